//! Budgets: limits on summary figures, and the verdicts on them.

use serde::Serialize;

use crate::case::{Case, Law, Limit};
use crate::figures::HOST_STEP_P99;
use crate::number::{self, seconds};

/// One limit and whether it holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Key of the figure.
    pub figure: &'static str,
    /// Its value, signed; null if the run gave none, which fails.
    pub value: Option<f64>,
    /// Largest allowed magnitude, or with `at_least` the least value.
    pub limit: f64,
    /// True if the limit is a least value.
    pub at_least: bool,
    /// Limit less magnitude, or value less limit; negative where the limit is broken.
    pub margin: Option<f64>,
    /// True if the limit is kept.
    pub pass: bool,
    /// True if the limit is a default, the run file having no `[budget]`.
    pub default: bool,
}

impl Verdict {
    /// The verdict on a value; no value fails.
    pub fn new(limit: &Limit, value: Option<f64>, default: bool) -> Self {
        let at_least = limit.is_least();
        let margin = value.map(|value| match at_least {
            true => value - limit.limit,
            false => limit.limit - value.abs(),
        });
        Self {
            figure: limit.figure,
            value,
            limit: limit.limit,
            at_least,
            margin,
            pass: margin.is_some_and(|margin| margin >= 0.0),
            default,
        }
    }

    /// Number of digits of the margin that hold, of the value's `digits`.
    pub fn margin_digits(&self, digits: Option<usize>) -> Option<usize> {
        Some(number::of_margin(self.margin?, self.value?, digits?))
    }
}

/// The limits that a case is held to, and whether they are the defaults.
pub fn limits(case: &Case) -> (Vec<Limit>, bool) {
    match &case.budget {
        Some(limits) => (limits.clone(), false),
        None => (default_limits(case), true),
    }
}

/// The limits that a run on this host is judged by, apart from the time of its
/// steps: those of [`limits`], and no fault where a supervision runs.
pub fn judged(case: &Case) -> (Vec<Limit>, bool) {
    let (mut limits, default) = limits(case);
    limits.retain(|limit| limit.figure != HOST_STEP_P99.key);
    // An axis that stopped on a fault has not done its work, whatever else
    // the budget asks for.
    let supervised = case.controller.law == Law::Firmware && !case.options.is_off();
    if supervised && limits.iter().all(|limit| limit.figure != FAULTS) {
        limits.push(Limit::new(FAULTS, 0.0));
    }
    (limits, default)
}

/// Without `[budget]`: no saturation, at most twice the commanded
/// acceleration, at most 2 % of the travel (the largest displacement on the way) as
/// following error; none of a command that does not move.
fn default_limits(case: &Case) -> Vec<Limit> {
    let end_s = seconds(case.run.duration_ns);
    let peak_mps2 = case.motion.peak_acceleration_until_mps2(end_s);
    let travel_m = case.motion.largest_displacement_m();
    let mut limits = vec![Limit::new("voltage_saturated_s", 0.0)];
    if peak_mps2 > 0.0 {
        limits.push(Limit::new("peak_abs_acc_mps2", 2.0 * peak_mps2));
    }
    if travel_m > 0.0 {
        limits.push(Limit::new("peak_following_error_mm", 1e3 * 0.02 * travel_m));
    }
    limits
}

/// The verdicts that follow from the figures of a summary, which `figure`
/// gives by key. The host's step time is measured elsewhere and never enters
/// a summary.
pub(crate) fn verdicts(case: &Case, figure: impl Fn(&str) -> Option<f64>) -> Vec<Verdict> {
    let (limits, default) = judged(case);
    let own = case.budget.iter().flatten();
    // A limit that nobody asked for is one of ours.
    let is_default = |limit: &Limit| default || own.clone().all(|own| own.figure != limit.figure);
    let verdict = |limit: &Limit| Verdict::new(limit, figure(limit.figure), is_default(limit));
    let mut verdicts: Vec<Verdict> = limits.iter().map(verdict).collect();
    // Nor has a chip done its work that was not done with a code when the next
    // was due.
    let late = figure(DEADLINE_MISSES);
    if late.is_some() && limits.iter().all(|limit| limit.figure != DEADLINE_MISSES) {
        let none = Limit::new(DEADLINE_MISSES, 0.0);
        verdicts.push(Verdict::new(&none, late, true));
    }
    verdicts
}

/// The least part of a limit that is left over, 1 − |value|/limit or of a least value
/// value/limit − 1, below 0 where
/// one is exceeded; `None` without a limit above 0, or where a value is missing
/// or a limit of 0 is not kept: then no part of a limit says how far.
pub fn least_relative_margin(verdicts: &[Verdict]) -> Option<f64> {
    let measured = |of: &Verdict| of.margin.is_some() && (of.limit > 0.0 || of.pass);
    if !verdicts.iter().all(measured) {
        return None;
    }
    let above_0 = verdicts.iter().filter(|verdict| verdict.limit > 0.0);
    let parts = above_0.filter_map(|verdict| Some(verdict.margin? / verdict.limit));
    parts.reduce(f64::min)
}

/// Key of the number of faults.
const FAULTS: &str = "faults";

/// Key of the number of steps that took longer than the sample time.
const DEADLINE_MISSES: &str = "deadline_misses";

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(limit: f64) -> Limit {
        Limit::new("final_error_um", limit)
    }

    #[test]
    fn limits_the_magnitude() {
        assert!(Verdict::new(&limit(50.0), Some(-50.0), false).pass);
        let over = Verdict::new(&limit(50.0), Some(-51.0), false);
        assert_eq!((over.pass, over.margin), (false, Some(-1.0)));
    }

    #[test]
    fn the_least_margin_is_that_of_the_tightest_limit() {
        let verdict = |most, value| Verdict::new(&limit(most), value, false);
        let half = verdict(50.0, Some(-25.0));
        let least = |others: &[Verdict]| {
            least_relative_margin(&[std::slice::from_ref(&half), others].concat())
        };
        assert_eq!(least(&[]), Some(0.5));
        assert_eq!(least(&[verdict(10.0, Some(9.0))]), Some(0.1));
        assert_eq!(least(&[verdict(10.0, Some(15.0))]), Some(-0.5));
        assert_eq!(least(&[verdict(0.0, Some(0.0))]), Some(0.5));
        assert_eq!(least(&[verdict(0.0, Some(1.0))]), None);
        assert_eq!(least(&[verdict(10.0, None)]), None);
        assert_eq!(least_relative_margin(&[]), None);
    }

    #[test]
    fn a_margin_has_a_least_value() {
        let at_least = Limit::new("modulus_margin_contact", 0.5);
        let verdict = |value| Verdict::new(&at_least, Some(value), false);
        assert!(verdict(0.6).pass && verdict(0.6).at_least);
        // An unstable loop has a negative margin, whose magnitude is no excuse.
        assert_eq!(
            (verdict(-0.75).pass, verdict(-0.75).margin),
            (false, Some(-1.25))
        );
        assert!(!Verdict::new(&limit(50.0), Some(40.0), false).at_least);
        assert_eq!(least_relative_margin(&[verdict(0.75)]), Some(0.5));
    }

    #[test]
    fn null_and_nan_fail() {
        assert!(!Verdict::new(&limit(50.0), None, false).pass);
        assert!(!Verdict::new(&limit(50.0), Some(f64::NAN), false).pass);
    }
}
