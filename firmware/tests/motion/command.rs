//! The command of Fig. 6 in fixed point with 256 fraction bits: exact next to
//! everything it is compared with.

use num_bigint::BigInt;

/// Fraction bits of all numbers here.
const BITS: u32 = 256;

/// A number with 256 fraction bits.
#[derive(Clone, Debug, PartialEq, PartialOrd)]
pub(crate) struct Fixed(BigInt);

impl Fixed {
    pub(crate) fn ratio(numerator: i128, denominator: i128) -> Self {
        Self((BigInt::from(numerator) << BITS) / denominator)
    }

    fn one() -> Self {
        Self::ratio(1, 1)
    }

    pub(crate) fn add(&self, other: &Self) -> Self {
        Self(&self.0 + &other.0)
    }

    pub(crate) fn sub(&self, other: &Self) -> Self {
        Self(&self.0 - &other.0)
    }

    fn mul(&self, other: &Self) -> Self {
        Self((&self.0 * &other.0) >> BITS)
    }

    fn div(&self, other: &Self) -> Self {
        Self((&self.0 << BITS) / &other.0)
    }

    fn half(&self) -> Self {
        Self(&self.0 >> 1_u32)
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.0 == BigInt::ZERO
    }

    /// Arc tangent of `1/n`.
    fn arc_tangent(n: i64) -> Self {
        let mut power = Self::ratio(1, i128::from(n));
        let mut sum = power.clone();
        for k in 1_i64..200 {
            power = Self(power.0 / -(n * n));
            sum = sum.add(&Self(&power.0 / (2 * k + 1)));
        }
        sum
    }

    /// π/2, by Machin.
    pub(crate) fn half_pi() -> Self {
        let (near, far) = (Self::arc_tangent(5), Self::arc_tangent(239));
        Self(near.0 * 8 - far.0 * 2)
    }

    fn sine_cosine(&self) -> (Self, Self) {
        let square = self.mul(self);
        let series = |first: Self, start: i64| {
            let (mut term, mut sum, mut n) = (first.clone(), first, start);
            while !term.is_zero() && n < 90 {
                term = Self(term.mul(&square).0 / -(n * (n + 1)));
                sum = sum.add(&term);
                n += 2;
            }
            sum
        };
        (series(self.clone(), 2), series(Self::one(), 1))
    }

    /// The nearest `f64` times `2^power`, for what is printed and bounded.
    pub(crate) fn to_f64(&self, power: i32) -> f64 {
        let shift = i64::from(BITS) - 64 - i64::from(power);
        let shifted = if shift >= 0 {
            &self.0 >> shift.unsigned_abs()
        } else {
            &self.0 << shift.unsigned_abs()
        };
        // 2^64 divides all that stays.
        let digits = i128::try_from(shifted).expect("moderate numbers");
        digits as f64 / 2_f64.powi(64)
    }
}

/// Position, velocity and acceleration \[counts, samples\].
pub(crate) struct Instant {
    pub(crate) position: Fixed,
    pub(crate) velocity: Fixed,
    pub(crate) acceleration: Fixed,
}

/// A motion in counts and picoseconds.
pub(crate) struct Command {
    intervals_ps: [u64; 7],
    period_ps: u64,
    half_pi: Fixed,
    travel: Fixed,
    up: Fixed,
    down: Fixed,
}

impl Command {
    pub(crate) fn new(
        travel: i64,
        intervals_ps: [u64; 7],
        period_ns: u32,
        half_pi: &Fixed,
    ) -> Self {
        let period_ps = u64::from(period_ns) * 1_000;
        let mut command = Self {
            intervals_ps,
            period_ps,
            half_pi: half_pi.clone(),
            travel: Fixed::ratio(i128::from(travel), 1 << 32),
            up: Fixed::one(),
            down: Fixed::one(),
        };
        // Amplitudes for a speed of 1, then scaled by the distance it goes.
        let t = command.durations();
        let gain = t[1].add(&t[0].add(&t[2]).div(half_pi));
        let loss = t[5].add(&t[4].add(&t[6]).div(half_pi));
        command.up = Fixed::one().div(&gain);
        command.down = Fixed::ratio(-1, 1).div(&loss);
        let end_ps = intervals_ps.iter().sum();
        let speed = command.travel.div(&command.walk(end_ps).position);
        command.up = speed.div(&gain);
        command.down = Fixed::ratio(0, 1).sub(&speed.div(&loss));
        command
    }

    fn durations(&self) -> [Fixed; 7] {
        self.intervals_ps
            .map(|t| Fixed::ratio(i128::from(t), i128::from(self.period_ps)))
    }

    /// The command at sample `k`; at rest from the end on.
    pub(crate) fn at_sample(&self, k: u64) -> Instant {
        let end_ps: u64 = self.intervals_ps.iter().sum();
        let now_ps = k * self.period_ps;
        if now_ps >= end_ps {
            return Instant {
                position: self.travel.clone(),
                velocity: Fixed::ratio(0, 1),
                acceleration: Fixed::ratio(0, 1),
            };
        }
        self.walk(now_ps)
    }

    /// Integrates interval by interval up to `now_ps`.
    fn walk(&self, now_ps: u64) -> Instant {
        let zero = Fixed::ratio(0, 1);
        let mut now = Instant {
            position: zero.clone(),
            velocity: zero.clone(),
            acceleration: zero.clone(),
        };
        let mut left_ps = now_ps;
        for (index, (&t_ps, duration)) in self.intervals_ps.iter().zip(self.durations()).enumerate()
        {
            if t_ps == 0 {
                continue;
            }
            let tau_ps = left_ps.min(t_ps);
            let tau = Fixed::ratio(i128::from(tau_ps), i128::from(self.period_ps));
            let a = match index {
                0..=2 => &self.up,
                3 => &zero,
                _ => &self.down,
            };
            let (shape, once, twice) = if index % 2 == 1 {
                (Fixed::one(), tau.clone(), tau.mul(&tau).half())
            } else {
                let w = self.half_pi.div(&duration);
                let (sine, cosine) = w.mul(&tau).sine_cosine();
                let versine = Fixed::one().sub(&cosine);
                if index % 4 == 0 {
                    let lag = tau.sub(&sine.div(&w)).div(&w);
                    (sine, versine.div(&w), lag)
                } else {
                    (cosine, sine.div(&w), versine.div(&w).div(&w))
                }
            };
            now = Instant {
                position: now
                    .position
                    .add(&now.velocity.mul(&tau))
                    .add(&a.mul(&twice)),
                velocity: now.velocity.add(&a.mul(&once)),
                acceleration: a.mul(&shape),
            };
            left_ps -= tau_ps;
            // What the next interval begins with, unless this one goes on.
            if left_ps == 0 && tau_ps < t_ps {
                break;
            }
        }
        now
    }
}
