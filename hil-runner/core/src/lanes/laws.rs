//! The sampled laws side by side: every lane gets the codes of the single run. Where
//! a sum in another order tells the code for certain it is computed by that, else by
//! the operations of the law in theirs.

use plant::{Encoder, Width};

use crate::case::{Case, Law};
use crate::controllers::{AxisController, FirmwareOnCounts, IoKind, LastTable, Pid, PidState};
use crate::message::{AxisStatus, Measurement, Steps, whole};
use crate::quantise::QuantiseError;

/// A law in all lanes, with its memory.
pub(crate) trait LaneLaw<W: Width> {
    /// One sample.
    fn sample(
        &mut self,
        w: W,
        settings: &Settings<W>,
        now: Instant<W::Vector>,
    ) -> LaneSample<W::Vector>;
}

/// The axes at a sample and what is asked of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant<V> {
    pub(crate) tick: u64,
    /// β, γ and α_ref \[rad\].
    pub(crate) beta: V,
    pub(crate) gamma: V,
    pub(crate) alpha_ref: V,
}

/// Codes, the counts that they were computed from, and the voltages that they give.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneSample<V> {
    pub(crate) code: V,
    pub(crate) count: V,
    pub(crate) held: Held<V>,
}

/// Rung `sampled`, real numbers, or `quantised`: whole counts and whole codes.
#[derive(Debug)]
pub(crate) struct Sampled<V, const WHOLE: bool>(pub(crate) Pid<V>, pub(crate) PidState<V>);

/// Rung `firmware`: the `firmware` crate, lane after lane. A lane without a
/// controller gets the code 0.
#[derive(Debug)]
pub(crate) struct Firmware<'a>(pub(crate) &'a mut [Option<LaneController>]);

/// The controller of a lane on rung `firmware`.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "the paper's law is stepped where it lies"
)]
pub(crate) enum LaneController {
    /// The paper's law alone.
    Paper(FirmwareOnCounts),
    /// The axis with everything beyond it: the single run's controller itself. With the
    /// encoder at its load.
    Axis(Box<AxisController>, Option<Encoder>),
}

impl LaneController {
    /// # Errors
    /// Those of the single run's controller.
    pub(crate) fn new(
        case: &Case,
        period_ns: u64,
        last: &mut LastTable,
    ) -> Result<Self, QuantiseError> {
        if case.options.is_off() {
            return FirmwareOnCounts::new(case, period_ns).map(Self::Paper);
        }
        let axis = AxisController::with_table(case, period_ns, IoKind::default(), last)?;
        Ok(Self::Axis(Box::new(axis), case.options.encoders.load))
    }

    /// The report of the axis, where there is one.
    pub(crate) fn status(&self) -> Option<AxisStatus> {
        match self {
            Self::Paper(_) => None,
            Self::Axis(axis, _) => Some(axis.status()),
        }
    }
}

/// Distance from a whole number beyond which a folded sum decides.
///
/// Let M bound the folded terms k₁·e, K_i·S and K_d/Δt·e_prev, and u = 2^−53. No gain is
/// negative, so that M bounds K_p·e, K_i·Δt·e and K_d/Δt·e too, and the law as written has
/// no partial sum above 5M. Its roundings add up to less than 23·u·M, those of the folded
/// sum, k₁ and K_d/Δt included, to less than 15·u·M (terms in u² left to the margin).
/// With M = 2^23 both together are less than 40·2^−30 = 3.8e-8: further from a step than
/// this distance, both have the same floor. Counts have four roundings, so that 2^27 will
/// do for them.
const FOLDED_STRAY: f64 = 1e-7;
const MOST_TERM: f64 = 8_388_608.0;
const MOST_COUNT: f64 = 134_217_728.0;

impl<W: Width> LaneLaw<W> for Sampled<W::Vector, true> {
    #[inline(always)]
    fn sample(
        &mut self,
        w: W,
        settings: &Settings<W>,
        now: Instant<W::Vector>,
    ) -> LaneSample<W::Vector> {
        let Self(pid, state) = self;
        let (beta, alpha_ref) = (now.beta, now.alpha_ref);
        let setpoint = settings.setpoint_count(w, alpha_ref);
        let (count, told) = settings.folded_count(w, beta);
        let folded = pid.folded(state, setpoint - count);
        let half = w.splat(0.5);
        let before = folded.integral - folded.derivative;
        let sum = folded.proportional + (before + half);
        let code = w.floor(sum);
        let asked_v = settings.asked_v(w, code);
        // Usually all of it is clear of steps and limits.
        let largest = w.max(w.abs(folded.integral), w.abs(folded.derivative));
        let largest = w.max(w.abs(folded.proportional), largest);
        let tells = w.both(
            w.greater(w.splat(MOST_TERM), largest),
            w.greater(w.splat(0.5 - FOLDED_STRAY), w.abs(sum - code - half)),
        );
        let free = settings.is_free(w, code, asked_v);
        if w.bits(w.both(w.both(told, tells), free)) == all::<W>() {
            pid.take(state, setpoint - count);
            let held = Held {
                voltage_v: asked_v,
                limited: 0,
            };
            return LaneSample { code, count, held };
        }
        let count = settings.count(w, beta);
        let y = pid.output(state, setpoint - count);
        // code = clamp(floor(y + ½), −2^(n−1), 2^(n−1) − 1)
        let (lowest, highest) = (w.load(&settings.code_min), w.load(&settings.code_max));
        let code = clamp(w, w.floor(y + half), lowest, highest);
        let held = settings.held(w, code);
        LaneSample { code, count, held }
    }
}

impl<W: Width> LaneLaw<W> for Sampled<W::Vector, false> {
    #[inline(always)]
    fn sample(
        &mut self,
        w: W,
        settings: &Settings<W>,
        now: Instant<W::Vector>,
    ) -> LaneSample<W::Vector> {
        let count = w.load(&settings.counts_per_rad) * (now.beta / w.load(&settings.gear_ratio));
        let setpoint = w.load(&settings.counts_per_rad) * now.alpha_ref;
        let code = self.0.output(&mut self.1, setpoint - count);
        let held = settings.held(w, code);
        LaneSample { code, count, held }
    }
}

impl<W: Width> LaneLaw<W> for Firmware<'_> {
    #[inline(always)]
    fn sample(
        &mut self,
        w: W,
        settings: &Settings<W>,
        now: Instant<W::Vector>,
    ) -> LaneSample<W::Vector> {
        let setpoint = settings.setpoint_count(w, now.alpha_ref);
        let (mut count, told) = settings.folded_count(w, now.beta);
        if w.bits(told) != all::<W>() {
            count = settings.count(w, now.beta);
        }
        let (positions, setpoints) = (w.stored(count), w.stored(setpoint));
        let gammas = w.stored(now.gamma);
        let mut codes = W::array(0.0);
        for (lane, controller) in self.0.iter_mut().enumerate() {
            let position = positions.as_ref()[lane];
            codes.as_mut()[lane] = match controller {
                None => 0.0,
                Some(LaneController::Paper(law)) => law.code(setpoints.as_ref()[lane], position),
                Some(LaneController::Axis(axis, load)) => {
                    let at_load = |encoder: Encoder| whole(encoder.count(gammas.as_ref()[lane]));
                    f64::from(axis.code(Measurement {
                        tick: now.tick,
                        position_counts: Steps::Whole(whole(position)),
                        load_counts: load.map(at_load),
                    }))
                }
            };
        }
        let code = w.load(&codes);
        let held = settings.held(w, code);
        LaneSample { code, count, held }
    }
}

/// Bits of all lanes.
const fn all<W: Width>() -> u64 {
    (1 << W::LANES) - 1
}

/// Settings of the lanes, in memory. A lane without a run has zeros: its axis
/// stays at rest.
#[derive(Debug, Clone)]
pub(crate) struct Settings<W: Width> {
    /// `K_p`, `K_i`, `K_d`.
    pub(crate) gains: [W::Array; 3],
    /// `K_enc` \[counts/rad\], z, and `K_enc/z`.
    counts_per_rad: W::Array,
    gear_ratio: W::Array,
    counts_per_beta_rad: W::Array,
    /// Lowest and highest code; infinite on rung `sampled`.
    code_min: W::Array,
    code_max: W::Array,
    /// `K_dac` \[V\].
    step_v: W::Array,
    /// `K_a` and `V_max`.
    amplifier_gain: W::Array,
    voltage_limit_v: W::Array,
    /// With a limit of the current the plant knows what the motor has: the limit of the
    /// voltage counts there, and only that of the code here.
    current_is_limited: bool,
}

/// The voltage of a code, and the lanes in which code or amplifier stands at its
/// limit, as bits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held<V> {
    pub(crate) voltage_v: V,
    pub(crate) limited: u64,
}

impl<W: Width> Settings<W> {
    pub(crate) fn new() -> Self {
        let zero = W::array(0.0);
        Self {
            gains: [zero; 3],
            counts_per_rad: zero,
            gear_ratio: W::array(1.0),
            counts_per_beta_rad: zero,
            code_min: zero,
            code_max: zero,
            step_v: zero,
            amplifier_gain: zero,
            voltage_limit_v: zero,
            current_is_limited: false,
        }
    }

    pub(crate) fn set(&mut self, lane: usize, case: &Case) {
        self.current_is_limited = case.amplifier.current_limit_a().is_some();
        let gains = &case.controller.gains;
        let [kp, ki, kd] = &mut self.gains;
        let (code_min, code_max) = match case.controller.law {
            Law::Sampled => (f64::NEG_INFINITY, f64::INFINITY),
            _ => (case.dac.code_min().into(), case.dac.code_max().into()),
        };
        let (counts_per_rad, z) = (
            case.encoder.counts_per_rad,
            case.axis.transmission.gear_ratio,
        );
        for (array, value) in [
            (kp, gains.kp),
            (ki, gains.ki_per_s),
            (kd, gains.kd_s),
            (&mut self.counts_per_rad, counts_per_rad),
            (&mut self.gear_ratio, z),
            (&mut self.counts_per_beta_rad, counts_per_rad / z),
            (&mut self.code_min, code_min),
            (&mut self.code_max, code_max),
            (&mut self.step_v, case.dac.step_v),
            (&mut self.amplifier_gain, case.amplifier.gain),
            (&mut self.voltage_limit_v, case.amplifier.voltage_limit_v),
        ] {
            array.as_mut()[lane] = value;
        }
    }

    /// `floor(K_enc·α)` with α = β/z, as the encoder counts.
    #[inline(always)]
    fn count(&self, w: W, beta: W::Vector) -> W::Vector {
        let alpha = beta / w.load(&self.gear_ratio);
        w.floor(w.load(&self.counts_per_rad) * alpha)
    }

    /// The same by one product, and where it tells.
    #[inline(always)]
    fn folded_count(&self, w: W, beta: W::Vector) -> (W::Vector, W::Mask) {
        let position = w.load(&self.counts_per_beta_rad) * beta;
        let count = w.floor(position);
        let inside = w.abs(position - count - w.splat(0.5));
        let told = w.both(
            w.greater(w.splat(0.5 - FOLDED_STRAY), inside),
            w.greater(w.splat(MOST_COUNT), w.abs(position)),
        );
        (count, told)
    }

    /// `floor(K_enc·α_ref + ½)`.
    #[inline(always)]
    fn setpoint_count(&self, w: W, alpha_ref: W::Vector) -> W::Vector {
        w.floor(w.load(&self.counts_per_rad) * alpha_ref + w.splat(0.5))
    }

    /// `K_a·K_dac·code`.
    #[inline(always)]
    fn asked_v(&self, w: W, code: W::Vector) -> W::Vector {
        w.load(&self.amplifier_gain) * (w.load(&self.step_v) * code)
    }

    /// Where neither code nor amplifier stands at its limit.
    #[inline(always)]
    fn is_free(&self, w: W, code: W::Vector, asked_v: W::Vector) -> W::Mask {
        let within = w.greater(w.load(&self.voltage_limit_v), w.abs(asked_v));
        w.both(within, self.code_is_free(w, code))
    }

    /// Where the code does not stand at its limit.
    #[inline(always)]
    fn code_is_free(&self, w: W, code: W::Vector) -> W::Mask {
        let above = w.greater(code, w.load(&self.code_min));
        let below = w.greater(w.load(&self.code_max), code);
        w.both(above, below)
    }

    /// `V_m = clamp(K_a·K_dac·code, ±V_max)`.
    #[inline(always)]
    pub(crate) fn held(&self, w: W, code: W::Vector) -> Held<W::Vector> {
        let limit_v = w.load(&self.voltage_limit_v);
        let asked_v = self.asked_v(w, code);
        let free = match self.current_is_limited {
            true => self.code_is_free(w, code),
            false => self.is_free(w, code, asked_v),
        };
        Held {
            voltage_v: clamp(w, asked_v, w.splat(0.0) - limit_v, limit_v),
            limited: all::<W>() & !w.bits(free),
        }
    }
}

/// As `f64::clamp`: what is not a number stays so.
#[inline(always)]
fn clamp<W: Width>(w: W, value: W::Vector, lowest: W::Vector, highest: W::Vector) -> W::Vector {
    w.smaller(highest, w.larger(lowest, value))
}

#[cfg(test)]
mod tests {
    use plant::One;

    use super::*;
    use crate::controllers::SampledLaw;
    use crate::number::seconds;
    use crate::runfile;

    /// Codes on steps, where the order of the sum decides: gains and errors with few
    /// digits put y + ½ on whole numbers, and the motor stands on the edge of a count.
    #[test]
    fn the_folded_sum_gives_the_codes_of_the_law_as_written() {
        let mut case = runfile::builtin("paper-2", &["controller.law=quantised".into()]).unwrap();
        let period_ns = case.controller.sample_time_ns.unwrap();
        let motion = case.motion.clone();
        let transmission = case.axis.transmission;
        let metres_per_rad = transmission.screw_pitch_m_per_rad * transmission.gear_ratio;
        let beta_per_count = transmission.gear_ratio / case.encoder.counts_per_rad;
        let (mut unlike, mut random) = (0, 1_u32);
        for variant in 0..400_u32 {
            case.controller.gains.kp = f64::from(1 + variant % 20) / 10.0;
            case.controller.gains.ki_per_s = f64::from(variant / 20) * 2.5;
            case.controller.gains.kd_s = f64::from(variant % 7) * 5e-4;
            let mut settings = Settings::<One>::new();
            settings.set(0, &case);
            let gains = settings.gains.map(|gain| gain.as_ref()[0]);
            let pid = Pid::new(gains, seconds(period_ns));
            let mut lane = Sampled::<f64, true>(pid, PidState::new(0.0));
            let mut folded_alone = PidState::new(0.0);
            let mut written = SampledLaw::new(&case, period_ns);
            for tick in 0..300 {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let alpha_ref =
                    motion.at(seconds(tick * period_ns)).displacement_m / metres_per_rad;
                let near = alpha_ref * case.encoder.counts_per_rad;
                let count = near.floor() - f64::from(random >> 28);
                // On the edge of a count, a bit above or below.
                let beta = (count + f64::from(random >> 27 & 1) * 1e-9) * beta_per_count;
                let count = case.encoder.count(beta / transmission.gear_ratio);
                let measured = Measurement {
                    tick,
                    position_counts: Steps::Whole(whole(count)),
                    load_counts: None,
                };
                let expected = written.step(measured).dac_code.real();
                let now = Instant {
                    tick,
                    beta,
                    gamma: beta,
                    alpha_ref,
                };
                let found = lane.sample(One, &settings, now);
                assert_eq!(found.count.to_bits(), count.to_bits(), "{variant} {tick}");
                assert_eq!(found.code.to_bits(), expected.to_bits(), "{variant} {tick}");
                let e = case.encoder.setpoint_count(alpha_ref) - count;
                let terms = pid.folded(&folded_alone, e);
                let sum = terms.proportional + (terms.integral - terms.derivative + 0.5);
                unlike += u32::from(sum.floor() != expected);
                pid.take(&mut folded_alone, e);
            }
        }
        // The contrast: without a look at how near the step is, codes differ.
        assert!(unlike >= 10, "{unlike}");
    }
}
