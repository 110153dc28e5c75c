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

use core::fmt;

use heapless::spsc::{Consumer, Producer, Queue};

use crate::reference::{Next, Observed, Setpoint, SetpointSource};

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
#[derive(Debug, Clone, Default)]
pub struct Stream<const N: usize> {
    queue: Queue<Streamed, N>,
}

impl<const N: usize> Stream<N> {
    /// Room for one setpoint takes two places: one stays empty.
    const HAS_ROOM: () = assert!(N > 1, "a stream needs room for one setpoint");

    /// An empty queue.
    pub const fn new() -> Self {
        let () = Self::HAS_ROOM;
        Self {
            queue: Queue::new(),
        }
    }

    /// The two ends, before the first setpoint of a motion. What is in the
    /// queue stays there.
    pub fn split(&mut self) -> (StreamSender<'_>, StreamReceiver<'_>) {
        let (producer, consumer) = self.queue.split();
        (
            StreamSender { producer },
            StreamReceiver {
                consumer,
                last: None,
            },
        )
    }
}

/// The end that the link fills.
pub struct StreamSender<'a> {
    producer: Producer<'a, Streamed>,
}

impl StreamSender<'_> {
    /// Appends a setpoint.
    ///
    /// # Errors
    /// The setpoint itself, where the axis has not yet taken enough of the
    /// others. Nothing is lost: send it again.
    pub fn send(&mut self, item: Streamed) -> Result<(), Streamed> {
        self.producer.enqueue(item)
    }

    /// Number of setpoints that can be sent now; taking one makes room for one.
    pub fn room(&self) -> usize {
        // The queue never holds more than it can.
        self.producer.capacity().saturating_sub(self.producer.len())
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
    consumer: Consumer<'a, Streamed>,
    /// The end of the last motion, until the next one begins.
    last: Option<Setpoint>,
}

impl StreamReceiver<'_> {
    /// Number of setpoints that wait. A motion had better begin with a few: the
    /// link may be late by as many samples.
    pub fn waiting(&self) -> usize {
        self.consumer.len()
    }

    /// Throws away what waits, and forgets where the last motion ended.
    pub fn discard(&mut self) {
        // No more than there can be: a sender that goes on does not hold it up.
        for _ in 0..self.consumer.capacity() {
            let _ = self.consumer.dequeue();
        }
        self.last = None;
    }
}

impl SetpointSource for StreamReceiver<'_> {
    fn next(&mut self, _: &Observed) -> Next {
        match (self.consumer.dequeue(), self.last) {
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
