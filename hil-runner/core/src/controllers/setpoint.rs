//! The motion command in counts, sample by sample.

use firmware::counts;
use firmware::law::words::LARGEST_RATE;
use plant::{Encoder, Motion, MotionPoint};

use super::world::Table;
use crate::case::Case;
use crate::message::whole;
use crate::number::seconds;
use crate::quantise::{QuantiseError, power_of_two};
use crate::scaling::RateBits;

/// The motor angle that the motion asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Setpoint {
    motion: Motion,
    encoder: Encoder,
    period_ns: u64,
    /// Length of the run \[ns\].
    duration_ns: u64,
    /// Carriage displacement per motor angle, `p·z` \[m/rad\].
    metres_per_rad: f64,
}

impl Setpoint {
    /// The motion of `case` at samples `period_ns` apart, at the motor.
    pub fn new(case: &Case, period_ns: u64) -> Self {
        let transmission = &case.axis.transmission;
        Self {
            motion: case.motion.clone(),
            encoder: case.encoder,
            period_ns,
            duration_ns: case.run.duration_ns,
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

    /// Largest speed of the motion \[m/s\].
    pub(super) fn peak_mps(&self) -> f64 {
        self.motion.peak_velocity_mps()
    }

    /// The command at `t_k`.
    fn at(&self, tick: u64) -> MotionPoint {
        self.motion.at(seconds(tick.saturating_mul(self.period_ns)))
    }

    /// `α_ref` of a command \[rad\].
    fn alpha_rad(&self, command: &MotionPoint) -> f64 {
        command.displacement_m / self.metres_per_rad
    }

    /// `K_enc·α_ref(t_k)`, a real number of counts.
    pub(super) fn position_counts(&self, tick: u64) -> f64 {
        self.encoder.position_counts(self.alpha_rad(&self.at(tick)))
    }

    /// `floor(K_enc·α_ref(t_k) + ½)` \[counts\].
    pub fn count(&self, tick: u64) -> i64 {
        self.count_of(&self.at(tick))
    }

    fn count_of(&self, command: &MotionPoint) -> i64 {
        whole(self.encoder.setpoint_count(self.alpha_rad(command)))
    }

    /// The first sample at or after the motion's end.
    pub(super) fn last_tick(&self) -> u64 {
        let end_s = self.motion.end_s();
        let quotient = whole((end_s / seconds(self.period_ns)).floor());
        // Rounding puts the quotient off by one at most; a motion beyond the clock's
        // range has no such sample.
        let first = u64::try_from(quotient).unwrap_or(0).saturating_sub(1);
        let ended = |tick: &u64| seconds(tick.saturating_mul(self.period_ns)) >= end_s;
        (first..first + 3).find(ended).unwrap_or(first + 3)
    }

    /// Velocity \[counts/sample\] and acceleration \[counts/sample²\] from those of the
    /// carriage \[m/s, m/s²\].
    fn per_sample(&self, velocity_mps: f64, acceleration_mps2: f64) -> [f64; 2] {
        let dt_s = seconds(self.period_ns);
        let counts_per_m = self.counts_per_m();
        [
            velocity_mps * counts_per_m * dt_s,
            acceleration_mps2 * counts_per_m * (dt_s * dt_s),
        ]
    }

    /// The finest rates of a table that stay below the largest that a law takes, 2^24 units:
    /// as the firmware's generator chooses them.
    ///
    /// # Errors
    /// [`QuantiseError::Setting`] if the motion is too fast for whole counts.
    pub(super) fn rate_bits(&self) -> Result<RateBits, QuantiseError> {
        let peak_mps2 = (self.motion).peak_acceleration_until_mps2(self.motion.end_s());
        let [velocity, acceleration] = self.per_sample(self.peak_mps(), peak_mps2);
        let most = (LARGEST_RATE - 1) as f64;
        let finest = |(peak, unit): (f64, &str)| {
            // A rounded peak stays below as well.
            let holds = |&bits: &u8| (peak * power_of_two(bits)).round() <= most;
            (0..=60).rev().find(holds).ok_or_else(|| {
                let because = format!(
                    "the motion reaches {peak:.0} counts per {unit}; it must stay below 2^24, \
                     with a longer motion or a shorter sample time"
                );
                QuantiseError::setting("controller.sample_time_s", seconds(self.period_ns), because)
            })
        };
        Ok(RateBits {
            velocity: finest((velocity, "sample"))?,
            acceleration: finest((acceleration, "sample²"))?,
        })
    }

    /// Velocity and acceleration of a command, in these fractions of counts.
    fn rates(&self, command: &MotionPoint, bits: RateBits) -> [i32; 2] {
        let [v, a] = self.per_sample(command.velocity_mps, command.acceleration_mps2);
        // Below 2^24 by the choice of the fractions.
        let word = |rate: f64, bits| (rate * power_of_two(bits)).round() as i32;
        [word(v, bits.velocity), word(a, bits.acceleration)]
    }

    /// The samples of a table: up to the motion's end, or to the first behind the run.
    fn ticks(&self) -> impl Iterator<Item = u64> {
        let behind = self.duration_ns / self.period_ns + 1;
        0..=self.last_tick().min(behind)
    }

    /// The setpoints of the run \[counts modulo 2^32\], the last of which is held.
    pub(super) fn positions(&self) -> Vec<i32> {
        let position = |tick| counts::wrap(self.count(tick));
        self.ticks().map(position).collect()
    }

    /// The table of them before its first sample, with the rates where these are given in
    /// such fractions.
    fn table(&self, rates: Option<RateBits>) -> Table {
        let Some(bits) = rates else {
            return Table::new(self.positions(), false);
        };
        let rated = |tick| {
            let command = self.at(tick);
            let [v, a] = self.rates(&command, bits);
            [counts::wrap(self.count_of(&command)), v, a]
        };
        Table::new(self.ticks().flat_map(rated).collect(), true)
    }
}

/// The table that was made last, for runs that differ in nothing that it depends on.
#[derive(Debug, Clone, Default)]
pub struct LastTable(Option<(Setpoint, Option<RateBits>, Table)>);

impl LastTable {
    /// The table of these setpoints, made if it is another one.
    pub(super) fn of(&mut self, setpoint: &Setpoint, rates: Option<RateBits>) -> Table {
        let known = self.0.take();
        let known = known.filter(|(of, with, _)| of == setpoint && *with == rates);
        let make = || (setpoint.clone(), rates, setpoint.table(rates));
        self.0.insert(known.unwrap_or_else(make)).2.clone()
    }
}
