//! Remarks on drive and loads of a case that its figures do not make plain.

use core::f64::consts::TAU;

use plant::{Control, Start};

use crate::case::{Case, Law};
use crate::feed_forward::bias_without_a_sign;
use crate::number::{self, seconds};
use crate::options::GapSource;
use crate::runfile::{Kind, SECTIONS};
use crate::theory::{JointState, margin};

/// All that is to be said of a case, a sentence each.
pub(crate) fn of_case(case: &Case) -> impl Iterator<Item = String> {
    let of_drive = slow_current_loop(case).or_else(|| idle_voltage_limit(case));
    let measures = case.options.backlash.gap == GapSource::Measured;
    of_drive
        .into_iter()
        .chain(unheld_load(case))
        .chain(gap_under_load(case).filter(|_| measures))
        .chain(start_without_a_flank(case))
        .chain(bias_without_a_sign(case))
        .chain(late_loads(case))
        .chain(late_events(case))
}

/// A load that keeps the joint on one flank while its gap is measured.
pub fn gap_under_load(case: &Case) -> Option<String> {
    let force_n = case.surroundings().force_at_n(0);
    let held_n = held_n(case);
    (force_n.abs() > held_n).then(|| {
        format!(
            "a load of {} N, of which friction holds {} N, keeps the joint on one flank: a backlash \
             measurement finds no gap there",
            number::table(force_n),
            number::table(held_n)
        )
    })
}

/// A start on a flank that the joint does not have.
fn start_without_a_flank(case: &Case) -> Option<String> {
    (case.start != Start::Centred && !case.has_gap()).then(|| {
        "transmission.start changes nothing: the joint has no gap whose flanks it could lie on"
            .to_owned()
    })
}

/// Loads that begin when the run is over.
fn late_loads(case: &Case) -> impl Iterator<Item = String> {
    let times = (1..).zip(&case.loads);
    let late = times.filter(|(_, load)| load.from_ns >= case.run.duration_ns);
    late.map(|(row, load)| late_time(case, &format!("load.{row}.from_s"), seconds(load.from_ns)))
}

/// Requests, faults and gain changes that come when the run is over.
fn late_events(case: &Case) -> impl Iterator<Item = String> {
    let of_events = ["sequence", "gain_change", "inject"];
    let sections = SECTIONS.iter();
    let sections = sections.filter(move |section| of_events.contains(&section.name));
    let keys = sections.flat_map(|section| section.keys.iter().map(move |key| (section.name, key)));
    let times = keys.filter_map(|(section, key)| {
        let is_time =
            matches!(key.kind, Kind::Time(_)) && key.acts.on(case.controller.law, |_| false);
        let time_s = key.get(case)?.number().filter(|_| is_time)?;
        Some((format!("{section}.{}", key.name), time_s))
    });
    let end_s = seconds(case.run.duration_ns);
    let late = times.filter(move |(_, time_s)| *time_s >= end_s);
    late.map(|(path, time_s)| late_time(case, &path, time_s))
}

fn late_time(case: &Case, path: &str, time_s: f64) -> String {
    format!(
        "{path} = {time_s} is not before the end of the run, run.duration_s = {}: nothing comes of it",
        seconds(case.run.duration_ns)
    )
}

/// Force that friction holds at rest \[N\].
fn held_n(case: &Case) -> f64 {
    let resistance = &case.axis.carriage.resistance;
    match resistance.opposes_motion {
        true => resistance.constant_n,
        false => 0.0,
    }
}

/// A limit of the voltage that an ideal current loop does not have.
fn idle_voltage_limit(case: &Case) -> Option<String> {
    let limit_v = case.amplifier.voltage_limit_v;
    (limit_v > 0.0 && case.voltage_limit_v().is_none()).then(|| {
        format!(
            "drive.voltage_limit_v = {} limits nothing: the current loop is ideal; with \
             current_bandwidth_hz it has a voltage",
            number::table(limit_v)
        )
    })
}

/// Bandwidth of a current loop, as a multiple of the position loop's crossover, below which
/// its lag is no longer small beside the loop's own margins: atan(1/3) is 18°.
const LEAST_BANDWIDTH: f64 = 3.0;

/// A current loop that is slow beside the position loop around it.
fn slow_current_loop(case: &Case) -> Option<String> {
    // The loop that the amplifier was tuned for: its own lag would lower the crossover.
    let mut ideal = case.clone();
    let Control::Current {
        bandwidth_radps, ..
    } = &mut ideal.amplifier.control
    else {
        return None;
    };
    let bandwidth_radps = bandwidth_radps.take()?;
    let crossover_radps = margin(&ideal, JointState::Contact)?.crossover_radps?;
    let ratio = bandwidth_radps / crossover_radps;
    (ratio < LEAST_BANDWIDTH).then(|| {
        let [loop_hz, crossover_hz] = [bandwidth_radps, crossover_radps].map(|w| w / TAU);
        format!(
            "the current loop of {} Hz is {} times as fast as the position loop, which crosses over \
             at {} Hz; below {LEAST_BANDWIDTH} times its lag takes much of the phase margin",
            number::table(loop_hz),
            number::table(ratio),
            number::table(crossover_hz),
        )
    })
}

/// A load at the start that neither friction nor a code holds yet: the first code finds no
/// error, the second one acts a sample later.
fn unheld_load(case: &Case) -> Option<String> {
    let period_ns = case.controller.sample_time_ns?;
    if case.controller.law == Law::Continuous {
        return None;
    }
    let delay_ns = case.controller.computation_delay.fixed_ns();
    let delay_ns = delay_ns.unwrap_or(period_ns);
    let (carriage, transmission) = (&case.axis.carriage, &case.axis.transmission);
    let force_n = case.surroundings().force_at_n(0);
    let falling_n = force_n.abs() - held_n(case);
    if falling_n <= 0.0 {
        return None;
    }
    let p = transmission.screw_pitch_m_per_rad;
    let mass_kg = carriage.mass_kg + transmission.screw_inertia_kg_m2 / (p * p);
    let time_s = seconds(period_ns + delay_ns);
    let fall_um = 1e6 * 0.5 * falling_n / mass_kg * time_s * time_s;
    let brakes = match case.amplifier.is_current_drive() {
        true => "; a current drive does not brake",
        false => "",
    };
    let (towards, start, flank) = match force_n > 0.0 {
        true => ("-x", Start::PositiveFlank, "positive_flank"),
        false => ("+x", Start::NegativeFlank, "negative_flank"),
    };
    let rests = match case.has_gap() && case.start != start {
        true => format!("; at rest it lies on the {flank} (transmission.start)"),
        false => String::new(),
    };
    Some(format!(
        "nothing holds the load of {} N before the first code that knows of it, {} ms after the \
         start: it moves the carriage by up to {} µm towards {towards} by then, and further until \
         the law holds it{brakes}{rests}",
        number::table(force_n),
        number::table(1e3 * time_s),
        number::table(fall_um),
    ))
}
