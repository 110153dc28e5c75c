//! The same run over numbers and over SPI frames, bit by bit.

use firmware::State;
use hil_core::controllers::IoKind;

use super::{PAPER, Ran};

/// Every row and every figure over both boards.
fn both(name: &str, sets: &[&[&str]]) -> (Ran, Ran) {
    let [direct, spi] = [IoKind::Direct, IoKind::Spi].map(|io| Ran::over(io, name, sets));
    (direct, spi)
}

/// Rows without the state of the axis, which the plain law does not have.
fn plain_rows(ran: &Ran) -> Vec<hil_core::trace::Row> {
    let mut rows = ran.rows.clone();
    for sample in rows.iter_mut().filter_map(|row| row.sample.as_mut()) {
        sample.axis_state = None;
    }
    rows
}

/// The paper's law without an axis around it, and the axis with drivers and
/// chips: the same bits.
#[test]
fn the_papers_cases_are_the_same_over_spi() {
    for name in PAPER {
        let (direct, spi) = both(name, &[&["drive.dac_bits=16"]]);
        assert_eq!(direct.rows, spi.rows, "{name}");
        assert_eq!(direct.summary(), spi.summary(), "{name}");
        // The axis around the law, with a watch that never trips.
        let (_, axis) = both(name, &[&["drive.dac_bits=16", "limits.missed_ticks=true"]]);
        assert_eq!(plain_rows(&direct), plain_rows(&axis), "{name}");
        assert_eq!(axis.axis().state, "holding");
    }
    let (direct, spi) = both("paper-2-12bit", &[]);
    assert_eq!(direct.rows, spi.rows);
    // The contrast: another converter is another run.
    let (twelve, _) = both("paper-2", &[&["drive.dac_bits=12"]]);
    let (sixteen, _) = both("paper-2", &[&["drive.dac_bits=16"]]);
    assert_ne!(twelve.rows, sixteen.rows);
}

/// Everything at once with a counter of 16 bits, stopped by the emergency stop.
#[test]
fn a_run_with_many_features_is_the_same_over_spi() {
    let sets = [
        "drive.dac_bits=16 encoder.counter_bits=16 controller.setpoints=queue \
         controller.derivative=measurement controller.velocity_ff_s=0.0769 \
         controller.quantiser=dither controller.anti_windup=clamp \
         controller.slew_limit_codes_per_s=200000 controller.feedback=dual \
         load_encoder.counts_per_mm=1000 limits.count_jump_counts=1000 \
         sequence.emergency_stop_s=0.7 sequence.emergency_stop_release_s=0.9 \
         sequence.reset_s=1 sequence.enable_s=1.1",
    ];
    let (direct, spi) = both("paper-2", &[&sets]);
    assert_eq!(direct.rows, spi.rows);
    assert_eq!(direct.outcome, spi.outcome);
    assert_eq!(direct.samples()[700].axis_state, Some(State::Fault));
    assert_eq!(direct.axis().state, "enabled");
}

/// A transfer that fails ends the run safely over both, with the same record.
#[test]
fn an_error_on_the_bus_ends_both_safely() {
    let (direct, spi) = both("paper-2", &[&["drive.dac_bits=16 inject.bus_error_s=0.4"]]);
    assert_eq!(direct.rows, spi.rows);
    assert_eq!(direct.outcome, spi.outcome);
    assert_eq!((spi.fault().cause, spi.fault().tick), ("hardware-bus", 400));
    let (before, at) = (&spi.rows[399], &spi.rows[400]);
    assert!(before.motor_voltage_v > 50.0);
    assert_eq!(at.motor_voltage_v, 0.0);
}

/// Wirings that no chip on the board has are refused with a sentence.
#[test]
fn boards_that_cannot_be_had() {
    for (set, what) in [
        ("drive.dac_bits=14", "converter of 14 bits"),
        ("encoder.counter_bits=24", "counter of 24 bits"),
    ] {
        let sentence = format!("there is no {what} on SPI");
        let case = bench_tests::case("paper-2", &["drive.dac_bits=16", set]);
        let error = Ran::of_case(case, IoKind::Spi).unwrap_err().to_string();
        assert!(error.contains(&sentence), "{error}");
    }
}
