//! The axis for firmware in C: what `include/servo.h` declares.
//!
//! A pointer must be null, or point to what its type says, for the length of the
//! call; what two pointers of a call point to must not overlap. A null pointer, one
//! off its alignment, and an axis in zeros that has not been started are refused:
//! [`SERVO_NO_POINTER`], or code 0 with the power off. One axis is for one context
//! at a time.

#![cfg_attr(target_os = "none", no_std)]
#![allow(non_camel_case_types, reason = "the names are those of the header")]
#![allow(clippy::missing_safety_doc, reason = "the page above has it for all")]

mod structures;

use core::ffi::{c_char, c_int};

use firmware::settings::Unfit;
use firmware::{AxisState, Event, Settings};

use structures::{SAFE, Source, at, at_mut};
pub use structures::{
    servo_fault, servo_inputs, servo_motion, servo_output, servo_setpoint, servo_stretch,
};

/// No image with this library in it reaches it: `scripts/c-example` looks.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// Number of words of a `servo_axis`.
pub const SERVO_AXIS_WORDS: usize = 64;
/// Return value of what has been done.
pub const SERVO_OK: c_int = 0;
/// Return value where a pointer is null or off its alignment, or the axis has not
/// been started.
pub const SERVO_NO_POINTER: c_int = -1;
/// Return value of a request that the state does not allow; nothing has changed.
pub const SERVO_REFUSED: c_int = -2;

/// Memory of an axis, the caller's, to be moved as it pleases between two calls; what
/// is in it is the library's. All zeros are an axis that has not been started.
#[repr(C)]
#[derive(Debug)]
pub struct servo_axis {
    /// No one else's.
    pub words: [u64; SERVO_AXIS_WORDS],
}

/// Memory of an axis as it is used.
#[repr(C)]
struct Memory {
    started: u32,
    state: AxisState,
}

/// Mark of an axis that has been started.
const STARTED: u32 = 0x6178_6973;

const _: () = assert!(size_of::<Memory>() <= size_of::<servo_axis>());
const _: () = assert!(align_of::<Memory>() <= align_of::<servo_axis>());

/// The axis in this memory, if it has been started.
///
/// # Safety
/// As of [`at_mut`].
unsafe fn started<'a>(axis: *mut servo_axis) -> Option<&'a mut AxisState> {
    // SAFETY: the same.
    let words = unsafe { at_mut(axis) }?;
    let memory: *mut Memory = core::ptr::from_mut(words).cast();
    // SAFETY: size and alignment are asserted above; every value is a `u32`.
    let mark = unsafe { (&raw const (*memory).started).read() };
    if mark != STARTED {
        return None;
    }
    // SAFETY: whoever wrote the mark wrote a state behind it.
    Some(unsafe { &mut (*memory).state })
}

fn refused(unfit: Unfit) -> c_int {
    c_int::from(unfit.word) + 1
}

/// Starts an axis: disabled, code 0. Returns 0, or the place of the first word that
/// is not accepted and 1, or `SERVO_NO_POINTER`; nothing has changed then.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_start(
    axis: *mut servo_axis,
    settings: *const Settings,
) -> c_int {
    // SAFETY: the caller's promise.
    let (words, settings) = unsafe { (at_mut(axis), at(settings)) };
    let (Some(words), Some(settings)) = (words, settings) else {
        return SERVO_NO_POINTER;
    };
    match AxisState::start_with(settings) {
        Ok(state) => {
            let memory: *mut Memory = core::ptr::from_mut(words).cast();
            let started = STARTED;
            // SAFETY: size and alignment are asserted above.
            unsafe { memory.write(Memory { started, state }) };
            SERVO_OK
        }
        Err(unfit) => refused(unfit),
    }
}

/// Takes other settings from the next sample on; the output goes on from where it
/// stands. Returns as `servo_axis_start`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_change(
    axis: *mut servo_axis,
    settings: *const Settings,
) -> c_int {
    // SAFETY: the caller's promise.
    let (state, settings) = unsafe { (started(axis), at(settings)) };
    let (Some(state), Some(settings)) = (state, settings) else {
        return SERVO_NO_POINTER;
    };
    state
        .change_to(settings)
        .map_or_else(refused, |()| SERVO_OK)
}

/// Name of a word of the settings by its place, from 0; null where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn servo_settings_name(place: c_int) -> *const c_char {
    // A search in text could panic by its signature; a walk over bytes cannot.
    let mut names = Settings::NAMES_IN_C.as_bytes().split(|byte| *byte == 0);
    let name = usize::try_from(place)
        .ok()
        .and_then(|place| names.nth(place));
    // Behind the last zero there is one more, without an end.
    let name = name.filter(|name| !name.is_empty());
    name.map_or(core::ptr::null(), |name| name.as_ptr().cast())
}

/// Asks for another state (`enum servo_event`), from the next sample on. Returns 0,
/// `SERVO_REFUSED` or `SERVO_NO_POINTER`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_request(axis: *mut servo_axis, event: u32) -> c_int {
    // SAFETY: the caller's promise.
    let Some(state) = (unsafe { started(axis) }) else {
        return SERVO_NO_POINTER;
    };
    let known = Event::ALL.into_iter().find(|known| *known as u32 == event);
    match known.map(|event| state.request(event)) {
        Some(Ok(_)) => SERVO_OK,
        Some(Err(_)) | None => SERVO_REFUSED,
    }
}

/// Computes one sample, with its setpoint, which is read while the axis moves; null:
/// there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_tick(
    axis: *mut servo_axis,
    inputs: *const servo_inputs,
    next: *const servo_setpoint,
) -> servo_output {
    // SAFETY: the caller's promise.
    let (state, inputs, next) = unsafe { (started(axis), at(inputs), at(next)) };
    sample(state, inputs, &mut Source::Setpoint(next))
}

/// Computes one sample of a motion in stretches, of which it takes the next one off
/// where it needs one; null: there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_play(
    axis: *mut servo_axis,
    inputs: *const servo_inputs,
    motion: *mut servo_motion,
) -> servo_output {
    // SAFETY: the caller's promise.
    let (state, inputs, motion) = unsafe { (started(axis), at(inputs), at_mut(motion)) };
    sample(state, inputs, &mut Source::Motion(motion))
}

/// One sample for both, which an image has once.
#[inline(never)]
fn sample(
    state: Option<&mut AxisState>,
    inputs: Option<&servo_inputs>,
    source: &mut Source<'_>,
) -> servo_output {
    match (state, inputs) {
        (Some(state), Some(inputs)) => state.tick(&inputs.into(), source).into(),
        _ => SAFE,
    }
}

/// Stops the axis in the sample of `tick`, whose output the hardware did not take.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_output_failed(
    axis: *mut servo_axis,
    tick: u64,
    failed_transfers: u32,
) -> servo_output {
    // SAFETY: the caller's promise.
    let state = unsafe { started(axis) };
    state.map_or(SAFE, |state| {
        state.output_failed(tick, failed_transfers).into()
    })
}

/// State of the axis (`enum servo_state`), or `SERVO_NO_POINTER`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_state(axis: *const servo_axis) -> c_int {
    // SAFETY: the caller's promise; the axis is read only.
    let state = unsafe { started(axis.cast_mut()) };
    state.map_or(SERVO_NO_POINTER, |state| state.state() as c_int)
}

/// Writes the fault that is latched. Returns 1, or 0 where there is none and nothing
/// is written, or `SERVO_NO_POINTER`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn servo_axis_fault(
    axis: *const servo_axis,
    fault: *mut servo_fault,
) -> c_int {
    // SAFETY: the caller's promise; the axis is read only.
    let (state, to) = unsafe { (started(axis.cast_mut()), at_mut(fault)) };
    let (Some(state), Some(to)) = (state, to) else {
        return SERVO_NO_POINTER;
    };
    let Some(fault) = state.fault() else {
        return 0;
    };
    *to = fault.into();
    1
}
