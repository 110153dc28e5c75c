//! Options of the controller beyond the paper's law: shape of the law,
//! supervision, backlash compensation, requests and injected faults.
//!
//! All of it acts on rung `firmware` alone. [`AxisOptions::default`] turns
//! all of it off; what is left then is the paper's law (eq. 23). Times of the
//! run are counted nanoseconds, angles radians; the run file has degrees.

pub use firmware::law::Derivative;
use plant::Encoder;

/// Everything that rung `firmware` can do beyond the paper's law.
///
/// ```
/// use hil_core::runfile;
///
/// let paper = runfile::builtin("paper-2", &[])?;
/// assert!(paper.options.is_off());
/// let clamped = runfile::builtin("paper-2", &["controller.anti_windup=clamp".to_owned()])?;
/// assert!(!clamped.options.is_off());
/// # Ok::<(), runfile::RunFileErrors>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisOptions {
    /// Shape of the law (`[controller]`).
    pub law: LawSettings,
    /// Encoders as the controller sees them (`[encoder]`, `[load_encoder]`).
    pub encoders: EncoderSettings,
    /// Limits of the supervision (`[limits]`).
    pub limits: Limits,
    /// Compensation of the backlash (`[backlash]`).
    pub backlash: BacklashSettings,
    /// Requests at given times (`[sequence]`).
    pub requests: Requests,
    /// Other gains from some time on (`[gain_change]`).
    pub gain_change: Option<GainChange>,
    /// Hardware that misbehaves at given times (`[inject]`).
    pub injections: Injections,
}

impl AxisOptions {
    /// True if all of it is off, so that the paper's law remains.
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }
}

/// Shape of the control law (`[controller]`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawSettings {
    /// Signal that the derivative acts on.
    pub derivative: Derivative,
    /// Time constant of the derivative's first-order filter \[s\]; 0 is none.
    pub derivative_filter_s: f64,
    /// Integrator treatment.
    pub anti_windup: AntiWindup,
    /// Time constant of [`AntiWindup::BackCalculation`] \[s\], greater than 0.
    pub tracking_time_s: f64,
    /// Mantissa bits of the fixed-point gains, 8 to 31; [`None`] takes 24, or as many
    /// more as the accuracy needs.
    pub word_bits: Option<u32>,
    /// Fraction bits that Kp, Ki·Δt and Kd/Δt are rounded to before they get
    /// their mantissas, 0 to 32; [`None`] rounds once.
    pub gain_fraction_bits: Option<u8>,
    /// Rounding of the law's output to a whole code.
    pub quantiser: Quantiser,
    /// Seed of [`Quantiser::Dither`].
    pub dither_seed: u32,
    /// Largest change of the output \[codes/s\]; [`None`] limits nothing.
    pub slew_limit_codes_per_s: Option<f64>,
    /// Feed-forward from the reference; all 0 is none.
    pub feed_forward: FeedForward,
    /// Origin of the setpoints.
    pub setpoints: SetpointOrigin,
    /// Encoders that close the loop.
    pub feedback: Feedback,
    /// At rest, errors up to this count as 0 \[counts\]; 0 is no dead band.
    pub rest_dead_band_counts: u32,
    /// Integrator while the axis stands.
    pub rest_integrator: RestIntegrator,
}

impl Default for LawSettings {
    fn default() -> Self {
        Self {
            derivative: Derivative::Error,
            derivative_filter_s: 0.0,
            anti_windup: AntiWindup::None,
            tracking_time_s: 0.01,
            word_bits: None,
            gain_fraction_bits: None,
            quantiser: Quantiser::Nearest,
            dither_seed: 1,
            slew_limit_codes_per_s: None,
            feed_forward: FeedForward::default(),
            setpoints: SetpointOrigin::Table,
            feedback: Feedback::Motor,
            rest_dead_band_counts: 0,
            rest_integrator: RestIntegrator::Run,
        }
    }
}

/// Guard of the integrator against winding up (`controller.anti_windup`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AntiWindup {
    /// Not at all: the paper's law.
    None,
    /// It goes no further than the headroom that is left, while the error
    /// drives it out.
    Clamp,
    /// The part that the limit cuts off is led back into it.
    BackCalculation,
}

/// Rounding of the law's output to a whole code (`controller.quantiser`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantiser {
    /// The nearest code.
    Nearest,
    /// The nearest code to the output plus what earlier roundings left over.
    ErrorFeedback,
    /// The nearest code to the output plus a random fraction of a code.
    Dither,
}

/// Origin of the setpoints (`controller.setpoints`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetpointOrigin {
    /// A table of positions, one a sample, computed before the run.
    Table,
    /// The firmware's own generator.
    Generator,
    /// A queue that the host fills during the run.
    Queue,
}

/// Encoders that close the loop (`controller.feedback`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feedback {
    /// The one on the motor shaft.
    Motor,
    /// The load's for the position, the motor's for the derivative.
    Dual,
}

/// Integrator while the axis stands
/// (`controller.rest_integrator`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RestIntegrator {
    /// It runs on.
    Run,
    /// It keeps its value.
    Hold,
}

/// Feed-forward gains; in numbers [`Case::feed_forward`](crate::case::Case::feed_forward).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FeedForward {
    /// Output per reference velocity \[codes s/count\].
    pub velocity_s: FeedForwardGain,
    /// Output per reference acceleration \[codes s²/count\].
    pub acceleration_s2: FeedForwardGain,
    /// Output with the sign of the reference velocity \[codes\].
    pub friction_codes: FeedForwardGain,
}

/// Origin of a feed-forward gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FeedForwardGain {
    /// This number, at least 0; 0 turns it off.
    Given(f64),
    /// What the model of the plant needs, whatever its values are.
    Plant,
}

impl Default for FeedForwardGain {
    fn default() -> Self {
        Self::Given(0.0)
    }
}

/// Encoders as the controller sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderSettings {
    /// Width of the counters, 8 to 32 bits; beyond it they wrap around.
    pub counter_bits: u32,
    /// Encoder on the load side, per radian of the screw; one at the carriage
    /// is converted by the screw's pitch, which is rigid.
    pub load: Option<Encoder>,
}

impl Default for EncoderSettings {
    fn default() -> Self {
        Self {
            counter_bits: 32,
            load: None,
        }
    }
}

/// Compensation of the backlash in the reference (`[backlash]`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BacklashSettings {
    /// Trigger of the reference's way across the gap.
    pub compensation: Compensation,
    /// Half gap \[rad\] at the joint; [`None`] takes the joint's own.
    pub half_gap_rad: Option<f64>,
    /// Source of the width of the gap.
    pub gap: GapSource,
    /// Sign of the far flank to the measurement of the gap.
    pub backlash_measurement_detection: FlankDetection,
    /// Motor speed of the measurement \[counts/s\], greater than 0.
    pub backlash_measurement_speed_counts_per_s: f64,
    /// Output that means a flank to [`FlankDetection::Effort`] \[codes\].
    pub backlash_measurement_effort_codes: u32,
}

impl Default for BacklashSettings {
    fn default() -> Self {
        Self {
            compensation: Compensation::None,
            half_gap_rad: None,
            gap: GapSource::Given,
            backlash_measurement_detection: FlankDetection::LoadEncoder,
            backlash_measurement_speed_counts_per_s: 200.0,
            backlash_measurement_effort_codes: 50,
        }
    }
}

/// Trigger of the reference's way across the gap (`backlash.compensation`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compensation {
    /// Nothing: no compensation.
    None,
    /// A change of sign of the reference velocity.
    Velocity,
    /// A change of sign of the reference acceleration.
    Acceleration,
}

/// Source of the width of the gap (`backlash.gap`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GapSource {
    /// From the settings.
    Given,
    /// From a measurement before the motion.
    Measured,
}

/// Sign of the far flank to the measurement
/// (`backlash.backlash_measurement_detection`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlankDetection {
    /// The load encoder moves.
    LoadEncoder,
    /// The output rises.
    Effort,
}

/// Limits of the supervision (`[limits]`); [`None`] is not monitored.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Largest following error.
    pub following_error: Option<FollowingErrorLimit>,
    /// Largest change of the encoder count in one sample \[counts\], below
    /// half the counter's range.
    pub count_jump_counts: Option<u32>,
    /// Standstill of the count that means that the encoder is lost.
    pub encoder_loss: Option<EncoderLoss>,
    /// Longest time with the output at its limit \[ns\], greater than 0.
    pub saturation_ns: Option<u64>,
    /// A missed tick is a fault.
    pub missed_ticks: bool,
    /// Largest speed of the axis at the carriage \[m/s\]. The backlash
    /// compensation needs it.
    pub velocity_mps: Option<f64>,
    /// Largest acceleration of the axis at the carriage \[m/s²\]. The backlash
    /// compensation needs it.
    pub acceleration_mps2: Option<f64>,
}

/// Largest following error: `counts + per_speed_s·|reference speed|`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FollowingErrorLimit {
    /// At standstill \[counts\], at least 1.
    pub counts: u32,
    /// On top, per speed \[counts/(counts/s)\], at least 0.
    pub per_speed_s: f64,
}

/// The encoder counts as lost if its count stands still this long under an
/// output of at least this size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EncoderLoss {
    /// Time \[ns\], greater than 0.
    pub after_ns: u64,
    /// Magnitude of the output \[codes\], at least 1.
    pub codes: u32,
}

/// Requests at given times \[ns\] (`[sequence]`); [`None`] never comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Requests {
    /// Disable the axis.
    pub disable_ns: Option<u64>,
    /// Enable the axis.
    pub enable_ns: Option<u64>,
    /// The emergency stop goes on.
    pub emergency_stop_ns: Option<u64>,
    /// The emergency stop goes off, later than it went on.
    pub emergency_stop_release_ns: Option<u64>,
    /// Reset the faults.
    pub reset_ns: Option<u64>,
}

/// Gains that hold from some time on (`[gain_change]`); at least one of them
/// changes, [`None`] stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GainChange {
    /// Time of the change \[ns\].
    pub at_ns: u64,
    /// Proportional gain \[codes/count\].
    pub kp: Option<f64>,
    /// Integral gain \[codes/(count s)\].
    pub ki_per_s: Option<f64>,
    /// Derivative gain \[codes s/count\].
    pub kd_s: Option<f64>,
}

/// Hardware that misbehaves at given times \[ns\] (`[inject]`); [`None`] never
/// does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Injections {
    /// One wrong count.
    pub encoder_glitch: Option<EncoderGlitch>,
    /// From here on the count stands still.
    pub encoder_freeze_ns: Option<u64>,
    /// The tick at this time does not come.
    pub missed_tick_ns: Option<u64>,
    /// The transfer at this time fails.
    pub bus_error_ns: Option<u64>,
    /// From here on the queue of setpoints is not filled.
    pub setpoint_underrun_ns: Option<u64>,
}

/// One wrong count of the encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EncoderGlitch {
    /// Time \[ns\].
    pub at_ns: u64,
    /// Counts that are added to the true one \[counts\].
    pub counts: i32,
}
