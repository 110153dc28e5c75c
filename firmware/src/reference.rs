//! Setpoints one sample at a time, whatever they come from: the table in the
//! controller's memory, the motion generator, a streamed queue, or a backlash measurement
//! routine.
//!
//! The table holds the desired positions as in the paper (section 3, `α_ref(t)`
//! before eq. 20): entry `k` is the setpoint of sample `k` in counts modulo 2^32
//! ([`crate::counts`]), from `k = 0` to the motion's end; from then on the last
//! entry is held. It never reports an end: a motion that has ended is an axis at
//! rest. A table with rates ([`next_rated`]) has velocity and acceleration besides.

use core::borrow::Borrow;
use core::sync::atomic::{Ordering, compiler_fence};

use heapless::Vec;

use crate::counts::{self, Counts};
use crate::dac::Codes;
use crate::refusal::{Refusal, What};
use crate::wide;

/// Command to the axis at one sample.
///
/// Velocity and acceleration serve the feed-forward only. Their exponents are
/// those of the source, declared once when the feed-forward words are made, so
/// that each uses its 32 bits to the full at any sample time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Setpoint {
    /// Position \[counts, modulo 2^32\].
    pub position: i32,
    /// Velocity \[2^−`velocity_fraction_bits` counts per sample\].
    pub velocity: i32,
    /// Acceleration \[2^−`acceleration_fraction_bits` counts per sample²\].
    pub acceleration: i32,
    /// Feed-forward that the source has computed itself \[codes\]; `None` leaves it
    /// to the law's words, of velocity and acceleration.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub ahead: Option<Codes>,
}

/// State of the axis as a source of setpoints sees it: a routine such as a
/// backlash measurement decides by it, the others do not look at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Observed {
    /// Position of the motor \[counts, modulo 2^32\].
    pub position: i32,
    /// Position of the load \[load counts, modulo 2^32\], where it has an
    /// encoder of its own.
    pub load_position: Option<i32>,
    /// The last code that the converter was given.
    pub code: i32,
}

/// Samples of a motion whose third difference is constant: the command as
/// forward differences, three additions a sample.
///
/// ```text
/// r(k+1) = r(k) + v(k),   v(k+1) = v(k) + a(k),   a(k+1) = a(k) + j
/// ```
///
/// So it is with the feed-forward, whose second difference is constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct Stretch {
    /// `r + ½` at the first sample, whose whole part is the nearest count.
    pub position: Counts,
    /// `v`, the change to the next sample.
    pub velocity: Counts,
    /// `a`, the change of that.
    pub acceleration: Counts,
    /// `j`, the change of that.
    pub jerk: Counts,
    /// Feed-forward at the first sample.
    pub ahead: Codes,
    /// Its change to the next sample.
    pub ahead_change: Codes,
    /// The change of that.
    pub ahead_growth: Codes,
    /// Number of samples, at least 1.
    pub samples: u32,
    /// Sign of the velocity on the way: −1, 0 or 1.
    pub velocity_sign: i8,
    /// Sign of the acceleration on the way.
    pub acceleration_sign: i8,
}

impl Stretch {
    /// Words of a stretch on a line and in a table: the seven numbers, the lower word
    /// of each first, the samples, and the two signs a byte each.
    pub const WORDS: usize = 16;

    /// The words, in their order.
    pub fn to_words(&self) -> [i32; Self::WORDS] {
        let [v, a] = [self.velocity_sign, self.acceleration_sign].map(i8::cast_unsigned);
        let numbers = [
            self.position.to_bits(),
            self.velocity.to_bits(),
            self.acceleration.to_bits(),
            self.jerk.to_bits(),
            self.ahead.to_bits(),
            self.ahead_change.to_bits(),
            self.ahead_growth.to_bits(),
        ];
        let [b, c, d, e, f, g, h] = numbers.map(|n| [wide::lower(n), wide::upper(n)]);
        let [[b, i], [c, j], [d, k], [e, l], [f, m], [g, n], [h, o]] = [b, c, d, e, f, g, h];
        let signs = i32::from_le_bytes([v, a, 0, 0]);
        let samples = self.samples.cast_signed();
        [b, i, c, j, d, k, e, l, f, m, g, n, h, o, samples, signs]
    }

    /// The stretch of these words.
    pub fn from_words(words: &[i32; Self::WORDS]) -> Self {
        let mut stretch = Self::ZERO;
        stretch.set_words(words);
        stretch
    }

    /// Takes the stretch of these words.
    #[inline(never)]
    pub fn set_words(&mut self, words: &[i32; Self::WORDS]) {
        let [b, i, c, j, d, k, e, l, f, m, g, n, h, o, samples, signs] = words;
        let number = |lower: &i32, upper: &i32| Counts::from_bits(wide::joined(*upper, *lower));
        self.position = number(b, i);
        apart();
        self.velocity = number(c, j);
        apart();
        self.acceleration = number(d, k);
        apart();
        self.jerk = number(e, l);
        apart();
        self.ahead = number(f, m);
        apart();
        self.ahead_change = number(g, n);
        apart();
        self.ahead_growth = number(h, o);
        apart();
        self.samples = samples.cast_unsigned();
        let [velocity, acceleration, ..] = signs.to_le_bytes();
        self.velocity_sign = velocity.cast_signed();
        self.acceleration_sign = acceleration.cast_signed();
    }

    /// All zeros, before an axis is started.
    pub(crate) const ZERO: Self = Self {
        position: Counts::ZERO,
        velocity: Counts::ZERO,
        acceleration: Counts::ZERO,
        jerk: Counts::ZERO,
        ahead: Codes::ZERO,
        ahead_change: Codes::ZERO,
        ahead_growth: Codes::ZERO,
        samples: 0,
        velocity_sign: 0,
        acceleration_sign: 0,
    };

    /// An axis that stays at `position` \[counts\].
    pub const fn resting_at(position: i32) -> Self {
        Self {
            position: nearest(position),
            samples: u32::MAX,
            ..Self::ZERO
        }
    }

    /// Stays at `position` \[counts\], with no end. Word by word, as [`Self::take`].
    #[inline(always)]
    pub(crate) fn rest_at(&mut self, position: i32) {
        self.position = nearest(position);
        self.velocity = Counts::ZERO;
        apart();
        self.acceleration = Counts::ZERO;
        apart();
        self.jerk = Counts::ZERO;
        apart();
        self.ahead = Codes::ZERO;
        apart();
        self.ahead_change = Codes::ZERO;
        apart();
        self.ahead_growth = Codes::ZERO;
        self.forget_signs();
    }

    /// Takes another stretch, from `start` on \[counts\]. Word by word: it is no call of a
    /// copy in an image that is to be small.
    #[inline(always)]
    pub fn take(&mut self, next: &Self, start: i32) {
        self.position = next
            .position
            .wrapping_add(Counts::from_bits(wide::joined(start, 0)));
        apart();
        self.velocity = next.velocity;
        apart();
        self.acceleration = next.acceleration;
        apart();
        self.jerk = next.jerk;
        apart();
        self.ahead = next.ahead;
        apart();
        self.ahead_change = next.ahead_change;
        apart();
        self.ahead_growth = next.ahead_growth;
        self.samples = next.samples;
        self.velocity_sign = next.velocity_sign;
        self.acceleration_sign = next.acceleration_sign;
    }

    /// Signs of velocity and acceleration.
    #[inline(always)]
    pub(crate) const fn signs(&self) -> [i8; 2] {
        [self.velocity_sign, self.acceleration_sign]
    }

    /// The next stretch asks for its flank anew.
    pub(crate) const fn forget_signs(&mut self) {
        (self.velocity_sign, self.acceleration_sign) = (0, 0);
    }

    /// From one sample to the next; how many there are is for who asks to know.
    #[inline(always)]
    pub fn advance(&mut self) {
        let (velocity, acceleration) = (self.velocity, self.acceleration);
        self.position = self.position.wrapping_add(velocity);
        apart();
        self.velocity = velocity.wrapping_add(acceleration);
        apart();
        self.acceleration = acceleration.wrapping_add(self.jerk);
        apart();
        let change = self.ahead_change;
        self.ahead = self.ahead.wrapping_add(change);
        apart();
        self.ahead_change = change.wrapping_add(self.ahead_growth);
    }

    /// The first of its samples as a setpoint of its own, with so many fraction bits
    /// of the velocity; of the acceleration it tells the sign.
    pub fn first(&self, velocity_fraction_bits: u8) -> Setpoint {
        let shift = 32_i64.wrapping_sub(wide::bits(velocity_fraction_bits));
        let velocity = match u32::try_from(shift) {
            Ok(down) => self.velocity.to_bits().wrapping_shr(down),
            Err(_) => {
                let up = shift.unsigned_abs().try_into().unwrap_or(0);
                self.velocity.to_bits().wrapping_shl(up)
            }
        };
        Setpoint {
            position: self.setpoint(),
            velocity: wide::lower(velocity),
            acceleration: i32::from(self.acceleration_sign),
            ahead: Some(self.ahead),
        }
    }

    /// The setpoint of the first of its samples \[counts, modulo 2^32\].
    #[inline(always)]
    pub const fn setpoint(&self) -> i32 {
        wide::upper(self.position.to_bits())
    }
}

/// Keeps what stands before it apart from what follows on a processor of 32 bits: the
/// compiler then loads and stores a number's words in pairs. It is no instruction itself.
#[inline(always)]
fn apart() {
    if cfg!(target_pointer_width = "32") {
        compiler_fence(Ordering::SeqCst);
    }
}

/// A whole position as that of a stretch: with the half that rounds it.
pub(crate) const fn nearest(position: i32) -> Counts {
    Counts::from_bits(wide::joined(position, i32::MIN))
}

/// Answer of a source for this sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// A setpoint of the motion.
    Setpoint(Setpoint),
    /// The setpoints of this sample and of those after it; the source is asked
    /// again behind them.
    Stretch(Stretch),
    /// The last setpoint: the axis holds it from here on.
    Last(Setpoint),
    /// The motion has not ended but there is no setpoint.
    Underrun,
}

/// [`Next`] of a source that has put a stretch where it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InPlace {
    /// It is there.
    Stretch,
    /// [`Next::Setpoint`].
    Setpoint(Setpoint),
    /// [`Next::Last`].
    Last(Setpoint),
    /// [`Next::Underrun`].
    Underrun,
}

impl InPlace {
    /// The same as a value, with the stretch that is in place.
    pub const fn with(self, stretch: Stretch) -> Next {
        match self {
            Self::Stretch => Next::Stretch(stretch),
            Self::Setpoint(setpoint) => Next::Setpoint(setpoint),
            Self::Last(setpoint) => Next::Last(setpoint),
            Self::Underrun => Next::Underrun,
        }
    }
}

/// A source of setpoints, asked once a sample while the axis moves.
pub trait SetpointSource {
    /// The setpoint of this sample.
    fn next(&mut self, observed: &Observed) -> Next;

    /// The same with a stretch put where it runs: what an axis asks. A source of stretches
    /// that has them in memory copies them once.
    #[inline(always)]
    fn next_in_place(&mut self, observed: &Observed, stretch: &mut Stretch) -> InPlace {
        match self.next(observed) {
            Next::Stretch(next) => {
                stretch.take(&next, 0);
                InPlace::Stretch
            }
            Next::Setpoint(setpoint) => InPlace::Setpoint(setpoint),
            Next::Last(setpoint) => InPlace::Last(setpoint),
            Next::Underrun => InPlace::Underrun,
        }
    }
}

/// Entries of a table on the host and on the larger chips: 64 KiB, 16.4 s of
/// motion at 1 ms, 1.6 s at 0.1 ms.
pub const CAPACITY: usize = 16_384;

/// Entries of a table on the smallest chips: 8 KiB, 2 s of motion at 1 ms.
pub const CAPACITY_SMALLEST: usize = 2_048;

/// Setpoints of one motion, at most `N` of them and at least one.
///
/// ```
/// use firmware::SetpointTable;
///
/// let mut table = SetpointTable::<4>::from_counts(&[0])?;
/// table.push(3)?;
/// table.push(5)?;
/// assert_eq!(table.at(1), 3);
/// // The last setpoint is held.
/// assert_eq!(table.at(1_000), 5);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetpointTable<const N: usize> {
    entries: Vec<i32, N>,
    /// Setpoint held beyond the entries: the last of them.
    last: i32,
}

impl<const N: usize> SetpointTable<N> {
    /// A table must have room for the setpoint of `k = 0`.
    const HAS_ROOM: () = assert!(N > 0, "a setpoint table needs room for one entry");

    /// An axis that stays at `position` \[counts\], with all of the table's room
    /// left.
    pub const fn resting_at(position: i32) -> Self {
        let () = Self::HAS_ROOM;
        Self {
            entries: Vec::new(),
            last: position,
        }
    }

    /// Forgets the entries behind the first ones, of which there are so many; the axis
    /// stays at the last of them, or where there is none at 0.
    pub fn keep(&mut self, entries: usize) {
        self.entries.truncate(entries);
        self.last = self.entries.last().copied().unwrap_or(0);
    }

    /// Forgets the entries; the axis stays at `position` \[counts\].
    pub fn rest_at(&mut self, position: i32) {
        self.entries.clear();
        self.last = position;
    }

    /// A table with the setpoints `counts` of `k = 0, 1, …` \[counts\].
    ///
    /// # Errors
    /// A [`Refusal`] of none and of more than `N`.
    ///
    /// ```
    /// use firmware::SetpointTable;
    ///
    /// let refusal = SetpointTable::<2>::from_counts(&[0, 1, 2]).unwrap_err();
    /// assert_eq!((refusal.value, refusal.most), (3, 2));
    /// ```
    pub fn from_counts(counts: &[i32]) -> Result<Self, Refusal> {
        let last = *counts.last().ok_or_else(|| Self::refusal(0))?;
        let entries = Vec::from_slice(counts).map_err(|_| Self::refusal(counts.len()))?;
        Ok(Self { entries, last })
    }

    fn refusal(needed: usize) -> Refusal {
        let entries = |entries: usize| i64::try_from(entries).unwrap_or(i64::MAX);
        Refusal::new(What::Setpoints, entries(needed), [1, entries(N)])
    }

    /// Entries that it still has room for.
    pub fn room(&self) -> usize {
        N.saturating_sub(self.entries.len())
    }

    /// Appends the setpoint of the next sample \[counts\].
    ///
    /// # Errors
    /// A [`Refusal`] where the table is full; it keeps what it
    /// has.
    pub fn push(&mut self, setpoint: i32) -> Result<(), Refusal> {
        self.entries
            .push(setpoint)
            .map_err(|_| Self::refusal(N.saturating_add(1)))?;
        self.last = setpoint;
        Ok(())
    }

    /// The setpoint of sample `k`; the last one from the table's end on
    /// \[counts\].
    pub fn at(&self, k: u64) -> i32 {
        usize::try_from(k)
            .ok()
            .and_then(|k| self.entries.get(k))
            .copied()
            .unwrap_or(self.last)
    }

    /// The setpoints of `k = 0, 1, …` \[counts\].
    pub fn as_counts(&self) -> &[i32] {
        &self.entries
    }
}

/// Reads a [`SetpointTable`], its own or a borrowed one, from the first entry
/// to the last. It knows positions only: the velocity is the difference to the
/// entry before, in whole counts per sample, the acceleration is 0. A table with rates
/// is read by [`next_rated`].
#[derive(Debug, Clone)]
pub struct TableSource<T, const N: usize> {
    table: T,
    place: TablePlace,
}

/// Words of a setpoint in a table with rates: position \[counts, modulo 2^32\], velocity
/// and acceleration as in [`Setpoint`].
pub const RATED_WORDS: usize = 3;

/// The setpoint at word `at` of a table with rates, which is then behind it; the last one
/// is held. Without one, or with a part of one, there is none: an underrun.
///
/// ```
/// use firmware::Next;
/// use firmware::reference::next_rated;
///
/// let (table, mut at) = ([10, 1, 0, 20, 0, -1], 0);
/// assert!(matches!(next_rated(&table, &mut at), Next::Setpoint(first) if first.velocity == 1));
/// assert!(matches!(next_rated(&table, &mut at), Next::Last(last) if last.position == 20));
/// assert!(matches!(next_rated(&table, &mut at), Next::Last(last) if last.position == 20));
/// assert_eq!(next_rated(&table[..5], &mut 3), Next::Underrun);
/// ```
#[inline(never)]
pub fn next_rated(words: &[i32], at: &mut usize) -> Next {
    let [position, velocity, acceleration, behind @ ..] = words.get(*at..).unwrap_or_default()
    else {
        return Next::Underrun;
    };
    let setpoint = Setpoint {
        position: *position,
        velocity: *velocity,
        acceleration: *acceleration,
        ahead: None,
    };
    if behind.is_empty() {
        return Next::Last(setpoint);
    }
    *at = at.wrapping_add(RATED_WORDS);
    Next::Setpoint(setpoint)
}

/// How far a table has been read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TablePlace {
    k: usize,
    /// The entry before, from the second on \[counts\].
    before: i32,
}

impl TablePlace {
    /// Before the first entry.
    pub const START: Self = Self { k: 0, before: 0 };

    /// The setpoint of the next entry, and from the last one on that.
    #[inline]
    pub fn next<const N: usize>(&mut self, table: &SetpointTable<N>) -> Next {
        self.next_of(&table.entries, table.last)
    }

    /// The same of entries wherever they are; behind them `last` is held \[counts\].
    #[inline]
    pub fn next_of(&mut self, entries: &[i32], last: i32) -> Next {
        let before = self.before;
        let position = entries.get(self.k).copied().unwrap_or(last);
        self.before = position;
        let mut setpoint = Setpoint {
            position,
            ..Setpoint::default()
        };
        let is_first = self.k == 0;
        // No entry has the largest number.
        self.k = self.k.saturating_add(1);
        if self.k >= entries.len() {
            return Next::Last(setpoint);
        }
        if !is_first {
            setpoint.velocity = counts::difference(position, before);
        }
        Next::Setpoint(setpoint)
    }
}

impl<T: Borrow<SetpointTable<N>>, const N: usize> TableSource<T, N> {
    /// The table.
    pub fn table(&self) -> &SetpointTable<N> {
        self.table.borrow()
    }

    /// Starts at the first entry.
    pub const fn new(table: T) -> Self {
        let place = TablePlace::START;
        Self { table, place }
    }
}

impl<T: Borrow<SetpointTable<N>>, const N: usize> SetpointSource for TableSource<T, N> {
    #[inline]
    fn next(&mut self, _: &Observed) -> Next {
        self.place.next(self.table.borrow())
    }
}
