//! The run files that are part of the program.

/// Name and text of every built-in case.
const CASES: [(&str, &str); 5] = [
    ("paper-1", include_str!("../../../../cases/paper-1.toml")),
    ("paper-2", include_str!("../../../../cases/paper-2.toml")),
    ("paper-3", include_str!("../../../../cases/paper-3.toml")),
    ("paper-4", include_str!("../../../../cases/paper-4.toml")),
    (
        "paper-2-12bit",
        include_str!("../../../../cases/paper-2-12bit.toml"),
    ),
];

/// Names of the built-in cases: the paper's four simulations and the second
/// one with the 12-bit converter of the paper's table.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    CASES.iter().map(|(name, _)| *name)
}

/// The run file of a built-in case, with its comments.
///
/// ```
/// use hil_core::runfile::builtin_text;
///
/// assert!(builtin_text("paper-1").is_some_and(|text| text.contains("[motor]")));
/// assert!(builtin_text("paper-9").is_none());
/// ```
pub fn builtin_text(name: &str) -> Option<&'static str> {
    CASES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}
