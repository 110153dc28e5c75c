//! The base of a study: numbers of its keys, its facts in words, and
//! what the study puts in their place.

use plant::Joint;

use crate::study::plan::Study;
use hil_core::case::{Case, ComputationDelay, Law};
use hil_core::figures::{CHIP_FIGURES, Figure, HOST_STEP_P99};
use hil_core::number::{self, seconds};
use hil_core::rest::Window;
use hil_core::run::rungs_leave_out;
use hil_core::runfile::{KeyPath, values_of_template};

/// The base and what becomes of it, a sentence each.
pub fn base_sentences(study: &Study) -> Vec<String> {
    let facts = facts(&study.base, study.reference.base());
    std::iter::once(facts).chain(replaced(study)).collect()
}

impl Study {
    /// Warnings to the reader of its results, a sentence each:
    /// keys that do nothing, limits that cannot be judged, runs that are too
    /// short.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::from_iter(self.keys_without_effect());
        let case = self.template().base();
        warnings.extend(values_of_template(case));
        let limited = |figure: &&Figure| {
            let limits = case.budget.iter().flatten();
            limits.into_iter().any(|limit| limit.figure == figure.key)
        };
        if limited(&&HOST_STEP_P99) {
            warnings.push(format!(
                "budget.{} is not judged in a study: it is the clock of this machine",
                HOST_STEP_P99.key
            ));
        }
        let of_chip = CHIP_FIGURES.iter().filter(limited);
        let of_chip = of_chip.map(|figure| format!("budget.{}", figure.key));
        let of_chip: Vec<String> = of_chip.collect();
        if !of_chip.is_empty() {
            warnings.push(format!(
                "{} cannot pass: only a chip, over --link, has such figures",
                of_chip.join(", ")
            ));
        }
        let (end_s, motion_end_s) = (seconds(case.run.duration_ns), case.motion.end_s());
        if end_s < motion_end_s {
            warnings.push(format!(
                "the runs end at {end_s} s, before the motion does ({motion_end_s} s): their figures are those of \
                 a part of the move"
            ));
        } else if Window::of(case).is_none() {
            warnings.push(format!(
                "the runs end at {end_s} s, before there are 8 samples of rest to look at: their figures of rest \
                 are empty"
            ));
        }
        warnings
    }

    /// The sentence about the keys beyond the paper's law that the base or an
    /// axis sets and some of the rungs leave out.
    fn keys_without_effect(&self) -> Option<String> {
        let leaving = self.rungs.iter().filter(|(law, _)| *law != Law::Firmware);
        let laws: Vec<Law> = leaving.clone().map(|(law, _)| *law).collect();
        let (_, template) = leaving.clone().next()?;
        let mut keys = template.base().keys_without_effect.clone();
        let of_axes = self.axes.iter().map(|axis| axis.key);
        let of_axes = of_axes.filter(|key| key.key.is_of_firmware());
        for path in of_axes.map(|key| key.path()) {
            if !keys.contains(&path) {
                keys.push(path);
            }
        }
        rungs_leave_out(&laws, &keys)
    }
}

/// The facts of a base that a reader of its results wants to see beside them,
/// in one sentence.
fn facts(name: &str, case: &Case) -> String {
    let shown = number::table;
    let transmission = &case.axis.transmission;
    let gains = &case.controller.gains;
    let period = case.controller.sample_time_ns.map(|ns| {
        let delay = match case.controller.computation_delay {
            ComputationDelay::Fixed(0) => String::new(),
            ComputationDelay::Fixed(ns) => {
                format!(" and {} ms delay", shown(1e3 * seconds(ns)))
            }
            ComputationDelay::Measured => " and the chip's own delay".to_owned(),
        };
        format!(", Δt = {} ms{delay}", shown(1e3 * seconds(ns)))
    });
    let joint = match transmission.joint {
        Joint::Rigid => "a rigid joint".to_owned(),
        Joint::Elastic(joint) => format!(
            "half gap b = {}°",
            shown(joint.backlash_half_rad.to_degrees())
        ),
    };
    format!(
        "Base {name}: rung {}, {} mm in {} s{}, {} bits over {} V, {} counts/rad, {joint}, \
         K_p = {}, K_i = {} 1/s, K_d = {} s.",
        case.controller.law.name(),
        shown(1e3 * case.motion.largest_displacement_m()),
        shown(case.motion.end_s()),
        period.unwrap_or_default(),
        case.dac.bits,
        shown(case.dac.step_v * f64::from(case.dac.bits).exp2()),
        shown(case.encoder.counts_per_rad),
        shown(gains.kp),
        shown(gains.ki_per_s),
        shown(gains.kd_s),
    )
}

/// The values that stand in the place of the base's own, in one sentence; `None`
/// where nothing.
fn replaced(study: &Study) -> Option<String> {
    let mut words: Vec<String> = Vec::new();
    for set in &study.sets {
        let (path, value) = set.split_once('=').unwrap_or((set, ""));
        let Ok(key) = KeyPath::find(path.trim()) else {
            continue;
        };
        let now = study.template().own_number(&key);
        let changed = format!("{} = {}", key.path(), value.trim());
        match (study.reference.own_number(&key), now) {
            (Some(own), Some(now)) if (own - now).abs() <= 1e-9 * own.abs() => {}
            (Some(own), Some(_)) => {
                words.push(format!("{changed} instead of {}", number::table(own)));
            }
            // No number, and nothing to compare it with.
            (_, None) if study.reference.sets().contains(set) => {}
            _ => words.push(changed),
        }
    }
    let own_law = study.reference.base().controller.law;
    if !study.rungs.iter().any(|(law, _)| *law == own_law) {
        let (now, own) = (study.rung_names(), own_law.name());
        words.push(format!("rung {now} instead of {own}"));
    }
    (!words.is_empty()).then(|| format!("The study replaces of the base: {}.", words.join("; ")))
}
