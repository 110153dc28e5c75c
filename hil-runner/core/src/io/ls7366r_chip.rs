//! The LS7366R, register by register, as its data sheet tells it (LSI/CSI
//! 7366R-122205, pages 3 and 4).
//!
//! ```text
//!  encoder ──► quadrature ──► CNTR ◄── LOAD CNTR ── DTR ◄── WR DTR
//!              ×1 ×2 ×4        └── RD CNTR, LOAD OTR ──► OTR ──► RD CNTR, RD OTR
//! ```
//!
//! The encoder is given as a position in quarters of a line (what ×4 counts) on
//! an endless axis; the counter follows its differences and wraps at its width.
//!
//! Different from the chip, on purpose: the counter stands still unless MDR0
//! asks for a free-running quadrature mode, so that a driver that sets another
//! mode is found out; index and compare are not wired and their latches stay 0;
//! the flag pins and the filter clock have no counterpart. After power-up the
//! counter holds [`Ls7366rChip::POWER_UP_COUNT`], because a chip promises
//! nothing about it. Whether CLR STR takes CEN along no source settles: it does
//! or does not, as asked for, and then for good.

use super::bus::SpiChip;

// The registers that an instruction can name: B5 B4 B3.
const MDR0: u8 = 0b001;
const MDR1: u8 = 0b010;
const DTR: u8 = 0b011;
const CNTR: u8 = 0b100;
const OTR: u8 = 0b101;
const STR: u8 = 0b110;

// The bits of STR: CY BW CMP IDX CEN PLS U/D S.
const CARRY: u8 = 1 << 7;
const BORROW: u8 = 1 << 6;
const COUNT_ENABLED: u8 = 1 << 3;
const POWER_LOST: u8 = 1 << 2;
const COUNTED_UP: u8 = 1 << 1;
const NEGATIVE: u8 = 1;

/// Meaning of the bytes behind an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Data {
    /// An instruction is to come.
    Instruction,
    /// Nothing: the instruction has no data, or all of it.
    Ignored,
    /// They leave the chip from the upper end of this word, zeros behind them.
    Out(u32),
    /// They enter a register, taken over when all are in: that, the number of bytes to
    /// come, and the word so far.
    In(u8, usize, u32),
}

/// The chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ls7366rChip {
    position: i64,
    enable_pin: bool,
    mdr0: u8,
    mdr1: u8,
    dtr: u32,
    cntr: u32,
    otr: u32,
    /// The latched bits of STR, all but [`COUNT_ENABLED`].
    latched: u8,
    /// CLR STR takes CEN along.
    clears_cen: bool,
    cen_cleared: bool,
    data: Data,
}

impl Ls7366rChip {
    /// Content of the counter after power-up.
    pub const POWER_UP_COUNT: u32 = 0xDEAD_BEEF;

    /// A chip that has just got its supply, at an encoder position \[quarters
    /// of a line\].
    pub const fn new(position: i64) -> Self {
        Self {
            position,
            enable_pin: true,
            mdr0: 0,
            mdr1: 0,
            dtr: 0,
            cntr: Self::POWER_UP_COUNT,
            otr: 0,
            latched: POWER_LOST,
            clears_cen: false,
            cen_cleared: false,
            data: Data::Instruction,
        }
    }

    /// The supply goes and comes back.
    pub fn lose_power(&mut self) {
        *self = Self {
            enable_pin: self.enable_pin,
            clears_cen: self.clears_cen,
            ..Self::new(self.position)
        };
    }

    /// The level of `CNT_EN`, which a pull-up holds high.
    pub fn set_enable_pin(&mut self, high: bool) {
        self.enable_pin = high;
    }

    /// The other reading of the data sheet: CLR STR clears CEN, too.
    pub fn set_clears_cen(&mut self, clears: bool) {
        self.clears_cen = clears;
    }

    /// The encoder moves to a position \[quarters of a line\].
    pub fn move_to(&mut self, position: i64) {
        let from = std::mem::replace(&mut self.position, position);
        if !self.counting() {
            return;
        }
        // B3 B2 = 00 is free running; B1 B0 = 01, 10, 11 counts every fourth,
        // every second, every quarter of a line.
        let quarters_per_count = match self.mdr0 & 0x0F {
            0b0001 => 4,
            0b0010 => 2,
            0b0011 => 1,
            _ => return,
        };
        let counts = i128::from(position.div_euclid(quarters_per_count))
            - i128::from(from.div_euclid(quarters_per_count));
        if counts == 0 {
            return;
        }
        let latched = self.latched & !COUNTED_UP;
        self.latched = latched | if counts > 0 { COUNTED_UP } else { 0 };
        let beyond = i128::from(self.cntr) + counts;
        let turn = 1_i128 << (8 * self.bytes());
        match beyond.div_euclid(turn) {
            0 => {}
            1.. => self.latched = (self.latched | CARRY) & !NEGATIVE,
            _ => self.latched |= BORROW | NEGATIVE,
        }
        self.cntr = u32::try_from(beyond.rem_euclid(turn)).unwrap_or(0);
    }

    const fn counting(&self) -> bool {
        self.enable_pin && self.mdr1 & 0x04 == 0
    }

    /// Bytes of CNTR, DTR and OTR: B1 B0 of MDR1 fewer than four.
    fn bytes(&self) -> usize {
        4 - usize::from(self.mdr1 & 0x03)
    }

    /// `word` cut to the width of the counter.
    fn cut(&self, word: u32) -> u32 {
        word & (u32::MAX >> (32 - 8 * self.bytes()))
    }

    const fn status(&self) -> u8 {
        let enabled = self.counting() && !self.cen_cleared;
        self.latched | if enabled { COUNT_ENABLED } else { 0 }
    }

    /// The lowest bytes of `word` leave the chip.
    const fn out(word: u32, bytes: usize) -> Data {
        Data::Out(word << (32 - 8 * bytes))
    }

    /// B7 B6: 00 CLR, 01 RD, 10 WR, 11 LOAD. Table 1 of the data sheet.
    fn start(&mut self, instruction: u8) {
        let register = (instruction >> 3) & 0b111;
        self.data = Data::Ignored;
        match (instruction >> 6, register) {
            (0b00, MDR0) => self.mdr0 = 0,
            (0b00, MDR1) => self.mdr1 = 0,
            (0b00, CNTR) => self.cntr = 0,
            (0b00, STR) => {
                self.latched = 0;
                self.cen_cleared = self.clears_cen;
            }
            (0b01, MDR0) => self.data = Self::out(u32::from(self.mdr0), 1),
            (0b01, MDR1) => self.data = Self::out(u32::from(self.mdr1), 1),
            (0b01, CNTR) => {
                self.otr = self.cntr;
                self.data = Self::out(self.otr, self.bytes());
            }
            (0b01, OTR) => self.data = Self::out(self.otr, self.bytes()),
            (0b01, STR) => self.data = Self::out(u32::from(self.status()), 1),
            (0b10, MDR0 | MDR1) => self.data = Data::In(register, 1, 0),
            (0b10, DTR) => self.data = Data::In(register, self.bytes(), 0),
            (0b11, CNTR) => self.cntr = self.cut(self.dtr),
            (0b11, OTR) => self.otr = self.cntr,
            _ => {}
        }
    }

    fn store(&mut self, register: u8, word: u32) {
        let [low, ..] = word.to_le_bytes();
        match register {
            MDR0 => self.mdr0 = low,
            MDR1 => {
                self.mdr1 = low;
                self.cntr = self.cut(self.cntr);
            }
            DTR => self.dtr = word,
            _ => {}
        }
    }
}

impl SpiChip for Ls7366rChip {
    fn select(&mut self) {
        self.data = Data::Instruction;
    }

    fn exchange(&mut self, mosi: u8) -> u8 {
        match &mut self.data {
            Data::Instruction => {
                self.start(mosi);
                0
            }
            Data::Ignored => 0,
            Data::Out(word) => {
                let [first, ..] = word.to_be_bytes();
                *word <<= 8;
                first
            }
            Data::In(register, bytes, word) => {
                *word = *word << 8 | u32::from(mosi);
                *bytes -= 1;
                if *bytes == 0 {
                    let (register, word) = (*register, *word);
                    self.data = Data::Ignored;
                    self.store(register, word);
                }
                0
            }
        }
    }

    fn deselect(&mut self) {
        self.select();
    }
}
