//! A line that damages, loses, doubles, delays and reorders what goes over it,
//! in both directions, by a seed.

use std::collections::VecDeque;
use std::time::Duration;

use hil_runner::chip::ChipError;
use hil_runner::chip::line::Line;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// Damage done to pieces of the traffic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Done {
    pub(crate) pieces: u64,
    pub(crate) damaged: u64,
    pub(crate) cut: u64,
    pub(crate) dropped: u64,
    pub(crate) doubled: u64,
    pub(crate) delayed: u64,
}

impl Done {
    pub(crate) fn faults(&self) -> u64 {
        self.damaged + self.cut + self.dropped + self.doubled + self.delayed
    }
}

/// A bad line.
#[derive(Debug)]
pub(crate) struct Noisy<L> {
    line: L,
    random: Pcg64Mcg,
    /// One piece of so many meets a fault.
    one_of: u64,
    /// Pieces that come later than what follows them, in each direction.
    held: [Option<Vec<u8>>; 2],
    arrived: VecDeque<u8>,
    pub(crate) done: std::sync::Arc<std::sync::Mutex<Done>>,
}

impl<L: Line> Noisy<L> {
    pub(crate) fn new(line: L, seed: u64, one_of: u64) -> Self {
        Self {
            line,
            random: Pcg64Mcg::new(u128::from(seed) << 64 | 0xcafe_f00d),
            one_of,
            held: [None, None],
            arrived: VecDeque::new(),
            done: std::sync::Arc::default(),
        }
    }

    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end
    }

    /// Fate of a piece on its way.
    fn pass(&mut self, direction: usize, piece: &[u8]) -> Vec<u8> {
        let mut passed = piece.to_vec();
        let fault = self.below(self.one_of);
        let kind = self.below(5);
        let done = self.done.clone();
        let mut done = done.lock().unwrap();
        done.pieces += 1;
        if fault == 0 {
            match kind {
                0 => {
                    // One to three bits, wherever.
                    for _ in 0..=self.below(3) {
                        let at = self.below(passed.len().max(1) as u64) as usize;
                        let bit = self.below(8);
                        if let Some(byte) = passed.get_mut(at) {
                            *byte ^= 1 << bit;
                        }
                    }
                    done.damaged += 1;
                }
                1 => {
                    passed.truncate(self.below(passed.len().max(1) as u64) as usize);
                    done.cut += 1;
                }
                2 => {
                    passed.clear();
                    done.dropped += 1;
                }
                3 => {
                    passed.extend_from_slice(piece);
                    done.doubled += 1;
                }
                _ => {
                    // It comes behind the next one.
                    let before = self.held[direction].replace(std::mem::take(&mut passed));
                    done.delayed += 1;
                    return before.unwrap_or_default();
                }
            }
        }
        if let Some(late) = self.held[direction].take() {
            // Behind what follows it, or right in front of that: a stray answer.
            if self.below(2) == 0 {
                passed.extend(late);
            } else {
                passed.splice(0..0, late);
            }
        }
        passed
    }
}

impl<L: Line> Line for Noisy<L> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        let passed = self.pass(0, bytes);
        self.line.send(&passed)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError> {
        if self.arrived.is_empty() {
            let mut piece = [0; 256];
            let count = self.line.receive(&mut piece, timeout)?;
            if count > 0 {
                let passed = self.pass(1, &piece[..count]);
                self.arrived.extend(passed);
            }
        }
        let count = buffer.len().min(self.arrived.len());
        for (place, byte) in buffer.iter_mut().zip(self.arrived.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn patience(&self) -> Duration {
        self.line.patience()
    }
}
