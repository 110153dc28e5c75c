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
use hil_runner::case::{Case, Law};
use hil_runner::run::LinkKind;

/// Keeps the exact solver away from a variant.
const DOPRI5: &str = "run.solver=dopri5";

/// What is done to a built-in case: its name here, the case, its overrides.
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
            0xc946_24ca_2795_35ed,
            0xb305_9afc_cda0_9293,
            0xac85_7488_a18b_6491,
            0x4924_79ca_0a72_2c02,
        ],
    ),
    (
        "2",
        [
            0x2c4f_59d3_2388_4e07,
            0xfe84_7518_7aa8_b22d,
            0x04d3_7baa_4ccb_2c14,
            0x26eb_dadb_d585_5d48,
        ],
    ),
    (
        "3",
        [
            0xa901_3068_85c0_2da3,
            0x9404_a318_44c3_d75e,
            0x65c9_dfef_0791_4668,
            0x4cc2_468f_47ed_42e7,
        ],
    ),
    (
        "4",
        [
            0x0058_1ec9_d0ab_c74f,
            0x2f60_48de_b8bb_deac,
            0x660e_98af_63a6_6208,
            0x5090_1871_5506_c787,
        ],
    ),
    (
        "delay",
        [
            0x0058_1ec9_d0ab_c74f,
            0x1abc_e4f4_690d_9fef,
            0x0c7b_38e4_3b85_c429,
            0x0c7b_38e4_3b85_c429,
        ],
    ),
    (
        "no pull",
        [
            0x67da_a228_6ca7_04f3,
            0x61fe_e934_e458_8099,
            0x1fdf_7dde_2f9f_eca7,
            0x5ad7_ac1e_594b_3a4b,
        ],
    ),
    (
        "friction",
        [
            0xcfc2_56d6_fbd8_1fcf,
            0xabe4_7553_c421_f080,
            0x6102_f0b1_27a4_e1b3,
            0xca3b_3a61_e17f_929a,
        ],
    ),
    (
        "rigid",
        [
            0x63b3_0d61_982c_da32,
            0x8a18_b7db_c582_40ec,
            0xdd23_3b0e_30bd_2e15,
            0x9e78_5f62_ec69_4b54,
        ],
    ),
    (
        "no gap",
        [
            0x2b4a_b233_74d1_6894,
            0xb67a_e0b7_14ff_c2fa,
            0x52f1_a759_a55a_6cfa,
            0xd0bb_df0c_ec7b_9f43,
        ],
    ),
    (
        "limited",
        [
            0x9877_0cdb_6182_faa0,
            0x264c_cf83_2bb8_0354,
            0x1bc4_f2c3_f7d8_a169,
            0x6941_90fa_d6c9_89f9,
        ],
    ),
    (
        "dopri5",
        [
            0xe839_5198_515b_babf,
            0x5db6_800f_f9bf_a56a,
            0xae5c_0fc2_1a82_5d86,
            0x471b_6b1c_7be1_bac3,
        ],
    ),
    (
        "dopri5, no affine plant",
        [
            0x258b_a341_69aa_205a,
            0x5c8a_da4b_fa9c_f04d,
            0x3c7e_3371_847c_4db4,
            0xaad8_6dd9_3ffa_2b5e,
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
    let inductance_h = &mut case.axis.motor.inductance_h;
    *inductance_h = inductance_h.next_up();
    assert_ne!(before, digest(&case));
}
