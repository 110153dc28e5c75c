//! The axis that drive mode drives: the paper's, behind the converter that this
//! board has. The one page to change for another machine.
//!
//! # Gains
//!
//! The paper's converter is a step of 4.88 mV in 14 bits, ±40 V, behind an
//! amplifier of 3 V/V. An AD5761R has ±10 V in 16 bits, steps of 0.305 mV. With
//! an amplifier of 12 V/V the motor gets the same ±120 V, and one of the paper's
//! codes is four of these, to within 0.06 %. So the gains are four times the paper's,
//! which the words say with two fraction bits less and the same mantissas:
//!
//! ```text
//! Kp = 12.8 codes/count   Ki = 20 /s   Kd = 0.2 s   Δt = 1 ms
//!
//! cargo run --release -- words paper-2 --set drive.dac_bits=16 \
//!     --set drive.dac_lsb_v=0.00030517578125 --set drive.amplifier_gain=12 \
//!     --set controller.kp=12.8 --set controller.ki_per_s=20 --set controller.kd_s=0.2 \
//!     --set encoder.counts_per_rad=636.61977 --set motion.travel_mm=25 \
//!     --set controller.anti_windup=clamp
//! ```
//!
//! prints them; `run` in place of `words` is the motion below on the paper's
//! plant: 0.38 mm following error, codes up to 2,584 of 32,767. The integrator is kept
//! from winding up, which the paper leaves open.
//!
//! # Motion
//!
//! The paper's second command, a tenth as far: 25 mm in 1 s. An encoder of 1,000
//! lines has 4,000 counts a turn, the motor turns half as fast as the screw, and
//! the screw has 5 mm a turn, so a millimetre is 400 counts.
//!
//! # Limits
//!
//! | monitor | limit | why |
//! | --- | --- | --- |
//! | following error | 400 counts, 1 mm | 2.6 times what the simulation shows |
//! | jump of the count | 400 counts a sample | the motor turns 306 counts a sample at 120 V without load |
//! | encoder loss | 3,277 codes, 50 ms | a tenth of the range, 12 V at the motor, turns it with certainty |
//! | saturation | 100 ms | a motion within its limits never gets there |
//! | missed tick | any | |

use firmware::axis::Axis;
use firmware::law::{AntiWindup, Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::{CounterParameters, Dac, GainWord, MotionPlan, Refusal};

use crate::drive::Planned;

/// `Δt` \[ns\].
pub const PERIOD_NS: u32 = 1_000_000;

/// Sample times in a second.
pub const SAMPLES_PER_S: u32 = 1_000_000_000 / PERIOD_NS;

/// Bits of the converter, an AD5761R.
pub const DAC_BITS: u32 = 16;

/// The travel of a motion \[counts\].
pub const TRAVEL_COUNTS: i32 = 10_000;

/// The intervals `t1` to `t7` of a motion \[ps\].
const INTERVALS_PS: [u64; 7] = {
    let quarter_s = 250_000_000_000;
    [quarter_s, 0, quarter_s, 0, quarter_s, 0, quarter_s]
};

/// See the page's section on gains.
const WORDS: LawWords = LawWords {
    kp: GainWord::new(13_421_773, 20),
    ki_dt: GainWord::new(10_737_418, 29),
    kd_per_dt: GainWord::new(13_107_200, 16),
    anti_windup: AntiWindup::Clamp,
    ..LawWords::NONE
};

/// Counts of following error.
const FOLLOWING_ERROR_COUNTS: u32 = 400;

/// Counts in a sample.
const LARGEST_JUMP_COUNTS: u32 = 400;

/// Codes, and samples at them.
const ENCODER_LOSS: (u32, u32) = (3_277, 50);

/// Samples.
const SATURATION_SAMPLES: u32 = 100;

/// Takes what was accepted; a refusal of `what` ends the build, since the axis is a constant.
#[allow(
    clippy::panic,
    reason = "in constant evaluation, where it ends the build"
)]
const fn accepted<T: Copy>(result: Result<T, Refusal>, what: &'static str) -> T {
    match result {
        Ok(accepted) => accepted,
        Err(_) => panic!("{}", what),
    }
}

/// The axis. A word or a limit that the firmware refuses ends the build.
pub const AXIS: Axis = {
    let dac = accepted(Dac::with_bits(DAC_BITS), "bits of the converter");
    let law = accepted(Law::accept(WORDS, dac), "words of the law");
    let output = accepted(Output::new(dac, None, Quantiser::Nearest), "slew limit");
    let mut axis = Axis::new(law, output);
    let counter = CounterParameters::accept(32, Some(LARGEST_JUMP_COUNTS));
    axis.counter = accepted(counter, "largest jump");
    let at_any_speed = GainWord::new(0, 0);
    let following = FollowingErrorMonitor::accept(FOLLOWING_ERROR_COUNTS, at_any_speed, 0);
    axis.monitors.following_error = Some(accepted(following, "following error"));
    let (codes, samples) = ENCODER_LOSS;
    let loss = EncoderLossMonitor::accept(codes, samples);
    axis.monitors.encoder_loss = Some(accepted(loss, "encoder loss"));
    let saturation = SaturationMonitor::accept(SATURATION_SAMPLES);
    axis.monitors.saturation = Some(accepted(saturation, "saturation"));
    axis.monitors.ticks = Some(TickMonitor);
    axis
};

/// The motion forth, and the one back.
///
/// # Errors
/// None with the constants of this page, as its test shows.
pub fn motions() -> Result<[Planned; 2], Refusal> {
    let travel = i64::from(TRAVEL_COUNTS) << 32;
    let planned = |travel| {
        let plan = MotionPlan::new(travel, INTERVALS_PS, PERIOD_NS)?;
        Planned::new(&plan, AXIS.law().words())
    };
    let [forth, back] = [planned(travel)?, planned(-travel)?];
    Ok([forth, back])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motions_are_opposite_and_last_a_second() {
        let [forth, back] = motions().expect("two motions");
        assert_eq!((forth.end(), back.end()), (TRAVEL_COUNTS, -TRAVEL_COUNTS));
        for planned in [forth, back] {
            let samples = planned.stretches().iter().map(|stretch| stretch.samples);
            assert_eq!(samples.sum::<u32>(), SAMPLES_PER_S);
        }
    }

    #[test]
    fn the_words_are_the_gains() {
        // w·2^−f of 12.8, 20·Δt and 0.2/Δt, to half a unit of w.
        for (word, gain) in [
            (WORDS.kp, 12.8),
            (WORDS.ki_dt, 0.02),
            (WORDS.kd_per_dt, 200.0),
        ] {
            let unit = f64::from(word.fraction_bits).exp2().recip();
            let error = f64::from(word.mantissa) * unit - gain;
            assert!(error.abs() <= unit / 2.0, "{word}: {error:e}");
        }
    }
}
