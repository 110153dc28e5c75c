//! The streamed queue: order, underrun, end mark, wrap, and a full queue.

#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::collections::VecDeque;

use firmware::{Codes, Next, Observed, Setpoint, SetpointSource, Stream, StreamReceiver, Streamed};
use proptest::prelude::*;

/// A setpoint that cannot be taken for another.
fn at(position: i32) -> Setpoint {
    Setpoint {
        position,
        velocity: position.wrapping_mul(3),
        acceleration: !position,
        ahead: (position % 2 == 0).then_some(Codes::from_bits((!i64::from(position)) << 7)),
    }
}

fn next(receiver: &mut StreamReceiver<'_>) -> Next {
    receiver.next(&Observed::default())
}

#[test]
fn order_is_kept_and_all_three_values_arrive() {
    let mut stream = Stream::<8>::new();
    let (mut sender, mut receiver) = stream.split();
    for position in 1..=6 {
        sender.send(Streamed::Setpoint(at(position))).expect("room");
    }
    sender.send(Streamed::Last(at(7))).expect("room");
    assert_eq!(receiver.waiting(), 7);
    for position in 1..=6 {
        assert_eq!(next(&mut receiver), Next::Setpoint(at(position)));
    }
    assert_eq!(next(&mut receiver), Next::Last(at(7)));
}

#[test]
fn an_empty_queue_is_an_underrun_at_once_and_leaves_no_trace() {
    let mut stream = Stream::<4>::new();
    let (mut sender, mut receiver) = stream.split();
    assert_eq!(next(&mut receiver), Next::Underrun, "nothing has come yet");
    sender.send(Streamed::Setpoint(at(1))).expect("room");
    assert_eq!(next(&mut receiver), Next::Setpoint(at(1)));
    for _ in 0..3 {
        assert_eq!(next(&mut receiver), Next::Underrun);
    }
    sender.send(Streamed::Setpoint(at(2))).expect("room");
    assert_eq!(next(&mut receiver), Next::Setpoint(at(2)));
}

#[test]
fn the_end_is_held_until_the_next_motion() {
    let mut stream = Stream::<4>::new();
    let (mut sender, mut receiver) = stream.split();
    sender.send(Streamed::Last(at(5))).expect("room");
    for _ in 0..3 {
        assert_eq!(next(&mut receiver), Next::Last(at(5)), "ended, no underrun");
    }
    sender.send(Streamed::Setpoint(at(6))).expect("room");
    assert_eq!(next(&mut receiver), Next::Setpoint(at(6)));
    assert_eq!(next(&mut receiver), Next::Underrun, "a motion again");
}

#[test]
fn a_full_queue_gives_the_setpoint_back_and_keeps_the_others() {
    let mut stream = Stream::<4>::new();
    let (mut sender, mut receiver) = stream.split();
    for position in 1..=3 {
        assert_eq!(sender.room(), usize::try_from(4 - position).expect("small"));
        sender.send(Streamed::Setpoint(at(position))).expect("room");
    }
    assert_eq!(sender.room(), 0);
    let item = Streamed::Last(at(-4));
    assert_eq!(sender.send(item), Err(item));
    assert_eq!(next(&mut receiver), Next::Setpoint(at(1)));
    assert_eq!(sender.room(), 1);
    sender.send(item).expect("room for one");
    assert_eq!(next(&mut receiver), Next::Setpoint(at(2)));
    assert_eq!(next(&mut receiver), Next::Setpoint(at(3)));
    assert_eq!(next(&mut receiver), Next::Last(at(-4)));
}

#[test]
fn what_is_discarded_is_gone() {
    let mut stream = Stream::<4>::new();
    let (mut sender, mut receiver) = stream.split();
    sender.send(Streamed::Last(at(1))).expect("room");
    assert_eq!(next(&mut receiver), Next::Last(at(1)));
    sender.send(Streamed::Setpoint(at(2))).expect("room");
    sender.send(Streamed::Last(at(3))).expect("room");
    receiver.discard();
    assert_eq!((receiver.waiting(), sender.room()), (0, 3));
    assert_eq!(next(&mut receiver), Next::Underrun, "nor is there an end");
}

#[test]
fn a_copy_goes_its_own_way() {
    let mut stream = Stream::<3>::new();
    let (mut sender, _) = stream.split();
    sender.send(Streamed::Setpoint(at(1))).expect("room");
    sender.send(Streamed::Last(at(2))).expect("room");
    let mut copy = stream.clone();
    assert_eq!(next(&mut stream.split().1), Next::Setpoint(at(1)));
    let (mut sender, mut receiver) = copy.split();
    assert_eq!(sender.room(), 0);
    assert_eq!(next(&mut receiver), Next::Setpoint(at(1)));
    sender.send(Streamed::Setpoint(at(3))).expect("room");
    assert_eq!(next(&mut receiver), Next::Last(at(2)));
    assert_eq!(next(&mut receiver), Next::Setpoint(at(3)));
    assert_eq!(stream.split().1.waiting(), 1);
}

#[test]
fn both_ends_work_at_the_same_time() {
    const COUNT: i32 = 20_000;
    let mut stream = Stream::<16>::new();
    let (mut sender, mut receiver) = stream.split();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            for position in 0..COUNT {
                let item = if position == COUNT - 1 {
                    Streamed::Last(at(position))
                } else {
                    Streamed::Setpoint(at(position))
                };
                while sender.send(item).is_err() {
                    std::thread::yield_now();
                }
            }
        });
        let mut expected = 0;
        loop {
            match next(&mut receiver) {
                Next::Setpoint(setpoint) => assert_eq!(setpoint, at(expected)),
                Next::Last(setpoint) => {
                    assert_eq!(setpoint, at(expected));
                    break;
                }
                Next::Stretch(_) => panic!("single setpoints"),
                Next::Underrun => {
                    std::thread::yield_now();
                    continue;
                }
            }
            expected += 1;
        }
        assert_eq!(expected, COUNT - 1);
    });
}

/// Requests to the two ends.
#[derive(Debug, Clone, Copy)]
enum Action {
    Send { last: bool },
    Take,
    Discard,
}

proptest! {
    /// Any order of events, many times round the queue, against a list.
    #[test]
    fn any_order_of_events_is_that_of_a_list(
        actions in prop::collection::vec(
            prop_oneof![
                8 => any::<bool>().prop_map(|last| Action::Send { last }),
                8 => Just(Action::Take),
                1 => Just(Action::Discard),
            ],
            0..200,
        )
    ) {
        let mut stream = Stream::<5>::new();
        let (mut sender, mut receiver) = stream.split();
        let mut list = VecDeque::new();
        let mut ended = None;
        for (position, action) in (0..).zip(actions) {
            match action {
                Action::Send { last } => {
                    let item = if last {
                        Streamed::Last(at(position))
                    } else {
                        Streamed::Setpoint(at(position))
                    };
                    let expected = if list.len() == 4 {
                        Err(item)
                    } else {
                        list.push_back(item);
                        Ok(())
                    };
                    prop_assert_eq!(sender.send(item), expected);
                }
                Action::Take => {
                    let expected = match list.pop_front() {
                        Some(Streamed::Setpoint(setpoint)) => {
                            ended = None;
                            Next::Setpoint(setpoint)
                        }
                        Some(Streamed::Last(setpoint)) => {
                            ended = Some(setpoint);
                            Next::Last(setpoint)
                        }
                        None => ended.map_or(Next::Underrun, Next::Last),
                    };
                    prop_assert_eq!(next(&mut receiver), expected);
                }
                Action::Discard => {
                    receiver.discard();
                    list.clear();
                    ended = None;
                }
            }
            prop_assert_eq!(receiver.waiting(), list.len());
            prop_assert_eq!(sender.room(), 4 - list.len());
        }
    }
}
