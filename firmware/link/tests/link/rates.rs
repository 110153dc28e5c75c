//! A table of setpoints with their rates in a chip's memory: the axis does with them
//! what it does with the same setpoints one by one.

use firmware::reference::RATED_WORDS;
use firmware::{Axis, Event, Next, Setpoint, State};
use firmware_link::{Events, Reply, Request, SourceKind, Step};

use crate::plans;
use crate::serving::{Host, step};

/// Words of the memory.
const ROOM: usize = 512;

/// A way with rates of both signs.
fn setpoints() -> Vec<Setpoint> {
    let setpoint = |k: i32| Setpoint {
        position: k * k * 5,
        velocity: if k < 60 { k * 9_000 } else { (60 - k) * 7_000 },
        acceleration: (30 - k) * 4_000,
        ahead: None,
    };
    (0..100).map(setpoint).collect()
}

/// The axis with velocities in 2^-12 counts per sample.
fn axis() -> Axis {
    let mut axis = plans::axis();
    let lag = firmware::GainWord::new(3, 0);
    let monitor = firmware::monitor::FollowingErrorMonitor::accept(400, lag, 12);
    axis.monitors.following_error = Some(monitor.unwrap());
    axis
}

/// An axis in motion, and the number of its first sample.
fn begun(words: &[i32], source: SourceKind) -> (Host<ROOM>, u32) {
    let (mut host, number) = Host::loaded(&axis(), words);
    let mut events = Events::default();
    events.insert(Event::Enable);
    events.insert(Event::Start);
    let begin = Request::Begin {
        configuration: host.configuration,
        source,
        events,
    };
    assert_eq!(host.ask(1, number, &begin), Reply::Taken);
    (host, number + 1)
}

/// Code, error and state of each sample; the setpoints come with the samples where `nexts`
/// has them.
fn ran(words: &[i32], source: SourceKind, nexts: &[Next]) -> Vec<(i32, i32, State)> {
    let (mut host, first) = begun(words, source);
    let sample = |tick: u64| {
        let k = tick.min(99) as i32;
        let behind = (k * k * 5 - 3).cast_unsigned();
        let request = match nexts.get(tick as usize) {
            None => step(behind, tick, &[]),
            Some(next) => {
                let Request::Step(step) = step(behind, tick, &[]) else {
                    panic!("a step")
                };
                Request::Step(Step {
                    next: *next,
                    ..step
                })
            }
        };
        match host.ask(1, first + tick as u32, &request) {
            Reply::Stepped(there) => (there.code, there.error_counts, there.state),
            other => panic!("no sample at {tick}: {other:?}"),
        }
    };
    (0..103).map(sample).collect()
}

#[test]
fn a_table_with_rates_is_its_setpoints_one_by_one() {
    let setpoints = setpoints();
    let words: Vec<i32> = (setpoints.iter())
        .flat_map(|s| [s.position, s.velocity, s.acceleration])
        .collect();
    let (last, before) = setpoints.split_last().unwrap();
    let mut nexts: Vec<Next> = before.iter().map(|s| Next::Setpoint(*s)).collect();
    nexts.push(Next::Last(*last));
    let by_table = ran(&words, SourceKind::Rates, &[]);
    assert_eq!(by_table, ran(&[], SourceKind::Step, &nexts));
    let moving = by_table
        .iter()
        .filter(|(.., state)| *state == State::Moving);
    assert_eq!(moving.count(), 99);
    assert_eq!(by_table[102].2, State::Holding);

    // The contrast: positions alone, whose differences are no such rates.
    let positions: Vec<i32> = setpoints.iter().map(|s| s.position).collect();
    let by_positions = ran(&positions, SourceKind::Table, &[]);
    let others = by_positions
        .iter()
        .zip(&by_table)
        .filter(|(a, b)| a.0 != b.0);
    assert!(others.count() > 50);
}

/// A part of a setpoint is none, nor is an empty memory.
#[test]
fn what_is_no_setpoint_is_an_underrun() {
    for words in [vec![], vec![1], vec![0; RATED_WORDS + 2]] {
        let (mut host, first) = begun(&words, SourceKind::Rates);
        let samples = words.len() / RATED_WORDS;
        for tick in 0..=samples {
            let reply = host.ask(1, first + tick as u32, &step(0, tick as u64, &[]));
            let Reply::Stepped(there) = reply else {
                panic!("no sample at {tick}")
            };
            assert_eq!(there.fault.is_some(), tick == samples, "{words:?}: {tick}");
        }
    }
}
