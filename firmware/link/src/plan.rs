//! A plan in the memory of a chip: the words of its stretches, and the end of
//! the motion.

use firmware::{AxisState, Counts, Next, Setpoint, Stretch};

/// Most samples of a stretch that is curved: the sum that is checked is made
/// sample by sample.
const CURVED_SAMPLES_MAX: u32 = 1 << 14;

/// The words of a plan, in their order.
pub fn words(stretches: &[Stretch], end: i32) -> impl Iterator<Item = i32> {
    let words = stretches.iter().flat_map(Stretch::to_words);
    words.chain(core::iter::once(end))
}

/// What a source of these words gives at word `at`, and the word after it.
pub(crate) fn next(words: &[i32], at: usize) -> Option<(Next, usize)> {
    let rest = words.get(at..)?;
    match rest.split_first_chunk() {
        Some((stretch, _)) => {
            let after = at.saturating_add(Stretch::WORDS);
            Some((Next::Stretch(Stretch::from_words(stretch)), after))
        }
        None => {
            let position = *rest.first()?;
            let last = Setpoint {
                position,
                ..Setpoint::default()
            };
            Some((Next::Last(last), at))
        }
    }
}

/// Walks through a plan: each stretch has samples and goes on where the one
/// before has ended, but for what two samples of acceleration make. The first that
/// does not is told.
pub(crate) fn check(words: &[i32], axis: &AxisState) -> Result<(), u32> {
    let (mut at, mut stretches) = (0, 0_u32);
    let mut before: Option<Stretch> = None;
    loop {
        let (from, after) = match next(words, at) {
            Some((Next::Stretch(stretch), after)) => (stretch, Some(after)),
            Some((Next::Last(last), _)) if words.len() == at.saturating_add(1) => {
                (Stretch::resting_at(last.position), None)
            }
            _ => return Err(stretches),
        };
        let goes_on = before.is_none_or(|before| {
            let gap = from.setpoint().wrapping_sub(before.setpoint());
            let [a, b] = [before, from].map(|stretch| whole(stretch.acceleration));
            gap.unsigned_abs() <= a.saturating_add(b).saturating_add(2)
        });
        let Some(after) = after.filter(|_| goes_on) else {
            return if goes_on { Ok(()) } else { Err(stretches) };
        };
        before = Some(end_of(from, axis).ok_or(stretches)?);
        at = after;
        stretches = stretches.saturating_add(1);
    }
}

/// A stretch after its last sample; none of one without samples, with too many, or
/// whose feed-forward the axis does not take.
pub(crate) fn end_of(mut stretch: Stretch, axis: &AxisState) -> Option<Stretch> {
    if stretch.samples == 0 || !axis.takes_ahead(stretch.ahead) {
        return None;
    }
    let straight = stretch.acceleration == 0 && stretch.jerk == 0;
    if straight && stretch.ahead_change == 0 && stretch.ahead_growth == 0 {
        let samples = i64::from(stretch.samples);
        let way = stretch.velocity.to_bits().wrapping_mul(samples);
        stretch.position = stretch.position.wrapping_add(Counts::from_bits(way));
        return Some(stretch);
    }
    if stretch.samples > CURVED_SAMPLES_MAX {
        return None;
    }
    for _ in 0..stretch.samples {
        if !axis.takes_ahead(stretch.ahead) {
            return None;
        }
        stretch.advance();
    }
    Some(stretch)
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
