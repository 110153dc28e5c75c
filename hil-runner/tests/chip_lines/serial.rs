//! The line over a serial port, with a pseudo-terminal in the board's place.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use hil_runner::chip::line::Line;
use hil_runner::chip::line::SerialLine;
use hil_runner::chip::spec::ChipLink;
use serialport::{SerialPort, TTYPort};

const LIMIT: Duration = Duration::from_secs(5);

/// A board's end of a port, and the port's name.
fn board() -> (TTYPort, String) {
    let (mut board, port) = TTYPort::pair().unwrap();
    board.set_timeout(LIMIT).unwrap();
    let path = port.name().unwrap();
    (board, path)
}

#[test]
fn bytes_go_there_and_back() {
    let (mut board, path) = board();
    let mut line = SerialLine::open(&path, 115_200).unwrap();
    let mut buffer = [0; 64];
    // What a terminal would take for itself: end, line ends, stop, delete.
    let sent = [0, 3, 4, 10, 13, 17, 19, 26, 28, 127, 0xff];
    line.send(&sent).unwrap();
    board.read_exact(&mut buffer[..sent.len()]).unwrap();
    assert_eq!(buffer[..sent.len()], sent);
    board.write_all(&sent).unwrap();
    let mut count = 0;
    while count < sent.len() {
        count += line.receive(&mut buffer[count..], LIMIT).unwrap();
    }
    assert_eq!(buffer[..count], sent);
}

#[test]
fn silence_ends_at_the_time_out() {
    let (_board, path) = board();
    let mut line = SerialLine::open(&path, 115_200).unwrap();
    let start = Instant::now();
    assert_eq!(
        line.receive(&mut [0; 8], Duration::from_millis(20))
            .unwrap(),
        0
    );
    assert!(start.elapsed() >= Duration::from_millis(20));
    assert!(start.elapsed() < LIMIT);
}

#[test]
fn board_that_is_unplugged_is_told() {
    let (board, path) = board();
    let mut line = SerialLine::open(&path, 115_200).unwrap();
    drop(board);
    let start = Instant::now();
    let told = line.receive(&mut [0; 8], LIMIT).unwrap_err().to_string();
    let words = format!("the serial port {path} is gone: ");
    assert!(told.starts_with(&words), "{told}");
    assert!(line.send(b"anyone?").is_err());
    assert!(start.elapsed() < LIMIT / 2);
}

#[test]
fn board_that_does_not_read_stops_nobody() {
    let (_board, path) = board();
    let mut line = SerialLine::open(&path, 115_200).unwrap();
    let start = Instant::now();
    // Far more than the system keeps; then a frame is lost after the patience.
    while start.elapsed() < Duration::from_millis(500) {
        line.send(&[0x55; 198]).unwrap();
    }
    assert!(start.elapsed() < Duration::from_millis(500) + 5 * line.patience());
    drop(line);
    assert!(start.elapsed() < LIMIT);
}

#[test]
fn patience_is_that_of_the_speed() {
    let (_board, path) = board();
    let patience = |baud| SerialLine::open(&path, baud).unwrap().patience();
    // Two largest frames of 198 bytes at 10 bits each.
    assert!(patience(9600) > Duration::from_millis(50 + 412));
    assert!(patience(9600) < Duration::from_millis(50 + 413));
    assert!(patience(921_600) < Duration::from_millis(55));
}

#[test]
fn port_that_is_not_there_is_told_by_name() {
    let link: ChipLink = "serial:/dev/no-such-port@9600".parse().unwrap();
    let error = hil_runner::chip::open(&link, &mut |_| {}).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the serial port /dev/no-such-port cannot be opened: No such file or directory"
    );
    // A file that is no port.
    let error = SerialLine::open("/dev/null", 115_200)
        .unwrap_err()
        .to_string();
    let words = "the serial port /dev/null cannot be opened: ";
    assert!(error.starts_with(words), "{error}");
}

#[test]
fn port_in_use_is_told() {
    let (_board, path) = board();
    let _line = SerialLine::open(&path, 115_200).unwrap();
    let error = SerialLine::open(&path, 115_200).unwrap_err().to_string();
    let words = format!("the serial port {path} cannot be opened: ");
    assert!(error.starts_with(&words), "{error}");
}
