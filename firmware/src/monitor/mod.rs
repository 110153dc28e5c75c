//! Four monitors over an axis: each looks at one sample and gives a [`crate::Trip`]
//! when its limit is passed.
//!
//! | monitor | trips when |
//! | --- | --- |
//! | [`FollowingErrorMonitor`] | `\|e\| > a + s·\|v_ref\|` |
//! | [`EncoderLossMonitor`] | `\|code\|` ≥ threshold and no count for `ticks` samples in a row |
//! | [`SaturationMonitor`] | output at a limit for more than `ticks` samples in a row |
//! | [`TickMonitor`] | a tick is not the successor of the last one |
//!
//! A monitor goes on tripping while its condition lasts; which fault was the
//! first is for [`crate::FaultLatch`] to remember.

mod encoder_loss;
mod error;
mod following_error;
mod saturation;
mod ticks;

pub use encoder_loss::{EncoderLossMonitor, EncoderLossState};
pub use error::MonitorError;
pub use following_error::{FollowingErrorMonitor, FollowingErrorState};
pub use saturation::{SaturationMonitor, SaturationState};
pub use ticks::{TickMonitor, TickState};

/// The length of a run of samples after one more; it ends where the condition
/// does, and stays at its largest value.
#[inline]
const fn lengthened(samples: u32, goes_on: bool) -> u32 {
    if goes_on {
        samples.saturating_add(1)
    } else {
        0
    }
}
