//! Faults in mid-move: what trips, when, and that the voltage is 0 in the same
//! row.

use firmware::State;

use super::Ran;

/// Powered up to the row before the fault; from it on code, voltage and power
/// are 0, the state is `fault` and the verdict fails.
fn stops(sets: &[&str], cause: &str, tick: usize, [measured, limit]: [i64; 2]) -> Ran {
    let ran = Ran::of("paper-2", &[sets]);
    let fault = ran.fault();
    println!("{}", fault.message);
    assert_eq!((fault.cause, fault.tick), (cause, tick as u64));
    assert_eq!((fault.measured, fault.limit), (measured, limit), "{cause}");
    assert_eq!(fault.t_s, ran.rows[tick].t_s);
    let samples = ran.samples();
    assert_eq!(samples[tick - 1].axis_state, Some(State::Moving));
    assert!(samples[tick - 1].dac_code > 5_000.0);
    assert_eq!(f64::from(fault.dac_code), samples[tick - 1].dac_code);
    assert_eq!(f64::from(fault.error_counts), samples[tick].error_counts);
    for (row, sample) in ran.rows.iter().zip(samples).skip(tick) {
        assert_eq!(sample.axis_state, Some(State::Fault));
        assert_eq!((sample.dac_code, row.motor_voltage_v), (0.0, 0.0));
    }
    assert_eq!(ran.summary().faults, Some(1));
    let verdict = ran.summary().verdicts.last().unwrap();
    assert_eq!((verdict.figure, verdict.pass), ("faults", false));
    ran
}

#[test]
fn emergency_stop_in_mid_move() {
    let ran = stops(
        &["sequence.emergency_stop_s=0.4"],
        "emergency-stop",
        400,
        [0, 0],
    );
    // What the summary keeps: everything up to that row is the plain run's.
    let plain = Ran::of("paper-2", &[]);
    assert_eq!(ran.codes()[..400], plain.codes()[..400]);
    assert_eq!(ran.fault().setpoint_counts, 30_615);
    let fault = ran.fault();
    let distance_counts = fault.setpoint_counts - fault.position_counts;
    assert_eq!(distance_counts, fault.error_counts);
    // Between two samples: at the first sample after it.
    let later = Ran::of("paper-2", &[&["sequence.emergency_stop_s=0.3991"]]);
    assert_eq!(later.fault().tick, 400);
}

/// Released, reset and enabled: the axis holds where it stands.
#[test]
fn the_way_back_from_an_emergency_stop() {
    let stop = ["sequence.emergency_stop_s=0.4 sequence.emergency_stop_release_s=0.5"];
    let back = ["sequence.reset_s=0.6", "sequence.enable_s=0.7"];
    let ran = Ran::of("paper-2", &[&stop, &back]);
    let states: Vec<State> = ran.samples().iter().filter_map(|s| s.axis_state).collect();
    let expected = [
        (0..400, State::Moving),
        (400..600, State::Fault),
        (600..700, State::Disabled),
        (700..1_501, State::Enabled),
    ];
    for (range, state) in expected {
        assert!(states[range].iter().all(|s| *s == state), "{state:?}");
    }
    // A fault that was reset was a fault all the same.
    assert_eq!((ran.fault().tick, ran.summary().faults), (400, Some(1)));
    assert_eq!(ran.axis().state, "enabled");

    // Neither disabled nor enabled out of a fault; a reset under pressure trips
    // again.
    let early = ["sequence.disable_s=0.52", "sequence.enable_s=0.55"];
    let early = Ran::of("paper-2", &[&stop, &early]);
    assert_eq!(early.outcome.refused_requests, 2);
    assert_eq!(early.axis().state, "fault");
    let pressed = ["sequence.emergency_stop_s=0.4 sequence.reset_s=0.45"];
    let pressed = Ran::of("paper-2", &[&pressed]);
    assert_eq!((pressed.axis().state, pressed.fault().tick), ("fault", 400));
    assert_eq!(pressed.summary().faults, Some(2));
}

/// A drive that runs down after a Disable still drives: its encoder is watched
/// until the code is 0.
#[test]
fn an_encoder_lost_while_the_code_runs_down() {
    let disabled = [
        "sequence.disable_s=0.4 controller.slew_limit_codes_per_s=4000 \
         limits.encoder_loss_s=0.1",
    ];
    let ran = Ran::of("paper-2", &[&disabled, &["inject.encoder_freeze_s=0.45"]]);
    assert_eq!(ran.samples()[449].axis_state, Some(State::Disabled));
    assert!(ran.samples()[449].dac_code > 1_000.0);
    assert_eq!(ran.fault().cause, "encoder-loss");
    // Contrast: with an encoder that counts it runs down without a fault.
    let quiet = Ran::of("paper-2", &[&disabled]);
    assert_eq!(quiet.summary().faults, Some(0));
}

/// One disturbed reading of −4096 counts: without a limit the axis takes it
/// for a motion and is shaken, 10.4 instead of 1.65 m/s²; with one it stops at
/// that very tick.
#[test]
fn a_glitch_of_the_encoder() {
    let glitch = ["inject.encoder_glitch_s=0.4 inject.encoder_glitch_counts=-4096"];
    let plain = Ran::of("paper-2", &[]).summary().peak_abs_acc_mps2;
    let unwatched = Ran::of("paper-2", &[&glitch]);
    let shaken = unwatched.summary().peak_abs_acc_mps2;
    println!("peak acceleration {plain:.2} m/s², with the glitch {shaken:.2} m/s²");
    assert!(shaken > 4.0 * plain);
    assert_eq!(unwatched.axis().fault, None);
    assert!(unwatched.codes()[400] > unwatched.codes()[399] + 2_000.0);

    // The axis made 181 counts in that sample: −4096 + 181.
    let sets = [&glitch[..], &["limits.count_jump_counts=300"]].concat();
    let ran = stops(&sets, "encoder-glitch", 400, [-3_915, 300]);
    // The position is the last good one.
    assert_eq!(f64::from(ran.fault().position_counts), ran.counts()[399]);
    // A limit that the motion itself does not reach trips on nothing.
    let quiet = Ran::of("paper-2", &[&["limits.count_jump_counts=300"]]);
    assert_eq!(quiet.axis().fault, None);
}

/// A count that stands still from 0.4 s on: without a watch the axis runs away
/// by 635 mm at full voltage; with one it stops after 10 samples.
#[test]
fn loss_of_the_encoder() {
    let freeze = "inject.encoder_freeze_s=0.4";
    let unwatched = Ran::of("paper-2", &[&[freeze]]);
    let away_mm = unwatched.summary().peak_following_error_mm;
    let watched = stops(
        &[freeze, "limits.encoder_loss_s=0.01"],
        "encoder-loss",
        410,
        [10, 10],
    );
    let travelled = |ran: &Ran| ran.carriage_um().last().unwrap() - ran.carriage_um()[400];
    let (free_mm, stopped_mm) = (1e-3 * travelled(&unwatched), 1e-3 * travelled(&watched));
    println!("from the loss on {free_mm:.0} mm, stopped {stopped_mm:.0} mm");
    assert!(away_mm > 500.0);
    assert!(stopped_mm < free_mm / 10.0);
}

#[test]
fn an_error_on_the_bus() {
    stops(&["inject.bus_error_s=0.4"], "hardware-bus", 400, [1, 0]);
}

/// A tick that does not come costs one sample of an old code: 7.9 m/s² instead
/// of 1.65, because the differences of two samples fall into one. As a fault
/// it is seen at the tick after.
#[test]
fn a_missed_tick() {
    let missed = "inject.missed_tick_s=0.4";
    let plain = Ran::of("paper-2", &[]).summary().peak_abs_acc_mps2;
    let unwatched = Ran::of("paper-2", &[&[missed]]);
    let shaken = unwatched.summary().peak_abs_acc_mps2;
    println!("peak acceleration {plain:.2} m/s², with a missed tick {shaken:.2} m/s²");
    assert_eq!(unwatched.codes()[400], unwatched.codes()[399]);
    assert_eq!(unwatched.axis().fault, None);
    assert!(shaken > 3.0 * plain);
    stops(
        &[missed, "limits.missed_ticks=true"],
        "missed-tick",
        401,
        [1, 0],
    );
}

/// A queue that runs dry: the setpoints that wait are used up first.
#[test]
fn an_underrun_of_the_queue() {
    let dry = ["controller.setpoints=queue inject.setpoint_underrun_s=0.4"];
    let ran = Ran::of("paper-2", &[&dry]);
    let fault = ran.fault();
    println!("{}", fault.message);
    let waited = fault.tick - 400;
    assert!((1..=16).contains(&waited), "{waited} setpoints waited");
    stops(&dry, "setpoint-underrun", fault.tick as usize, [0, 1]);
    // After the motion's end there is nothing to run dry of.
    let after = ["controller.setpoints=queue inject.setpoint_underrun_s=1.1"];
    assert_eq!(Ran::of("paper-2", &[&after]).axis().fault, None);
}
