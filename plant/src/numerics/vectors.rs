//! The vector instructions that runs are made with: the widest that the processor has,
//! unless fewer are asked for. They decide about speed alone.

use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::Level;

/// Sets of vector instructions of x86-64, the narrowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Vectors {
    /// SSE2, which every processor has.
    Sse2,
    /// AVX2.
    Avx2,
    /// AVX-512, of the processors that have all of it that is asked for.
    Avx512,
}

/// Place of the widest set that may be used.
static MOST: AtomicUsize = AtomicUsize::new(Vectors::Avx512 as usize);

impl Vectors {
    /// Runs that are begun from now on use no wider ones. What the processor lacks is not
    /// used either, and other processors know none of these.
    pub fn limit(self) {
        MOST.store(self as usize, Ordering::Relaxed);
    }

    /// Name of the instructions that runs use now.
    pub fn in_use() -> &'static str {
        match widest() {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512(_) => "AVX-512",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(_) => "AVX2",
            #[cfg(target_arch = "x86_64")]
            level if level.as_sse2().is_some() => "SSE2",
            #[cfg(target_arch = "aarch64")]
            Level::Neon(_) => "NEON",
            level if level.is_fallback() => "none",
            _ => "the least of this architecture",
        }
    }
}

impl FromStr for Vectors {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "sse2" => Ok(Self::Sse2),
            "avx2" => Ok(Self::Avx2),
            "avx512" => Ok(Self::Avx512),
            _ => Err(format!("{name:?}: sse2, avx2 or avx512")),
        }
    }
}

/// The widest instructions that may be used.
pub fn widest() -> Level {
    let level = Level::new();
    #[cfg(target_arch = "x86_64")]
    let lowered = match MOST.load(Ordering::Relaxed) {
        most if most == Vectors::Sse2 as usize => level.as_sse2().map(Level::Sse2),
        most if most == Vectors::Avx2 as usize => level.as_avx2().map(Level::Avx2),
        _ => None,
    };
    #[cfg(not(target_arch = "x86_64"))]
    let lowered = None;
    lowered.unwrap_or(level)
}

/// Does something of a single run with the instructions for four numbers, where a level has
/// them; `simd` names them. The sums of a step are quicker so than with two, and `floor` is
/// one of them. Wider ones have not made it quicker.
macro_rules! in_fours {
    ($level:expr, $simd:ident => $work:expr) => {{
        #[cfg(target_arch = "x86_64")]
        let result = if let Some($simd) = $level.as_avx2() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else {
            fearless_simd::dispatch!($level, $simd => $work)
        };
        #[cfg(not(target_arch = "x86_64"))]
        let result = fearless_simd::dispatch!($level, $simd => $work);
        result
    }};
}
pub(crate) use in_fours;

/// The same for work that does not name its instructions.
#[inline(always)]
pub fn with_four<R>(level: Level, work: impl FnOnce() -> R) -> R {
    in_fours!(level, _simd => work())
}
