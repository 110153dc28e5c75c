//! Four watches over an axis: each looks at one sample and gives a [`crate::Trip`]
//! when its limit is passed.
//!
//! | watch | trips when |
//! | --- | --- |
//! | [`FollowingErrorWatch`] | `\|e\| > a + s·\|v_ref\|` |
//! | [`EncoderLossWatch`] | `\|code\|` ≥ threshold and no count for `ticks` samples in a row |
//! | [`SaturationWatch`] | output at a limit for more than `ticks` samples in a row |
//! | [`TickWatch`] | a tick is not the successor of the last one |
//!
//! A watch goes on tripping while its condition lasts; which fault was the
//! first is for [`crate::FaultLatch`] to remember.

mod encoder_loss;
mod error;
mod following_error;
mod saturation;
mod ticks;

pub use encoder_loss::{EncoderLossState, EncoderLossWatch};
pub use error::WatchError;
pub use following_error::{FollowingErrorState, FollowingErrorWatch};
pub use saturation::{SaturationState, SaturationWatch};
pub use ticks::{TickState, TickWatch};

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
