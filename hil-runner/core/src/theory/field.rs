//! The margin of a case, and as a function of its gains: what a picture over
//! K_p and K_d contours.

use super::delay::DelayedLoop;
use super::family::LoopFamily;
use super::gains::{LoopGains, is_papers_loop, loop_gain};
use super::linear_axis::{JointState, LinearAxis};
use super::margin::Margin;
use crate::case::{Case, Law};
use plant::PidGains;

/// The margins of a case's linear loop: sampled, with hold and delay as they
/// are, or on rung `continuous` the paper's own. `None` where the loop is not
/// the paper's ([`is_papers_loop`]), its sample time or delay is not known, or
/// a rigid axis is asked for an open joint.
///
/// Works out a family for one case; whoever has many of one axis and timing
/// keeps the [`LoopFamily`].
pub fn margin(case: &Case, joint: JointState) -> Option<Margin> {
    if !is_papers_loop(case) {
        return None;
    }
    let gains = LoopGains::of(case);
    if case.controller.law == Law::Continuous {
        let axis = LinearAxis::new(&case.axis, joint)?;
        return Some(DelayedLoop::continuous(&axis, &gains).margin());
    }
    Some(LoopFamily::of(case, joint)?.margin(&gains))
}

/// The signed modulus margin over K_p and K_d, everything else as in a case.
///
/// ```
/// use hil_core::runfile;
/// use hil_core::theory::{JointState, MarginField};
///
/// let case = runfile::builtin("paper-2", &["controller.law=sampled".to_owned()])?;
/// let Some(field) = MarginField::of(&case, JointState::Closed) else {
///     return Ok(());
/// };
/// assert!(field.signed(3.2, 0.05) > 0.5);
/// assert!(field.signed(3.2, 30.0) < 0.0);
/// # Ok::<(), hil_core::runfile::RunFileErrors>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MarginField {
    family: LoopFamily,
    ki_per_s: f64,
    /// `K_0` \[V/rad per code/count\].
    k0: f64,
}

impl MarginField {
    /// The field of a case; `None` as for [`margin`], and on rung `continuous`.
    pub fn of(case: &Case, joint: JointState) -> Option<Self> {
        let sampled = case.controller.law != Law::Continuous && is_papers_loop(case);
        Some(Self {
            family: LoopFamily::of(case, joint).filter(|_| sampled)?,
            ki_per_s: case.controller.gains.ki_per_s,
            k0: loop_gain(case),
        })
    }

    /// `min |1 + L|`, negative where the loop is unstable
    /// ([`Margin::signed`]): continuous in both gains, and 0 on the border.
    /// `kp` in codes per count, `kd_s` in codes per (count per second).
    pub fn signed(&self, kp: f64, kd_s: f64) -> f64 {
        let gains = PidGains {
            kp,
            ki_per_s: self.ki_per_s,
            kd_s,
        };
        self.family
            .margin(&LoopGains::new(&gains, self.k0))
            .signed()
    }
}
