//! Command lines of this program, as reports and messages show them.

/// The line that starts this program with these words: a POSIX shell takes
/// each of them as it is.
///
/// ```
/// use hil_runner::command_line::command_line;
///
/// let words = ["run", "my axis.toml", "--set", "motion.travel_mm=20"];
/// assert_eq!(
///     command_line(words),
///     "hil-runner run 'my axis.toml' --set 'motion.travel_mm=20'",
/// );
/// ```
pub fn command_line<'w>(words: impl IntoIterator<Item = &'w str>) -> String {
    let words = core::iter::once("hil-runner").chain(words);
    // Quoting fails for NUL alone, which no command line can have had.
    let quoter = shlex::Quoter::new().allow_nul(true);
    quoter.join(words).unwrap_or_default()
}

/// An option that is given once for each of its values.
pub fn each_with<'w>(
    option: &'w str,
    values: impl IntoIterator<Item = &'w String>,
) -> impl Iterator<Item = &'w str> {
    let pair = move |value: &'w String| [option, value.as_str()];
    values.into_iter().flat_map(pair)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signs that a shell would take apart or put something else in the place of.
    #[test]
    fn a_shell_takes_the_words_as_they_are() {
        let values = [
            "a b",
            "it's",
            "\"$HOME\" `id` $(id)",
            "motion.intervals_s=[0.1, 0.2, 0.0]",
            "budget={a = 1}",
            "line\nbreak",
            "",
            "*?~!^#;&|<>\\",
            "µ",
        ];
        let line = command_line(values);
        let taken = shlex::split(&line).unwrap();
        assert_eq!(taken[0], "hil-runner");
        assert_eq!(taken[1..], values);
        // And not as they stand.
        assert_ne!(shlex::split(&values.join(" ")).unwrap_or_default(), values);
    }

    #[test]
    fn an_option_stands_before_each_of_its_values() {
        let sets = ["a=1".to_owned(), "b=2".to_owned()];
        let words: Vec<&str> = each_with("--set", &sets).collect();
        assert_eq!(words, ["--set", "a=1", "--set", "b=2"]);
    }
}
