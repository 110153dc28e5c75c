//! The studies that are part of the program: templates, each rendered over a
//! base case into a study file with that base's own numbers and words.
//!
//! A template sees the base with the command line's `--set`: its keys by
//! `key("controller.kp")`, and what several keys make together, such as
//! `motion_time_s`. The outcome is an ordinary study file, which is what
//! `--print` prints and the folder of the results keeps.

use minijinja::{AutoEscape, Environment, Error, ErrorKind, UndefinedBehavior, Value, context};
use plant::{Course, Joint};

use crate::page;
use hil_core::budget::limits;
use hil_core::case::Law;
use hil_core::number;
use hil_core::rest::rest_from_s;
use hil_core::runfile::{KeyPath, Template};
use hil_core::theory::{JointState, margin};

/// Name and template of every ready study.
const STUDIES: [(&str, &str); 7] = {
    macro_rules! with_text {
        ($($name:literal),+) => {
            [$(($name, include_str!(concat!("../../../studies/", $name, ".toml")))),+]
        };
    }
    with_text![
        "sample-time",
        "resolution",
        "backlash",
        "gains",
        "word-length",
        "motion",
        "tolerance"
    ]
};

/// Base of a ready study where the command line names none.
pub const BASE: &str = "paper-2";

/// Names of the ready studies.
pub fn names() -> impl Iterator<Item = &'static str> {
    STUDIES.iter().map(|(name, _)| *name)
}

/// True if there is a ready study of this name.
pub fn is_ready(name: &str) -> bool {
    names().any(|known| known == name)
}

/// The study file of a ready study around a base case, `base_name`, on the
/// rungs of the command line if it names any.
///
/// # Errors
/// A sentence if the study asks something that this base does not have, such
/// as a gap of a rigid joint, or if there is no such study.
pub(super) fn render(
    name: &str,
    base_name: &str,
    base: &Template,
    rungs: Option<&[Law]>,
) -> Result<String, String> {
    let Some((_, text)) = STUDIES.iter().find(|(known, _)| *known == name) else {
        return Err("it is no ready study".to_owned());
    };
    let render = || {
        let environment = environment(base, rungs)?;
        let template = environment.template_from_named_str(name, text)?;
        template.render(words_of(base_name, base, rungs))
    };
    render().map_err(|error: Error| match error.kind() {
        ErrorKind::InvalidOperation if error.detail().is_some() => {
            error.detail().unwrap_or_default().to_owned()
        }
        _ => format!("the template of the program itself is wrong: {error}"),
    })
}

/// Functions that a template can call.
fn environment(base: &Template, rungs: Option<&[Law]>) -> Result<Environment<'static>, Error> {
    let mut environment = page::environment()?;
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|_| AutoEscape::None);
    let values = base.clone();
    environment.add_function("key", move |path: &str| -> Result<Value, Error> {
        let key =
            KeyPath::find(path).map_err(|why| Error::new(ErrorKind::BadSerialization, why))?;
        Ok(values.own_number(&key).map_or(Value::from(()), Value::from))
    });
    let values = base.clone();
    environment.add_function("given", move |path: &str| -> bool {
        KeyPath::find(path).is_ok_and(|key| values.is_given(key.section, key.key.name))
    });
    let (allowed, _) = limits(base.base());
    environment.add_function("limit", move |figure: &str| {
        let limit = allowed.iter().find(|limit| limit.figure == figure);
        limit.map_or(Value::from(()), |limit| Value::from(limit.limit))
    });
    let intervals_s = base.base().motion.intervals_s();
    environment.add_function("is_shape_of_base", move |shape: Vec<f64>| {
        let whole = |of: &[f64]| of.iter().sum::<f64>();
        intervals_s.is_some_and(|own_s| {
            let alike = |(own, other): (&f64, &f64)| {
                (own / whole(&own_s) - other / whole(&shape)).abs() < 1e-6
            };
            shape.len() == own_s.len() && own_s.iter().zip(&shape).all(alike)
        })
    });
    let (law, asked) = (base.base().controller.law, rungs.map(<[Law]>::to_vec));
    environment.add_function("rungs", move |least: Vec<String>| -> Vec<&'static str> {
        let compared = |rung: &Law| least.iter().any(|name| name == rung.name());
        let taken = |rung: &Law| match &asked {
            Some(asked) => asked.contains(rung),
            None => *rung == law || compared(rung),
        };
        Law::ALL.into_iter().filter(taken).map(Law::name).collect()
    });
    environment.add_function("refuse", |why: &str| -> Result<Value, Error> {
        Err(Error::new(ErrorKind::InvalidOperation, why.to_owned()))
    });
    environment.add_filter("sig", |number: f64, digits: usize| {
        number::significant(number, digits)
    });
    // A time in whole nanoseconds, at least one.
    environment.add_filter("ns", |time_s: f64| libm::round(1e9 * time_s).max(1.0) / 1e9);
    environment.add_filter("shown", |number: f64| number::table(number));
    environment.add_filter("quoted", |text: &str| toml::Value::from(text).to_string());
    environment.add_filter("as_list", |values: Vec<Value>| {
        format!("{values:?}").replace('\'', "\"")
    });
    Ok(environment)
}

/// Values that a template can name.
fn words_of(base_name: &str, base: &Template, rungs: Option<&[Law]>) -> Value {
    let case = base.base();
    let (motion, transmission) = (&case.motion, &case.axis.transmission);
    let lines = case.encoder.counts_per_rad * core::f64::consts::FRAC_PI_2;
    // The carriage's way in one count, down to a power of ten.
    let count_um = 1e6 * transmission.screw_pitch_m_per_rad * transmission.gear_ratio
        / case.encoder.counts_per_rad;
    let rung = match rungs {
        Some(rungs) if !rungs.contains(&case.controller.law) => rungs.last(),
        _ => None,
    };
    let law = *rung.unwrap_or(&case.controller.law);
    let on = |law| {
        let mut case = case.clone();
        case.controller.law = law;
        case
    };
    let mut endless = on(Law::Firmware);
    endless.run.duration_ns = u64::MAX;
    context! {
        base => base_name,
        // As it can stand within quotes of TOML.
        name => case.name.replace('\\', "\\\\").replace('"', "\\\""),
        law => case.controller.law.name(),
        // The rung that pictures show: the base's own, if it is run.
        rung => law.name(),
        rigid => transmission.joint == Joint::Rigid,
        has_gap => case.has_gap(),
        // Whether theory has a linear loop of the runs.
        has_loop => law != Law::Continuous && margin(&on(law), JointState::Contact).is_some(),
        // Moves may end where they began.
        travel_mm => number::significant(1e3 * match motion.course() {
            Course::Row(_) | Course::Profile(_) => motion.largest_displacement_m(),
            _ => motion.travel_m(),
        }, 9),
        motion_time_s => motion.end_s(),
        // After all requests and faults: a study may run longer than its base.
        rest_from_s => rest_from_s(&endless),
        intervals_s => motion.intervals_s().map(Vec::from),
        duration_s => hil_core::number::seconds(case.run.duration_ns),
        dac_bits => case.dac.bits,
        dac_range_v => case.dac.step_v * f64::from(case.dac.bits).exp2(),
        lines => whole_lines(lines),
        count_um => libm::exp10(libm::floor(libm::log10(count_um))),
        has_budget => case.budget.is_some(),
    }
}

/// Lines of an encoder that is given by its counts per radian: a whole number
/// if it is one, else two digits of it, as K_enc may have been cut off.
fn whole_lines(lines: f64) -> f64 {
    let whole = libm::round(lines);
    match (lines - whole).abs() <= 1e-6 * lines {
        true => whole,
        false => libm::round(number::significant(lines, 2)).max(1.0),
    }
}
