//! The numbers of one step in each kind of mode, which all lanes share, and those that a
//! lane's mode decides.

use std::sync::Arc;

use crate::exact::{BOUND_MARGIN, DRIVING, HeldTable, behind_figure, times_sizes};
use crate::hybrid::Automaton;
use crate::model::amplifier::StageMode;
use crate::model::axis::{Axis, Mode};
use crate::model::direction::Direction;
use crate::model::joint::JointMode;
use crate::model::resistance::GuideMode;
use crate::numerics::seconds;
use crate::numerics::width::{One, Width};
use crate::observe::extremes::FIGURES;

/// What the numbers of a step depend on: whether the joint carries torque, and what the
/// guide does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Kind(usize);

/// Number of kinds.
pub(super) const KINDS: usize = 6;

impl Kind {
    pub(super) fn of(mode: &Mode) -> Self {
        let guide = match mode.guide {
            // No axis has both.
            GuideMode::AsWritten | GuideMode::Slides(Direction::Positive) => 0,
            GuideMode::Slides(Direction::Negative) => 1,
            GuideMode::Stuck => 2,
        };
        Self(2 * guide + usize::from(mode.joint.carries()))
    }

    /// What the guide does, on an axis with friction.
    pub(super) fn guide(self) -> GuideMode {
        let [forward, backward] = Direction::BOTH.map(GuideMode::Slides);
        [forward, backward, GuideMode::Stuck][self.0 / 2]
    }

    /// True if friction holds the screw.
    pub(super) fn is_stuck(self) -> bool {
        self.0 / 2 == 2
    }

    pub(super) fn is_closed(self) -> bool {
        self.0 % 2 == 1
    }

    pub(super) fn place(self) -> usize {
        self.0
    }

    /// The same with the other state of the joint.
    pub(super) fn after_contact_change(self) -> Self {
        Self(self.0 ^ 1)
    }

    pub(super) fn all() -> impl Iterator<Item = Self> {
        (0..KINDS).map(Self)
    }
}

/// The lanes in each kind of mode: byte k has those of kind k, as bits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kinds(u64);

/// A bit in every byte.
const EVERY: u64 = 0x0101_0101_0101_0101;

impl Kinds {
    pub(super) const NONE: Self = Self(0);

    /// Puts a lane into a kind.
    pub(super) fn set(&mut self, lane: usize, Kind(place): Kind) {
        self.0 = self.0 & !(EVERY << lane) | 1 << (8 * place + lane);
    }

    /// The kind of a lane.
    pub(super) fn of(self, lane: usize) -> Kind {
        Kind((self.0 >> lane & EVERY).trailing_zeros() as usize / 8 % KINDS)
    }

    /// The kinds that there are, each with its lanes.
    #[inline(always)]
    pub(super) fn present(self) -> impl Iterator<Item = (Kind, u64)> {
        let mut left = self.0;
        core::iter::from_fn(
            #[inline(always)]
            move || {
                let place = (left != 0).then_some(left.trailing_zeros() as usize / 8)?;
                let lanes = left >> (8 * place) & 0xff;
                left &= !(0xff << (8 * place));
                Some((Kind(place), lanes))
            },
        )
    }

    /// The first of them, and the others.
    #[inline(always)]
    pub(super) fn first_and_others(self) -> (Kind, impl Iterator<Item = (Kind, u64)>) {
        let mut kinds = self.present();
        let first = kinds.next().map_or(Kind(0), |(kind, _)| kind);
        (first, kinds)
    }
}

/// One step of all groups.
#[derive(Debug, Clone)]
pub(super) struct Phase {
    pub(super) length_ns: u64,
    pub(super) length_s: f64,
    /// The step in each kind of mode, where it is known.
    kinds: [Option<Arc<HeldTable>>; KINDS],
    /// Changes of ẍ, I, p·γ and p·β above which they are monotone, per rate of the driving
    /// states, and how far they may stray from their chords, with the joint open and closed,
    /// whatever the guide does.
    pub(super) slopes: [[[f64; DRIVING]; 2]; FIGURES],
    pub(super) chords: [[[f64; DRIVING]; 2]; FIGURES],
}

impl Phase {
    pub(super) fn new(length_ns: u64) -> Self {
        Self {
            length_ns,
            length_s: seconds(length_ns),
            kinds: [const { None }; KINDS],
            slopes: [[[0.0; DRIVING]; 2]; FIGURES],
            chords: [[[0.0; DRIVING]; 2]; FIGURES],
        }
    }

    /// Takes over the numbers of a table for modes of this kind.
    pub(super) fn learn(&mut self, kind: Kind, table: &Arc<HeldTable>, axis: &Axis) {
        let place = usize::from(kind.is_closed());
        for figure in 0..FIGURES {
            // The power per volt.
            let given = [axis.pitch_m_per_rad, 0.0];
            let (quantity, (scale, _)) = behind_figure(One, figure, given, [0.0, 1.0]);
            let (linear, scale) = (table.table.quantity(quantity), BOUND_MARGIN * scale.abs());
            for (largest, bounds) in [
                (&mut self.slopes[figure][place], linear.slopes(scale)),
                (&mut self.chords[figure][place], linear.chords(scale)),
            ] {
                for (largest, bound) in largest.iter_mut().zip(bounds) {
                    *largest = largest.max(bound);
                }
            }
        }
        self.kinds[kind.0] = Some(Arc::clone(table));
    }

    /// The step in a mode of this kind, if it is known.
    #[inline(always)]
    pub(super) fn of(&self, Kind(place): Kind) -> Option<&HeldTable> {
        self.kinds.get(place)?.as_deref()
    }
}

/// `Σ row_j·|v_j|` over the driving states, with the numbers of the open or the closed
/// joint, lane by lane.
#[inline(always)]
pub(super) fn times_sizes_of<W: Width>(
    w: W,
    closed: W::Mask,
    [open_row, closed_row]: &[[f64; DRIVING]; 2],
    sizes: W::Quad,
) -> W::Vector {
    let (open, shut) = (
        times_sizes(w, open_row, sizes),
        times_sizes(w, closed_row, sizes),
    );
    w.select(closed, shut, open)
}

/// The numbers of every lane's mode.
#[derive(Debug, Clone)]
pub(super) struct ModeNumbers<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    pub(super) offset_rad: W::Array,
    /// The guard `base + side·δ − open·|δ|`, positive within the mode.
    pub(super) base: W::Array,
    side: W::Array,
    open: W::Array,
    /// That of a guide with friction: `base + direction·γ̇`, less |τ| where it is stuck.
    guide_base: W::Array,
    /// Direction in which the guide slides: −1, 1, or 0 where it is stuck.
    pub(super) guide_direction: W::Array,
    /// 1 where dry friction holds the screw, else 0.
    stuck: W::Array,
    /// `k` and `c` while a flank carries, else 0.
    pub(super) stiffness: W::Array,
    pub(super) damping: W::Array,
    /// a0 against the motion.
    pub(super) resistance_n: W::Array,
    /// The flank in contact: −1, 0 or 1.
    pub(super) joint: W::Array,
}

impl<W: Width> ModeNumbers<W> {
    pub(super) fn new() -> Self {
        let zero = W::array(0.0);
        Self {
            offset_rad: zero,
            base: zero,
            side: zero,
            open: zero,
            guide_base: zero,
            guide_direction: zero,
            stuck: zero,
            stiffness: zero,
            damping: zero,
            resistance_n: zero,
            joint: zero,
        }
    }

    /// The guard of the joint; where δ is not a number, neither is this.
    #[inline(always)]
    pub(super) fn guard(&self, w: W, delta: W::Vector) -> W::Vector {
        (w.load(&self.base) + w.load(&self.side) * delta) - w.load(&self.open) * w.abs(delta)
    }

    /// The lowest guard over values of δ.
    #[inline(always)]
    pub(super) fn lowest_guard(&self, w: W, deltas: &[W::Vector]) -> W::Vector {
        let (mut low, mut high) = (deltas[0], deltas[0]);
        for delta in &deltas[1..] {
            (low, high) = (w.min(*delta, low), w.max(*delta, high));
        }
        let side = w.load(&self.side);
        let loaded = w.load(&self.base) + w.min(side * low, side * high);
        loaded - w.load(&self.open) * w.max(w.abs(low), w.abs(high))
    }

    /// The guard of the guide, with the torque that turns the screw.
    #[inline(always)]
    pub(super) fn guide_guard(&self, w: W, speed: W::Vector, torque: W::Vector) -> W::Vector {
        let slides = w.load(&self.guide_base) + w.load(&self.guide_direction) * speed;
        slides - w.load(&self.stuck) * w.abs(torque)
    }

    /// The lanes in which dry friction holds the screw.
    #[inline(always)]
    pub(super) fn is_stuck(&self, w: W) -> W::Mask {
        w.greater(w.load(&self.stuck), w.splat(0.5))
    }

    /// True if no bound can tell that the lane keeps its mode.
    pub(super) fn is_unsure(&self, lane: usize) -> bool {
        self.base.as_ref()[lane] == f64::NEG_INFINITY
    }

    /// Sets a lane's numbers to those of its mode.
    pub(super) fn set(&mut self, lane: usize, plant: &Automaton) {
        let (mode, axis) = (&plant.mode, &plant.axis);
        let never = f64::NEG_INFINITY;
        let follows = mode.stage == StageMode::Follows;
        let simple = !axis.releases() && plant.fresh.is_none() && follows;
        let (base, side, open) = match mode.joint {
            _ if !simple => (never, 0.0, 0.0),
            JointMode::Rigid | JointMode::Gapless => (f64::INFINITY, 0.0, 0.0),
            JointMode::Open => (axis.backlash_half_rad(), 0.0, 1.0),
            JointMode::Loaded(flank) => (0.0, flank.sign(), 0.0),
            JointMode::Released(_) => (never, 0.0, 0.0),
        };
        let (guide_base, stuck) = match mode.guide {
            GuideMode::Stuck => (axis.holding_torque_nm, 1.0),
            _ => (0.0, 0.0),
        };
        let (stiffness, damping) = match (mode.joint, axis.joint) {
            (JointMode::Gapless | JointMode::Loaded(_), Some(joint)) => {
                (joint.stiffness_nm_per_rad, joint.damping_nms_per_rad)
            }
            _ => (0.0, 0.0),
        };
        let resistance_n = mode.guide.direction() * axis.resistance.constant_n;
        for (array, value) in [
            (&mut self.offset_rad, axis.offset_rad(mode)),
            (&mut self.base, base),
            (&mut self.side, side),
            (&mut self.open, open),
            (&mut self.guide_base, guide_base),
            (&mut self.guide_direction, mode.guide.direction()),
            (&mut self.stuck, stuck),
            (&mut self.stiffness, stiffness),
            (&mut self.damping, damping),
            (&mut self.resistance_n, resistance_n),
            (&mut self.joint, f64::from(mode.joint.contact().sign())),
        ] {
            array.as_mut()[lane] = value;
        }
    }
}
