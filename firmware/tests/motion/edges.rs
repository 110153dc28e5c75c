//! Motions at the edge of what there is, and beyond.

use firmware::law::LawWords;
use firmware::refusal::What;
use firmware::{Codes, GainWord, MotionPlan, Stretch};

use super::{Sample, all, samples};

#[test]
fn the_feed_forward_belongs_to_what_follows_a_jump() {
    // 8 counts up in 4 samples and down in 4, no rest between: ±0.5.
    let each_ps = 4_000_000_000;
    let plan = MotionPlan::new(8 << 32, [0, each_ps, 0, 0, 0, each_ps, 0], 1_000_000);
    let plan = plan.expect("a plan");
    let words = LawWords {
        acceleration_ff: GainWord::new(1, plan.head().acceleration_fraction_bits),
        ..LawWords::NONE
    };
    let stretches: Vec<Stretch> = plan.stretches(&words, 0).collect();
    let half = Codes::from_num(0.5);
    let seen: Vec<Codes> = samples(stretches.into_iter()).map(|s| s.ahead).collect();
    assert_eq!(seen, [[half; 4], [-half; 4]].concat());
}

#[test]
fn no_travel_is_a_rest_of_the_same_length() {
    let plan = MotionPlan::new(0, [1_000_000_007; 7], 1_000_000).expect("a plan");
    assert_eq!(plan.head().last_sample, 8);
    let rest = Sample {
        position: 0,
        ahead: Codes::ZERO,
    };
    assert_eq!(all(&plan), [rest; 8]);
    // Nor is there friction to pay for, or a flank to take: contrast, a travel.
    let words = LawWords {
        friction_ff: GainWord::new(40, 0),
        ..LawWords::NONE
    };
    let signs = |travel: i64| {
        let plan = MotionPlan::new(travel, [1_000_000_007; 7], 1_000_000).expect("a plan");
        let first = plan.stretches(&words, 0).next().expect("a stretch");
        (first.ahead, first.velocity_sign)
    };
    assert_eq!(signs(0), (Codes::ZERO, 0));
    assert_eq!(signs(-8 << 32), (Codes::from_num(-40), -1));
}

#[test]
fn a_motion_shorter_than_a_sample_is_a_step() {
    let plan = MotionPlan::new(5 << 31, [1, 0, 0, 0, 0, 0, 900_000_000], 1_000_000);
    let plan = plan.expect("a plan");
    let positions: Vec<i32> = all(&plan).iter().map(|s| s.position).collect();
    assert_eq!((positions, plan.head().end), (vec![0], 3), "floor(2.5 + ½)");
}

#[test]
fn what_cannot_be_generated_is_refused() {
    let second = 1_000_000_000_000;
    let fine = [second, 0, 0, 0, 0, 0, second];
    let refused = |travel, intervals, period| {
        MotionPlan::new(travel, intervals, period).expect_err("refused")
    };
    let day = 86_400 * second;
    let cases = [
        (
            refused(1, fine, 0),
            (What::Period, 0, [1, u32::MAX.into()]),
            "the sample time is 0; it must be at least 1 ns",
        ),
        (
            refused(i64::MIN, fine, 1),
            (What::Travel, i64::MIN, [-i64::MAX, i64::MAX]),
            "a travel of -9223372036854775808/2^32 counts is too long; \
             it must be shorter than 2^31 counts",
        ),
        (
            refused(1, [0, 0, 0, second, second, 0, 0], 1),
            (What::Rise, 0, [1, i64::MAX]),
            "the intervals 1 to 3 are all 0; one of them must be longer to gain speed",
        ),
        (
            refused(1, [0, 0, second, second, 0, 0, 0], 1),
            (What::Fall, 0, [1, i64::MAX]),
            "the intervals 5 to 7 are all 0; one of them must be longer to lose speed",
        ),
        (
            refused(1, [54 * day, 0, 0, 0, 0, 0, second], 1_000_000),
            (What::Duration, 4_665_601_000_000_000_000, [0, 1 << 62]),
            "the intervals add up to 4665601000000000000 ps; \
             together they may last 2^62 ps, 53 days",
        ),
        (
            refused(1 << 62, [0, second, 0, 0, 0, second, 0], 1_000_000_000),
            (What::Velocity, 1 << 30, [0, (1 << 24) - 1]),
            "the motion reaches 1073741824 counts per sample; it must stay below 2^24, \
             with a longer motion or a shorter sample time",
        ),
        (
            refused(1 << 60, [0, second, 0, 0, 0, 1, 0], 1_000_000),
            (
                What::Acceleration(6),
                536_870_911_999_463,
                [0, (1 << 24) - 1],
            ),
            "interval 6 accelerates by 536870911999463 counts per sample²; it must stay \
             below 2^24, with a longer interval or a shorter sample time",
        ),
    ];
    for (error, expected, sentence) in cases {
        let found = (error.what, error.value, [error.least, error.most]);
        assert_eq!(found, expected);
        assert_eq!(error.to_string(), sentence);
    }
}
