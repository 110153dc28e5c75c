/// The axis of paper-2, a sample every 1000000 ns, by `hil-runner scaling --rust`.
///
/// Within |e| ≤ 131072 and |Σe| ≤ 524798909 counts a code is at most 1 from the exact law's.
/// Differences beyond 24652 counts are held there. Codes are -8192 to 8191.
pub const AXIS: firmware::Axis = {
    use firmware::*;

    let words = law::LawWords {
        kp: GainWord::new(10726965, 23),
        ki_dt: GainWord::new(8581572, 32),
        kd_per_dt: GainWord::new(13107200, 18),
        velocity_ff: GainWord::new(0, 32),
        acceleration_ff: GainWord::new(0, 32),
        friction_ff: GainWord::new(0, 32),
        error_bits: 17,
        integral_bits: 20,
        derivative: law::Derivative::Measurement,
        filter: None,
        anti_windup: law::AntiWindup::None,
    };
    let Ok(dac) = Dac::with_bits(14) else { panic!() };
    let Ok(law) = law::Law::accept(words, dac) else { panic!() };
    let Ok(output) = output::Output::new(dac, None, output::Quantiser::Nearest) else { panic!() };
    let mut axis = Axis::new(law, output);
    axis.counter = match CounterParameters::accept(32, Some(300)) { Ok(accepted) => accepted, Err(_) => panic!() };
    axis.feedback = axis::Feedback::Load(match CounterParameters::accept(32, Some(751)) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis
};
