//! Motions that the chip plans itself: those that a host would have sent.

use firmware::law::LawWords;
use firmware::{GainWord, MotionPlan};
use firmware_link::{Events, Nak, Planned, Reply, Request, SourceKind, plan};

use crate::serving::{Host, payload};

const MS: u64 = 1_000_000_000;

const PLANNED: Planned = Planned {
    travel: -(54_321 << 32) + 77,
    intervals_ps: [
        100 * MS,
        50 * MS,
        80 * MS,
        30 * MS,
        70 * MS,
        0,
        120 * MS + 1,
    ],
    period_ns: 1_000_000,
    start: -1_000,
    gains: [
        GainWord::new(5_000, 32),
        GainWord::new(-20_000, 32),
        GainWord::new(40 << 10, 10),
    ],
};

/// Words that a host plans.
fn sent(planned: &Planned) -> Vec<i32> {
    let motion = MotionPlan::new(planned.travel, planned.intervals_ps, planned.period_ns).unwrap();
    let [velocity_ff, acceleration_ff, friction_ff] = planned.gains;
    let words = LawWords {
        velocity_ff,
        acceleration_ff,
        friction_ff,
        ..LawWords::NONE
    };
    let stretches: Vec<_> = motion.stretches(&words, planned.start).collect();
    let end = motion.head().end.wrapping_add(planned.start);
    plan::words(&stretches, end).collect()
}

#[test]
fn the_chip_plans_what_the_host_would_send() {
    let motions = [
        PLANNED,
        Planned {
            travel: 2_000_000 << 32,
            intervals_ps: [333, 0, 1, 900, 47, 11, 250].map(|ms| ms * MS),
            start: i32::MAX - 5,
            ..PLANNED
        },
        Planned {
            travel: 0,
            ..PLANNED
        },
        Planned {
            travel: 1 << 32,
            intervals_ps: [MS; 7],
            ..PLANNED
        },
    ];
    for planned in motions {
        let mut host = Host::<4_096>::greeted(1);
        let axis = crate::plans::axis();
        host.part(1, 1, &Request::Settings(&payload(&axis)));
        assert_eq!(host.part(1, 2, &Request::Plan(&planned)), Reply::Taken);
        assert_eq!(host.table.as_counts(), sent(&planned));
        // It is a part of the configuration, and a plan that BEGIN accepts.
        let begin = |configuration| Request::Begin {
            configuration,
            source: SourceKind::Plan,
            events: Events::default(),
        };
        let here = host.configuration;
        let other = host.ask(1, 3, &begin(here ^ 1));
        assert_eq!(other, Reply::Nak(Nak::Configuration { here }));
        assert_eq!(host.ask(1, 3, &begin(here)), Reply::Taken, "{planned:?}");
        // Behind BEGIN there is no other.
        let late = host.ask(1, 4, &Request::Plan(&planned));
        assert_eq!(late, Reply::Nak(Nak::Request));
    }
}

#[test]
fn a_motion_that_is_none_changes_nothing() {
    let none = Reply::Nak(Nak::Plan { stretch: 0 });
    let with = |intervals_ps| Planned {
        intervals_ps,
        ..PLANNED
    };
    let refused = [
        (
            Planned {
                period_ns: 0,
                ..PLANNED
            },
            none,
        ),
        (
            Planned {
                travel: i64::MIN,
                ..PLANNED
            },
            none,
        ),
        // No time at all, none to gain speed, none to lose it.
        (with([0; 7]), none),
        (with([0, 0, 0, MS, MS, MS, MS]), none),
        (with([MS, MS, MS, MS, 0, 0, 0]), none),
        // Too long, and too fast.
        (with([1 << 62, 0, 0, 0, 0, 0, 1]), none),
        (with([u64::MAX; 7]), none),
        (
            Planned {
                travel: i64::MAX,
                ..with([MS; 7])
            },
            none,
        ),
        (with([0, 100 * MS, 0, 0, 0, 1, 0]), none),
        // Stretches without end, and one that has no room for its end.
        (
            Planned {
                period_ns: 1,
                ..with([1 << 58; 7])
            },
            Reply::Nak(Nak::Memory),
        ),
    ];
    let mut host = Host::<256>::greeted(1);
    let kept = [7_i32, 8].map(i32::to_le_bytes).concat();
    assert_eq!(host.part(1, 1, &Request::Memory(&kept)), Reply::Taken);
    for (planned, reply) in refused {
        assert_eq!(
            host.ask(1, 2, &Request::Plan(&planned)),
            reply,
            "{planned:?}"
        );
        assert_eq!(host.table.as_counts(), [7, 8]);
    }
    // A byte less, a byte more.
    let body = Request::Plan(&PLANNED).body(1, 2, 0).unwrap();
    for bytes in [body[..body.len() - 1].to_vec(), [&body[..], &[0]].concat()] {
        let (_, reply) = host.body(&bytes).unwrap();
        assert_eq!(reply, Reply::Nak(Nak::Request));
    }
    assert_eq!(host.table.as_counts(), [7, 8]);
    // The number is still free.
    assert_eq!(host.ask(1, 2, &Request::Memory(&kept)), Reply::Taken);
    assert_eq!(host.table.as_counts(), [7, 8, 7, 8]);
}

/// The last word decides: the same motion with room for all of it, and for all but one.
#[test]
fn the_end_needs_room_too() {
    let short = Planned {
        travel: 8 << 32,
        intervals_ps: [0, 4 * MS, 0, 0, 0, 4 * MS, 0],
        ..PLANNED
    };
    assert_eq!(sent(&short).len(), 33);
    let mut host = Host::<33>::greeted(1);
    assert_eq!(host.ask(1, 1, &Request::Plan(&short)), Reply::Taken);
    assert_eq!(host.table.as_counts(), sent(&short));
    let mut host = Host::<32>::greeted(1);
    let reply = host.ask(1, 1, &Request::Plan(&short));
    assert_eq!(reply, Reply::Nak(Nak::Memory));
    assert_eq!(host.table.as_counts(), [0; 0]);
}
