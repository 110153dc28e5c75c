//! A study that was read and found right: which cases it runs.
//!
//! ```text
//! axes ──► plan ──► point: what every key has ──► constraint ──► case of a rung
//! ```

pub(super) mod axis;
mod loop_gain;
pub(super) mod points;

use schemars::JsonSchema;
use serde::Deserialize;

use self::axis::{Axis, AxisValue, Setting};
use self::loop_gain::at_other_steps;
use self::points::{Constraint, Plan};
use crate::study::picture::Picture;
use hil_core::case::{Case, Law};
use hil_core::runfile::{KeyPath, KeyValue, RunFileErrors, Template};

/// Fate of the loop where steps of encoder or converter change
/// (`loop_gain`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LoopGain {
    /// Gains stay as the base gives them: in codes per count the loop changes with
    /// finer steps, in volts per radian it does not.
    #[default]
    PerCount,
    /// Gains, feed-forward and limits keep their volts and radians, those that
    /// they have with the steps of the base: only the resolution changes.
    Constant,
}

/// A prediction (`theory`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Theory {
    /// The margin of the continuous loop with half a sample and the delay as
    /// dead time: what hold and delay cost, to first order.
    HoldAndDelay,
    /// Limit cycles by describing functions of gap, encoder and converter.
    DescribingFunction,
    /// Effect of white quantisation noise on position, acceleration and voltage.
    QuantisationNoise,
}

/// A study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// Its title.
    pub title: String,
    /// Its question.
    pub description: String,
    /// Remarks to know before a figure is quoted.
    pub notes: Vec<String>,
    /// Name or path of the base case.
    pub base: String,
    /// The base with the command line's `--set` alone, before what the study
    /// changes.
    pub reference: Template,
    /// The points.
    pub plan: Plan,
    /// The axes.
    pub axes: Vec<Axis>,
    /// Rungs that every point is run on, each with its run file.
    pub rungs: Vec<(Law, Template)>,
    /// Points that do not fulfil these are left out.
    pub constraints: Vec<Constraint>,
    /// Fate of the gains where encoder or converter change.
    pub loop_gain: LoopGain,
    /// Predictions that stand beside the figures.
    pub theory: Vec<Theory>,
    /// True if it is found out what feeds a limit cycle.
    pub feeding: bool,
    /// True if each rung is compared with the one before it, row by row.
    pub differences: bool,
    /// Part of the runs that must pass \[%\].
    pub required_yield_percent: Option<f64>,
    /// Pictures of the results.
    pub pictures: Vec<Picture>,
    /// Text of the study file.
    pub text: String,
    /// Keys that differ from the base in every run, as on a command line.
    pub sets: Vec<String>,
}

/// One point: what every axis has there.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The values, as the axes give them.
    pub chosen: Vec<AxisValue>,
    /// The values that the keys take.
    pub values: Vec<KeyValue>,
}

/// Additions of the command line to a study.
#[derive(Debug, Clone, Default)]
pub struct Changes {
    /// Another base case than that of the file.
    pub base: Option<String>,
    /// The base's run file, where it is not to be read from its path.
    pub base_text: Option<String>,
    /// Further `section.key=value`.
    pub sets: Vec<String>,
    /// Other rungs than those of the file.
    pub rungs: Option<Vec<Law>>,
}

impl Study {
    /// The base with what the study changes, on the first rung; the others have
    /// another law alone.
    pub fn template(&self) -> &Template {
        let first = self.rungs.first();
        first.map_or(&self.reference, |(_, template)| template)
    }

    /// Names of the rungs in a row.
    pub fn rung_names(&self) -> String {
        let names: Vec<&str> = self.rungs.iter().map(|(law, _)| law.name()).collect();
        names.join(", ")
    }

    /// Rows of the results: points times rungs.
    pub fn rows(&self) -> u64 {
        self.plan.points() * self.rungs.len() as u64
    }

    /// A point, 0 ≤ `number` < points of the plan.
    pub fn point(&self, number: u64) -> Point {
        let at = |(place, axis): (usize, &Axis)| axis.at(self.plan.position(number, place));
        let chosen: Vec<AxisValue> = self.axes.iter().enumerate().map(at).collect();
        let own = |(axis, chosen): (&Axis, &AxisValue)| chosen.value(&axis.key, None);
        let mut values: Vec<KeyValue> = self.axes.iter().zip(&chosen).map(own).collect();
        // Factors of what the base has come first: others may be factors of them.
        for of_base in [true, false] {
            for (place, axis) in self.axes.iter().enumerate() {
                let Some(times) = axis.times.filter(|_| axis.is_of_base() == of_base) else {
                    continue;
                };
                let factor = match of_base {
                    true => self.template().own_number(&times),
                    false => self.number(&values, &times),
                };
                values[place] = chosen[place].value(&axis.key, factor.or(Some(f64::NAN)));
            }
        }
        Point { chosen, values }
    }

    /// The number that a key has at a point, if it has one.
    fn number(&self, values: &[KeyValue], key: &KeyPath) -> Option<f64> {
        let path = key.path();
        match self.axes.iter().position(|axis| axis.key.path() == path) {
            Some(place) => values.get(place)?.number(),
            None => self.template().number(key),
        }
    }

    /// The constraint that keeps a point from being run.
    pub fn broken_constraint(&self, point: &Point) -> Option<&Constraint> {
        self.constraints
            .iter()
            .find(|constraint| !constraint.holds(|key| self.number(&point.values, key)))
    }

    /// Every `section.key=value` that makes the base case the run of a point on
    /// rung number `rung`, as a command line would have them.
    pub fn row_sets(&self, point: &Point, rung: usize) -> Vec<String> {
        let mut sets = self.sets.clone();
        sets.push(format!("controller.law={}", self.rungs[rung].0.name()));
        // A point that makes no run has the values of its axes.
        let changes = self.changes(point, rung);
        let changes = changes.unwrap_or_else(|_| self.chosen(point));
        let line = |(key, value): &Setting| format!("{}={}", key.path(), value.to_toml());
        sets.extend(changes.iter().map(line));
        sets
    }

    /// The run of a point on rung number `rung`.
    ///
    /// # Errors
    /// Mistakes in the values of the point.
    pub fn case(&self, point: &Point, rung: usize) -> Result<Case, RunFileErrors> {
        let (_, template) = &self.rungs[rung];
        let changes = self.changes(point, rung)?;
        if changes.is_empty() {
            return Ok(template.base().clone());
        }
        template.case(changes.iter().map(|(key, value)| (key, value)))
    }

    /// Every key that a point gives another value than its rung's run file:
    /// those of the axes, and what keeps the loop where steps change.
    ///
    /// # Errors
    /// Mistakes in the values of the point.
    pub fn changes(&self, point: &Point, rung: usize) -> Result<Vec<Setting>, RunFileErrors> {
        let mut changes = self.chosen(point);
        if self.loop_gain == LoopGain::Constant {
            let (_, template) = &self.rungs[rung];
            let case = template.case(changes.iter().map(|(key, value)| (key, value)))?;
            for (key, value) in at_other_steps(self.reference.base(), &case, template, &changes) {
                changes.retain(|(axis, _)| axis.path() != key.path());
                changes.push((key, value));
            }
        }
        Ok(changes)
    }

    /// The keys of the axes with their values at a point.
    fn chosen(&self, point: &Point) -> Vec<Setting> {
        let keys = self.axes.iter().map(|axis| axis.key);
        keys.zip(point.values.iter().cloned()).collect()
    }
}
