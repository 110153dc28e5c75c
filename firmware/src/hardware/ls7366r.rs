//! Driver for the LS7366R: a quadrature counter of up to 32 bits on SPI.
//!
//! Register facts are those of the LSI/CSI data sheet "LS7366R 32-bit
//! quadrature counter with serial interface" (7366R-122205): sections STR, IR
//! with Table 1, CNTR and OTR on page 3, MDR0 and MDR1 on page 4.
//!
//! # On the wire
//!
//! SPI mode 0, most significant bit first, one instruction for each fall of the
//! chip select: an instruction byte, then 0 to 4 bytes of data.
//!
//! ```text
//! instruction   B7 B6: 00 CLR  01 RD  10 WR  11 LOAD
//!               B5 B4 B3: 001 MDR0  010 MDR1  011 DTR  100 CNTR  101 OTR  110 STR
//! ```
//!
//! | instruction | bytes | meaning here |
//! | --- | --- | --- |
//! | WR MDR0 | `88 03` | four counts per line, free running, index off, filter clock undivided |
//! | WR MDR1 | `90 00`, `90 02` | four or two bytes wide, counting, no flag pins |
//! | CLR CNTR, CLR STR | `20`, `30` | count 0, status latches cleared |
//! | RD MDR0, RD MDR1 | `48 xx`, `50 xx` | read back what was written |
//! | RD CNTR | `60 xx xx (xx xx)` | the count, coherent |
//! | RD STR | `70 xx` | the status; at a start once before CLR STR, too |
//!
//! RD CNTR copies the counter to the output register OTR at once and then
//! shifts OTR out: all bytes are of one instant, however slow the bus is and
//! however fast the encoder turns. It makes LOAD OTR followed by RD OTR, two
//! selects instead of one, unnecessary.
//!
//! # Checks
//!
//! [`Ls7366r::initialise`] refuses a chip that does not read back both mode
//! registers as written, that after a loss of power says that it is not counting
//! (its `CNT_EN` pin is held low), or whose loss of power stays on record.
//!
//! It asks for CEN before CLR STR. Table 1 says that this clears STR "to zero",
//! page 3 that CEN tells whether the counter is enabled, and nothing which of
//! the two holds behind it, or how long. PLS tells whether a CLR STR has gone
//! before since power-up; if so, CEN is not asked, and a `CNT_EN` that has gone
//! low meanwhile is left to the monitor over a lost encoder.
//!
//! [`Ls7366r::count`] reads the status behind every count: a chip that has lost
//! its supply for a moment comes back with a cleared MDR0, in which it is not a
//! quadrature counter at all, and would otherwise go on answering plausible
//! numbers. Count and status are 7 bytes a sample (5 with two-byte counts): 14 µs
//! at 4 MHz.

use embedded_hal::spi::SpiDevice;
use thiserror::Error;

/// Instructions: B7 B6 what, B5 B4 B3 with which register.
mod instruction {
    pub(super) const CLEAR_CNTR: u8 = 0x20;
    pub(super) const CLEAR_STR: u8 = 0x30;
    pub(super) const READ_MDR0: u8 = 0x48;
    pub(super) const READ_MDR1: u8 = 0x50;
    pub(super) const READ_CNTR: u8 = 0x60;
    pub(super) const READ_STR: u8 = 0x70;
    pub(super) const WRITE_MDR0: u8 = 0x88;
    pub(super) const WRITE_MDR1: u8 = 0x90;
}

/// B1 B0 = 11: four counts per line; all else 0: free running, index disabled,
/// filter clock not divided.
const MDR0: u8 = 0x03;

/// Number of bits that the counter is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CounterWidth {
    /// Two bytes: wraps at 2^16 counts, one transfer of 3 bytes.
    Bits16,
    /// Four bytes: wraps at 2^32 counts, one transfer of 5 bytes.
    Bits32,
}

impl CounterWidth {
    /// 16 or 32.
    pub const fn bits(self) -> u32 {
        match self {
            Self::Bits16 => 16,
            Self::Bits32 => 32,
        }
    }

    /// MDR1: B1 B0 the bytes (00 four, 10 two), B2 = 0 counting, no flags.
    const fn mdr1(self) -> u8 {
        match self {
            Self::Bits16 => 0x02,
            Self::Bits32 => 0x00,
        }
    }
}

/// The status register as read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ls7366rStatus(u8);

impl Ls7366rStatus {
    /// B7, CY: the counter has passed its upper end since the last clear.
    pub const fn carry(self) -> bool {
        self.0 & 0x80 != 0
    }

    /// B6, BW: the counter has passed its lower end since the last clear.
    pub const fn borrow(self) -> bool {
        self.0 & 0x40 != 0
    }

    /// B3, CEN: the counter is enabled. No source says what it reads behind
    /// CLR STR, and so behind [`Ls7366r::initialise`].
    pub const fn counting(self) -> bool {
        self.0 & 0x08 != 0
    }

    /// B2, PLS: the chip has been without power since the last clear.
    pub const fn power_lost(self) -> bool {
        self.0 & 0x04 != 0
    }

    /// All eight bits: CY BW CMP IDX CEN PLS U/D S.
    pub const fn bits(self) -> u8 {
        self.0
    }
}

/// An LS7366R behind its chip select.
///
/// ```no_run
/// # fn example<SPI: embedded_hal::spi::SpiDevice>(spi: SPI)
/// # -> Result<(), firmware::hardware::Ls7366rError<SPI::Error>> {
/// use firmware::hardware::{CounterWidth, Ls7366r};
///
/// let mut counter = Ls7366r::new(spi, CounterWidth::Bits32);
/// counter.initialise()?;
/// let register: u32 = counter.count()?;
/// # let _ = register;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Ls7366r<SPI> {
    /// The bus below the driver, for what the driver does not do.
    pub spi: SPI,
    width: CounterWidth,
}

impl<SPI> Ls7366r<SPI> {
    /// A chip that has not been spoken to yet.
    pub const fn new(spi: SPI, width: CounterWidth) -> Self {
        Self { spi, width }
    }
}

impl<SPI: SpiDevice> Ls7366r<SPI> {
    /// Sets both mode registers, clears count and status, and reads back what
    /// the chip made of it. May be called again at standstill; the count is
    /// then 0.
    ///
    /// # Errors
    /// [`Ls7366rError`]; the chip must not be used before this has succeeded.
    pub fn initialise(&mut self) -> Result<(), Ls7366rError<SPI::Error>> {
        let mdr1 = self.width.mdr1();
        self.write(&[instruction::WRITE_MDR0, MDR0])?;
        self.write(&[instruction::WRITE_MDR1, mdr1])?;
        let before = self.status()?;
        self.write(&[instruction::CLEAR_CNTR])?;
        self.write(&[instruction::CLEAR_STR])?;

        for (register, read, written) in [
            ("MDR0", instruction::READ_MDR0, MDR0),
            ("MDR1", instruction::READ_MDR1, mdr1),
        ] {
            let read = self.read_byte(read)?;
            if read != written {
                return Err(Ls7366rError::ModeRegister {
                    register,
                    written,
                    read,
                });
            }
        }
        // Behind the mode registers, which tell a chip that is not there.
        if before.power_lost() && !before.counting() {
            return Err(Ls7366rError::NotCounting { status: before });
        }
        self.trusted_status().map(drop)
    }

    /// The count \[counts\], modulo 2^16 or 2^32 by the width.
    ///
    /// # Errors
    /// [`Ls7366rError::Bus`]; [`Ls7366rError::PowerLost`] if the chip has been
    /// without power since [`Ls7366r::initialise`], or was never initialised.
    pub fn count(&mut self) -> Result<u32, Ls7366rError<SPI::Error>> {
        let count = match self.width {
            CounterWidth::Bits16 => {
                let [_, high, low] = self.exchange([instruction::READ_CNTR, 0, 0])?;
                u32::from(u16::from_be_bytes([high, low]))
            }
            CounterWidth::Bits32 => {
                let [_, bytes @ ..] = self.exchange([instruction::READ_CNTR, 0, 0, 0, 0])?;
                u32::from_be_bytes(bytes)
            }
        };
        // Behind the count, so that power lost before it cannot be missed.
        self.trusted_status()?;
        Ok(count)
    }

    /// The status register.
    ///
    /// # Errors
    /// [`Ls7366rError::Bus`].
    pub fn status(&mut self) -> Result<Ls7366rStatus, Ls7366rError<SPI::Error>> {
        self.read_byte(instruction::READ_STR).map(Ls7366rStatus)
    }

    fn trusted_status(&mut self) -> Result<Ls7366rStatus, Ls7366rError<SPI::Error>> {
        let status = self.status()?;
        if status.power_lost() {
            Err(Ls7366rError::PowerLost { status })
        } else {
            Ok(status)
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Ls7366rError<SPI::Error>> {
        self.spi.write(bytes).map_err(Ls7366rError::Bus)
    }

    fn read_byte(&mut self, instruction: u8) -> Result<u8, Ls7366rError<SPI::Error>> {
        let [_, byte] = self.exchange([instruction, 0])?;
        Ok(byte)
    }

    /// One instruction with its data, in a single select; what came back.
    fn exchange<const N: usize>(
        &mut self,
        mut bytes: [u8; N],
    ) -> Result<[u8; N], Ls7366rError<SPI::Error>> {
        let transferred = self.spi.transfer_in_place(&mut bytes);
        transferred.map(|()| bytes).map_err(Ls7366rError::Bus)
    }
}

/// Reason for which the counter cannot be used. A [`Ls7366rError::Bus`] may pass; after the
/// others the count is worthless until [`Ls7366r::initialise`] succeeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Ls7366rError<E> {
    /// The transfer failed.
    #[error("the transfer to the counter failed: {0:?}")]
    Bus(E),
    /// A mode register does not read back as written: another chip, a swapped
    /// or broken line, the wrong SPI mode.
    #[error(
        "the counter's {register} was set to {written:#04x} and reads {read:#04x}; \
         the chip must answer as written"
    )]
    ModeRegister {
        /// The register, MDR0 or MDR1.
        register: &'static str,
        /// The byte written.
        written: u8,
        /// The byte read back.
        read: u8,
    },
    /// The mode is right, but the chip does not count.
    #[error(
        "the counter is not counting (status {:#04x}); its enable pin must be high",
        .status.bits()
    )]
    NotCounting {
        /// The status read.
        status: Ls7366rStatus,
    },
    /// The chip has been without power, and with it count and mode.
    #[error(
        "the counter has lost its supply (status {:#04x}); \
         it must be initialised and the axis be referenced again",
        .status.bits()
    )]
    PowerLost {
        /// The status read.
        status: Ls7366rStatus,
    },
}
