//! The linear loop as matrices of its own: the equations of motion written down again, their
//! exponential whole, and the controller's difference equations one by one, as a
//! simulation makes them.

use std::f64::consts::{PI, TAU};

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, SMatrix, SVector, Schur};
use plant::{Amplifier, AxisParameters, Control, Joint};

use super::super::characteristic::{Characteristic, LoopGains};
use super::super::linear_axis::{JointState, LinearAxis, Shaft};
use super::Draw;

/// β, β̇, γ, γ̇, I and q; what an axis does not have decays by itself.
const STATES: usize = 6;
/// With the code that is held, and a force on the carriage as cosine and sine.
const HELD: usize = STATES + 3;
/// With what the controller remembers: the last code, S, v and the last α.
const ALL: usize = STATES + 4;
type Smooth = SMatrix<f64, HELD, HELD>;

/// `e^A`, by its series for a part of A and squaring.
fn exponential(a: &Smooth) -> Smooth {
    let norm = a
        .column_iter()
        .map(|column| column.abs().sum())
        .fold(0.0, f64::max);
    let halvings = (norm.max(1e-3).log2() + 3.0).max(0.0).ceil() as i32;
    let part = a * 0.5_f64.powi(halvings);
    let (mut term, mut sum) = (Smooth::identity(), Smooth::identity());
    for n in 1..20 {
        term = term * part / f64::from(n);
        sum += term;
    }
    for _ in 0..halvings {
        sum *= sum;
    }
    sum
}

/// A linear loop and its timing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Loop {
    pub(super) axis: AxisParameters,
    pub(super) amplifier: Amplifier,
    pub(super) joint: JointState,
    pub(super) dual: bool,
    pub(super) gains: LoopGains,
    pub(super) period_s: f64,
    pub(super) delay_s: f64,
}

impl Loop {
    /// A random one; of ten, five with a filter, three with two encoders.
    pub(super) fn draw(draw: &mut Draw, trial: usize, period_s: f64) -> Self {
        let mut axis = draw.axis();
        if trial.is_multiple_of(7) {
            axis.transmission.joint = Joint::Rigid;
        }
        let gap = trial % 10 == 9 && !trial.is_multiple_of(7);
        let mut gains = draw.gains();
        if trial.is_multiple_of(2) {
            gains.smoothing = period_s / (period_s + period_s * draw.decades(0.1, 100.0));
        }
        Self {
            axis,
            amplifier: draw.amplifier(trial / 3 % 3),
            joint: match gap {
                true => JointState::Gap,
                false => JointState::Contact,
            },
            dual: !gap && trial % 10 < 3,
            gains,
            period_s,
            delay_s: period_s * [0.0, 1.0, draw.uniform()][trial % 3],
        }
    }

    /// The axis of the theory.
    pub(super) fn linear(&self) -> LinearAxis {
        let mut axis = LinearAxis::new(&self.axis, &self.amplifier, self.joint).unwrap();
        if self.dual && axis.has_joint() {
            axis.position_of = Shaft::Screw;
        }
        axis
    }

    /// The equations of motion, u held and a force on the carriage of ω.
    fn system(&self, radps: f64) -> Smooth {
        let (motor, transmission) = (&self.axis.motor, &self.axis.transmission);
        let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
        let (j1, km) = (
            motor.inertia_kg_m2 / (z * z),
            motor.torque_constant_nm_per_a / z,
        );
        let j2 = transmission.screw_inertia_kg_m2 + self.axis.carriage.mass_kg * p * p;
        let drag = p * self.axis.carriage.resistance.linear_ns_per_rad;
        let (r, l) = (motor.resistance_ohm, motor.inductance_h);
        let mut a = -Smooth::identity();
        let (beta, gamma, current, memory, code, cos, sin) = (0, 2, 4, 5, 6, 7, 8);
        for held in [code, cos, sin] {
            a[(held, held)] = 0.0;
        }
        a[(cos, sin)] = -radps;
        a[(sin, cos)] = radps;
        let mut moves = |body: usize, terms: &[(usize, f64)]| {
            a.row_mut(body).fill(0.0);
            a.row_mut(body + 1).fill(0.0);
            a[(body, body + 1)] = 1.0;
            for (state, factor) in terms {
                a[(body + 1, *state)] += factor;
            }
        };
        let ideal = matches!(
            self.amplifier.control,
            Control::Current {
                bandwidth_radps: None,
                ..
            }
        );
        let drive = match ideal {
            true => code,
            false => current,
        };
        match (self.joint, transmission.joint) {
            (JointState::Gap, _) => moves(beta, &[(drive, km / j1)]),
            (JointState::Contact, Joint::Rigid) => {
                let j = j1 + j2;
                moves(
                    beta,
                    &[(drive, km / j), (beta + 1, -drag / j), (cos, -p / j)],
                );
            }
            (JointState::Contact, Joint::Elastic(joint)) => {
                let k = joint.stiffness_nm_per_rad;
                // As the theory counts it with a current drive.
                let least = match self.amplifier.control {
                    Control::Current { .. } => 1e-6 * (k * j2).sqrt(),
                    Control::Voltage { .. } => 0.0,
                };
                let c = joint.damping_nms_per_rad.max(least);
                let joint = |j: f64| {
                    let (k, c) = (k / j, c / j);
                    [(beta, -k), (beta + 1, -c), (gamma, k), (gamma + 1, c)]
                };
                moves(beta, &[&joint(j1)[..], &[(drive, km / j1)]].concat());
                let screw = [(gamma + 1, -drag / j2), (cos, -p / j2)];
                moves(gamma, &[&joint(-j2)[..], &screw].concat());
            }
        }
        if !ideal {
            a.row_mut(current).fill(0.0);
            a[(current, beta + 1)] = -km / l;
            a[(current, current)] = -r / l;
        }
        match self.amplifier.control {
            Control::Current {
                bandwidth_radps: Some(omega),
                ..
            } => {
                // V = L·ω_c·(i_cmd − I) + R·ω_c·q, and q̇ = i_cmd − I
                a[(current, code)] = omega;
                a[(current, current)] -= omega;
                a[(current, memory)] = omega * r / l;
                a.row_mut(memory).fill(0.0);
                a[(memory, code)] = 1.0;
                a[(memory, current)] = -1.0;
            }
            Control::Voltage { .. } => a[(current, code)] = 1.0 / l,
            Control::Current { .. } => {}
        }
        a
    }

    /// The position that K_p and K_i see, in radians of the motor.
    fn position(&self, x: &SVector<f64, HELD>) -> f64 {
        let elastic = self.axis.transmission.joint != Joint::Rigid;
        let shaft = if self.dual && elastic { x[2] } else { x[0] };
        shaft / self.axis.transmission.gear_ratio
    }

    /// The controller at a sample, with `added` on its code: the code that leaves it, and
    /// its own.
    fn control(&self, x: &SVector<f64, HELD>, memory: &mut [f64; 4], added: f64) -> f64 {
        let [last, sum, rate, angle] = memory;
        let g = &self.gains;
        let error = -self.position(x);
        let alpha = x[0] / self.axis.transmission.gear_ratio;
        // S ← S + T·e; one that drives nothing stands.
        if g.ki_v_per_rads != 0.0 {
            *sum += self.period_s * error;
        }
        // v ← v + a·(x − v), x = −(α − α_prev)
        *rate += g.smoothing * (-(alpha - *angle) - *rate);
        *angle = alpha;
        let own = g.kp_v_per_rad * error
            + g.ki_v_per_rads * *sum
            + g.kd_vs_per_rad / self.period_s * *rate;
        *last = own + added;
        own
    }

    /// The axis over the delay, and over the rest of a sample, without a force.
    fn held(&self) -> [Smooth; 2] {
        let a = self.system(0.0);
        [self.delay_s, self.period_s - self.delay_s].map(|held_s| exponential(&(a * held_s)))
    }

    /// A sample with `added` on its code; the code of the law itself.
    fn sample(
        &self,
        [late, rest]: &[Smooth; 2],
        x: &mut SVector<f64, HELD>,
        memory: &mut [f64; 4],
        added: f64,
    ) -> f64 {
        let last = memory[0];
        let own = self.control(x, memory, added);
        x[STATES] = last;
        *x = late * *x;
        x[STATES] = memory[0];
        *x = rest * *x;
        own
    }

    /// Transition from sample to sample without a force.
    fn transition(&self) -> SMatrix<f64, ALL, ALL> {
        let held = self.held();
        let mut transition = SMatrix::zeros();
        for column in 0..ALL {
            let mut x = SVector::<f64, HELD>::zeros();
            let mut memory = [0.0; 4];
            match column {
                0..STATES => x[column] = 1.0,
                _ => memory[column - STATES] = 1.0,
            }
            self.sample(&held, &mut x, &mut memory, 0.0);
            for row in 0..STATES {
                transition[(row, column)] = x[row];
            }
            for row in STATES..ALL {
                transition[(row, column)] = memory[row - STATES];
            }
        }
        transition
    }

    /// Largest magnitude of the closed loop's poles; none where the QR iteration, which has no
    /// bound of its own in `complex_eigenvalues`, does not end.
    pub(super) fn radius(&self) -> Option<f64> {
        let mut transition = self.transition();
        if self.gains.ki_v_per_rads == 0.0 {
            transition[(STATES + 1, STATES + 1)] = 0.0;
        }
        for state in 0..STATES {
            // What the axis does not have moves nothing but itself.
            let own = transition[(state, state)];
            if transition.row(state).abs().sum() == own.abs() {
                transition[(state, state)] = 0.0;
            }
        }
        balance_parlett_reinsch(&mut transition);
        let schur = Schur::try_new(transition, f64::EPSILON, 1000)?;
        let poles = schur.complex_eigenvalues();
        let sizes = poles.iter().map(|z| z.norm_sqr().sqrt());
        Some(sizes.fold(0.0, f64::max))
    }

    /// `L(e^{jθ})` from the steady state under a sine on the code: the codes of the law
    /// itself against those that leave it. θ is `turns` turns in `samples`, a whole number
    /// of both.
    pub(super) fn measured(&self, turns: u32, samples: u32, settle: u32) -> Complex<f64> {
        let held = self.held();
        let (mut x, mut memory) = (SVector::<f64, HELD>::zeros(), [0.0; 4]);
        let (mut own, mut left) = (Complex::from(0.0), Complex::from(0.0));
        let settle = settle.next_multiple_of(samples);
        for k in 0..settle + samples {
            let phi = TAU * f64::from(turns * (k % samples) % samples) / f64::from(samples);
            let law = self.sample(&held, &mut x, &mut memory, phi.cos());
            if k >= settle {
                let turn = Complex::new(phi.cos(), -phi.sin());
                own += turn * law;
                left += turn * memory[0];
            }
        }
        -own / left
    }

    /// `F/x` of the fundamental \[N/m\], from the steady state under a force that is a
    /// cosine, at `fine` places of every sample.
    pub(super) fn measured_stiffness(
        &self,
        turns: u32,
        samples: u32,
        settle: u32,
        fine: u32,
    ) -> Complex<f64> {
        let theta = TAU * f64::from(turns) / f64::from(samples);
        let a = self.system(theta / self.period_s);
        // The new code comes at one of the places, so that a sample is cut by the delay.
        let step_s = self.period_s / f64::from(fine);
        let step = exponential(&(a * step_s));
        let late = (self.delay_s / step_s).round() as u32;
        let (mut x, mut memory) = (SVector::<f64, HELD>::zeros(), [0.0; 4]);
        x[STATES + 1] = 1.0;
        let mut sum = Complex::from(0.0);
        let settle = settle.next_multiple_of(samples);
        for k in 0..settle + samples {
            let last = memory[0];
            self.control(&x, &mut memory, 0.0);
            for place in 0..fine {
                x[STATES] = if place < late { last } else { memory[0] };
                if k >= settle {
                    let at = u64::from(turns) * u64::from((k % samples) * fine + place);
                    let phi = TAU * at as f64 / f64::from(samples * fine);
                    let screw = match self.axis.transmission.joint {
                        Joint::Rigid => x[0],
                        Joint::Elastic(_) => x[2],
                    };
                    sum += Complex::new(phi.cos(), -phi.sin()) * screw;
                }
                x = step * x;
            }
            // The force anew, without what rounding has gathered.
            let phi = TAU * f64::from(turns * ((k + 1) % samples) % samples) / f64::from(samples);
            (x[STATES + 1], x[STATES + 2]) = (phi.cos(), phi.sin());
        }
        let p = self.axis.transmission.screw_pitch_m_per_rad;
        let x_m = sum * (2.0 * p / f64::from(samples * fine));
        // F = 1 N as the theory counts it, against positive x.
        x_m.inv()
    }
}

/// Samples after which what decays by `radius` a sample is below 1e-12.
pub(super) fn settling(radius: f64) -> u32 {
    (1e-12_f64.ln() / radius.ln()).ceil() as u32
}

/// Routh's scheme with filter, two encoders and every drive against the eigenvalues of the
/// simulation's matrix.
#[test]
fn stability_with_options_agrees_with_the_matrix() {
    let mut draw = Draw::new(21);
    let (mut counts, mut odd, mut without) = ([0_u32; 2], Vec::new(), [0_u32; 2]);
    let (mut unknown, mut gaps) = (0, 0);
    for trial in 0..32_000 {
        let period_s = draw.decades(1e-6, 1e-2);
        let case = Loop::draw(&mut draw, trial, period_s);
        let axis = case.linear();
        let stable = |axis: &LinearAxis, gains: &LoopGains| {
            Characteristic::new(axis, period_s, case.delay_s).is_stable(gains)
        };
        let found = stable(&axis, &case.gains);
        let Some(radius) = case.radius() else {
            unknown += 1;
            continue;
        };
        if found != (radius < 1.0) {
            odd.push((radius - 1.0, trial));
        }
        counts[usize::from(found)] += 1;
        gaps += u32::from(case.joint == JointState::Gap);
        // What the option is worth: the loop without it.
        let mut unfiltered = case.gains;
        unfiltered.smoothing = 1.0;
        without[0] += u32::from(stable(&axis, &unfiltered) != found);
        let mut motor = axis;
        motor.position_of = Shaft::Motor;
        without[1] += u32::from(stable(&motor, &case.gains) != found);
    }
    assert!(unknown < 40, "{unknown}");
    println!(
        "{unknown} unknown; unstable, stable: {counts:?}, {gaps} in the gap; odd {odd:?}; other without filter, screw {without:?}"
    );
    assert!(odd.iter().all(|(off, _)| off.abs() < 1e-9), "{odd:?}");
    assert!(counts.iter().all(|&n| n > 6400), "{counts:?}");
    assert!(without.iter().all(|&n| n > 160), "{without:?}");
    assert!(gaps > 2500, "{gaps}");
}

/// L against the steady state of a simulated sine, and the loops without filter or screw,
/// which are others.
#[test]
fn the_response_is_that_of_a_simulated_sine() {
    let mut draw = Draw::new(22);
    let (mut worst, mut loops) = (0.0_f64, 0);
    // Least difference of the loops without the option: a filter, two encoders.
    let mut without = [f64::INFINITY; 2];
    for trial in 0..2000 {
        let period_s = draw.decades(1e-4, 1e-2);
        let case = Loop::draw(&mut draw, trial, period_s);
        let Some(radius) = case.radius().filter(|radius| *radius < 0.999) else {
            continue;
        };
        let samples = 7 + (draw.uniform() * 60.0) as u32;
        let turns = 1 + (draw.uniform() * f64::from(samples / 2 - 1)) as u32;
        let theta = TAU * f64::from(turns) / f64::from(samples);
        assert!(theta < PI);
        let measured = case.measured(turns, samples, settling(radius));
        let off = |axis: &LinearAxis, gains: &LoopGains| {
            let l = Characteristic::new(axis, period_s, case.delay_s).at(gains, theta);
            ((l - measured) / measured).norm_sqr().sqrt()
        };
        let axis = case.linear();
        worst = worst.max(off(&axis, &case.gains));
        loops += 1;
        if case.gains.smoothing < 1.0 && case.gains.kd_vs_per_rad > 0.0 {
            let mut gains = case.gains;
            gains.smoothing = 1.0;
            without[0] = without[0].min(off(&axis, &gains));
        }
        if axis.position_of == Shaft::Screw {
            let mut motor = axis;
            motor.position_of = Shaft::Motor;
            without[1] = without[1].min(off(&motor, &case.gains));
        }
    }
    println!("{loops} loops within {worst:.1e}; without filter, screw at least {without:?}");
    assert!(loops > 15, "{loops}");
    assert!(worst < 1e-7, "{worst}");
    assert!(without.iter().all(|least| *least > 100.0 * worst));
}
