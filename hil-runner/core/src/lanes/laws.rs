//! The sampled laws side by side: the operations of `law`, in their order, so
//! that every lane gets the codes of the single run.

use plant::Width;

use super::settings::Settings;
use crate::controllers::{FirmwareOnCounts, Pid};

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
pub(crate) struct Sampled<V>(pub(crate) Pid<V>);

/// Rung `quantised`: whole counts and whole codes.
#[derive(Debug)]
pub(crate) struct Quantised<V>(pub(crate) Pid<V>);

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
        (self.0.output(error_counts), position_counts)
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
        let y = self.0.output(setpoint - count);
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
