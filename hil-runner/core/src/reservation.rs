//! Reasons for which a run that keeps its limits does not simply pass.

use plant::Contact;

use crate::case::{Case, Law, MASS_CHANGE};
use crate::figures::SUMMARY_FIGURES;
use crate::lockstep::Outcome;
use crate::number::{self, seconds};
use crate::rest::{FEWEST, Window};
use crate::summary::Summary;
use crate::theory::{JointState, margin};

/// A reason that a reader has to know before a run's verdicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reservation {
    /// The run ends before the motion does.
    EndsInMotion,
    /// It ends before there is a window of rest.
    EndsBeforeRest,
    /// The carriage is outside the settling band at the end.
    NotSettled,
    /// Nothing holds the carriage at the end.
    Floats,
    /// The linear loop is unstable.
    UnstableLoop,
    /// A second run gives other figures.
    FiguresDoNotHold,
}

impl Reservation {
    /// The same in a few words.
    pub fn words(self) -> &'static str {
        match self {
            Self::EndsInMotion => "the run ends before its motion",
            Self::EndsBeforeRest => "the run ends before its rest",
            Self::NotSettled => "not settled",
            Self::Floats => "floats in its gap",
            Self::UnstableLoop => "the loop is unstable",
            Self::FiguresDoNotHold => "figures do not hold",
        }
    }
}

/// The reservations about a run, a sentence with each.
pub fn of(case: &Case, outcome: &Outcome) -> Vec<(Reservation, String)> {
    let summary = &outcome.summary;
    let mut found = Vec::new();
    let (end_s, motion_end_s) = (seconds(case.run.duration_ns), case.motion.end_s());
    if end_s < motion_end_s {
        let sentence = format!(
            "the run ends at {end_s} s, before the motion does ({motion_end_s} s): final, settling \
             and peak figures are those of a part of the move{}",
            null_figures(summary, &["settling_time_s", OF_REST[0], OF_REST[1]])
        );
        found.push((Reservation::EndsInMotion, sentence));
    } else {
        if Window::of(case).is_none() {
            let sentence = format!(
                "the run ends at {end_s} s, before its window of rest has {FEWEST} samples{}",
                null_figures(summary, &OF_REST)
            );
            found.push((Reservation::EndsBeforeRest, sentence));
        }
        if summary.settling_time_s.is_none() {
            let sentence = format!(
                "not settled: the carriage ends {} µm from its command, outside the band of ±{} µm \
                 (run.settling_band_um); no default limit looks at that",
                summary.shown("final_error_um"),
                number::table(case.run.settling_band_um)
            );
            found.push((Reservation::NotSettled, sentence));
        }
        if floats(case, outcome.final_contact) {
            let [max, rms] =
                ["rest_error_max_um", "rest_error_rms_um"].map(|key| summary.shown(key));
            let instead = match summary.rest_error_max_um {
                Some(_) => {
                    format!("quote rest_error_max_um ({max} µm) and rest_error_rms_um ({rms} µm)")
                }
                None => "a longer run has rest_error_max_um and rest_error_rms_um".to_owned(),
            };
            let sentence = format!(
                "the carriage floats in its gap and nothing holds it: final_error_um is where it \
                 happens to be when the run ends; {instead}"
            );
            found.push((Reservation::Floats, sentence));
        }
    }
    found.extend(unstable_loop(case).map(|sentence| (Reservation::UnstableLoop, sentence)));
    let unsure = digits_sentence(summary);
    found.extend(unsure.map(|sentence| (Reservation::FiguresDoNotHold, sentence)));
    found
}

/// All limits kept, but: what is to be said of runs, each with its name; of a
/// reservation that some of them have, which. `None` without any.
pub fn kept_but(runs: &[(&str, &[Reservation])]) -> Option<String> {
    let mut all: Vec<Reservation> = Vec::new();
    for reservation in runs.iter().flat_map(|(_, of_run)| *of_run) {
        if !all.contains(reservation) {
            all.push(*reservation);
        }
    }
    let words = all.iter().map(|reservation| {
        let having = runs
            .iter()
            .filter(|(_, of_run)| of_run.contains(reservation));
        let names: Vec<&str> = having.map(|(name, _)| *name).collect();
        if names.len() == runs.len() {
            reservation.words().to_owned()
        } else {
            format!("{} ({})", reservation.words(), names.join(", "))
        }
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| format!("All limits kept, but: {}", words.join(", ")))
}

/// Beginnings of the keys of figures that need a window of rest.
const OF_REST: [&str; 2] = ["rest_", "limit_cycle_"];

/// The figures whose keys begin so that a run does not have.
fn null_figures(summary: &Summary, begins: &[&str]) -> String {
    let null = SUMMARY_FIGURES.iter().filter(|figure| {
        let named = begins.iter().any(|begin| figure.key.starts_with(begin));
        named && summary.figure(figure.key).is_none()
    });
    let keys: Vec<&str> = null.map(|figure| figure.key).collect();
    match keys.as_slice() {
        [] => String::new(),
        keys => format!("; null: {}", keys.join(", ")),
    }
}

/// True if the carriage is in the gap without anything that keeps it there.
fn floats(case: &Case, contact: Contact) -> bool {
    let resistance = &case.axis.carriage.resistance;
    let held = resistance.opposes_motion && resistance.constant_n > 0.0;
    case.has_gap() && contact == Contact::Open && !held
}

/// The states of the joint that make the sampled loop unstable.
fn unstable_loop(case: &Case) -> Option<String> {
    if case.controller.law == Law::Continuous {
        return None;
    }
    let states = [
        (JointState::Contact, "in contact"),
        (JointState::Gap, "in the gap"),
    ];
    let unstable = states.into_iter().filter_map(|(joint, words)| {
        if joint == JointState::Gap && !case.has_gap() {
            return None;
        }
        let margin = margin(case, joint)?.signed();
        (margin < 0.0).then(|| format!("{words} (modulus margin {})", number::table(margin)))
    });
    let unstable: Vec<String> = unstable.collect();
    (!unstable.is_empty()).then(|| {
        format!(
            "the sampled loop is unstable {}: small causes grow, and figures do not \
             hold beyond the digits that are shown",
            unstable.join(" and ")
        )
    })
}

/// The figures by the number of digits that hold.
fn digits_sentence(summary: &Summary) -> Option<String> {
    let digits = &summary.digits_that_hold;
    let most = digits.values().max()?;
    let groups = (0..=*most).filter_map(|n| {
        let of_n = digits.iter().filter(|(_, digits)| **digits == n);
        let keys: Vec<&str> = of_n.map(|(key, _)| *key).collect();
        let words = match n {
            0 => format!("no digit (shown as {})", number::UNKNOWN),
            1 => "1 digit".to_owned(),
            n => format!("{n} digits"),
        };
        (!keys.is_empty()).then(|| format!("{words} of {}", keys.join(", ")))
    });
    Some(format!(
        "figures do not hold: the run is chaotic, ill-conditioned or unstable, and a carriage heavier \
         by {MASS_CHANGE:e} of its mass gives others. What holds and is shown: {}",
        groups.collect::<Vec<_>>().join("; ")
    ))
}
