//! Motions: intervals, limits, profiles, and rows of moves.

use hil_core::case::Case;
use plant::{Course, Motion, MotionLimits};

use super::{BASE, messages, parse};

/// [`BASE`] with other lines for those of its `[motion]`.
fn with_motion(lines: &str) -> String {
    let (before, rest) = BASE.split_once("[motion]\n").unwrap();
    let (_, after) = rest.split_once("\n[").unwrap();
    format!("{before}{lines}\n[{after}")
}

fn motion(lines: &str) -> Motion {
    let case = parse(&with_motion(lines), &[]).unwrap_or_else(|errors| panic!("{errors}"));
    case.motion
}

const LIMITS: &str = "[motion]
travel_mm = -40.0
max_acceleration_mps2 = 4.0
";

const MOVES: &str = "[[move]]
travel_mm = 40.0
intervals_s = [0.1, 0, 0.1, 0, 0.1, 0, 0.1]
total_time_s = 0.2
dwell_s = 0.05

[[move]]
travel_mm = -10.0
max_acceleration_mps2 = 4.0
max_velocity_mps = 0.1
max_jerk_mps3 = 80.0
";

#[test]
fn limits_are_read_in_their_units() {
    let limits = MotionLimits {
        acceleration_mps2: 4.0,
        velocity_mps: f64::INFINITY,
        jerk_mps3: f64::INFINITY,
    };
    assert_eq!(motion(LIMITS), Motion::limited(-0.04, limits).unwrap());
    let all = format!("{LIMITS}max_velocity_mps = 0.1\nmax_jerk_mps3 = 80\n");
    let limits = MotionLimits {
        velocity_mps: 0.1,
        jerk_mps3: 80.0,
        ..limits
    };
    assert_eq!(motion(&all), Motion::limited(-0.04, limits).unwrap());
    assert_ne!(motion(&all), motion(LIMITS));
    // Which stay settings of the command.
    assert!(matches!(motion(&all).course(), Course::Limits(of, _) if *of == limits));
}

#[test]
fn moves_follow_each_other_with_their_dwells() {
    let stretched = Motion::new(0.04, [0.05, 0.0, 0.05, 0.0, 0.05, 0.0, 0.05]).unwrap();
    let limits = MotionLimits {
        acceleration_mps2: 4.0,
        velocity_mps: 0.1,
        jerk_mps3: 80.0,
    };
    let back = Motion::limited(-0.01, limits).unwrap();
    let row = Motion::row(&[(stretched.clone(), 0.05), (back.clone(), 0.0)]).unwrap();
    assert_eq!(motion(MOVES), row);
    assert_eq!((row.travel_m(), row.largest_displacement_m()), (0.03, 0.04));
    let other = MOVES.replace("dwell_s = 0.05", "dwell_s = 0.06");
    assert_ne!(motion(&other), row);
    // The keys of a row can be set, one way for another too.
    let set = parse(
        &with_motion(MOVES),
        &["move.2.intervals_s=[0.1,0,0.1,0,0.1,0,0.1]"],
    );
    let back = Motion::new(-0.01, [0.1, 0.0, 0.1, 0.0, 0.1, 0.0, 0.1]).unwrap();
    let row = Motion::row(&[(stretched, 0.05), (back, 0.0)]).unwrap();
    assert_eq!(set.unwrap().motion, row);
}

#[test]
fn a_profile_comes_from_the_file_beside() {
    let points = [(0.0, 0.0), (1.0, 0.0005), (2.0, 0.002)];
    let found = motion("[motion]\nprofile = \"one\"\n");
    assert_eq!(found, Motion::profile(&points).unwrap());
    assert_ne!(found, motion("[motion]\nprofile = \"two\"\n"));
    let set = parse(BASE, &["motion.profile=one"]).unwrap();
    assert_eq!(set.motion, found);
}

#[test]
fn mistakes_are_told_where_they_stand() {
    let told = |lines: &str, sets: &[&str]| messages(&with_motion(lines), sets).join("\n");
    let profile = told("[motion]\nprofile = \"three\"\n", &[]);
    assert!(
        profile.ends_with("motion.profile = \"three\" is not allowed: there is no three"),
        "{profile}"
    );
    let blank = told("[motion]\nprofile = \"blank\"\n", &[]);
    assert!(
        blank.contains("blank:6: t_s = 1 must be greater"),
        "{blank}"
    );
    let both = told(&format!("{LIMITS}{MOVES}"), &[]);
    assert!(both.contains("there too; a file has one of them"), "{both}");
    let mixed = told(&format!("{MOVES}intervals_s = [1, 1, 1, 1, 1, 1, 1]"), &[]);
    assert!(
        mixed.contains("move.2.intervals_s = ")
            && mixed.contains("move.2.max_acceleration_mps2 = 4.0 (line"),
        "{mixed}"
    );
    let none = told("", &[]);
    assert!(none.ends_with("or profile, or [[move]]"), "{none}");
    let lacking = told("[[move]]\ntravel_mm = 1\n", &[]);
    assert!(lacking.contains("[move.1] (line"), "{lacking}");
    let no_rise = told(MOVES, &["move.1.intervals_s=[0,0,0,0,1,0,0]"]);
    assert!(
        no_rise.contains("move.1.intervals_s") && no_rise.contains("needs an acceleration"),
        "{no_rise}"
    );
    assert_eq!(told(MOVES, &[]), "");
}

/// The generator and the queue plan one move; the table holds any command.
#[test]
fn the_generator_plans_one_move() {
    let of_firmware = |lines: &str, origin: &str| {
        let origin = format!("controller.setpoints={origin}");
        messages(&with_motion(lines), &["controller.law=firmware", &origin])
    };
    let profile = "[motion]\nprofile = \"one\"\n";
    for (lines, what) in [(MOVES, "several moves"), (profile, "a profile")] {
        for origin in ["table", "queue"] {
            assert_eq!(of_firmware(lines, origin), [""; 0], "{what}");
        }
        let told = of_firmware(lines, "generator");
        assert!(told.len() == 1 && told[0].contains(what), "{told:?}");
    }
    let one = MOVES.split("\n\n").next().unwrap();
    for lines in [LIMITS, one] {
        for origin in ["table", "generator", "queue"] {
            assert_eq!(of_firmware(lines, origin), [""; 0], "{lines}");
        }
    }
}

/// A limit that refers to the travel refers to the farthest on the way.
#[test]
fn default_limits_follow_the_farthest_displacement() {
    let limits = |case: &Case| {
        let (limits, _) = hil_core::budget::limits(case);
        let find = |key| limits.iter().find(|l| l.figure == key).map(|l| l.limit);
        find("peak_following_error_mm").zip(find("peak_abs_acc_mps2"))
    };
    let there_and_back = MOVES.replace("-10.0", "-40.0");
    let case = parse(&with_motion(&there_and_back), &[]).unwrap();
    assert_eq!(case.motion.travel_m(), 0.0);
    assert_eq!(limits(&case).unwrap().0, 0.8);
    let still = LIMITS.replace("-40.0", "0.0");
    assert_eq!(limits(&parse(&with_motion(&still), &[]).unwrap()), None);
}
