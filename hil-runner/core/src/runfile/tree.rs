//! A TOML document as a tree in which every value keeps its line and the text
//! that stands for it in the file.

use core::ops::Range;

use toml::de::{DeTable, DeValue};

use super::errors::{Findings, Place, Problem, one_line};

/// Longest piece of a value that a message repeats \[characters\].
const ECHO: usize = 60;

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) place: Place,
    /// The value as it was written, in one line.
    pub(super) text: String,
    pub(super) value: Toml,
}

/// A TOML value.
#[derive(Debug, Clone)]
pub(super) enum Toml {
    Text(String),
    Flag(bool),
    /// An integer or float, and its decimal text, which is kept because times are judged
    /// to 1e-6 ns, which `f64` cannot do from 10 s on.
    Number(f64, String),
    Date,
    Array(Vec<Node>),
    Table(Table),
}

impl Toml {
    /// The type, to say what a value is not.
    pub(super) fn type_words(&self) -> &'static str {
        match self {
            Self::Text(_) => "a string",
            Self::Flag(_) => "a boolean",
            Self::Number(..) => "a number",
            Self::Date => "a date",
            Self::Array(_) => "an array",
            Self::Table(_) => "a table",
        }
    }

    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value, _) => Some(*value),
            _ => None,
        }
    }

    pub(super) fn table(&self) -> Option<&Table> {
        match self {
            Self::Table(table) => Some(table),
            _ => None,
        }
    }

    /// The items of an array, each with its table if it is one.
    pub(super) fn rows(&self) -> Vec<(&Node, Option<&Table>)> {
        let items = match self {
            Self::Array(items) => items.iter(),
            _ => [].iter(),
        };
        items.map(|item| (item, item.value.table())).collect()
    }
}

/// Keys in the order of the file, each with its value.
#[derive(Debug, Clone, Default)]
pub(super) struct Table {
    pub(super) entries: Vec<(String, Node)>,
}

impl Table {
    pub(super) fn get(&self, key: &str) -> Option<&Node> {
        let (_, node) = self.entries.iter().find(|(name, _)| name == key)?;
        Some(node)
    }

    pub(super) fn get_mut(&mut self, key: &str) -> Option<&mut Node> {
        let mut entries = self.entries.iter_mut();
        entries.find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// The keys of a section that is there and is a table.
    pub(super) fn section(&self, name: &str) -> Option<&Self> {
        if name.is_empty() {
            return Some(self);
        }
        self.get(name)?.value.table()
    }

    /// Sets a key, in its old place if it is there.
    pub(super) fn set(&mut self, key: &str, node: Node) {
        match self.get_mut(key) {
            Some(old) => *old = node,
            None => self.entries.push((key.to_owned(), node)),
        }
    }
}

/// Reads a whole file.
///
/// # Errors
/// Line and problem if the text is not TOML.
pub(super) fn parse_document(text: &str) -> Result<Table, (Place, Problem)> {
    let breaks = text.match_indices('\n').map(|(at, _)| at + 1);
    let starts: Vec<usize> = core::iter::once(0).chain(breaks).collect();
    // Line and column, both from 1, the column in characters.
    let position = |offset: usize| {
        let line = starts.partition_point(|start| *start <= offset);
        let start = starts.get(line.saturating_sub(1)).copied();
        let before = text.get(start.unwrap_or(0)..offset).unwrap_or("");
        (line, before.chars().count() + 1)
    };
    let locate = |span: Range<usize>| {
        let (line, _) = position(span.start);
        (Place::Line(line), text.get(span).unwrap_or(""))
    };
    match DeTable::parse(text) {
        Ok(document) => Ok(table(document.get_ref(), &locate)),
        Err(error) => {
            let (at, message) = syntax_error(text, &error);
            let (line, column) = position(at);
            Err((Place::Line(line), Problem::Syntax { column, message }))
        }
    }
}

/// Reads one value that was given on the command line.
///
/// # Errors
/// The parser's message if the text is not a TOML value.
pub(super) fn parse_value(text: &str, place: &Place) -> Result<Node, String> {
    match DeValue::parse(text) {
        Ok(value) => {
            let locate = |span: Range<usize>| (place.clone(), text.get(span).unwrap_or(""));
            Ok(node(value.get_ref(), value.span(), &locate))
        }
        Err(error) => Err(syntax_error(text, &error).1),
    }
}

/// Place of an error in the text, and the parser's message with what it leaves out.
fn syntax_error(text: &str, error: &toml::de::Error) -> (usize, String) {
    let span = error.span().unwrap_or(text.len()..text.len());
    let at = span.start;
    let unexpected = one_line(text.get(span).unwrap_or(""), ECHO);
    let message = match error.message() {
        "duplicate key" => format!("{unexpected} is given twice"),
        message if message.starts_with("string values must be quoted") => {
            if unexpected.is_empty() {
                "a value is missing here".to_owned()
            } else {
                format!("{unexpected} is no TOML value; strings stand in quotes")
            }
        }
        message if message.starts_with("unexpected key or value") => {
            "there is more than one value on this line".to_owned()
        }
        message => one_line(message.trim_end_matches(", expected nothing"), usize::MAX),
    };
    (at, message)
}

/// Place and text of a span.
type Locate<'a> = &'a dyn Fn(Range<usize>) -> (Place, &'a str);

fn table(source: &DeTable<'_>, locate: Locate<'_>) -> Table {
    // The parser sorts by name; the file's own order is that of the spans.
    let mut keys: Vec<_> = source.iter().collect();
    keys.sort_by_key(|(key, _)| key.span().start);
    let entries = keys.into_iter().map(|(key, value)| {
        let name = key.get_ref().to_string();
        (name, node(value.get_ref(), value.span(), locate))
    });
    Table {
        entries: entries.collect(),
    }
}

fn node(value: &DeValue<'_>, span: Range<usize>, locate: Locate<'_>) -> Node {
    let (place, text) = locate(span);
    let text = match value {
        // Of dotted keys the parser has the key's own span.
        DeValue::Table(_) if !text.starts_with(['{', '[']) => "{ … }".to_owned(),
        _ => one_line(text, ECHO),
    };
    Node {
        place,
        text,
        value: match value {
            DeValue::String(text) => Toml::Text(text.to_string()),
            DeValue::Integer(integer) => integer_number(integer),
            DeValue::Float(float) => decimal_number(float.as_str()),
            DeValue::Boolean(flag) => Toml::Flag(*flag),
            DeValue::Datetime(_) => Toml::Date,
            DeValue::Array(array) => Toml::Array(
                array
                    .iter()
                    .map(|item| node(item.get_ref(), item.span(), locate))
                    .collect(),
            ),
            DeValue::Table(inner) => Toml::Table(table(inner, locate)),
        },
    }
}

fn integer_number(integer: &toml::de::DeInteger<'_>) -> Toml {
    if integer.radix() == 10 {
        return decimal_number(integer.as_str());
    }
    let value = i128::from_str_radix(integer.as_str(), integer.radix());
    // More than 127 bits: as good as infinite.
    decimal_number(&value.map_or("inf".to_owned(), |value| value.to_string()))
}

fn decimal_number(text: &str) -> Toml {
    // The sum turns −0 into 0, so that no sign hides in a zero. What is
    // no number cannot pass the parser; NaN is refused further on.
    Toml::Number(text.parse().unwrap_or(f64::NAN) + 0.0, text.to_owned())
}

/// Largest part of a nanosecond that is taken for rounding, as a fraction and
/// as its complement.
const TOLERANCE: (f64, f64) = (0.000_001, 0.999_999);

/// Places that are looked at on either side of the point: 64 bits hold 20 digits, and
/// as many behind the point are far below the tolerance.
const PLACES: usize = 20;

/// The nanoseconds in `decimal` seconds, without a detour over `f64`; `None` if
/// they are not whole, or are negative or too many for 64 bits.
///
/// A time of the run must be a whole number of nanoseconds to 1e-6 ns. An `f64`
/// near 100 s is 1.4e-5 ns wide, so the decimal text itself is judged: 100.001 is
/// exact, 100.0010000000001 is not.
pub(super) fn nanoseconds(decimal: &str) -> Option<u64> {
    let unsigned = decimal.strip_prefix('+').unwrap_or(decimal);
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i64>().ok()?),
        None => (unsigned, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{whole}{fraction}");
    if digits.is_empty() || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let significant = digits.trim_start_matches('0');
    if significant.is_empty() {
        return Some(0);
    }
    // How many significant digits stand before the point, in nanoseconds.
    let leading = digits.len() - significant.len();
    let point = i64::try_from(whole.len()).ok()? - i64::try_from(leading).ok()?;
    let point = point.checked_add(exponent)?.checked_add(9)?;
    let Ok(point) = usize::try_from(point.saturating_add(PLACES as i64)) else {
        return Some(0);
    };
    if point > 2 * PLACES {
        return None;
    }
    let zeros = "0".repeat(PLACES);
    let padded = format!("{zeros}{significant}{zeros}");
    let (before, after) = padded.split_at_checked(point)?;
    let whole_ns: u64 = format!("0{before}").parse().ok()?;
    let part: f64 = format!("0.{after}").parse().ok()?;
    match part {
        _ if part <= TOLERANCE.0 => Some(whole_ns),
        _ if part >= TOLERANCE.1 => whole_ns.checked_add(1),
        _ => None,
    }
}

impl Findings {
    /// Records a value that its key does not allow.
    pub(super) fn refuse(&mut self, node: &Node, key: &str, because: String) {
        let problem = Problem::NotAllowed {
            key: key.to_owned(),
            text: node.text.clone(),
            because,
        };
        self.push(node.place.clone(), problem);
    }
}

#[cfg(test)]
mod tests {
    use super::nanoseconds;

    #[test]
    fn whole_nanoseconds_are_counted() {
        for (text, ns) in [
            ("0", 0),
            ("0.0", 0),
            ("0e9", 0),
            ("1", 1_000_000_000),
            ("+1.5", 1_500_000_000),
            ("0.001", 1_000_000),
            ("1e-3", 1_000_000),
            ("1E-9", 1),
            ("0.000000001", 1),
            ("123456789.987654321", 123_456_789_987_654_321),
            // Sums of f64 as scripts print them.
            ("0.30000000000000004", 300_000_000),
            ("0.09999999999999999", 100_000_000),
            ("100.001", 100_001_000_000),
            ("00.1e1", 1_000_000_000),
            ("1e9", 1_000_000_000_000_000_000),
            ("1e-500", 0),
        ] {
            assert_eq!(nanoseconds(text), Some(ns), "{text}");
        }
    }

    #[test]
    fn the_tolerance_is_a_millionth_of_a_nanosecond() {
        assert_eq!(nanoseconds("0.001000000000001"), Some(1_000_000));
        assert_eq!(nanoseconds("0.0010000000000011"), None);
        assert_eq!(nanoseconds("0.000999999999999999"), Some(1_000_000));
        assert_eq!(nanoseconds("0.0009999999999989"), None);
        assert_eq!(nanoseconds("100.0010000000001"), None);
        assert_eq!(nanoseconds("5e-10"), None);
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        for text in [
            "-1",
            "nan",
            "inf",
            "",
            ".",
            "e5",
            "1e20",
            "1e400",
            "1e99999999999999999999",
            "1e9223372036854775807",
        ] {
            assert_eq!(nanoseconds(text), None, "{text}");
        }
    }
}
