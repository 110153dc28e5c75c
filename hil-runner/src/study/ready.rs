//! The studies that are part of the program.

/// Name and text of every ready study.
const STUDIES: [(&str, &str); 7] = [
    (
        "sample-time",
        include_str!("../../studies/sample-time.toml"),
    ),
    ("resolution", include_str!("../../studies/resolution.toml")),
    ("backlash", include_str!("../../studies/backlash.toml")),
    ("gains", include_str!("../../studies/gains.toml")),
    (
        "word-length",
        include_str!("../../studies/word-length.toml"),
    ),
    ("motion", include_str!("../../studies/motion.toml")),
    ("tolerance", include_str!("../../studies/tolerance.toml")),
];

/// Names of the ready studies.
pub fn names() -> impl Iterator<Item = &'static str> {
    STUDIES.iter().map(|(name, _)| *name)
}

/// The study file of a ready study, with its comments.
pub fn text(name: &str) -> Option<&'static str> {
    STUDIES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}
