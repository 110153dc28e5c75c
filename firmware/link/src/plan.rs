//! A plan in the memory of a chip: the words of its stretches, and the end of
//! the motion.

use firmware::{AxisState, Codes, Counts, InPlace, Setpoint, Stretch};

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
        *at = at.saturating_add(Stretch::WORDS);
        stretch.set_words(words);
        return InPlace::Stretch;
    }
    let last = |position| Setpoint {
        position,
        ..Setpoint::default()
    };
    let end = rest.first().map(|end| InPlace::Last(last(*end)));
    end.unwrap_or(InPlace::Underrun)
}

/// Walks through a plan: each stretch has samples and goes on where the one
/// before has ended, but for what two samples of acceleration make. The first that
/// does not is told.
#[inline(never)]
pub(crate) fn check(words: &[i32], axis: &AxisState) -> Result<(), u32> {
    let (words, rest) = words.as_chunks();
    let (mut before, mut place) = (None, 0_u32);
    for words in words {
        let mut stretch = Stretch::from_words(words);
        if !goes_on(before, &stretch) || !advance_to_end(&mut stretch, axis) {
            return Err(place);
        }
        before = Some((stretch.setpoint(), whole(stretch.acceleration)));
        place = place.saturating_add(1);
    }
    match rest {
        [end] if goes_on(before, &Stretch::resting_at(*end)) => Ok(()),
        _ => Err(place),
    }
}

/// Tells whether a stretch begins where the one `before` has led, at a setpoint
/// with an acceleration in whole counts.
#[inline(never)]
fn goes_on(before: Option<(i32, u32)>, stretch: &Stretch) -> bool {
    before.is_none_or(|(setpoint, acceleration)| {
        let gap = stretch.setpoint().wrapping_sub(setpoint).unsigned_abs();
        let accelerations = whole(stretch.acceleration).saturating_add(acceleration);
        gap <= accelerations.saturating_add(2)
    })
}

/// Takes a stretch to its last sample and behind it. Tells whether it is one: it
/// has samples, not too many, and the axis takes its feed-forward.
#[inline(never)]
pub(crate) fn advance_to_end(stretch: &mut Stretch, axis: &AxisState) -> bool {
    let straight = stretch.acceleration == Counts::ZERO
        && stretch.jerk == Counts::ZERO
        && stretch.ahead_change == Codes::ZERO
        && stretch.ahead_growth == Codes::ZERO;
    let mut samples = stretch.samples;
    if straight && samples > 0 {
        // As one long sample.
        let way = stretch.velocity.to_bits().wrapping_mul(samples.into());
        stretch.velocity = Counts::from_bits(way);
        samples = 1;
    }
    let mut takes = samples > 0 && samples <= CURVED_SAMPLES_MAX;
    while takes && samples > 0 {
        takes = axis.takes_ahead(stretch.ahead);
        stretch.advance();
        samples = samples.saturating_sub(1);
    }
    takes
}

/// The magnitude in whole counts, rounded up.
fn whole(value: Counts) -> u32 {
    value
        .to_bits()
        .unsigned_abs()
        .wrapping_shr(32)
        .try_into()
        .unwrap_or(u32::MAX - 1)
        .saturating_add(1)
}
