//! The numbers of the page are those of the program.

use firmware::axis::Inputs;
use firmware::{Event, FaultCause, GainWord, Next, Setpoint, Settings, State, Stretch};
use firmware_link::frame::{LARGEST_BODY, LARGEST_FRAME, crc32};
use firmware_link::reply::LARGEST_REPLY;
use firmware_link::request::MOST_WORDS;
use firmware_link::{
    Events, Identity, Nak, Planned, Reply, Request, SourceKind, Status, Step, Stepped,
};

use crate::{PAGE, section};

/// The rows of the table that is headed by these cells, as cells without quotes.
fn rows(heading: &str) -> Vec<Vec<&'static str>> {
    let (_, rest) = PAGE
        .split_once(&format!("\n| {heading} |\n"))
        .unwrap_or_else(|| panic!("docs/LINE.md has no table {heading}"));
    let rows = rest
        .lines()
        .take_while(|line| line.starts_with('|'))
        .skip(1);
    let cells = |row: &'static str| {
        let cells = row.trim_matches('|').split('|');
        cells.map(|cell| cell.trim().trim_matches('`')).collect()
    };
    rows.map(cells).collect()
}

/// The first two cells of each row.
fn pairs(heading: &str) -> Vec<(String, String)> {
    let rows = rows(heading).into_iter();
    rows.map(|row| (row[0].to_owned(), row[1].to_owned()))
        .collect()
}

fn numbered(names: &[&str]) -> Vec<(String, String)> {
    let names = names.iter().enumerate();
    names
        .map(|(place, name)| (place.to_string(), (*name).to_owned()))
        .collect()
}

#[test]
fn the_settings() {
    let shown: Vec<Vec<String>> = rows("place | name | least | most | meaning")
        .into_iter()
        .map(|row| row[..4].iter().map(ToString::to_string).collect())
        .collect();
    let words = Settings::NAMES.iter().zip(Settings::RANGES).enumerate();
    let expected: Vec<Vec<String>> = words
        .map(|(place, (name, [least, most]))| {
            vec![
                place.to_string(),
                (*name).to_owned(),
                least.to_string(),
                most.to_string(),
            ]
        })
        .collect();
    for (shown, expected) in shown.iter().zip(&expected) {
        assert_eq!(shown, expected);
    }
    assert_eq!(shown.len(), expected.len());
    let words = Settings::WORDS;
    assert!(
        PAGE.contains(&format!("SETTINGS has {words} words")),
        "{words}"
    );
}

#[test]
fn states_causes_sources_and_refusals() {
    assert_eq!(
        pairs("number | state | powered"),
        numbered(&State::ALL.map(State::name))
    );
    let causes = pairs("number | cause | `measured` | `limit`");
    assert_eq!(causes, numbered(&FaultCause::ALL.map(FaultCause::name)));

    let source = |source| {
        let begin = Request::Begin {
            configuration: 0,
            source,
            events: Events::default(),
        };
        begin.body(0, 0, 0).unwrap()[12]
    };
    let sources = [
        SourceKind::Table,
        SourceKind::Plan,
        SourceKind::Step,
        SourceKind::Rates,
    ];
    assert_eq!(sources.map(source), [0, 1, 2, 3]);
    assert_eq!(
        pairs("number | source"),
        numbered(&["table", "plan", "step", "rates"])
    );

    let naks = [
        ("damaged", Nak::Damaged, 0),
        ("session", Nak::Session, 0),
        ("number", Nak::Number { expected: 9 }, 9),
        ("request", Nak::Request, 0),
        ("configuration", Nak::Configuration { here: 9 }, 9),
        ("settings", Nak::Settings { word: 9 }, 9),
        ("memory", Nak::Memory, 0),
        ("driving", Nak::Driving, 0),
        ("plan", Nak::Plan { stretch: 9 }, 9),
    ];
    for (place, (_, nak, value)) in naks.iter().enumerate() {
        let body = Reply::Nak(*nak).body(0, 0).unwrap();
        assert_eq!(usize::from(body[7]), place);
        assert_eq!(body[8..], [*value, 0, 0, 0]);
    }
    let names = naks.map(|(name, ..)| name);
    assert_eq!(pairs("cause | name | value | because"), numbered(&names));
}

const PLAN: Planned = Planned {
    travel: 1,
    intervals_ps: [2, 3, 4, 5, 6, 7, 8],
    period_ns: 9,
    start: 10,
    gains: [GainWord::new(11, 12); 3],
};

/// Every field of a PLAN is where the page says.
#[test]
fn the_fields_of_a_plan() {
    let body = Request::Plan(&PLAN).body(0, 0, 0).unwrap();
    assert!(PAGE.contains(&format!("A PLAN has {} bytes", body.len())));
    let (_, text) = PAGE.split_once("**PLAN** plans").unwrap();
    for (field, [offset, size], first) in [
        ("travel", [7, 8], 1),
        ("intervals", [15, 56], 2),
        ("period", [71, 4], 9),
        ("start", [75, 4], 10),
        ("gains", [79, 15], 11),
    ] {
        assert!(text.contains(&format!("\n| {offset} | {size} | {field} |")));
        assert_eq!(body[offset], first);
    }
    assert_eq!((body[15 + 48], body[83]), (8, 12));
}

#[test]
fn the_kinds() {
    let step = Request::Step(step(Next::Underrun));
    let begin = Request::Begin {
        configuration: 0,
        source: SourceKind::Step,
        events: Events::default(),
    };
    let requests = [
        ("HELLO", Request::Hello),
        ("SETTINGS", Request::Settings(&[])),
        ("MEMORY", Request::Memory(&[])),
        ("PLAN", Request::Plan(&PLAN)),
        ("BEGIN", begin),
        ("STEP", step),
        ("STATUS", Request::Status),
    ];
    let kinds =
        requests.map(|(name, request)| (format!("{:02x}", request.kind()), name.to_owned()));
    assert_eq!(pairs("kind | request | payload | answered by"), kinds);

    let replies = [
        ("IDENTITY", Reply::Hello(Identity::default())),
        ("TAKEN", Reply::Taken),
        ("STEPPED", Reply::Stepped(Stepped::default())),
        ("RECORD", Reply::Status(Status::default())),
        ("NAK", Reply::Nak(Nak::Damaged)),
    ];
    let kinds = replies.map(|(name, reply)| {
        let kind = reply.body(0, 0).unwrap()[0];
        (format!("{kind:02x}"), name.to_owned())
    });
    assert_eq!(pairs("kind | reply | payload"), kinds);
}

fn step(next: Next) -> Step {
    Step {
        events: Events::default(),
        inputs: Inputs::default(),
        motor_unread: false,
        next,
    }
}

fn flags(step: Step) -> u8 {
    Request::Step(step).body(0, 0, u64::MAX).unwrap()[7]
}

#[test]
fn the_flags() {
    let none = step(Next::Underrun);
    assert_eq!(flags(none), 0);
    let with = |change: fn(&mut Step)| {
        let mut step = none;
        change(&mut step);
        format!("{:02x}", flags(step))
    };
    let named = |bit, name: &str| (bit, name.to_owned());
    let of_step = [
        named(with(|step| step.events.insert(Event::Disable)), "disable"),
        named(with(|step| step.events.insert(Event::Reset)), "reset"),
        named(with(|step| step.events.insert(Event::Enable)), "enable"),
        named(with(|step| step.events.insert(Event::Start)), "start"),
        named(
            with(|step| step.inputs.emergency_stop = true),
            "emergency stop",
        ),
        named(with(|step| step.inputs.load_register = Some(0)), "load"),
        named(with(|step| step.motor_unread = true), "odd"),
        named(
            with(|step| step.next = Next::Last(Setpoint::default())),
            "next",
        ),
    ];
    assert_eq!(pairs("bit | of a STEP | with it"), of_step);

    let replied = |stepped: Stepped| {
        let body = Reply::Stepped(stepped).body(0, 0).unwrap();
        format!("{:02x}", body[16])
    };
    let refused = |event| {
        let mut refused = Events::default();
        refused.insert(event);
        replied(Stepped {
            refused,
            ..Stepped::default()
        })
    };
    let fault = firmware::Fault {
        cause: FaultCause::EmergencyStop,
        tick: 0,
        values: firmware::FaultValues::default(),
    };
    let [power, out_of_range, fault] = [
        (true, false, None),
        (false, true, None),
        (false, false, Some(fault)),
    ]
    .map(|(power, out_of_range, fault)| {
        replied(Stepped {
            power,
            out_of_range,
            fault,
            ..Stepped::default()
        })
    });
    let of_reply = [
        named(refused(Event::Disable), "disable refused"),
        named(refused(Event::Reset), "reset refused"),
        named(refused(Event::Enable), "enable refused"),
        named(refused(Event::Start), "start refused"),
        named(power, "power"),
        named(out_of_range, "out of range"),
        named(fault, "fault"),
    ];
    assert_eq!(pairs("bit | of a STEPPED | meaning"), of_reply);
}

/// Lengths of bodies with everything in them, and of the frame.
#[test]
fn the_lengths() {
    let stretch = Request::Step(Step {
        motor_unread: true,
        inputs: Inputs {
            load_register: Some(1),
            ..Inputs::default()
        },
        ..step(Next::Stretch(Stretch::default()))
    });
    let longest = stretch.body(0, 0, u64::MAX).unwrap().len();
    let fault = Stepped {
        fault: Some(firmware::Fault {
            cause: FaultCause::EmergencyStop,
            tick: 0,
            values: firmware::FaultValues::default(),
        }),
        ..Stepped::default()
    };
    let fault = Reply::Stepped(fault).body(0, 0).unwrap().len();
    assert!(fault <= LARGEST_REPLY);
    let text = section(PAGE, "## Frames");
    for sentence in [
        format!("at most {LARGEST_BODY} bytes"),
        format!("at most {LARGEST_FRAME} bytes on the line"),
        format!("{:08x}", crc32(b"123456789")),
    ] {
        assert!(text.contains(&sentence), "{sentence}");
    }
    for sentence in [
        format!("A STEP has 12 to {longest} bytes"),
        format!("A STEPPED has 21 or {fault} bytes"),
        format!("at most {MOST_WORDS} words"),
        format!("version {}", firmware_link::body::VERSION),
    ] {
        assert!(PAGE.contains(&sentence), "{sentence}");
    }
}

/// The words of a stretch, by numbers that tell every byte.
#[test]
fn the_words_of_a_stretch() {
    let number = |n: i64| firmware::Counts::from_bits(n << 32 | (n + 1));
    let stretch = Stretch {
        position: number(1),
        velocity: number(3),
        acceleration: number(5),
        jerk: number(7),
        ahead: number(9),
        ahead_change: number(11),
        ahead_growth: number(13),
        samples: 15,
        velocity_sign: -1,
        acceleration_sign: 1,
    };
    let words = [2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 15, 0x01ff];
    assert_eq!(stretch.to_words(), words);
    let names: Vec<&str> = rows("words | field | unit")
        .iter()
        .map(|row| row[1])
        .collect();
    let fields = [
        "position",
        "velocity",
        "acceleration",
        "jerk",
        "ahead",
        "ahead_change",
        "ahead_growth",
        "samples",
        "signs",
    ];
    assert_eq!(names, fields);
}
