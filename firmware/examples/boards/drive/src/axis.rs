/// The axis of paper-2, a sample every 1000000 ns, by `hil-runner scaling --rust`.
///
/// Within |e| ≤ 131072 and |Σe| ≤ 419430409 counts a code is at most 1 from the exact law's.
/// Differences beyond 50660 counts are held there. Codes are -4096 to 4095.
pub const AXIS: firmware::Axis = {
    use firmware::*;

    let words = law::LawWords {
        kp: GainWord::new(13421773, 23),
        ki_dt: GainWord::new(10737418, 32),
        kd_per_dt: GainWord::new(13107200, 19),
        velocity_ff: GainWord::new(0, 32),
        acceleration_ff: GainWord::new(0, 32),
        friction_ff: GainWord::new(0, 32),
        error_bits: 17,
        integral_bits: 20,
        derivative: law::Derivative::Error,
        filter: None,
        anti_windup: law::AntiWindup::Clamp,
    };
    let Ok(dac) = Dac::with_bits(13) else { panic!() };
    let Ok(law) = law::Law::accept(words, dac) else { panic!() };
    let Ok(output) = output::Output::new(dac, None, output::Quantiser::Nearest) else { panic!() };
    let mut axis = Axis::new(law, output);
    axis.counter = match CounterParameters::accept(32, Some(400)) { Ok(accepted) => accepted, Err(_) => panic!() };
    axis.monitors.following_error = Some(match monitor::FollowingErrorMonitor::accept(400, GainWord::new(0, 32), 0) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis.monitors.encoder_loss = Some(match monitor::EncoderLossMonitor::accept(410, 50) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis.monitors.saturation = Some(match monitor::SaturationMonitor::accept(100) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis.monitors.ticks = Some(monitor::TickMonitor);
    axis
};
