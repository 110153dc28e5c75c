//! A plan as bytes, for a chip that is to run what a host has planned:
//! planning divides and needs 128 bits and 11 KiB of flash, running a plan needs
//! neither.
//!
//! The parts are the plan's head and its pieces, in their order. A chip takes
//! them as they are: whatever the numbers, running them can neither panic nor
//! leave the integers, and the frames that bring them carry a CRC.

use heapless::Vec;

use super::generator::MotionState;
use super::piece::{Long, Piece, Point, Shape, Turn};
use super::plan::MotionPlan;
use crate::link::bytes::{Reader, Writer};
use crate::link::settings::Payload;

impl MotionPlan {
    /// No motion: the axis stays at 0.
    pub const fn at_rest() -> Self {
        Self {
            pieces: Vec::new(),
            sign: 0,
            end: 0,
            last_sample: 0,
            velocity_fraction_bits: 0,
            acceleration_fraction_bits: 0,
        }
    }

    /// Forgets the motion: the axis stays at 0.
    pub fn rest(&mut self) {
        self.pieces.clear();
        self.sign = 0;
        self.end = 0;
        self.last_sample = 0;
        self.velocity_fraction_bits = 0;
        self.acceleration_fraction_bits = 0;
    }

    /// The parts of the plan, the head first.
    pub fn parts(&self) -> impl Iterator<Item = Payload> {
        let mut head = Writer::new();
        head.i32(self.sign);
        head.i32(self.end);
        head.u64(self.last_sample);
        head.u8(self.velocity_fraction_bits);
        head.u8(self.acceleration_fraction_bits);
        let pieces = self.pieces.iter().filter_map(|piece| {
            let mut part = Writer::new();
            piece.write(&mut part);
            part.finish()
        });
        head.finish().into_iter().chain(pieces)
    }

    /// Takes a part; a head begins another plan. `None` if it is no part, or
    /// one too many: the plan is then what it was.
    pub fn take_part(&mut self, part: &[u8]) -> Option<()> {
        let mut from = Reader::new(part);
        if part.len() == HEAD_BYTES {
            // Field by field: a plan is too large to pass over a chip's stack.
            self.pieces.clear();
            self.sign = from.i32()?;
            self.end = from.i32()?;
            self.last_sample = from.u64()?;
            self.velocity_fraction_bits = from.u8()?;
            self.acceleration_fraction_bits = from.u8()?;
            return Some(());
        }
        let piece = Piece::read(&mut from)?;
        from.end()?;
        self.pieces.push(piece).ok()
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
}

/// Bytes of a head; a piece has more.
const HEAD_BYTES: usize = 18;

impl Piece {
    fn write<const N: usize>(&self, to: &mut Writer<N>) {
        to.u32(self.samples);
        let Point {
            line,
            step,
            sine,
            cosine,
            velocity,
        } = self.entry;
        for long in [line, step] {
            long.write(to);
        }
        for number in [sine, cosine, velocity] {
            to.i64(number);
        }
        match self.shape {
            Shape::Straight {
                growth,
                velocity_growth,
                acceleration,
            } => {
                to.u8(0);
                growth.write(to);
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
                turn.write(to);
                to.u8(shift);
                to.i64(velocity_centre);
                to.i32(velocity_weight);
                to.i32(acceleration_weight);
                to.i32(acceleration_centre);
            }
        }
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            samples: from.u32()?,
            entry: Point {
                line: Long::read(from)?,
                step: Long::read(from)?,
                sine: from.i64()?,
                cosine: from.i64()?,
                velocity: from.i64()?,
            },
            shape: match from.u8()? {
                0 => Shape::Straight {
                    growth: Long::read(from)?,
                    velocity_growth: from.i64()?,
                    acceleration: from.i32()?,
                },
                1 => Shape::Sine {
                    turn: Turn::read(from)?,
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
}

impl Long {
    fn write<const N: usize>(self, to: &mut Writer<N>) {
        let [lower, upper] = self.high;
        for word in [self.low, lower, upper] {
            to.u32(word);
        }
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let [low, lower, upper] = [from.u32()?, from.u32()?, from.u32()?];
        Some(Self {
            high: [lower, upper],
            low,
        })
    }
}

impl Turn {
    fn write<const N: usize>(self, to: &mut Writer<N>) {
        to.u32(self.high);
        to.i32(self.low);
        to.i32(self.centre);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            high: from.u32()?,
            low: from.i32()?,
            centre: from.i32()?,
        })
    }
}
