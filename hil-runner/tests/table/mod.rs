//! Tables of test cases, a line each.

/// The two sides of every line `left => right`, with `\n` on the left for the end of
/// a line; lines set in go on with the one before.
pub(crate) fn table(text: &str) -> Vec<(String, String)> {
    let text = text.trim().replace("\n    ", " ");
    let cases = text.lines().map(|line| {
        let (left, right) = line.split_once("=>").unwrap();
        (left.trim().replace("\\n", "\n"), right.trim().to_owned())
    });
    cases.collect()
}
