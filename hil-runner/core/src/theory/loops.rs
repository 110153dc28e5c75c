//! Figures of a case's linear loop, joint state by joint state: margins, crossover,
//! bandwidth and stiffness, and the reason where there is none.
//!
//! The loop is the exact sampled one of the case: hold, delay, the derivative's filter, the
//! encoders that close it, the kind of drive. The options act on rung `firmware` alone; the
//! gains are those of the run file before they are rounded. Nonlinear parts
//! are left out: limits of converter, amplifier and current, with them anti-windup, the
//! steps of encoder and converter, and what [`left_out`] names. Feed-forward, compensation
//! in the reference and supervision stand outside of the loop, and the derivative of the
//! measurement is in it what that of the error is.
//!
//! Where gains change during the run, a joint state's figures are, all of them, those of the
//! gains with the smaller signed modulus margin.

use std::collections::VecDeque;

use core::f64::consts::{PI, TAU};

use serde::Serialize;

use super::characteristic::LoopGains;
use super::curve::Margin;
use super::delay::DelayedLoop;
use super::family::{FamilyKey, LoopFamily, Room};
use super::linear_axis::{JointState, has_dual_feedback};
use super::stiffness::Compliance;
use crate::case::{Case, Law};
use crate::figures;
use crate::options::RestIntegrator;

/// Families that are kept: those of neighbouring points of a grid, or of the corners of an
/// axis.
const KEPT: usize = 32;

/// Both joint states, in the order of a pair of figures.
pub const JOINT_STATES: [JointState; 2] = [JointState::Contact, JointState::Gap];

/// Figures of a case's linear sampled loop; `None` where there is no such loop
/// ([`no_loop`]), and for a figure that this loop does not have.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LoopFigures {
    /// Modulus margin 1/M_s in contact, negative where the loop is unstable.
    pub modulus_margin_contact: Option<f64>,
    /// The same in the gap.
    pub modulus_margin_gap: Option<f64>,
    /// Gain margin in contact \[dB\]; none of an unstable loop, or where no gain makes it so.
    pub gain_margin_contact_db: Option<f64>,
    /// The same in the gap.
    pub gain_margin_gap_db: Option<f64>,
    /// Phase margin in contact \[°\], a lag if above 0; none of an unstable loop.
    pub phase_margin_contact_deg: Option<f64>,
    /// The same in the gap.
    pub phase_margin_gap_deg: Option<f64>,
    /// Lowest frequency at which |L| falls to 1 in contact \[Hz\], of an unstable loop too.
    pub crossover_contact_hz: Option<f64>,
    /// The same in the gap.
    pub crossover_gap_hz: Option<f64>,
    /// Lowest frequency at which |T| falls below 1/√2 in contact \[Hz\], of `T = L/(1 + L)`
    /// with L broken at the code: the motor's position against its setpoint, and with two
    /// encoders, or the derivative of the measurement, the same without what those leave
    /// out of the setpoint's way. None of an unstable loop.
    pub bandwidth_contact_hz: Option<f64>,
    /// The same in the gap.
    pub bandwidth_gap_hz: Option<f64>,
    /// Least dynamic stiffness against a force on the carriage, in contact, up to half of
    /// the sample rate \[N/µm\]; none of an unstable loop.
    pub least_stiffness_n_per_um: Option<f64>,
}

impl LoopFigures {
    /// A figure by its key.
    pub fn figure(&self, key: &str) -> Option<f64> {
        match key {
            "modulus_margin_contact" => self.modulus_margin_contact,
            "modulus_margin_gap" => self.modulus_margin_gap,
            "gain_margin_contact_db" => self.gain_margin_contact_db,
            "gain_margin_gap_db" => self.gain_margin_gap_db,
            "phase_margin_contact_deg" => self.phase_margin_contact_deg,
            "phase_margin_gap_deg" => self.phase_margin_gap_deg,
            "crossover_contact_hz" => self.crossover_contact_hz,
            "crossover_gap_hz" => self.crossover_gap_hz,
            "bandwidth_contact_hz" => self.bandwidth_contact_hz,
            "bandwidth_gap_hz" => self.bandwidth_gap_hz,
            "least_stiffness_n_per_um" => self.least_stiffness_n_per_um,
            _ => None,
        }
    }
}

/// Figures of loops, with the families that were asked for last.
///
/// ```
/// use hil_core::runfile;
/// use hil_core::theory::Loops;
///
/// let filtered = "controller.derivative_filter_s=0.002".to_owned();
/// let case = runfile::builtin("paper-2", &[filtered])?;
/// let figures = Loops::default().figures(&case);
/// assert!(figures.modulus_margin_contact > Some(0.5));
/// assert!(figures.modulus_margin_gap < figures.modulus_margin_contact);
/// # Ok::<(), runfile::RunFileErrors>(())
/// ```
#[derive(Debug, Default)]
pub struct Loops {
    known: VecDeque<Known>,
    room: Room,
}

/// A family, and the compliances of its loops once they were asked for.
#[derive(Debug)]
struct Known {
    key: FamilyKey,
    family: LoopFamily,
    compliance: Option<Compliance>,
}

impl Loops {
    /// All figures of a case: some microseconds, and about a hundred for each new family.
    pub fn figures(&mut self, case: &Case) -> LoopFigures {
        self.of_cases(&[case]).pop().unwrap_or_default()
    }

    /// Those of several cases, each as by itself: side by side they take less.
    pub fn of_cases(&mut self, cases: &[&Case]) -> Vec<LoopFigures> {
        let loops = cases.iter().enumerate().flat_map(|(place, &case)| {
            each_gains(case).map(move |gains| Loop { place, case, gains })
        });
        self.of_loops(cases.len(), &loops.collect::<Vec<_>>())
    }

    /// Those of a case with other gains; of several, each joint state's with the smallest
    /// signed modulus margin.
    pub fn figures_of(&mut self, case: &Case, gains: &[LoopGains]) -> LoopFigures {
        let with = |&gains: &LoopGains| Loop {
            place: 0,
            case,
            gains,
        };
        let loops: Vec<_> = gains.iter().map(with).collect();
        self.of_loops(1, &loops).pop().unwrap_or_default()
    }

    /// Those of as many cases, from all of their loops.
    fn of_loops(&mut self, cases: usize, loops: &[Loop<'_>]) -> Vec<LoopFigures> {
        let [contact, gap] = JOINT_STATES.map(|joint| {
            let margins = self.of_families(joint, loops, |known, room, gains| {
                known.family.margins(room, gains)
            });
            worst(cases, loops, &margins)
        });
        let stable = contact.iter().flatten();
        let stable = stable.filter(|(margin, _)| margin.stable);
        let stable: Vec<_> = stable.map(|&(_, of)| of).collect();
        let least = self.of_families(JointState::Contact, &stable, Known::stiffness);
        let mut stiffness = vec![None; cases];
        for (of, least) in stable.iter().zip(least) {
            stiffness[of.place] = least;
        }
        let margins = contact.iter().zip(&gap).zip(stiffness);
        let figures = margins.map(|((contact, gap), stiffness)| {
            let margin = |worst: &Option<(Margin, Loop<'_>)>| worst.map(|(margin, _)| margin);
            LoopFigures::new(margin(contact), margin(gap), stiffness)
        });
        figures.collect()
    }

    /// What the family of each loop has for its gains, in their order; none where there is
    /// no such loop.
    fn of_families<T: Clone>(
        &mut self,
        joint: JointState,
        loops: &[Loop<'_>],
        figures: impl Fn(&mut Known, &mut Room, &[LoopGains]) -> Vec<T>,
    ) -> Vec<Option<T>> {
        let keys = loops.iter().map(|of| (key(of.case, joint), of.gains));
        let keys: Vec<_> = keys.collect();
        let mut all = Vec::with_capacity(loops.len());
        let mut gains = Vec::new();
        for same in keys.chunk_by(|a, b| a.0 == b.0) {
            let Some((known, room)) = same[0].0.and_then(|key| self.known(key)) else {
                all.resize(all.len() + same.len(), None);
                continue;
            };
            gains.clear();
            gains.extend(same.iter().map(|(_, gains)| *gains));
            all.extend(figures(known, room, &gains).into_iter().map(Some));
        }
        all
    }

    /// The signed modulus margins alone, in contact and in the gap.
    pub fn signed_modulus(&mut self, case: &Case) -> [Option<f64>; 2] {
        JOINT_STATES.map(|joint| {
            let (known, room) = self.known(key(case, joint)?)?;
            let family = &known.family;
            let of_gains = each_gains(case).map(|gains| family.signed_modulus_in(room, &gains));
            of_gains.min_by(f64::total_cmp)
        })
    }

    /// The family of a key, and room for its curves.
    fn known(&mut self, key: FamilyKey) -> Option<(&mut Known, &mut Room)> {
        let place = self.known.iter().position(|known| known.key == key);
        let place = place.unwrap_or_else(|| {
            // The oldest makes room.
            self.known.truncate(KEPT - 1);
            self.known.push_front(Known {
                key,
                family: key.family(),
                compliance: None,
            });
            0
        });
        Some((self.known.get_mut(place)?, &mut self.room))
    }
}

/// One loop of a case.
#[derive(Debug, Clone, Copy)]
struct Loop<'a> {
    /// Place of the case among others.
    place: usize,
    case: &'a Case,
    gains: LoopGains,
}

impl LoopFigures {
    fn new(contact: Option<Margin>, gap: Option<Margin>, stiffness: Option<f64>) -> Self {
        let gain_db = |margin: Option<Margin>| Some(20.0 * libm::log10(margin?.gain?));
        let phase_deg = |margin: Option<Margin>| Some(margin?.phase_rad? * (180.0 / PI));
        let crossover_hz = |margin: Option<Margin>| Some(margin?.crossover_radps? / TAU);
        let bandwidth_hz = |margin: Option<Margin>| Some(margin?.bandwidth_radps? / TAU);
        Self {
            modulus_margin_contact: contact.map(|margin| margin.signed()),
            modulus_margin_gap: gap.map(|margin| margin.signed()),
            gain_margin_contact_db: gain_db(contact),
            gain_margin_gap_db: gain_db(gap),
            phase_margin_contact_deg: phase_deg(contact),
            phase_margin_gap_deg: phase_deg(gap),
            crossover_contact_hz: crossover_hz(contact),
            crossover_gap_hz: crossover_hz(gap),
            bandwidth_contact_hz: bandwidth_hz(contact),
            bandwidth_gap_hz: bandwidth_hz(gap),
            least_stiffness_n_per_um: stiffness,
        }
    }
}

impl Known {
    /// The least stiffness with each of some gains \[N/µm\].
    fn stiffness(&mut self, room: &mut Room, gains: &[LoopGains]) -> Vec<f64> {
        let family = &self.family;
        let compliance = (self.compliance).get_or_insert_with(|| Compliance::new(family));
        compliance.least_n_per_um(family, room, gains)
    }
}

/// The key of a case's family; none where it has no such loop.
fn key(case: &Case, joint: JointState) -> Option<FamilyKey> {
    match no_loop(case, joint) {
        None => FamilyKey::of(case, joint),
        Some(_) => None,
    }
}

/// The gains of a run: those at its start, and those after a change.
fn each_gains(case: &Case) -> impl Iterator<Item = LoopGains> {
    core::iter::once(LoopGains::of(case)).chain(LoopGains::after_change(case))
}

/// Of each case, the loop with the smallest signed modulus margin.
fn worst<'a>(
    cases: usize,
    loops: &[Loop<'a>],
    margins: &[Option<Margin>],
) -> Vec<Option<(Margin, Loop<'a>)>> {
    let mut worst: Vec<Option<(Margin, Loop<'a>)>> = vec![None; cases];
    for (of, margin) in loops.iter().zip(margins) {
        let worst = &mut worst[of.place];
        let Some(margin) = margin else { continue };
        let is_worse = |(known, _): (Margin, _)| margin.signed().total_cmp(&known.signed()).is_lt();
        if worst.is_none_or(is_worse) {
            *worst = Some((*margin, *of));
        }
    }
    worst
}

/// The margins of a case's linear loop: sampled, with hold and delay as they
/// are, or on rung `continuous` the paper's own; where gains change, those of
/// the smaller signed modulus margin. `None` where sample time or delay is not known, or
/// there is no such loop.
///
/// Works out a family for one case; whoever has many keeps [`Loops`].
pub fn margin(case: &Case, joint: JointState) -> Option<Margin> {
    if case.controller.law == Law::Continuous {
        return Some(DelayedLoop::of(case, joint)?.margin());
    }
    let family = LoopFamily::of(case, joint)?;
    let margins = each_gains(case).map(|gains| family.margin(&gains));
    margins.min_by(|one, other| one.signed().total_cmp(&other.signed()))
}

/// The reason why a case has no linear sampled loop in a state of its joint; `None` where
/// it has one.
pub fn no_loop(case: &Case, joint: JointState) -> Option<&'static str> {
    let controller = &case.controller;
    if controller.law == Law::Continuous {
        return Some("rung continuous has no sampled loop");
    }
    if joint == JointState::Gap {
        if case.axis.transmission.joint.elastic().is_none() {
            return Some("a rigid joint has no gap");
        }
        if !case.has_gap() {
            return Some("a joint with transmission.backlash_half_deg = 0 has no gap");
        }
        if has_dual_feedback(case) {
            return Some(
                "in the gap the load does not see the motor: with controller.feedback = \"dual\" \
                 there is no position loop",
            );
        }
    }
    if controller.sample_time_ns.unwrap_or(0) == 0 {
        return Some("without controller.sample_time_s there is no sampled loop");
    }
    if controller.computation_delay.fixed_ns().is_none() {
        return Some("a measured computation delay is another one for every sample");
    }
    None
}

/// The note on a case whose linear loop is without some of its options.
pub fn left_out(case: &Case) -> Option<String> {
    if case.controller.law != Law::Firmware {
        return None;
    }
    let law = &case.options.law;
    let keys = [
        law.slew_limit_codes_per_s
            .map(|_| "controller.slew_limit_codes_per_s"),
        (law.rest_dead_band_counts > 0).then_some("controller.rest_dead_band_counts"),
        (law.rest_integrator != RestIntegrator::Run).then_some("controller.rest_integrator"),
    ];
    let keys: Vec<&str> = keys.into_iter().flatten().collect();
    (!keys.is_empty()).then(|| format!("the linear loop leaves out {}", keys.join(", ")))
}

/// The reason why a case has no figure of that key; `None` where it has a loop, or where the
/// figure is none of a loop.
pub fn no_figure(case: &Case, figure: &str) -> Option<&'static str> {
    let is_of_loop = figures::find(figure).is_some_and(|figure| figure.at_least);
    let joint = match figure.contains("_gap") {
        true => JointState::Gap,
        false => JointState::Contact,
    };
    is_of_loop.then(|| no_loop(case, joint)).flatten()
}
