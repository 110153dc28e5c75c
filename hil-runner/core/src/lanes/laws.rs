//! The sampled laws side by side: the operations of `law`, in their order, so
//! that every lane gets the codes of the single run.

use plant::Width;

use crate::case::{Case, Law};
use crate::controllers::{FirmwareOnCounts, Pid, PidState};

/// A law in all lanes, with its memory.
pub(crate) trait LaneLaw<W: Width> {
    /// The codes for where the motors are and where they should be \[rad\], and
    /// the counts that they were computed from.
    fn code(&mut self, w: W, settings: &Settings<W>, angles_rad: [W::Vector; 2]) -> [W::Vector; 2];
}

/// Rung `sampled`, real numbers, or `quantised`: whole counts and whole codes.
#[derive(Debug)]
pub(crate) struct Sampled<V, const WHOLE: bool>(pub(crate) Pid<V>, pub(crate) PidState<V>);

/// Rung `firmware`: the `firmware` crate, lane after lane. A lane without a
/// controller gets the code 0.
#[derive(Debug)]
pub(crate) struct Firmware<'a>(pub(crate) &'a mut [Option<FirmwareOnCounts>]);

impl<W: Width, const WHOLE: bool> LaneLaw<W> for Sampled<W::Vector, WHOLE> {
    #[inline(always)]
    fn code(&mut self, w: W, settings: &Settings<W>, angles_rad: [W::Vector; 2]) -> [W::Vector; 2] {
        let [position, setpoint] = settings.counts::<WHOLE>(w, angles_rad);
        let y = self.0.output(&mut self.1, setpoint - position);
        if !WHOLE {
            return [y, position];
        }
        // code = clamp(floor(y + ½), −2^(n−1), 2^(n−1) − 1)
        let code = w.floor(y + w.splat(0.5));
        let (lowest, highest) = (w.load(&settings.code_min), w.load(&settings.code_max));
        [clamp(w, code, lowest, highest), position]
    }
}

impl<W: Width> LaneLaw<W> for Firmware<'_> {
    #[inline(always)]
    fn code(&mut self, w: W, settings: &Settings<W>, angles_rad: [W::Vector; 2]) -> [W::Vector; 2] {
        let [position, setpoint] = settings.counts::<true>(w, angles_rad);
        let [mut positions, mut setpoints, mut codes] = [W::array(0.0); 3];
        w.store(position, &mut positions);
        w.store(setpoint, &mut setpoints);
        let inputs = setpoints.as_ref().iter().zip(positions.as_ref());
        let lanes = codes.as_mut().iter_mut().zip(self.0.iter_mut());
        for ((code, controller), (&setpoint, &position)) in lanes.zip(inputs) {
            if let Some(controller) = controller {
                *code = controller.code(setpoint, position);
            }
        }
        [w.load(&codes), position]
    }
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
        let [kp, ki, kd] = &mut self.gains;
        let (code_min, code_max) = match case.controller.law {
            Law::Sampled => (f64::NEG_INFINITY, f64::INFINITY),
            _ => (case.dac.code_min().into(), case.dac.code_max().into()),
        };
        for (array, value) in [
            (kp, gains.kp),
            (ki, gains.ki_per_s),
            (kd, gains.kd_s),
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

    /// Position and setpoint in counts, `K_enc·α` and `K_enc·α_ref`, or in whole
    /// ones: `floor(K_enc·α)` and `floor(K_enc·α_ref + ½)`.
    #[inline(always)]
    fn counts<const WHOLE: bool>(
        &self,
        w: W,
        [alpha, alpha_ref]: [W::Vector; 2],
    ) -> [W::Vector; 2] {
        let counts_per_rad = w.load(&self.counts_per_rad);
        let (position, setpoint) = (counts_per_rad * alpha, counts_per_rad * alpha_ref);
        if WHOLE {
            [w.floor(position), w.floor(setpoint + w.splat(0.5))]
        } else {
            [position, setpoint]
        }
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
