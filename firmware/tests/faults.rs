//! The fault that is kept, the one that is named, and its sentence.

use firmware::faults::most_urgent;
use firmware::{Fault, FaultCause, FaultLatch, FaultValues, Trip};

fn fault(cause: FaultCause, tick: u64, measured: i64, limit: i64) -> Fault {
    let values = FaultValues {
        setpoint: 10,
        position: -20,
        error: 30,
        code: -40,
        measured,
        limit,
    };
    Fault {
        cause,
        tick,
        values,
    }
}

#[test]
fn the_first_fault_stays_until_it_is_cleared() {
    let mut latch = FaultLatch::default();
    assert_eq!(latch.get(), None);
    let first = fault(FaultCause::SaturationTooLong, 5, 101, 100);
    latch.trip(first);
    // Not even a more urgent one of the same tick number takes its place:
    // that may be a tick which came twice.
    latch.trip(fault(FaultCause::EmergencyStop, 5, 0, 0));
    latch.trip(fault(FaultCause::FollowingError, 6, 2, 1));
    assert_eq!(latch.get(), Some(&first));

    latch.clear();
    assert_eq!(latch.get(), None);
    let second = fault(FaultCause::FollowingError, 7, 2, 1);
    latch.trip(second);
    assert_eq!(latch.get(), Some(&second));
}

#[test]
fn the_more_urgent_cause_wins_in_either_order() {
    let trip = |cause, measured| Trip {
        cause,
        measured,
        limit: 0,
    };
    for (i, a) in FaultCause::ALL.into_iter().enumerate() {
        assert_eq!(most_urgent(Some(trip(a, 1)), None), Some(trip(a, 1)));
        assert_eq!(most_urgent(None, Some(trip(a, 1))), Some(trip(a, 1)));
        for (j, b) in FaultCause::ALL.into_iter().enumerate() {
            let winner = if j < i { trip(b, 2) } else { trip(a, 1) };
            let chosen = most_urgent(Some(trip(a, 1)), Some(trip(b, 2)));
            assert_eq!(chosen, Some(winner));
        }
    }
}

#[test]
fn every_fault_says_what_was_measured_and_what_the_axis_did() {
    for cause in FaultCause::ALL {
        let text = fault(cause, 123, 6_001, 5_999).to_string();
        let state = "(tick 123: setpoint 10, position -20, error 30 counts, code -40)";
        assert!(text.ends_with(state), "{text}");
        let plain = matches!(cause, FaultCause::EmergencyStop | FaultCause::MissedTick);
        assert!(plain || text.contains("5999"), "{text}");
        assert!(cause == FaultCause::EmergencyStop || text.contains("6001"));
    }
    let again = fault(FaultCause::MissedTick, 123, -1, 0).to_string();
    assert!(again.starts_with("the tick came again, 1 too early"));
}
