//! Figures of a target, and what they were when someone last looked at them.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::chip::line::ChipError;
use crate::chip::spec::Target;

/// Something that was measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// Its name, unique among those of a target.
    pub name: String,
    /// Its amount.
    pub amount: Amount,
}

/// A measured amount.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Amount {
    /// Instructions of a sample.
    Instructions(Instructions),
    /// Bytes of memory.
    Bytes(u32),
}

/// Instructions of the samples of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Instructions {
    /// Most.
    pub max: u32,
    /// 99 % of the samples take no more. `None` where they were not told one by one.
    pub p99: Option<u32>,
    /// Lower median.
    pub median: u32,
    /// Of the very first sample, which is not among the others: it begins
    /// filter and integral. `None` where it was not taken apart.
    pub first: Option<u32>,
}

/// Instructions may differ by this share \[%\] or by this many, whichever is
/// more.
const INSTRUCTIONS: Tolerance = Tolerance {
    percent: 3,
    at_least: 2,
};

/// Bytes may differ by this share \[%\].
const BYTES: Tolerance = Tolerance {
    percent: 2,
    at_least: 0,
};

/// The goldens of a target.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Goldens {
    instructions: BTreeMap<String, Instructions>,
    bytes: BTreeMap<String, u32>,
}

impl Goldens {
    /// Reads the file of a target; one that is not there has no goldens.
    ///
    /// # Errors
    /// [`ChipError`] if it cannot be read, or is no such file.
    pub fn read(path: &Path) -> Result<Self, ChipError> {
        let failed = |because: String| {
            let (path, because) = (path.display(), because.trim_end());
            ChipError(format!("{path} is no file of goldens: {because}"))
        };
        match std::fs::read_to_string(path) {
            Ok(text) => toml::from_str(&text).map_err(|error| failed(error.to_string())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(failed(error.to_string())),
        }
    }

    /// The golden of a figure.
    pub fn get(&self, name: &str) -> Option<Amount> {
        let instructions = self.instructions.get(name).copied();
        let instructions = instructions.map(Amount::Instructions);
        instructions.or_else(|| self.bytes.get(name).copied().map(Amount::Bytes))
    }

    /// Holds figures against their goldens: one judgement a figure, then one a
    /// golden that nothing was measured for.
    pub fn judge(&self, figures: &[Figure]) -> Vec<Judgement> {
        let judge = |name: &String, measured: Option<Amount>| Judgement {
            figure: name.clone(),
            measured,
            golden: self.get(name),
        };
        let there = figures.iter();
        let there = there.map(|figure| judge(&figure.name, Some(figure.amount)));
        let names = self.instructions.keys().chain(self.bytes.keys());
        let gone = names.filter(|name| figures.iter().all(|figure| figure.name != **name));
        there.chain(gone.map(|name| judge(name, None))).collect()
    }
}

/// A figure held against its golden.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Judgement {
    /// Name of the figure.
    pub figure: String,
    /// Its amount; none for a figure that is gone.
    pub measured: Option<Amount>,
    /// The golden; none for a figure that is new.
    pub golden: Option<Amount>,
}

impl Judgement {
    /// The part that is farthest off; none where one of the two is missing, or
    /// they have other parts.
    pub fn difference(&self) -> Option<Difference> {
        let (measured, tolerance) = self.measured?.parts();
        let (golden, _) = self.golden?.parts();
        let name = |(part, _): &(&'static str, u32)| *part;
        if !measured.iter().map(name).eq(golden.iter().map(name)) {
            return None;
        }
        let parts = measured.into_iter().zip(golden);
        let differences = parts.map(|((part, measured), (_, golden))| Difference {
            part,
            measured,
            golden,
            within: tolerance.allows(measured, golden),
        });
        let far = |part: &Difference| (!part.within, part.signed().unsigned_abs());
        // Of equals the first.
        differences.rev().max_by_key(far)
    }

    /// True if it is within the tolerance.
    pub fn pass(&self) -> bool {
        matches!(self.difference(), Some(difference) if difference.within)
    }
}

/// Distance of a part of a figure from its golden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Difference {
    /// "max", "p99", "median", "first" or "bytes".
    pub part: &'static str,
    /// Measured.
    pub measured: u32,
    /// Golden.
    pub golden: u32,
    /// True if it is within the tolerance.
    pub within: bool,
}

impl Difference {
    /// Measured less golden.
    pub fn signed(self) -> i64 {
        i64::from(self.measured) - i64::from(self.golden)
    }
}

impl Amount {
    /// Its parts by name, and how far they may be off.
    fn parts(self) -> (Vec<(&'static str, u32)>, Tolerance) {
        match self {
            Self::Bytes(bytes) => (vec![("bytes", bytes)], BYTES),
            Self::Instructions(count) => {
                let parts = [
                    ("max", Some(count.max)),
                    ("p99", count.p99),
                    ("median", Some(count.median)),
                    ("first", count.first),
                ];
                let there = parts.into_iter();
                let there = there.filter_map(|(part, count)| Some((part, count?)));
                (there.collect(), INSTRUCTIONS)
            }
        }
    }
}

/// A difference that is allowed.
#[derive(Debug, Clone, Copy)]
struct Tolerance {
    percent: u64,
    at_least: u64,
}

impl Tolerance {
    fn allows(self, measured: u32, golden: u32) -> bool {
        let difference = u64::from(measured.abs_diff(golden));
        difference <= self.at_least || 100 * difference <= self.percent * u64::from(golden)
    }
}

/// The file of a target with these figures.
pub fn text(target: Target, figures: &[Figure]) -> String {
    let mut instructions = String::new();
    let mut bytes = String::new();
    for Figure { name, amount } in figures {
        // A string takes whatever is written to it.
        let _ = match amount {
            Amount::Instructions(_) => {
                let parts = amount.parts().0.into_iter();
                let said: Vec<String> = parts.map(|(part, n)| format!("{part} = {n}")).collect();
                writeln!(instructions, "{name:?} = {{ {} }}", said.join(", "))
            }
            Amount::Bytes(count) => writeln!(bytes, "{name:?} = {count}"),
        };
    }
    format!(
        "# What the controller costs on {name} ({triple}), from `hil-runner budget {name} --bless`.\n\
         #\n\
         # Compilers differ: instructions may be {percent} % or {least} off, bytes {bytes_percent} %. A better \
         figure beyond\n\
         # that fails too, until it is blessed: otherwise what was gained could be lost again\n\
         # unseen. Only `--bless` writes this file.\n\n\
         [instructions]\n{instructions}\n[bytes]\n{bytes}",
        name = target.name(),
        triple = target.triple(),
        percent = INSTRUCTIONS.percent,
        least = INSTRUCTIONS.at_least,
        bytes_percent = BYTES.percent,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(name: &str, max: u32, median: u32, first: Option<u32>) -> Figure {
        Figure {
            name: name.to_owned(),
            amount: Amount::Instructions(Instructions {
                max,
                p99: first.map(|_| max),
                median,
                first,
            }),
        }
    }

    fn bytes(count: u32) -> Figure {
        Figure {
            name: "image".to_owned(),
            amount: Amount::Bytes(count),
        }
    }

    fn goldens(figures: &[Figure]) -> Goldens {
        toml::from_str(&text(Target::M4, figures)).unwrap()
    }

    #[test]
    fn a_file_says_what_was_written() {
        let figures = [
            figure("law, clamp", 71, 63, Some(168)),
            figure("run, moving", 606, 500, None),
            bytes(19_432),
        ];
        let read = goldens(&figures);
        for figure in &figures {
            assert_eq!(read.get(&figure.name), Some(figure.amount));
        }
        assert!(
            read.judge(&figures)
                .iter()
                .all(|judgement| judgement.pass())
        );
        assert!(toml::from_str::<Goldens>("[instruction]\n").is_err());
    }

    #[test]
    fn three_percent_pass_and_four_fail_whether_worse_or_better() {
        let golden = goldens(&[figure("law", 100, 100, Some(100))]);
        let pass = |max, median, first| {
            let [judgement] = &golden.judge(&[figure("law", max, median, Some(first))])[..] else {
                return false;
            };
            judgement.pass()
        };
        assert!(pass(103, 97, 100));
        for (max, median, first) in [
            (104, 100, 100),
            (96, 100, 100),
            (100, 104, 100),
            (100, 100, 96),
        ] {
            assert!(!pass(max, median, first), "{max} {median} {first}");
        }
    }

    #[test]
    fn small_figures_may_be_two_instructions_off() {
        let golden = goldens(&[figure("law", 40, 40, None)]);
        let pass = |max| golden.judge(&[figure("law", max, 40, None)])[0].pass();
        assert_eq!(
            [pass(38), pass(42), pass(43), pass(37)],
            [true, true, false, false]
        );
    }

    #[test]
    fn bytes_may_be_two_percent_off() {
        let golden = goldens(&[bytes(1_000)]);
        let pass = |count| golden.judge(&[bytes(count)])[0].pass();
        assert_eq!(
            [pass(1_020), pass(980), pass(1_021), pass(979)],
            [true, true, false, false]
        );
    }

    #[test]
    fn the_part_that_fails_is_shown() {
        let golden = goldens(&[figure("law", 1_000, 10, None)]);
        let judged = golden.judge(&[figure("law", 1_020, 14, None)]);
        let difference = judged[0].difference().unwrap();
        assert_eq!(
            (difference.part, difference.signed(), difference.within),
            ("median", 4, false)
        );
    }

    #[test]
    fn what_is_new_or_gone_fails() {
        let golden = goldens(&[figure("old", 10, 10, None)]);
        let judged = golden.judge(&[figure("new", 10, 10, None)]);
        let names: Vec<(&str, bool, bool)> = judged
            .iter()
            .map(|j| (j.figure.as_str(), j.golden.is_some(), j.pass()))
            .collect();
        assert_eq!(names, [("new", false, false), ("old", true, false)]);
        // A figure that has lost its first sample is another one.
        let golden = goldens(&[figure("law", 10, 10, Some(10))]);
        assert!(!golden.judge(&[figure("law", 10, 10, None)])[0].pass());
    }
}
