/// The axis of paper-2, a sample every 1000000 ns, by `hil-runner scaling --rust`.
///
/// Within |e| ≤ 131072 and |Σe| ≤ 209715204 counts a code is at most 1 from the exact law's.
/// Differences beyond 30092 counts are held there. Codes are -8192 to 8191.
/// Setpoints come with velocities in 2^-16 counts/sample and accelerations in 2^-24 counts/sample².
pub const AXIS: firmware::Axis = {
    use firmware::*;

    let words = law::LawWords {
        kp: GainWord::new(13421773, 22),
        ki_dt: GainWord::new(10737418, 31),
        kd_per_dt: GainWord::new(13107200, 18),
        velocity_ff: GainWord::new(5039718, 32),
        acceleration_ff: GainWord::new(128000, 32),
        friction_ff: GainWord::new(10485760, 19),
        error_bits: 17,
        integral_bits: 20,
        derivative: law::Derivative::Measurement,
        filter: Some(law::FilterWords { smoothing: 1431655765, fraction_bits: 10 }),
        anti_windup: law::AntiWindup::BackCalculation { tracking: 214748365 },
    };
    let Ok(dac) = Dac::with_bits(14) else { panic!() };
    let Ok(law) = law::Law::accept(words, dac) else { panic!() };
    let Ok(output) = output::Output::new(dac, Some(300), output::Quantiser::Dither { seed: 1 }) else { panic!() };
    let mut axis = Axis::new(law, output);
    axis.counter = match CounterParameters::accept(16, Some(300)) { Ok(accepted) => accepted, Err(_) => panic!() };
    axis.backlash_compensation = BacklashCompensation::planned(17, 6, Trigger::Velocity);
    axis.rest.dead_band = 1;
    axis.rest.hold_integral = true;
    axis.monitors.following_error = Some(match monitor::FollowingErrorMonitor::accept(600, GainWord::new(1342177280, 27), 16) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis.monitors.encoder_loss = Some(match monitor::EncoderLossMonitor::accept(400, 20) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis.monitors.saturation = Some(match monitor::SaturationMonitor::accept(100) { Ok(accepted) => accepted, Err(_) => panic!() });
    axis.monitors.ticks = Some(monitor::TickMonitor);
    axis
};
