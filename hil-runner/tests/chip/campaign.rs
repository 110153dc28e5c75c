//! Bad lines by the thousand: no wrong code is ever applied.

use hil_runner::chip::client::Client;

use crate::loopback::Loopback;
use crate::noise::{Done, Noisy};
use crate::same_codes::{CASES, case, on_chip, on_host};

/// Every run ends, and ends with the host's rows.
#[test]
fn a_bad_line_changes_no_code() {
    let mut total = Done::default();
    let mut noticed = hil_runner::chip::client::Noticed::default();
    let mut runs = 0;
    for (seed, (name, sets)) in (1..).zip(CASES) {
        let case = case(name, sets);
        let (host, _) = on_host(&case);
        for one_of in [50, 7] {
            let line = Noisy::new(Loopback::new(), seed, one_of);
            let done = line.done.clone();
            let mut client = Client::greet(Box::new(line)).unwrap();
            let (chip, _) = on_chip(&case, &mut client).unwrap();
            assert!(chip == host, "{name} {sets:?}, one of {one_of}");
            let done = *done.lock().unwrap();
            total.pieces += done.pieces;
            total.damaged += done.damaged;
            total.cut += done.cut;
            total.dropped += done.dropped;
            total.doubled += done.doubled;
            total.delayed += done.delayed;
            noticed.answered += client.noticed().answered;
            noticed.repeated += client.noticed().repeated;
            noticed.damaged += client.noticed().damaged;
            noticed.stray += client.noticed().stray;
            runs += 1;
        }
    }
    println!("{runs} runs over bad lines, no code differs; {total:?}; {noticed:?}");
    assert!(total.faults() > 3_000, "{total:?}");
    // The contrast: the line was bad enough to be noticed.
    assert!(noticed.repeated > 1_000, "{noticed:?}");
    assert!(noticed.damaged > 500, "{noticed:?}");
}

/// A chip that loses its memory in mid-move ends the run with a sentence.
#[test]
fn a_restart_in_mid_move_is_noticed() {
    use hil_runner::chip::ChipError;
    use hil_runner::chip::line::Line;
    use std::time::Duration;

    #[derive(Debug)]
    struct Restarting {
        chip: Loopback,
        frames: u32,
    }
    impl Line for Restarting {
        fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
            self.frames += 1;
            if self.frames == 700 {
                self.chip.restart();
            }
            self.chip.send(bytes)
        }
        fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError> {
            self.chip.receive(buffer, timeout)
        }
        fn patience(&self) -> Duration {
            Duration::ZERO
        }
    }
    let line = Restarting {
        chip: Loopback::new(),
        frames: 0,
    };
    let mut client = Client::greet(Box::new(line)).unwrap();
    let error = on_chip(&case("paper-2", &[]), &mut client).unwrap_err();
    assert!(error.contains("restarted and lost its memory"), "{error}");
    assert!(error.contains("at sample"), "{error}");
    // It can be used again at once.
    assert!(on_chip(&case("paper-2", &[]), &mut client).is_ok());
}

/// A whole frame with a code that the converter does not have.
#[test]
fn a_code_out_of_range_is_not_applied() {
    use firmware_link::Reply;
    use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, encode};
    use hil_runner::chip::ChipError;
    use hil_runner::chip::line::Line;
    use std::time::Duration;

    #[derive(Debug)]
    struct Wild(Loopback, i32);
    impl Line for Wild {
        fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
            self.0.send(bytes)
        }
        fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError> {
            let count = self.0.receive(buffer, timeout)?;
            let mut receiver = Receiver::new();
            for byte in &buffer[..count] {
                let Some(Received::Body(body)) = receiver.take(*byte) else {
                    continue;
                };
                let Some((header, Reply::Stepped(mut stepped))) = Reply::read(body) else {
                    continue;
                };
                if header.number > 600 {
                    stepped.code = self.1;
                }
                let body = Reply::Stepped(stepped).body(header.session, header.number);
                let frame = encode::<LARGEST_FRAME>(&body.unwrap()).unwrap();
                buffer[..frame.len()].copy_from_slice(&frame);
                return Ok(frame.len());
            }
            Ok(count)
        }
        fn patience(&self) -> Duration {
            Duration::ZERO
        }
    }
    let run = |code| {
        let line = Wild(Loopback::new(), code);
        let mut client = Client::greet(Box::new(line)).unwrap();
        on_chip(&case("paper-2", &[]), &mut client)
    };
    let error = run(8_192).unwrap_err();
    let sentence = "answers code 8192; the converter has -8192 to 8191";
    assert!(error.contains(sentence), "{error}");
    // The contrast: the largest code is one of the converter's.
    assert!(run(8_191).is_ok());
}
