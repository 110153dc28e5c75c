//! Points errors of a run at the key of the run file that caused them.

use firmware::Refusal;
use firmware::law::Part;
use firmware::refusal::What;

use crate::error::RunError;
use crate::quantise::{QuantiseError, key};
use crate::runfile::RunFile;

/// The error of a run of this file as the user should read it.
pub fn explain(file: &RunFile, error: &RunError) -> String {
    let refuse = |key: &str, because: &str| match key.split_once('.') {
        Some((section, key)) => file.refuse(section, key, because).to_string(),
        None => because.to_owned(),
    };
    let RunError::Quantise(refused) = error else {
        return format!("{}: {error}", file.case.name);
    };
    match refused {
        QuantiseError::Gains(unfit) => {
            let lines = unfit.iter().map(|gain| refuse(gain.key, &gain.because()));
            lines.collect::<Vec<_>>().join("\n")
        }
        QuantiseError::Law(law) => refuse(key_of(law), &law.to_string()),
        QuantiseError::Setting { key, because, .. } => refuse(key, because),
        QuantiseError::DelayUnknown => {
            refuse("controller.computation_delay_s", &refused.to_string())
        }
        QuantiseError::Motion(_) | QuantiseError::Travel(_) => {
            refuse("motion.travel_mm", &refused.to_string())
        }
        QuantiseError::Setpoints(Refusal { value: 1.., .. }) => {
            refuse("controller.sample_time_s", &refused.to_string())
        }
        _ => format!("{}: {refused}", file.case.name),
    }
}

/// The key that a refusal of the law is best laid at.
fn key_of(error: &Refusal) -> &'static str {
    let part = match error.what {
        What::Gain(part, _) | What::LawFractionBits(part, _) | What::Term(part, _) => part,
        What::Difference(_) => Part::Derivative,
        What::ErrorSum => Part::Integral,
        What::FilterSmoothing | What::FilterFractionBits => {
            return "controller.derivative_filter_s";
        }
        What::Tracking => return "controller.tracking_time_s",
        _ => Part::Proportional,
    };
    key(part)
}
