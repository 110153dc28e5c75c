//! A plan as bytes, for a chip that is to run what a host has planned:
//! planning divides and needs 128 bits and 11 KiB of flash, running a plan needs
//! neither.
//!
//! The parts are the plan's head and its pieces, in their order. A chip takes
//! them as they are: whatever the numbers, running them can neither panic nor
//! leave the integers, and the frames that bring them carry a CRC.

use firmware::MotionPlan;
use firmware::motion::PlanHead;
use firmware::motion::piece::{Long, Piece, Point, Shape, Turn};

use crate::body::{Reader, Wire, Writer};
use crate::settings::Payload;

/// The parts of a plan, the head first.
pub fn parts(plan: &MotionPlan) -> impl Iterator<Item = Payload> {
    let first = Writer::body(|to| head(to, &mut plan.head()));
    let pieces = plan.pieces().iter();
    let pieces = pieces.filter_map(|one| Writer::body(|to| piece(to, &mut { *one })));
    first.into_iter().chain(pieces)
}

/// Adds a part to a plan; a head begins another. `None` if it is no part, or
/// one too many: the plan is then what it was.
pub fn take_part(plan: &mut MotionPlan, part: &[u8]) -> Option<()> {
    let mut from = Reader::new(part);
    if part.len() == HEAD_BYTES {
        let mut taken = PlanHead::default();
        head(&mut from, &mut taken)?;
        plan.begin(taken);
        return Some(());
    }
    let [straight, _] = shapes();
    let mut taken = Piece {
        samples: 0,
        entry: Point::default(),
        shape: straight,
    };
    piece(&mut from, &mut taken)?;
    from.end()?;
    plan.push(taken)
}

/// Bytes of a head; a piece has more.
const HEAD_BYTES: usize = 18;

fn head(wire: &mut impl Wire, head: &mut PlanHead) -> Option<()> {
    wire.i32(&mut head.sign)?;
    wire.i32(&mut head.end)?;
    wire.u64(&mut head.last_sample)?;
    wire.u8(&mut head.velocity_fraction_bits)?;
    wire.u8(&mut head.acceleration_fraction_bits)
}

/// The two shapes, in the order of their numbers on the line.
fn shapes() -> [Shape; 2] {
    [
        Shape::Straight {
            growth: Long::default(),
            velocity_growth: 0,
            acceleration: 0,
        },
        Shape::Sine {
            turn: Turn::default(),
            shift: 0,
            velocity_centre: 0,
            velocity_weight: 0,
            acceleration_weight: 0,
            acceleration_centre: 0,
        },
    ]
}

fn piece(wire: &mut impl Wire, piece: &mut Piece) -> Option<()> {
    let entry = &mut piece.entry;
    wire.u32(&mut piece.samples)?;
    long(wire, &mut entry.line)?;
    long(wire, &mut entry.step)?;
    wire.i64(&mut entry.sine)?;
    wire.i64(&mut entry.cosine)?;
    wire.i64(&mut entry.velocity)?;
    wire.choice(&mut piece.shape, &shapes())?;
    match &mut piece.shape {
        Shape::Straight {
            growth,
            velocity_growth,
            acceleration,
        } => {
            long(wire, growth)?;
            wire.i64(velocity_growth)?;
            wire.i32(acceleration)
        }
        Shape::Sine {
            turn: Turn { high, low, centre },
            shift,
            velocity_centre,
            velocity_weight,
            acceleration_weight,
            acceleration_centre,
        } => {
            wire.u32(high)?;
            wire.i32(low)?;
            wire.i32(centre)?;
            wire.u8(shift)?;
            wire.i64(velocity_centre)?;
            wire.i32(velocity_weight)?;
            wire.i32(acceleration_weight)?;
            wire.i32(acceleration_centre)
        }
    }
}

fn long(wire: &mut impl Wire, long: &mut Long) -> Option<()> {
    let [lower, upper] = &mut long.high;
    wire.u32(&mut long.low)?;
    wire.u32(lower)?;
    wire.u32(upper)
}
