//! Cost of a sample where the axis is a constant of the image, feature by
//! feature: the time of every sample goes to the host over `from-chip`.
//!
//! Frames of [`firmware_link::frame`], in this order and unasked:
//!
//! | body | meaning |
//! | --- | --- |
//! | [`Reply::Hello`] | the identity, session and number 0 |
//! | `41`, text | name of the feature whose samples follow |
//! | `42`, 4 bytes each, lowest first | ticks of its samples, in their order |
//! | [`Reply::Status`] | deepest stack and all samples; nothing follows |

#![no_std]
#![no_main]

mod axes;
mod features;
mod motor;
mod samples;

use features::{LAWS, TICKS};
use images::chip::Chip;
use images::host::{self, File, Mode};
use samples::Samples;

#[images::entry]
fn main() -> ! {
    let mut chip = Chip::at_start();
    report(&mut chip);
    host::exit()
}

/// All features; `None` where the host does not listen.
fn report(chip: &mut Chip) -> Option<()> {
    // The host opens its ends in the same order: each waits for the other. It
    // has nothing to say.
    let _requests = File::open(c"to-chip", Mode::Read)?;
    let host = File::open(c"from-chip", Mode::Write)?;
    let mut samples = Samples::begin(chip, &host)?;
    for feature in LAWS {
        samples.name(feature.name)?;
        motor::drive_law(&feature, &mut samples)?;
    }
    for feature in TICKS {
        samples.name(feature.name)?;
        motor::drive_axis(&feature, &mut samples)?;
    }
    samples.end()
}
