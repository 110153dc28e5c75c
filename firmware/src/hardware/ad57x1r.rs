//! Driver for the AD5721R (12 bits) and AD5761R (16 bits): bipolar D/A
//! converters on SPI.
//!
//! Coding, control register and its readback are those of Analog Devices' data
//! sheet "AD5761R/AD5721R, multiple range, 16-/12-bit, bipolar/unipolar voltage
//! output DACs" (Rev. C), Tables 13 to 16; the numbers of the commands, the
//! meaning of CV, PV and RA and the place of a 12-bit code those of Analog
//! Devices' own driver (no-OS, `ad5761r.h`).
//!
//! # On the wire
//!
//! SPI mode 1 (data taken at the falling clock), frames of 24 bits, one for
//! each fall of the chip select, taken over when it rises:
//!
//! ```text
//!  23 22 21  20  19 18 17 16   15 … 0
//!   x  x  x   0   command      data; 12 bits stand at 15 … 4
//! ```
//!
//! | command | frame | meaning here |
//! | --- | --- | --- |
//! | 1111 | `0F 00 00` | software full reset: as after power-up, output clamped to ground |
//! | 0100 | `04 02 E8` | control register, which also frees the output |
//! | 0011 | `03 hh ll` | write and update the DAC register |
//! | 1100, 1011 | `0C 02 E8`, `0B 00 00` | read back control, DAC register; the answer comes with the next frame, whichever |
//! | 0000 | `00 02 E8` | no operation; fetches an answer |
//!
//! The data of a no operation and of a read-back do not matter. Where they are
//! the control word, one turned bit makes the command 0100 of them, and the chip
//! is then set as it was; one makes 0011 of 1011, and the code is then 0.
//!
//! # The control word
//!
//! ```text
//!  CV 01  OVR 0  B2C 1  ETS 1  IRO 1  PV 01  RA 000   =  0x02E8
//! ```
//!
//! Range ±10 V without overrange, codes in two's complement, internal
//! reference, off when too hot. Clear and power-up value are *midscale*: on a
//! bipolar range that is 0 V, while zero scale, which zeros in CV and PV mean,
//! is −10 V, full speed backwards. The full reset goes before every setting of
//! the range; it also clamps the output to ground meanwhile. That the code 0 is
//! then written all the same makes the output independent of PV.
//!
//! # Every code is a look at the chip
//!
//! [`Ad57x1r::set_code`] asks for the control register and takes the answer with
//! the frame that carries the code: a frame more in a sample, 3 bytes, 6 µs at
//! 4 MHz. The register must read as written, with these two clear:
//!
//! | bit | Table 16 | set by |
//! | --- | --- | --- |
//! | 12, SC | short-circuit condition detected | an output that has met its limit of current |
//! | 11, BO | brownout condition detected | a supply that was too low |
//!
//! Both keep what they have seen until the control register is written, so that
//! nothing between two samples is missed; a chip that has lost its registers with
//! its supply, or does not answer, is found by the same comparison. The code has
//! gone out by then: the caller switches off, and that a fault was reset clears
//! neither bit. [`Ad57x1r::initialise`] does, at standstill.
//!
//! # Codes beyond the range
//!
//! are refused and nothing is sent. Cut to the width they would change sign;
//! saturated, they would hide that controller and converter disagree about the
//! width, with every voltage wrong by a power of two. The caller switches off
//! on every error, see [`crate::hardware`].

use embedded_hal::spi::SpiDevice;
use thiserror::Error;

/// Commands: bits 19 to 16 of a frame.
mod command {
    pub(super) const NO_OPERATION: u8 = 0x0;
    pub(super) const WRITE_AND_UPDATE: u8 = 0x3;
    pub(super) const WRITE_CONTROL: u8 = 0x4;
    pub(super) const READ_DAC: u8 = 0xB;
    pub(super) const READ_CONTROL: u8 = 0xC;
    pub(super) const FULL_RESET: u8 = 0xF;
}

/// See the page's section on the control word.
const CONTROL: u16 = 0x02E8;

/// Bits 12 to 0 of the control register; the others are not defined. SC and BO
/// among them, which [`CONTROL`] has clear.
const CONTROL_MASK: u16 = 0x1FFF;

/// Bit 20, always 0, and the command.
const COMMAND_MASK: u8 = 0x1F;

/// One of the two converters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ad57x1rModel {
    /// 12 bits: codes −2048 to 2047, 4.88 mV each.
    Ad5721r,
    /// 16 bits: codes −32 768 to 32 767, 0.305 mV each.
    Ad5761r,
}

impl Ad57x1rModel {
    /// 12 or 16.
    pub const fn bits(self) -> u32 {
        match self {
            Self::Ad5721r => 12,
            Self::Ad5761r => 16,
        }
    }

    /// Worth of the last place of a code in the 16 bits of a frame.
    const fn last_place(self) -> i16 {
        match self {
            Self::Ad5721r => 16,
            Self::Ad5761r => 1,
        }
    }

    /// The 16 data bits for a code: left-justified. In range exactly if the
    /// product fits: −2^11·16 = −2^15, and 2^11·16 does not.
    fn data(self, code: i32) -> Option<i16> {
        i16::try_from(code).ok()?.checked_mul(self.last_place())
    }

    /// The code of 16 data bits; the bits below a 12-bit code have no meaning.
    fn code(self, data: i16) -> i32 {
        i32::from(match self {
            Self::Ad5721r => data >> 4,
            Self::Ad5761r => data,
        })
    }
}

/// An AD5721R or AD5761R behind its chip select.
///
/// ```no_run
/// # fn example<SPI: embedded_hal::spi::SpiDevice>(spi: SPI)
/// # -> Result<(), firmware::hardware::Ad57x1rError<SPI::Error>> {
/// use firmware::hardware::{Ad57x1r, Ad57x1rModel};
///
/// let mut converter = Ad57x1r::new(spi, Ad57x1rModel::Ad5721r);
/// converter.initialise()?;
/// converter.set_code(-1_024)?; // −5 V
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Ad57x1r<SPI> {
    /// The bus below the driver, for what the driver does not do.
    pub spi: SPI,
    /// The converter, and with it the codes.
    model: Ad57x1rModel,
}

impl<SPI> Ad57x1r<SPI> {
    /// A chip that has not been spoken to yet.
    pub const fn new(spi: SPI, model: Ad57x1rModel) -> Self {
        Self { spi, model }
    }

    /// The converter.
    pub const fn model(&self) -> Ad57x1rModel {
        self.model
    }
}

impl<SPI: SpiDevice> Ad57x1r<SPI> {
    /// Resets the chip, sets its control register and the code 0, and reads
    /// both back. The output is at 0 V from the first frame on.
    ///
    /// # Errors
    /// [`Ad57x1rError`]; the chip must not be used before this has succeeded.
    pub fn initialise(&mut self) -> Result<(), Ad57x1rError<SPI::Error>> {
        self.write(command::FULL_RESET, [0, 0])?;
        self.write(command::WRITE_CONTROL, CONTROL.to_be_bytes())?;
        self.set_code(0)?;
        match self.code()? {
            0 => Ok(()),
            code => Err(Ad57x1rError::NotAtZero { code }),
        }
    }

    /// Writes a code to the DAC register, 0 is 0 V, the smallest is −10 V, and
    /// looks at the control register with it.
    ///
    /// # Errors
    /// [`Ad57x1rError::CodeOutOfRange`], and the output stays as it is;
    /// [`Ad57x1rError::Bus`], and it may;
    /// [`Ad57x1rError::Control`], [`Ad57x1rError::Answer`], and the code was sent.
    pub fn set_code(&mut self, code: i32) -> Result<(), Ad57x1rError<SPI::Error>> {
        let data = self.model.data(code).ok_or(Ad57x1rError::CodeOutOfRange {
            code,
            bits: self.model.bits(),
        })?;
        self.write(command::READ_CONTROL, CONTROL.to_be_bytes())?;
        let [high, low] = data.to_be_bytes();
        let carrier = [command::WRITE_AND_UPDATE, high, low];
        let control = u16::from_be_bytes(self.answer(command::READ_CONTROL, carrier)?);
        if control & CONTROL_MASK == CONTROL {
            Ok(())
        } else {
            Err(Ad57x1rError::Control {
                written: CONTROL,
                read: control,
            })
        }
    }

    /// The code that the DAC register holds, read back in two frames.
    ///
    /// # Errors
    /// [`Ad57x1rError::Bus`], [`Ad57x1rError::Answer`].
    pub fn code(&mut self) -> Result<i32, Ad57x1rError<SPI::Error>> {
        self.write(command::READ_DAC, [0, 0])?;
        let [high, low] = CONTROL.to_be_bytes();
        let carrier = [command::NO_OPERATION, high, low];
        let data = i16::from_be_bytes(self.answer(command::READ_DAC, carrier)?);
        Ok(self.model.code(data))
    }

    fn write(&mut self, command: u8, data: [u8; 2]) -> Result<(), Ad57x1rError<SPI::Error>> {
        let [high, low] = data;
        let written = self.spi.write(&[command, high, low]);
        written.map_err(Ad57x1rError::Bus)
    }

    /// Sends `frame`; the answer to `command`, which went before, comes with it
    /// and carries that command.
    fn answer(
        &mut self,
        command: u8,
        mut frame: [u8; 3],
    ) -> Result<[u8; 2], Ad57x1rError<SPI::Error>> {
        let transferred = self.spi.transfer_in_place(&mut frame);
        transferred.map_err(Ad57x1rError::Bus)?;
        let [answered, data @ ..] = frame;
        if answered & COMMAND_MASK == command {
            Ok(data)
        } else {
            Err(Ad57x1rError::Answer { command, frame })
        }
    }
}

/// Reason for which the converter cannot be used, or not with this code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Ad57x1rError<E> {
    /// The transfer failed; it may pass.
    #[error("the transfer to the converter failed: {0:?}")]
    Bus(E),
    /// The answer to a read-back belongs to another command: another chip, a
    /// swapped or broken line, the wrong SPI mode.
    #[error(
        "the converter answered {frame:02x?} to the command {command:#x}; \
         an answer must repeat the command"
    )]
    Answer {
        /// The command sent.
        command: u8,
        /// The frame that came back.
        frame: [u8; 3],
    },
    /// The control register does not read back as written: the chip has met a
    /// short circuit or a brown-out, has lost its supply, or was never set.
    #[error(
        "the converter's control register was set to {written:#06x} and reads {read:#06x}; \
         the chip must answer as written, without short circuit (bit 12) or brown-out (bit 11)"
    )]
    Control {
        /// The word written.
        written: u16,
        /// The word read back; bit 12 is SC, bit 11 BO.
        read: u16,
    },
    /// The DAC register does not read back the code 0.
    #[error(
        "the converter was set to the code 0 and reads {code}; the chip must answer as written"
    )]
    NotAtZero {
        /// The code read back.
        code: i32,
    },
    /// The converter has no such code. Nothing was sent; with a code in range
    /// the chip goes on.
    #[error(
        "the code {code} does not fit a converter of {bits} bits; \
         controller and converter must have the same number of bits"
    )]
    CodeOutOfRange {
        /// The code given.
        code: i32,
        /// The converter's bits.
        bits: u32,
    },
}
