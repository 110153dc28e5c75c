//! `tuned.toml`: the file of the case with its comments, and only the tuned keys changed.

use hil_core::runfile::{KeyPath, KeyValue};
use toml_edit::{DocumentMut, Item, Table, TomlError, Value};

/// The text of a run file with keys set to other values; whatever else stands in it stays as
/// it is. A key that was not there comes last in its section, a section that was not there
/// last in the file.
///
/// # Errors
/// The text or a value is no TOML.
///
/// ```
/// use hil_core::runfile::KeyPath;
/// use hil_runner::tune::tuned_file::with_values;
///
/// let kp = KeyPath::find("controller.kp")?;
/// let text = "[controller]\nkp = 3.2 # codes per count\n";
/// let tuned = with_values(text, &[(kp, kp.value(4.25))])?;
/// assert_eq!(tuned, "[controller]\nkp = 4.25 # codes per count\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn with_values(text: &str, values: &[(KeyPath, KeyValue)]) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    for (key, value) in values {
        let mut value: Value = value.to_toml().parse()?;
        let section = match key.section {
            "" => document.as_table_mut(),
            name => {
                let new = || Item::Table(Table::new());
                let section = document.entry(name).or_insert_with(new);
                match section.as_table_mut() {
                    Some(section) => section,
                    // An inline table becomes a section.
                    None => {
                        let inline = core::mem::take(section).into_table().unwrap_or_default();
                        *section = Item::Table(inline);
                        match section.as_table_mut() {
                            Some(section) => section,
                            None => continue,
                        }
                    }
                }
            }
        };
        match section.get_mut(key.key.name).and_then(Item::as_value_mut) {
            Some(known) => {
                *value.decor_mut() = known.decor().clone();
                *known = value;
            }
            None => {
                section.insert(key.key.name, Item::Value(value));
            }
        }
    }
    Ok(document.to_string())
}
