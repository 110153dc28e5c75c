//! A bus that knows beforehand what will be said on it.

use std::collections::VecDeque;

use embedded_hal::spi::{self, Operation, SpiDevice};

/// A bus error that carries a number, to see it arrive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lost(pub(crate) u32);

impl spi::Error for Lost {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

/// One transaction: the bytes that must come, and the answer to them.
pub(crate) type Step = (Vec<u8>, Result<Vec<u8>, Lost>);

/// A bus that knows beforehand what will be said on it.
#[derive(Debug)]
pub(crate) struct Script(VecDeque<Step>);

impl Script {
    /// Pairs of bytes sent and bytes answered; an answer is filled with zeros.
    pub(crate) fn of(steps: &[(&[u8], &[u8])]) -> Self {
        let step = |&(sent, answer): &(&[u8], &[u8])| (sent.to_vec(), Ok(answer.to_vec()));
        Self(steps.iter().map(step).collect())
    }

    pub(crate) fn then_lost(mut self, sent: &[u8], number: u32) -> Self {
        self.0.push_back((sent.to_vec(), Err(Lost(number))));
        self
    }

    pub(crate) fn assert_done(&self) {
        assert!(self.0.is_empty(), "never said: {:02x?}", self.0);
    }
}

impl spi::ErrorType for Script {
    type Error = Lost;
}

impl SpiDevice for Script {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Lost> {
        let (expected, answer) = self.0.pop_front().expect("more is said than planned");
        let mut sent = Vec::new();
        let mut answers = answer.clone().unwrap_or_default().into_iter();
        for operation in operations {
            match operation {
                Operation::Write(bytes) => {
                    sent.extend_from_slice(bytes);
                    answers.by_ref().take(bytes.len()).for_each(drop);
                }
                Operation::TransferInPlace(bytes) => {
                    sent.extend_from_slice(bytes);
                    bytes.fill_with(|| answers.next().unwrap_or(0));
                }
                other => unreachable!("not used by these drivers: {other:?}"),
            }
        }
        assert_eq!(sent, expected, "sent {sent:02x?}, planned {expected:02x?}");
        answer.map(drop)
    }
}

/// A script with one answer replaced.
pub(crate) fn spoiled(
    script: &[(&'static [u8], &'static [u8])],
    at: usize,
    answer: &'static [u8],
) -> Script {
    let mut script = script[..=at].to_vec();
    script[at].1 = answer;
    Script::of(&script)
}
