//! Random numbers by place: draw `i` of axis `j` is the same whoever asks for
//! it, in whatever order.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// A number in \[0, 1), 53 bits of it: draw `index` of axis `axis` under `seed`.
pub(super) fn unit(seed: u64, axis: u64, index: u64) -> f64 {
    let [high, low, stream] = [0, 1, 2].map(|part| mix(mix(seed, axis), part));
    let state = (u128::from(high) << 64) | u128::from(low);
    let mut generator = Pcg64::new(state, stream.into());
    generator.advance(index.into());
    from_bits(generator.next_u64())
}

/// The upper 53 of 64 bits as a number in \[0, 1).
#[expect(clippy::cast_precision_loss, reason = "53 bits")]
pub(super) fn from_bits(bits: u64) -> f64 {
    // 2^-53
    (bits >> 11) as f64 / 9_007_199_254_740_992.0
}

/// Two numbers into one without a pattern: the finaliser of `SplitMix64`
/// (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
pub(super) fn mix(a: u64, b: u64) -> u64 {
    let mut z = a
        .wrapping_add(b.wrapping_mul(0xd1b5_4a32_d192_ed03))
        .wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Place of `index` in a shuffled row of `count`, `index` < `count`: a Feistel
/// network over the next power of four, walked until it falls inside (Black,
/// Rogaway, "Ciphers with arbitrary finite domains", 2002). Needs no memory.
pub(super) fn shuffled(seed: u64, axis: u64, index: u64, count: u64) -> u64 {
    const ROUNDS: u64 = 6;
    let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mask = (1_u64 << half) - 1;
    let key = mix(seed, mix(axis, 3));
    let mut place = index;
    loop {
        let (mut left, mut right) = (place >> half, place & mask);
        for round in 0..ROUNDS {
            (left, right) = (right, left ^ (mix(key ^ round, right) & mask));
        }
        place = (left << half) | right;
        if place < count {
            return place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_taken_once() {
        for count in [1, 2, 3, 5, 64, 100, 1000, 4097] {
            let mut places: Vec<u64> = (0..count).map(|i| shuffled(7, 0, i, count)).collect();
            let in_order = places.is_sorted();
            places.sort_unstable();
            assert_eq!(places, (0..count).collect::<Vec<_>>());
            assert!(count < 5 || !in_order, "{count} places are not shuffled");
        }
    }

    /// Mean and variance of a uniform number, and no correlation of axes or of
    /// neighbours: each within five standard deviations of 20,000 draws.
    #[test]
    fn draws_are_uniform_and_independent() {
        let n = 20_000;
        let draws = |axis| (0..n).map(move |i| unit(1, axis, i) - 0.5);
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / n as f64;
        let tolerance = 5.0 / (n as f64).sqrt();
        assert!(mean(&mut draws(0)).abs() < tolerance * (1.0_f64 / 12.0).sqrt());
        let variance = mean(&mut draws(0).map(|u| u * u));
        assert!((variance - 1.0 / 12.0).abs() < tolerance / 180.0_f64.sqrt());
        for other in [1, 2] {
            let across = mean(&mut draws(0).zip(draws(other)).map(|(u, v)| u * v));
            assert!(across.abs() < tolerance / 12.0, "axis {other}: {across}");
        }
        let neighbours = mean(&mut draws(0).zip(draws(0).skip(1)).map(|(u, v)| u * v));
        assert!(neighbours.abs() < tolerance / 12.0);
        // The measure finds what is not independent.
        assert!(mean(&mut draws(0).zip(draws(0)).map(|(u, v)| u * v)) > tolerance / 12.0);
    }
}
