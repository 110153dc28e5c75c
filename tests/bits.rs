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
            0x4586_b0ff_4fea_c3cb,
            0xb475_df22_953f_a3db,
            0x2d40_c76d_02dd_aaf1,
            0x3379_98f5_7c38_2d2d,
        ],
    ),
    (
        "2",
        [
            0x6f40_a43b_5350_eb5e,
            0x99c8_ed35_2f68_09c3,
            0xb834_b969_e11a_ef1d,
            0x4a00_ecac_fc0d_d433,
        ],
    ),
    (
        "3",
        [
            0xded5_cd5c_4834_467f,
            0xc64e_d5ab_b79c_2aa3,
            0x160a_2c9a_a11b_40c8,
            0x473e_bb05_269d_467d,
        ],
    ),
    (
        "4",
        [
            0x223d_b08f_8c17_dc5e,
            0x11dd_520d_a1d4_9f3d,
            0x528e_0cbc_31b5_5b82,
            0x8db6_c432_d312_1928,
        ],
    ),
    (
        "delay",
        [
            0x223d_b08f_8c17_dc5e,
            0xe498_5652_1f0f_13f5,
            0x8eb2_8792_5e9e_1bf3,
            0x8eb2_8792_5e9e_1bf3,
        ],
    ),
    (
        "no pull",
        [
            0x1055_201b_532c_015a,
            0x2674_e255_d2d5_1413,
            0xee61_e10e_2de5_aaab,
            0x789b_550f_13bd_96ec,
        ],
    ),
    (
        "friction",
        [
            0xef26_5a73_a7c3_f5d7,
            0x1053_8ae6_07bc_6a33,
            0xa935_d4a3_80ff_7836,
            0x5e4f_3e1c_d2e4_959d,
        ],
    ),
    (
        "rigid",
        [
            0x96d4_30dd_0295_ecc5,
            0x0855_8382_616b_ab25,
            0x1a81_9945_fca5_347a,
            0x9d80_1e25_86df_8dd4,
        ],
    ),
    (
        "no gap",
        [
            0x67d4_5372_5606_ec2b,
            0x3e03_d4c7_251f_7782,
            0x6dbe_ae10_3447_6811,
            0x2a72_de51_1b09_70c5,
        ],
    ),
    (
        "limited",
        [
            0xb748_3812_2b1f_c60e,
            0x759f_d7d8_56ee_6804,
            0xcfda_cd1f_b4f8_06b9,
            0xb0fe_8682_a4a2_d368,
        ],
    ),
    (
        "dopri5",
        [
            0x3b5a_73a5_3af0_03ad,
            0xb9df_5747_b442_5c24,
            0x8969_40db_75c0_8c84,
            0x1821_00fa_0782_6240,
        ],
    ),
    (
        "dopri5, no affine plant",
        [
            0x70db_41a6_9bff_5c4b,
            0x0622_139b_a910_2ea0,
            0xb8f3_286e_4834_c619,
            0x5c54_2381_2c1c_d510,
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
