//! Settings that fit by the table of fixed-point gains do fit; hardly any others do.

use bench_tests::case;
use hil_core::controllers::{
    Controller, IoKind, accepted, scaling_request, smallest_sample_time_ns,
};
use hil_core::number;
use hil_core::quantise::{PARTS, key as key_of};
use hil_core::scaling::ScalingRequest;

use super::Ran;

const GENERATOR: &str = "controller.setpoints=generator";

/// Settings of cases of different sample times, converters, resolutions and options.
const CASES: &str = include_str!("fixed_point_gains.txt");

fn with(sets: &str, key: &str, value: f64) -> ScalingRequest {
    let set = format!("{key}={value:e}");
    let all = [sets, "run.duration_s=0.01", &set];
    scaling_request(&case("paper-2", &all)).unwrap()
}

#[test]
fn the_largest_gain_fits_and_one_percent_more_does_not() {
    for sets in CASES.lines() {
        let request = scaling_request(&case("paper-2", &[sets])).unwrap();
        request.scaled_law().unwrap();
        for (index, key) in PARTS.map(key_of).into_iter().enumerate() {
            let largest = request.largest_gain(index);
            println!("{sets:?}: {key} up to {}", number::table(largest));
            let fits = with(sets, key, largest).scaled_law().is_ok();
            assert!(fits, "{key} = {largest}");
            let more = with(sets, key, 1.01 * largest).scaled_law();
            let sentence = more.unwrap_err().to_string();
            assert!(sentence.contains(key), "{key}: {sentence}");
            assert!(sentence.contains("hold at most"), "{sentence}");
        }
    }
}

/// As the table prints it, with the digits that it prints.
#[test]
fn the_printed_largest_gain_fits() {
    for sets in CASES.lines() {
        let request = scaling_request(&case("paper-2", &[sets])).unwrap();
        for (index, key) in PARTS.map(key_of).into_iter().enumerate() {
            let printed = number::table(request.largest_gain(index));
            let (mantissa, exponent) = printed.split_once("·10").unwrap_or((&printed, ""));
            let exponent: String = exponent.chars().map(plain_digit).collect();
            let exponent = if exponent.is_empty() { "0" } else { &exponent };
            let value: f64 = format!("{mantissa}e{exponent}").parse().unwrap();
            let fits = with(sets, key, value).scaled_law().is_ok();
            assert!(fits, "{sets:?}: {key} = {printed}");
        }
    }
}

/// A digit or sign that stands high.
fn plain_digit(high: char) -> char {
    let mut digits = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".chars().zip("0123456789-".chars());
    digits.find(|(from, _)| *from == high).unwrap().1
}

#[test]
fn the_smallest_sample_time_fits_and_one_percent_less_does_not() {
    for sets in CASES.lines() {
        let mut case = case("paper-2", &[sets]);
        let smallest_ns = smallest_sample_time_ns(&case).unwrap();
        let smallest_us = smallest_ns as f64 / 1e3;
        println!("{sets:?}: sample time down to {smallest_us} µs");
        let mut run_at = |sample_time_ns: u64| {
            case.controller.sample_time_ns = Some(sample_time_ns);
            Controller::new(&case, IoKind::Direct)
        };
        assert!(run_at(smallest_ns).is_ok());
        // One nanosecond is the least that there is.
        if smallest_ns > 1 {
            assert!(run_at(smallest_ns * 99 / 100).is_err());
        }
    }
}

/// The run itself accepts and refuses what the table says.
#[test]
fn the_run_agrees_with_the_table() {
    let sets = [GENERATOR, "run.duration_s=0.01"];
    let request = scaling_request(&case("paper-2", &sets)).unwrap();
    for (index, key) in PARTS.map(key_of).into_iter().enumerate() {
        let largest = request.largest_gain(index);
        let run = |value: f64| {
            let set = format!("{key}={value:e}");
            let case = case("paper-2", &[&sets[..], &[&set]].concat());
            Ran::of_case(case, IoKind::Direct)
        };
        let outcome = run(largest).unwrap().outcome;
        assert_eq!(outcome.out_of_range_samples, 0, "{key}");
        let sentence = run(1.01 * largest).unwrap_err().to_string();
        assert!(sentence.contains(key), "{sentence}");
    }
}

/// An error that stops a run stops the table too, words or not.
#[test]
fn what_no_run_takes_has_no_table() {
    for sets in [
        ["gain_change.at_s=0.5 gain_change.kp=1e9"],
        ["controller.slew_limit_codes_per_s=10 controller.anti_windup=clamp"],
    ] {
        let case = case("paper-2", &sets);
        assert!(Controller::new(&case, IoKind::Direct).is_err());
        assert!(accepted(&case, 1_000_000).is_err(), "{sets:?}");
    }
    assert!(accepted(&case("paper-2", &[]), 1_000_000).is_ok());
}

/// The refusal of paper-1 with these sets.
fn refused(sets: &[&str]) -> String {
    let request = scaling_request(&case("paper-1", sets)).unwrap();
    request.scaled_law().unwrap_err().to_string()
}

/// The number that follows these words.
fn number_after(sentence: &str, words: &str) -> f64 {
    let (_, rest) = sentence.split_once(words).unwrap();
    rest.split(' ').next().unwrap().parse().unwrap()
}

/// The boundary is told to the count, whatever the limit that was asked for.
#[test]
fn the_largest_following_error_fits_and_one_count_more_does_not() {
    const NO_INTEGRAL: &str = "controller.ki_per_s=0";
    const PER_SPEED: &str = "limits.following_error_per_speed_s";
    let lag = format!("{PER_SPEED}=0.0123");
    let dual = "load_encoder.counts_per_mm=1000 controller.feedback=dual \
                controller.derivative=measurement";
    let cases: [(&[&str], f64); 7] = [
        // 2^8 errors of the largest size, and a sum of errors up to 2^31.
        (&[], 8_388_608.0),
        // A Kp of 2 to 4 has at most 29 fraction bits, and the term 2^30 codes.
        (&[NO_INTEGRAL], 134_217_728.0),
        (&[NO_INTEGRAL, "controller.kp=3000"], 131_072.0),
        // No gain is in the way.
        (&[NO_INTEGRAL, "controller.kp=0"], 536_870_912.0),
        (&[&lag], 8_388_608.0),
        (&[GENERATOR, &lag], 8_388_608.0),
        (&[&lag, dual], 8_388_608.0),
    ];
    for (sets, range_counts) in cases {
        let with = |counts: f64| {
            let set = format!("limits.following_error_counts={counts}");
            let request = scaling_request(&case("paper-1", &[sets, &[&set]].concat()));
            request.unwrap().scaled_law()
        };
        let has_lag = sets.iter().any(|set| set.starts_with(PER_SPEED));
        let words = if has_lag { "at most " } else { "errors up to " };
        let said = with(900_000_000.0).unwrap_err().to_string();
        println!("{sets:?}: {said}");
        let largest_counts = number_after(&said, words);
        assert_eq!(number_after(&said, "errors up to "), range_counts);
        assert_eq!(largest_counts < range_counts, has_lag, "{said}");
        assert_eq!(said.contains(PER_SPEED), has_lag, "{said}");
        let scaled = with(largest_counts).unwrap();
        assert_eq!(f64::from(scaled.law.error_limit()), range_counts);
        // One sentence from one count too many to the key's last one.
        for counts in [largest_counts + 1.0, 536_870_912.0, 536_870_913.0, 1e9] {
            if counts > largest_counts {
                let more = with(counts).unwrap_err().to_string();
                let (key, because) = more.split_once(": ").unwrap();
                assert_eq!(key, format!("limits.following_error_counts = {counts}"));
                assert!(said.ends_with(because), "{more}");
            }
        }
    }
}

/// Bits that are too few are to blame, as long as more would do.
#[test]
fn the_largest_following_error_is_that_of_the_gains_in_their_bits() {
    let with = |counts: &str| {
        let limit = format!("limits.following_error_counts={counts}");
        let request = scaling_request(&case("paper-1", &["controller.word_bits=24", &limit]));
        request.unwrap().scaled_law()
    };
    assert_eq!(
        with("900000000").unwrap_err().to_string(),
        "limits.following_error_counts = 900000000: the firmware holds errors up to 1048576 counts \
         with these gains in 24 bits at this sample time"
    );
    assert!(with("1048576").is_ok());
    for counts in ["1048577", "8388608"] {
        let said = with(counts).unwrap_err().to_string();
        assert!(said.starts_with("controller.word_bits = 24: "), "{said}");
    }
}

/// A lag that leaves no count is what is too large.
#[test]
fn the_largest_lag_fits_and_one_percent_more_does_not() {
    for counts in ["2000", "300000000"] {
        let set = |counts: &str, lag: f64| {
            [
                format!("limits.following_error_counts={counts}"),
                format!("limits.following_error_per_speed_s={lag}"),
            ]
        };
        let [limit, lag] = set(counts, 1e4);
        let said = refused(&[&limit, &lag]);
        println!("{said}");
        assert!(said.starts_with("limits.following_error_per_speed_s = 10000: "));
        let beside = number_after(&said, "limits.following_error_counts = ").to_string();
        assert_eq!(beside, if counts == "2000" { "2000" } else { "1" });
        let largest = number_after(&said, "at most ");
        let [limit, lag] = set(&beside, largest);
        let request = scaling_request(&case("paper-1", &[&limit, &lag])).unwrap();
        assert!(request.scaled_law().is_ok(), "{largest}");
        let [limit, lag] = set(&beside, 1.01 * largest);
        assert!(!refused(&[&limit, &lag]).is_empty());
    }
}

/// Gains that fit no range of errors are to blame, whatever the limit: they are
/// told for the one that was asked for where they would fit it, else for the least.
#[test]
fn gains_that_fit_no_errors_are_told_first() {
    let large = "controller.kp=1e5";
    for (counts, gain, range) in [
        ("2000", "4095.5", "131072"),
        ("200000", "2047.7", "262144"),
        ("300000000", "4095.5", "131072"),
        ("900000000", "4095.5", "131072"),
    ] {
        let largest = format!("at most {gain} at this sample time and errors up to {range}");
        let said = refused(&[large, &format!("limits.following_error_counts={counts}")]);
        assert!(said.starts_with("controller.kp = 100000: "), "{said}");
        assert!(said.contains(&largest), "{said}");
        assert!(!said.contains('\n') && !said.contains("limits."), "{said}");
    }
}

/// Gains of which two are too large leave the firmware's sentence, on the least range.
#[test]
fn two_gains_that_fit_no_errors_are_told_as_the_firmware_does() {
    for counts in ["1", "200000", "300000000", "900000000"] {
        let limit = format!("limits.following_error_counts={counts}");
        let said = refused(&["controller.kp=1e5", "controller.ki_per_s=1e9", &limit]);
        assert!(said.starts_with("the word "), "{said}");
        assert!(said.contains(" of Kp has 14 fraction bits"), "{said}");
        println!("{said}");
    }
}

/// A limit serves all gains of the run.
#[test]
fn a_limit_that_only_the_next_gains_do_not_fit_is_told_with_the_change() {
    let sets = ["gain_change.at_s=0.5 limits.following_error_counts=200000"];
    let accepted = |kp: &str| accepted(&case("paper-1", &[&sets[..], &[kp]].concat()), 1_000_000);
    let said = accepted("gain_change.kp=3000").unwrap_err().to_string();
    assert_eq!(
        said,
        "limits.following_error_counts = 200000: from the gain change on, the firmware holds \
         errors up to 131072 counts with these gains at this sample time"
    );
    assert!(accepted("gain_change.kp=2000").is_ok());
}

/// An integral gain fits no errors beyond 2^23 counts; one that is rounded to 0 is none.
#[test]
fn a_gain_that_is_rounded_to_nothing_does_not_fit() {
    let largest = |counts: &str| {
        let set = format!("limits.following_error_counts={counts}");
        let request = scaling_request(&case("paper-1", &["controller.ki_per_s=0", &set])).unwrap();
        assert!(request.scaled_law().is_ok());
        request.largest_gain(1)
    };
    assert_eq!(largest("8388609"), 0.0);
    assert!(largest("8388608") > 100.0);
}
