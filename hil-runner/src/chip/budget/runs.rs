//! Runs whose axis comes in words over the line: its options are looked at in
//! every sample.

use super::{Amount, BudgetError, Figure, Instructions, Memory};
use crate::chip::client::Client;
use crate::chip::open;
use crate::chip::spec::{ChipLink, Target, Transport};
use crate::chip::{ChipUnderTest, run_on_chip};
use crate::files;
use hil_core::chip_cost::ChipReport;
use hil_core::run::RunOptions;

/// The case of the runs.
const CASE: &str = "paper-2";

/// Every feature that goes with every other one, and requests that lead
/// through all states: off, on again, and a stop.
const EVERYTHING: [&str; 32] = [
    "drive.dac_bits=16",
    "encoder.counter_bits=16",
    "load_encoder.counts_per_mm=1000",
    "controller.derivative=measurement",
    "controller.derivative_filter_s=0.0005",
    "controller.anti_windup=back-calculation",
    "controller.tracking_time_s=0.02",
    "controller.word_bits=24",
    "controller.quantiser=error-feedback",
    "controller.slew_limit_codes_per_s=300000",
    "controller.velocity_ff_s=0.0769",
    "controller.acceleration_ff_s2=0.0005",
    "controller.friction_ff_codes=20",
    "controller.setpoints=generator",
    "controller.rest_dead_band_counts=1",
    "controller.rest_integrator=hold",
    "backlash.compensation=acceleration",
    "backlash.gap=measured",
    "limits.following_error_counts=600",
    "limits.following_error_per_speed_s=0.01",
    "limits.count_jump_counts=300",
    "limits.encoder_loss_s=0.02",
    "limits.encoder_loss_codes=400",
    "limits.saturation_s=0.1",
    "limits.missed_ticks=true",
    "limits.velocity_mps=2",
    "limits.acceleration_mps2=20",
    "sequence.disable_s=1.3",
    "sequence.enable_s=1.4",
    "sequence.emergency_stop_s=1.5",
    "run.duration_s=1.6",
    "run.events=false",
];

/// What the runs have cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ran {
    /// Instructions by the state after the sample.
    pub states: Vec<Figure>,
    /// Memory of the image, and the stack of all runs.
    pub memory: Memory,
}

/// Runs the paper's controller and then an axis with everything on.
///
/// # Errors
/// [`BudgetError`] if there is no chip, or a run ends early.
pub fn run(
    target: Target,
    transport: Transport,
    tell: &mut dyn FnMut(&str),
) -> Result<Ran, BudgetError> {
    let link = ChipLink::Qemu { target, transport };
    let mut client = Client::greet(open(&link, tell)?.line)?;
    let paper = report(&mut client, &[])?;
    let everything = report(&mut client, &EVERYTHING)?;
    let mut states = figures("run", &paper);
    states.extend(figures("run, everything", &everything));
    Ok(Ran {
        states,
        memory: Memory {
            flash: everything.flash_bytes,
            ram: everything.ram_bytes,
            // Painted once, so that it is that of both.
            stack: everything.stack_bytes.unwrap_or(0),
        },
    })
}

fn report(client: &mut Client, sets: &[&str]) -> Result<ChipReport, BudgetError> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let file = files::run_file(CASE, &sets)?;
    let mut chip = ChipUnderTest {
        client,
        in_qemu: true,
    };
    let outcome = run_on_chip(
        &file.case,
        RunOptions::default(),
        &mut chip,
        &mut |_| Ok(()),
    )?;
    outcome.summary.chip.ok_or(BudgetError::NoSteps)
}

/// A figure a state.
fn figures(name: &str, report: &ChipReport) -> Vec<Figure> {
    let whole = |count: u64| u32::try_from(count).unwrap_or(u32::MAX);
    let of_states = report.states.iter().map(|cost| Figure {
        name: format!("{name}, {}", cost.state),
        amount: Amount::Instructions(Instructions {
            max: whole(cost.max),
            median: whole(cost.median),
            first: None,
        }),
    });
    of_states.collect()
}
