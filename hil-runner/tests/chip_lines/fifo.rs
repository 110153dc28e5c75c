//! The line over FIFOs, with a shell in QEMU's place.

use std::time::{Duration, Instant};

use hil_runner::chip::line::Line;
use hil_runner::chip::qemu::FifoLine;

use crate::guard::shell;
use crate::support::{processes_in, signal, within};

const LIMIT: Duration = Duration::from_secs(5);

/// Opens both ends in the order of the firmware, then does `then`.
fn fake(then: &str) -> FifoLine {
    let process = shell(&format!("exec 5<to-chip 6>from-chip; {then}"));
    FifoLine::open(process, LIMIT).unwrap()
}

#[test]
fn bytes_go_there_and_back() {
    let mut line = fake("exec cat <&5 >&6");
    let mut buffer = [0; 64];
    for round in 0..200_u8 {
        let sent = [round, 0, 0xff, b'\n', 0x1a, round];
        line.send(&sent).unwrap();
        let count = line.receive(&mut buffer, LIMIT).unwrap();
        assert_eq!(buffer[..count], sent);
    }
    // And nothing else.
    assert_eq!(line.receive(&mut buffer, Duration::ZERO).unwrap(), 0);
}

#[test]
fn silence_ends_at_the_time_out() {
    let mut line = fake("exec sleep 1000");
    let start = Instant::now();
    let timeout = Duration::from_millis(20);
    assert_eq!(line.receive(&mut [0; 8], timeout).unwrap(), 0);
    assert!(start.elapsed() >= timeout);
}

#[test]
fn end_of_the_other_side_is_told_at_once() {
    for (how, told) in [
        ("read -r _ <&5; exit 7", "the fake has ended with status 7"),
        (
            "read -r _ <&5; kill -9 $$",
            "the fake has ended with signal 9",
        ),
    ] {
        let mut line = fake(how);
        line.send(b"go\n").unwrap();
        let start = Instant::now();
        let error = line.receive(&mut [0; 8], LIMIT).unwrap_err();
        assert_eq!(error.to_string(), told);
        assert!(start.elapsed() < LIMIT / 2, "{:?}", start.elapsed());
        // As often as one asks, in either direction.
        assert_eq!(line.send(b"more").unwrap_err().to_string(), told);
        let found = line.receive(&mut [0; 8], LIMIT).unwrap_err().to_string();
        assert_eq!(found, told);
    }
}

#[test]
fn what_was_said_before_the_end_is_read() {
    let mut line = fake("echo last words >&6; exit 0");
    let mut buffer = [0; 64];
    let count = line.receive(&mut buffer, LIMIT).unwrap();
    assert_eq!(&buffer[..count], b"last words\n");
    assert!(line.receive(&mut buffer, LIMIT).is_err());
}

#[test]
fn side_that_only_closes_its_line_is_told() {
    let mut line = fake("exec 6>&-; exec sleep 1000");
    let error = line.receive(&mut [0; 8], LIMIT).unwrap_err();
    assert_eq!(error.to_string(), "the fake has closed its end of the line");
}

#[test]
fn side_that_does_not_read_stops_nobody() {
    let mut line = fake("exec sleep 1000");
    // Three times what a FIFO holds.
    for _ in 0..1000 {
        line.send(&[0x55; 198]).unwrap();
    }
}

#[test]
fn line_that_is_not_opened_is_not_waited_for() {
    let process = shell("exec sleep 1000");
    let folder = process.folder().to_path_buf();
    let start = Instant::now();
    let error = FifoLine::open(process, Duration::from_millis(100)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the fake runs, but its image has not opened the line within 0.1 s"
    );
    assert!(start.elapsed() < LIMIT);
    assert!(!folder.exists() && processes_in(&folder).is_empty());
}

#[test]
fn process_that_ends_before_the_line_is_open_says_why() {
    let process = shell("echo could not load the image; exit 1");
    let error = FifoLine::open(process, LIMIT).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the fake could not be started: the fake has ended with status 1; \
         it said: could not load the image"
    );
}

#[test]
fn nothing_is_left_of_a_line() {
    let process = shell("exec 5<to-chip 6>from-chip; exec sleep 1000");
    let folder = process.folder().to_path_buf();
    let line = FifoLine::open(process, LIMIT).unwrap();
    assert!(within(LIMIT, || processes_in(&folder).len() >= 3));
    drop(line);
    assert!(!folder.exists() && processes_in(&folder).is_empty());
}

#[test]
fn stopped_side_is_silent_and_goes_on() {
    let mut line = fake("echo $$ >&6; exec cat <&5 >&6");
    let mut buffer = [0; 64];
    let count = line.receive(&mut buffer, LIMIT).unwrap();
    let process = str::from_utf8(&buffer[..count]).unwrap().trim().to_owned();
    signal("STOP", &process);
    line.send(b"anyone?").unwrap();
    assert_eq!(
        line.receive(&mut buffer, Duration::from_millis(20))
            .unwrap(),
        0
    );
    signal("CONT", &process);
    let count = line.receive(&mut buffer, LIMIT).unwrap();
    assert_eq!(&buffer[..count], b"anyone?");
}
