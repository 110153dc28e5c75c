//! Colours, dashes and marks of the curves, and their legend.

use super::data::Data;
use crate::study::picture::Curve;
use crate::study::picture::canvas::Stroke;
use crate::study::picture::colour::{Colour, INK, MUTED, SERIES, darker, series};
use crate::study::picture::label::{Label, within};
use crate::study::picture::legend::{Entry, Group, Key};
use crate::study::picture::mark::{Mark, shape};
use crate::study::picture::reference::limit_entry;
use crate::study::picture::spec::{Lines, Panel};

/// Width of the curves \[px\].
const CURVE: f64 = 2.0;
/// Dashes of theory \[px\], by column.
const THEORY: [&[f64]; 3] = [&[8.0, 5.0], &[2.5, 3.5], &[14.0, 4.0, 3.0, 4.0]];

/// Who looks how, by column and series.
pub(super) struct Looks {
    simulated: Vec<String>,
    theory: Vec<String>,
    series: Vec<String>,
    ordered: bool,
    /// One simulated column and one of theory at most per panel: the titles of
    /// the axes say which.
    alike: bool,
}

impl Looks {
    pub(super) fn of(lines: &Lines, data: &Data) -> Self {
        let columns = |of: fn(&Panel) -> &Vec<String>| {
            let mut names: Vec<String> = Vec::new();
            for name in lines.panels.iter().flat_map(of) {
                if !names.contains(name) {
                    names.push(name.clone());
                }
            }
            names
        };
        let single = |panel: &Panel| panel.y.len() < 2 && panel.theory.len() < 2;
        Self {
            simulated: columns(|panel| &panel.y),
            theory: columns(|panel| &panel.theory),
            series: match lines.series {
                Some(_) => data.series.names.clone(),
                None => Vec::new(),
            },
            ordered: data.series.numbers.is_some(),
            alike: lines.panels.iter().all(single),
        }
    }

    fn series_colour(&self, at: usize) -> Colour {
        series(at, self.series.len(), self.ordered)
    }

    /// Line and mark of a simulated column.
    pub(super) fn simulated(&self, column: &str, at: usize) -> (Stroke, Mark) {
        let place = self.simulated.iter().position(|name| name == column);
        let place = if self.alike { 0 } else { place.unwrap_or(0) };
        let (colour, form, hollow) = if self.series.is_empty() {
            (SERIES[place % SERIES.len()], place, place >= SERIES.len())
        } else {
            // Colours and shapes come round together; then marks are hollow.
            let again = at >= SERIES.len() && !self.ordered;
            (self.series_colour(at), at, again || place > 0)
        };
        let mark = Mark {
            shape: shape(form),
            colour,
            hollow,
        };
        (Stroke::solid(colour, CURVE), mark)
    }

    /// Line of a column of theory; over the simulation it must be darker.
    pub(super) fn theory(&self, column: &str, at: usize) -> Stroke {
        let place = self.theory.iter().position(|name| name == column);
        let place = if self.alike { 0 } else { place.unwrap_or(0) };
        // Where each column has its theory, it has the colour of the column.
        let twins = self.simulated.len() == self.theory.len();
        let behind = if twins { 0 } else { self.simulated.len() };
        let colour = if !self.series.is_empty() {
            darker(self.series_colour(at))
        } else if self.alike {
            INK
        } else {
            darker(SERIES[(behind + place) % SERIES.len()])
        };
        Stroke::dashed(colour, CURVE, THEORY[place % THEORY.len()])
    }

    /// Line of a curve that the caller gave.
    pub(super) fn given(&self, at: usize) -> Stroke {
        Stroke::dashed(INK, CURVE, THEORY[at % THEORY.len()])
    }

    /// The legend: series, columns, curves, limits.
    pub(super) fn legend(&self, lines: &Lines, curves: &[Curve]) -> Vec<Group> {
        let mut groups = Vec::new();
        if let Some(column) = lines.series.as_ref().filter(|_| !self.series.is_empty()) {
            let entries = self.series.iter().enumerate().map(|(at, name)| {
                let key = match self.simulated.first() {
                    Some(column) => {
                        let (stroke, mark) = self.simulated(column, at);
                        Key::Line(stroke, Some(mark))
                    }
                    None => Key::Line(self.theory("", at), None),
                };
                Entry::new(key, name)
            });
            groups.push(Group {
                heading: format!("{}:", Label::of(column).words),
                entries: entries.collect(),
            });
        }
        let mut entries = self.columns(lines);
        let given = |(at, curve): (usize, &Curve)| {
            Entry::new(Key::Line(self.given(at), None), &curve.label)
        };
        entries.extend(curves.iter().enumerate().map(given));
        entries.extend(limits(lines));
        groups.push(Group::of(entries));
        groups
    }

    /// Entries of the columns, where the titles of the axes do not say all.
    fn columns(&self, lines: &Lines) -> Vec<Entry> {
        if self.alike && self.theory.is_empty() {
            return Vec::new();
        }
        // Beside series of different colours a column is told by form alone.
        let grey = |colour: Colour| match self.series.is_empty() {
            true => colour,
            false => MUTED,
        };
        let simulated = |column: &str| {
            let (mut stroke, mut mark) = self.simulated(column, 0);
            (stroke.colour, mark.colour) = (grey(stroke.colour), grey(mark.colour));
            Key::Line(stroke, Some(mark))
        };
        let theory = |column: &str| {
            let mut stroke = self.theory(column, 0);
            stroke.colour = grey(stroke.colour);
            Key::Line(stroke, None)
        };
        let named = |column: &str, own: &Option<String>, usual: &str| match (self.alike, own) {
            (false, _) => Label::of(column).words,
            (true, Some(own)) => own.clone(),
            (true, None) => usual.to_owned(),
        };
        let most = if self.alike { 1 } else { usize::MAX };
        let mark = |column: &String| {
            Entry::new(simulated(column), named(column, &lines.marks, "simulated"))
        };
        let dash =
            |column: &String| Entry::new(theory(column), named(column, &lines.dashes, "theory"));
        let marks = self.simulated.iter().take(most).map(mark);
        marks
            .chain(self.theory.iter().take(most).map(dash))
            .collect()
    }
}

/// One entry per limit; where panels differ it says of what.
fn limits(lines: &Lines) -> Vec<Entry> {
    let several = lines.panels.len() > 1;
    let entry = |panel: &Panel| {
        let limit = panel.limit.as_ref()?;
        let label = Label::of(panel.first_column());
        let mut entry = limit_entry(limit, &label);
        if several {
            entry.words += &format!(" ({})", within(&panel.y_axis.words(&label)));
        }
        Some(entry)
    };
    lines.panels.iter().filter_map(entry).collect()
}
