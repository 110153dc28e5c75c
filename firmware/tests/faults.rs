//! The sentence of a fault.

use firmware::{Fault, FaultCause, FaultValues};

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
