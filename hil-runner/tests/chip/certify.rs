//! A chip is held against the host step by step, and the first difference is
//! found where it is.

use firmware::law::{Law, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Axis, Dac, Event, FaultCause, GainWord, Settings, State};
use firmware_link::{Events, Planned, Request, SourceKind, settings};
use hil_core::case::Case;
use hil_core::error::RunError;
use hil_core::message::{Command, Link, LinkError, Measurement, Steps};
use hil_runner::chip::ChipLaw;
use hil_runner::chip::certify::{Comparison, Difference, HostTrace, Number, Step, TraceHash};
use hil_runner::chip::client::Client;
use hil_runner::chip::spec::{ChipLink, Transport};

use crate::loopback::Loopback;
use crate::same_codes::{CASES, case};
use crate::targets::targets;
use crate::vectors::replay_all;

fn record(case: &Case) -> HostTrace<'_> {
    HostTrace::record(case, &mut |_| Ok(())).unwrap()
}

fn hash_of(steps: &[Step]) -> TraceHash {
    let mut hash = TraceHash::default();
    hash.extend(steps);
    hash
}

/// The cases on a chip: as many steps, the same hash.
pub(crate) fn certify(client: &mut Client) {
    let (mut host_hash, mut chip_hash) = (TraceHash::default(), TraceHash::default());
    let mut hashes = Vec::new();
    for (name, sets) in CASES {
        let case = case(name, sets);
        let host = record(&case);
        let mut chip = ChipLaw::new(client, &case, true).unwrap();
        let comparison = host.compare(&mut chip, &mut chip_hash, &mut |_| Ok(()));
        let same = Comparison {
            compared: host.steps().len() as u64,
            difference: None,
        };
        assert_eq!(comparison.unwrap(), same, "{name} {sets:?}");
        assert!(same.compared > 1_000, "{name} {sets:?}");
        host_hash.extend(host.steps());
        assert_eq!(chip_hash, host_hash, "{name} {sets:?}");
        hashes.push(hash_of(host.steps()).to_string());
    }
    // The contrast: no two of the cases have one hash.
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), CASES.len());
}

#[test]
fn a_chip_in_memory_is_the_same() {
    certify(&mut Client::greet(Box::new(Loopback::new())).unwrap());
}

/// A chip that answers one step otherwise.
struct Altered<L, F> {
    chip: L,
    at: u64,
    change: F,
}

impl<L: Link, F: Fn(&mut Command)> Link for Altered<L, F> {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let mut command = self.chip.exchange(measurement)?;
        if measurement.tick == self.at {
            (self.change)(&mut command);
        }
        Ok(command)
    }
}

/// The finding of a change at a step of a case.
fn altered(case: &Case, at: u64, change: impl Fn(&mut Command)) -> Difference {
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let chip = ChipLaw::new(&mut client, case, true).unwrap();
    let mut link = Altered { chip, at, change };
    let mut hash = TraceHash::default();
    let host = record(case);
    let comparison = host.compare(&mut link, &mut hash, &mut |_| Ok(())).unwrap();
    // It goes on to that step, and no further.
    assert_eq!(comparison.compared, at + 1);
    let before = host.steps().iter().take(usize::try_from(at).unwrap() + 1);
    let before: Vec<_> = before.copied().collect();
    assert_ne!(hash, hash_of(&before));
    comparison.difference.unwrap()
}

#[test]
fn one_code_that_is_1_off_is_found_in_its_step() {
    let case = case("paper-2", &[]);
    let code = record(&case).steps()[512]
        .numbers()
        .into_iter()
        .find_map(|(name, number)| (name == "code").then_some(number));
    let Some(Number::Whole(code)) = code else {
        panic!("{code:?}")
    };
    let found = altered(&case, 512, |command| {
        command.dac_code = Steps::Whole(command.dac_code.whole() + 1);
    });
    let number = |value| Number::Whole(value).to_string();
    assert_eq!(
        found.to_string(),
        format!(
            "differs at step 512 (0.512 s) of paper-2: code {} on the chip, {} here",
            number(code + 1),
            number(code)
        )
    );
    assert_eq!(found.at, 512);
}

/// The last step too, whose code never acts on the plant.
#[test]
fn nothing_of_an_answer_may_differ() {
    type Change = fn(&mut Command);
    let changes: [(&str, Change); 6] = [
        ("error", |command| {
            command.error_counts = Steps::Whole(command.error_counts.whole() - 1);
        }),
        ("out of range", |command| command.out_of_range = true),
        ("state", |command| {
            command.axis.as_mut().unwrap().state = State::Enabled;
        }),
        ("faults", |command| {
            command.axis.as_mut().unwrap().faults += 1;
        }),
        ("refused requests", |command| {
            command.axis.as_mut().unwrap().refused_requests += 1;
        }),
        ("peak error", |command| {
            command.axis.as_mut().unwrap().peak_error_counts += 1;
        }),
    ];
    let case = case("paper-3", &["controller.anti_windup=clamp"]);
    for (name, change) in changes {
        let found = altered(&case, 1_500, change);
        let names: Vec<_> = found.numbers.iter().map(|pair| pair.name).collect();
        assert_eq!(names, [name]);
    }
}

/// The execution time of the chip is no difference: the chip in memory says it with
/// every step, and the host does not.
#[test]
fn times_are_not_compared() {
    let case = case("paper-1", &[]);
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let chip = ChipLaw::new(&mut client, &case, true).unwrap();
    let mut link = Altered {
        chip,
        at: 7,
        change: |command: &mut Command| {
            let execution = command.execution.as_mut().unwrap();
            execution.cycles += 1;
        },
    };
    let mut hash = TraceHash::default();
    let compared = record(&case).compare(&mut link, &mut hash, &mut |_| Ok(()));
    assert_eq!(compared.unwrap().difference, None);
}

/// A fault whose record differs in one number, of the second fault of a run.
#[test]
fn a_fault_with_another_record_is_found() {
    let case = case(
        "paper-2",
        &[
            "inject.encoder_glitch_s=0.2",
            "inject.encoder_glitch_counts=-4096",
            "limits.count_jump_counts=1000",
            "sequence.reset_s=0.25",
            "sequence.enable_s=0.26",
            "inject.bus_error_s=0.3",
        ],
    );
    let found = altered(&case, 300, |command| {
        let axis = command.axis.as_mut().unwrap();
        assert_eq!(axis.faults, 2);
        let fault = axis.fault.as_mut().unwrap();
        assert_eq!(fault.cause, FaultCause::HardwareBus);
        fault.values.limit += 1;
    });
    assert_eq!(
        found.to_string(),
        "differs at step 300 (0.3 s) of paper-2: limit of the fault 1 on the chip, 0 here"
    );
}

#[test]
fn a_chip_with_other_gains_is_found() {
    let wanted = case("paper-2", &[]);
    let other = case("paper-2", &["controller.kp=3.3"]);
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let mut chip = ChipLaw::new(&mut client, &other, true).unwrap();
    let mut hash = TraceHash::default();
    let compared = record(&wanted).compare(&mut chip, &mut hash, &mut |_| Ok(()));
    let found = compared.unwrap().difference.unwrap();
    // At once when there is an error to speak of: 0.1 codes a count.
    assert!(found.at < 20, "{found}");
    let names: Vec<_> = found.numbers.iter().map(|pair| pair.name).collect();
    assert_eq!(names, ["code"], "{found}");
}

#[test]
fn only_the_firmware_is_compared() {
    let case = case("paper-2", &["controller.law=quantised"]);
    let refused = HostTrace::record(&case, &mut |_| Ok(())).unwrap_err();
    assert!(matches!(refused, RunError::Link(_)), "{refused:?}");
    assert_eq!(
        refused.to_string(),
        "a chip runs the firmware; the law must be \"firmware\", not \"quantised\""
    );
}

/// 1000 counts up in 40 ms and to rest in 40 ms.
const PLAN: Planned = Planned {
    travel: 1_000 << 32,
    intervals_ps: [0, 40_000_000_000, 0, 0, 0, 40_000_000_000, 0],
    period_ns: 1_000_000,
    start: 0,
    gains: [GainWord::new(0, 0); 3],
};

/// What is planned there counts into the configuration as what is sent.
#[test]
fn a_chip_that_plans_has_the_configuration_of_its_host() {
    let dac = Dac::with_bits(14).unwrap();
    let law = Law::accept(LawWords::NONE, dac).unwrap();
    let axis = Axis::new(law, Output::unlimited(dac, Quantiser::Nearest));
    let settings = settings::write(&Settings::of(&axis)).unwrap();
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    client.take(&Request::Settings(&settings)).unwrap();
    client.take(&Request::Plan(&PLAN)).unwrap();
    let mut events = Events::default();
    events.insert(Event::Enable);
    client.begin(SourceKind::Plan, events).unwrap();
}

/// The images, where they can be run here.
#[test]
fn every_image_in_qemu_is_the_same() {
    for target in targets("the same bits", Transport::Fifo) {
        let link = ChipLink::Qemu {
            target,
            transport: Transport::Fifo,
        };
        let opened = hil_runner::chip::open(&link, &mut |line| eprintln!("{line}")).unwrap();
        let mut client = Client::greet(opened.line).unwrap();
        let begin = std::time::Instant::now();
        certify(&mut client);
        replay_all(&mut client);
        // It is built without the planner, and is none the worse for being asked.
        let refused = client.request(&Request::Plan(&PLAN)).unwrap_err();
        assert!(refused.0.contains("refuses"), "{refused}");
        client.begin_session().unwrap();
        println!("{link}: {:.2} s", begin.elapsed().as_secs_f64());
    }
}
