//! `hil-runner certify` as a script sees it, with a board that is a thread at
//! the other end of a pseudo-terminal.

use std::io::{Read, Write};
use std::process::{Command, Output};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use firmware_link::Reply;
use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, encode};
use hil_runner::chip::line::Line;
use serialport::{SerialPort, TTYPort};

use crate::loopback::Loopback;

const PAGE: &str = include_str!("../../../docs/CHIP.md");

/// A board whose step number `wrong` has a code that is 1 too large.
struct Board {
    port: String,
    thread: JoinHandle<()>,
    end: Arc<AtomicBool>,
}

impl Board {
    fn start(wrong: Option<u32>) -> Self {
        let (mut board, port) = TTYPort::pair().unwrap();
        board.set_timeout(Duration::from_millis(20)).unwrap();
        let name = port.name().unwrap();
        let end = Arc::new(AtomicBool::new(false));
        let ends = end.clone();
        let thread = std::thread::spawn(move || {
            let mut chip = WrongChip::new(wrong);
            let mut buffer = [0; 256];
            while !ends.load(Ordering::Relaxed) {
                // Nothing for a while.
                let Ok(count) = board.read(&mut buffer) else {
                    continue;
                };
                let replies = chip.answer(&buffer[..count]);
                board.write_all(&replies).unwrap();
            }
            // The program's end of the port was open as long as this one.
            drop(port);
        });
        Self {
            port: name,
            thread,
            end,
        }
    }

    fn certify(self, args: &[&str]) -> Output {
        let output = certify(&[args, &["--link", &format!("serial:{}", self.port)]].concat());
        self.end.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
        output
    }
}

struct WrongChip {
    chip: Loopback,
    receiver: Receiver,
    wrong: Option<u32>,
    /// Session and number of the last step, and how many there were; one that
    /// is asked for again counts once.
    last: (u16, u32),
    steps: u32,
}

impl WrongChip {
    fn new(wrong: Option<u32>) -> Self {
        Self {
            chip: Loopback::new(),
            receiver: Receiver::new(),
            wrong,
            last: (0, 0),
            steps: 0,
        }
    }

    fn answer(&mut self, requests: &[u8]) -> Vec<u8> {
        self.chip.send(requests).unwrap();
        let mut bytes = [0; 1024];
        let count = self.chip.receive(&mut bytes, Duration::ZERO).unwrap();
        let mut frames = Vec::new();
        for byte in &bytes[..count] {
            let Some(Received::Body(body)) = self.receiver.take(*byte) else {
                continue;
            };
            let (header, mut reply) = Reply::read(body).unwrap();
            if let Reply::Stepped(stepped) = &mut reply {
                let this = (header.session, header.number);
                self.steps += u32::from(this != self.last);
                self.last = this;
                stepped.code += i32::from(Some(self.steps - 1) == self.wrong);
            }
            let body = reply.body(header.session, header.number).unwrap();
            frames.extend(encode::<LARGEST_FRAME>(&body).unwrap());
        }
        frames
    }
}

fn certify(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .arg("certify")
        .args(args)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn the_same_bits_on_a_board() {
    let output = Board::start(None).certify(&["paper-1", "paper-2", "paper-3", "paper-4"]);
    let table = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let lines: Vec<&str> = table.lines().collect();
    let line = |name: &str| {
        let line = lines.iter().find(|line| line.starts_with(name)).unwrap();
        line.split_whitespace().collect::<Vec<_>>()
    };
    let (host, board) = (line("host"), line("serial:"));
    // Trace hash, cases, steps, and behind the verdict files and rows.
    assert_eq!(host[2..5], board[2..5], "{table}");
    assert_eq!(host[3..5], ["4", "6004"], "{table}");
    assert_eq!(board[5], "same", "{table}");
    assert_eq!(host[5..7], board[6..8], "{table}");
    assert_eq!(board[8], "same", "{table}");
    for line in &lines {
        assert!(line.chars().count() <= 100, "{line}");
    }
    // The page shows what is printed.
    let shown = PAGE.lines().find(|line| line.starts_with("host "));
    let shown: Vec<&str> = shown.unwrap().split_whitespace().collect();
    assert_eq!(shown, host);
}

/// The contrast: one code of one step.
#[test]
fn another_code_on_a_board_is_told_and_fails() {
    // Behind the steps of the first case.
    let wrong = 1_501 + 512;
    let output = Board::start(Some(wrong)).certify(&["paper-1", "paper-2"]);
    let table = text(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let sentence = "differs at step 512 (0.512 s) of paper-2: code 5462 on the chip, 5461 here\n";
    assert!(
        table.contains(sentence) && PAGE.contains(sentence),
        "{table}"
    );
    assert!(table.contains(" differs "), "{table}");
    // The vectors are replayed all the same.
    assert!(table.lines().any(|line| line.ends_with(" same")), "{table}");
}

/// The same in JSON: the difference in its words, and none where there is none.
#[test]
fn certificates_in_json_have_the_difference() {
    let output = Board::start(Some(512)).certify(&["paper-2", "--json"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let targets: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let (host, board) = (&targets[0], &targets[1]);
    assert_eq!(
        (&host["target"], &host["cases"]["steps"]),
        (&"host".into(), &1501.into())
    );
    assert!(host["cases"]["difference"].is_null() && board["vectors"]["difference"].is_null());
    let difference = board["cases"]["difference"].as_str().unwrap();
    assert!(
        difference.starts_with("differs at step 512 (0.512 s) of paper-2: "),
        "{difference}"
    );
    assert_eq!(host["vectors"], board["vectors"]);
    assert_ne!(host["trace_hash"], board["trace_hash"]);
}
