//! Setpoints that a host streams: a queue between the link and the axis.
//!
//! ```text
//!  host ──link──► send ──► [ queue of N − 1 setpoints ] ──► next ──► axis
//!             (main loop)                              (every sample)
//! ```
//!
//! The two ends are taken apart so that each can live where it is used, the
//! sender with the link and the receiver in the sample interrupt; neither
//! waits for the other. The last setpoint of a motion carries the mark that
//! it is the last. A queue that runs empty before that mark is an underrun,
//! and is reported at the sample that it happens: what the axis does about it
//! is the axis's business, and the receiver hands out what comes after.
//!
//! # Processors
//!
//! Loads and stores of whole words are all that the queue asks of a processor.
//! `heapless::spsc` would serve, but it leaves out those without
//! compare-and-swap that are not on a list of its own, such as
//! `riscv32imc-unknown-none-elf`, or takes a critical section there, and then
//! one end does wait for the other.

use core::fmt;
use core::sync::atomic::{AtomicBool, AtomicI32, AtomicUsize, Ordering};

use crate::dac::Codes;
use crate::reference::{Next, Observed, Setpoint, SetpointSource};
use crate::wide;

/// A setpoint on its way, with velocity and acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Streamed {
    /// More follow.
    Setpoint(Setpoint),
    /// The last of its motion.
    Last(Setpoint),
}

impl Streamed {
    /// The setpoint, last or not.
    pub const fn setpoint(&self) -> Setpoint {
        match *self {
            Self::Setpoint(setpoint) | Self::Last(setpoint) => setpoint,
        }
    }
}

/// Memory for up to `N − 1` setpoints on their way.
///
/// ```
/// use firmware::{Next, Observed, Setpoint, SetpointSource, Stream, Streamed};
///
/// let mut stream = Stream::<4>::new();
/// let (mut sender, mut receiver) = stream.split();
/// let at = |position| Setpoint { position, ..Setpoint::default() };
///
/// sender.send(Streamed::Setpoint(at(1)))?;
/// let seen = Observed::default();
/// assert_eq!(receiver.next(&seen), Next::Setpoint(at(1)));
/// // The motion has not ended, but nothing has come.
/// assert_eq!(receiver.next(&seen), Next::Underrun);
/// sender.send(Streamed::Last(at(2)))?;
/// assert_eq!(receiver.next(&seen), Next::Last(at(2)));
/// # Ok::<(), firmware::stream::Streamed>(())
/// ```
#[derive(Debug, Clone)]
pub struct Stream<const N: usize> {
    queue: Queue<[Place; N]>,
}

impl<const N: usize> Stream<N> {
    /// Room for one setpoint takes two places: one stays empty.
    const HAS_ROOM: () = assert!(N > 1, "a stream needs room for one setpoint");

    /// An empty queue.
    pub const fn new() -> Self {
        let () = Self::HAS_ROOM;
        Self {
            queue: Queue {
                sent: AtomicUsize::new(0),
                taken: AtomicUsize::new(0),
                places: [const { Place::new() }; N],
            },
        }
    }

    /// The two ends, before the first setpoint of a motion. What is in the
    /// queue stays there.
    pub fn split(&mut self) -> (StreamSender<'_>, StreamReceiver<'_>) {
        let queue = &self.queue;
        (StreamSender { queue }, StreamReceiver { queue, last: None })
    }
}

impl<const N: usize> Default for Stream<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Ring of places for one sender and one receiver. One place stays empty, so
/// that a full ring is not taken for an empty one.
#[derive(Debug)]
struct Queue<Places: ?Sized> {
    /// Place of the next setpoint to be sent; only the sender changes it.
    sent: AtomicUsize,
    /// Place of the next setpoint to be taken; only the receiver changes it.
    taken: AtomicUsize,
    places: Places,
}

impl Queue<[Place]> {
    fn capacity(&self) -> usize {
        self.places.len().saturating_sub(1)
    }

    /// Exact but for what the other end does meanwhile: the sender sees as many
    /// as this or more than there are, the receiver as many or fewer.
    fn waiting(&self) -> usize {
        let sent = self.sent.load(Ordering::Acquire);
        let taken = self.taken.load(Ordering::Acquire);
        let turn = if sent < taken { self.places.len() } else { 0 };
        sent.saturating_add(turn).saturating_sub(taken)
    }

    fn after(&self, place: usize) -> usize {
        let next = place.saturating_add(1);
        if next < self.places.len() { next } else { 0 }
    }

    /// Appends an item; by the sender only. `None` where there is no room.
    fn send(&self, item: Streamed) -> Option<()> {
        let sent = self.sent.load(Ordering::Relaxed);
        let next = self.after(sent);
        // Acquired, so that the receiver is done with the place.
        if next == self.taken.load(Ordering::Acquire) {
            return None;
        }
        self.places.get(sent)?.store(item);
        self.sent.store(next, Ordering::Release);
        Some(())
    }

    /// Takes the first item; by the receiver only.
    fn take(&self) -> Option<Streamed> {
        let taken = self.taken.load(Ordering::Relaxed);
        // Acquired, so that the place is filled.
        if taken == self.sent.load(Ordering::Acquire) {
            return None;
        }
        let item = self.places.get(taken)?.load();
        self.taken.store(self.after(taken), Ordering::Release);
        Some(item)
    }
}

impl<Places: Clone> Clone for Queue<Places> {
    fn clone(&self) -> Self {
        let copy = |at: &AtomicUsize| AtomicUsize::new(at.load(Ordering::Relaxed));
        Self {
            sent: copy(&self.sent),
            taken: copy(&self.taken),
            places: self.places.clone(),
        }
    }
}

/// An item, word by word: both ends refer to it, and only what is atomic can be
/// written through that without `unsafe`. Its order is that of the ring's ends.
#[derive(Debug)]
struct Place {
    /// Position, velocity, acceleration, and of the feed-forward, where there is one, the
    /// upper and the lower word.
    words: [AtomicI32; 5],
    computed: AtomicBool,
    last: AtomicBool,
}

impl Place {
    const fn new() -> Self {
        Self {
            words: [const { AtomicI32::new(0) }; 5],
            computed: AtomicBool::new(false),
            last: AtomicBool::new(false),
        }
    }

    fn store(&self, item: Streamed) {
        let setpoint = item.setpoint();
        let ahead = setpoint.ahead.unwrap_or_default().to_bits();
        let words = [
            setpoint.position,
            setpoint.velocity,
            setpoint.acceleration,
            wide::upper(ahead),
            wide::lower(ahead),
        ];
        for (place, word) in self.words.iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
        let computed = setpoint.ahead.is_some();
        self.computed.store(computed, Ordering::Relaxed);
        let last = matches!(item, Streamed::Last(_));
        self.last.store(last, Ordering::Relaxed);
    }

    fn load(&self) -> Streamed {
        let words = self.words.each_ref();
        let [position, velocity, acceleration, upper, lower] =
            words.map(|word| word.load(Ordering::Relaxed));
        let ahead = Codes::from_bits(wide::joined(upper, lower));
        let setpoint = Setpoint {
            position,
            velocity,
            acceleration,
            ahead: self.computed.load(Ordering::Relaxed).then_some(ahead),
        };
        if self.last.load(Ordering::Relaxed) {
            Streamed::Last(setpoint)
        } else {
            Streamed::Setpoint(setpoint)
        }
    }
}

impl Clone for Place {
    fn clone(&self) -> Self {
        let copy = Self::new();
        copy.store(self.load());
        copy
    }
}

/// The end that the link fills.
pub struct StreamSender<'a> {
    queue: &'a Queue<[Place]>,
}

impl StreamSender<'_> {
    /// Appends a setpoint.
    ///
    /// # Errors
    /// The setpoint itself, where the axis has not yet taken enough of the
    /// others. Nothing is lost: send it again.
    pub fn send(&mut self, item: Streamed) -> Result<(), Streamed> {
        self.queue.send(item).ok_or(item)
    }

    /// Number of setpoints that can be sent now; taking one makes room for one.
    pub fn room(&self) -> usize {
        // The queue never holds more than it can.
        self.queue.capacity().saturating_sub(self.queue.waiting())
    }
}

impl fmt::Debug for StreamSender<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StreamSender")
            .field("room", &self.room())
            .finish()
    }
}

/// The end that the axis empties, one setpoint a sample.
pub struct StreamReceiver<'a> {
    queue: &'a Queue<[Place]>,
    /// The end of the last motion, until the next one begins.
    last: Option<Setpoint>,
}

impl StreamReceiver<'_> {
    /// Number of setpoints that wait. A motion had better begin with a few: the
    /// link may be late by as many samples.
    pub fn waiting(&self) -> usize {
        self.queue.waiting()
    }

    /// Throws away what waits, and forgets where the last motion ended.
    pub fn discard(&mut self) {
        // No more than there can be: a sender that goes on does not hold it up.
        for _ in 0..self.queue.capacity() {
            let _ = self.queue.take();
        }
        self.last = None;
    }
}

impl SetpointSource for StreamReceiver<'_> {
    fn next(&mut self, _: &Observed) -> Next {
        match (self.queue.take(), self.last) {
            (Some(Streamed::Setpoint(setpoint)), _) => {
                self.last = None;
                Next::Setpoint(setpoint)
            }
            (Some(Streamed::Last(setpoint)), _) => {
                self.last = Some(setpoint);
                Next::Last(setpoint)
            }
            (None, Some(setpoint)) => Next::Last(setpoint),
            (None, None) => Next::Underrun,
        }
    }
}

impl fmt::Debug for StreamReceiver<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StreamReceiver")
            .field("waiting", &self.waiting())
            .field("last", &self.last)
            .finish()
    }
}
