//! Lanes that leave the common step: they are single runs for as long as it
//! lasts.

use super::lanes::{Batch, Before, state_of};
use super::width::Width;
use crate::axis::Drive;
use crate::error::PlantError;
use crate::exact::FIGURES;
use crate::extremes::Extremes;
use crate::plant::Plant;
use crate::state::State;

/// The single run that a lane is.
#[derive(Debug, Clone)]
pub(crate) struct Lane {
    pub(crate) plant: Plant,
    pub(crate) extremes: Extremes,
    pub(crate) result: Result<(), PlantError>,
}

impl Lane {
    /// Raises the run's peaks to those of the batch.
    pub(crate) fn raise<A: AsRef<[f64]>>(&mut self, peaks: &[A; FIGURES], lane: usize) {
        for (peak, figure) in peaks.iter().zip(self.extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
    }
}

impl<W: Width> Batch<W> {
    /// After a step from `before`: advances the lanes of `moved` as single runs,
    /// and looks at the settling band in the step of those of `wanted`.
    #[cold]
    #[inline(never)]
    pub(crate) fn look_closer(
        &mut self,
        (phase, moved, wanted): (usize, u64, u64),
        before: &Before<W>,
        command_m: &W::Array,
    ) {
        for lane in 0..W::LANES {
            let bit = 1 << lane;
            if (moved | wanted) & bit == 0 {
                continue;
            }
            let voltage_v = before.voltage_v.as_ref()[lane];
            let y = state_of::<W>(&before.state, lane);
            let run = &mut self.lanes[lane];
            run.plant.set(&y, self.time_ns);
            run.raise(&before.peaks, lane);
            if moved & bit != 0 {
                self.advance_lane(phase, lane, before, command_m.as_ref()[lane]);
            } else {
                let length_ns = self.phases[phase].length_ns;
                let extremes = &mut run.extremes;
                run.plant
                    .look(&mut self.tables, voltage_v, length_ns, 0, extremes);
            }
        }
    }

    fn advance_lane(&mut self, phase: usize, lane: usize, before: &Before<W>, command_m: f64) {
        self.last_outside.as_mut()[lane] = before.last_outside.as_ref()[lane];
        for (new, old) in self.peaks.iter_mut().zip(&before.peaks) {
            new.as_mut()[lane] = old.as_ref()[lane];
        }
        let run = &mut self.lanes[lane];
        let mode = *run.plant.mode();
        // From here on the single run goes on with the sum.
        run.extremes.joint_loss_j = before.joint_loss_j.as_ref()[lane];
        if run.result.is_ok() {
            run.result = run.plant.advance_exactly(
                &mut self.tables,
                &Drive::Held(before.voltage_v.as_ref()[lane]),
                self.phases[phase].length_ns,
                &mut run.extremes,
            );
        }
        self.joint_loss_j.as_mut()[lane] = run.extremes.joint_loss_j;
        let y = run.plant.state();
        let figures = run.plant.figures(command_m);
        let changed = *run.plant.mode() != mode || run.plant.is_fresh();
        self.put(lane, &y);
        self.raise_floors(lane);
        for (array, value) in self.figures.iter_mut().zip(figures) {
            array.as_mut()[lane] = value;
        }
        if changed || self.mode.is_unsure(lane) {
            self.take_mode(lane);
        }
    }

    /// Sets a lane's state.
    fn put(&mut self, lane: usize, y: &State) {
        let values = [
            y.beta_rad,
            y.beta_dot_radps,
            y.epsilon_rad,
            y.epsilon_dot_radps,
            y.current_a,
        ];
        for (array, value) in self.state.iter_mut().zip(values) {
            array.as_mut()[lane] = value;
        }
    }
}
