//! Boost odeint on the project's workloads: writes a case for
//! `odeint/odeint.cpp`, builds that program where a compiler and Boost's
//! headers are there, runs it and reads what it prints.

use std::error::Error;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use bench_benches::elastic_axis::State;
use bench_benches::lockstep::{Plan, seconds};
use hil_core::case::{Case, Law};
use hil_core::run::{RunOptions, run};
use plant::Joint;

/// Tolerances: absolute and relative, for every step.
pub const W1_TOLERANCE: f64 = 1e-10;
/// See [`W1_TOLERANCE`].
pub const W2_TOLERANCE: f64 = 1e-9;
/// See [`W1_TOLERANCE`].
pub const W3_TOLERANCE: f64 = 1e-9;

/// Largest deviation at the end of a run that counts as agreement. Measured:
/// 1.8e-11 on W1, 2.9e-11 on W2, 1.1e-10 on W3.
pub const BOUND: f64 = 1e-9;

/// As quick as the compiler makes it; how it rounds is not looked at.
const FLAGS: [&str; 4] = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG"];

/// The program, built, with a case.
#[derive(Debug)]
pub struct Odeint {
    program: PathBuf,
    case: String,
}

/// What the program prints.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounds {
    /// Time of each run.
    pub times: Vec<Duration>,
    /// Changes of contact.
    pub changes: usize,
    /// Every code times the number of its sample, counted from one, in a sum.
    pub codes: f64,
    /// State at the end.
    pub state: State,
}

/// Comparison with the project's own run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Worst of γ, γ̇, ε, ε̇, I at the end, each in units of its largest
    /// magnitude in the whole run.
    pub deviation: f64,
    /// Changes of contact.
    pub changes: usize,
}

impl Odeint {
    /// Builds the program in `folder` for a case.
    ///
    /// # Errors
    /// A sentence if it cannot be built, or the case is none for it.
    pub fn new(folder: &Path, case: &Case, tolerance: f64) -> Result<Self, Box<dyn Error>> {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("odeint/odeint.cpp");
        let program = folder.join("odeint");
        let compiler = std::env::var_os("CXX").unwrap_or_else(|| "g++".into());
        let built = Command::new(&compiler)
            .args(FLAGS.map(OsStr::new))
            .args([OsStr::new("-o"), program.as_os_str(), source.as_os_str()])
            .output()
            .map_err(|error| format!("no {}: {error}", compiler.display()))?;
        if !built.status.success() {
            let said = String::from_utf8_lossy(&built.stderr);
            let first = said.lines().find(|line| line.contains("error"));
            return Err(first.unwrap_or("the compiler failed").to_owned().into());
        }
        Ok(Self {
            program,
            case: text(case, tolerance)?,
        })
    }

    /// Runs the case `rounds` times, after one run that is not counted.
    ///
    /// # Errors
    /// A sentence if the program fails.
    pub fn run(&self, rounds: u64) -> Result<Rounds, Box<dyn Error>> {
        let mut child = Command::new(&self.program)
            .arg(rounds.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        if let Some(mut input) = child.stdin.take() {
            input.write_all(self.case.as_bytes())?;
        }
        let output = child.wait_with_output()?;
        if !output.status.success() {
            return Err(format!("odeint: {}", output.status).into());
        }
        let said = String::from_utf8(output.stdout)?;
        let numbers = |name: &str| -> Result<Vec<f64>, Box<dyn Error>> {
            let words = said
                .lines()
                .map(str::split_whitespace)
                .find_map(|mut words| (words.next() == Some(name)).then_some(words));
            let words = words.ok_or_else(|| format!("odeint printed no {name}"))?;
            Ok(words.map(str::parse).collect::<Result<_, _>>()?)
        };
        let first = |name: &str| -> Result<f64, Box<dyn Error>> {
            let first = numbers(name)?.first().copied();
            first.ok_or_else(|| format!("odeint printed no number after {name}").into())
        };
        Ok(Rounds {
            times: numbers("ns")?
                .into_iter()
                .map(|ns| Duration::from_secs_f64(ns * 1e-9))
                .collect(),
            changes: first("changes")? as usize,
            codes: first("codes")?,
            state: numbers("state")?.try_into().map_err(|_| "no five states")?,
        })
    }

    /// Runs once and holds the result against the project's own.
    ///
    /// # Errors
    /// A sentence if they do not agree.
    pub fn agreement(&self, case: &Case) -> Result<Agreement, Box<dyn Error>> {
        let (mut own, mut largest) = (State::default(), State::default());
        // The last sample's code moves nothing any more.
        let (mut number, mut sum, mut codes) = (0.0, 0.0, 0.0);
        let outcome = run(case, RunOptions::default(), &mut |row| {
            if let Some(sample) = row.sample {
                codes = sum;
                number += 1.0;
                sum += number * sample.dac_code;
            }
            let epsilon_dot_radps = row.beta_dot_radps - row.gamma_dot_radps;
            own = [
                row.gamma_rad,
                row.gamma_dot_radps,
                row.beta_rad - row.gamma_rad,
                epsilon_dot_radps,
                row.current_a,
            ];
            for (largest, own) in largest.iter_mut().zip(own) {
                *largest = largest.max(own.abs());
            }
            Ok(())
        })?;
        let rounds = self.run(0)?;
        let deviation = (0..own.len()).fold(0.0, |worst: f64, i| {
            worst.max((rounds.state[i] - own[i]).abs() / largest[i])
        });
        let changes = outcome.contact_changes.len();
        if rounds.changes != changes {
            return Err(format!("{} changes of contact, not {changes}", rounds.changes).into());
        }
        if rounds.codes != codes {
            return Err(format!("other codes: {}, not {codes}", rounds.codes).into());
        }
        let finite = rounds.state.iter().all(|y| y.is_finite());
        if !finite || deviation > BOUND {
            return Err(format!("odeint is {deviation:.1e} off, more than {BOUND:.0e}").into());
        }
        Ok(Agreement { deviation, changes })
    }
}

/// The case as the program reads it.
fn text(case: &Case, tolerance: f64) -> Result<String, Box<dyn Error>> {
    let (motor, transmission) = (&case.axis.motor, &case.axis.transmission);
    let (controller, gains) = (&case.controller, &case.controller.gains);
    let Joint::Elastic(joint) = transmission.joint else {
        return Err("a rigid joint".into());
    };
    let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
    if case.motion.end_s() > seconds(case.run.duration_ns) {
        return Err("a run that ends within its motion".into());
    }
    let mut text = String::new();
    let mut line = |name: &str, numbers: &[f64]| {
        text += name;
        for number in numbers {
            // The shortest digits that give the same number again.
            let _ = write!(text, " {number:e}");
        }
        text += "\n";
    };
    line("tolerance", &[tolerance]);
    line("gear_ratio", &[z]);
    line("gear_inertia_kg_m2", &[motor.inertia_kg_m2 / (z * z)]);
    let screw = transmission.screw_inertia_kg_m2 + case.axis.carriage.mass_kg * p * p;
    line("screw_inertia_kg_m2", &[screw]);
    line(
        "torque_constant_nm_per_a",
        &[motor.torque_constant_nm_per_a],
    );
    line("resistance_ohm", &[motor.resistance_ohm]);
    line("inductance_h", &[motor.inductance_h]);
    line("stiffness_nm_per_rad", &[joint.stiffness_nm_per_rad]);
    line("damping_nms_per_rad", &[joint.damping_nms_per_rad]);
    line("backlash_half_rad", &[joint.backlash_half_rad]);
    line("voltage_limit_v", &[case.amplifier.voltage_limit_v]);
    if controller.law == Law::Continuous {
        let pid = [gains.kp, gains.ki_per_s, gains.kd_s];
        let k0 = case.amplifier.gain * case.encoder.counts_per_rad * case.dac.step_v / z;
        line("law", &pid.map(|gain| k0 * gain));
        line("segments", &segments(case, p));
        return Ok(text);
    }
    let plan = Plan::new(case).ok_or("no sample time")?;
    line("sample_time_s", &[seconds(plan.period_ns())]);
    line("setpoints", plan.setpoints());
    line("kp", &[gains.kp]);
    line("ki_per_s", &[gains.ki_per_s]);
    line("kd_s", &[gains.kd_s]);
    line("counts_per_rad", &[case.encoder.counts_per_rad]);
    line(
        "codes",
        &[case.dac.code_min().into(), case.dac.code_max().into()],
    );
    line("dac_step_v", &[case.dac.step_v]);
    line("amplifier_gain", &[case.amplifier.gain]);
    Ok(text)
}

/// The command between its breaks and the rest after it, as angles of the gear:
/// start and length, the amplitudes of sine, one and cosine, speed, angle and
/// the integral of the angle at the start.
fn segments(case: &Case, p: f64) -> Vec<f64> {
    let (motion, mut start_s, mut numbers) = (&case.motion, 0.0, Vec::new());
    let rest_s = seconds(case.run.duration_ns) - motion.end_s();
    for (index, length_s) in (0..).zip(motion.intervals_s().into_iter().flatten().chain([rest_s])) {
        if length_s <= 0.0 {
            continue;
        }
        let point = motion.at(start_s);
        let next_s = start_s + length_s;
        let (sine, one, cosine) = match index {
            0 | 4 => (motion.acceleration_before_mps2(next_s), 0.0, 0.0),
            2 | 6 => (0.0, 0.0, point.acceleration_mps2),
            _ => (0.0, point.acceleration_mps2, 0.0),
        };
        numbers.extend([start_s, length_s]);
        let rest = [
            sine,
            one,
            cosine,
            point.velocity_mps,
            point.displacement_m,
            point.displacement_integral_ms,
        ];
        numbers.extend(rest.map(|number| number / p));
        start_s = next_s;
    }
    numbers
}
