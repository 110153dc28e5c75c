//! The width of a text, without fonts: the widest that a reader may have.

/// Size of the title \[px\].
pub(super) const TITLE_PX: f64 = 18.0;
/// Size of the titles of axes \[px\].
pub(super) const AXIS_PX: f64 = 15.0;
/// Size of numbers at ticks and of the legend \[px\].
pub(super) const TICK_PX: f64 = 14.0;
/// Size of remarks \[px\]; nothing is smaller.
pub(super) const NOTE_PX: f64 = 13.0;
/// Height of a line over the size of its letters.
pub(super) const LINE: f64 = 1.3;

/// Advance of the characters from space to `~` in hundredths of the size: the
/// larger of DejaVu Sans (the metrics of Verdana) and Liberation Sans (those of
/// Arial and Helvetica), one of which stands behind `sans-serif` nearly
/// everywhere.
const ADVANCE: [u8; 95] = [
    32, 40, 46, 84, 64, 95, 78, 27, 39, 39, 50, 84, 32, 36, 32, 34, 64, 64, 64, 64, 64, 64, 64, 64,
    64, 64, 34, 34, 84, 84, 84, 56, 102, 68, 69, 72, 77, 67, 61, 78, 75, 29, 50, 67, 56, 86, 75,
    79, 67, 79, 72, 67, 61, 73, 68, 99, 69, 67, 69, 39, 34, 39, 84, 56, 50, 61, 63, 55, 63, 62, 35,
    63, 63, 28, 28, 58, 28, 97, 63, 61, 63, 63, 41, 52, 39, 63, 59, 82, 59, 59, 52, 64, 34, 64, 84,
];

/// Bold over regular: the widest letter in common use.
const BOLD: f64 = 1.18;

/// Width of a text \[px\], rather too large than too small.
pub(super) fn width(text: &str, size_px: f64) -> f64 {
    let advance = |letter: char| match u32::from(letter) {
        code @ 0x20..=0x7e => ADVANCE
            .get((code - 0x20) as usize)
            .map_or(1.0, |&advance| f64::from(advance) / 100.0),
        // Letters of Europe, Greek, raised digits; then signs as wide as −.
        0xa0..=0x3ff | 0x1e00..=0x1fff | 0x2070..=0x209f => 0.69,
        0x2000..=0x2bff => 0.84,
        // Scripts whose letters fill a square.
        _ => 1.0,
    };
    size_px * text.chars().map(advance).sum::<f64>()
}

/// Width of a bold text \[px\].
pub(super) fn bold_width(text: &str, size_px: f64) -> f64 {
    BOLD * width(text, size_px)
}

/// Folds a text into lines of at most that width: at spaces, else behind the
/// joints of names, else anywhere.
pub(super) fn fold(text: &str, size_px: f64, line_px: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    // A space that must not break is no end of a word.
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        let longer = match line.as_str() {
            "" => word.to_owned(),
            line => format!("{line} {word}"),
        };
        if width(&longer, size_px) <= line_px {
            line = longer;
            continue;
        }
        if !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        let mut pieces = broken(word, size_px, line_px);
        line = pieces.pop().unwrap_or_default();
        lines.extend(pieces);
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// A word in pieces of at most that width, of at least one letter each.
fn broken(word: &str, size_px: f64, line_px: f64) -> Vec<String> {
    let (mut pieces, mut rest) = (Vec::new(), word);
    while !rest.is_empty() && width(rest, size_px) > line_px {
        let ends = rest
            .char_indices()
            .map(|(at, letter)| at + letter.len_utf8());
        let fitting = ends
            .clone()
            .take_while(|&end| width(&rest[..end], size_px) <= line_px)
            .last()
            .or(ends.clone().next())
            .unwrap_or(rest.len());
        // Behind the last joint of what fits.
        let joint = rest[..fitting].rfind(['_', '.', '-', '/', ',']);
        let (piece, more) = rest.split_at(joint.map_or(fitting, |at| at + 1));
        pieces.push(piece.to_owned());
        rest = more;
    }
    pieces.push(rest.to_owned());
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_the_width_of_the_widest_font() {
        // DejaVu Sans: "mm" is 2·0.974 of the size, "il" 2·0.278.
        assert!((width("mm", 100.0) - 194.0).abs() < 1e-9);
        assert!((width("il", 100.0) - 56.0).abs() < 1e-9);
        assert!(bold_width("mm", 100.0) > 220.0);
    }

    #[test]
    fn lines_keep_the_width_and_every_letter() {
        let text = "Peak following error of a_name_that_is_far_too_long_for_one_line here";
        for line_px in [30.0, 90.0, 200.0, 1e4] {
            let lines = fold(text, 14.0, line_px);
            assert!(lines.iter().all(|line| width(line, 14.0) <= line_px));
            let letters = |text: &str| text.replace(' ', "");
            assert_eq!(letters(&lines.concat()), letters(text), "{line_px}");
        }
        // The contrast: a line that is not folded is too wide.
        assert!(width(text, 14.0) > 200.0);
        assert_eq!(fold(text, 14.0, 90.0)[0], "Peak");
    }

    #[test]
    fn names_break_behind_their_joints() {
        let found = fold("peak_following", 10.0, 40.0);
        assert_eq!(found, ["peak_", "followin", "g"].map(String::from));
    }
}
