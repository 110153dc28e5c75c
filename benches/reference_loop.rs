//! What a run with contacts and figures is compared with: the law as
//! written, in its order ([`Plan::run`]), and the exact map of one sample with
//! the joint in one mode. Nobody looks for contacts and nothing is recorded.
//!
//! The map is made here, from nothing of the `plant` crate: `ẋ = A·x + B·V`
//! with `x = (β, β̇, δ, ε̇, I)` and the flank closed, over a sample
//! `x(T) = e^{AT}·x(0) + ∫₀ᵀ e^{At} dt·B·V`. Speeds are counted per sample, so
//! that all entries of `AT` are of a size.

use std::convert::Infallible;
use std::error::Error;

use fearless_simd::{Level, Simd, dispatch};
use hil_core::case::Case;
use hil_core::run::{RunOptions, run};
use plant::Joint;

use crate::elastic_axis::{CURRENT, EPSILON, ElasticAxis, State};
use crate::lockstep::{Axis, Plan, count, seconds};

/// States, and the held voltage after them.
const SIZE: usize = 6;
/// Place of the voltage, which stays what it is.
const VOLTAGE: usize = 5;

/// Rows of a column: those of the state, and room for whole vectors.
const ROWS: usize = 8;

type Matrix = [[f64; SIZE]; SIZE];

/// A plan with the map of its sample.
#[derive(Debug, Clone)]
pub struct ReferenceLoop {
    plan: Plan,
    map: SampleMap,
    level: Level,
}

/// The axis in its one mode, from sample to sample.
#[derive(Debug, Clone, PartialEq)]
struct SampleMap {
    /// What each state adds to all at the end of the sample, and what a volt adds.
    columns: [[f64; ROWS]; SIZE],
    /// `β` \[rad\], `β̇` \[rad/sample\], `δ`, `ε̇` and `I` \[A\].
    x: [f64; ROWS],
}

impl ReferenceLoop {
    /// The loop of a case; `None` if its joint is rigid or it has no samples.
    pub fn new(case: &Case) -> Option<Self> {
        let plan = Plan::new(case)?;
        let axis = ElasticAxis::new(&gapless(case))?;
        let sample_s = seconds(case.controller.sample_time_ns?);
        // `δ` is counted from the flank, which without a gap lies at zero.
        let flank = axis.flank(true);
        let rates = |column: usize| -> State {
            let unit = |place| f64::from(u8::from(place == column));
            let y = [
                unit(0) - unit(EPSILON),
                (unit(1) - unit(3)) / sample_s,
                unit(EPSILON),
                unit(3) / sample_s,
                unit(CURRENT),
            ];
            let [
                gamma_dot,
                gamma_ddot,
                epsilon_dot,
                epsilon_ddot,
                current_dot,
            ] = axis.derivative(&flank, unit(VOLTAGE), &y);
            [
                gamma_dot + epsilon_dot,
                (gamma_ddot + epsilon_ddot) * sample_s,
                epsilon_dot,
                epsilon_ddot * sample_s,
                current_dot,
            ]
        };
        let columns: [State; SIZE] = std::array::from_fn(rates);
        // The voltage is held: its row is nothing.
        let mut a = Matrix::default();
        for (row, of_state) in a.iter_mut().take(VOLTAGE).enumerate() {
            *of_state = columns.map(|rates| rates[row] * sample_s);
        }
        let map = exponential(&a);
        let column = |column: usize| -> [f64; ROWS] {
            std::array::from_fn(|row| if row < VOLTAGE { map[row][column] } else { 0.0 })
        };
        Some(Self {
            plan,
            map: SampleMap {
                columns: std::array::from_fn(column),
                x: [0.0; ROWS],
            },
            level: narrow(Level::new()),
        })
    }

    /// One run from rest; `observe` gets every code. Returned is the last β \[rad\].
    pub fn run(&self, observe: impl FnMut(f64)) -> f64 {
        // As a single run of the project: `floor` is one instruction, wider
        // vectors do not pay.
        dispatch!(self.level, simd => on(simd, &self.plan, self.map.clone(), observe))
    }

    /// Codes of this loop that differ from those of the project's own run of `case`.
    ///
    /// # Errors
    /// Those of that run; one if the numbers of samples differ.
    pub fn codes_apart(&self, case: &Case) -> Result<usize, Box<dyn Error>> {
        let (mut own, mut codes) = (Vec::new(), Vec::new());
        run(case, RunOptions::default(), &mut |row| {
            own.extend(row.sample.map(|sample| sample.dac_code));
            Ok(())
        })?;
        self.run(|code| codes.push(code));
        if codes.len() != own.len() {
            return Err(format!("{} codes, and {} of the run", codes.len(), own.len()).into());
        }
        Ok(codes.iter().zip(&own).filter(|(a, b)| a != b).count())
    }
}

/// The case without a gap: its joint has one mode.
pub fn gapless(case: &Case) -> Case {
    let mut case = case.clone();
    if let Joint::Elastic(joint) = &mut case.axis.transmission.joint {
        joint.backlash_half_rad = 0.0;
    }
    case
}

/// The loop of a case, checked: without a gap its codes are those of the
/// project's own run. The same question asked of the case with its gap, and of
/// a carriage heavier by 1e-5, must be answered otherwise.
///
/// # Errors
/// A sentence if the codes differ, or if the contrasts do not.
pub fn checked(case: &Case) -> Result<ReferenceLoop, Box<dyn Error>> {
    let reference = ReferenceLoop::new(case).ok_or("a rigid joint or no sample time")?;
    let apart = reference.codes_apart(&gapless(case))?;
    if apart > 0 {
        return Err(format!("the reference loop has {apart} codes of its own").into());
    }
    let mut heavier = gapless(case);
    heavier.axis.carriage.mass_kg *= 1.0 + 1e-5;
    for (what, contrast) in [("gap", case), ("mass", &heavier)] {
        if reference.codes_apart(contrast)? == 0 {
            return Err(format!("the codes do not tell the {what}: they check nothing").into());
        }
    }
    Ok(reference)
}

#[inline(always)]
fn on<S: Simd>(_: S, plan: &Plan, mut map: SampleMap, mut observe: impl FnMut(f64)) -> f64 {
    let Ok(()) = plan.run(&mut map, |_, code, _| observe(code));
    map.x[0]
}

fn narrow(level: Level) -> Level {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(narrow) = level.as_sse4_2() {
        return Level::Sse4_2(narrow);
    }
    level
}

impl Axis for SampleMap {
    type Error = Infallible;

    #[inline(always)]
    fn beta_rad(&self) -> f64 {
        self.x[0]
    }

    #[inline(always)]
    fn hold(&mut self, voltage_v: f64, _: u64) -> Result<(), Infallible> {
        // The voltage comes last, and is what the next sample waits for.
        let mut x = [0.0; ROWS];
        for (column, &state) in self.columns[..VOLTAGE].iter().zip(&self.x) {
            for (x, &c) in x.iter_mut().zip(column) {
                *x += c * state;
            }
        }
        for (x, &c) in x.iter_mut().zip(&self.columns[VOLTAGE]) {
            *x += c * voltage_v;
        }
        self.x = x;
        Ok(())
    }
}

/// `e^A` by its series and by squaring: `e^{2X} − 1 = 2·(e^X − 1) + (e^X − 1)²`,
/// without the 1 that would swallow the digits of a small `X`.
fn exponential(a: &Matrix) -> Matrix {
    let norm = a.iter().flatten().fold(0.0, |m: f64, a| m.max(a.abs()));
    let (mut halvings, mut scale) = (0, 1.0);
    while norm * scale > 1.0 / 64.0 {
        scale /= 2.0;
        halvings += 1;
    }
    let x = a.map(|row| row.map(|a| a * scale));
    let (mut sum, mut term) = (x, x);
    for n in 2..=20 {
        term = product(&term, &x).map(|row| row.map(|a| a / count(n)));
        sum = combined(&sum, &term);
    }
    for _ in 0..halvings {
        let squared = product(&sum, &sum);
        sum = combined(&combined(&sum, &sum), &squared);
    }
    for (place, row) in sum.iter_mut().enumerate() {
        row[place] += 1.0;
    }
    sum
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..SIZE).map(|k| a[i][k] * b[k][j]).sum::<f64>())
    })
}

fn combined(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}
