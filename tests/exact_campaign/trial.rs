//! One random run on the exact solver, cut into samples that can be repeated.

use bench_tests::draw::Draw;
use bench_tests::random_case::{SAMPLE_TIMES_S, fastest_rate, random_case};
use bench_tests::solvers::exact;
use hil_core::case::{Case, Law};
use hil_core::controllers::{Controller, IoKind};
use hil_core::message::Measurement;
use plant::{AxisParameters, ContactChange, Drive, Joint, Plant, PlantError, Span, State, Watch};

/// Source of a sample's voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Excitation {
    /// The law's own codes.
    Law,
    /// Random steps, whatever the law says.
    Steps,
    /// Another random voltage each sample.
    Noise,
}

/// One sample of a run: what it starts from and what the exact solver made
/// of it.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    /// The plant at the start.
    pub(crate) before: Plant,
    /// Voltage still in force, and until when after the start \[ns\].
    pub(crate) old: (f64, u64),
    /// Voltage from then on, and until when after the start \[ns\].
    pub(crate) new: (f64, u64),
    /// Contact changes of the exact solver.
    pub(crate) changes: Vec<ContactChange>,
    /// The plant at the end.
    pub(crate) after: Plant,
    /// The law at the end, before it sees the position there.
    pub(crate) law: Controller,
    /// Number of the sample that comes next.
    pub(crate) next_tick: u64,
}

impl Sample {
    /// Takes `plant`, which stands at the start of the sample, to its end.
    pub(crate) fn advance(
        &self,
        plant: &mut Plant,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let start_ns = plant.time_ns();
        for (voltage_v, until_ns) in [self.old, self.new] {
            plant.advance(&Drive::Held(voltage_v), start_ns + until_ns, watch)?;
        }
        Ok(())
    }
}

/// A run in samples.
#[derive(Debug)]
pub(crate) struct Trial {
    /// Axis, law and parts.
    pub(crate) case: Case,
    /// Source of the voltages.
    pub(crate) excitation: Excitation,
    /// The samples in order.
    pub(crate) samples: Vec<Sample>,
    /// Range of every component over the run.
    pub(crate) ranges: [f64; 5],
}

/// Collects contact changes and the range of every component: at the ends of
/// the samples and at the changes between them, where speeds are highest.
#[derive(Debug)]
struct Observer {
    changes: Vec<ContactChange>,
    low: [f64; 5],
    high: [f64; 5],
}

impl Observer {
    fn new() -> Self {
        Self {
            changes: Vec::new(),
            low: [f64::INFINITY; 5],
            high: [f64::NEG_INFINITY; 5],
        }
    }
}

impl Watch for Observer {
    fn span(&mut self, span: &Span<'_>) {
        for state in [span.state_at(0.0), span.state_at(1.0)] {
            for (i, value) in components(&state).into_iter().enumerate() {
                self.low[i] = self.low[i].min(value);
                self.high[i] = self.high[i].max(value);
            }
        }
    }

    fn contact_change(&mut self, change: &ContactChange) {
        self.changes.push(*change);
    }
}

/// The components of a state that have an equation of motion.
pub(crate) fn components(state: &State) -> [f64; 5] {
    [
        state.gamma_rad(),
        state.gamma_dot_radps(),
        state.epsilon_rad,
        state.epsilon_dot_radps,
        state.current_a,
    ]
}

impl Trial {
    /// The random run of a seed, on a plant that `spoil` may have changed
    /// behind the reference's back.
    ///
    /// # Errors
    /// The error with which the exact solver gave up.
    pub(crate) fn run(seed: u64, spoil: fn(&mut AxisParameters)) -> Result<Self, PlantError> {
        let draw = &mut Draw::new(seed);
        let laws = [Law::Sampled, Law::Quantised, Law::Firmware];
        let case = random_case(draw, &laws, SAMPLE_TIMES_S);
        let mut axis = case.axis;
        spoil(&mut axis);
        let start = random_start(draw, &case);
        let mut plant = Plant::with_state(&axis, exact(), &start);
        let excitation = match draw.unit() {
            u if u < 0.6 => Excitation::Law,
            u if u < 0.8 => Excitation::Steps,
            _ => Excitation::Noise,
        };
        let mut law = controller(&case);
        let (period_ns, delay_ns) = timing(&case);
        let (mut in_force, mut applied_v) = (0.0, 0.0);
        let (mut samples, mut observer) = (Vec::new(), Observer::new());
        for tick in 0..case.run.duration_ns / period_ns {
            let code = law.step(Measurement::new(&case, tick, &plant.state()));
            let code = code.dac_code.real();
            applied_v = match excitation {
                Excitation::Law => case.amplifier.command(case.dac.output_v(code)),
                Excitation::Steps if draw.chance(0.9) && tick > 0 => applied_v,
                _ => case.amplifier.voltage_limit_v * draw.between(-1.0, 1.0),
            };
            let mut sample = Sample {
                before: plant.clone(),
                old: (in_force, delay_ns),
                new: (applied_v, period_ns),
                changes: Vec::new(),
                after: plant.clone(),
                law: law.clone(),
                next_tick: tick + 1,
            };
            sample.advance(&mut plant, &mut observer)?;
            sample.changes = core::mem::take(&mut observer.changes);
            sample.after = plant.clone();
            samples.push(sample);
            in_force = applied_v;
        }
        Ok(Self {
            case,
            excitation,
            samples,
            ranges: core::array::from_fn(|i| observer.high[i] - observer.low[i]),
        })
    }
}

fn controller(case: &Case) -> Controller {
    match Controller::new(case, IoKind::Direct) {
        Ok(Some(law)) => law,
        other => panic!("{other:?}"),
    }
}

fn timing(case: &Case) -> (u64, u64) {
    let period_ns = case.controller.sample_time_ns.unwrap_or(1_000_000);
    let delay = case.controller.computation_delay;
    (period_ns, delay.fixed_ns().unwrap_or(0))
}

/// Somewhere on its way, so that flanks meet within the run however short it
/// is; a third of the runs begin at rest. The encoder stands between two
/// counts, not on one, as real encoders do.
fn random_start(draw: &mut Draw, case: &Case) -> State {
    let transmission = &case.axis.transmission;
    let offset_counts = draw.between(-20.0, 20.0);
    let gamma_rad = transmission.gear_ratio * offset_counts / case.encoder.counts_per_rad;
    let mut start = State {
        beta_rad: gamma_rad,
        ..State::default()
    };
    if draw.chance(0.33) {
        return start;
    }
    start.current_a = draw.sign() * draw.decades(1e-2, 20.0);
    if draw.chance(0.7) {
        start.beta_dot_radps = draw.sign() * draw.decades(1e-3, 100.0);
    }
    let Joint::Elastic(joint) = transmission.joint else {
        return start;
    };
    let (flank, speed) = (draw.sign(), draw.decades(1e-3, 30.0));
    let (b, inside) = (joint.backlash_half_rad, draw.chance(0.75));
    let relaxation_s = joint.damping_nms_per_rad / joint.stiffness_nm_per_rad;
    if b > 0.0 && joint.no_pull && relaxation_s > 0.0 && draw.chance(0.3) {
        // Let go, and driven back into the flank before the gap opens.
        let slow = draw.decades(1e-4, 0.1);
        start.epsilon_rad = flank * (b + slow * relaxation_s * draw.between(0.3, 0.99));
        start.epsilon_dot_radps = -flank * slow;
        start.current_a = flank * start.current_a.abs();
    } else if inside && b > 0.0 {
        // On its way to the flank, there within the run.
        let way = speed * case.run.duration_ns as f64 * 1e-9 * draw.unit();
        start.epsilon_rad = flank * (b - way.min(2.0 * b));
        start.epsilon_dot_radps = flank * speed;
    } else {
        start.epsilon_rad = flank * (b + speed / fastest_rate(&case.axis));
        start.epsilon_dot_radps = draw.sign() * speed;
    }
    // So far β was γ.
    start.beta_rad += start.epsilon_rad;
    start.beta_dot_radps += start.epsilon_dot_radps;
    start
}
