//! docs/line_client.py, a host that was made from docs/LINE.md alone: it moves an
//! axis over a bad line and on a chip in QEMU, and every sample is the host's.

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use firmware::axis::{AxisState, Inputs};
use firmware::reference::TableSource;
use firmware::{CAPACITY, Event, SetpointTable, Settings};
use hil_runner::chip::guard::Guarded;
use hil_runner::chip::image::Finder;
use hil_runner::chip::line::Line;
use hil_runner::chip::qemu;
use hil_runner::chip::spec::{Target, Transport};
use rustix::fs::{Mode, OFlags};
use serialport::{SerialPort, TTYPort};

use crate::loopback::Loopback;
use crate::noise::Noisy;
use crate::targets::{left_out, targets};

/// Time for a session; one takes a second.
const LIMIT: Duration = Duration::from_secs(60);

fn docs() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs"))
}

/// True if there is Python for the client; that it is missing is told.
fn python_is_here(test: &str) -> bool {
    let script = "import sys, termios; sys.exit(sys.version_info < (3, 9))";
    let asked = Command::new("python3").args(["-c", script]).status();
    let here = asked.is_ok_and(|status| status.success());
    if !here {
        left_out(test, "python3 is missing, or older than 3.9");
    }
    here
}

/// Runs Python in the folder of the client; one that takes too long is ended.
fn run(args: &[&str]) -> Output {
    let mut child = Command::new("python3")
        .args(args)
        .current_dir(docs())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    // What it says is less than a pipe holds.
    while child.try_wait().unwrap().is_none() && start.elapsed() < LIMIT {
        std::thread::sleep(Duration::from_millis(5));
    }
    // Of one that has ended this says so.
    let _ = child.kill();
    child.wait_with_output().unwrap()
}

fn said(output: Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Settings of the client with a change, and its table.
fn axis_of_client(change: &str) -> (Settings, Vec<i32>) {
    let script = format!(
        "import line_client as c\n{change}\nprint(*c.SETTINGS)\nprint(*c.SETTINGS.values())\n\
         print(*c.TABLE)"
    );
    let text = said(run(&["-c", &script]));
    let [names, words, table] = text.lines().collect::<Vec<_>>()[..] else {
        panic!("{text}")
    };
    assert_eq!(names.split(' ').collect::<Vec<_>>(), Settings::NAMES);
    let words: Vec<u32> = words.split(' ').map(|word| word.parse().unwrap()).collect();
    let table = table.split(' ').map(|word| word.parse().unwrap()).collect();
    (Settings::from_words(words.try_into().unwrap()), table)
}

/// The samples of a session in the client's words, and those of the host's axis
/// for the same registers.
fn samples(text: &str, settings: &Settings, table: &[i32]) -> [String; 2] {
    let samples = text.lines().filter(|line| !line.starts_with('#'));
    let mut axis = AxisState::start_with(settings).unwrap();
    axis.request(Event::Enable).unwrap();
    axis.request(Event::Start).unwrap();
    let table = SetpointTable::<CAPACITY>::from_counts(table).unwrap();
    let mut source = TableSource::new(&table);
    let (mut chip, mut host) = (String::new(), String::new());
    for line in samples {
        let mut words = line.split(' ');
        let mut number = || words.next().unwrap().parse::<u32>().unwrap();
        let (k, motor_register) = (number(), number());
        if k == 199 {
            axis.request(Event::Disable).unwrap();
        }
        let inputs = Inputs {
            tick: k.into(),
            motor_register,
            ..Inputs::default()
        };
        let output = axis.tick(&inputs, &mut source);
        let (code, error, state) = (output.code, output.error_counts, output.state.name());
        write!(host, "{k} {motor_register} {code} {error} {state}").unwrap();
        if let Some(fault) = axis.fault() {
            let (cause, tick, values) = (fault.cause.name(), fault.tick, fault.values);
            let (measured, limit) = (values.measured, values.limit);
            write!(
                host,
                " {cause} tick {tick} measured {measured} limit {limit}"
            )
            .unwrap();
        }
        host.push('\n');
        chip.push_str(line);
        chip.push('\n');
    }
    [chip, host]
}

/// A session of the client as it is; the states that it went through.
fn whole_session(port: &str) -> String {
    let text = said(run(&["line_client.py", port]));
    let (settings, table) = axis_of_client("");
    let [chip, host] = samples(&text, &settings, &table);
    assert_eq!(chip, host);
    assert_eq!(chip.lines().count(), 200);
    for (state, times) in [("moving", 100), ("holding", 99), ("disabled", 1)] {
        let there = |line: &&str| line.ends_with(&format!(" {state}"));
        assert_eq!(chip.lines().filter(there).count(), times, "{state}");
    }
    // The contrast: a gain that is larger by a thousandth.
    let other = Settings {
        kp_mantissa: settings.kp_mantissa + settings.kp_mantissa / 1_000,
        ..settings
    };
    let [chip, host] = samples(&text, &other, &table);
    assert_ne!(chip, host);
    text
}

/// A chip in memory whose line damages, loses, doubles and delays.
#[test]
fn a_client_from_the_page_stands_a_bad_line() {
    if !python_is_here("the client over a bad line") {
        return;
    }
    let (mut board, port) = TTYPort::pair().unwrap();
    board.set_timeout(Duration::from_millis(5)).unwrap();
    let name = port.name().unwrap();
    let end = Arc::new(AtomicBool::new(false));
    let ends = end.clone();
    let thread = std::thread::spawn(move || {
        let mut line = Noisy::new(Loopback::new(), 3, 40);
        let mut buffer = [0; 256];
        while !ends.load(Ordering::Relaxed) {
            // Nothing for a while.
            let Ok(count) = board.read(&mut buffer) else {
                continue;
            };
            line.send(&buffer[..count]).unwrap();
            let count = line.receive(&mut buffer, Duration::ZERO).unwrap();
            board.write_all(&buffer[..count]).unwrap();
        }
        drop(port);
        *line.done.lock().unwrap()
    });
    let text = whole_session(&name);
    end.store(true, Ordering::Relaxed);
    let done = thread.join().unwrap();
    println!("{done:?}; {}", text.lines().last().unwrap());
    assert!(done.faults() > 0, "{done:?}");
}

/// QEMU with the image behind a UART, and its pseudo-terminal.
fn chip_at_a_terminal() -> (Guarded, String) {
    let tell = &mut |line: &str| eprintln!("{line}");
    let image = Finder::from_environment().image(Target::M4, Transport::Uart.image(), tell);
    let mut process = qemu::start(Target::M4, Transport::Uart, &image.unwrap()).unwrap();
    let start = Instant::now();
    loop {
        let said = process.said().split_once("redirected to ");
        if let Some((port, _)) = said.and_then(|(_, port)| port.split_once(' ')) {
            let port = port.to_owned();
            return (process, port);
        }
        assert_eq!(process.ended(), None);
        assert!(start.elapsed() < LIMIT, "no pseudo-terminal");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_client_from_the_page_moves_an_axis_on_a_chip() {
    let test = "the client on m4";
    if !python_is_here(test) || !targets(test, Transport::Uart).contains(&Target::M4) {
        return;
    }
    let (_process, port) = chip_at_a_terminal();
    // QEMU looks only every second whether somebody has opened it.
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let _open = rustix::fs::open(port.as_str(), flags, Mode::empty()).unwrap();
    let text = whole_session(&port);
    assert!(text.starts_with("# m4, image "), "{text}");
    assert!(text.contains("\n# 200 samples, "), "{text}");

    // A limit that the motion leaves: the fault's record is the host's too.
    let change = "c.SETTINGS['following_error_counts'] = 60";
    let with = |change: &str| {
        let script = format!("import line_client as c\n{change}\nc.main('{port}')");
        run(&["-c", &script])
    };
    let text = said(with(change));
    let (settings, table) = axis_of_client(change);
    let [chip, host] = samples(&text, &settings, &table);
    assert_eq!(chip, host);
    let last = chip.lines().last().unwrap();
    assert!(last.contains(" 0 63 fault following-error tick "), "{last}");

    // Refusals have the page's words.
    for (change, sentence) in [
        (
            "c.SETTINGS['dac_bits'] = 25",
            "the chip refuses request 1: it refuses the word dac_bits of the settings\n",
        ),
        (
            "c.DISABLE = c.START = 0; c.ENABLE = 2",
            "the chip refuses request 5: there is no such request, or not now\n",
        ),
    ] {
        let output = with(change);
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        assert_eq!(String::from_utf8(output.stderr).unwrap(), sentence);
    }
}
