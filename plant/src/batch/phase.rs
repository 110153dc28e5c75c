//! The numbers of one step over all lanes: what a lane's mode decides.

use super::width::Width;
use crate::exact::{BOUND_MARGIN, Column, HELD, HeldTable, Quantity};

/// The states that drive something: β̇, δ, ε̇ and I. β does not.
pub(crate) const DRIVING: usize = 4;

/// Coefficients of the four driving states, one number per lane.
pub(crate) type Row<W> = [<W as Width>::Array; DRIVING];

/// One step of all lanes.
#[derive(Debug, Clone)]
pub(crate) struct Phase<W: Width> {
    pub(crate) length_ns: u64,
    pub(crate) transition: [Row<W>; HELD],
    pub(crate) drift: [W::Array; HELD],
    pub(crate) per_volt: [W::Array; HELD],
    /// How far δ may stray from its chord, per change of the states.
    pub(crate) gap_bound: Row<W>,
    /// δ at the quarters of the step less its start, and how far it may stray
    /// from the chords between them, likewise.
    pub(crate) gap_points: [Row<W>; 3],
    pub(crate) gap_fine_bound: Row<W>,
    /// Changes of ẍ, I, p·γ and p·β above which they are monotone, likewise.
    pub(crate) slopes: [Row<W>; FIGURES],
    /// How far they may stray from their chords.
    pub(crate) chords: [Row<W>; FIGURES],
}

/// Figures that are looked at between the samples.
pub(crate) const FIGURES: usize = 4;

impl<W: Width> Phase<W> {
    pub(crate) fn new(length_ns: u64) -> Self {
        let zero = W::array(0.0);
        Self {
            length_ns,
            transition: [[zero; DRIVING]; HELD],
            drift: [zero; HELD],
            per_volt: [zero; HELD],
            gap_bound: [zero; DRIVING],
            gap_points: [[zero; DRIVING]; 3],
            gap_fine_bound: [zero; DRIVING],
            slopes: [[zero; DRIVING]; FIGURES],
            chords: [[zero; DRIVING]; FIGURES],
        }
    }

    /// A state at the end of the step, in the order of `Kernel::step`.
    #[inline(always)]
    pub(crate) fn row(
        &self,
        w: W,
        state: usize,
        from: &[W::Vector; DRIVING],
        base: W::Vector,
        voltage_v: W::Vector,
    ) -> W::Vector {
        let phi = &self.transition[state];
        let rotor = w.load(&phi[0]) * from[0] + w.load(&phi[1]) * from[1];
        let joint = w.load(&phi[2]) * from[2] + w.load(&phi[3]) * from[3];
        ((rotor + joint) + base) + w.load(&self.per_volt[state]) * voltage_v
    }

    /// Sets one lane to the step of a table.
    pub(crate) fn set(&mut self, lane: usize, table: &HeldTable, pitch_m_per_rad: f64) {
        let kernel = &table.kernel;
        for row in 0..HELD {
            for (to, from) in self.transition[row].iter_mut().zip(&kernel.transition[row]) {
                to.as_mut()[lane] = *from;
            }
            self.drift[row].as_mut()[lane] = kernel.drift[row];
            self.per_volt[row].as_mut()[lane] = kernel.per_volt[row];
        }
        let bounds = |quantity: Quantity| &table.table.quantity(quantity).bounds;
        let gap = &bounds(Quantity::Delta).per_change;
        for j in 0..DRIVING {
            self.gap_bound[j].as_mut()[lane] = BOUND_MARGIN * gap[j + 1];
        }
        // Without quarters an infinite bound, which excludes nothing.
        let none = ([Column::zeros(); 3], Column::repeat(f64::INFINITY));
        let (points, fine) = table.gap_quarters.unwrap_or(none);
        for j in 0..DRIVING {
            for (row, point) in self.gap_points.iter_mut().zip(&points) {
                row[j].as_mut()[lane] = point[j + 1];
            }
            self.gap_fine_bound[j].as_mut()[lane] = BOUND_MARGIN * fine[j + 1];
        }
        let p = pitch_m_per_rad;
        let figures = [
            (Quantity::ScrewAcceleration, p),
            (Quantity::Current, 1.0),
            (Quantity::ScrewAngle, p),
            (Quantity::GearAngle, p),
        ];
        for (i, (quantity, scale)) in figures.into_iter().enumerate() {
            let bounds = bounds(quantity);
            for j in 0..DRIVING {
                let scale = BOUND_MARGIN * scale;
                self.slopes[i][j].as_mut()[lane] = scale * bounds.slope_per_change[j + 1];
                self.chords[i][j].as_mut()[lane] = scale * bounds.per_change[j + 1];
            }
        }
    }
}
