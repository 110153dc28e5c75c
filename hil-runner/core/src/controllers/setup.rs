//! From a case in SI units to the firmware's axis: law, output, encoders, monitors
//! and setpoints.

use firmware::axis::{Axis, AxisState, Feedback as AxisFeedback, Monitors, Rest};
use firmware::law::Law;
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::motion::MotionPlan;
use firmware::output::{Output, Quantiser};
use firmware::position::CounterParameters;
use firmware::{Dac, Event};
use plant::Encoder;

use super::setpoint::{LastTable, Setpoint};
use super::world::{Generator, Source, Supply};
use crate::case::Case;
use crate::message::whole;
use crate::options::{self, Compensation, Feedback, RestIntegrator, SetpointOrigin};
use crate::quantise::{PARTS, QuantiseError, finest_word, key};
use crate::runfile::motion_key;
use crate::scaling::{
    FOLLOWING_ERROR, FOLLOWING_ERROR_PER_SPEED, RateBits, ScaledLaw, ScalingRequest,
};

/// Key of the largest change of the output.
const SLEW_LIMIT: &str = "controller.slew_limit_codes_per_s";

/// Requests to the axis before its first sample.
pub const FROM_REST: [Event; 2] = [Event::Enable, Event::Start];

/// The memory of an axis before its first sample, enabled and started.
pub(super) fn started(axis: &Axis) -> AxisState {
    let mut state = AxisState::start(axis);
    // From rest the table has no refusal.
    for event in FROM_REST {
        let _ = state.request(event);
    }
    state
}

/// A case, on its way to the parts of an axis.
#[derive(Debug)]
pub struct Setup<'a> {
    pub(super) case: &'a Case,
    pub(super) period_ns: u64,
    pub(super) setpoint: Setpoint,
    /// The encoder at the load, where the position comes from it.
    load: Option<Encoder>,
    plan: Option<MotionPlan>,
    /// Fractions of the rates that come with the setpoints; none where these are positions.
    rates: Option<RateBits>,
}

impl<'a> Setup<'a> {
    /// The settings of `case` at a sample time of `period_ns`.
    ///
    /// # Errors
    /// [`QuantiseError`] if the motion cannot be generated.
    pub fn of(case: &'a Case, period_ns: u64) -> Result<Self, QuantiseError> {
        let load = case.options.encoders.load;
        let load = load.filter(|_| case.options.law.feedback == Feedback::Dual);
        let setpoint = match load {
            Some(load) => Setpoint::of_load(case, period_ns, load),
            None => Setpoint::new(case, period_ns),
        };
        let travel_counts = case.motion.largest_displacement_m() * setpoint.counts_per_m();
        if travel_counts.abs() >= 2_147_483_648.0 {
            let because = format!(
                "it makes {} encoder counts; a travel must be shorter than 2^31 = 2147483648",
                travel_counts.round()
            );
            let travel_mm = case.motion.largest_displacement_m() * 1e3;
            let key = motion_key(&case.motion);
            return Err(QuantiseError::setting(key, travel_mm, because));
        }
        let plan = match case.options.law.setpoints {
            SetpointOrigin::Table => None,
            // What no plan makes, the queue has from a table.
            SetpointOrigin::Queue if case.motion.intervals_s().is_none() => None,
            _ => Some(plan(case, period_ns, &setpoint)?),
        };
        let rates = match &plan {
            Some(plan) => Some(RateBits {
                velocity: plan.head().velocity_fraction_bits,
                acceleration: plan.head().acceleration_fraction_bits,
            }),
            None if reads_rates(case) => Some(setpoint.rate_bits()?),
            None => None,
        };
        Ok(Self {
            case,
            period_ns,
            setpoint,
            load,
            plan,
            rates,
        })
    }

    /// The axis without anything that acts on the reference: the one that a
    /// measurement of the gap runs on.
    pub(super) fn axis(&self, law: Law) -> Result<Axis, QuantiseError> {
        let settings = &self.case.options;
        let dac = Dac::with_bits(self.case.dac.bits)?;
        let slew_limit = settings.law.slew_limit_codes_per_s.unwrap_or(0.0);
        let output = Output::new(dac, self.slew()?, self.quantiser())
            .map_err(QuantiseError::of(SLEW_LIMIT, slew_limit))?;
        let bits = u8::try_from(settings.encoders.counter_bits).unwrap_or(u8::MAX);
        let counter = |jump| {
            let value = f64::from(settings.limits.count_jump_counts.unwrap_or(0));
            CounterParameters::accept(bits, jump)
                .map_err(QuantiseError::of("limits.count_jump_counts", value))
        };
        let mut axis = Axis::new(law, output);
        axis.counter = counter(settings.limits.count_jump_counts)?;
        axis.feedback = match settings.law.feedback {
            Feedback::Motor => AxisFeedback::Motor,
            // A jump of the motor is one of the load by as many counts.
            Feedback::Dual => {
                let per_count = 1.0 / self.motor_counts_per_count();
                let jump = settings.limits.count_jump_counts.map(|counts| {
                    let counts = (f64::from(counts) * per_count).ceil();
                    // Saturates; what the counter cannot tell is refused.
                    counts.max(1.0) as u32
                });
                AxisFeedback::Load(counter(jump)?)
            }
        };
        axis.rest = Rest {
            dead_band: settings.law.rest_dead_band_counts,
            hold_integral: settings.law.rest_integrator == RestIntegrator::Hold,
        };
        axis.monitors = self.monitors()?;
        Ok(axis)
    }

    /// The law from the start.
    ///
    /// # Errors
    /// [`QuantiseError`] if a gain has no fixed-point form.
    pub fn law(&self) -> Result<ScaledLaw, QuantiseError> {
        self.request().scaled_law()
    }

    /// The law from the gain change on.
    ///
    /// # Errors
    /// As [`Self::law`].
    pub fn next_law(&self) -> Result<Option<Law>, QuantiseError> {
        let Some(change) = self.case.options.gain_change else {
            return Ok(None);
        };
        let changes = [
            ("gain_change.kp", change.kp),
            ("gain_change.ki_per_s", change.ki_per_s),
            ("gain_change.kd_s", change.kd_s),
        ];
        let mut request = self.request();
        for (gain, (_, change)) in request.gains.iter_mut().zip(changes) {
            *gain = change.unwrap_or(*gain);
        }
        let words = request.scaled_law().map_err(|error| match error {
            // The gains that change have keys of their own.
            QuantiseError::Gains(mut unfit) => {
                for (part, (own, change)) in PARTS.into_iter().zip(changes) {
                    let mut unfit = unfit.iter_mut().filter(|gain| gain.key == key(part));
                    if let (Some(gain), Some(_)) = (unfit.next(), change) {
                        gain.key = own;
                    }
                }
                QuantiseError::Gains(unfit)
            }
            // The gains before it have been accepted with this setting.
            QuantiseError::Setting {
                key,
                value,
                because,
            } => QuantiseError::setting(key, value, format!("from the gain change on, {because}")),
            error => error,
        })?;
        Ok(Some(words.law))
    }

    /// Everything that the fixed-point gains depend on.
    pub(super) fn request(&self) -> ScalingRequest {
        let (gains, settings) = (&self.case.controller.gains, self.case.options.law);
        let [velocity, acceleration, friction] = self.case.with_formulas();
        ScalingRequest {
            settings,
            gains: [
                gains.kp,
                gains.ki_per_s,
                gains.kd_s,
                velocity.0,
                acceleration.0,
                friction.0,
            ],
            from_plant: [None, None, None, velocity.1, acceleration.1, friction.1],
            sample_time_ns: self.period_ns,
            following_error: self.case.options.limits.following_error,
            peak_speed_counts_per_s: self.setpoint.peak_mps() * self.setpoint.counts_per_m(),
            motor_counts_per_count: self.motor_counts_per_count(),
            dac_bits: self.case.dac.bits,
            rates: self.rates(),
        }
    }

    /// The setpoints of the run, with the feed-forward of the law.
    pub fn source(&self, law: &Law) -> Source {
        self.source_with(law, &mut LastTable::default())
    }

    /// The same, from the last table if that is theirs.
    pub(super) fn source_with(&self, law: &Law, last: &mut LastTable) -> Source {
        let generator = self.plan.as_ref().map(|plan| Generator::new(plan, law));
        let mut table = || last.of(&self.setpoint, self.rates);
        match (self.case.options.law.setpoints, generator) {
            (SetpointOrigin::Generator, Some(generator)) => Source::Generator(Box::new(generator)),
            (SetpointOrigin::Queue, Some(generator)) => {
                Source::queue(Supply::of_stretches(generator, self.rates().velocity))
            }
            (SetpointOrigin::Queue, None) => Source::queue(Supply::Table(table())),
            _ => Source::Table(table()),
        }
    }

    /// `ρ`: motor counts per count of the position's encoder.
    fn motor_counts_per_count(&self) -> f64 {
        self.load
            .map_or(1.0, |load| self.motor_counts_per_load_count(load))
    }

    /// A half gap \[rad\], or the joint's own, at the motor \[counts\]: `K_enc·b/z`.
    pub(super) fn half_gap_counts(&self, half_rad: Option<f64>) -> f64 {
        let transmission = &self.case.axis.transmission;
        let half_rad = half_rad.unwrap_or(transmission.joint.backlash_half_rad());
        self.case.encoder.counts_per_rad * half_rad / transmission.gear_ratio
    }

    /// Motor counts per count of the load's encoder, `K_enc/(z·K_load)`.
    pub(super) fn motor_counts_per_load_count(&self, load: Encoder) -> f64 {
        let z = self.case.axis.transmission.gear_ratio;
        self.case.encoder.counts_per_rad / (z * load.counts_per_rad)
    }

    fn rates(&self) -> RateBits {
        self.rates.unwrap_or_default()
    }

    fn quantiser(&self) -> Quantiser {
        let settings = &self.case.options.law;
        match settings.quantiser {
            options::Quantiser::Nearest => Quantiser::Nearest,
            options::Quantiser::ErrorFeedback => Quantiser::ErrorFeedback,
            options::Quantiser::Dither => Quantiser::Dither {
                seed: settings.dither_seed,
            },
        }
    }

    /// Whole codes per sample, rounded down; none that is wider than any
    /// converter limits nothing.
    fn slew(&self) -> Result<Option<u32>, QuantiseError> {
        let Some(codes_per_s) = self.case.options.law.slew_limit_codes_per_s else {
            return Ok(None);
        };
        let codes = (codes_per_s * self.period_ns as f64 / 1e9).floor();
        if codes < 1.0 {
            let least = 1e9 / self.period_ns as f64;
            let because = format!(
                "it must be at least one code per sample, {least} codes/s at this sample time"
            );
            return Err(QuantiseError::setting(SLEW_LIMIT, codes_per_s, because));
        }
        Ok((codes < f64::from(1 << 24)).then_some(whole(codes).unsigned_abs() as u32))
    }

    /// The monitors of the supervision, in samples and counts.
    fn monitors(&self) -> Result<Monitors, QuantiseError> {
        let limits = &self.case.options.limits;
        let rates = self.rates();
        let ticks =
            |time_ns: u64| u32::try_from(time_ns.div_ceil(self.period_ns)).unwrap_or(u32::MAX);
        let following_error = limits.following_error.map(|limit| {
            // Samples of lag: counts per (count per sample).
            let lag = limit.per_speed_s * 1e9 / self.period_ns as f64;
            if lag >= f64::from(1 << 30) {
                let key = FOLLOWING_ERROR_PER_SPEED;
                let because = "it must be below 2^30 sample times";
                return Err(QuantiseError::setting(key, limit.per_speed_s, because));
            }
            let (word, counts) = (finest_word(lag, 32, 31), limit.counts);
            FollowingErrorMonitor::accept(counts, word, rates.velocity)
                .map_err(QuantiseError::of(FOLLOWING_ERROR, f64::from(counts)))
        });
        let encoder_loss = limits.encoder_loss.map(|loss| {
            let refused = QuantiseError::of("limits.encoder_loss_codes", f64::from(loss.codes));
            EncoderLossMonitor::accept(loss.codes, ticks(loss.after_ns)).map_err(refused)
        });
        let saturation = limits.saturation_ns.map(|after_ns| {
            let refused = QuantiseError::of("limits.saturation_s", after_ns as f64 / 1e9);
            SaturationMonitor::accept(ticks(after_ns)).map_err(refused)
        });
        Ok(Monitors {
            following_error: following_error.transpose()?,
            encoder_loss: encoder_loss.transpose()?,
            saturation: saturation.transpose()?,
            ticks: limits.missed_ticks.then_some(TickMonitor),
        })
    }
}

/// True of an axis that asks for more of a setpoint than its position.
fn reads_rates(case: &Case) -> bool {
    let options = &case.options;
    let lag = options.limits.following_error;
    case.feed_forward().iter().any(|gain| *gain > 0.0)
        || lag.is_some_and(|limit| limit.per_speed_s > 0.0)
        || options.backlash.compensation != Compensation::None
}

/// The plan of the motion for the firmware's generator.
fn plan(case: &Case, period_ns: u64, setpoint: &Setpoint) -> Result<MotionPlan, QuantiseError> {
    let travel = setpoint.travel_counts() * 4_294_967_296.0;
    let period = u32::try_from(period_ns).unwrap_or(u32::MAX);
    let intervals_s = case.motion.intervals_s().ok_or_else(|| {
        let because = "controller.setpoints = \"generator\" plans one move in seven intervals; a row \
                       of moves and a profile need \"table\" or \"queue\"";
        QuantiseError::Bench(because.to_owned())
    })?;
    let intervals_ps = intervals_s.map(|t_s| (t_s * 1e12).round() as u64);
    let travel = whole(travel.round());
    Ok(MotionPlan::new(travel, intervals_ps, period)?)
}

/// Everything that the fixed-point gains of a case depend on, whether or not it asks
/// for more than the paper's law.
///
/// # Errors
/// [`QuantiseError`] if there is no sample time or the motion cannot be
/// generated.
pub fn scaling_request(case: &Case) -> Result<ScalingRequest, QuantiseError> {
    let period_ns = case.controller.sample_time_ns;
    let period_ns = period_ns.ok_or(QuantiseError::NoSampleTime)?;
    Ok(Setup::of(case, period_ns)?.request())
}
