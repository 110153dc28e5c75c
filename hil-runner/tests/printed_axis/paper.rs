/// The axis of paper-2, a sample every 1000000 ns, by `hil-runner scaling --rust`.
///
/// Within |e| ≤ 131072 and |Σe| ≤ 209715204 counts a code is at most 1 from the exact law's.
/// Differences beyond 29688 counts are held there. Codes are -8192 to 8191.
pub const AXIS: firmware::Axis = {
    use firmware::*;

    let words = law::LawWords {
        kp: GainWord::new(13421773, 22),
        ki_dt: GainWord::new(10737418, 31),
        kd_per_dt: GainWord::new(13107200, 18),
        velocity_ff: GainWord::new(0, 32),
        acceleration_ff: GainWord::new(0, 32),
        friction_ff: GainWord::new(0, 32),
        error_bits: 17,
        integral_bits: 20,
        derivative: law::Derivative::Error,
        filter: None,
        anti_windup: law::AntiWindup::None,
    };
    let Ok(dac) = Dac::with_bits(14) else { panic!() };
    let Ok(law) = law::Law::accept(words, dac) else { panic!() };
    let Ok(output) = output::Output::new(dac, None, output::Quantiser::Nearest) else { panic!() };
    Axis::new(law, output)
};
