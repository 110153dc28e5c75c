/* Position controller of an axis: settings once, then one call in every sample.
 *
 * A pointer must be null, or point to what its type says, for the length of the call; what two
 * pointers of a call point to must not overlap. A null pointer, one off its alignment, and an axis
 * in zeros that has not been started are refused: SERVO_NO_POINTER, or code 0 with the power off.
 * One axis is for one context at a time.
 *
 * Made from firmware/c/src, whose tests compare it. */

#ifndef SERVO_H
#define SERVO_H

#include <stdbool.h>
#include <stdint.h>

/** State of an axis. */
enum servo_state {
  SERVO_STATE_DISABLED = 0,
  SERVO_STATE_ENABLED = 1,
  SERVO_STATE_MOVING = 2,
  SERVO_STATE_HOLDING = 3,
  SERVO_STATE_FAULT = 4,
};

/** Request for another state. */
enum servo_event {
  SERVO_EVENT_ENABLE = 0,
  SERVO_EVENT_DISABLE = 1,
  SERVO_EVENT_START = 2,
  SERVO_EVENT_RESET = 5,
};

/** Cause of a fault, the most urgent first. */
enum servo_cause {
  SERVO_CAUSE_EMERGENCY_STOP = 0,
  SERVO_CAUSE_HARDWARE_BUS = 1,
  SERVO_CAUSE_MISSED_TICK = 2,
  SERVO_CAUSE_ENCODER_GLITCH = 3,
  SERVO_CAUSE_ENCODER_LOSS = 4,
  SERVO_CAUSE_SETPOINT_UNDERRUN = 5,
  SERVO_CAUSE_FOLLOWING_ERROR = 6,
  SERVO_CAUSE_SATURATION_TOO_LONG = 7,
};

/**
 * Settings of an axis, as `hil-runner scaling CASE --c` prints them. A limit of
 * 2^32 - 1 is none.
 */
typedef struct servo_settings {
  /** Kp: an integer x times scale, and that times mantissa, is Kp·x in 2^−32 codes; so with the gains that follow. 0 to 2147483647. */
  uint32_t kp_mantissa;
  /** Of Kp. 1 to 1073741824. */
  uint32_t kp_scale;
  /** Ki·Δt [codes per count]. 0 to 2147483647. */
  uint32_t ki_dt_mantissa;
  /** Of Ki·Δt. 1 to 1073741824. */
  uint32_t ki_dt_scale;
  /** Kd/Δt [codes per count]; with a filter per unit of the filtered difference. 0 to 2147483647. */
  uint32_t kd_per_dt_mantissa;
  /** Of Kd/Δt. 1 to 1073741824. */
  uint32_t kd_per_dt_scale;
  /** 1: the derivative is that of the measurement, not of the error. 0 to 1. */
  uint32_t derivative_of_measurement;
  /** a·2^31 of the derivative's filter; 0 is none. 0 to 2147483647. */
  uint32_t filter_smoothing;
  /** 2^h of the filter: the units of a count in it. 1 to 536870912. */
  uint32_t filter_scale;
  /** E, largest error [counts]. 1 to 536870912. */
  uint32_t error_limit_counts;
  /** D, largest difference [counts]. 1 to 1073741824. */
  uint32_t difference_limit_counts;
  /** Bits of the motor's counter. 8 to 32. */
  uint32_t counter_bits;
  /** Largest change of its count [counts per sample]. 1 to 4294967295. */
  uint32_t largest_jump_counts;
  /** 1: the position is that of the load's encoder. 0 to 1. */
  uint32_t feedback_of_load;
  /** Code from which on a healthy encoder moves [codes]. 1 to 4294967295. */
  uint32_t encoder_loss_codes;
  /** Samples after which it is lost. 1 to 4294967295. */
  uint32_t encoder_loss_samples;
  /** Samples that the output may stand at a limit. 0 to 4294967295. */
  uint32_t saturation_samples;
  /** Bits of the converter. 2 to 24. */
  uint32_t dac_bits;
  /** Largest change of the code [codes per sample]. 1 to 16777216. */
  uint32_t slew_codes;
  /** 0 nearest, 1 error feedback, 2 dither. 0 to 2. */
  uint32_t quantiser;
  /** Start of the dither's generator. 0 to 4294967295. */
  uint32_t dither_seed;
  /** 0 none, 1 clamp, 2 back-calculation. 0 to 2. */
  uint32_t anti_windup;
  /** Δt/T_t·2^31 of the back-calculation. 0 to 2147483647. */
  uint32_t tracking;
  /** First whole number beyond the integral's range [codes]. 1 to 2147483647. */
  uint32_t integral_range_codes;
  /** 1 where beyond D a declared range is left. 0 to 1. */
  uint32_t difference_is_declared;
  /** Feed-forward of the velocity [codes per unit of a setpoint's velocity]. 0 to 2147483647. */
  uint32_t velocity_ff_mantissa;
  /** Of the feed-forward of the velocity. 1 to 1073741824. */
  uint32_t velocity_ff_scale;
  /** Feed-forward of the acceleration [codes per unit of a setpoint's acceleration]. 0 to 2147483647. */
  uint32_t acceleration_ff_mantissa;
  /** Of the feed-forward of the acceleration. 1 to 1073741824. */
  uint32_t acceleration_ff_scale;
  /** Feed-forward of the friction [codes]. 0 to 2147483647. */
  uint32_t friction_ff_mantissa;
  /** Of the feed-forward of the friction. 1 to 1073741824. */
  uint32_t friction_ff_scale;
  /** Largest feed-forward of a source that computes it itself [codes]. 0 to 1073741824. */
  uint32_t ahead_limit_codes;
  /** Bits of the load's counter. 8 to 32. */
  uint32_t load_counter_bits;
  /** Largest change of its count [counts per sample]. 1 to 4294967295. */
  uint32_t load_largest_jump_counts;
  /** Largest following error at rest [counts]. 1 to 4294967295. */
  uint32_t following_error_counts;
  /** By how much it grows with the speed, mantissa·2^−fraction_bits [samples]. 0 to 2147483647. */
  uint32_t lag_mantissa;
  /** Of the lag. 0 to 46. */
  uint32_t lag_fraction_bits;
  /** Fraction bits of setpoints' velocities. 0 to 60. */
  uint32_t velocity_fraction_bits;
  /** 1: a tick that is missed is a fault. 0 to 1. */
  uint32_t watches_ticks;
  /** Errors that count as 0 at rest [counts]. 0 to 4294967295. */
  uint32_t dead_band_counts;
  /** 1: the integral stands still at rest. 0 to 1. */
  uint32_t hold_integral;
  /** B of the backlash compensation [motor counts]. 0 to 16777216. */
  uint32_t half_gap_counts;
  /** N, half the samples of a move across the gap; 0 is no compensation. 0 to 65535. */
  uint32_t crossing_half_samples;
  /** B/N² [2^−32 counts], its lower word. 0 to 4294967295. */
  uint32_t crossing_first_low;
  /** Its upper word [counts]. 0 to 16777216. */
  uint32_t crossing_first_high;
  /** 1: the flank follows the acceleration, not the velocity. 0 to 1. */
  uint32_t flank_of_acceleration;
} servo_settings;

/**
 * Number of words of a `servo_axis`.
 */
#define SERVO_AXIS_WORDS 64

/**
 * Return value of what has been done.
 */
#define SERVO_OK 0

/**
 * Return value where a pointer is null or off its alignment, or the axis has not
 * been started.
 */
#define SERVO_NO_POINTER -1

/**
 * Return value of a request that the state does not allow; nothing has changed.
 */
#define SERVO_REFUSED -2

/**
 * Memory of an axis, the caller's, to be moved as it pleases between two calls; what
 * is in it is the library's. All zeros are an axis that has not been started.
 */
typedef struct servo_axis {
  /**
   * No one else's.
   */
  uint64_t words[SERVO_AXIS_WORDS];
} servo_axis;

/**
 * Results of one sample.
 */
typedef struct servo_output {
  /**
   * Code for the converter.
   */
  int32_t code;
  /**
   * `e = r - c` as measured [counts].
   */
  int32_t error_counts;
  /**
   * `enum servo_state` after this sample.
   */
  uint32_t state;
  /**
   * True if the power stage is to be on.
   */
  bool power;
  /**
   * True if the law left a declared range.
   */
  bool out_of_range;
} servo_output;

/**
 * Readings of the hardware at one sample.
 */
typedef struct servo_inputs {
  /**
   * Number of the sample, counted by the timer that starts it.
   */
  uint64_t tick;
  /**
   * Register of the motor's encoder.
   */
  uint32_t motor_register;
  /**
   * Register of the load's encoder.
   */
  uint32_t load_register;
  /**
   * Transfers on the hardware's buses that failed since the last sample.
   */
  uint32_t failed_transfers;
  /**
   * 1 where `load_register` has been read.
   */
  uint8_t has_load_register;
  /**
   * 1 where the emergency stop is asserted.
   */
  uint8_t emergency_stop;
} servo_inputs;

/**
 * Command of one sample.
 */
typedef struct servo_setpoint {
  /**
   * Position [counts, modulo 2^32].
   */
  int32_t position;
  /**
   * Velocity, in the unit that the settings were made for.
   */
  int32_t velocity;
  /**
   * Acceleration, in the unit that the settings were made for.
   */
  int32_t acceleration;
  /**
   * 1: the last setpoint of the motion; the axis holds it from here on.
   */
  uint8_t last;
  /**
   * 1: `ahead` is the feed-forward; else it follows from velocity and
   * acceleration.
   */
  uint8_t has_ahead;
  /**
   * Feed-forward of one's own [2^-32 codes].
   */
  int64_t ahead;
} servo_setpoint;

/**
 * Samples of a motion whose third difference is constant: `r += v`, `v += a`,
 * `a += j` in each. Positions are in 2^-32 counts, codes in 2^-32 codes.
 */
typedef struct servo_stretch {
  /**
   * `r` at the first sample, and half a count.
   */
  int64_t position;
  /**
   * `v`, its change to the next sample.
   */
  int64_t velocity;
  /**
   * `a`, the change of that.
   */
  int64_t acceleration;
  /**
   * `j`, the change of that.
   */
  int64_t jerk;
  /**
   * Feed-forward at the first sample.
   */
  int64_t ahead;
  /**
   * Its change to the next sample.
   */
  int64_t ahead_change;
  /**
   * The change of that.
   */
  int64_t ahead_growth;
  /**
   * Number of samples, at least 1.
   */
  uint32_t samples;
  /**
   * Sign of the velocity on the way: -1, 0 or 1.
   */
  int8_t velocity_sign;
  /**
   * Sign of the acceleration on the way.
   */
  int8_t acceleration_sign;
} servo_stretch;

/**
 * Motion in stretches. The axis takes one off where it needs one; behind the last
 * one it holds `target`.
 */
typedef struct servo_motion {
  /**
   * The next stretch.
   */
  const struct servo_stretch *next;
  /**
   * Number of stretches that are left.
   */
  uint32_t left;
  /**
   * Position at the end [counts, modulo 2^32].
   */
  int32_t target;
} servo_motion;

/**
 * Record of the first fault.
 */
typedef struct servo_fault {
  /**
   * Number of the sample that found it.
   */
  uint64_t tick;
  /**
   * Measured value; its meaning is that of the cause.
   */
  int64_t measured;
  /**
   * The limit that it passed, in the same unit.
   */
  int64_t limit;
  /**
   * Setpoint [counts, modulo 2^32].
   */
  int32_t setpoint;
  /**
   * Position [counts, modulo 2^32].
   */
  int32_t position;
  /**
   * `e = r - c` [counts].
   */
  int32_t error_counts;
  /**
   * The code in force when it was found.
   */
  int32_t code;
  /**
   * `enum servo_cause`.
   */
  uint32_t cause;
} servo_fault;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Starts an axis: disabled, code 0. Returns 0, or the place of the first word that
 * is not accepted and 1, or `SERVO_NO_POINTER`; nothing has changed then.
 */
int servo_axis_start(struct servo_axis *axis, const servo_settings *settings);

/**
 * Takes other settings from the next sample on; the output goes on from where it
 * stands. Returns as `servo_axis_start`.
 */
int servo_axis_change(struct servo_axis *axis, const servo_settings *settings);

/**
 * Name of a word of the settings by its place, from 0; null where there is none.
 */
const char *servo_settings_name(int place);

/**
 * Asks for another state (`enum servo_event`), from the next sample on. Returns 0,
 * `SERVO_REFUSED` or `SERVO_NO_POINTER`.
 */
int servo_axis_request(struct servo_axis *axis, uint32_t event);

/**
 * Computes one sample, with its setpoint, which is read while the axis moves; null:
 * there is none.
 */
struct servo_output servo_axis_tick(struct servo_axis *axis,
                                    const struct servo_inputs *inputs,
                                    const struct servo_setpoint *next);

/**
 * Computes one sample of a motion in stretches, of which it takes the next one off
 * where it needs one; null: there is none.
 */
struct servo_output servo_axis_play(struct servo_axis *axis,
                                    const struct servo_inputs *inputs,
                                    struct servo_motion *motion);

/**
 * Stops the axis in the sample of `tick`, whose output the hardware did not take.
 */
struct servo_output servo_axis_output_failed(struct servo_axis *axis,
                                             uint64_t tick,
                                             uint32_t failed_transfers);

/**
 * State of the axis (`enum servo_state`), or `SERVO_NO_POINTER`.
 */
int servo_axis_state(const struct servo_axis *axis);

/**
 * Writes the fault that is latched. Returns 1, or 0 where there is none and nothing
 * is written, or `SERVO_NO_POINTER`.
 */
int servo_axis_fault(const struct servo_axis *axis, struct servo_fault *fault);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SERVO_H */
