//! An axis as C source: an initialiser of `servo_settings`, with what each word
//! means.

use firmware::axis::Axis;
use firmware::settings::Settings;
use hil_core::scaling::ScalingRequest;

use super::rust_axis::{commented, declared};

/// The constant `axis` of the case `name`, whose gains were made from `request`.
pub(super) fn source(name: &str, request: &ScalingRequest, axis: &Axis) -> String {
    let words = Settings::of(axis).to_words();
    let field = |((name, word), meaning): ((&str, u32), &str)| {
        let value = match word {
            u32::MAX => "UINT32_MAX".to_owned(),
            word => format!("{word}u"),
        };
        let meaning = meaning.replace(['\\', '`'], "");
        format!("    .{name} = {value}, /*{meaning} */\n")
    };
    let fields = Settings::NAMES
        .into_iter()
        .zip(words)
        .zip(Settings::MEANINGS);
    format!(
        "/* The axis of {name}, a sample every {} ns, by `hil-runner scaling --c`.\n *\n{} */\n\
         #include \"servo.h\"\n\nstatic const servo_settings axis = {{\n{}}};\n",
        request.sample_time_ns,
        commented(" * ", &declared(request, axis)),
        fields.map(field).collect::<String>(),
    )
}
