//! What the dampers of all lanes' joints take in a step, in the order of
//! [`crate::exact::Dissipation::over`].

use super::lanes::{Batch, Step};
use super::phase::{DRIVING, closed_lanes};
use super::width::Width;
use crate::exact::HeldTable;
use crate::state::{BETA_DOT, CURRENT, EPSILON_DOT};

/// The numbers of the closed joint; all lanes have the same.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LaneLoss {
    /// c; 0 as long as no joint was closed, and without damping.
    damping_nms_per_rad: f64,
    /// β̈ from δ, ε̇ and I.
    gear: [f64; 3],
    /// ε̈ from β̇, δ, ε̇ and I, and its constant part.
    joint: [f64; DRIVING],
    load: f64,
    /// İ from β̇, I and V.
    current: [f64; 3],
    /// R, upper triangular.
    factor: [[f64; DRIVING]; DRIVING],
}

impl LaneLoss {
    /// That of a table of the closed joint.
    pub(crate) fn new(table: &HeldTable) -> Self {
        let Some(loss) = &table.loss else {
            return Self::default();
        };
        let (damping_nms_per_rad, factor) = loss.whole();
        let system = &table.system;
        let row = |state: usize| -> [f64; DRIVING] {
            core::array::from_fn(|j| system.a[(state, BETA_DOT + j)])
        };
        let ([_, delta, speed, current], joint) = (row(BETA_DOT), row(EPSILON_DOT));
        let [induced, _, _, resistive] = row(CURRENT);
        Self {
            damping_nms_per_rad,
            gear: [delta, speed, current],
            joint,
            load: system.load[EPSILON_DOT],
            current: [induced, resistive, system.per_volt],
            factor: core::array::from_fn(|i| core::array::from_fn(|j| factor[(i, j)])),
        }
    }
}

impl<W: Width> Batch<W> {
    /// What the dampers take in a step \[J\]: `c·|R·v|²` with the rates v at its
    /// start, 0 where the joint is open.
    #[inline(always)]
    pub(super) fn joint_loss_of(
        &self,
        phase: usize,
        step: &Step<W>,
        voltage_v: W::Vector,
    ) -> W::Vector {
        let (w, phase) = (self.width, &self.phases[phase]);
        let (loss, zero) = (&phase.loss, w.splat(0.0));
        let closed = closed_lanes(w, &phase.closed);
        if loss.damping_nms_per_rad == 0.0 || w.bits(closed) == 0 {
            return zero;
        }
        let [beta_dot, delta, epsilon_dot, current] = step.from;
        let times = |coefficient: f64, x: W::Vector| w.splat(coefficient) * x;
        // Without the terms that are zero, which change no sum.
        let [d, e, i] = loss.gear;
        let gear = times(d, delta) + (times(e, epsilon_dot) + times(i, current));
        let [b, d, e, i] = loss.joint;
        let joint = (times(b, beta_dot) + times(d, delta))
            + (times(e, epsilon_dot) + times(i, current))
            + w.splat(loss.load);
        let [b, i, v] = loss.current;
        let armature = (times(b, beta_dot) + times(i, current)) + times(v, voltage_v);
        let rates = [gear, epsilon_dot, joint, armature];
        let mut sum = zero;
        for (i, row) in loss.factor.iter().enumerate() {
            let mut part = times(row[i], rates[i]);
            for j in i + 1..DRIVING {
                part = part + times(row[j], rates[j]);
            }
            sum = sum + part * part;
        }
        w.select(closed, times(loss.damping_nms_per_rad, sum), zero)
    }
}
