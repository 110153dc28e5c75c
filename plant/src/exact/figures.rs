//! What the figures of a run look at on one piece of the exact solution.

use super::advance::HeldPiece;
use super::feedback::FeedbackPiece;
use super::peak::Sought;
use super::system::{Column, FEEDBACK, HELD, held_state};
use super::tables::{Linear, Quantity, Table};
use super::walk::{Flow, Leg};
use crate::axis::Axis;
use crate::mode::AmplifierMode;
use crate::motion::Motion;
use crate::state::Vector;

/// One piece of the solution with the quantities that figures are made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sights<'a, const D: usize> {
    flow: Flow<'a, D>,
    /// The piece from end to end, with the shortest of the table's steps that
    /// is no shorter.
    leg: Leg<D>,
    /// 1 where the piece is as long as that step. The chord of a shorter one
    /// lies up to once the deviation from the longer one's, which makes 2.
    slack: f64,
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
        end: &Column<D>,
        length_s: f64,
    ) -> Self {
        let p = axis.pitch_m_per_rad();
        let steps = &table.levels.steps;
        let level = steps
            .iter()
            .rposition(|step| step.length_s >= length_s)
            .unwrap_or(0);
        let leg = Leg {
            start_s: 0.0,
            length_s,
            from: *flow.start,
            rate: table.levels.a * flow.start + flow.input,
            to: *end,
            level,
        };
        let slack = if steps[level].length_s == length_s {
            1.0
        } else {
            2.0
        };
        let of = |quantity, scale, offset| sought(table.quantity(quantity), scale, offset);
        Self {
            flow,
            leg,
            slack,
            acceleration: of(Quantity::ScrewAcceleration, p, p * screw_load),
            current: of(Quantity::Current, 1.0, 0.0),
            voltage: None,
            carriage: of(Quantity::ScrewAngle, p, -p * offset_rad),
            motor: of(Quantity::GearAngle, p, 0.0),
        }
    }

    /// Raises `peak` to the supremum of the quantity's magnitude within the
    /// piece; the ends are known.
    pub(crate) fn raise(&self, sought: &Sought<'a, D>, peak: &mut f64) {
        if !sought.stays_below(&self.leg, self.slack, *peak)
            && let Some(within) = self.flow.peak_within(sought, self.leg.length_s, *peak)
        {
            *peak = peak.max(within);
        }
    }

    /// Raises `peak` to the supremum of |command − quantity| within the piece;
    /// where the command is not smooth, that of its parts.
    pub(crate) fn raise_behind(
        &self,
        sought: &Sought<'a, D>,
        motion: &'a Motion,
        start_s: f64,
        peak: &mut f64,
    ) {
        let behind = Sought {
            command: Some((motion, start_s)),
            ..*sought
        };
        if behind.stays_below(&self.leg, self.slack, *peak) {
            return;
        }
        let length_s = self.leg.length_s;
        let mut from_s = 0.0;
        let inner = motion.breaks_s().map(|t| t - start_s);
        for to_s in inner.into_iter().chain([length_s]) {
            if to_s <= from_s || to_s > length_s {
                continue;
            }
            let start: Column<D> = self.flow.at(from_s);
            let flow = Flow {
                start: &start,
                ..self.flow
            };
            let part = Sought {
                command: Some((motion, start_s + from_s)),
                ..*sought
            };
            if to_s < length_s {
                *peak = peak.max(part.value(&self.flow.at(to_s), to_s - from_s).abs());
            }
            if let Some(within) = flow.peak_within(&part, to_s - from_s, *peak) {
                *peak = peak.max(within);
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
        let length_s = self.leg.length_s;
        if distance.value(&self.leg.to, length_s).abs() > band_m {
            return Some(length_s);
        }
        let (chord, _) = distance.strays(&self.leg);
        let from = distance.value(&self.leg.from, 0.0).abs();
        if from.max(distance.value(&self.leg.to, length_s).abs()) + self.slack * chord <= band_m {
            return None;
        }
        self.flow.last_outside(&distance, band_m, length_s)
    }
}

impl HeldPiece<'_> {
    pub(crate) fn sights(&self, axis: &Axis, end: &Vector, length_s: f64) -> Sights<'_, HELD> {
        let table = &self.table.table;
        let constants = (self.offset_rad, self.table.system.screw_load);
        let end = held_state(end, self.offset_rad);
        Sights::new(axis, self.flow(), table, constants, &end, length_s)
    }
}

impl FeedbackPiece<'_> {
    pub(crate) fn sights(
        &self,
        axis: &Axis,
        amplifier: AmplifierMode,
        length_s: f64,
    ) -> Sights<'_, FEEDBACK> {
        let table = &self.table.table;
        let constants = (self.offset_rad, self.table.screw_load);
        let end = self.end;
        let mut sights = Sights::new(axis, self.flow(), table, constants, &end, length_s);
        if amplifier == AmplifierMode::Linear {
            let demand = table.quantity(Quantity::Demand);
            sights.voltage = Some(sought(demand, 1.0, 0.0));
        }
        sights
    }
}
