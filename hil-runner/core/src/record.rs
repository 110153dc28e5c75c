//! Observers of a run: what they keep while the plant is advanced.

use plant::{
    Contact, ContactChange, Course, Extremes, ExtremesSettings, Motion, Plant, Span, State, Watch,
};

use crate::case::Case;
use crate::number::seconds;

/// Follows a run: extremes always, the rest as far as it was asked for.
#[derive(Debug)]
pub(crate) struct Recorder {
    pub(crate) extremes: Extremes,
    pub(crate) events: Option<Vec<ContactChange>>,
    pub(crate) plot: Option<PlotRecorder>,
    pub(crate) grid: Option<GridRecorder>,
}

impl Recorder {
    pub(crate) fn new(case: &Case, plot: bool, grid_ns: Option<u64>) -> Self {
        let mut extremes = Extremes::new(ExtremesSettings {
            motion: case.motion.clone(),
            settling_band_m: 1e-6 * case.run.settling_band_um,
        });
        extremes.work_limit = case.run.work_limit;
        Self {
            extremes,
            events: (case.run.events || plot).then(Vec::new),
            plot: plot.then(|| PlotRecorder::new(case)),
            grid: grid_ns.map(|interval_ns| GridRecorder {
                interval_ns,
                pitch_m_per_rad: case.axis.transmission.screw_pitch_m_per_rad,
                points: Vec::new(),
            }),
        }
    }
}

impl Watch for Recorder {
    fn span(&mut self, span: &Span<'_>) {
        self.extremes.span(span);
        if let Some(plot) = &mut self.plot {
            plot.span(span);
        }
        if let Some(grid) = &mut self.grid {
            grid.span(span);
        }
    }

    fn contact_change(&mut self, change: &ContactChange) {
        self.extremes.contact_change(change);
        if let Some(events) = &mut self.events {
            events.push(*change);
        }
    }

    fn work(&mut self, amount: u64) -> bool {
        self.extremes.work(amount)
    }
}

/// One point of the curves in a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlotPoint {
    /// Time \[s\]; the same instant stands twice where something jumps.
    pub t_s: f64,
    /// Carriage acceleration \[m/s²\].
    pub acc_mps2: f64,
    /// State of the axis.
    pub state: State,
    /// Voltage in force \[V\].
    pub voltage_v: f64,
    /// DAC code in force; `None` on rung `continuous`.
    pub dac_code: Option<f64>,
    /// Contact.
    pub contact: Contact,
}

/// Buckets that the duration is cut into; with up to four points in each,
/// more than a wide screen shows.
const BUCKETS: f64 = 750.0;

/// Points kept for the sake of a jump; rattling without end would otherwise
/// fill the memory.
const MOST_JUMPS: usize = 20_000;

/// Thins the solver's own steps to what a plot can show: of each bucket of
/// time the first, the last, the lowest and the highest acceleration, and both
/// sides of every jump of voltage, contact or command.
#[derive(Debug)]
pub(crate) struct PlotRecorder {
    points: Vec<PlotPoint>,
    /// Points of the current bucket, and whether they must be kept.
    bucket: Vec<(PlotPoint, bool)>,
    bucket_end_s: f64,
    bucket_length_s: f64,
    jumps: usize,
    /// Code in force, set by the lockstep before each advance.
    pub(crate) dac_code: Option<f64>,
    /// The voltage changes at codes alone.
    voltage_is_held: bool,
    motion: Motion,
}

impl PlotRecorder {
    fn new(case: &Case) -> Self {
        Self {
            points: Vec::new(),
            bucket: Vec::new(),
            bucket_end_s: 0.0,
            bucket_length_s: seconds(case.run.duration_ns) / BUCKETS,
            jumps: 0,
            dac_code: None,
            voltage_is_held: case.holds_the_voltage(),
            motion: case.motion.clone(),
        }
    }

    fn span(&mut self, span: &Span<'_>) {
        self.add(self.point(span, 0.0), false);
        let (start_s, end_s) = (span.start_s(), span.end_s());
        // A profile's acceleration jumps at its ends only.
        let is_profile = matches!(self.motion.course(), Course::Profile(_));
        let may_jump = |t: f64| !is_profile || t == self.motion.end_s();
        let breaks_s = self.motion.breaks_between(start_s, end_s).iter();
        let points: Vec<PlotPoint> = breaks_s
            .filter(|&&t| may_jump(t))
            .map(|&t_s| PlotPoint {
                t_s,
                ..self.point(span, (t_s - start_s) / span.length_s())
            })
            .collect();
        for point in points {
            // Twice: the command may jump here.
            self.add(point, true);
            self.add(point, true);
        }
        self.add(self.point(span, 1.0), false);
    }

    fn add(&mut self, point: PlotPoint, keep: bool) {
        if !keep && self.bucket.last().is_some_and(|(last, _)| *last == point) {
            // Where one span ends the next begins.
            return;
        }
        if point.t_s >= self.bucket_end_s {
            self.empty_bucket();
            self.bucket_end_s = point.t_s + self.bucket_length_s;
        }
        let mut keep = keep;
        if let Some((last, last_kept)) = self.bucket.last_mut()
            && self.jumps < MOST_JUMPS
        {
            if last.contact != point.contact {
                // Both sides, or the spike is drawn as a slope.
                self.jumps += 1;
                (*last_kept, keep) = (true, true);
            } else if self.voltage_is_held && last.voltage_v != point.voltage_v {
                // Held from here on; the value before needs no second point.
                self.jumps += 1;
                keep = true;
            }
        }
        self.bucket.push((point, keep));
    }

    /// Keeps of the current bucket what a plot can show.
    fn empty_bucket(&mut self) {
        let mut extremes = [0, 0, 0, self.bucket.len().saturating_sub(1)];
        for (i, (point, _)) in self.bucket.iter().enumerate() {
            let acc = |i: usize| self.bucket.get(i).map_or(f64::NAN, |(p, _)| p.acc_mps2);
            if point.acc_mps2 < acc(extremes[1]) {
                extremes[1] = i;
            }
            if point.acc_mps2 > acc(extremes[2]) {
                extremes[2] = i;
            }
        }
        for (i, (point, keep)) in self.bucket.drain(..).enumerate() {
            if keep || extremes.contains(&i) {
                self.points.push(point);
            }
        }
    }

    /// The points, in order.
    pub(crate) fn finish(mut self) -> Vec<PlotPoint> {
        self.empty_bucket();
        self.points
    }

    fn point(&self, span: &Span<'_>, theta: f64) -> PlotPoint {
        PlotPoint {
            t_s: if theta < 1.0 {
                span.start_s() + theta * span.length_s()
            } else {
                span.end_s()
            },
            acc_mps2: span.acceleration_at_mps2(theta),
            state: span.state_at(theta),
            voltage_v: span.voltage_at_v(theta),
            dac_code: self.dac_code,
            contact: span.contact(),
        }
    }
}

/// The carriage at one instant of a common grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridPoint {
    /// Carriage displacement \[m\].
    pub x_m: f64,
    /// Carriage acceleration \[m/s²\].
    pub acc_mps2: f64,
}

/// Takes the carriage from the solution at the instants of a grid that owes
/// nothing to the sample time, without disturbing the solver.
#[derive(Debug)]
pub(crate) struct GridRecorder {
    interval_ns: u64,
    pitch_m_per_rad: f64,
    pub(crate) points: Vec<GridPoint>,
}

impl GridRecorder {
    /// Adds the instant at which the run ends, if it is one of the grid.
    pub(crate) fn finish(&mut self, end_ns: u64, plant: &Plant) {
        if self.next_s() <= seconds(end_ns) {
            self.push(&plant.state(), plant.acceleration_mps2());
        }
    }

    fn push(&mut self, state: &State, acc_mps2: f64) {
        let x_m = self.pitch_m_per_rad * state.gamma_rad();
        self.points.push(GridPoint { x_m, acc_mps2 });
    }

    fn next_s(&self) -> f64 {
        let done = u64::try_from(self.points.len()).unwrap_or(u64::MAX);
        seconds(done.saturating_mul(self.interval_ns))
    }

    fn span(&mut self, span: &Span<'_>) {
        while self.next_s() < span.end_s() {
            let theta = ((self.next_s() - span.start_s()) / span.length_s()).clamp(0.0, 1.0);
            self.push(&span.state_at(theta), span.acceleration_at_mps2(theta));
        }
    }
}
