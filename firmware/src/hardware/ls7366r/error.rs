//! Why the counter cannot be used.

use core::fmt;

use super::Ls7366rStatus;

/// One of the two mode registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModeRegister {
    /// Counting mode, index, filter.
    Mdr0,
    /// Width, enable, flags.
    Mdr1,
}

impl fmt::Display for ModeRegister {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mdr0 => "MDR0",
            Self::Mdr1 => "MDR1",
        })
    }
}

/// Why the counter cannot be used. A [`Ls7366rError::Bus`] may pass; after the
/// others the count is worthless until [`Ls7366r::initialise`](super::Ls7366r::initialise) succeeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ls7366rError<E> {
    /// The transfer failed.
    Bus(E),
    /// A mode register does not read back as written: another chip, a swapped
    /// or broken line, the wrong SPI mode.
    ModeRegister {
        /// Which one.
        register: ModeRegister,
        /// The byte written.
        written: u8,
        /// The byte read back.
        read: u8,
    },
    /// The mode is right, but the chip does not count.
    NotCounting {
        /// The status read.
        status: Ls7366rStatus,
    },
    /// The chip has been without power, and with it count and mode.
    PowerLost {
        /// The status read.
        status: Ls7366rStatus,
    },
}

impl<E: fmt::Debug> fmt::Display for Ls7366rError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "the transfer to the counter failed: {error:?}"),
            Self::ModeRegister {
                register,
                written,
                read,
            } => write!(
                f,
                "the counter's {register} was set to {written:#04x} and reads {read:#04x}; \
                 the chip must answer as written"
            ),
            Self::NotCounting { status } => write!(
                f,
                "the counter is not counting (status {:#04x}); its enable pin must be high",
                status.bits()
            ),
            Self::PowerLost { status } => write!(
                f,
                "the counter has lost its supply (status {:#04x}); \
                 it must be initialised and the axis be referenced again",
                status.bits()
            ),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for Ls7366rError<E> {}
