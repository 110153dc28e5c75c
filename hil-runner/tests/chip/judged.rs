//! The published trace hash is that of the law in exact integers, which shares
//! nothing with the firmware but the shape of its settings: a mistake that host
//! and chip have in common would give both another hash.

#[path = "../../../firmware/tests/exact/model.rs"]
#[allow(dead_code, reason = "the law's own tests measure more of it")]
mod model;

use firmware::law::{Begin, LawInput, LawWords};
use firmware::output::Quantiser;
use hil_core::case::Case;
use hil_core::controllers::{Setpoint, papers_law};
use hil_core::message::{Command, Link, LinkError, Measurement};
use hil_runner::chip::certify::{Comparison, HostTrace, TraceHash};

use crate::same_codes::case;
use model::Model;

const PAGE: &str = include_str!("../../../docs/CHIP.md");

/// The law in exact integers behind the setpoints of a case.
struct Judge {
    setpoint: Setpoint,
    model: Model,
    begin: Option<Begin>,
}

impl Judge {
    fn of(case: &Case, change: impl FnOnce(&mut LawWords)) -> Self {
        let period_ns = case.controller.sample_time_ns.unwrap();
        let mut words = *papers_law(case, period_ns).unwrap().law.words();
        change(&mut words);
        Self {
            setpoint: Setpoint::new(case, period_ns),
            model: Model::new(words, case.dac.bits, None, Quantiser::Nearest),
            begin: Some(Begin::AtRest),
        }
    }
}

impl Link for Judge {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        // e = r − c                                         eq. 20, 22 [counts]
        let error = self.setpoint.count(tick) - measurement.position_counts.whole();
        let error = i32::try_from(error).unwrap();
        let input = LawInput {
            error,
            ..LawInput::default()
        };
        let sample = self.model.step(&input, self.begin.take());
        Ok(Command {
            out_of_range: sample.told,
            ..Command::whole(tick, error, i32::try_from(sample.code).unwrap())
        })
    }
}

/// The judge in the loop of a case, held against the host.
fn judged(case: &Case, judge: &mut Judge, hash: &mut TraceHash) -> Comparison {
    let host = HostTrace::record(case, &mut |_| Ok(())).unwrap();
    host.compare(judge, hash, &mut |_| Ok(())).unwrap()
}

#[test]
fn the_published_hash_is_that_of_the_law_in_exact_integers() {
    let mut hash = TraceHash::default();
    for name in ["paper-1", "paper-2", "paper-3", "paper-4"] {
        let case = case(name, &[]);
        let comparison = judged(&case, &mut Judge::of(&case, |_| ()), &mut hash);
        assert_eq!((comparison.compared, comparison.difference), (1_501, None));
    }
    let published = PAGE.matches(&hash.to_string()).count();
    assert!(
        published >= 5,
        "{hash} stands {published} times in docs/CHIP.md"
    );
}

/// The contrast: a gain that is 2^−10 larger is another law.
#[test]
fn another_gain_is_seen() {
    let case = case("paper-2", &[]);
    let mut judge = Judge::of(&case, |words| words.kp.mantissa += words.kp.mantissa >> 10);
    let comparison = judged(&case, &mut judge, &mut TraceHash::default());
    assert!(comparison.difference.is_some(), "{comparison:?}");
}
