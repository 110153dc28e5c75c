//! One sample of the exact solver against the reference.

use bench_tests::solvers::{FINER_TOLERANCE, REFERENCE_TOLERANCE, with_dopri5};
use hil_core::case::Law;
use hil_core::message::Measurement;
use plant::{ContactChange, Plant, Solver, State};

use crate::margin::{Margin, Passage};
use crate::trial::{Sample, Trial, components};

/// Tolerance of the state, in units of its range over the run.
pub(crate) const STATE_SHARE: f64 = 1e-10;

/// Ranges below this are held to this: a component that stands still has no
/// range, and the reference itself only promises so many rad, rad/s and A.
pub(crate) const SMALLEST_RANGE: f64 = 1e-3;

/// Times of contact changes agree to this \[s\], or to the time in which the
/// surface moves by the state's own tolerance.
const TIME_TOLERANCE_S: f64 = 1e-9;

/// Excursions less deep than this are left to rounding \[rad\].
pub(crate) const SHALLOW_RAD: f64 = 1e-12;

/// Positions this close to the next count are left to rounding \[counts\].
const NEAR_COUNT: f64 = 1e-6;

/// Share of the tolerance beyond which it means nothing if one last bit of the
/// start moves the reference's end by so much: a solver rounds at least a
/// hundred times on the way, and a hundred roundings add up like ten.
const LAST_BIT_SHARE: f64 = 0.1;

/// Reason to leave out a sample that does not agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Excuse {
    /// A surface was touched.
    Touched,
    /// Only the code differs, next to a count.
    NearCount,
    /// Only numbers differ, and the reference's own end hangs on the last bit
    /// of its start: many impacts in one sample, mostly of undamped joints.
    Amplified,
}

/// Outcome of one sample.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Verdict {
    /// A surface was touched.
    pub(crate) touched: bool,
    /// The position is next to a count.
    pub(crate) near_count: bool,
    /// Reason for which a disagreement does not count.
    pub(crate) excuse: Option<Excuse>,
    /// Compared with the finer reference.
    pub(crate) finer: bool,
    /// Largest difference of a component over what it may be.
    pub(crate) state_share: f64,
    /// Largest difference in time of a contact change over what it may be.
    pub(crate) time_share: f64,
    /// The difference in units of the effect of the last bit, if that decides.
    pub(crate) last_bits: f64,
    /// The first thing that does not agree.
    pub(crate) fault: Option<String>,
}

/// Repeats a sample with `dopri5` and compares; where they disagree, once
/// more with the finer tolerance, which then counts: most of what is left of a
/// difference in a hundred thousand samples is the reference's own.
pub(crate) fn compare(trial: &Trial, sample: &Sample, tolerance: f64) -> Verdict {
    let verdict = compare_at(trial, sample, tolerance);
    if verdict.fault.is_none() || tolerance > REFERENCE_TOLERANCE {
        return verdict;
    }
    Verdict {
        finer: true,
        ..compare_at(trial, sample, FINER_TOLERANCE)
    }
}

fn compare_at(trial: &Trial, sample: &Sample, tolerance: f64) -> Verdict {
    let case = &trial.case;
    let ranges = &trial.ranges.map(|range| range.max(SMALLEST_RANGE));
    let mut plant = with_dopri5(&sample.before, &case.axis, tolerance);
    let start_s = seconds(plant.time_ns());
    let mut margin = Margin::new(&case.axis);
    let advanced = sample.advance(&mut plant, &mut margin);
    let mut verdict = Verdict {
        touched: false,
        near_count: false,
        excuse: None,
        finer: false,
        state_share: 0.0,
        time_share: 0.0,
        last_bits: 0.0,
        fault: None,
    };
    if let Err(error) = advanced {
        verdict.fault = Some(format!("the reference gave up: {error}"));
        return verdict;
    }
    let (exact, other) = (sample.after.state(), plant.state());
    verdict.state_share = state_share(trial, &exact, &other);
    verdict.touched = margin.margin_rad() < SHALLOW_RAD;
    let exact_start_s = seconds(sample.before.time_ns());
    let off = |passage: &Passage, change: &ContactChange| {
        let later_s = (passage.change.time_s - start_s) - (change.time_s - exact_start_s);
        let allowed_rad = STATE_SHARE * ranges[2];
        later_s.abs() / TIME_TOLERANCE_S.max(allowed_rad / passage.rate_radps)
    };
    let order = |a: &ContactChange| (a.from, a.to, a.impact);
    let expected: Vec<_> = margin.passages.iter().map(|p| order(&p.change)).collect();
    let found: Vec<_> = sample.changes.iter().map(order).collect();
    for (passage, change) in margin.passages.iter().zip(&sample.changes) {
        verdict.time_share = verdict.time_share.max(off(passage, change));
    }
    let (e, o) = (position(trial, &exact), position(trial, &other));
    verdict.near_count = case.controller.law != Law::Sampled && (e - e.round()).abs() < NEAR_COUNT;
    let code = |state| {
        let measured = Measurement::new(case, sample.next_tick, state);
        sample.law.clone().step(measured).dac_code.real()
    };
    let codes_agree = match case.controller.law {
        // Real numbers: as close as the law makes of positions that are.
        Law::Sampled => {
            let steepest = steepest_gain(trial);
            let allowed =
                steepest * case.encoder.counts_per_rad * STATE_SHARE * (ranges[0] + ranges[2])
                    / case.axis.transmission.gear_ratio;
            (code(&exact) - code(&other)).abs() <= allowed + 1e-12 * code(&other).abs()
        }
        _ => code(&exact) == code(&other),
    };
    verdict.fault = if found != expected {
        Some(format!(
            "contact changes {found:?} for {expected:?}, margin {:e}",
            margin.margin_rad()
        ))
    } else if verdict.time_share > 1.0 {
        Some(format!(
            "a contact change is off by {} of its tolerance",
            verdict.time_share
        ))
    } else if verdict.state_share > 1.0 {
        Some(format!(
            "the state is off by {:.2} of its tolerance, {exact:?} for {other:?}, after {} changes",
            verdict.state_share,
            sample.changes.len()
        ))
    } else if !codes_agree {
        Some(format!(
            "code {} for {} at {e} and {o} counts",
            code(&exact),
            code(&other)
        ))
    } else {
        None
    };
    if verdict.fault.is_some() {
        let state_agrees = verdict.time_share <= 1.0 && verdict.state_share <= 1.0;
        verdict.excuse = if verdict.touched {
            Some(Excuse::Touched)
        } else if found == expected && state_agrees && verdict.near_count {
            Some(Excuse::NearCount)
        } else if found == expected {
            let share = last_bit_share(trial, sample, tolerance, &other);
            verdict.last_bits = verdict.state_share / share;
            (share > LAST_BIT_SHARE).then_some(Excuse::Amplified)
        } else {
            None
        };
    }
    if verdict.excuse.is_some() {
        verdict.fault = None;
    }
    verdict
}

/// Codes that the law adds per count of error, at most.
fn steepest_gain(trial: &Trial) -> f64 {
    let settings = &trial.case.controller;
    let period_s = seconds(settings.sample_time_ns.unwrap_or(1));
    let gains = settings.gains;
    gains.kp + gains.ki_per_s * period_s + gains.kd_s / period_s
}

fn position(trial: &Trial, state: &State) -> f64 {
    let alpha_rad = state.beta_rad / trial.case.axis.transmission.gear_ratio;
    trial.case.encoder.position_counts(alpha_rad)
}

fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// Movement of the reference's end, in units of its tolerance, when one
/// component of the start changes in its last bit: the largest of all ten.
fn last_bit_share(trial: &Trial, sample: &Sample, tolerance: f64, end: &State) -> f64 {
    let start = sample.before.state();
    let nudges: [fn(&mut State) -> &mut f64; 5] = [
        |state| &mut state.beta_rad,
        |state| &mut state.beta_dot_radps,
        |state| &mut state.epsilon_rad,
        |state| &mut state.epsilon_dot_radps,
        |state| &mut state.current_a,
    ];
    let mut largest = 0.0_f64;
    for nudge in nudges {
        for neighbour in [f64::next_up, f64::next_down] {
            let mut state = start;
            let value = nudge(&mut state);
            // What is at rest stays at rest.
            if *value == 0.0 {
                continue;
            }
            *value = neighbour(*value);
            if start.gamma_dot_radps() == 0.0 && state.gamma_dot_radps() != 0.0 {
                continue;
            }
            let solver = Solver::Dopri5 { tolerance };
            let mut plant = Plant::with_state(&trial.case.axis, solver, &state);
            if sample.advance(&mut plant, &mut ()).is_ok() {
                largest = largest.max(state_share(trial, &plant.state(), end));
            }
        }
    }
    largest
}

/// Largest difference of a component over what it may be.
fn state_share(trial: &Trial, a: &State, b: &State) -> f64 {
    let mut largest = 0.0_f64;
    for ((x, y), range) in components(a).iter().zip(components(b)).zip(trial.ranges) {
        let share = (x - y).abs() / (STATE_SHARE * range.max(SMALLEST_RANGE));
        // `max` would hide a NaN.
        largest = if share.is_nan() {
            f64::INFINITY
        } else {
            largest.max(share)
        };
    }
    largest
}
