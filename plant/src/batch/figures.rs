//! The figures at the ends of a step, and whether they may exceed their peaks
//! in between.

use super::lanes::{Batch, Before, Step};
use super::pending::{KEPT_PENDING, MOST_PENDING, Pending};
use super::phase::dot;
use super::width::Width;
use crate::exact::{CARRIAGE, FIGURES};

impl<W: Width> Batch<W> {
    /// ẍ, I, and how far carriage and motor are behind, at the end of a step.
    #[inline(always)]
    pub(super) fn figures_after(
        &self,
        step: &Step<W>,
        command_m: W::Vector,
    ) -> [W::Vector; FIGURES] {
        let (w, mode) = (self.width, &self.mode);
        let p = w.splat(self.axis.pitch_m_per_rad());
        let to = &step.to;
        // From ε as the single run knows it; and no torque is 0, not −0.
        let epsilon = to[1] + step.offset;
        let delta = epsilon - step.offset;
        let mut torque = w.load(&mode.stiffness) * delta + w.load(&mode.damping) * to[2];
        torque = torque + w.splat(0.0);
        if self.axis.joint.is_none() {
            let motor = self.axis.motor().torque_constant_nm_per_a;
            torque = (w.splat(motor) * to[3]) / w.splat(self.axis.gear_ratio());
        }
        let a1 = w.splat(self.axis.resistance().linear_ns_per_rad);
        let force = w.load(&mode.resistance_n) + a1 * (to[0] - to[2]);
        [
            p * ((torque - p * force) / w.splat(self.axis.moved_inertia())),
            to[3],
            command_m - p * (step.beta[1] - epsilon),
            command_m - p * step.beta[1],
        ]
    }

    /// Upper bounds of the figures' magnitudes within the step, and the lanes
    /// in which one of them exceeds the peak and the ends; −∞ where it cannot.
    #[inline(always)]
    pub(super) fn uppers(
        &self,
        phase: usize,
        step: &Step<W>,
        ends: &[W::Vector; FIGURES],
    ) -> ([W::Vector; FIGURES], u64) {
        let (w, phase) = (self.width, &self.phases[phase]);
        let all = (1_u64 << W::LANES) - 1;
        let (half, never) = (w.splat(0.5), w.splat(f64::NEG_INFINITY));
        let mut uppers = [never; FIGURES];
        let mut pending = 0;
        for (i, end) in ends.iter().enumerate() {
            let start = w.load(&self.figures[i]);
            let mut slope = dot(w, &phase.slopes[i], &step.change);
            if i >= CARRIAGE {
                slope = slope + w.load(&self.bend_m) * half;
            }
            let size = w.larger(w.abs(start), w.abs(*end));
            let known = w.larger(w.load(&self.floors[i]), w.load(&self.peaks[i]));
            let monotone = w.greater(w.abs(*end - start), slope);
            let mut below = w.at_most(size + slope * half, w.larger(size, known));
            if (w.bits(monotone) | w.bits(below)) & all == all {
                continue;
            }
            let mut chord = dot(w, &phase.chords[i], &step.change);
            if i >= CARRIAGE {
                chord = chord + w.load(&self.bend_m) * w.splat(0.125);
            }
            let upper = size + chord;
            below = w.at_most(upper, w.larger(size, known));
            uppers[i] = w.select(below, never, w.select(monotone, never, upper));
            pending |= !(w.bits(monotone) | w.bits(below)) & all;
        }
        (uppers, pending)
    }

    /// Lets the step wait for a closer look at the figures of all lanes but
    /// those of `moved`.
    #[inline(always)]
    pub(super) fn wait(
        &mut self,
        (phase, moved): (usize, u64),
        step: &Step<W>,
        before: &Before<W>,
        (ends, uppers): (&[W::Vector; FIGURES], &[W::Vector; FIGURES]),
    ) {
        if self.pending.len() >= MOST_PENDING {
            self.sift();
            if self.pending.len() > KEPT_PENDING {
                self.answer_all();
            }
        }
        let w = self.width;
        let mut upper = [W::array(f64::NEG_INFINITY); FIGURES];
        for (array, vector) in upper.iter_mut().zip(uppers) {
            w.store(*vector, array);
            for lane in (0..W::LANES).filter(|lane| moved >> lane & 1 != 0) {
                array.as_mut()[lane] = f64::NEG_INFINITY;
            }
        }
        // What the command does, from how far the motor is behind it.
        let p = w.splat(self.axis.pitch_m_per_rad());
        let motor = CARRIAGE + 1;
        let behind_m = ends[motor] - w.load(&self.figures[motor]);
        let size_m = p * w.larger(w.abs(step.beta[0]), w.abs(step.beta[1]));
        let mut pending = Pending {
            upper,
            figures: self.figures,
            command_m: W::array(0.0),
            size_m: W::array(0.0),
            time_ns: self.time_ns,
            phase,
            state: before.state,
            offset_rad: self.mode.offset_rad,
            joint: self.mode.joint,
            closed: self.phases[phase].closed,
            voltage_v: before.voltage_v,
            enclosed: false,
        };
        let command_m = behind_m + p * (step.beta[1] - step.beta[0]);
        w.store(command_m, &mut pending.command_m);
        w.store(size_m, &mut pending.size_m);
        self.pending.push(pending);
    }
}
