//! The AD5721R and AD5761R, register by register; the sources are those of the
//! driver, [`firmware::hardware::ad57x1r`].
//!
//! ```text
//!  MOSI ──► shift register, 24 bits ──► MISO
//!                │ chip select rises: command                CV, PV, RA, coding
//!                ▼                                           control register
//!           input register ──► DAC register ──► output ◄─────────┘
//!                                    (clamped to ground until control is written)
//! ```
//!
//! A frame shifts out what the shift register holds: the answer to a read-back
//! if the frame before asked for one, else that frame itself (daisy chain).
//! Frames of fewer than 24 bits do nothing; of longer ones the last 24 count.
//!
//! Both registers hold 16 bits, the twelve of an AD5721R left-justified.
//!
//! Taken as likely where the sources are silent: the first control frame after a
//! reset frees the output at the power-up value of its PV bits, a frame with
//! bit 20 set does nothing; after a reset short circuit and brown-out stand until
//! control is written, which clears them. The driver relies on none of it. Not
//! wired: the pins `LDAC` (so the DAC register changes only by command), `CLR`
//! and `RESET`, and overrange. A short circuit and a brown-out are only reported:
//! the output stays as it is.

use firmware::hardware::Ad57x1rModel;

use super::bus::SpiChip;

// Bits of the control register that only the chip sets.
const SHORT_CIRCUIT: u16 = 1 << 12;
const BROWN_OUT: u16 = 1 << 11;

/// Output of the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DacOutput {
    /// Clamped to ground: 0 V, whatever the registers hold.
    Clamped,
    /// Driven; the code of the DAC register counted from the middle of the
    /// range, −2^(n−1) to 2^(n−1)−1.
    Code(i32),
}

/// The chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ad57x1rChip {
    model: Ad57x1rModel,
    /// 24 bits.
    shift: u32,
    bytes: u32,
    input: u16,
    dac: u16,
    /// `None` until written: the output is clamped.
    control: Option<u16>,
    /// Bits of the conditions seen since control was written.
    seen: u16,
    daisy_chain: bool,
}

impl Ad57x1rChip {
    /// A chip that has just got its supply.
    pub const fn new(model: Ad57x1rModel) -> Self {
        Self {
            model,
            shift: 0,
            bytes: 0,
            input: 0,
            dac: 0,
            control: None,
            seen: SHORT_CIRCUIT | BROWN_OUT,
            daisy_chain: true,
        }
    }

    /// The supply goes and comes back.
    pub fn lose_power(&mut self) {
        *self = Self::new(self.model);
    }

    /// The output meets a short circuit, which may pass.
    pub fn short_circuit(&mut self) {
        self.seen |= SHORT_CIRCUIT;
    }

    /// The supply becomes too low for a moment, and the registers survive it.
    pub fn brown_out(&mut self) {
        self.seen |= BROWN_OUT;
    }

    /// The output.
    pub fn output(&self) -> DacOutput {
        let Some(control) = self.control else {
            return DacOutput::Clamped;
        };
        let middle = if twos_complement(control) { 0 } else { 0x8000 };
        // Counted from the middle, the 16 bits are two's complement.
        let left_justified = (self.dac ^ middle).cast_signed();
        DacOutput::Code(i32::from(left_justified >> self.unused_bits()))
    }

    /// The voltage at the output \[V\] without load and errors.
    pub fn output_v(&self) -> f64 {
        let (Some(control), DacOutput::Code(code)) = (self.control, self.output()) else {
            return 0.0;
        };
        // RA: lower end and span of the range.
        let (lower_v, span_v) = match control & 0x7 {
            0b000 => (-10.0, 20.0),
            0b001 => (0.0, 10.0),
            0b010 => (-5.0, 10.0),
            0b011 => (0.0, 5.0),
            0b100 => (-2.5, 10.0),
            0b101 => (-3.0, 6.0),
            0b110 => (0.0, 16.0),
            _ => (0.0, 20.0),
        };
        let codes = f64::from(1_u32 << self.model.bits());
        lower_v + span_v * (0.5 + f64::from(code) / codes)
    }

    const fn unused_bits(&self) -> u32 {
        16 - self.model.bits()
    }

    /// `data` without the bits that the model does not have.
    const fn cut(&self, data: u16) -> u16 {
        data & (u16::MAX << self.unused_bits())
    }

    /// The data that PV, bits 4 and 3, asks for, in the coding of `control`: an end
    /// of the range or its middle.
    const fn power_up(&self, control: u16) -> u16 {
        let straight = match (control >> 3) & 0b11 {
            0b00 => 0,
            0b01 => 0x8000,
            _ => u16::MAX,
        };
        let sign = if twos_complement(control) { 0x8000 } else { 0 };
        self.cut(straight ^ sign)
    }

    fn set_control(&mut self, data: u16) {
        let control = data & 0x07FF;
        self.seen = 0;
        if self.control.replace(control).is_none() {
            self.reset_data(control);
        }
    }

    fn reset_data(&mut self, control: u16) {
        self.input = self.power_up(control);
        self.dac = self.input;
    }

    fn execute(&mut self) {
        let frame = self.shift;
        let [_, head, high, low] = frame.to_be_bytes();
        let data = u16::from_be_bytes([high, low]);
        // Bit 20 must be 0; bits 23 to 21 do not matter.
        match head & 0x1F {
            0x1 => self.input = self.cut(data),
            0x2 => self.dac = self.input,
            0x3 => (self.input, self.dac) = (self.cut(data), self.cut(data)),
            0x4 => self.set_control(data),
            0x7 => self.reset_data(self.control.unwrap_or(0)),
            0x9 => self.daisy_chain = low & 1 == 0,
            0xA => self.answer(head, self.input),
            0xB => self.answer(head, self.dac),
            0xC => self.answer(head, self.control.unwrap_or(0) | self.seen),
            0xF => self.lose_power(),
            _ => {}
        }
    }

    fn answer(&mut self, head: u8, data: u16) {
        let [high, low] = data.to_be_bytes();
        self.shift = u32::from_be_bytes([0, head & 0x1F, high, low]);
    }
}

/// B2C, bit 7.
const fn twos_complement(control: u16) -> bool {
    control & 0x0080 != 0
}

impl SpiChip for Ad57x1rChip {
    fn select(&mut self) {
        self.bytes = 0;
    }

    fn exchange(&mut self, mosi: u8) -> u8 {
        self.bytes += 1;
        let [_, miso, high, low] = self.shift.to_be_bytes();
        self.shift = u32::from_be_bytes([0, high, low, mosi]);
        // Without daisy chain the chip's output is off; a pull-down reads 0.
        if self.daisy_chain { miso } else { 0 }
    }

    fn deselect(&mut self) {
        if self.bytes >= 3 {
            self.execute();
        }
    }
}
