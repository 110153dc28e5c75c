//! The paper's continuous PID law (eq. 27-31): rung `continuous`.

use std::sync::Arc;

use crate::model::amplifier::Amplifier;
use crate::model::dac::Dac;
use crate::model::encoder::Encoder;
use crate::model::joint::Transmission;
use crate::model::motion::Motion;
use crate::model::state::{BETA, BETA_DOT, BETA_INTEGRAL, Vector};

/// Gains of the PID law (eq. 23), per encoder count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PidGains {
    /// `K_p` \[DAC codes per count\].
    pub kp: f64,
    /// `K_i` \[codes per count and second\].
    pub ki_per_s: f64,
    /// `K_d` \[codes per (count per second)\].
    pub kd_s: f64,
}

/// Side of an instant: the reference's acceleration can jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Before,
    After,
}

/// Continuous position controller together with its motion command.
#[derive(Debug, Clone, PartialEq)]
pub struct ContinuousPid {
    pub(crate) gains: PidGains,
    /// `K_0 = K_a·K_enc·K_dac` of eq. 27 \[V/rad, or A/rad, per unit of gain\].
    pub(crate) loop_gain: f64,
    limit: f64,
    pub(crate) gear_ratio: f64,
    /// Carriage displacement to motor angle: `α = x/(p·z)`.
    pub(crate) radians_per_m: f64,
    motion: Motion,
    /// Shared by clones alone.
    origin: Arc<()>,
}

impl ContinuousPid {
    /// Puts the parts of Fig. 4 together.
    pub fn new(
        gains: PidGains,
        encoder: Encoder,
        dac: Dac,
        amplifier: Amplifier,
        transmission: &Transmission,
        motion: Motion,
    ) -> Self {
        Self {
            gains,
            loop_gain: amplifier.gain * encoder.counts_per_rad * dac.step_v,
            limit: amplifier.limit(),
            gear_ratio: transmission.gear_ratio,
            radians_per_m: 1.0 / (transmission.screw_pitch_m_per_rad * transmission.gear_ratio),
            motion,
            origin: Arc::default(),
        }
    }

    /// The motion command that the controller follows.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Sign of the output with which an axis at rest begins to follow the command; 0 where
    /// the command rests, or there is no gain.
    pub(crate) fn first_direction(&self, time_s: f64) -> f64 {
        let PidGains { kp, ki_per_s, kd_s } = self.gains;
        let at = |time_s| self.motion.at(time_s).acceleration_mps2;
        // An acceleration that begins at zero has its sign a nanosecond later.
        let first = [at(time_s), at(time_s + 1e-9)]
            .into_iter()
            .find(|a| *a != 0.0);
        first.filter(|_| kp + ki_per_s + kd_s > 0.0).unwrap_or(0.0)
    }

    /// Limit of the amplifier's command, `±V_max` \[V\] or that of a current drive \[A\].
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// True if two laws are the same. This is asked in every row.
    #[inline(always)]
    pub(crate) fn is_same_law(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.origin, &other.origin) || self == other
    }

    /// `V_m = K_0·[K_p·e + K_i·∫e + K_d·ė]` before the amplifier's limit,
    /// eq. 27-28 \[V, or A with a current drive\].
    pub(crate) fn demand(&self, time_s: f64, y: &Vector) -> f64 {
        let r = self.motion.at(time_s);
        self.weighted([
            (r.displacement_integral_ms, y[BETA_INTEGRAL]),
            (r.displacement_m, y[BETA]),
            (r.velocity_mps, y[BETA_DOT]),
        ])
    }

    /// Time derivative of the demand.
    pub(crate) fn demand_rate(
        &self,
        time_s: f64,
        side: Side,
        beta: f64,
        beta_dot: f64,
        beta_ddot: f64,
    ) -> f64 {
        let mut r = self.motion.at(time_s);
        if side == Side::Before {
            r.acceleration_mps2 = self.motion.acceleration_before_mps2(time_s);
        }
        self.weighted([
            (r.displacement_m, beta),
            (r.velocity_mps, beta_dot),
            (r.acceleration_mps2, beta_ddot),
        ])
    }

    /// `K_0·[K_p·e + K_i·ê + K_d·ė]` with the errors ê, e and ė, or the rates of these:
    /// each from its command and from the gear output.
    fn weighted(&self, commands_and_angles: [(f64, f64); 3]) -> f64 {
        let (s, z) = (self.radians_per_m, self.gear_ratio);
        let [e_hat, e, e_dot] = commands_and_angles.map(|(command, angle)| command * s - angle / z);
        let (kp, ki, kd) = (self.gains.kp, self.gains.ki_per_s, self.gains.kd_s);
        self.loop_gain * (kp * e + ki * e_hat + kd * e_dot)
    }
}
