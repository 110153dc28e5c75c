//! What `[tune]` of a run file asks for.

use super::KeyPath;
use crate::distribution::Distribution;

/// A tuned key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TunedKey {
    /// The key.
    pub key: KeyPath,
    /// Place in its list, from 1.
    pub element: Option<usize>,
    /// Its range.
    pub range: Option<[f64; 2]>,
}

impl TunedKey {
    /// Its path.
    pub fn path(&self) -> String {
        match self.element {
            Some(element) => format!("{}.{element}", self.key.path()),
            None => self.key.path(),
        }
    }
}

/// Objective.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Objective {
    /// Key of the figure.
    pub figure: &'static str,
    /// Its weight.
    pub weight: f64,
}

/// Side of a bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// At least.
    AtLeast,
    /// At most.
    AtMost,
    /// At most so many times what the file's own setting gives on the same axis.
    OfBefore,
}

/// A requirement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Requirement {
    /// Key of the figure.
    pub figure: &'static str,
    /// Side.
    pub bound: Bound,
    /// Limit.
    pub limit: f64,
}

impl Requirement {
    /// Part of the limit that is left over, of 1 where that is 0; below 0 where it is missed.
    pub fn left(&self, value: f64) -> f64 {
        let left = match self.bound {
            Bound::AtLeast => value - self.limit,
            Bound::AtMost | Bound::OfBefore => self.limit - value.abs(),
        };
        let size = if self.limit == 0.0 {
            1.0
        } else {
            self.limit.abs()
        };
        left / size
    }
}

/// A key over which a setting has to serve.
#[derive(Debug, Clone, PartialEq)]
pub struct Over {
    /// The key.
    pub key: KeyPath,
    /// Its values.
    pub spread: OverSpread,
}

/// Values of such a key.
#[derive(Debug, Clone, PartialEq)]
pub enum OverSpread {
    /// Factors of the file's own.
    Factors(Vec<f64>),
    /// Values.
    Values(Vec<f64>),
    /// Words.
    Words(Vec<String>),
    /// Drawn.
    Drawn(Drawn),
}

/// A distribution.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Its values.
    pub distribution: Distribution,
    /// They are factors of the file's own.
    pub is_factor: bool,
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct TuneSettings {
    /// Keys.
    pub keys: Vec<TunedKey>,
    /// Aims.
    pub minimise: Vec<Objective>,
    /// Requirements.
    pub require: Option<Vec<Requirement>>,
    /// Corners.
    pub over: Vec<Over>,
    /// Drawn axes.
    pub draws: u64,
    /// Seed.
    pub seed: u64,
    /// Runs.
    pub runs: Option<u64>,
}
