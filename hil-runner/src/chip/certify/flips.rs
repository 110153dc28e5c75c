//! One-bit changes of the machine code, each run as the image itself is: how much
//! of the code the comparison looks at.
//!
//! ```text
//!  image ──► run, QEMU's log ──► instructions that were executed
//!                                             │ drawn, one bit of each
//!                                             ▼
//!  copy with that bit ──► HELLO ──► vectors ──► cases ──► Found or Survivor
//! ```
//!
//! The CRC-32 that the chip tells of its image gives every flip away; here
//! counts only how the chip behaves. Constants and tables between the
//! instructions are not flipped.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use firmware_link::Identity;
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;
use rustc_demangle::demangle;

use super::{Comparison, HostTrace, TraceHash, VectorFile, replay};
use crate::chip::chip_law::ChipLaw;
use crate::chip::client::{Client, GIVE_UP};
use crate::chip::guard::OneCpu;
use crate::chip::image::crc32;
use crate::chip::line::ChipError;
use crate::chip::qemu::{FifoLine, start_logged};
use crate::chip::spec::Target;

/// Time that vectors and cases may take. An image as it is took 1 s with one
/// other process a core, 2026-11; a flipped one may be asked everything twice.
const LONGEST: Duration = Duration::from_secs(60);

/// An instruction that a run has executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instruction {
    /// The function that has it.
    pub symbol: String,
    /// Its bytes in memory.
    pub bytes: Vec<u8>,
    /// QEMU's words for it: "bne #0x5e".
    pub text: String,
}

/// Executed instructions by address.
pub type Executed = BTreeMap<u32, Instruction>;

/// A bit of an instruction to be inverted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flip {
    /// Address of the instruction.
    pub address: u32,
    /// Number of the bit, from the lowest of the first byte.
    pub bit: usize,
}

/// The part of the comparison that finds a flip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Up to the answer to HELLO.
    Start,
    /// The golden vectors.
    Vectors,
    /// The cases in closed loop, behind the vectors.
    Cases,
}

/// The behaviour that finds a flip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An answer with another number.
    Number,
    /// A refusal, or an answer to something else.
    Refusal,
    /// No answer in time.
    Silence,
    /// The end of QEMU: the processor has locked up.
    End,
}

/// The end of a flip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// The comparison shows a difference.
    Found {
        /// Its place.
        place: Place,
        /// Its kind.
        kind: Kind,
        /// Both in words.
        sentence: String,
    },
    /// No row and no step shows one.
    Survived {
        /// QEMU's words for the other instruction.
        text: String,
        /// Remarks that may explain it.
        remarks: Vec<String>,
    },
}

/// An image, and all that its flips are held against.
#[derive(Debug)]
pub struct Campaign<'a> {
    target: Target,
    image: Vec<u8>,
    vectors: &'a [VectorFile],
    hosts: &'a [HostTrace<'a>],
    /// None before the first run.
    identity: Option<Identity>,
    executed: Executed,
    /// Requests that are asked again even so: a HELLO while the chip still starts.
    repeated: u64,
}

/// A run of an image.
#[derive(Default)]
struct Trial {
    found: Option<Outcome>,
    identity: Identity,
    executed: Executed,
    repeated: u64,
}

impl<'a> Campaign<'a> {
    /// Runs an image as it is and notes what it executes.
    ///
    /// # Errors
    /// [`ChipError`] if it cannot be run, or differs already.
    pub fn new(
        target: Target,
        image: &Path,
        vectors: &'a [VectorFile],
        hosts: &'a [HostTrace<'a>],
    ) -> Result<Self, ChipError> {
        let failed = |error| ChipError(format!("{} cannot be read: {error}", image.display()));
        let mut campaign = Self {
            target,
            image: fs::read(image).map_err(failed)?,
            vectors,
            hosts,
            identity: None,
            executed: Executed::new(),
            repeated: u64::MAX,
        };
        // A request that is asked again on a busy machine runs code of its own; the
        // draw must not depend on it.
        for run in 0..3 {
            let trial = campaign.trial(&campaign.image)?;
            if let Some(Outcome::Found { sentence, .. }) = trial.found {
                return Err(ChipError(format!("the image as it is: {sentence}")));
            }
            campaign.identity = Some(trial.identity);
            campaign.repeated = campaign.repeated.min(trial.repeated);
            if run == 0 {
                campaign.executed = trial.executed;
            } else {
                let both = |address: &u32, _: &mut _| trial.executed.contains_key(address);
                campaign.executed.retain(both);
            }
        }
        Ok(campaign)
    }

    /// The instructions of the image that vectors and cases execute.
    pub fn executed(&self) -> &Executed {
        &self.executed
    }

    /// Draws so many of the instructions, no one twice, and a bit of each.
    ///
    /// # Errors
    /// [`ChipError`] if there are fewer.
    pub fn draw(&self, count: usize, seed: u64) -> Result<Vec<Flip>, ChipError> {
        let mut left: Vec<_> = self.executed.iter().collect();
        if count > left.len() {
            return Err(ChipError(format!(
                "{count} flips are too many: {} instructions are executed",
                left.len()
            )));
        }
        let mut generator = Pcg64::new(seed.into(), 0);
        // Off by less than 2^−40: an image has fewer than 2^24 instructions.
        let mut below = |limit: usize| {
            let drawn = u128::from(generator.next_u64()) * limit as u128;
            usize::try_from(drawn >> 64).unwrap_or(0)
        };
        let draw = |_| {
            let (&address, instruction) = left.swap_remove(below(left.len()));
            let bit = below(8 * instruction.bytes.len());
            Flip { address, bit }
        };
        Ok((0..count).map(draw).collect())
    }

    /// Runs the image with one bit inverted, up to the first difference.
    ///
    /// # Errors
    /// [`ChipError`] if QEMU cannot be started, or the flip is of no
    /// instruction.
    pub fn run(&self, flip: Flip) -> Result<Outcome, ChipError> {
        let Flip { address, bit } = flip;
        let mut image = self.image.clone();
        let byte = offset(&image, address).and_then(|at| image.get_mut(at + bit / 8));
        let none = || ChipError(format!("there is no byte at {address:#010x} to be flipped"));
        *byte.ok_or_else(none)? ^= 1 << (bit % 8);
        let mut trial = self.trial(&image)?;
        let survived = |trial: &Trial| Outcome::Survived {
            text: text(&trial.executed, address).to_owned(),
            remarks: self.remarks(address, trial),
        };
        Ok(trial.found.take().unwrap_or_else(|| survived(&trial)))
    }

    /// Runs a file up to the first difference.
    fn trial(&self, image: &[u8]) -> Result<Trial, ChipError> {
        let failed = |error: io::Error| ChipError(format!("a flipped image: {error}"));
        let folder = tempfile::tempdir().map_err(failed)?;
        let (path, log) = (folder.path().join("image"), folder.path().join("log"));
        fs::write(&path, image).map_err(failed)?;
        let image_crc = crc32(&path)?;
        let one_cpu = OneCpu::keep();
        let mut process = start_logged(self.target, &path, &log)?;
        process.one_cpu = Some(one_cpu);
        let mut trial = Trial::default();
        match FifoLine::open(process, GIVE_UP).and_then(|line| Client::greet(Box::new(line))) {
            Err(error) => trial.found = found(Place::Start, Err(error.0)),
            Ok(mut client) => {
                trial.identity = *client.identity();
                let known = self.identity.unwrap_or(trial.identity);
                trial.found = if trial.identity == (Identity { image_crc, ..known }) {
                    self.first_difference(&mut client)
                } else {
                    Some(Outcome::Found {
                        place: Place::Start,
                        kind: Kind::Number,
                        sentence: "another identity".to_owned(),
                    })
                };
                trial.repeated = client.noticed().repeated;
                // Before the line is gone: the image's end is not compared.
                let log = fs::read(&log).map_err(failed)?;
                trial.executed = executed(&String::from_utf8_lossy(&log));
                // Not those of a boot loader, which is QEMU's.
                let is_own = |address: &u32, _: &mut _| offset(image, *address).is_some();
                trial.executed.retain(is_own);
            }
        }
        Ok(trial)
    }

    /// The golden vectors, then the cases.
    fn first_difference(&self, client: &mut Client) -> Option<Outcome> {
        let start = Instant::now();
        let mut in_time = || {
            let late = || io::Error::other(format!("the controller {SILENT} all in {LONGEST:?}"));
            (start.elapsed() < LONGEST).then_some(()).ok_or_else(late)
        };
        let replayed = self.vectors.iter().find_map(|file| {
            let replayed = replay(client, file, &mut in_time);
            found(Place::Vectors, replayed.map_err(|error| error.to_string()))
        });
        replayed.or_else(|| {
            self.hosts.iter().find_map(|host| {
                let hash = &mut TraceHash::default();
                let compared = ChipLaw::new(client, host.case, true)
                    .and_then(|mut chip| host.compare(&mut chip, hash, &mut |_| in_time()));
                found(Place::Cases, compared.map_err(|error| error.to_string()))
            })
        })
    }

    /// Remarks on a flip that has survived.
    fn remarks(&self, address: u32, trial: &Trial) -> Vec<String> {
        let mut remarks = Vec::new();
        if text(&self.executed, address) == text(&trial.executed, address) {
            remarks.push("another encoding of the same".to_owned());
        }
        // A comparison stands a few instructions before its branch.
        let behind = self.executed.range(address..).take(4);
        let mut branches = behind.filter_map(|(at, found)| Some((at, found, target(&found.text)?)));
        if let Some((at, branch, to)) = branches.next() {
            let next = at + u32::try_from(branch.bytes.len()).unwrap_or(0);
            match [to, next].map(|address| self.executed.contains_key(&address)) {
                [true, false] => remarks.push(format!("{} always branches", branch.text)),
                [false, true] => remarks.push(format!("{} never branches", branch.text)),
                _ => {}
            }
        }
        // A repetition runs code of its own; a few of them come of a busy machine.
        if trial.repeated != self.repeated {
            if trial.repeated > self.repeated + 5 {
                remarks.push(format!("{} requests asked again", trial.repeated));
            }
            return remarks;
        }
        let beyond = |of: &Executed, other: &Executed| {
            let beyond = of.keys().filter(|address| !other.contains_key(address));
            beyond.count()
        };
        let more = beyond(&trial.executed, &self.executed);
        let fewer = beyond(&self.executed, &trial.executed);
        if (more, fewer) != (0, 0) {
            remarks.push(format!("{more} instructions more, {fewer} fewer"));
        }
        remarks
    }
}

/// Words of a line on which nothing comes.
const SILENT: &str = "has not answered";

fn found(place: Place, compared: Result<Comparison, String>) -> Option<Outcome> {
    let (kind, sentence) = match compared {
        Ok(Comparison { difference, .. }) => (Kind::Number, difference?.to_string()),
        Err(said) if said.contains("QEMU has ended") => (Kind::End, said),
        Err(said) if said.contains(SILENT) || said.contains("has not opened") => {
            (Kind::Silence, said)
        }
        Err(said) => (Kind::Refusal, said),
    };
    Some(Outcome::Found {
        place,
        kind,
        sentence,
    })
}

/// QEMU's words for an instruction, if it was executed.
fn text(executed: &Executed, address: u32) -> &str {
    let found = executed.get(&address);
    found.map_or("no longer executed", |found| &found.text)
}

/// Instructions of QEMU's log of `-d in_asm`. Each block of them begins with the name
/// of its function; some processors' have a line of their state more:
///
/// ```text
/// ----------------
/// IN: Reset
/// 0x00000066:  4281       cmp      r1, r0
/// 0x00000068:  f000 f90d  bl       #0x286
/// ```
fn executed(log: &str) -> Executed {
    let mut symbol = String::new();
    let instruction = |line: &str| {
        if let Some(name) = line.strip_prefix("IN: ") {
            symbol = format!("{:#}", demangle(name));
        }
        let (address, rest) = line.strip_prefix("0x")?.split_once(':')?;
        let address = u32::from_str_radix(address, 16).ok()?;
        let (mut bytes, mut text) = (Vec::new(), Vec::new());
        for word in rest.split_whitespace() {
            // Half a word or a word at a time, the highest digit first.
            match (word.len(), u32::from_str_radix(word, 16)) {
                (4 | 8, Ok(value)) if text.is_empty() => {
                    bytes.extend(value.to_le_bytes().into_iter().take(word.len() / 2));
                }
                _ => text.push(word),
            }
        }
        let instruction = Instruction {
            symbol: symbol.clone(),
            bytes,
            text: text.join(" "),
        };
        Some((address, instruction))
    };
    log.lines().filter_map(instruction).collect()
}

/// The address to which a conditional branch of Arm or RISC-V goes: "bne #0x5e",
/// "beq a0,a1,24 # 0x80000130".
fn target(text: &str) -> Option<u32> {
    let name = text.split([' ', '.']).next()?;
    let others = ["b", "bl", "blx", "bic", "bics", "bfi", "bfc"];
    let is_branch = name.starts_with('b') && !others.contains(&name);
    let (_, address) = text.rsplit_once("0x")?;
    let address = u32::from_str_radix(address, 16).ok()?;
    (is_branch || name.starts_with("cb")).then_some(address)
}

/// The place in an ELF file of what is loaded for an address.
fn offset(file: &[u8], address: u32) -> Option<usize> {
    let header = FileHeader32::<LittleEndian>::parse(file).ok()?;
    let endian = header.endian().ok()?;
    let segments = header.program_headers(endian, file).ok()?.iter();
    let mut loaded = segments.filter(|segment| segment.p_type(endian) == PT_LOAD);
    loaded.find_map(|segment| {
        let at = address.checked_sub(segment.p_vaddr(endian))?;
        let is_here = at < segment.p_filesz(endian);
        let at = segment.p_offset(endian).checked_add(at)?;
        usize::try_from(at).ok().filter(|_| is_here)
    })
}

#[cfg(test)]
mod tests {
    use super::{Executed, executed, target};

    fn one(executed: &Executed, address: u32) -> (&str, &[u8], &str) {
        let found = &executed[&address];
        (&found.symbol, &found.bytes, &found.text)
    }

    #[test]
    fn instructions_are_read_from_the_log() {
        let log = "----------------\nIN: _ZN4fifo5serve17h3471d1caec7d7f07E\n\
                   0x00000066:  4281       cmp      r1, r0\n\
                   0x00000068:  f000 f90d  bl       #0x286\n\n\
                   ----------------\nIN: \nPriv: 3; Virt: 0\n\
                   0x80000000:  800000b7          lui                     ra,-2147483648\n\
                   0x80000004:  8082              ret                     \n";
        let executed = executed(log);
        assert_eq!(executed.len(), 4);
        let [cmp, bl, lui, ret] =
            [0x66, 0x68, 0x8000_0000, 0x8000_0004].map(|address| one(&executed, address));
        assert_eq!(cmp, ("fifo::serve", &[0x81, 0x42][..], "cmp r1, r0"));
        assert_eq!(
            bl,
            ("fifo::serve", &[0x00, 0xf0, 0x0d, 0xf9][..], "bl #0x286")
        );
        assert_eq!(lui, ("", &[0xb7, 0, 0, 0x80][..], "lui ra,-2147483648"));
        assert_eq!(ret, ("", &[0x82, 0x80][..], "ret"));
    }

    #[test]
    fn conditional_branches_have_a_target() {
        assert_eq!(target("bne.w #0x5e"), Some(0x5e));
        assert_eq!(target("cbz r0, #0x1f4"), Some(0x1f4));
        assert_eq!(target("beq a0,a1,24 # 0x80000130"), Some(0x8000_0130));
        // The contrast: calls, jumps, and numbers that are none.
        for text in [
            "b #0x5e",
            "bl #0x5e",
            "bic r0, r1, #0x10",
            "movs r0, #0x10",
            "bx lr",
        ] {
            assert_eq!(target(text), None, "{text}");
        }
    }
}
