//! The bits of whole runs: the same on every machine, at every level of
//! optimisation and with every set of instructions.
//!
//! ```text
//! cargo test -p bench-tests --test bits                      as tests are built
//! cargo test -p bench-tests --test bits --profile bits       not optimised
//! cargo test -p bench-tests --test bits --release            as it is shipped
//! ```
//!
//! `BLESS=1` prints the table of a build instead of comparing it: to be
//! copied here after an intended change, and only then.

use bench_tests::digest::Digest;
use bench_tests::solvers::run_exactly;
use bench_tests::{case, rows};
use hil_core::case::{Case, Law};
use hil_runner::host::LinkKind;

/// Keeps the exact solver away from a variant.
const DOPRI5: &str = "run.solver=dopri5";

/// A change of a built-in case: its name here, the case, its overrides.
const VARIANTS: [(&str, &str, &[&str]); 12] = [
    ("1", "paper-1", &[]),
    ("2", "paper-2", &[]),
    ("3", "paper-3", &[]),
    ("4", "paper-4", &[]),
    (
        "delay",
        "paper-4",
        &["controller.computation_delay_s=0.0003"],
    ),
    ("no pull", "paper-1", &["transmission.no_pull=true"]),
    (
        "friction",
        "paper-3",
        &[
            "carriage.resistance_constant_n=60",
            "carriage.resistance_linear_ns_per_rad=0.5",
            "carriage.resistance_opposes_motion=true",
        ],
    ),
    ("rigid", "paper-2", &["transmission.joint=rigid"]),
    ("no gap", "paper-2", &["transmission.backlash_half_deg=0"]),
    ("limited", "paper-2", &["drive.voltage_limit_v=40"]),
    ("dopri5", "paper-2", &[DOPRI5]),
    (
        "dopri5, no affine plant",
        "paper-3",
        &[
            DOPRI5,
            "carriage.resistance_quadratic_ns2_per_rad2=0.001",
            "carriage.resistance_opposes_motion=true",
        ],
    ),
];

/// Digests by variant and, from the left, by rung.
const PINNED: [(&str, [u64; 4]); 12] = [
    (
        "1",
        [
            0x33e7_969d_d2ce_7b20,
            0xe6d5_8788_a61a_64c9,
            0x688b_79f6_93b9_54b2,
            0x74cd_a2db_6e18_387a,
        ],
    ),
    (
        "2",
        [
            0xe198_3715_d6f1_db03,
            0x96b8_869c_d6fa_e09b,
            0x815d_6d4c_e7a3_0b97,
            0x8b5f_ded7_5e17_b37f,
        ],
    ),
    (
        "3",
        [
            0x23cd_1f3b_0b5b_8970,
            0xc217_b9c0_ee2c_6cbb,
            0xa055_95d6_693a_1b6a,
            0xa055_95d6_693a_1b6a,
        ],
    ),
    (
        "4",
        [
            0x7940_03fa_a655_3f8d,
            0x8198_e7cf_df67_06c7,
            0x7199_71fb_9001_9111,
            0x2706_b1c6_3bb3_a10a,
        ],
    ),
    (
        "delay",
        [
            0x7940_03fa_a655_3f8d,
            0xbe60_84c6_9f2a_0aa3,
            0xdf0c_f2be_968f_63cc,
            0x5d7d_b051_272e_3e55,
        ],
    ),
    (
        "no pull",
        [
            0x5939_a413_d486_30a1,
            0xd8ca_de8b_8dec_bfe8,
            0x29a0_cb64_7acc_3c6f,
            0xdad1_dcd5_e074_78df,
        ],
    ),
    (
        "friction",
        [
            0x4543_0d71_a182_3bc5,
            0x2ca2_70bb_ed88_c0f5,
            0xff72_33a4_8fb6_6b8e,
            0x50df_98ad_a389_58e7,
        ],
    ),
    (
        "rigid",
        [
            0xa0ca_3613_0ba6_86bb,
            0xd780_d151_56fe_8416,
            0xdd6c_d496_ba29_02af,
            0xdc7d_12f2_5fe9_2187,
        ],
    ),
    (
        "no gap",
        [
            0x36e0_4f5e_eed2_62a9,
            0xbe17_852f_bcec_d127,
            0xda9b_5570_3598_0ee0,
            0xda9b_5570_3598_0ee0,
        ],
    ),
    (
        "limited",
        [
            0x5048_e183_f34b_5de5,
            0x01e8_3cec_5b98_16e5,
            0x9ec5_c4d4_011f_0f62,
            0x9ec5_c4d4_011f_0f62,
        ],
    ),
    (
        "dopri5",
        [
            0x3b5a_73a5_3af0_03ad,
            0xb9df_5747_b442_5c24,
            0x8969_40db_75c0_8c84,
            0x7ce7_9044_70c1_9db4,
        ],
    ),
    (
        "dopri5, no affine plant",
        [
            0x70db_41a6_9bff_5c4b,
            0x0622_139b_a910_2ea0,
            0xb8f3_286e_4834_c619,
            0x3da0_830b_e399_4023,
        ],
    ),
];

fn digests(name: &str, sets: &[&str]) -> [u64; 4] {
    Law::ALL.map(|law| {
        let rung = format!("controller.law={}", law.name());
        let mut case = case(name, &[sets, &[rung.as_str()]].concat());
        if !sets.contains(&DOPRI5) {
            case = run_exactly(&case);
        }
        let (rows, outcome) = rows(&case, LinkKind::InProcess);
        Digest::of_run(&rows, &outcome)
    })
}

#[test]
fn bits_are_the_pinned_ones() {
    let found = VARIANTS.map(|(variant, name, sets)| (variant, digests(name, sets)));
    if std::env::var_os("BLESS").is_some() {
        for (variant, digests) in found {
            println!("    (\n        \"{variant}\",\n        [");
            for digest in digests {
                let hex = format!("{digest:016x}");
                let groups = [&hex[..4], &hex[4..8], &hex[8..12], &hex[12..]];
                println!("            0x{},", groups.join("_"));
            }
            println!("        ],\n    ),");
        }
        return;
    }
    for (found, pinned) in found.iter().zip(&PINNED) {
        assert_eq!(found, pinned, "{}", found.0);
    }
}

/// The contrast: the last bit of one parameter changes the digest.
#[test]
fn the_last_bit_of_a_parameter_shows() {
    let mut case = run_exactly(&case("paper-2", &[]));
    let digest = |case: &Case| {
        let (rows, outcome) = rows(case, LinkKind::InProcess);
        Digest::of_run(&rows, &outcome)
    };
    let before = digest(&case);
    assert_eq!(before, digest(&case));
    let resistance_ohm = &mut case.axis.motor.resistance_ohm;
    *resistance_ohm = resistance_ohm.next_up();
    assert_ne!(before, digest(&case));
}
