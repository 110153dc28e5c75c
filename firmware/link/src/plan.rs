//! A plan in the memory of a chip: the words of its stretches, and the end of
//! the motion.

use firmware::{AxisState, Counts, InPlace, Setpoint, Stretch};

/// Most samples of a stretch that is curved: the sum that is checked is made
/// sample by sample.
const CURVED_SAMPLES_MAX: u32 = 1 << 14;

/// The words of a plan, in their order.
pub fn words(stretches: &[Stretch], end: i32) -> impl Iterator<Item = i32> {
    let words = stretches.iter().flat_map(Stretch::to_words);
    words.chain(core::iter::once(end))
}

/// What a source of these words gives at word `at`, which is then behind it: a
/// stretch where it is wanted, or what is none.
#[inline(always)]
pub(crate) fn next(words: &[i32], at: &mut usize, stretch: &mut Stretch) -> InPlace {
    let rest = words.get(*at..).unwrap_or_default();
    if let Some(words) = rest.first_chunk() {
        *at = at.wrapping_add(Stretch::WORDS);
        stretch.set_words(words);
        return InPlace::Stretch;
    }
    match rest.first() {
        Some(end) => InPlace::Last(Setpoint {
            position: *end,
            ..Setpoint::default()
        }),
        None => InPlace::Underrun,
    }
}

/// Walks through a plan: each stretch has samples and goes on where the one
/// before has ended, but for what two samples of acceleration make. The first that
/// does not is told.
#[inline(never)]
pub(crate) fn check(words: &[i32], axis: &AxisState) -> Result<(), u32> {
    let (mut rest, mut place) = (words, 0_u32);
    let mut stretch = Stretch::default();
    // Wherever the first one begins.
    let (mut end, mut slack) = (0, u32::MAX);
    loop {
        let is_end = rest.len() == 1;
        if let [last] = rest {
            stretch.position = Stretch::resting_at(*last).position;
            stretch.acceleration = Counts::ZERO;
        } else if let Some((words, behind)) = rest.split_first_chunk() {
            stretch.set_words(words);
            rest = behind;
        } else {
            return Err(place);
        }
        let gap = stretch.setpoint().wrapping_sub(end).unsigned_abs();
        slack = whole(stretch.acceleration).saturating_add(slack);
        if gap > slack.saturating_add(2) {
            return Err(place);
        }
        if is_end {
            return Ok(());
        }
        if !advance_to_end(&mut stretch, axis) {
            return Err(place);
        }
        (end, slack) = (stretch.setpoint(), whole(stretch.acceleration));
        place = place.wrapping_add(1);
    }
}

/// Takes a stretch to its last sample and behind it. Tells whether it is one: it
/// has samples, not too many, and the axis takes its feed-forward.
#[inline(never)]
pub(crate) fn advance_to_end(stretch: &mut Stretch, axis: &AxisState) -> bool {
    let curved = stretch.acceleration | stretch.jerk | stretch.ahead_change | stretch.ahead_growth;
    let mut samples = stretch.samples;
    if samples == 0 {
        return false;
    }
    if curved == Counts::ZERO {
        // As one long sample.
        let way = stretch.velocity.to_bits().wrapping_mul(samples.into());
        stretch.velocity = Counts::from_bits(way);
        samples = 1;
    }
    if samples > CURVED_SAMPLES_MAX {
        return false;
    }
    for _ in 0..samples {
        if !axis.takes_ahead(stretch.ahead) {
            return false;
        }
        stretch.advance();
    }
    true
}

/// The magnitude in whole counts, rounded up.
#[inline(never)]
fn whole(value: Counts) -> u32 {
    let counts = value.to_bits().unsigned_abs().wrapping_shr(32);
    // At most 2^31.
    u32::try_from(counts).unwrap_or(0).wrapping_add(1)
}
