//! The session that the page shows, replayed into a server.

use firmware::axis::{Axis, Inputs};
use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{CounterParameters, Dac, Event, GainWord, Next, SetpointTable, Settings};
use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, crc32_on, encode};
use firmware_link::{Events, Identity, Request, Server, SourceKind, Step, Target, settings};

use crate::dump::described;
use crate::{PAGE, section};

const HEADING: &str = "## A session, byte by byte";

/// A target in memory whose clock stands still.
struct Fixed;

impl Target for Fixed {
    fn identity(&self) -> Identity {
        Identity {
            version: firmware_link::body::VERSION,
            target: *b"memory\0\0",
            image_crc: 0x1234_abcd,
            flash_bytes: 17_736,
            ram_bytes: 1_924,
            table_capacity: 16,
            timer_hz: 25_000_000,
        }
    }
    fn start(&mut self) {}
    fn elapsed(&mut self) -> u32 {
        320
    }
    fn stack_bytes(&self) -> u32 {
        2_512
    }
}

/// The page up to the dump, the dump, and what follows it.
fn parted(page: &str) -> [&str; 3] {
    let session = section(page, HEADING);
    let (_, rest) = session.split_once("```text\n").unwrap();
    let (dump, _) = rest.split_once("```").unwrap();
    let start = page.len() - page.split_once(session).unwrap().1.len() - rest.len();
    let (before, rest) = page.split_at(start);
    [before, dump, &rest[dump.len()..]]
}

/// The frames of the host in a dump, each with its title. What goes over the line is
/// read, and nothing else.
fn of_host(dump: &str) -> Result<Vec<(String, Vec<u8>)>, String> {
    let mut frames: Vec<(String, Vec<u8>)> = Vec::new();
    for line in dump.lines() {
        if let Some(bytes) = line.strip_prefix("line ") {
            let (_, frame) = frames.last_mut().ok_or("bytes before the first frame")?;
            for byte in bytes.split_whitespace() {
                frame.push(u8::from_str_radix(byte, 16).map_err(|error| error.to_string())?);
            }
        } else if line.starts_with("host: ") || line.starts_with("chip: ") {
            frames.push((line.to_owned(), Vec::new()));
        }
    }
    frames.retain(|(title, _)| title.starts_with("host: "));
    Ok(frames)
}

/// The dump of a session with these frames of the host: what a server answers.
fn replayed(frames: &[(String, Vec<u8>)]) -> Result<String, String> {
    let mut table = SetpointTable::<16>::resting_at(0);
    let mut server = Server::START;
    let mut receivers = [Receiver::new(), Receiver::new()];
    let mut dump = Vec::new();
    for (title, line) in frames {
        let mut answers = 0;
        for byte in line {
            let [of_host, of_chip] = &mut receivers;
            if let Some(received) = of_host.take(*byte) {
                let Received::Body(body) = received else {
                    return Err(format!("{title}: damaged"));
                };
                dump.push(described(title, body, line));
            }
            let answered = server.take(*byte, &mut table, &mut Fixed);
            for byte in answered {
                if let Some(received) = of_chip.take(*byte) {
                    let Received::Body(answer) = received else {
                        return Err(format!("{title}: its answer is damaged"));
                    };
                    dump.push(described("chip: answers", answer, answered));
                    answers += 1;
                }
            }
        }
        if answers != 1 {
            return Err(format!("{title}: {answers} frames"));
        }
    }
    Ok(dump.join("\n"))
}

fn axis() -> Axis {
    let dac = Dac::with_bits(12).unwrap();
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let output = Output::new(dac, None, Quantiser::Nearest).unwrap();
    let mut axis = Axis::new(Law::accept(words, dac).unwrap(), output);
    axis.counter = CounterParameters::accept(16, Some(500)).unwrap();
    axis
}

fn events(events: &[Event]) -> Events {
    let mut set = Events::default();
    events.iter().for_each(|event| set.insert(*event));
    set
}

/// What the page shows: titles, numbers and requests.
fn session() -> Vec<(String, Vec<u8>)> {
    let settings = settings::write(&Settings::of(&axis())).unwrap();
    let setpoints: Vec<u8> = [0_i32, 100, 250, -3]
        .into_iter()
        .flat_map(i32::to_le_bytes)
        .collect();
    let parts = [Request::Settings(&settings), Request::Memory(&setpoints)];
    let configuration = parts.iter().zip([&settings[..], &setpoints]);
    let configuration = configuration.fold(0, |crc, (part, payload)| {
        crc32_on(crc32_on(crc, &[part.kind()]), payload)
    });
    let begin = Request::Begin {
        configuration,
        source: SourceKind::Table,
        events: events(&[Event::Enable, Event::Start]),
    };
    let step = |tick, motor_register, stop, asked: &[Event]| {
        Request::Step(Step {
            events: events(asked),
            inputs: Inputs {
                tick,
                motor_register,
                emergency_stop: stop,
                ..Inputs::default()
            },
            motor_unread: false,
            next: Next::Underrun,
        })
    };
    let requests = [
        ("HELLO: a new session", 0, Request::Hello),
        (
            "SETTINGS: 2 codes per count, 12 bits, a counter of 16",
            1,
            parts[0],
        ),
        ("MEMORY: a table of four setpoints", 2, parts[1]),
        ("BEGIN: enabled and started at once", 3, begin),
        (
            "STEP, sample 0: the register defines the position",
            4,
            step(0, 0, false, &[]),
        ),
        ("STEP, sample 1", 5, step(1, 90, false, &[])),
        (
            "STEP, sample 1 once more: answered from memory",
            5,
            step(1, 90, false, &[]),
        ),
        (
            "STEP, too early: number 6 is expected",
            7,
            step(1, 180, false, &[]),
        ),
        ("STEP, sample 2", 6, step(2, 180, false, &[])),
        (
            "STEP, sample 3: the emergency stop is pressed",
            7,
            step(3, 0xfffe, true, &[]),
        ),
        (
            "STEP, sample 4: reset, and a start that is refused",
            8,
            step(4, 0xfffd, false, &[Event::Reset, Event::Start]),
        ),
        (
            "STEP, sample 7: its tick comes along",
            9,
            step(7, 0xfffd, false, &[Event::Enable]),
        ),
        (
            "STATUS: with the number of the last request",
            9,
            Request::Status,
        ),
    ];
    let frames = requests.into_iter().map(|(title, number, request)| {
        let last_tick = match request {
            // This tick is said, the others follow.
            Request::Step(step) if number != 9 => step.inputs.tick.wrapping_sub(1),
            _ => u64::MAX,
        };
        let body = request.body(0x1f2e, number, last_tick).unwrap();
        let line = encode::<LARGEST_FRAME>(&body).unwrap().to_vec();
        (format!("host: {title}"), line)
    });
    frames.collect()
}

/// `BLESS=1` writes the session of this file into the page.
#[test]
fn the_session_is_the_servers() {
    let [before, now, after] = parted(PAGE);
    if std::env::var_os("BLESS").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/LINE.md");
        let blessed = replayed(&session()).unwrap();
        std::fs::write(path, format!("{before}{blessed}{after}")).unwrap();
        return;
    }
    let frames = of_host(now).unwrap();
    assert_eq!(frames.len(), 13);
    assert_eq!(replayed(&frames).unwrap(), now);
}

/// The contrast: another byte anywhere, of a field, of a CRC or on the line, of
/// either side, is found.
#[test]
fn another_byte_in_the_page_is_found() {
    let [_, dump, _] = parted(PAGE);
    let mut bytes = 0;
    let mut start = 0;
    for line in dump.split_inclusive('\n') {
        // Behind the place, as far as the words.
        let (from, to) = if line.starts_with("line ") {
            (7, line.len())
        } else {
            (7, line.len().min(30))
        };
        if line.starts_with("line ") || line.starts_with("  ") {
            for at in (from..to).step_by(3) {
                let Some(byte) = line.get(at..at + 2).filter(|byte| !byte.trim().is_empty()) else {
                    break;
                };
                let other = u8::from_str_radix(byte, 16).unwrap() ^ 0x10;
                let mut changed = dump.to_owned();
                changed.replace_range(start + at..start + at + 2, &format!("{other:02x}"));
                let found = of_host(&changed).and_then(|frames| replayed(&frames));
                assert_ne!(found, Ok(changed), "{line}");
                bytes += 1;
            }
        }
        start += line.len();
    }
    println!("{bytes} bytes");
    assert!(bytes > 1_000, "{bytes}");
}
