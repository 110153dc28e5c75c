//! From a case in SI units to the axis in words.

mod take_up;
mod watches;

use firmware::axis::{Axis, Feedback as AxisFeedback, Rest};
use firmware::law::Law;
use firmware::motion::MotionPlan;
use firmware::output::{Output, Quantiser};
use firmware::position::CounterParameters;
use firmware::reference::TableSource;
use firmware::{CAPACITY, Dac, SetpointTable};

use super::source::{Generator, Source, StreamedQueue};
use crate::case::Case;
use crate::controllers::{Setpoint, fits_table, last_tick, whole};
use crate::options::{self, Feedback, RestIntegrator, SetpointOrigin};
use crate::quantise::{QuantiseError, setpoint_table};
use crate::scaling::{RateBits, ScaledLaw, ScalingRequest};

/// What the parts of an axis are made from.
#[derive(Debug)]
pub struct Setup<'a> {
    case: &'a Case,
    period_ns: u64,
    setpoint: Setpoint,
    plan: Option<MotionPlan>,
}

impl<'a> Setup<'a> {
    /// The settings of `case` at a sample time of `period_ns`.
    ///
    /// # Errors
    /// [`QuantiseError`] if the gap has to be measured and cannot be.
    pub fn of(case: &'a Case, period_ns: u64) -> Result<Self, QuantiseError> {
        let setpoint = match (case.options.law.feedback, case.options.encoders.load) {
            (Feedback::Dual, Some(load)) => Setpoint::of_load(case, period_ns, load),
            _ => Setpoint::new(case, period_ns),
        };
        let plan = match case.options.law.setpoints {
            SetpointOrigin::Table => None,
            SetpointOrigin::Generator | SetpointOrigin::Queue => {
                Some(plan(case, period_ns, &setpoint)?)
            }
        };
        Ok(Self {
            case,
            period_ns,
            setpoint,
            plan,
        })
    }

    /// The same without anything that acts on the reference: what homing runs.
    pub(super) fn axis_without_take_up(&self, law: Law) -> Result<Axis, QuantiseError> {
        let settings = &self.case.options;
        let output = Output::new(self.dac()?, self.slew()?, self.quantiser()).map_err(|error| {
            setting(
                "controller.slew_limit_codes_per_s",
                self.slew_value(),
                &error,
            )
        })?;
        let bits = u8::try_from(settings.encoders.counter_bits).unwrap_or(u8::MAX);
        let counter = |jump| {
            CounterParameters::accept(bits, jump).map_err(|error| {
                let value = f64::from(settings.limits.count_jump_counts.unwrap_or(0));
                setting("limits.count_jump_counts", value, &error)
            })
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
        axis.monitors = self.watches()?;
        Ok(axis)
    }

    /// The axis of the run.
    pub fn axis(&self, law: Law) -> Result<Axis, QuantiseError> {
        let mut axis = self.axis_without_take_up(law)?;
        axis.backlash_compensation = self.take_up()?;
        Ok(axis)
    }

    /// The words of the law from the start.
    pub fn words(&self) -> Result<ScaledLaw, QuantiseError> {
        self.request().words()
    }

    /// The law from the gain change on.
    pub fn next_law(&self) -> Result<Option<Law>, QuantiseError> {
        let Some(change) = self.case.options.gain_change else {
            return Ok(None);
        };
        let mut request = self.request();
        let gains = &mut request.gains;
        gains.kp = change.kp.unwrap_or(gains.kp);
        gains.ki_per_s = change.ki_per_s.unwrap_or(gains.ki_per_s);
        gains.kd_s = change.kd_s.unwrap_or(gains.kd_s);
        let words = request.words().map_err(|error| match error {
            // The gains that change have keys of their own.
            QuantiseError::Gains(mut unfit) => {
                for gain in &mut unfit {
                    gain.key = match gain.key {
                        "controller.kp" if change.kp.is_some() => "gain_change.kp",
                        "controller.ki_per_s" if change.ki_per_s.is_some() => {
                            "gain_change.ki_per_s"
                        }
                        "controller.kd_s" if change.kd_s.is_some() => "gain_change.kd_s",
                        key => key,
                    };
                }
                QuantiseError::Gains(unfit)
            }
            error => error,
        })?;
        Ok(Some(words.law))
    }

    /// What the words are made from.
    pub(super) fn request(&self) -> ScalingRequest {
        ScalingRequest {
            settings: self.case.options.law,
            gains: self.case.controller.gains,
            sample_time_ns: self.period_ns,
            travel_counts: whole(self.setpoint.count(last_tick(self.case, self.period_ns))),
            motor_counts_per_count: self.motor_counts_per_count(),
            dac_bits: self.case.dac.bits,
            rates: self.rates(),
        }
    }

    /// The setpoints of the run.
    pub fn source(&self) -> Result<Source, QuantiseError> {
        Ok(match (self.case.options.law.setpoints, &self.plan) {
            (SetpointOrigin::Generator, Some(plan)) => {
                Source::Generator(Box::new(Generator::new(plan.clone())))
            }
            (SetpointOrigin::Queue, Some(plan)) => {
                Source::Queue(Box::new(StreamedQueue::new(Generator::new(plan.clone()))))
            }
            _ => {
                let last = fits_table(last_tick(self.case, self.period_ns))?;
                let positions = (0..=last).map(|tick| whole(self.setpoint.count(tick)));
                let table: SetpointTable<CAPACITY> = setpoint_table(positions)?;
                Source::Table(Box::new(TableSource::new(table)))
            }
        })
    }

    /// `ρ`: motor counts per count of the position's encoder.
    fn motor_counts_per_count(&self) -> f64 {
        match (
            self.case.options.law.feedback,
            self.case.options.encoders.load,
        ) {
            (Feedback::Dual, Some(load)) => self.motor_counts_per_load_count(load),
            _ => 1.0,
        }
    }

    /// Motor counts per count of the load's encoder, `K_enc/(z·K_load)`.
    pub(super) fn motor_counts_per_load_count(&self, load: plant::Encoder) -> f64 {
        let z = self.case.axis.transmission.gear_ratio;
        self.case.encoder.counts_per_rad / (z * load.counts_per_rad)
    }

    fn rates(&self) -> RateBits {
        self.plan
            .as_ref()
            .map_or(RateBits::default(), |plan| RateBits {
                velocity: plan.velocity_fraction_bits(),
                acceleration: plan.acceleration_fraction_bits(),
            })
    }

    fn dac(&self) -> Result<Dac, QuantiseError> {
        Dac::with_bits(self.case.dac.bits).map_err(QuantiseError::Dac)
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

    fn slew_value(&self) -> f64 {
        self.case.options.law.slew_limit_codes_per_s.unwrap_or(0.0)
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
            return Err(setting(
                "controller.slew_limit_codes_per_s",
                codes_per_s,
                &because,
            ));
        }
        Ok((codes < f64::from(1 << 24)).then_some(whole(codes).unsigned_abs() as u32))
    }
}

/// The plan of the motion for the firmware's generator.
fn plan(case: &Case, period_ns: u64, setpoint: &Setpoint) -> Result<MotionPlan, QuantiseError> {
    let travel = setpoint.travel_counts() * 4_294_967_296.0;
    let period = u32::try_from(period_ns).unwrap_or(u32::MAX);
    let intervals_ps = case
        .motion
        .intervals_s()
        .map(|t_s| (t_s * 1e12).round() as u64);
    MotionPlan::new(whole(travel.round()), intervals_ps, period).map_err(QuantiseError::Motion)
}

/// A setting that the firmware refuses.
pub(super) fn setting(
    key: &'static str,
    value: f64,
    because: &dyn std::fmt::Display,
) -> QuantiseError {
    QuantiseError::Setting {
        key,
        value,
        because: because.to_string(),
    }
}
