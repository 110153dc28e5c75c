//! The cause of a limit cycle: the same case again with one nonlinearity
//! taken away at a time.
//!
//! A smooth loop that is stable comes to rest. Where one does not, the steps of
//! the encoder or of the converter, the gap or dry friction feed the cycle, and
//! without the one that does the cycle dies. All runs are made on rung
//! `quantised`, the lowest that has all four, with the paper's law and without
//! anything else that the firmware's axis may do:
//!
//! ```
//! use hil_core::rest::feeding::{baseline, counterfactuals, fed_by};
//! use hil_core::{lanes::Runs, runfile};
//!
//! let case = runfile::builtin("paper-1", &["run.duration_s=2".to_owned()])?;
//! let mut runs = Runs::new();
//! let mut ripple_um = |case: &_| runs.single(case).ok()?.rest_ripple_um;
//! if let Some(amplitude_um) = ripple_um(&baseline(&case)) {
//!     let without: Vec<_> = counterfactuals(&case)
//!         .iter()
//!         .map(|other| (other.without, ripple_um(&other.case)))
//!         .collect();
//!     println!("fed by {}", fed_by(amplitude_um, &without));
//! }
//! # Ok::<(), runfile::RunFileErrors>(())
//! ```

use plant::{Dac, Joint};

use crate::case::{Case, ComputationDelay, Law};

/// Bits by which encoder and converter are refined.
const FINER_BITS: u32 = 10;

/// Bits of a converter at most.
const MOST_DAC_BITS: u32 = 24;

/// Share of its amplitude below which a cycle counts as gone.
const GONE: f64 = 0.2;

/// Nonlinearity of an axis and its controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Nonlinearity {
    /// The encoder's steps.
    Encoder,
    /// The converter's steps.
    Dac,
    /// The gap of the joint.
    Gap,
    /// Friction that changes its sign with the motion.
    Friction,
}

impl Nonlinearity {
    /// All of them, in the order in which they are shown.
    pub const ALL: [Self; 4] = [Self::Encoder, Self::Dac, Self::Gap, Self::Friction];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        ["encoder", "dac", "gap", "friction"][self as usize]
    }
}

/// A case with one nonlinearity taken away.
#[derive(Debug, Clone, PartialEq)]
pub struct Counterfactual {
    /// The one that was taken away.
    pub without: Nonlinearity,
    /// The case to be run.
    pub case: Case,
}

/// The case that the counterfactuals are held against: the same on rung
/// `quantised`, and without a delay where that is measured on a chip.
pub fn baseline(case: &Case) -> Case {
    let mut case = case.clone();
    case.controller.law = Law::Quantised;
    if case.controller.computation_delay == ComputationDelay::Measured {
        case.controller.computation_delay = ComputationDelay::Fixed(0);
    }
    case.run.events = false;
    case
}

/// The cases to be run again: [`baseline`] less one nonlinearity each, for
/// those that it has.
///
/// Encoder and converter are not made ideal but finer by ten bits, with the
/// gains that keep the loop what it is: the rounding stays where it was and
/// becomes a thousand times smaller. A converter of more than 14 bits is refined
/// to 24, the most there is; one of 24 stays out.
pub fn counterfactuals(case: &Case) -> Vec<Counterfactual> {
    let base = baseline(case);
    let without = |nonlinearity| {
        let mut case = base.clone();
        let found = match nonlinearity {
            Nonlinearity::Encoder => refine_encoder(&mut case),
            Nonlinearity::Dac => refine_converter(&mut case),
            Nonlinearity::Gap => close_gap(&mut case),
            Nonlinearity::Friction => remove_friction(&mut case),
        };
        found.then_some(Counterfactual {
            without: nonlinearity,
            case,
        })
    };
    Nonlinearity::ALL.into_iter().filter_map(without).collect()
}

/// `factor` times the gains: a power of two, so that no digit changes.
fn scale_gains(case: &mut Case, factor: f64) {
    let gains = &mut case.controller.gains;
    for gain in [&mut gains.kp, &mut gains.ki_per_s, &mut gains.kd_s] {
        *gain *= factor;
    }
}

fn refine_encoder(case: &mut Case) -> bool {
    let factor = f64::from(1_u32 << FINER_BITS);
    case.encoder.counts_per_rad *= factor;
    scale_gains(case, 1.0 / factor);
    true
}

fn refine_converter(case: &mut Case) -> bool {
    let bits = FINER_BITS.min(MOST_DAC_BITS.saturating_sub(case.dac.bits));
    let factor = f64::from(1_u32 << bits);
    case.dac = Dac {
        bits: case.dac.bits + bits,
        step_v: case.dac.step_v / factor,
    };
    scale_gains(case, factor);
    bits > 0
}

fn close_gap(case: &mut Case) -> bool {
    let Joint::Elastic(joint) = &mut case.axis.transmission.joint else {
        return false;
    };
    let had_one = joint.backlash_half_rad > 0.0;
    joint.backlash_half_rad = 0.0;
    had_one
}

fn remove_friction(case: &mut Case) -> bool {
    let resistance = &mut case.axis.carriage.resistance;
    let had_some = resistance.opposes_motion && resistance.constant_n > 0.0;
    resistance.constant_n = 0.0;
    had_some
}

/// The nonlinearities that feed a cycle of `amplitude_um` \[µm\], as `dac`, `dac+gap` or
/// `none`: whatever it is without which the amplitude, in `results`, falls below a fifth. A
/// run that gave no amplitude tells nothing, and where there is no cycle (an amplitude of 0)
/// nothing feeds it.
///
/// Ripples (`rest_ripple_um`) are the figures to compare: an oscillation that
/// has merely become irregular has one too.
pub fn fed_by(amplitude_um: f64, results: &[(Nonlinearity, Option<f64>)]) -> String {
    let dies_without = |of: &Nonlinearity| {
        let mut left_um = results.iter().filter(|(without, _)| without == of);
        left_um.any(|(_, left_um)| left_um.is_some_and(|um| um < GONE * amplitude_um))
    };
    let feeding = Nonlinearity::ALL.into_iter().filter(dies_without);
    let names: Vec<_> = feeding.map(Nonlinearity::name).collect();
    match names[..] {
        [] => "none".to_owned(),
        _ => names.join("+"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runfile;

    fn case(sets: &[&str]) -> Case {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        runfile::builtin("paper-2", &sets).unwrap()
    }

    fn without(case: &Case) -> Vec<Nonlinearity> {
        counterfactuals(case)
            .iter()
            .map(|other| other.without)
            .collect()
    }

    #[test]
    fn a_case_is_run_again_without_what_it_has() {
        use Nonlinearity::{Dac, Encoder, Friction, Gap};
        assert_eq!(without(&case(&[])), [Encoder, Dac, Gap]);
        let found = without(&case(&["transmission.joint=rigid"]));
        assert_eq!(found, [Encoder, Dac]);
        let closed = case(&["transmission.backlash_half_deg=0", "drive.dac_bits=24"]);
        assert_eq!(without(&closed), [Encoder]);
        let rubbing = [
            "carriage.resistance_constant_n=60",
            "carriage.resistance_opposes_motion=true",
        ];
        assert_eq!(without(&case(&rubbing)), [Encoder, Dac, Gap, Friction]);
        // A weight is no friction.
        assert_eq!(without(&case(&rubbing[..1])), [Encoder, Dac, Gap]);
    }

    /// The loop stays what it is: volts per radian, and the range in volts.
    #[test]
    fn refining_changes_the_steps_alone() {
        for bits in [8, 14, 18] {
            let case = case(&[&format!("drive.dac_bits={bits}")]);
            let volts_per_rad = |case: &Case| {
                case.controller.gains.kp * case.encoder.counts_per_rad * case.dac.step_v
            };
            let range_v = |case: &Case| case.dac.output_v(f64::from(case.dac.code_min()));
            for other in counterfactuals(&case) {
                assert_eq!(volts_per_rad(&other.case), volts_per_rad(&case));
                assert_eq!(range_v(&other.case), range_v(&case));
                let finer = other.without == Nonlinearity::Dac;
                assert_eq!(other.case.dac.step_v < case.dac.step_v, finer);
                assert!(other.case.dac.bits <= 24);
                assert_eq!(other.case.controller.law, Law::Quantised);
            }
        }
    }

    #[test]
    fn what_feeds_a_cycle_is_named() {
        use Nonlinearity::{Dac, Encoder, Gap};
        let fed = |amplitude, left: &[f64]| {
            let results = [Encoder, Dac, Gap]
                .into_iter()
                .zip(left.iter().copied().map(Some));
            fed_by(amplitude, &results.collect::<Vec<_>>())
        };
        assert_eq!(fed(10.0, &[9.0, 1.9, 12.0]), "dac");
        assert_eq!(fed(10.0, &[9.0, 0.0, 1.0]), "dac+gap");
        assert_eq!(fed(10.0, &[0.1, 5.0, 7.0]), "encoder");
        assert_eq!(fed(10.0, &[2.0, 5.0, 7.0]), "none");
        assert_eq!(fed(0.0, &[0.0, 0.0, 0.0]), "none");
        let untold = [(Dac, None), (Gap, Some(f64::NAN))];
        assert_eq!(fed_by(10.0, &untold), "none");
    }
}
