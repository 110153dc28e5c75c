//! Planned motions over the line: the chip runs what the host has planned, and
//! nothing else.

use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::reference::{Observed, SetpointSource};
use firmware::{
    Axis, AxisState, Codes, Counts, Dac, Event, GainWord, Inputs, Motion, MotionPlan, Next,
    PlannedMotion, Setpoint, State, Stretch,
};
use firmware_link::{Events, Nak, Reply, Request, SourceKind, Step, plan};

use crate::serving::{Host, payload, step};

/// Words of the memory.
const ROOM: usize = 2_048;

/// Feed-forward and a little of everything else.
pub(crate) fn axis() -> Axis {
    let words = LawWords {
        kp: GainWord::new(13_421_773, 24),
        ki_dt: GainWord::new(10_737_418, 32),
        velocity_ff: GainWord::new(5_000, 32),
        acceleration_ff: GainWord::new(20_000, 32),
        friction_ff: GainWord::new(40 << 10, 10),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(16).unwrap();
    let law = Law::accept(words, dac).unwrap();
    Axis::new(law, Output::new(dac, None, Quantiser::Nearest).unwrap())
}

/// Stretches from `start` on, where they end, and the same for the host's axis.
fn planned(travel: i64, thousandths: [u64; 7], start: i32) -> (Vec<Stretch>, i32, Planned) {
    let intervals_ps = thousandths.map(|ms| ms * 1_000_000_000);
    let plan = MotionPlan::new(travel, intervals_ps, 1_000_000).unwrap();
    let words = *axis().law().words();
    let stretches = plan.stretches(&words, start).collect();
    let host = Planned::new(&plan, &words).unwrap();
    (stretches, plan.head().end.wrapping_add(start), host)
}

type Planned = PlannedMotion<128>;

/// An axis that was sent a plan; the answer to its BEGIN, and the next number.
fn begun(words: &[i32]) -> (Host<ROOM>, Reply, u32) {
    let (mut host, number) = Host::loaded(&axis(), words);
    let begin = Request::Begin {
        configuration: host.configuration,
        source: SourceKind::Plan,
        events: Events::default(),
    };
    let reply = host.ask(1, number, &begin);
    (host, reply, number + 1)
}

fn refused(words: &[i32]) -> Reply {
    begun(words).1
}

#[test]
fn a_plan_runs_to_the_setpoints_of_the_host() {
    let plans = [
        planned(-(54_321 << 32) + 77, [100, 50, 80, 30, 70, 0, 120], -1_000),
        planned(2_000_000 << 32, [333, 0, 1, 900, 47, 11, 250], i32::MAX - 5),
        planned(3 << 31, [0, 40, 0, 0, 0, 40, 0], 0),
        planned(0, [10; 7], 9),
        planned(1 << 32, [0, 0, 0, 0, 0, 0, 0].map(|_| 1), 5),
    ];
    for (stretches, end, planned) in plans {
        let words: Vec<i32> = plan::words(&stretches, end).collect();
        let (mut host, reply, first) = begun(&words);
        assert_eq!(reply, Reply::Taken);

        let setpoints = stretches.iter().flat_map(|stretch| {
            let mut at = *stretch;
            (0..stretch.samples).map(move |_| {
                let setpoint = at.setpoint();
                at.advance();
                setpoint
            })
        });
        let start = end.wrapping_sub(planned.end());
        let (mut here, mut motion) = (AxisState::start(&axis()), Motion::new(&planned, start));
        let rest = [end; 3];
        let samples = setpoints.clone().count();
        for (tick, setpoint) in (0..).zip(setpoints.chain(rest)) {
            // A motor that is always a little behind.
            let register = setpoint.wrapping_sub(3).cast_unsigned();
            let events: &[Event] = match tick {
                0 => &[Event::Enable, Event::Start],
                _ => &[],
            };
            for event in events {
                here.request(*event).unwrap();
            }
            let number = first + tick as u32;
            let Reply::Stepped(there) = host.ask(1, number, &step(register, tick, events)) else {
                panic!("no sample at {tick}")
            };
            let inputs = Inputs {
                tick,
                motor_register: register,
                ..Inputs::default()
            };
            let output = here.tick(&inputs, &mut motion);
            assert_eq!(there.error_counts, 3, "sample {tick}");
            let seen = (there.code, there.error_counts, there.state);
            assert_eq!(seen, (output.code, output.error_counts, output.state));
            let moves = tick < samples as u64;
            assert_eq!(there.state == State::Moving, moves, "sample {tick}");
        }
    }
}

#[test]
fn a_plan_that_is_none_is_refused_by_its_stretch() {
    let (stretches, end, _) = planned(54_321 << 32, [100, 50, 80, 30, 70, 0, 120], 0);
    let count = stretches.len();
    assert!(count > 6, "{count} stretches");
    let words = |stretches: &[Stretch]| -> Vec<i32> { plan::words(stretches, end).collect() };
    let good = words(&stretches);
    assert_eq!(refused(&good), Reply::Taken);
    let at = |stretch: usize| {
        let stretch = stretch as u32;
        Reply::Nak(Nak::Plan { stretch })
    };

    for stretch in 0..count {
        let mut none = stretches.clone();
        none[stretch].samples = 0;
        assert_eq!(refused(&words(&none)), at(stretch));
        // No curve is that long, and a line leads elsewhere.
        none[stretch].samples = u32::MAX;
        let line = none[stretch].acceleration == 0 && none[stretch].jerk == 0;
        assert_eq!(refused(&words(&none)), at(stretch + usize::from(line)));

        // A jump of what comes behind it, in whole counts.
        let mut jump = good.clone();
        let behind = Stretch::WORDS * (stretch + 1);
        jump[(behind + 1).min(Stretch::WORDS * count)] += 1_000;
        assert_eq!(refused(&jump), at(stretch + 1));

        // Cut off within a stretch, and behind it.
        for words in [2, 15, 16, 17].map(|words| behind - Stretch::WORDS + words) {
            let cut = words.min(good.len() - 1);
            let read = cut / Stretch::WORDS;
            assert_eq!(refused(&good[..cut]), at(read), "{words} words");
        }
    }
    assert_eq!(refused(&[]), at(0));
    let mut longer = good.clone();
    longer.push(end);
    assert_eq!(refused(&longer), at(count));
}

/// A source that answers what it has.
struct Given(Next);

impl SetpointSource for Given {
    fn next(&mut self, _: &Observed) -> Next {
        self.0
    }
}

/// Every answer of a source, and every field of the inputs, arrives as it was sent.
#[test]
fn what_comes_with_a_step_is_what_the_axis_takes() {
    let plain = Setpoint {
        position: 40,
        velocity: 30_000,
        acceleration: -20_000,
        ahead: None,
    };
    let ahead = Setpoint {
        ahead: Some(Codes::from_bits(-(5 << 32) - 77)),
        ..plain
    };
    let stretch = Stretch {
        position: Counts::from_bits((50 << 32) + (1 << 31)),
        velocity: Counts::from_bits(3 << 32),
        acceleration: Counts::from_bits(-(1 << 31)),
        jerk: Counts::from_bits(1 << 28),
        ahead: Codes::from_bits(9 << 32),
        ahead_change: Codes::from_bits(1 << 33),
        ahead_growth: Codes::from_bits(-(1 << 32)),
        samples: 3,
        velocity_sign: 1,
        acceleration_sign: -1,
    };
    let nexts = [
        Next::Setpoint(plain),
        Next::Setpoint(ahead),
        Next::Stretch(stretch),
        Next::Underrun,
        Next::Underrun,
        Next::Setpoint(plain),
        Next::Last(ahead),
        Next::Underrun,
    ];
    let mut axis = axis();
    axis.monitors.ticks = Some(firmware::monitor::TickMonitor);
    let mut host = Host::<16>::greeted(1);
    host.part(1, 1, &Request::Settings(&payload(&axis)));
    let mut events = Events::default();
    events.insert(Event::Enable);
    events.insert(Event::Start);
    let begin = Request::Begin {
        configuration: host.configuration,
        source: SourceKind::Step,
        events,
    };
    assert_eq!(host.ask(1, 2, &begin), Reply::Taken);
    let mut here = AxisState::start(&axis);
    here.request(Event::Enable).unwrap();
    here.request(Event::Start).unwrap();

    let mut codes = Vec::new();
    for (tick, next) in (0..).zip(nexts) {
        let mut inputs = Inputs {
            tick,
            motor_register: 35 + tick as u32,
            load_register: (tick % 2 == 0).then_some(7),
            ..Inputs::default()
        };
        let mut step = Step {
            events: Events::default(),
            inputs,
            motor_unread: tick == 3,
            next,
        };
        // The last sample: its tick comes again, and says by how much.
        if tick == 7 {
            step.inputs.tick = 5;
        }
        inputs.tick = step.inputs.tick;
        if step.motor_unread {
            (inputs.motor_register, _) = here.last_registers();
        }
        let output = here.tick(&inputs, &mut Given(next));
        let Reply::Stepped(there) = host.ask(1, 3 + tick as u32, &Request::Step(step)) else {
            panic!("no sample at {tick}")
        };
        let seen = (there.code, there.error_counts, there.state);
        assert_eq!(seen, (output.code, output.error_counts, output.state));
        assert_eq!(there.fault, here.fault().copied(), "sample {tick}");
        codes.push(there.code);
    }
    assert_eq!(here.fault().unwrap().values.measured, -2);
    codes.dedup();
    assert_eq!(codes.len(), 8, "{codes:?}");
    // A stretch without samples is none.
    let none = Stretch {
        samples: 0,
        ..stretch
    };
    let step = Request::Step(Step {
        events: Events::default(),
        inputs: Inputs::default(),
        motor_unread: false,
        next: Next::Stretch(none),
    });
    assert_eq!(host.ask(1, 11, &step), Reply::Nak(Nak::Request));
}
