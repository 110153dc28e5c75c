//! Lanes that leave the common step and are not followed side by side: they
//! are single runs for as long as it lasts.

use super::group::Group;
use super::lanes::Shared;
use super::question::Question;
use super::step::Leaving;
use super::width::Width;
use crate::hybrid::Automaton;
use crate::hybrid::PlantError;
use crate::model::axis::Drive;
use crate::model::state::State;
use crate::observe::extremes::Extremes;
use crate::observe::extremes::FIGURES;

/// The single run that a lane is.
#[derive(Debug, Clone)]
pub(crate) struct Lane {
    pub(crate) plant: Automaton,
    pub(crate) extremes: Extremes,
    pub(crate) result: Result<(), PlantError>,
    /// Where a figure may have exceeded its peak.
    pub(super) questions: Vec<Question>,
}

impl Lane {
    pub(super) fn new(plant: Automaton, extremes: Extremes) -> Self {
        Self {
            plant,
            extremes,
            result: Ok(()),
            questions: Vec::new(),
        }
    }

    /// Another run; the room for questions is kept.
    pub(super) fn start(&mut self, plant: Automaton, extremes: Extremes) {
        (self.plant, self.extremes, self.result) = (plant, extremes, Ok(()));
        self.questions.clear();
    }

    /// Raises the run's peaks to those of the batch.
    pub(crate) fn raise<A: AsRef<[f64]>>(&mut self, peaks: &[A; FIGURES], lane: usize) {
        for (peak, figure) in peaks.iter().zip(self.extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
    }
}

impl<W: Width> Group<W> {
    /// Looks at the settling band in the step that begins now, in the lanes of
    /// `wanted`.
    #[cold]
    #[inline(never)]
    pub(super) fn look_at_band(
        &mut self,
        shared: &mut Shared,
        phase: usize,
        wanted: u64,
        voltage_v: W::Vector,
    ) {
        let time_ns = self.track.now().time_ns;
        let mut held = W::array(0.0);
        self.width.store(voltage_v, &mut held);
        for lane in (0..W::LANES).filter(|lane| wanted >> lane & 1 != 0) {
            let y = self.state(lane);
            let run = &mut self.lanes[lane];
            run.plant.set(&y, time_ns);
            let length_ns = shared.phases[phase].length_ns;
            let (tables, extremes) = (&mut shared.tables, &mut run.extremes);
            run.plant
                .look_at_band(tables, (held.as_ref()[lane], length_ns), extremes);
        }
    }

    /// Advances a lane as a single run.
    #[cold]
    #[inline(never)]
    pub(super) fn advance_lane(&mut self, shared: &mut Shared, left: &Leaving) {
        let lane = left.lane;
        let run = &mut self.lanes[lane];
        run.plant.set(&left.y, left.time_ns);
        run.raise(&self.peaks, lane);
        run.raise(&self.track.ends, lane);
        let mode = run.plant.mode;
        // From here on the single run goes on with the sum.
        run.extremes.joint_loss_j = self.joint_loss_j.as_ref()[lane];
        if run.result.is_ok() {
            run.result = run.plant.advance_exactly(
                &mut shared.tables,
                &Drive::Held(left.voltage_v),
                shared.phases[left.phase].length_ns,
                &mut run.extremes,
            );
        }
        self.joint_loss_j.as_mut()[lane] = run.extremes.joint_loss_j;
        let y = run.plant.state();
        let changed = run.plant.mode != mode || run.plant.fresh.is_some();
        self.raise_floors(lane);
        let changed = changed || self.mode.is_unsure(lane);
        self.put(shared, (lane, changed), &y, left.commands_m[1]);
    }

    /// Puts a lane to where its run is, in another mode if it has changed.
    pub(super) fn put(
        &mut self,
        shared: &mut Shared,
        (lane, changed): (usize, bool),
        y: &State,
        command_m: f64,
    ) {
        let values = [
            y.beta_rad,
            y.beta_dot_radps,
            y.epsilon_rad,
            y.epsilon_dot_radps,
            y.current_a,
        ];
        for (array, value) in self.track.now_mut().state.iter_mut().zip(values) {
            array.as_mut()[lane] = value;
        }
        let figures = self.lanes[lane].plant.figures(command_m);
        self.acceleration_mps2.as_mut()[lane] = figures[0];
        for (start, figure) in self.track.starts.iter_mut().zip(figures) {
            let start = &mut start.as_mut()[lane];
            *start = start.max(figure.abs());
        }
        if changed {
            self.take_mode(shared, lane);
        }
    }
}
