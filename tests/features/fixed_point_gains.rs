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

/// Cases of different sample times, converters, resolutions and options.
const CASES: [&[&str]; 6] = [
    &[GENERATOR],
    &[
        GENERATOR,
        "drive.dac_bits=24",
        "encoder.counts_per_rad=63600",
        "controller.kp=0.032",
        "controller.ki_per_s=0.05",
        "controller.kd_s=0.0005",
    ],
    &[
        GENERATOR,
        "controller.sample_time_s=0.00005",
        "controller.derivative_filter_s=0.001",
    ],
    &[
        GENERATOR,
        "controller.sample_time_s=0.01",
        "controller.anti_windup=clamp",
    ],
    &[
        GENERATOR,
        "controller.velocity_ff_s=0.07",
        "controller.friction_ff_codes=20",
    ],
    &[
        GENERATOR,
        "load_encoder.counts_per_mm=1000",
        "controller.feedback=dual",
        "controller.derivative=measurement",
    ],
];

fn with(sets: &[&str], key: &str, value: f64) -> ScalingRequest {
    let set = format!("{key}={value:e}");
    let all = [sets, &["run.duration_s=0.01", &set]].concat();
    scaling_request(&case("paper-2", &all)).unwrap()
}

#[test]
fn the_largest_gain_fits_and_one_percent_more_does_not() {
    for sets in CASES {
        let request = scaling_request(&case("paper-2", sets)).unwrap();
        request.scaled_law().unwrap();
        for (index, key) in PARTS.map(key_of).into_iter().enumerate() {
            let largest = request.largest_gain(index);
            println!("{sets:?}: {key} up to {}", number::table(largest));
            assert!(
                with(sets, key, largest).scaled_law().is_ok(),
                "{key} = {largest}"
            );
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
    for sets in CASES {
        let request = scaling_request(&case("paper-2", sets)).unwrap();
        for (index, key) in PARTS.map(key_of).into_iter().enumerate() {
            let printed = number::table(request.largest_gain(index));
            let (mantissa, exponent) = printed.split_once("·10").unwrap_or((&printed, ""));
            let exponent: String = exponent.chars().map(plain_digit).collect();
            let value: f64 = format!(
                "{mantissa}e{}",
                if exponent.is_empty() { "0" } else { &exponent }
            )
            .parse()
            .unwrap();
            assert!(
                with(sets, key, value).scaled_law().is_ok(),
                "{sets:?}: {key} = {printed}"
            );
        }
    }
}

/// A digit or sign that stands high.
fn plain_digit(high: char) -> char {
    "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"
        .chars()
        .zip("0123456789-".chars())
        .find_map(|(from, to)| (from == high).then_some(to))
        .unwrap()
}

#[test]
fn the_smallest_sample_time_fits_and_one_percent_less_does_not() {
    for sets in CASES {
        let mut case = case("paper-2", sets);
        let smallest_ns = smallest_sample_time_ns(&case).unwrap();
        println!(
            "{sets:?}: sample time down to {} µs",
            smallest_ns as f64 / 1e3
        );
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
            Ran::of_case(
                case("paper-2", &[&sets[..], &[&set]].concat()),
                IoKind::Direct,
            )
        };
        assert_eq!(
            run(largest).unwrap().outcome.out_of_range_samples,
            0,
            "{key}"
        );
        let sentence = run(1.01 * largest).unwrap_err().to_string();
        assert!(sentence.contains(key), "{sentence}");
    }
}

/// An error that stops a run stops the table too, words or not.
#[test]
fn what_no_run_takes_has_no_table() {
    for sets in [
        ["gain_change.at_s=0.5", "gain_change.kp=1e9"],
        [
            "controller.slew_limit_codes_per_s=10",
            "controller.anti_windup=clamp",
        ],
    ] {
        let case = case("paper-2", &sets);
        assert!(Controller::new(&case, IoKind::Direct).is_err());
        assert!(accepted(&case, 1_000_000).is_err(), "{sets:?}");
    }
    assert!(accepted(&case("paper-2", &[]), 1_000_000).is_ok());
}
