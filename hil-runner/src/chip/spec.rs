//! Names of links on the command line.

use core::fmt;
use core::str::FromStr;

/// A processor that the firmware is built for, and the machine that QEMU
/// shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Target {
    /// Cortex-M4, `mps2-an386`.
    M4,
    /// Cortex-M0, `microbit`.
    M0,
    /// Cortex-M3, `mps2-an385`.
    M3,
    /// RISC-V rv32imac, `virt`.
    Rv32,
}

impl Target {
    /// Every target.
    pub const ALL: [Self; 4] = [Self::M4, Self::M0, Self::M3, Self::Rv32];

    /// Its own name, the compiler's, and that of QEMU's board with it.
    const fn names(self) -> [&'static str; 3] {
        match self {
            Self::M4 => ["m4", "thumbv7em-none-eabihf", "mps2-an386"],
            Self::M0 => ["m0", "thumbv6m-none-eabi", "microbit"],
            Self::M3 => ["m3", "thumbv7m-none-eabi", "mps2-an385"],
            Self::Rv32 => ["rv32", "riscv32imac-unknown-none-elf", "virt"],
        }
    }

    /// Its name on the command line, in summaries and of its image.
    pub const fn name(self) -> &'static str {
        self.names()[0]
    }

    /// The target of that name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.name() == name)
    }

    /// The compiler's name for it.
    pub const fn triple(self) -> &'static str {
        self.names()[1]
    }

    /// The board that has it in QEMU.
    pub(super) const fn machine(self) -> &'static str {
        self.names()[2]
    }
}

/// The way of the bytes to a chip in QEMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Transport {
    /// Two FIFOs that the firmware reads and writes by semihosting.
    Fifo,
    /// The chip's UART, seen from here as a serial port.
    Uart,
}

impl Transport {
    /// The image that serves the controller over it, by its name as a program.
    pub const fn image(self) -> &'static str {
        match self {
            Self::Fifo => "fifo",
            Self::Uart => "uart",
        }
    }
}

/// The image that measures what a sample costs, feature by feature, and says it
/// over FIFOs.
pub const COST_IMAGE: &str = "cost";

/// A controller on a chip, and the way to it.
///
/// ```
/// use hil_runner::chip::spec::{ChipLink, Target, Transport};
///
/// let link: ChipLink = "qemu:m0".parse()?;
/// assert_eq!(link, ChipLink::Qemu { target: Target::M0, transport: Transport::Fifo });
/// assert_eq!("qemu".parse::<ChipLink>()?.to_string(), "qemu:m4");
/// let board: ChipLink = "serial:/dev/ttyACM0@921600".parse()?;
/// assert_eq!(board, ChipLink::Serial { path: "/dev/ttyACM0".into(), baud: 921_600 });
/// assert!("qemu:m7".parse::<ChipLink>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ChipLink {
    /// An image in QEMU.
    Qemu {
        /// The processor.
        target: Target,
        /// The way to it.
        transport: Transport,
    },
    /// A board on a serial port.
    Serial {
        /// The port, such as `/dev/ttyACM0`.
        path: String,
        /// Bits per second.
        baud: u32,
    },
}

/// Bits per second where none are given.
pub const DEFAULT_BAUD: u32 = 115_200;

impl fmt::Display for ChipLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Qemu { target, transport } => {
                let kind = match transport {
                    Transport::Fifo => "qemu",
                    Transport::Uart => "qemu-uart",
                };
                write!(f, "{kind}:{}", target.name())
            }
            Self::Serial { path, baud } => write!(f, "serial:{path}@{baud}"),
        }
    }
}

impl FromStr for ChipLink {
    type Err = String;

    /// Reads a link; a text that names none has a sentence.
    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, rest) = match text.split_once(':') {
            Some((kind, rest)) => (kind, Some(rest)),
            None => (text, None),
        };
        let qemu = |transport| {
            let target = rest.map_or(Some(Target::M4), Target::find)?;
            Some(Self::Qemu { target, transport })
        };
        let link = match (kind, rest) {
            ("qemu", _) => qemu(Transport::Fifo),
            ("qemu-uart", _) => qemu(Transport::Uart),
            ("serial", Some(rest)) => Self::serial(rest),
            _ => None,
        };
        link.ok_or_else(|| {
            format!(
                "{text} is no link to a chip; it must be qemu[:m4|m0|m3|rv32], \
                 qemu-uart[:m4|m0|m3|rv32] or serial:PORT[@BAUD]"
            )
        })
    }
}

impl ChipLink {
    /// Reads `PORT` or `PORT@BAUD`.
    fn serial(text: &str) -> Option<Self> {
        let (path, baud) = match text.rsplit_once('@') {
            Some((path, baud)) => (path, baud.parse().ok()?),
            None => (text, DEFAULT_BAUD),
        };
        let path = path.to_owned();
        (!path.is_empty() && baud > 0).then_some(Self::Serial { path, baud })
    }
}
