//! What a lane needs around a change of contact: the solution within a step with the joint
//! open or closed, the bounds of its figures and guards, and its energies.

use crate::exact::{
    BOUND_MARGIN, DRIVING, Dissipation, Grid, HELD, HeldTable, Matrix, PARTS, Quantity, Sketch,
    heat_of_part,
};
use crate::model::axis::Axis;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA_DOT, CURRENT, EPSILON, EPSILON_DOT};
use crate::numerics::width::Width;
use crate::observe::extremes::{ENERGIES, FIGURES};

/// States in lanes: β, β̇, δ, ε̇ and I.
pub(super) type States<W> = [<W as Width>::Vector; HELD];

/// The numbers of one step.
#[derive(Debug, Clone)]
pub(super) struct LaneGrid {
    pub(super) length_s: f64,
    pub(super) a: Matrix<HELD>,
    pub(super) grid: Grid<HELD>,
    /// δ over the step.
    pub(super) sketch: Sketch<HELD>,
    /// Bounds of how far the figures stray from their chords over the step, or twice
    /// that over a part of it.
    pub(super) chords: [[f64; DRIVING]; FIGURES],
    guide: GuideMode,
    /// a0 against the motion \[N\].
    resistance_n: f64,
    /// Bound of how far what the guide's guard looks at strays from its chord over the step,
    /// or twice that over a part of it; 0 without friction.
    guide_chord: [f64; DRIVING],
    /// k and c while a flank carries, else 0.
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// See `Axis::current_noise`.
    pub(super) current_noise: f64,
    /// What makes the energies of a part of the step.
    loss: Option<Dissipation<DRIVING>>,
    armature: Dissipation<PARTS>,
}

impl LaneGrid {
    /// The numbers of a table; `None` where a sample has no sketch, or the joint
    /// no gap.
    pub(super) fn of(table: &HeldTable, axis: &Axis) -> Option<Self> {
        let joint = axis.joint?;
        let grid = table.table.grid.as_ref()?;
        let sketch = table.table.quantity(Quantity::Delta).sketch.as_ref()?;
        let carries = if table.closed { 1.0 } else { 0.0 };
        let mut noisy = *axis;
        noisy.set_parting_noise(0.0, table.length_s());
        Some(Self {
            current_noise: noisy.current_noise,
            length_s: grid.length_s,
            a: table.system.a,
            grid: grid.clone(),
            sketch: sketch.clone(),
            chords: figures(axis).map(|(quantity, scale)| {
                let linear = table.table.quantity(quantity);
                linear.chords(scale.abs() * BOUND_MARGIN)
            }),
            guide: table.guide,
            resistance_n: table.guide.direction() * axis.resistance.constant_n,
            guide_chord: Quantity::of_guide(table.guide).map_or([0.0; DRIVING], |quantity| {
                table.table.quantity(quantity).chords(BOUND_MARGIN)
            }),
            stiffness: carries * joint.stiffness_nm_per_rad,
            damping: carries * joint.damping_nms_per_rad,
            loss: table.loss.clone(),
            armature: table.armature.clone(),
        })
    }

    /// The energies of a part of the step from where the current and the rates are these.
    #[inline(always)]
    pub(super) fn energies<W: Width>(
        &self,
        w: W,
        (current, rate): (W::Vector, &States<W>),
        voltage_v: W::Vector,
        length_s: W::Vector,
    ) -> [W::Vector; ENERGIES] {
        let [_, rates @ ..] = *rate;
        let heat = (self.loss.as_ref(), &self.armature);
        let [joint_j, armature_j, charge_as] = heat_of_part(w, heat, (current, &rates), length_s);
        [joint_j, armature_j, voltage_v * charge_as]
    }

    /// ẍ \[m/s²\] with δ counted from an offset, in the order of
    /// `Axis::carriage_acceleration_mps2`.
    #[inline(always)]
    pub(super) fn acceleration<W: Width>(
        &self,
        w: W,
        axis: &Axis,
        offset: W::Vector,
        y: &States<W>,
    ) -> W::Vector {
        if self.guide == GuideMode::Stuck {
            return w.splat(0.0);
        }
        let p = w.splat(axis.pitch_m_per_rad);
        let linear = w.splat(axis.resistance.linear_ns_per_rad);
        let speed = y[BETA_DOT] - y[EPSILON_DOT];
        let force = w.splat(self.resistance_n) + linear * speed;
        let force = force + w.splat(axis.load_force_n);
        // No torque is 0, not −0.
        let torque = self.flank_torque(w, offset, y) + w.splat(0.0);
        (torque - p * force) * w.splat(axis.pitch_per_inertia)
    }

    /// Ψ while a flank carries, else 0.
    #[inline(always)]
    fn flank_torque<W: Width>(&self, w: W, offset: W::Vector, y: &States<W>) -> W::Vector {
        let delta = y[EPSILON] - offset;
        w.splat(self.stiffness) * delta + w.splat(self.damping) * y[EPSILON_DOT]
    }

    /// The lanes in which guide and current keep their modes over a part of the step between
    /// two states; the magnitudes of the rates at its start, and how far the current may
    /// stray from its chord, are these.
    #[inline(always)]
    pub(super) fn others_hold<W: Width>(
        &self,
        w: W,
        (axis, offset): (&Axis, W::Vector),
        [from, to]: [&States<W>; 2],
        (sizes, current_strays): (&States<W>, W::Vector),
    ) -> u64 {
        let mut holds = (1 << W::LANES) - 1;
        let two = w.splat(2.0);
        if let Some([_, limit_a]) = axis.stage.limits() {
            let ends = w.max(w.abs(from[CURRENT]), w.abs(to[CURRENT]));
            let within = w.splat(limit_a) - ends;
            holds &= w.bits(w.greater(within, two * current_strays));
        }
        if self.guide != GuideMode::AsWritten {
            let strays = two * sum(w, &self.guide_chord, sizes);
            let (from, to) = (
                self.guide_guard(w, (axis, offset), from),
                self.guide_guard(w, (axis, offset), to),
            );
            holds &= w.bits(w.greater(w.min(from, to), strays));
        }
        holds
    }

    /// The guard of a guide with friction.
    #[inline(always)]
    fn guide_guard<W: Width>(
        &self,
        w: W,
        (axis, offset): (&Axis, W::Vector),
        y: &States<W>,
    ) -> W::Vector {
        if self.guide == GuideMode::Stuck {
            let torque = self.flank_torque(w, offset, y) - w.splat(axis.load_torque_nm());
            return w.splat(axis.holding_torque_nm) - w.abs(torque);
        }
        w.splat(self.guide.direction()) * (y[BETA_DOT] - y[EPSILON_DOT])
    }

    /// Makes γ̇ = 0 to the last bit where friction holds the screw.
    #[inline(always)]
    pub(super) fn hold<W: Width>(&self, y: &mut States<W>) {
        if self.guide == GuideMode::Stuck {
            y[EPSILON_DOT] = y[BETA_DOT];
        }
    }
}

/// `Σ row_j·x_j` over the driving states, in their order.
#[inline(always)]
pub(super) fn sum<W: Width>(w: W, row: &[f64; DRIVING], x: &States<W>) -> W::Vector {
    let mut sum = w.splat(row[0]) * x[1];
    for j in 1..DRIVING {
        sum = sum + w.splat(row[j]) * x[j + 1];
    }
    sum
}

/// The quantities behind the figures, and what they are multiplied with.
pub(super) fn figures(axis: &Axis) -> [(Quantity, f64); FIGURES] {
    let p = axis.pitch_m_per_rad;
    [
        (Quantity::ScrewAcceleration, p),
        (Quantity::Current, 1.0),
        (Quantity::ScrewAngle, p),
        (Quantity::GearAngle, p),
        // The power, per volt.
        (Quantity::Current, 1.0),
    ]
}
