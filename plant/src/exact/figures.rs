//! What the figures of a run look at on one piece of the exact solution.

use super::advance::{FeedbackPiece, HeldPiece};
use super::peak::Sought;
use super::system::Column;
use super::tables::{Linear, Quantity, Table};
use super::walk::{Flow, Leg};
use crate::axis::Axis;
use crate::mode::AmplifierMode;
use crate::motion::Motion;

/// One piece of the solution with the quantities that figures are made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sights<'a, const D: usize> {
    flow: Flow<'a, D>,
    length_s: f64,
    /// The whole piece as one step, where it is as long as the table's.
    whole: Option<Leg<D>>,
    /// ẍ.
    pub(crate) acceleration: Sought<'a, D>,
    /// I.
    pub(crate) current: Sought<'a, D>,
    /// The demand, where the voltage follows it.
    pub(crate) voltage: Option<Sought<'a, D>>,
    /// `p·γ`.
    pub(crate) carriage: Sought<'a, D>,
    /// `p·β`.
    pub(crate) motor: Sought<'a, D>,
}

fn sought<const D: usize>(linear: &Linear<D>, scale: f64, offset: f64) -> Sought<'_, D> {
    Sought {
        linear,
        scale,
        offset,
        command: None,
    }
}

impl<'a, const D: usize> Sights<'a, D> {
    fn new(
        axis: &Axis,
        flow: Flow<'a, D>,
        table: &'a Table<D>,
        (offset_rad, screw_load): (f64, f64),
        length_s: f64,
    ) -> Self {
        let p = axis.pitch_m_per_rad();
        let step = &table.levels.steps[0];
        let whole = (length_s == step.length_s).then(|| {
            let rate = table.levels.a * flow.start + flow.input;
            Leg {
                start_s: 0.0,
                length_s,
                from: *flow.start,
                rate,
                to: flow.start + step.integral * rate,
                level: 0,
            }
        });
        let of = |quantity, scale, offset| sought(table.quantity(quantity), scale, offset);
        Self {
            flow,
            length_s,
            whole,
            acceleration: of(Quantity::ScrewAcceleration, p, p * screw_load),
            current: of(Quantity::Current, 1.0, 0.0),
            voltage: None,
            carriage: of(Quantity::ScrewAngle, p, -p * offset_rad),
            motor: of(Quantity::GearAngle, p, 0.0),
        }
    }

    /// Raises `peak` to the supremum of the quantity's magnitude.
    pub(crate) fn raise(&self, sought: &Sought<'a, D>, peak: &mut f64) {
        if let Some(leg) = &self.whole
            && sought.upper_bound(leg) <= *peak
        {
            return;
        }
        *peak = peak.max(self.flow.peak(sought, self.length_s));
    }

    /// Raises `peak` to the supremum of |command − quantity|; `breaks_s` are
    /// the instants at which the command is not smooth.
    pub(crate) fn raise_behind(
        &self,
        sought: &Sought<'a, D>,
        motion: &'a Motion,
        start_s: f64,
        peak: &mut f64,
    ) {
        let mut from_s = 0.0;
        let breaks_s = motion.breaks_s();
        let inner = breaks_s.iter().map(|t| t - start_s);
        for to_s in inner.chain([self.length_s]) {
            if to_s <= from_s || to_s > self.length_s {
                continue;
            }
            let behind = Sought {
                command: Some((motion, start_s + from_s)),
                ..*sought
            };
            if from_s == 0.0 && to_s == self.length_s {
                self.raise(&behind, peak);
            } else {
                let start: Column<D> = self.flow.at(from_s);
                let flow = Flow {
                    start: &start,
                    ..self.flow
                };
                *peak = peak.max(flow.peak(&behind, to_s - from_s));
            }
            from_s = to_s;
        }
    }

    /// When the carriage is last further than `band_m` from `target_m`,
    /// counted from the start of the piece \[s\].
    pub(crate) fn last_outside(&self, target_m: f64, band_m: f64) -> Option<f64> {
        let distance = Sought {
            scale: -self.carriage.scale,
            offset: target_m - self.carriage.offset,
            ..self.carriage
        };
        if let Some(leg) = &self.whole
            && distance.upper_bound(leg) <= band_m
        {
            return None;
        }
        self.flow.last_outside(&distance, band_m, self.length_s)
    }
}

impl HeldPiece<'_> {
    pub(crate) fn sights(&self, axis: &Axis, length_s: f64) -> Sights<'_, { super::system::HELD }> {
        let table = &self.table.table;
        let constants = (self.offset_rad, self.table.system.screw_load);
        Sights::new(axis, self.flow(), table, constants, length_s)
    }
}

impl FeedbackPiece<'_> {
    pub(crate) fn sights(
        &self,
        axis: &Axis,
        amplifier: AmplifierMode,
        length_s: f64,
    ) -> Sights<'_, { super::system::FEEDBACK }> {
        let table = &self.table.table;
        let constants = (self.offset_rad, self.table.screw_load);
        let mut sights = Sights::new(axis, self.flow(), table, constants, length_s);
        if amplifier == AmplifierMode::Linear {
            let demand = table.quantity(Quantity::Demand);
            sights.voltage = Some(sought(demand, 1.0, 0.0));
        }
        sights
    }
}
