//! The firmware's images in QEMU, over either transport.

use std::time::{Duration, Instant};

use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, encode};
use firmware_link::{Identity, Reply, Request};
use hil_runner::chip::ChipError;
use hil_runner::chip::guard::Guarded;
use hil_runner::chip::image::{Finder, crc32};
use hil_runner::chip::line::Line;
use hil_runner::chip::qemu::{self, FifoLine, PtyLine};
use hil_runner::chip::spec::{ChipLink, Target, Transport};

use crate::support::{processes_in, signal, within};
use crate::targets::targets;

const LIMIT: Duration = Duration::from_secs(10);

/// Asks until there is an answer; the n-th asking has number n.
fn hello(line: &mut dyn Line) -> Result<Identity, ChipError> {
    let start = Instant::now();
    let body = Request::Hello.body(7, 0, u64::MAX).unwrap();
    let frame = encode::<LARGEST_FRAME>(&body).unwrap();
    let mut receiver = Receiver::new();
    let mut buffer = [0; 256];
    loop {
        assert!(start.elapsed() < LIMIT, "no answer");
        line.send(&frame)?;
        let patience = line.patience();
        loop {
            let count = line.receive(&mut buffer, patience)?;
            if count == 0 {
                break;
            }
            for &byte in &buffer[..count] {
                let Some(Received::Body(body)) = receiver.take(byte) else {
                    continue;
                };
                if let Some((_, Reply::Hello(identity))) = Reply::read(body) {
                    return Ok(identity);
                }
            }
        }
    }
}

fn tell(line: &str) {
    eprintln!("{line}");
}

/// QEMU with an image, and what it is called when it has ended.
fn start(target: Target, transport: Transport) -> Guarded {
    let finder = Finder::from_environment();
    let image = finder.image(target, transport.image(), &mut tell).unwrap();
    qemu::start(target, transport, &image).unwrap()
}

fn open(process: Guarded, transport: Transport) -> Box<dyn Line> {
    match transport {
        Transport::Fifo => Box::new(FifoLine::open(process, LIMIT).unwrap()),
        Transport::Uart => Box::new(PtyLine::open(process, LIMIT).unwrap()),
    }
}

const TRANSPORTS: [Transport; 2] = [Transport::Fifo, Transport::Uart];

#[test]
fn every_target_answers_and_has_the_image_that_it_was_given() {
    for transport in TRANSPORTS {
        for target in targets("an image's answer", transport) {
            let link = ChipLink::Qemu { target, transport };
            let mut opened = hil_runner::chip::open(&link, &mut tell).unwrap();
            let identity = hello(&mut *opened.line).unwrap();
            let name = identity.target.split(|&byte| byte == 0).next().unwrap();
            assert_eq!(name, target.name().as_bytes(), "{link}");
            let image_crc = opened.image_crc.unwrap();
            // Computed by the chip over its flash, and here over the file.
            assert_eq!(identity.image_crc, image_crc, "{link}");
            let other = match transport {
                Transport::Fifo => Transport::Uart,
                Transport::Uart => Transport::Fifo,
            };
            let other = Finder::from_environment().image(target, other.image(), &mut tell);
            assert_ne!(crc32(&other.unwrap()).unwrap(), image_crc, "{link}");
        }
    }
}

#[test]
fn qemu_that_is_killed_is_told_at_once_and_leaves_nothing() {
    for transport in TRANSPORTS {
        for target in targets("the death of QEMU", transport) {
            let process = start(target, transport);
            let folder = process.folder().to_path_buf();
            let mut line = open(process, transport);
            hello(&mut *line).unwrap();
            let qemu = |process: &&u32| {
                let name = std::fs::read_to_string(format!("/proc/{process}/comm"));
                name.is_ok_and(|name| name.starts_with("qemu"))
            };
            let processes = processes_in(&folder);
            signal("KILL", &processes.iter().find(qemu).unwrap().to_string());
            let killed = Instant::now();
            let error = loop {
                if let Err(error) = hello(&mut *line) {
                    break error.to_string();
                }
            };
            assert!(
                killed.elapsed() < Duration::from_secs(2),
                "{:?}",
                killed.elapsed()
            );
            assert!(error.starts_with("QEMU has ended with signal 9"), "{error}");
            // Before the line is dropped.
            assert!(within(LIMIT, || processes_in(&folder).is_empty()));
            assert!(!folder.exists());
        }
    }
}

#[test]
fn qemu_that_is_blocked_or_stopped_ends_with_its_line() {
    for transport in TRANSPORTS {
        for target in targets("the end of QEMU", transport) {
            let process = start(target, transport);
            let folder = process.folder().to_path_buf();
            let mut line = open(process, transport);
            hello(&mut *line).unwrap();
            for process in processes_in(&folder) {
                if std::fs::read_to_string(format!("/proc/{process}/comm"))
                    .is_ok_and(|name| name.starts_with("qemu"))
                {
                    signal("STOP", &process.to_string());
                }
            }
            // More than the line holds: sending does not wait for a chip that
            // does not read.
            let begin = Instant::now();
            for _ in 0..400 {
                line.send(&[0x55; 198]).unwrap();
                if begin.elapsed() > Duration::from_secs(1) {
                    break;
                }
            }
            assert!(begin.elapsed() < LIMIT / 2);
            drop(line);
            assert!(!folder.exists() && processes_in(&folder).is_empty());
        }
    }
}

#[test]
fn file_that_is_no_image_is_told_by_qemu() {
    for target in targets("a file that is no image", Transport::Fifo) {
        let folder = tempfile::tempdir().unwrap();
        let image = folder.path().join("none.elf");
        let process = qemu::start(target, Transport::Fifo, &image).unwrap();
        let error = FifoLine::open(process, LIMIT).unwrap_err();
        let sentence = error.to_string();
        assert!(
            sentence
                .starts_with("QEMU could not be started: QEMU has ended with status 1; it said:"),
            "{sentence}"
        );
        assert!(sentence.contains("none.elf"), "{sentence}");
    }
}
