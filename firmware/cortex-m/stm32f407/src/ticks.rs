//! Numbers of the samples, as the hardware counts them.

/// Turns a counter of 32 bits, which counts the sample times without the
/// program, into numbers of samples.
///
/// A sample that ends after the next one should have begun has not kept its
/// time, although none is missing: [`Ticks::overrun`] makes it count as one
/// more, so that the monitor over missed ticks sees both.
///
/// ```
/// use stm32f407_drive::Ticks;
///
/// let mut ticks = Ticks::default();
/// assert_eq!(ticks.number(u32::MAX), u64::from(u32::MAX));
/// assert_eq!(ticks.number(0), 1 << 32);
/// ticks.overrun();
/// assert_eq!(ticks.number(1), (1 << 32) + 2);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct Ticks {
    counter: u32,
    number: u64,
}

impl Ticks {
    /// The number of the sample at which the counter reads `counter`; it is
    /// asked for more often than the counter wraps, every 49 days at 1 ms.
    pub fn number(&mut self, counter: u32) -> u64 {
        let passed = counter.wrapping_sub(self.counter);
        self.counter = counter;
        self.number = self.number.wrapping_add(u64::from(passed));
        self.number
    }

    /// The sample before has ended too late.
    pub fn overrun(&mut self) {
        self.number = self.number.wrapping_add(1);
    }
}
