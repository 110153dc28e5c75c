//! Plans are the same bits from version to version: traces depend on them.

use firmware::law::LawWords;
use firmware::{GainWord, MotionPlan};

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    /// Of any magnitude below 2^bits.
    fn any(&mut self, bits: u64) -> u64 {
        match self.below(bits + 1) {
            0 => 0,
            length => self.next() >> (64 - length),
        }
    }
}

/// FNV-1a over the words of all plans and refusals; every fourth motion is of any
/// magnitudes, the others last some samples, picoseconds more or less.
fn hash(cases: u32) -> (u64, u32) {
    let mut random = Random(1);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut planned = 0;
    let mut take = |value: i64| {
        for byte in value.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    };
    for case in 0..cases {
        let period_ns = random.any(32) as u32;
        let sample_ps = u64::from(period_ns) * 1_000;
        let intervals_ps = [(); 7].map(|()| match (case % 4, random.below(4)) {
            (_, 0) => 0,
            (0, _) => random.any(62),
            (_, 1) => random.below(5),
            (1, _) => sample_ps * random.below(40),
            _ => sample_ps * random.any(11) + random.any(11),
        });
        let travel = random.any(63).cast_signed() * [1, -1][(case % 2) as usize];
        let mut gain = || GainWord::new(random.any(32) as i32, random.below(40) as u8);
        let words = LawWords {
            velocity_ff: gain(),
            acceleration_ff: gain(),
            friction_ff: gain(),
            ..LawWords::NONE
        };
        match MotionPlan::new(travel, intervals_ps, period_ns) {
            Err(refusal) => take(refusal.value),
            Ok(plan) => {
                planned += 1;
                take(plan.head().last_sample.cast_signed());
                take(plan.head().velocity_fraction_bits.into());
                take(plan.head().acceleration_fraction_bits.into());
                let stretches = plan.stretches(&words, case.cast_signed());
                for word in stretches.take(40).flat_map(|stretch| stretch.to_words()) {
                    take(word.into());
                }
            }
        }
    }
    (hash, planned)
}

#[test]
fn plans_are_those_of_every_version() {
    let (hash, planned) = hash(4_000);
    assert!(planned > 2_000, "{planned}");
    assert_eq!(
        format!("{hash:016x}"),
        "6d441525cfb79db0",
        "of {planned} plans"
    );
}
