//! Changes of mode: what happens at one instant, for every solver that
//! locates it.

use crate::error::PlantError;
use crate::hybrid::guard::Instant;
use crate::hybrid::mode::{Guard, Guards};
use crate::model::axis::Drive;
use crate::model::pid::Side;
use crate::model::state::{EPSILON_DOT, Vector};
use crate::observe::span::{ContactChange, Watch};
use crate::plant::Plant;
use crate::stepped::adaptive::Interval;

/// Mode changes at one and the same instant after which the plant gives up: a
/// contact, a break of stiction and a limit can coincide, more cannot.
const MAX_EVENTS_AT_ONCE: u32 = 8;

impl Plant {
    /// Changes the mode at `guard` and reports a change of contact.
    pub(crate) fn switch(
        &mut self,
        guard: Guard,
        drive: &Drive<'_>,
        interval: &Interval,
        watch: &mut impl Watch,
    ) {
        let from = self.contact();
        let acceleration_before_mps2 = self.acceleration_mps2();
        self.mode = self.axis.switch(guard, &self.mode, &mut self.y);
        let opposite = guard.opposite(&self.mode);
        self.fresh = self
            .guards(drive)
            .contains(&Some(opposite))
            .then_some(opposite);
        let to = self.contact();
        if from != to {
            watch.contact_change(&ContactChange {
                time_s: interval.now_s(),
                from,
                to,
                impact: matches!(guard, Guard::Meet(_)),
                epsilon_dot_radps: self.y[EPSILON_DOT],
                acceleration_before_mps2,
                acceleration_after_mps2: self.acceleration_mps2(),
            });
        }
    }

    /// Changes modes until every guard holds at this very instant: a contact
    /// may break the stick, a new voltage may move a rigid axis off rest.
    /// Returns the derivative.
    pub(crate) fn settle(
        &mut self,
        drive: &Drive<'_>,
        interval: &Interval,
        watch: &mut impl Watch,
    ) -> Result<Vector, PlantError> {
        let time_s = interval.now_s();
        for _ in 0..MAX_EVENTS_AT_ONCE {
            let dy = self.axis.derivative(&self.mode, drive, time_s, &self.y);
            let instant = Instant {
                time_s,
                side: Side::After,
                y: &self.y,
                dy: &dy,
            };
            let broken = self.guards(drive).into_iter().flatten().find(|&guard| {
                let (value, rate) = self.axis.guard(guard, &self.mode, drive, instant);
                self.fresh != Some(guard) && (value < 0.0 || value == 0.0 && rate < 0.0)
            });
            match broken {
                None => return Ok(dy),
                Some(guard) => self.switch(guard, drive, interval, watch),
            }
        }
        Err(PlantError::TooManyEvents { time_s })
    }

    pub(crate) fn guards(&self, drive: &Drive<'_>) -> Guards {
        let feedback = matches!(drive, Drive::Feedback(_));
        self.mode.guards(self.axis.releases(), feedback)
    }
}
