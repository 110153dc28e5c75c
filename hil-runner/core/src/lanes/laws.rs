//! The sampled laws side by side: the operations of `law`, in their order, so
//! that every lane gets the codes of the single run.

use plant::Width;

use crate::case::{Case, Law};
use crate::controllers::{FirmwareOnCounts, Pid, PidState};

/// A law in all lanes, with its memory.
pub(crate) trait LaneLaw<W: Width> {
    /// The codes for where the motors are and where they should be \[rad\], and
    /// the counts that they were computed from.
    fn code(
        &mut self,
        w: W,
        settings: &Settings<W>,
        alpha_rad: W::Vector,
        alpha_ref_rad: W::Vector,
    ) -> (W::Vector, W::Vector);
}

/// Rung `sampled`: real numbers.
#[derive(Debug)]
pub(crate) struct Sampled<V>(pub(crate) Pid<V>, pub(crate) PidState<V>);

/// Rung `quantised`: whole counts and whole codes.
#[derive(Debug)]
pub(crate) struct Quantised<V>(pub(crate) Pid<V>, pub(crate) PidState<V>);

/// Rung `firmware`: the `firmware` crate, lane after lane. A lane without a
/// controller gets the code 0.
#[derive(Debug)]
pub(crate) struct Firmware<'a>(pub(crate) &'a mut [Option<FirmwareOnCounts>]);

impl<W: Width> LaneLaw<W> for Sampled<W::Vector> {
    #[inline(always)]
    fn code(
        &mut self,
        w: W,
        settings: &Settings<W>,
        alpha_rad: W::Vector,
        alpha_ref_rad: W::Vector,
    ) -> (W::Vector, W::Vector) {
        let counts_per_rad = w.load(&settings.counts_per_rad);
        let position_counts = counts_per_rad * alpha_rad;
        let error_counts = counts_per_rad * alpha_ref_rad - position_counts;
        (self.0.output(&mut self.1, error_counts), position_counts)
    }
}

impl<W: Width> LaneLaw<W> for Quantised<W::Vector> {
    #[inline(always)]
    fn code(
        &mut self,
        w: W,
        settings: &Settings<W>,
        alpha_rad: W::Vector,
        alpha_ref_rad: W::Vector,
    ) -> (W::Vector, W::Vector) {
        let (setpoint, count) = counts(w, settings, alpha_rad, alpha_ref_rad);
        let y = self.0.output(&mut self.1, setpoint - count);
        // code = clamp(floor(y + ½), −2^(n−1), 2^(n−1) − 1)
        let code = settings.clamped_code(w, w.floor(y + w.splat(0.5)));
        (code, count)
    }
}

impl<W: Width> LaneLaw<W> for Firmware<'_> {
    #[inline(always)]
    fn code(
        &mut self,
        w: W,
        settings: &Settings<W>,
        alpha_rad: W::Vector,
        alpha_ref_rad: W::Vector,
    ) -> (W::Vector, W::Vector) {
        let (setpoint, count) = counts(w, settings, alpha_rad, alpha_ref_rad);
        let mut setpoints = W::array(0.0);
        let mut counts = W::array(0.0);
        let mut codes = W::array(0.0);
        w.store(setpoint, &mut setpoints);
        w.store(count, &mut counts);
        let inputs = setpoints.as_ref().iter().zip(counts.as_ref());
        for ((code, controller), (&setpoint, &count)) in
            codes.as_mut().iter_mut().zip(self.0.iter_mut()).zip(inputs)
        {
            if let Some(controller) = controller {
                *code = controller.code(setpoint, count);
            }
        }
        (w.load(&codes), count)
    }
}

/// Setpoint and position in whole counts: `floor(K_enc·α_ref + ½)` and
/// `floor(K_enc·α)`.
#[inline(always)]
fn counts<W: Width>(
    w: W,
    settings: &Settings<W>,
    alpha_rad: W::Vector,
    alpha_ref_rad: W::Vector,
) -> (W::Vector, W::Vector) {
    let counts_per_rad = w.load(&settings.counts_per_rad);
    (
        w.floor(counts_per_rad * alpha_ref_rad + w.splat(0.5)),
        w.floor(counts_per_rad * alpha_rad),
    )
}

/// Settings of the lanes, in memory. A lane without a run has zeros: its axis
/// stays at rest.
#[derive(Debug, Clone)]
pub(crate) struct Settings<W: Width> {
    /// `K_p`, `K_i`, `K_d`.
    pub(crate) gains: [W::Array; 3],
    /// `K_enc` \[counts/rad\].
    pub(crate) counts_per_rad: W::Array,
    /// Lowest and highest code; infinite on rung `sampled`.
    code_min: W::Array,
    code_max: W::Array,
    /// `K_dac` \[V\].
    step_v: W::Array,
    /// `K_a` and `V_max`.
    amplifier_gain: W::Array,
    voltage_limit_v: W::Array,
}

/// The voltage of a code, and 1 where code or amplifier stands at its limit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held<V> {
    pub(crate) voltage_v: V,
    pub(crate) limited: V,
}

impl<W: Width> Settings<W> {
    pub(crate) fn new() -> Self {
        let zero = W::array(0.0);
        Self {
            gains: [zero; 3],
            counts_per_rad: zero,
            code_min: zero,
            code_max: zero,
            step_v: zero,
            amplifier_gain: zero,
            voltage_limit_v: zero,
        }
    }

    pub(crate) fn set(&mut self, lane: usize, case: &Case) {
        let gains = &case.controller.gains;
        for (array, gain) in self
            .gains
            .iter_mut()
            .zip([gains.kp, gains.ki_per_s, gains.kd_s])
        {
            array.as_mut()[lane] = gain;
        }
        let (code_min, code_max) = match case.controller.law {
            Law::Sampled => (f64::NEG_INFINITY, f64::INFINITY),
            _ => (case.dac.code_min().into(), case.dac.code_max().into()),
        };
        for (array, value) in [
            (&mut self.counts_per_rad, case.encoder.counts_per_rad),
            (&mut self.code_min, code_min),
            (&mut self.code_max, code_max),
            (&mut self.step_v, case.dac.step_v),
            (&mut self.amplifier_gain, case.amplifier.gain),
            (&mut self.voltage_limit_v, case.amplifier.voltage_limit_v),
        ] {
            array.as_mut()[lane] = value;
        }
    }

    /// The code within the converter's range.
    #[inline(always)]
    pub(crate) fn clamped_code(&self, w: W, code: W::Vector) -> W::Vector {
        clamp(w, code, w.load(&self.code_min), w.load(&self.code_max))
    }

    /// `V_m = clamp(K_a·K_dac·code, ±V_max)`.
    #[inline(always)]
    pub(crate) fn held(&self, w: W, code: W::Vector) -> Held<W::Vector> {
        let (one, zero) = (w.splat(1.0), w.splat(0.0));
        let limit_v = w.load(&self.voltage_limit_v);
        let asked_v = w.load(&self.amplifier_gain) * (w.load(&self.step_v) * code);
        let free = w.greater(limit_v, w.abs(asked_v));
        let above = w.greater(code, w.load(&self.code_min));
        let below = w.greater(w.load(&self.code_max), code);
        let limited = w.select(free, zero, one);
        let limited = w.select(below, limited, one);
        Held {
            voltage_v: clamp(w, asked_v, zero - limit_v, limit_v),
            limited: w.select(above, limited, one),
        }
    }
}

/// As `f64::clamp`: what is not a number stays so.
#[inline(always)]
fn clamp<W: Width>(w: W, value: W::Vector, lowest: W::Vector, highest: W::Vector) -> W::Vector {
    w.smaller(highest, w.larger(lowest, value))
}
