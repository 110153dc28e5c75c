//! What may have been meant: the nearest of the known names.

use super::key_table::SECTIONS;
use super::keys::either;

/// The hint for an unknown name, and the names it takes to be meant.
pub(super) struct Hint {
    pub(super) text: String,
    pub(super) meant: Vec<&'static str>,
}

/// Hint for a section that does not exist.
pub(super) fn section(unknown: &str) -> Hint {
    let names: Vec<&str> = SECTIONS
        .iter()
        .skip(1)
        .map(|section| section.name)
        .collect();
    let meant = nearest(unknown, &names);
    let text = if meant.is_empty() {
        format!("the sections are {}", names.join(", "))
    } else {
        let brackets: Vec<String> = meant.iter().map(|name| format!("[{name}]")).collect();
        format!("did you mean {}?", either(&brackets))
    };
    Hint { text, meant }
}

/// Hint for a key that its section does not have; `section` is empty at the
/// top of the file.
pub(super) fn key(section: &str, unknown: &str) -> Hint {
    // A name that is right, but in the wrong place: TOML puts every key into
    // the section whose header stands above it.
    if let Some(home) = SECTIONS.iter().find(|s| s.key(unknown).is_some()) {
        let text = if home.name.is_empty() {
            format!("{unknown} stands at the top of the file, before the first section")
        } else {
            format!("{unknown} belongs to [{}]", home.name)
        };
        return Hint {
            text,
            meant: Vec::new(),
        };
    }
    if SECTIONS.iter().any(|s| s.name == unknown) {
        return Hint {
            text: format!("{unknown} is a section; write [{unknown}]"),
            meant: Vec::new(),
        };
    }
    let known = SECTIONS.iter().find(|s| s.name == section);
    let names: Vec<&str> = known
        .iter()
        .flat_map(|section| section.keys)
        .map(|key| key.name)
        .collect();
    let meant = nearest(unknown, &names);
    let text = if !meant.is_empty() {
        let words: Vec<String> = meant.iter().map(|name| (*name).to_owned()).collect();
        format!("did you mean {}?", either(&words))
    } else if section.is_empty() {
        "only name stands outside the sections".to_owned()
    } else {
        format!("the keys of [{section}] are {}", names.join(", "))
    };
    Hint { text, meant }
}

/// Up to three names near `unknown`, the nearest first.
fn nearest<'a>(unknown: &str, names: &[&'a str]) -> Vec<&'a str> {
    let unknown = unknown.to_lowercase().replace('-', "_");
    let mut near: Vec<(usize, &str)> = names
        .iter()
        .filter_map(|name| Some((distance(&unknown, name)?, *name)))
        .collect();
    near.sort_by_key(|(distance, _)| *distance);
    let best = near.first().map_or(0, |(distance, _)| *distance);
    // One clear favourite stands alone; others only show if they are as near.
    near.into_iter()
        .filter(|(distance, _)| *distance == best)
        .map(|(_, name)| name)
        .take(3)
        .collect()
}

/// Edits between the two if they are few enough for a slip; a name without
/// its unit counts as one edit.
fn distance(unknown: &str, name: &str) -> Option<usize> {
    let prefix = unknown.len() >= 2 && name.starts_with(&format!("{unknown}_"));
    if prefix {
        return Some(1);
    }
    let longest = unknown.chars().count().max(name.len());
    // A long key cannot be a slip, and the table below is quadratic.
    if unknown.chars().count() > 2 * name.len() {
        return None;
    }
    let edits = edit_distance(unknown, name);
    (edits <= longest.div_ceil(3)).then_some(edits)
}

/// Levenshtein distance: insertions, deletions and replacements.
fn edit_distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = i;
        let mut left = i + 1;
        for (j, b) in to.iter().enumerate() {
            let above = row.get(j + 1).copied().unwrap_or(0);
            let best = (diagonal + usize::from(a != *b))
                .min(above + 1)
                .min(left + 1);
            if let Some(cell) = row.get_mut(j) {
                *cell = left;
            }
            diagonal = above;
            left = best;
        }
        if let Some(cell) = row.last_mut() {
            *cell = left;
        }
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::{edit_distance, key, nearest, section};

    #[test]
    fn edit_distance_counts_single_edits() {
        for (a, b, edits) in [
            ("", "", 0),
            ("", "abc", 3),
            ("abc", "", 3),
            ("kitten", "sitting", 3),
            ("motor", "moter", 1),
            ("flaw", "lawn", 2),
        ] {
            assert_eq!(edit_distance(a, b), edits, "{a} {b}");
        }
    }

    #[test]
    fn slips_are_recognised_and_strangers_are_not() {
        assert_eq!(section("moter").meant, ["motor"]);
        assert_eq!(section("quaternion").meant, [""; 0]);
        assert_eq!(key("motor", "inertia").meant, ["inertia_kg_m2"]);
        assert_eq!(key("budget", "final_eror_um").meant, ["final_error_um"]);
        assert_eq!(key("motor", "Resistance-Ohm").meant, ["resistance_ohm"]);
        assert!(key("motor", "kp").text.contains("belongs to [controller]"));
        assert_eq!(nearest("zz", &["kp", "kd_s"]), [""; 0]);
    }
}
