//! A motion that the chip plans itself: what it is asked for.

use firmware::GainWord;

use crate::body::halves;
use crate::frame::Frame;

/// A motion to be planned ([`firmware::MotionPlan::new`]), with the feed-forward that
/// comes with it ([`firmware::MotionPlan::stretches`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Planned {
    /// \[2^−32 counts\].
    pub travel: i64,
    /// The intervals `t1` to `t7` \[ps\].
    pub intervals_ps: [u64; 7],
    /// Sample time \[ns\].
    pub period_ns: u32,
    /// Position that it starts from \[counts, modulo 2^32\].
    pub start: i32,
    /// Gains of velocity, acceleration and friction.
    pub gains: [GainWord; 3],
}

impl Planned {
    pub(crate) fn write(&self, to: &mut Frame) {
        to.words(&halves(self.travel));
        for t_ps in self.intervals_ps {
            to.words(&halves(t_ps.cast_signed()));
        }
        to.words(&[self.period_ns, self.start.cast_unsigned()]);
        for gain in self.gains {
            to.words(&[gain.mantissa.cast_unsigned()]);
            to.put(gain.fraction_bits);
        }
    }
}
