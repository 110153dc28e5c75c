//! Feed-forward from the plant: what the model needs from the drive for a motion of the
//! whole axis as one body, in contact, the joint's elasticity left out.
//!
//! ```text
//! κ = k_m/z,   J_eq = J_m/z² + J_v + M·p²,   β̇ = z·ċ/K_enc
//! I = (J_eq·β̈ + p·a1·β̇ + p·a0·sign β̇)/κ
//! V = κ·β̇ + R·I + L·İ              code = V/(K_a·K_dac)
//! i = I + (İ + κ·β̈/R)/ω_c          code = i/(K_a·K_dac)   of a current drive; I without ω_c
//! ```
//!
//! The second line in the others, by β̇, β̈ and sign β̇:
//!
//! ```text
//! V:  κ + R·p·a1/κ    (R·J_eq + L·p·a1)/κ                 R·p·a0/κ
//! i:  p·a1/κ          (J_eq + (p·a1 + κ²/R)/ω_c)/κ        p·a0/κ
//! ```
//!
//! The loop of the amplifier (`plant/src/model/amplifier.rs`) makes of i the current
//! `I = ω_c/(s + ω_c)·i − s·κ·β̇/((L·s + R)·(s + ω_c))`; i is its inverse up to β̈. No key has the
//! jerk: its terms are left out, and so are a quadratic resistance, loads, and hold and delay
//! of the law. A derivative of the measurement brakes with K_d·ċ, which the velocity's word
//! gives back.

use plant::Control;

use crate::case::{Case, Law};
use crate::options::{Derivative, FeedForwardGain};

/// A gain from the plant in the unit of its key, and its formula.
type OfPlant = (f64, &'static str);

impl Case {
    /// Feed-forward per velocity \[codes s/count\], per acceleration \[codes s²/count\] and
    /// with the sign of the velocity \[codes\], in numbers.
    ///
    /// ```
    /// let sets = ["controller.velocity_ff_s=plant".to_owned()];
    /// let case = hil_core::runfile::builtin("paper-2", &sets)?;
    /// // k_m/(K_enc·K_a·K_dac): no resistance.
    /// let [velocity_s, ..] = case.feed_forward();
    /// assert!((velocity_s - 0.25 / (636.0 * 3.0 * 0.00488)).abs() < 1e-15);
    /// # Ok::<(), hil_core::runfile::RunFileErrors>(())
    /// ```
    pub fn feed_forward(&self) -> [f64; 3] {
        self.with_formulas().map(|(number, _)| number)
    }

    /// The same, with the formula of each that is from the plant.
    pub(crate) fn with_formulas(&self) -> [(f64, Option<&'static str>); 3] {
        let ahead = &self.options.law.feed_forward;
        let [velocity, acceleration, friction] = self.of_plant();
        [
            (ahead.velocity_s, velocity),
            (ahead.acceleration_s2, acceleration),
            (ahead.friction_codes, friction),
        ]
        .map(|(gain, (number, formula))| match gain {
            FeedForwardGain::Given(given) => (given, None),
            FeedForwardGain::Plant => (number, Some(formula)),
        })
    }

    fn of_plant(&self) -> [OfPlant; 3] {
        let (motor, gear) = (&self.axis.motor, &self.axis.transmission);
        let (z, p) = (gear.gear_ratio, gear.screw_pitch_m_per_rad);
        let (r, l) = (motor.resistance_ohm, motor.inductance_h);
        let kappa = motor.torque_constant_nm_per_a / z;
        let inertia = motor.inertia_kg_m2 / (z * z)
            + gear.screw_inertia_kg_m2
            + self.axis.carriage.mass_kg * p * p;
        let resistance = &self.axis.carriage.resistance;
        let linear = p * resistance.linear_ns_per_rad;
        // Without a direction a0 is a bias, which no sign gives.
        let dry = match resistance.opposes_motion {
            true => p * resistance.constant_n,
            false => 0.0,
        };
        let measures = self.options.law.derivative == Derivative::Measurement;
        let [velocity, acceleration, friction] = match self.amplifier.control {
            Control::Voltage { .. } => [
                (
                    kappa + r * linear / kappa,
                    match measures {
                        false => "(k_m/z + R·p·a1·z/k_m)·z/(K_enc·K_a·K_dac)",
                        true => "(k_m/z + R·p·a1·z/k_m)·z/(K_enc·K_a·K_dac) + K_d",
                    },
                ),
                (
                    (r * inertia + l * linear) / kappa,
                    "(R·J_eq + L·p·a1)·z²/(k_m·K_enc·K_a·K_dac)",
                ),
                (r * dry / kappa, "R·p·a0·z/(k_m·K_a·K_dac)"),
            ],
            Control::Current {
                bandwidth_radps, ..
            } => [
                (
                    linear / kappa,
                    match measures {
                        false => "p·a1·z²/(k_m·K_enc·K_a·K_dac)",
                        true => "p·a1·z²/(k_m·K_enc·K_a·K_dac) + K_d",
                    },
                ),
                match bandwidth_radps {
                    None => (inertia / kappa, "J_eq·z²/(k_m·K_enc·K_a·K_dac)"),
                    Some(omega) => (
                        (inertia + (linear + kappa * kappa / r) / omega) / kappa,
                        "(J_eq + (p·a1 + (k_m/z)²/R)/ω_c)·z²/(k_m·K_enc·K_a·K_dac)",
                    ),
                },
                (dry / kappa, "p·a0·z/(k_m·K_a·K_dac)"),
            ],
        };
        let per_count = z / self.output_per_rad();
        let per_code = 1.0 / (self.dac.step_v * self.amplifier.gain);
        let given_back = if measures {
            self.controller.gains.kd_s
        } else {
            0.0
        };
        [
            (velocity.0 * per_count + given_back, velocity.1),
            (acceleration.0 * per_count, acceleration.1),
            (friction.0 * per_code, friction.1),
        ]
    }
}

/// A friction from the plant that is none, where a0 is a constant bias.
pub(crate) fn bias_without_a_sign(case: &Case) -> Option<String> {
    let resistance = &case.axis.carriage.resistance;
    let asks = case.options.law.feed_forward.friction_codes == FeedForwardGain::Plant;
    let acts = asks && case.controller.law == Law::Firmware;
    (acts && resistance.constant_n != 0.0 && !resistance.opposes_motion).then(|| {
        "controller.friction_ff_codes = \"plant\" is 0: without carriage.resistance_opposes_motion \
         a0 pushes one way at all times, which no sign of the velocity gives"
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controllers::scaling_request;
    use crate::quantise::from_plant;
    use crate::remarks;
    use crate::report::parameters;
    use crate::run::{RunOptions, run};
    use crate::runfile::{self, KeyPath, Value};

    const KEYS: [&str; 3] = ["velocity_ff_s", "acceleration_ff_s2", "friction_ff_codes"];

    /// All three from the plant.
    const PLANT: &str = "controller.velocity_ff_s=plant controller.acceleration_ff_s2=plant \
        controller.friction_ff_codes=plant";

    /// A rigid axis with friction of both kinds, on steps so fine that they do not count.
    const RIGID: &str = "transmission.joint=rigid encoder.counts_per_rad=1e5 drive.dac_bits=24 \
        drive.dac_lsb_v=1e-5 controller.sample_time_s=1e-4 carriage.resistance_linear_ns_per_rad=2 \
        carriage.resistance_constant_n=100 carriage.resistance_opposes_motion=true";
    const VOLTAGE: &str = "controller.kp_v_per_rad=30 controller.ki_v_per_rad_s=0 \
        controller.kd_vs_per_rad=0.46";
    const CURRENT: &str = "drive.kind=current drive.amplifier_gain_a_per_v=1 \
        drive.current_limit_a=80 controller.kp_a_per_rad=20 controller.ki_a_per_rad_s=0 \
        controller.kd_as_per_rad=0.3";

    fn case(sets: &[&str]) -> Case {
        let sets = sets.iter().flat_map(|sets| sets.split_whitespace());
        let sets: Vec<String> = sets.map(str::to_owned).collect();
        runfile::builtin("paper-2", &sets).unwrap()
    }

    fn peak_um(sets: &[&str]) -> f64 {
        let outcome = run(&case(sets), RunOptions::default(), &mut |_| Ok(())).unwrap();
        let summary = outcome.summary;
        assert_eq!(summary.figure("voltage_saturated_s"), Some(0.0));
        1e3 * summary.peak_motor_following_error_mm
    }

    /// The word takes nearly all of the lag away, and a tenth more or less of any of the
    /// three makes it worse. Measured: 107 mm without and 1.3 µm with it under a voltage
    /// drive, 1.6 mm and 0.5 µm under an ideal current loop, 1.6 mm and 7.9 µm under one of
    /// 200 Hz. The voltage drive has little inductance: no key has the jerk's `L·J_eq/κ`.
    #[test]
    fn no_other_values_are_as_good() {
        let voltage = format!("{VOLTAGE} motor.inductance_h=1e-4");
        let slow = format!("{CURRENT} drive.current_bandwidth_hz=200");
        for drive in [&voltage, CURRENT, &slow] {
            for derivative in ["error", "measurement"] {
                let derivative = format!("controller.derivative={derivative}");
                let sets = [RIGID, drive, &derivative];
                let with = |more: &str| peak_um(&[&sets[..], &[PLANT, more]].concat());
                let (none, plant) = (peak_um(&sets), with(""));
                println!("{drive} {derivative}: {none:.0} without, {plant:.2} µm");
                assert!(100.0 * plant < none);
                let numbers = case(&[&sets[..], &[PLANT]].concat()).feed_forward();
                for (key, number) in KEYS.into_iter().zip(numbers) {
                    let off = [0.9, 1.1].map(|factor| {
                        let other = format!("controller.{key}={}", factor * number);
                        with(&other)
                    });
                    println!("  {key}: {off:.2?}");
                    assert!(off.iter().all(|other| *other > plant), "{key}");
                }
            }
        }
    }

    /// Computed by hand at the motor's shaft, `J_m + z²·(J_v + M·p²)`.
    #[test]
    fn the_numbers_are_those_of_the_equations() {
        let friction = "carriage.resistance_linear_ns_per_rad=2 carriage.resistance_constant_n=100 \
            carriage.resistance_opposes_motion=true";
        let slow = format!("{CURRENT} drive.current_bandwidth_hz=200");
        let of_current = [0.008_204_708_892_251_54, 0.004_802_881_069_637_234];
        for (sets, [velocity_s, acceleration_s2], friction_codes) in [
            (
                VOLTAGE,
                [0.030_952_201_509_396_895, 0.002_419_217_404_085_161_6],
                65.227_435_693_399_74,
            ),
            (CURRENT, of_current, 130.454_871_386_799_48),
            (
                &slow,
                [of_current[0], 0.004_852_143_028_335_203],
                130.454_871_386_799_48,
            ),
        ] {
            let found = case(&[sets, friction, PLANT]).feed_forward();
            for (found, wanted) in
                found
                    .into_iter()
                    .zip([velocity_s, acceleration_s2, friction_codes])
            {
                assert!(
                    (found - wanted).abs() < 1e-14 * wanted,
                    "{sets}: {found} {wanted}"
                );
            }
        }
    }

    /// What changes mass, drive or encoder gets the numbers of its own.
    #[test]
    fn a_case_keeps_the_word() {
        let key = KeyPath::find("controller.acceleration_ff_s2").unwrap().key;
        let own = case(&[PLANT]);
        assert_eq!(key.get(&own), Some(Value::Choice("plant")));
        for (set, change) in [
            (
                "carriage.mass_kg=100",
                (|c| c.axis.carriage.mass_kg = 100.0) as fn(&mut Case),
            ),
            ("drive.amplifier_gain=6", |c| c.amplifier.gain = 6.0),
            ("encoder.counts_per_rad=1272", |c| {
                c.encoder.counts_per_rad = 1272.0
            }),
        ] {
            let mut changed = own.clone();
            change(&mut changed);
            let numbers = changed.feed_forward();
            assert_ne!(numbers, own.feed_forward(), "{set}");
            assert_eq!(numbers, case(&[PLANT, set]).feed_forward(), "{set}");
            let gains = scaling_request(&changed).unwrap().gains;
            assert_eq!(gains[3..], numbers, "{set}");
        }
    }

    #[test]
    fn a_bias_is_no_friction() {
        let told = |sets: &str| {
            let case = case(&[PLANT, sets]);
            let mut remarks = remarks::of_case(&case);
            let told = remarks.any(|remark| remark.contains("friction_ff_codes"));
            (case.feed_forward()[2] == 0.0, told)
        };
        let bias = "carriage.resistance_constant_n=100";
        let friction = format!("{bias} carriage.resistance_opposes_motion=true");
        assert_eq!(told(bias), (true, true));
        assert_eq!(
            told(&format!("{bias} controller.law=quantised")),
            (true, false)
        );
        assert_eq!(told(""), (true, false));
        assert_eq!(told(&friction), (false, false));
    }

    /// A resistance that pushes on would ask for a gain below 0.
    #[test]
    fn a_gain_below_0_is_refused_with_its_number() {
        let pushing = case(&[PLANT, "carriage.resistance_linear_ns_per_rad=-20"]);
        let refused = scaling_request(&pushing).unwrap().scaled_law();
        assert_eq!(
            refused.unwrap_err().to_string(),
            "controller.velocity_ff_s = -0.014173697397986575: the plant makes it −0.014174; a gain \
             must be finite and at least 0"
        );
    }

    #[test]
    fn number_formula_and_fixed_point_are_shown() {
        let case = case(&[PLANT, "controller.derivative=measurement"]);
        let scaled = scaling_request(&case).unwrap().scaled_law().unwrap();
        assert_eq!(
            from_plant(&scaled.rows),
            "velocity_ff_s = 0.07685 from the plant: (k_m/z + R·p·a1·z/k_m)·z/(K_enc·K_a·K_dac) + K_d\n\
             acceleration_ff_s2 = 0.0024014 from the plant: (R·J_eq + L·p·a1)·z²/(k_m·K_enc·K_a·K_dac)\n\
             friction_ff_codes = 0 from the plant: R·p·a0·z/(k_m·K_a·K_dac)\n"
        );
        let shown: Vec<String> = parameters::of(&case)
            .into_iter()
            .chain(parameters::of_words(&scaled.fixed_point()))
            .filter(|row| row.value.contains("plant"))
            .map(|row| format!("{}: {} {}", row.label, row.value, row.unit))
            .collect();
        assert_eq!(shown.len(), 3 + 2);
        assert_eq!(
            shown[0],
            "Velocity feed-forward: from the plant: 0.07685 codes·s/count"
        );
        assert!(shown[3].starts_with("Kv/Δt in fixed point (rounding): "));
        assert!(shown[3].contains(&scaled.rows[3].word.to_string()));
    }
}
