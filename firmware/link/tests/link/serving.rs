//! A server acts once on a request, and on no other.

use firmware::axis::{Axis, Inputs};
use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, Event, GainWord, Next, SetpointTable, Settings, State};
use firmware_link::body::{Header, VERSION};
use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, crc32_on, encode};
use firmware_link::request::MOST_WORDS;
use firmware_link::settings::write;
use firmware_link::{Events, Identity, Nak, Reply, Request, Server, SourceKind, Step, Target};

/// A target in memory whose clock stands still.
struct Memory;

impl Target for Memory {
    fn identity(&self) -> Identity {
        Identity {
            version: VERSION,
            target: *b"memory\0\0",
            image_crc: 7,
            flash_bytes: 8,
            ram_bytes: 9,
            table_capacity: 16,
            timer_hz: 10,
        }
    }
    fn start(&mut self) {}
    fn elapsed(&mut self) -> u32 {
        5
    }
    fn stack_bytes(&self) -> u32 {
        11
    }
}

/// A host that asks once.
pub(crate) struct Host<const N: usize = 16> {
    server: Server,
    pub(crate) table: SetpointTable<N>,
    pub(crate) configuration: u32,
}

impl<const N: usize> Host<N> {
    /// Without a session.
    fn new() -> Self {
        Self {
            server: Server::START,
            table: SetpointTable::resting_at(0),
            configuration: 0,
        }
    }

    /// In a session of its own.
    pub(crate) fn greeted(session: u16) -> Self {
        let mut host = Self::new();
        let hello = host.ask(session, 0, &Request::Hello);
        assert!(matches!(hello, Reply::Hello(_)));
        host
    }

    /// In session 1, with the settings of an axis and words in its memory; and the number
    /// of the next request.
    pub(crate) fn loaded(axis: &Axis, words: &[i32]) -> (Self, u32) {
        let mut host = Self::greeted(1);
        host.part(1, 1, &Request::Settings(&payload(axis)));
        let mut number = 2;
        for part in words.chunks(MOST_WORDS) {
            let bytes: Vec<u8> = part.iter().flat_map(|word| word.to_le_bytes()).collect();
            assert_eq!(host.part(1, number, &Request::Memory(&bytes)), Reply::Taken);
            number += 1;
        }
        (host, number)
    }

    pub(crate) fn ask(&mut self, session: u16, number: u32, request: &Request<'_>) -> Reply {
        let body = request.body(session, number, u64::MAX).unwrap();
        let (header, reply) = self.body(&body).unwrap();
        assert_eq!(header.number, number);
        reply
    }

    /// The answer to any body.
    pub(crate) fn body(&mut self, body: &[u8]) -> Option<(Header, Reply)> {
        self.line(&encode::<LARGEST_FRAME>(body).unwrap())
    }

    /// The answer to any frame.
    fn line(&mut self, frame: &[u8]) -> Option<(Header, Reply)> {
        let mut answer = None;
        for byte in frame {
            let mut receiver = Receiver::new();
            for byte in self.server.take(*byte, &mut self.table, &mut Memory) {
                assert_eq!(answer, None, "nothing follows a frame");
                if let Some(received) = receiver.take(*byte) {
                    let Received::Body(body) = received else {
                        panic!("a damaged answer");
                    };
                    answer = Some(Reply::read(body).expect("a reply"));
                }
            }
        }
        answer
    }

    /// A part of the configuration.
    pub(crate) fn part(&mut self, session: u16, number: u32, request: &Request<'_>) -> Reply {
        let body = request.body(session, number, 0).unwrap();
        self.configuration = crc32_on(self.configuration, &[request.kind()]);
        self.configuration = crc32_on(self.configuration, &body[7..]);
        self.ask(session, number, request)
    }
}

/// The settings of an axis as bytes.
pub(crate) fn payload(axis: &Axis) -> firmware_link::settings::Payload {
    write(&Settings::of(axis)).unwrap()
}

/// Kp = 2 codes per count behind 12 bits.
fn axis() -> Axis {
    let dac = Dac::with_bits(12).unwrap();
    let words = LawWords {
        kp: GainWord::new(1 << 30, 29),
        ..LawWords::NONE
    };
    let law = Law::accept(words, dac).unwrap();
    Axis::new(law, Output::new(dac, None, Quantiser::Nearest).unwrap())
}

pub(crate) fn step(motor_register: u32, tick: u64, events: &[Event]) -> Request<'static> {
    let mut set = Events::default();
    for event in events {
        set.insert(*event);
    }
    Request::Step(Step {
        events: set,
        inputs: Inputs {
            tick,
            motor_register,
            ..Inputs::default()
        },
        motor_unread: false,
        next: Next::Underrun,
    })
}

/// A session in which the axis waits for its first sample, number 4.
fn configured() -> Host {
    let mut host = Host::greeted(1);
    let payload = payload(&axis());
    assert_eq!(host.part(1, 1, &Request::Settings(&payload)), Reply::Taken);
    let setpoints: Vec<u8> = [0_i32, 100, 200]
        .iter()
        .flat_map(|r| r.to_le_bytes())
        .collect();
    assert_eq!(host.part(1, 2, &Request::Memory(&setpoints)), Reply::Taken);
    let begin = Request::Begin {
        configuration: host.configuration,
        source: SourceKind::Table,
        events: Events::default(),
    };
    assert_eq!(host.ask(1, 3, &begin), Reply::Taken);
    host
}

fn code(reply: Reply) -> i32 {
    match reply {
        Reply::Stepped(stepped) => stepped.code,
        other => panic!("no sample: {other:?}"),
    }
}

#[test]
fn a_session_from_hello_to_status() {
    let mut host = configured();
    let first = host.ask(1, 4, &step(0, 0, &[Event::Enable, Event::Start]));
    let Reply::Stepped(first) = first else {
        panic!("{first:?}")
    };
    assert_eq!(
        (first.code, first.state, first.ticks),
        (0, State::Moving, 5)
    );
    assert_eq!(code(host.ask(1, 5, &step(90, 1, &[]))), 20);
    let Reply::Status(status) = host.ask(1, 6, &Request::Status) else {
        panic!()
    };
    assert_eq!((status.stack_bytes, status.steps), (11, 2));
}

/// The contrast to acting once: a server that carried the repetition out would
/// answer with the next setpoint's code.
#[test]
fn a_repeated_request_is_answered_and_not_repeated() {
    let mut host = configured();
    host.ask(1, 4, &step(0, 0, &[Event::Enable, Event::Start]));
    let once = host.ask(1, 5, &step(90, 1, &[]));
    let again = host.ask(1, 5, &step(90, 1, &[]));
    assert_eq!(again, once);
    assert_eq!(code(host.ask(1, 6, &step(90, 2, &[]))), 220);
}

#[test]
fn numbers_and_sessions_that_are_not_expected_are_refused() {
    let mut host = configured();
    let number = Reply::Nak(Nak::Number { expected: 4 });
    for other in [0, 2, 5, 1_000] {
        assert_eq!(host.ask(1, other, &step(0, 0, &[])), number);
    }
    assert_eq!(host.ask(2, 4, &step(0, 0, &[])), Reply::Nak(Nak::Session));
    // A late HELLO of the same session ends nothing, one of another does.
    assert!(matches!(host.ask(1, 0, &Request::Hello), Reply::Hello(_)));
    assert_eq!(code(host.ask(1, 4, &step(0, 0, &[]))), 0);
    assert!(matches!(host.ask(2, 0, &Request::Hello), Reply::Hello(_)));
    assert_eq!(host.ask(1, 5, &step(0, 0, &[])), Reply::Nak(Nak::Session));
    assert_eq!(host.ask(2, 1, &step(0, 0, &[])), Reply::Nak(Nak::Request));
}

#[test]
fn another_configuration_is_refused() {
    let mut host = Host::<16>::greeted(9);
    host.part(9, 1, &Request::Settings(&payload(&axis())));
    let begin = |configuration| Request::Begin {
        configuration,
        source: SourceKind::Table,
        events: Events::default(),
    };
    let here = host.configuration;
    let refused = Reply::Nak(Nak::Configuration { here });
    assert_eq!(host.ask(9, 2, &begin(here ^ 1)), refused);
    assert_eq!(host.ask(9, 2, &begin(here)), Reply::Taken);
}

#[test]
fn more_words_than_the_memory_holds_are_refused() {
    let mut host = Host::<16>::greeted(9);
    let ten = [0; 40];
    assert_eq!(host.ask(9, 1, &Request::Memory(&ten)), Reply::Taken);
    let full = Reply::Nak(Nak::Memory);
    assert_eq!(host.ask(9, 2, &Request::Memory(&ten)), full);
    // Nothing of the ten has been kept: there is room for six.
    assert_eq!(host.ask(9, 2, &Request::Memory(&[0; 24])), Reply::Taken);
}

/// Events of BEGIN act all of them or none.
#[test]
fn a_begin_that_is_refused_has_not_acted() {
    for refused in [
        [Event::Enable, Event::Reset],
        [Event::Disable, Event::Start],
    ] {
        let mut host = Host::<16>::greeted(9);
        host.part(9, 1, &Request::Settings(&payload(&axis())));
        let begin = |configuration, asked: &[Event]| {
            let mut events = Events::default();
            asked.iter().for_each(|event| events.insert(*event));
            Request::Begin {
                configuration,
                source: SourceKind::Step,
                events,
            }
        };
        let here = host.configuration;
        let nak = Reply::Nak(Nak::Request);
        assert_eq!(host.ask(9, 2, &begin(here, &refused)), nak);
        // An axis that was enabled would refuse it.
        assert_eq!(host.ask(9, 2, &begin(here, &[Event::Enable])), Reply::Taken);
        let Reply::Stepped(stepped) = host.ask(9, 3, &step(0, 0, &[])) else {
            panic!("a step");
        };
        assert_eq!(stepped.state, State::Enabled);
    }
}

/// Every set of events, as the table of states has it from disabled on.
#[test]
fn a_begin_takes_the_events_that_a_new_axis_takes() {
    let asked = [Event::Disable, Event::Reset, Event::Enable, Event::Start];
    for bits in 0_u8..16 {
        let mut events = Events::default();
        let mut state = Some(State::Disabled);
        for (place, event) in asked.into_iter().enumerate() {
            if bits >> place & 1 == 1 {
                events.insert(event);
                state = state.and_then(|state| state.after(event).ok());
            }
        }
        let mut host = Host::<16>::greeted(1);
        host.part(1, 1, &Request::Settings(&payload(&axis())));
        let begin = Request::Begin {
            configuration: host.configuration,
            source: SourceKind::Table,
            events,
        };
        let expected = match state {
            Some(_) => Reply::Taken,
            None => Reply::Nak(Nak::Request),
        };
        assert_eq!(host.ask(1, 2, &begin), expected, "{events:?}");
    }
}

#[test]
fn a_damaged_frame_asks_for_the_next_request() {
    let mut host = configured();
    let (header, reply) = host.line(&[1, 2, 3, 0]).unwrap();
    assert_eq!((header.session, header.number), (1, 4));
    assert_eq!(reply, Reply::Nak(Nak::Damaged));
}

/// Other parameters change the code, and nothing of where the axis stands.
#[test]
fn a_running_axis_takes_other_parameters() {
    let mut host = configured();
    host.ask(1, 4, &step(0, 0, &[Event::Enable, Event::Start]));
    assert_eq!(code(host.ask(1, 5, &step(90, 1, &[]))), 20);
    let law = *axis().law();
    let slow = Axis::new(
        law,
        Output::new(law.dac(), Some(7), Quantiser::Nearest).unwrap(),
    );
    let payload = payload(&slow);
    assert_eq!(host.ask(1, 6, &Request::Settings(&payload)), Reply::Taken);
    // Still moving, to the third setpoint: 220 codes, in steps of 7 from 20 on.
    assert_eq!(code(host.ask(1, 7, &step(90, 2, &[]))), 27);
    // Words that are missing, or out of range, change nothing.
    let missing = Request::Settings(&payload[1..]);
    assert_eq!(host.ask(1, 8, &missing), Reply::Nak(Nak::Request));
    for (word, name) in Settings::NAMES.into_iter().enumerate() {
        let mut payload = payload.clone();
        let [least, most] = Settings::RANGES[word];
        let Some(out) = most.checked_add(1).or(least.checked_sub(1)) else {
            continue;
        };
        payload[4 * word..][..4].copy_from_slice(&out.to_le_bytes());
        let word = word as u32;
        let refused = Reply::Nak(Nak::Settings { word });
        assert_eq!(
            host.ask(1, 8, &Request::Settings(&payload)),
            refused,
            "{name}"
        );
    }
    assert_eq!(code(host.ask(1, 8, &step(90, 3, &[]))), 34);
}

/// Of another version nothing is read but which one it is.
#[test]
fn an_older_version_is_told() {
    let body = |version| {
        let identity = Identity {
            version,
            ..Memory.identity()
        };
        Reply::Hello(identity).body(1, 0).unwrap()
    };
    for version in [0, 1, VERSION - 1, VERSION + 1] {
        let mut body = body(version)[..8].to_vec();
        for _ in 0..40 {
            let (_, reply) = Reply::read(&body).expect("a greeting");
            let Reply::Hello(identity) = reply else {
                panic!("{reply:?}")
            };
            assert_eq!((identity.version, identity.target), (version, [0; 8]));
            body.push(77);
        }
    }
    // Contrast: this version is read to its end.
    let mut ours = body(VERSION);
    assert_eq!(Reply::read(&ours[..ours.len() - 1]), None);
    ours.push(77).unwrap();
    assert_eq!(Reply::read(&ours), None);
    // Requests of version 1 are none here: PAPER, SETPOINTS, PLAN.
    let mut host = Host::<16>::greeted(1);
    for kind in [0x02, 0x05, 0x08] {
        let (_, reply) = host.body(&[kind, 1, 0, 1, 0, 0, 0]).unwrap();
        assert_eq!(reply, Reply::Nak(Nak::Request));
    }
}

#[test]
fn every_refusal_reads_as_it_was_written() {
    let mut bodies = Vec::new();
    for nak in crate::NAKS {
        let body = Reply::Nak(nak).body(1, 2).unwrap();
        let (header, reply) = Reply::read(&body).unwrap();
        assert_eq!((header.session, header.number), (1, 2));
        assert_eq!(reply, Reply::Nak(nak));
        bodies.push(body);
    }
    // The next number is none: nine are all that there are.
    let mut unknown = bodies.pop().unwrap();
    let cause = unknown.len() - 5;
    unknown[cause] += 1;
    assert_eq!(Reply::read(&unknown), None);
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(20_000))]

    /// Whatever a whole frame says, the server answers with a reply that can be
    /// read, or with nothing, and goes on serving.
    #[test]
    fn any_body_is_answered_or_left(
        bodies in proptest::collection::vec(
            (0_u8..12, 0_u8..3, 0_u32..7, proptest::collection::vec(proptest::num::u8::ANY, 0..186)),
            1..12,
        ),
        begun in proptest::bool::ANY,
    ) {
        let mut host = if begun { configured() } else { Host::new() };
        for (kind, session, number, rest) in bodies {
            let mut body = vec![kind, session, 0];
            body.extend(number.to_le_bytes());
            body.extend(rest);
            if let Some((header, _)) = host.body(&body) {
                proptest::prop_assert_eq!(header.number, number);
            }
        }
        let hello = host.ask(77, 0, &Request::Hello);
        proptest::prop_assert!(matches!(hello, Reply::Hello(_)));
    }
}
