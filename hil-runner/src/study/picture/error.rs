//! Reasons for a picture that cannot be drawn.

/// Reason for a missing picture, as a sentence. Every one is a mistake in the
/// study file or in the table; the other pictures of a study are not touched by
/// it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct PictureError(String);

impl PictureError {
    pub(super) fn new(sentence: impl Into<String>) -> Self {
        Self(sentence.into())
    }

    /// Columns, or a column and the unit that was asked for, with units that
    /// cannot share an axis.
    pub(super) fn units([first, other]: [(&str, &str); 2]) -> Self {
        let words = |unit| match unit {
            "" => "no unit",
            unit => unit,
        };
        Self(format!(
            "\"{}\" is in {} and \"{}\" in {}: they cannot share an axis",
            first.0,
            words(first.1),
            other.0,
            words(other.1)
        ))
    }
}
