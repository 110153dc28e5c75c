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

use crate::body::{Reader, Writer};
use crate::settings::Payload;

/// The parts of a plan, the head first.
pub fn parts(plan: &MotionPlan) -> impl Iterator<Item = Payload> {
    let PlanHead {
        sign,
        end,
        last_sample,
        velocity_fraction_bits,
        acceleration_fraction_bits,
    } = plan.head();
    let mut head = Writer::new();
    head.i32(sign);
    head.i32(end);
    head.u64(last_sample);
    head.u8(velocity_fraction_bits);
    head.u8(acceleration_fraction_bits);
    let pieces = plan.pieces().iter().filter_map(|piece| {
        let mut part = Writer::new();
        write_piece(&mut part, piece);
        part.finish()
    });
    head.finish().into_iter().chain(pieces)
}

/// Adds a part to a plan; a head begins another. `None` if it is no part, or
/// one too many: the plan is then what it was.
pub fn take_part(plan: &mut MotionPlan, part: &[u8]) -> Option<()> {
    let mut from = Reader::new(part);
    if part.len() == HEAD_BYTES {
        plan.begin(PlanHead {
            sign: from.i32()?,
            end: from.i32()?,
            last_sample: from.u64()?,
            velocity_fraction_bits: from.u8()?,
            acceleration_fraction_bits: from.u8()?,
        });
        return Some(());
    }
    let piece = read_piece(&mut from)?;
    from.end()?;
    plan.push(piece)
}

/// Bytes of a head; a piece has more.
const HEAD_BYTES: usize = 18;

fn write_piece<const N: usize>(to: &mut Writer<N>, piece: &Piece) {
    to.u32(piece.samples);
    let Point {
        line,
        step,
        sine,
        cosine,
        velocity,
    } = piece.entry;
    for long in [line, step] {
        write_long(to, long);
    }
    for number in [sine, cosine, velocity] {
        to.i64(number);
    }
    match piece.shape {
        Shape::Straight {
            growth,
            velocity_growth,
            acceleration,
        } => {
            to.u8(0);
            write_long(to, growth);
            to.i64(velocity_growth);
            to.i32(acceleration);
        }
        Shape::Sine {
            turn,
            shift,
            velocity_centre,
            velocity_weight,
            acceleration_weight,
            acceleration_centre,
        } => {
            to.u8(1);
            write_turn(to, turn);
            to.u8(shift);
            to.i64(velocity_centre);
            to.i32(velocity_weight);
            to.i32(acceleration_weight);
            to.i32(acceleration_centre);
        }
    }
}

fn read_piece(from: &mut Reader<'_>) -> Option<Piece> {
    Some(Piece {
        samples: from.u32()?,
        entry: Point {
            line: read_long(from)?,
            step: read_long(from)?,
            sine: from.i64()?,
            cosine: from.i64()?,
            velocity: from.i64()?,
        },
        shape: match from.u8()? {
            0 => Shape::Straight {
                growth: read_long(from)?,
                velocity_growth: from.i64()?,
                acceleration: from.i32()?,
            },
            1 => Shape::Sine {
                turn: read_turn(from)?,
                shift: from.u8()?,
                velocity_centre: from.i64()?,
                velocity_weight: from.i32()?,
                acceleration_weight: from.i32()?,
                acceleration_centre: from.i32()?,
            },
            _ => return None,
        },
    })
}

fn write_long<const N: usize>(to: &mut Writer<N>, long: Long) {
    let [lower, upper] = long.high;
    for word in [long.low, lower, upper] {
        to.u32(word);
    }
}

fn read_long(from: &mut Reader<'_>) -> Option<Long> {
    let [low, lower, upper] = [from.u32()?, from.u32()?, from.u32()?];
    Some(Long {
        high: [lower, upper],
        low,
    })
}

fn write_turn<const N: usize>(to: &mut Writer<N>, turn: Turn) {
    to.u32(turn.high);
    to.i32(turn.low);
    to.i32(turn.centre);
}

fn read_turn(from: &mut Reader<'_>) -> Option<Turn> {
    Some(Turn {
        high: from.u32()?,
        low: from.i32()?,
        centre: from.i32()?,
    })
}
