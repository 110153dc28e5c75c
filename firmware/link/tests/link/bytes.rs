//! The bytes of version 3, held by the CRC-32 of all that goes over the line.

use firmware::axis::Inputs;
use firmware::faults::{Fault, FaultCause, FaultValues};
use firmware::law::LawWords;
use firmware::{Codes, Event, GainWord, MotionPlan, Next, Setpoint, Settings, State, Stretch};
use firmware_link::frame::{crc32, crc32_on};
use firmware_link::plan;
use firmware_link::settings::write;
use firmware_link::{Events, Identity, Reply, Request, SourceKind, Status, Step, Stepped};

use crate::NAKS;
use crate::parameters::axes;

/// The CRC-32 of bodies, each with its length in front.
fn crc_of<T: AsRef<[u8]>>(bodies: impl IntoIterator<Item = T>) -> u32 {
    bodies.into_iter().fold(0, |crc, body| {
        let length = u8::try_from(body.as_ref().len()).unwrap();
        crc32_on(crc32_on(crc, &[length]), body.as_ref())
    })
}

fn events(events: &[Event]) -> Events {
    let mut set = Events::default();
    events.iter().for_each(|event| set.insert(*event));
    set
}

fn steps() -> impl Iterator<Item = Request<'static>> {
    let setpoint = Setpoint {
        position: -70_000,
        velocity: 0x1234_5678,
        acceleration: -3,
        ahead: None,
    };
    let ahead = Setpoint {
        ahead: Some(Codes::from_bits(-0x0123_4567_89ab_cdef)),
        ..setpoint
    };
    let stretch = Stretch::from_words(&core::array::from_fn(|k| -7 << k));
    let nexts = [
        Next::Underrun,
        Next::Setpoint(setpoint),
        Next::Last(setpoint),
        Next::Setpoint(ahead),
        Next::Stretch(stretch),
    ];
    nexts.into_iter().enumerate().flat_map(|(k, next)| {
        let odd = [false, true];
        odd.map(|odd| {
            Request::Step(Step {
                events: events(&Events::ORDER[k.min(3)..]),
                inputs: Inputs {
                    tick: if odd { 0x0102_0304_0506_0708 } else { 42 },
                    motor_register: 0xfedc_ba98,
                    load_register: odd.then_some(77),
                    emergency_stop: k == 1,
                    failed_transfers: u32::from(odd) * 3,
                },
                motor_unread: odd,
                next,
            })
        })
    })
}

#[test]
fn the_requests() {
    const PAYLOAD: &[u8] = &[1, 0, 2, 255];
    let others = [
        Request::Hello,
        Request::Settings(PAYLOAD),
        Request::Memory(PAYLOAD),
        Request::Status,
    ];
    let sources = [
        SourceKind::Table,
        SourceKind::Plan,
        SourceKind::Step,
        SourceKind::Rates,
    ];
    let begins = sources.map(|source| Request::Begin {
        configuration: 0xdead_beef,
        source,
        events: events(&[Event::Enable, Event::Start]),
    });
    let requests = others.into_iter().chain(begins).chain(steps());
    let bodies = requests.map(|request| request.body(0x1f2e, 0x0a0b_0c0d, 41).unwrap());
    assert_eq!(crc_of(bodies), 2_036_959_284);
}

#[test]
fn the_replies() {
    let identity = Identity {
        version: 2,
        target: *b"memory\0\0",
        image_crc: 0x0102_0304,
        flash_bytes: 5,
        ram_bytes: 6,
        table_capacity: 7,
        timer_hz: 8,
    };
    let faults = FaultCause::ALL.map(|cause| {
        Some(Fault {
            cause,
            tick: 9 << 40,
            values: FaultValues {
                setpoint: -1,
                position: 2,
                error: -3,
                code: 4,
                measured: -(5 << 33),
                limit: 6 << 34,
            },
        })
    });
    let faults = faults.into_iter().chain([None]);
    let steps = faults.zip(State::ALL.into_iter().cycle());
    let steps = steps.map(|(fault, state)| {
        Reply::Stepped(Stepped {
            code: -8_191,
            error_counts: 100_000,
            state,
            power: state.is_powered(),
            out_of_range: fault.is_none(),
            refused: events(&[Event::Reset, Event::Start]),
            ticks: 0x0a0b_0c0d,
            fault,
        })
    });
    let others = [
        Reply::Hello(identity),
        Reply::Taken,
        Reply::Status(Status {
            stack_bytes: 2_824,
            steps: 1_500,
        }),
    ];
    let replies = others.into_iter().chain(NAKS.map(Reply::Nak)).chain(steps);
    let bodies = replies.map(|reply| reply.body(0x1f2e, 0x0a0b_0c0d).unwrap());
    assert_eq!(crc_of(bodies), 44_308_188);
}

#[test]
fn the_settings_and_a_plan() {
    let axes = axes();
    let settings = axes.iter().map(|axis| write(&Settings::of(axis)).unwrap());
    assert_eq!(crc_of(settings), 3_780_153_715);
    let eighth_ps = 125_000_333_000;
    let plan = MotionPlan::new(-(54_321 << 32) + 77, [eighth_ps; 7], 1_000_000).unwrap();
    let forward = LawWords {
        velocity_ff: GainWord::new(1_638_400, 32),
        ..LawWords::NONE
    };
    let stretches: Vec<Stretch> = plan.stretches(&forward, 77).collect();
    let words = plan::words(&stretches, plan.head().end + 77);
    assert_eq!(crc_of(words.map(i32::to_le_bytes)), 3_727_709_164);
    // The contrast: a length and an order are seen.
    assert_ne!(crc_of([&[1, 2], &[3, 4]]), crc_of([&[1, 2], &[4, 3]]));
    assert_ne!(crc_of([&[7][..]]), crc32(&[7]));
}
