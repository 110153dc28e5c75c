//! The motion sample by sample.

use super::piece::{Piece, Point};
use super::plan::MotionPlan;
use crate::reference::{Next, Observed, Setpoint, SetpointSource};

/// How far a motion has come: 56 bytes. The default is before its first
/// sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotionState {
    pub(super) point: Point,
    /// Samples of the present interval still to come.
    pub(super) left: u32,
    /// Intervals entered so far.
    pub(super) entered: u8,
}

/// An axis keeps all that it remembers in 256 bytes.
const _: () = assert!(size_of::<MotionState>() == 56);

/// A source of setpoints that computes them from a plan.
///
/// ```
/// use firmware::{MotionGenerator, MotionPlan, Next, Observed, SetpointSource};
///
/// // 1000 counts up in 40 ms and to rest in 40 ms, a sample every 20 ms.
/// let intervals_ps = [0, 40_000_000_000, 0, 0, 0, 40_000_000_000, 0];
/// let plan = MotionPlan::new(1_000 << 32, intervals_ps, 20_000_000)?;
/// let mut source = MotionGenerator::new(&plan, 7);
/// let mut positions = [0; 5];
/// for position in &mut positions {
///     *position = match source.next(&Observed::default()) {
///         Next::Setpoint(setpoint) | Next::Last(setpoint) => setpoint.position,
///         Next::Underrun => unreachable!("a plan has every sample"),
///     };
/// }
/// assert_eq!(positions, [7, 132, 507, 882, 1_007]);
/// # Ok::<(), firmware::MotionError>(())
/// ```
#[derive(Debug, Clone)]
pub struct MotionGenerator<'a> {
    plan: &'a MotionPlan,
    state: MotionState,
    start: i32,
}

impl<'a> MotionGenerator<'a> {
    /// Starts the motion at `start` \[counts, modulo 2^32\].
    pub fn new(plan: &'a MotionPlan, start: i32) -> Self {
        Self {
            plan,
            state: MotionState::default(),
            start,
        }
    }

    /// How far the motion has come.
    pub const fn state(&self) -> &MotionState {
        &self.state
    }
}

impl SetpointSource for MotionGenerator<'_> {
    #[inline]
    fn next(&mut self, _: &Observed) -> Next {
        let next = self.plan.next(&mut self.state);
        let placed = |setpoint: Setpoint| Setpoint {
            position: setpoint.position.wrapping_add(self.start),
            ..setpoint
        };
        match next {
            Next::Setpoint(setpoint) => Next::Setpoint(placed(setpoint)),
            Next::Last(setpoint) => Next::Last(placed(setpoint)),
            Next::Underrun => Next::Underrun,
        }
    }
}

impl MotionPlan {
    /// The setpoint of the next sample, relative to where the motion starts;
    /// from the end on the last one.
    #[inline]
    pub fn next(&self, state: &mut MotionState) -> Next {
        let piece = if state.left > 0 {
            state.left = state.left.wrapping_sub(1);
            let present = usize::from(state.entered).wrapping_sub(1);
            self.pieces
                .get(present)
                .inspect(|piece| piece.advance(&mut state.point))
        } else {
            let piece = self.pieces.get(usize::from(state.entered));
            piece.inspect(|piece| state.enter(piece))
        };
        match piece {
            Some(piece) => Next::Setpoint(piece.setpoint(&state.point, self.head.sign)),
            None => Next::Last(Setpoint {
                position: self.head.end,
                velocity: 0,
                acceleration: 0,
            }),
        }
    }
}

impl MotionState {
    /// Before the first sample.
    pub const fn at_start() -> Self {
        Self {
            point: Point::ZERO,
            left: 0,
            entered: 0,
        }
    }

    #[inline]
    fn enter(&mut self, piece: &Piece) {
        // Seven intervals at most.
        self.entered = self.entered.wrapping_add(1);
        self.left = piece.samples.wrapping_sub(1);
        self.point = piece.entry;
    }
}
