//! What a command asks of drive and motor, were the axis to follow it: remarks for a
//! user who cannot see it in the command.

use plant::{Course, MotionPoint};

use crate::case::{Case, Law};
use crate::number::{rounded, seconds};

/// Instants within each interval of the command that are looked at.
const INSTANTS: u32 = 16;

/// The remarks on the command of a case.
pub(crate) fn remarks(case: &Case) -> Vec<String> {
    let mut remarks = Vec::new();
    if let Course::Profile(profile) = case.motion.course() {
        // Below an atom's width it is rounding.
        let goes = match 1e3 * profile.overshoot_m {
            rounding if rounding < 1e-7 => "stays between the points".to_owned(),
            beyond_mm => format!(
                "goes up to {} mm beyond the points around it",
                rounded(beyond_mm, 3)
            ),
        };
        remarks.push(format!(
            "the profile is a cubic spline through {} points, at rest at both ends: it {goes}, and its \
             acceleration jumps by {} m/s² at the start and {} m/s² at the end",
            profile.points,
            rounded(profile.start_jump_mps2, 3),
            rounded(profile.end_jump_mps2, 3),
        ));
    }
    let needed = Needed::of(case);
    // What the largest code asks of the amplifier, where codes have a range.
    let of_codes = case.amplifier.gain * case.dac.output_v(case.dac.code_max().into());
    let of_codes = (case.controller.law >= Law::Quantised).then_some(of_codes);
    let is_current_drive = case.amplifier.is_current_drive();
    let lower = |limit: Option<f64>, name: &'static str, is_commanded: bool| {
        let of_codes = of_codes.filter(|_| is_commanded);
        let of_codes = of_codes.map(|most| (most, "the largest code asks for"));
        let limit = limit.map(|most| (most, name));
        let both = limit.into_iter().chain(of_codes);
        both.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let limit_v = case.voltage_limit_v();
    let voltage = lower(limit_v, "voltage_limit_v is", !is_current_drive);
    if let Some((limit_v, name)) = voltage
        && needed.voltage_v > limit_v
    {
        remarks.push(format!(
            "the motion asks for a speed or force beyond drive and motor: at {} s it needs k_m·{} rad/s + R·{} A = \
             {} V, and {name} {} V",
            rounded(needed.at_s, 3),
            rounded(needed.speed_radps, 3),
            rounded(needed.current_a, 3),
            rounded(needed.voltage_v, 3),
            rounded(limit_v, 3),
        ));
    }
    let limit_a = case.amplifier.current_limit_a();
    let current = lower(limit_a, "current_limit_a is", is_current_drive);
    if let Some((limit_a, name)) = current
        && needed.peak_current_a > limit_a
    {
        remarks.push(format!(
            "the motion asks for a force beyond drive and motor: it needs up to {} A, and {name} {} A",
            rounded(needed.peak_current_a, 3),
            rounded(limit_a, 3),
        ));
    }
    remarks
}

/// Largest voltage and current of a rigid axis that follows the command, the voltage
/// across the inductance left out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Needed {
    voltage_v: f64,
    /// Instant, motor speed and current of the largest voltage.
    at_s: f64,
    speed_radps: f64,
    current_a: f64,
    peak_current_a: f64,
}

impl Needed {
    fn of(case: &Case) -> Self {
        let (motion, surroundings) = (&case.motion, case.surroundings());
        let end_s = motion.end_s().min(seconds(case.run.duration_ns));
        let loads = case.loads.iter();
        let edges = loads.flat_map(|load| [Some(load.from_ns), load.to_ns]);
        let edges_s = edges.flatten().map(seconds);
        let breaks_s = motion.breaks_s().iter().copied();
        let mut breaks_s: Vec<f64> = breaks_s.chain(edges_s).chain([end_s]).collect();
        breaks_s.retain(|&t| t <= end_s);
        breaks_s.sort_unstable_by(f64::total_cmp);
        let (mut needed, mut start_s) = (Self::default(), 0.0);
        for break_s in breaks_s {
            // The nearest nanosecond: an edge of a load is one.
            let load_n = surroundings.force_at_n(libm::round(1e9 * start_s) as u64);
            for i in 0..=INSTANTS {
                let share = f64::from(i) / f64::from(INSTANTS);
                let now_s = start_s + share * (break_s - start_s);
                let mut point = motion.at(now_s);
                if i == INSTANTS {
                    point.acceleration_mps2 = motion.acceleration_before_mps2(break_s);
                }
                needed.look(case, now_s, &point, load_n);
            }
            start_s = break_s;
        }
        needed
    }

    fn look(&mut self, case: &Case, now_s: f64, point: &MotionPoint, load_n: f64) {
        let (motor, transmission) = (&case.axis.motor, &case.axis.transmission);
        let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
        let (screw_radps, k_m) = (point.velocity_mps / p, motor.torque_constant_nm_per_a);
        // J1 + J2 of a rigid joint, eq. 16
        let inertia_kg_m2 = motor.inertia_kg_m2 / (z * z)
            + transmission.screw_inertia_kg_m2
            + case.axis.carriage.mass_kg * p * p;
        let resistance = &case.axis.carriage.resistance;
        let direction = match resistance.opposes_motion {
            true if screw_radps == 0.0 => 0.0,
            true => screw_radps.signum(),
            false => 1.0,
        };
        let squared = resistance.quadratic_ns2_per_rad2 * screw_radps * screw_radps;
        let force_n = direction * (resistance.constant_n + squared)
            + resistance.linear_ns_per_rad * screw_radps
            + load_n;
        // k_m·I/z = (J1 + J2)·γ̈ + p·F_r,  V = k_m·γ̇/z + R·I
        let torque_nm = inertia_kg_m2 * (point.acceleration_mps2 / p) + p * force_n;
        let (current_a, speed_radps) = (torque_nm * z / k_m, screw_radps / z);
        let voltage_v = (k_m * speed_radps + motor.resistance_ohm * current_a).abs();
        self.peak_current_a = self.peak_current_a.max(current_a.abs());
        if voltage_v > self.voltage_v {
            (self.voltage_v, self.at_s) = (voltage_v, now_s);
            (self.speed_radps, self.current_a) = (speed_radps, current_a);
        }
    }
}

#[cfg(test)]
mod tests {
    use plant::Load;

    use super::*;
    use crate::runfile;

    /// The remarks on a move within limits of speed and acceleration.
    fn told(velocity_mps: f64, sets: &[&str]) -> Vec<String> {
        let mut sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        sets.push("motion.max_acceleration_mps2=5".to_owned());
        sets.push(format!("motion.max_velocity_mps={velocity_mps}"));
        sets.push("drive.dac_bits=16".to_owned());
        remarks(&runfile::builtin("paper-2", &sets).unwrap())
    }

    #[test]
    fn speed_and_current_are_those_of_the_equations() {
        // k_m·v/(p·z) = 0.25·0.9·2π/5e-3/2 and R·I with I = (J1 + J2)·(a/p)·z/k_m.
        let pitch = 5e-3 / core::f64::consts::TAU;
        let inertia = 2e-4 / 4.0 + 8.5e-4 + 50.0 * pitch * pitch;
        let current_a = inertia * 5.0 / pitch * 2.0 / 0.25;
        let voltage_v = 0.25 * 0.9 / pitch / 2.0 + 1.5 * current_a;
        let found = Needed::of(
            &runfile::builtin(
                "paper-2",
                &[
                    "motion.max_acceleration_mps2=5".to_owned(),
                    "motion.max_velocity_mps=0.9".to_owned(),
                ],
            )
            .unwrap(),
        );
        assert!(
            (found.voltage_v - voltage_v).abs() < 1e-9 * voltage_v,
            "{found:?}"
        );
        assert!(
            (found.peak_current_a - current_a).abs() < 1e-9 * current_a,
            "{found:?}"
        );
        assert!((found.at_s - 0.18).abs() < 1e-12);
        let limit = |limit_v: f64| format!("drive.voltage_limit_v={limit_v}");
        let beyond = told(0.9, &[&limit(voltage_v - 0.1)]);
        assert!(
            beyond.len() == 1 && beyond[0].contains("voltage_limit_v is "),
            "{beyond:?}"
        );
        // The contrasts: a volt more, a slower move.
        assert_eq!(told(0.9, &[&limit(voltage_v + 0.1)]), [""; 0]);
        assert_eq!(told(0.8, &[&limit(voltage_v - 0.1)]), [""; 0]);
        let amperes = |limit_a: f64| format!("drive.current_limit_a={limit_a}");
        let beyond = told(0.5, &[&amperes(current_a - 0.1)]);
        assert!(
            beyond.len() == 1 && beyond[0].contains("current_limit_a is "),
            "{beyond:?}"
        );
        assert_eq!(told(0.5, &[&amperes(current_a + 0.1)]), [""; 0]);
        // A load counts while it acts.
        let mut case = runfile::builtin("paper-2", &[]).unwrap();
        let without = Needed::of(&case);
        case.loads.push(Load {
            from_ns: 100_000_000,
            to_ns: Some(250_000_000),
            force_n: 1e3,
        });
        assert!(Needed::of(&case).peak_current_a > without.peak_current_a + 1.0);
        // The contrast: one that acts when the motion is over.
        let after_ns = (1e9 * case.motion.end_s()) as u64 + 1;
        (case.loads[0].from_ns, case.loads[0].to_ns) = (after_ns, None);
        assert_eq!(Needed::of(&case).peak_current_a, without.peak_current_a);
    }
}
