//! Counters that wrap around: a move across the end of a register is a move
//! like any other.

use bench_tests::case;
use firmware::axis::Inputs;
use firmware::output::{Output, Quantiser};
use firmware::{
    Axis, AxisState, CounterParameters, Dac, Event, Motion, MotionPlan, PlannedMotion, State,
    counts,
};
use hil_core::controllers::{IoKind, scaling_request};
use plant::{ContactChange, Drive, Plant, Solver, Span, Watch};

use super::{PAPER, Ran};

/// The paper's moves cover 99 902 counts, one and a half times the register.
#[test]
fn sixteen_bits_give_the_codes_of_thirty_two() {
    for name in PAPER {
        let wide = Ran::of(name, &[]);
        let most = wide.counts().into_iter().fold(0.0, f64::max);
        assert!(most > 65_536.0 + 32_768.0);
        let narrow = Ran::of(name, &[&["encoder.counter_bits=16"]]);
        assert_eq!(wide.codes(), narrow.codes(), "{name}");
        let [wide, narrow] = [&wide, &narrow].map(|ran| ran.summary().final_error_um);
        assert_eq!(wide, narrow);
    }
}

/// The contrast: 8 bits tell steps below 128 counts a sample, and the paper's
/// moves make 200. A shorter one, which stays below, fits.
#[test]
fn eight_bits_are_too_few_for_the_papers_speed() {
    let [wide, narrow] = [16, 8].map(|bits| {
        let bits = format!("encoder.counter_bits={bits}");
        let ran = |more: &str| Ran::of("paper-2", &[&[&bits, more]]);
        (ran("motion.travel_mm=250"), ran("motion.travel_mm=100"))
    });
    assert_ne!(wide.0.codes(), narrow.0.codes());
    assert!(narrow.0.summary().peak_following_error_mm > 10.0);
    assert_eq!(wide.1.codes(), narrow.1.codes());
}

/// Sees nothing.
struct Nobody;

impl Watch for Nobody {
    fn span(&mut self, _: &Span<'_>) {}

    fn contact_change(&mut self, _: &ContactChange) {}
}

/// Codes of paper-2 with the firmware's axis around the plant, the encoder
/// showing `start` where the axis stands at first.
fn codes_from(start: i32, counter_bits: u8) -> (Vec<i32>, i64) {
    let case = case("paper-2", &["controller.setpoints=generator"]);
    let law = scaling_request(&case).unwrap().scaled_law().unwrap().law;
    let dac = Dac::with_bits(case.dac.bits).unwrap();
    let mut axis = Axis::new(law, Output::new(dac, None, Quantiser::Nearest).unwrap());
    axis.counter = CounterParameters::accept(counter_bits, None).unwrap();
    let z = case.axis.transmission.gear_ratio;
    let travel_rad = case.motion.travel_m() / (case.axis.transmission.screw_pitch_m_per_rad * z);
    let travel = case.encoder.position_counts(travel_rad) * 4_294_967_296.0;
    const QUARTER: u64 = 250_000_000_000;
    let quarters = [QUARTER, 0, QUARTER, 0, QUARTER, 0, QUARTER];
    let plan = MotionPlan::new(travel.round() as i64, quarters, 1_000_000).unwrap();
    let planned = PlannedMotion::<256>::new(&plan, law.words()).unwrap();
    let mut source = Motion::new(&planned, start);
    let mut state = AxisState::start(&axis);
    for event in [Event::Enable, Event::Start] {
        state.request(event).unwrap();
    }
    let mut plant = Plant::new(&case.axis, Solver::Exact);
    let mut position = 0;
    let codes = (0..=1_500).map(|tick| {
        let count = case.encoder.count(plant.state().beta_rad / z) as i64;
        position = i64::from(start) + count;
        let inputs = Inputs {
            tick,
            motor_register: counts::wrap(position).cast_unsigned(),
            ..Inputs::default()
        };
        let output = state.tick(&inputs, &mut source);
        let code_v = case.dac.output_v(f64::from(output.code));
        let drive = Drive::Held(case.amplifier.command(code_v));
        let advanced = plant.advance(&drive, (tick + 1) * 1_000_000, &mut Nobody);
        advanced.unwrap();
        output.code
    });
    let codes = codes.collect();
    assert_eq!(state.state(), State::Holding);
    (codes, position)
}

/// 2^31 counts: the axis stands 50 000 counts below the end of its position
/// and moves by 99 902 across it.
#[test]
fn a_move_across_two_to_the_31_gives_the_same_codes() {
    let ran = Ran::of("paper-2", &[&["controller.setpoints=generator"]]);
    let (here, end) = codes_from(0, 32);
    assert!((99_000..101_000).contains(&end));
    let of_run: Vec<f64> = here.iter().map(|code| f64::from(*code)).collect();
    assert_eq!(of_run, ran.codes(), "the loop above is the bench's");
    let (across, end) = codes_from(i32::MAX - 50_000, 32);
    assert!(end > i64::from(i32::MAX));
    assert_eq!(here, across);
    // And across the end of a shorter register at the same time. It is
    // sign-extended: the axis stands at -1 - 50 000.
    let (across, _) = codes_from(-50_001, 16);
    let told = "start at -50 001 is not the register's 15 535";
    assert_ne!(here, across, "{told}");
    let (across, _) = codes_from(-15_536, 16);
    assert_eq!(here, across);
}

/// A travel is shorter than 2^31 counts; a longer one is refused with a sentence,
/// from whichever source it comes.
#[test]
fn too_long_a_move_is_refused() {
    for source in ["table", "generator", "queue"] {
        let refusal = |counts_per_rad: &str| {
            let source = format!("controller.setpoints={source}");
            let counts = format!("encoder.counts_per_rad={counts_per_rad}");
            let gains = "controller.kp=0.0012 controller.kd_s=1.8e-5 controller.ki_per_s=0.002";
            let case = case("paper-2", &[&source, &counts, gains]);
            let refusal = Ran::of_case(case, IoKind::Direct).err();
            refusal.map(|error| error.to_string())
        };
        // 157 rad: 2 136 million counts.
        assert_eq!(refusal("1.36e7"), None, "{source}");
        let sentence = refusal("1.37e7").unwrap();
        let wanted = "motion.travel_mm = 250: it makes 2151990968 encoder counts; a travel must \
                      be shorter than 2^31 = 2147483648";
        assert_eq!(sentence, wanted, "{source}");
    }
}
