//! The key reference in Markdown, made from the key table.

use super::key_table::SECTIONS;
use super::keys::{Key, Need};

/// All keys of the run file: one table a section.
///
/// ```
/// let page = hil_core::runfile::key_reference();
/// assert!(page.contains("| `inertia_kg_m2` | kg m² | greater than 0 | required | every rung |"));
/// ```
pub fn key_reference() -> String {
    let mut page = String::from(
        "# Keys of the run file\n\n\
         TOML, one file a run. Integers serve for numbers; `nan` and `inf` are refused. Numbers\n\
         other than 0 lie between 1e-50 and 1e50 in magnitude. Times of the run (marked \"ns\") are\n\
         whole nanoseconds and at most 1e9 s. `hil-runner schema` prints the same as a JSON schema.\n",
    );
    for section in SECTIONS {
        let title = if section.name.is_empty() {
            "Top of the file".to_owned()
        } else {
            format!("`[{}]`", section.name)
        };
        page.push_str(&format!("\n## {title}\n\n{}\n\n", section.meaning));
        page.push_str("| key | unit | allowed | if left out | acts on | meaning |\n");
        page.push_str("| --- | --- | --- | --- | --- | --- |\n");
        for key in section.keys {
            page.push_str(&row(key));
        }
    }
    page
}

fn row(key: &Key) -> String {
    let unit = match key.kind {
        super::keys::Kind::Time(_) | super::keys::Kind::TimeOrWord(..) => "s (ns)",
        _ => key.unit,
    };
    let absent = match key.need {
        Need::Always => "required".to_owned(),
        Need::ElasticJoint => "required unless the joint is rigid".to_owned(),
        Need::SampledLaw => "required unless the law is \"continuous\"".to_owned(),
        Need::OneOf(partner) => format!("required unless `{partner}` is given; never both"),
        Need::NotWith(partner) => format!("–; never with `{partner}`"),
        Need::Optional => "–".to_owned(),
        Need::OnlyWith(partner) => format!("–; only with `{partner}`"),
        Need::Limit => "no limit".to_owned(),
        Need::FileStem => "stem of the file's name".to_owned(),
        Need::Default(default) => format!("`{}`", default.to_toml()),
    };
    let (name, allowed) = (key.name, key.range_words());
    let acts = key.acts.words();
    let meaning = key.meaning.trim_end_matches(',');
    format!("| `{name}` | {unit} | {allowed} | {absent} | {acts} | {meaning} |\n")
}
