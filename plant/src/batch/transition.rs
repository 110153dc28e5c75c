//! A step with one change of contact, lane by lane: what `Automaton::advance_held`
//! does with it, in the same order of operations. Lanes in which something else
//! happens, or in which the sketches leave a question open, are told apart.

use super::phase::{Kind, Phase};
use crate::exact::{
    Curve, DELTA, DRIVING, ELEVENTH, Grid, HELD, HeldTable, NOISE_ULPS, Quantity, SLOPES, Sketch,
    times_sizes, zero_near,
};
use crate::model::axis::{Axis, NOISE_PER_BACKLASH};
use crate::model::joint::ElasticJoint;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT};
use crate::numerics::width::Width;
use crate::observe::extremes::{CARRIAGE, ENERGIES, FIGURES};

/// States in lanes: β, β̇, δ, ε̇ and I.
type States<W> = [<W as Width>::Vector; HELD];

/// Starts of the lanes in the step.
#[derive(Debug, Clone)]
pub(super) struct TransitionStart<W: Width> {
    /// β, β̇, ε, ε̇ and I.
    pub(super) y: [W::Array; HELD],
    pub(super) voltage_v: W::Array,
    /// The flank in contact: −1, 0 or 1.
    pub(super) flank: W::Array,
    pub(super) backlash_half_rad: W::Array,
    /// x_ref at both ends \[m\].
    pub(super) commands_m: [W::Array; 2],
    /// `T²·sup|a_ref|` \[m\].
    pub(super) bend_m: W::Array,
    /// `β(0)`, from which β is counted \[rad\].
    pub(super) start_rad: W::Array,
}

/// A step in one kind of mode, as a change of contact within it needs it.
#[derive(Debug, Clone, Copy)]
pub(super) struct KindOfStep<'a> {
    axis: &'a Axis,
    joint: &'a ElasticJoint,
    table: &'a HeldTable,
    grid: &'a Grid<HELD>,
    /// δ over the step.
    sketch: &'a Sketch<HELD>,
    /// Bounds of how far the figures stray from their chords over the step, or twice that over
    /// a part of it, with the joint open and closed.
    chords: &'a [[[f64; DRIVING]; 2]; FIGURES],
}

impl<'a> KindOfStep<'a> {
    /// `None` where a sample has no sketch, or the joint no gap.
    pub(super) fn new(axis: &'a Axis, phase: &'a Phase, kind: Kind) -> Option<Self> {
        let table = phase.of(kind)?;
        Some(Self {
            axis,
            joint: axis.joint.as_ref()?,
            table,
            grid: table.table.grid.as_ref()?,
            sketch: table.table.quantity(Quantity::Delta).sketch.as_ref()?,
            chords: &phase.chords,
        })
    }

    /// Bounds of how far the figures stray from their chords, by the magnitudes of the rates.
    #[inline(always)]
    fn strays<W: Width>(&self, w: W, sizes: W::Quad) -> [W::Vector; FIGURES] {
        let mut strays = [w.splat(0.0); FIGURES];
        for (stray, rows) in strays.iter_mut().zip(self.chords) {
            *stray = times_sizes(w, &rows[usize::from(self.table.closed)], sizes);
        }
        strays
    }

    /// ẍ \[m/s²\] with δ counted from an offset, in the order of
    /// `Axis::carriage_acceleration_mps2`.
    #[inline(always)]
    fn acceleration<W: Width>(&self, w: W, offset: W::Vector, y: &States<W>) -> W::Vector {
        let (axis, guide) = (self.axis, self.table.guide);
        if guide == GuideMode::Stuck {
            return w.splat(0.0);
        }
        let p = w.splat(axis.pitch_m_per_rad);
        let resistance = &axis.resistance;
        let linear = w.splat(resistance.linear_ns_per_rad) * (y[BETA_DOT] - y[EPSILON_DOT]);
        let force = w.splat(guide.direction() * resistance.constant_n) + linear;
        let force = force + w.splat(axis.load_force_n);
        // No torque is 0, not −0.
        let torque = self.flank_torque(w, offset, y) + w.splat(0.0);
        (torque - p * force) * w.splat(axis.pitch_per_inertia)
    }

    /// Ψ while a flank carries, else 0.
    #[inline(always)]
    fn flank_torque<W: Width>(&self, w: W, offset: W::Vector, y: &States<W>) -> W::Vector {
        let carries = if self.table.closed { 1.0 } else { 0.0 };
        let k = w.splat(carries * self.joint.stiffness_nm_per_rad);
        let c = w.splat(carries * self.joint.damping_nms_per_rad);
        k * (y[EPSILON] - offset) + c * y[EPSILON_DOT]
    }

    /// The lanes in which guide and current keep their modes over a part of the step between
    /// two states, where the magnitudes of the rates at its start are these.
    #[inline(always)]
    fn others_hold<W: Width>(
        &self,
        w: W,
        offset: W::Vector,
        [from, to]: [&States<W>; 2],
        sizes: W::Quad,
    ) -> u64 {
        let mut holds = (1 << W::LANES) - 1;
        let (two, step) = (w.splat(2.0), &self.table.step);
        if let Some([_, limit_a]) = self.axis.stage.limits() {
            let ends = w.max(w.abs(from[CURRENT]), w.abs(to[CURRENT]));
            let within = w.splat(limit_a) - ends;
            holds &= w.bits(w.greater(within, two * step.current_strays(w, sizes)));
        }
        if self.table.guide != GuideMode::AsWritten {
            let (from, to) = (
                self.guide_guard(w, offset, from),
                self.guide_guard(w, offset, to),
            );
            let strays = two * step.guide_strays(w, sizes);
            holds &= w.bits(w.greater(w.min(from, to), strays));
        }
        holds
    }

    /// The guard of a guide with friction.
    #[inline(always)]
    fn guide_guard<W: Width>(&self, w: W, offset: W::Vector, y: &States<W>) -> W::Vector {
        if self.table.guide == GuideMode::Stuck {
            let torque = self.flank_torque(w, offset, y) - w.splat(self.axis.load_torque_nm());
            return w.splat(self.axis.holding_torque_nm) - w.abs(torque);
        }
        w.splat(self.table.guide.direction()) * (y[BETA_DOT] - y[EPSILON_DOT])
    }

    /// Makes γ̇ = 0 to the last bit where friction holds the screw.
    #[inline(always)]
    fn hold<W: Width>(&self, y: &mut States<W>) {
        if self.table.guide == GuideMode::Stuck {
            y[EPSILON_DOT] = y[BETA_DOT];
        }
    }
}

/// Step of the lanes of `known`.
#[derive(Debug, Clone)]
pub(super) struct Transition<W: Width> {
    pub(super) known: u64,
    /// Time of the change of contact, from the start of the step \[s\].
    pub(super) change_s: W::Array,
    /// The flank in contact afterwards.
    pub(super) flank: W::Array,
    /// β, β̇, ε, ε̇ and I just before the change, just after it, and at the end.
    pub(super) before: [W::Array; HELD],
    pub(super) after: [W::Array; HELD],
    pub(super) end: [W::Array; HELD],
    /// Energies of the two pieces \[J\].
    pub(super) energies_j: [[W::Array; ENERGIES]; 2],
    /// ẍ at both ends of the two pieces.
    pub(super) acceleration_mps2: [[W::Array; 2]; 2],
    /// Upper bounds of the figures' magnitudes on the two pieces, and how far
    /// the carriage may be from its chord \[m\].
    pub(super) uppers: [[W::Array; FIGURES]; 2],
    pub(super) carriage_strays_m: [W::Array; 2],
}

impl<W: Width> TransitionStart<W> {
    pub(super) fn new() -> Self {
        let zero = W::array(0.0);
        Self {
            y: [zero; HELD],
            voltage_v: zero,
            flank: zero,
            backlash_half_rad: zero,
            commands_m: [zero; 2],
            bend_m: zero,
            start_rad: zero,
        }
    }

    /// Follows the lanes of `asked` over a step that begins in the first kind of mode and ends
    /// in the second, with the other state of the joint.
    #[inline(always)]
    pub(super) fn follow(
        &self,
        w: W,
        [first, next]: [KindOfStep<'_>; 2],
        asked: u64,
    ) -> Transition<W> {
        let closed = first.table.closed;
        let (zero, one) = (w.splat(0.0), w.splat(1.0));
        let y = w.load_each(&self.y);
        let (voltage_v, b) = (w.load(&self.voltage_v), w.load(&self.backlash_half_rad));
        let start_flank = w.load(&self.flank);
        let start_offset = start_flank * b;
        let mut x = y;
        x[EPSILON] = y[EPSILON] - start_offset;
        let rate = first.table.step.rates(w, &x, voltage_v);
        let slopes = DeltaSlopes::new(w, first.sketch, &rate);

        // The guard `sign·δ + offset` that may fall.
        let mut known = asked;
        let (sign, offset, noise) = if closed {
            let noise = self.part_noise(w, &first, &x);
            let value = start_flank * y[EPSILON] - (b - noise);
            known &= w.bits(w.greater(value, zero));
            (start_flank, zero, noise)
        } else {
            let above = w.greater(zero, y[EPSILON] - b);
            let below = w.greater(zero, (zero - y[EPSILON]) - b);
            known &= w.bits(w.both(above, below));
            let rises = w.greater(slopes.end(w, x[EPSILON]), zero);
            (w.select(rises, zero - one, one), b, zero)
        };
        let curve = slopes.guard(w, sign, offset + sign * x[EPSILON]);
        if !closed {
            let other = zero - sign;
            known &= slopes.guard(w, other, offset + other * x[EPSILON]).holds(w);
        }
        let length_s = w.splat(first.table.length_s());
        let crossing = curve.first_zero(w, noise, known);
        let near_s = crossing.theta * length_s;
        let local = first
            .grid
            .near(w, &first.table.system.a, (&x, &rate), near_s);
        let near = local.window.sigma(near_s);
        let guard = local.state(DELTA, (sign, offset));
        let (sigma, mut known) = zero_near(w, &guard, near, crossing.known);
        let change_s = local.window.time_s(sigma);
        let late = w.at_most(crossing.from * length_s, change_s);
        let early = w.at_most(change_s, crossing.to * length_s);
        let within = w.both(w.greater(change_s, zero), w.greater(length_s, change_s));
        known &= w.bits(w.both(w.both(late, early), within));
        let mut before = local.at(sigma);
        before[EPSILON] = before[EPSILON] + start_offset;
        first.hold::<W>(&mut before);

        // The change, and the joint's other state.
        let mut after = before;
        let flank = if closed { zero } else { zero - sign };
        let end_offset = flank * b;
        if closed {
            // Not through to the other flank at once.
            let through = (zero - start_flank) * after[EPSILON] - b;
            known &= w.bits(w.greater(zero, through));
        } else {
            after[EPSILON] = end_offset;
        }
        let [_, rates @ ..] = rate;
        let start = (x[CURRENT], &rates);
        let first_j = first.table.energies_of_part(w, start, voltage_v, change_s);
        let mut x = after;
        x[EPSILON] = after[EPSILON] - end_offset;
        let left_s = length_s - change_s;
        let theta = left_s / length_s;
        let next_rate = next.table.step.rates(w, &x, voltage_v);
        let slopes = DeltaSlopes::new(w, next.sketch, &next_rate);
        if closed {
            let fresh = zero - start_flank;
            let curve = slopes.guard(w, fresh, b + fresh * x[EPSILON]);
            known &= curve.holds_after_start(w, theta);
            let curve = slopes.guard(w, start_flank, b + start_flank * x[EPSILON]);
            known &= curve.holds_until(w, theta);
        } else {
            let curve = slopes.guard(w, flank, zero + flank * x[EPSILON]);
            known &= curve.holds_after_start(w, theta);
        }
        let local = next
            .grid
            .near(w, &next.table.system.a, (&x, &next_rate), left_s);
        let mut end = local.at(local.window.sigma(left_s));
        end[EPSILON] = end[EPSILON] + end_offset;
        next.hold::<W>(&mut end);
        let mut size = zero;
        for (before, end) in before.iter().zip(&end) {
            size = size + (w.abs(*before) + w.abs(*end));
        }
        known &= w.bits(w.at_most(size, w.splat(f64::MAX)));

        let acceleration = [
            first.acceleration(w, start_offset, &y),
            first.acceleration(w, start_offset, &before),
            next.acceleration(w, end_offset, &after),
            next.acceleration(w, end_offset, &end),
        ];
        let behind_m = self.behind(w, first.axis, [&before, &after, &end], change_s / length_s);
        let [_, next_rates @ ..] = next_rate;
        let sizes = [rates, next_rates].map(
            #[inline(always)]
            |rates| w.quad_abs(w.quad(rates)),
        );
        let strays = [first.strays(w, sizes[0]), next.strays(w, sizes[1])];
        known &= first.others_hold(w, start_offset, [&y, &before], sizes[0]);
        known &= next.others_hold(w, end_offset, [&after, &end], sizes[1]);
        let (bend, two) = (w.load(&self.bend_m) * w.splat(0.125), w.splat(2.0));
        let mut uppers = [[W::array(0.0); FIGURES]; 2];
        let currents = [y[CURRENT], after[CURRENT], end[CURRENT]];
        let [carriage_m, motor_m] = behind_m;
        for (piece, uppers) in uppers.iter_mut().enumerate() {
            let (to, strays) = (piece + 1, &strays[piece]);
            let accelerations = [acceleration[2 * piece], acceleration[2 * piece + 1]];
            let current = upper(w, [currents[piece], currents[to]], strays[1]);
            *uppers = w.stored_each(&[
                upper(w, accelerations, strays[0]),
                current,
                upper(w, [carriage_m[piece], carriage_m[to]], strays[2] + bend),
                upper(w, [motor_m[piece], motor_m[to]], strays[3] + bend),
                w.abs(voltage_v) * current,
            ]);
        }
        let carriage_strays_m = [two * strays[0][CARRIAGE], two * strays[1][CARRIAGE]];
        let start = (x[CURRENT], &next_rates);
        let second_j = next.table.energies_of_part(w, start, voltage_v, left_s);
        let [a, b, c, d] = acceleration;
        Transition {
            energies_j: [w.stored_each(&first_j), w.stored_each(&second_j)],
            known,
            change_s: w.stored(change_s),
            flank: w.stored(flank),
            before: w.stored_each(&before),
            after: w.stored_each(&after),
            end: w.stored_each(&end),
            acceleration_mps2: [w.stored_each(&[a, b]), w.stored_each(&[c, d])],
            uppers,
            carriage_strays_m: w.stored_each(&carriage_strays_m),
        }
    }

    /// Angle by which a loaded flank must fall to have come away (see
    /// `Axis::release_noise_nm`) \[rad\].
    #[inline(always)]
    fn part_noise(&self, w: W, from: &KindOfStep<'_>, x: &States<W>) -> W::Vector {
        let mut axis = *from.axis;
        axis.set_parting_noise(0.0, from.table.length_s());
        let terms = from
            .table
            .step
            .terms_of_delta(w, x, w.load(&self.voltage_v));
        let b = w.load(&self.backlash_half_rad);
        let parting = w.splat(NOISE_ULPS) * terms + w.splat(NOISE_PER_BACKLASH) * b;
        let motor = &axis.motor;
        let km = w.splat(motor.torque_constant_nm_per_a / axis.gear_ratio);
        let braking = km * w.abs(km * x[BETA_DOT]) / w.splat(motor.resistance_ohm);
        let stiffness = w.splat(from.joint.stiffness_nm_per_rad);
        let release = stiffness * parting + w.splat(axis.current_noise) * braking;
        release / stiffness
    }

    /// Upper bounds of how far carriage and motor are behind the command at the
    /// start, where the contact changes, and at the end.
    #[inline(always)]
    fn behind(
        &self,
        w: W,
        axis: &Axis,
        [before, after, end]: [&States<W>; 3],
        theta: W::Vector,
    ) -> [[W::Vector; 3]; 2] {
        let p = w.splat(axis.pitch_m_per_rad);
        let (from_m, end_m) = (w.load(&self.commands_m[0]), w.load(&self.commands_m[1]));
        let (beta, epsilon) = (w.load(&self.y[BETA]), w.load(&self.y[EPSILON]));
        let then_m = from_m + theta * (end_m - from_m);
        // The command bends, and all of this is rounded.
        let sizes = w.abs(from_m) + w.abs(end_m) + p * (w.abs(before[BETA]) + w.abs(end[BETA]));
        let moved = p * w.abs(after[EPSILON] - before[EPSILON]);
        let off =
            w.load(&self.bend_m) * w.splat(0.125) + sizes * w.splat(64.0 * f64::EPSILON) + moved;
        let start = w.load(&self.start_rad);
        let mut behind_m = [
            [
                from_m - p * ((beta - epsilon) + start),
                then_m - p * ((after[BETA] - after[EPSILON]) + start),
                end_m - p * ((end[BETA] - end[EPSILON]) + start),
            ],
            [
                from_m - p * beta,
                then_m - p * after[BETA],
                end_m - p * end[BETA],
            ],
        ];
        for size_m in behind_m.as_flattened_mut() {
            *size_m = w.abs(*size_m) + off;
        }
        behind_m
    }
}

/// Upper bound of a magnitude over a part of a step, from both ends and how far it strays from its
/// chord over the whole: up to twice that from the part's.
#[inline(always)]
fn upper<W: Width>(w: W, [from, to]: [W::Vector; 2], stray: W::Vector) -> W::Vector {
    w.max(w.abs(from), w.abs(to)) + w.splat(2.0) * stray
}

/// Slopes of δ over a step, and what they may be off by.
struct DeltaSlopes<W: Width> {
    slopes: [W::Vector; SLOPES],
    stray: W::Vector,
}

impl<W: Width> DeltaSlopes<W> {
    /// Over the step that begins with `rate`.
    #[inline(always)]
    fn new(w: W, sketch: &Sketch<HELD>, rate: &States<W>) -> Self {
        let (slopes, stray) = sketch.slopes(w, rate);
        Self { slopes, stray }
    }

    /// About where δ ends that starts here.
    #[inline(always)]
    fn end(&self, w: W, start: W::Vector) -> W::Vector {
        let mut change = self.slopes[0];
        for slope in &self.slopes[1..] {
            change = change + *slope;
        }
        start + change * w.splat(ELEVENTH)
    }

    /// The guard `sign·δ + offset`, which is `start` at the start; `sign` is 1 or
    /// −1.
    #[inline(always)]
    fn guard(&self, w: W, sign: W::Vector, start: W::Vector) -> Curve<W> {
        let mut slopes = self.slopes;
        for slope in &mut slopes {
            *slope = sign * *slope;
        }
        Curve::new(w, start, slopes, self.stray)
    }
}
