//! The motion command in counts, sample by sample.

use firmware::{CAPACITY, SetpointTable};
use plant::{Encoder, Motion};

use crate::case::Case;
use crate::message::whole;
use crate::number::seconds;
use crate::quantise::{QuantiseError, setpoint_table};

/// The motor angle that the motion asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    motion: Motion,
    encoder: Encoder,
    period_ns: u64,
    /// Carriage displacement per motor angle, `p·z` \[m/rad\].
    metres_per_rad: f64,
}

impl Setpoint {
    /// The motion of `case` at samples `period_ns` apart, at the motor.
    pub fn new(case: &Case, period_ns: u64) -> Self {
        let transmission = &case.axis.transmission;
        Self {
            motion: case.motion,
            encoder: case.encoder,
            period_ns,
            metres_per_rad: transmission.screw_pitch_m_per_rad * transmission.gear_ratio,
        }
    }

    /// The same at the load: the screw's angle, in counts of the encoder there.
    pub(super) fn of_load(case: &Case, period_ns: u64, load: Encoder) -> Self {
        Self {
            encoder: load,
            metres_per_rad: case.axis.transmission.screw_pitch_m_per_rad,
            ..Self::new(case, period_ns)
        }
    }

    /// Counts per displacement of the carriage \[counts/m\].
    pub(super) fn counts_per_m(&self) -> f64 {
        self.encoder.counts_per_rad / self.metres_per_rad
    }

    /// The whole travel, a real number of counts.
    pub(super) fn travel_counts(&self) -> f64 {
        let travel_rad = self.motion.travel_m() / self.metres_per_rad;
        self.encoder.position_counts(travel_rad)
    }

    /// Largest speed of the motion, where its acceleration ends \[m/s\].
    pub(super) fn peak_mps(&self) -> f64 {
        let [t1, t2, t3, ..] = self.motion.intervals_s();
        self.motion.at(t1 + t2 + t3).velocity_mps.abs()
    }

    /// `α_ref(t_k)` \[rad\].
    fn alpha_rad(&self, tick: u64) -> f64 {
        let time_s = seconds(tick.saturating_mul(self.period_ns));
        self.motion.at(time_s).displacement_m / self.metres_per_rad
    }

    /// `K_enc·α_ref(t_k)`, a real number of counts.
    pub(super) fn position_counts(&self, tick: u64) -> f64 {
        self.encoder.position_counts(self.alpha_rad(tick))
    }

    /// `floor(K_enc·α_ref(t_k) + ½)` \[counts\].
    pub fn count(&self, tick: u64) -> i64 {
        whole(self.encoder.setpoint_count(self.alpha_rad(tick)))
    }

    /// The first sample at or after the motion's end.
    pub(super) fn last_tick(&self) -> u64 {
        let end_s = self.motion.end_s();
        let estimate = whole((end_s / seconds(self.period_ns)).floor());
        let mut tick = u64::try_from(estimate).unwrap_or(0).saturating_sub(1);
        while seconds(tick.saturating_mul(self.period_ns)) < end_s {
            tick += 1;
        }
        tick
    }

    /// The last sample, if a table holds the setpoints up to it: refused before 10^9
    /// samples of a motion are computed for it.
    ///
    /// # Errors
    /// [`QuantiseError::Refused`] if the motion is longer than the table.
    pub(super) fn last_in_table(&self) -> Result<u64, QuantiseError> {
        let last = self.last_tick();
        let needed = last.saturating_add(1);
        match usize::try_from(needed) {
            Ok(needed) if needed <= CAPACITY => Ok(last),
            _ => Err(QuantiseError::too_long(needed, CAPACITY)),
        }
    }

    /// The setpoints of the whole motion.
    ///
    /// # Errors
    /// [`QuantiseError`] if the motion is longer than the table.
    pub fn table(&self) -> Result<SetpointTable<CAPACITY>, QuantiseError> {
        setpoint_table((0..=self.last_in_table()?).map(|tick| self.count(tick)))
    }
}
