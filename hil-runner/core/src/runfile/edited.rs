//! A run file with other values: its text with comments and order, in which only the keys
//! that are set are changed.

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use super::keys::Section;
use super::table;
use super::{Place, Problem, RunFileErrors};

/// The text of a run file with `sets`, each `section.key=value` as on the command line;
/// whatever else stands in it stays as it is. A key that was not there comes last in its
/// section, a section that was not there last in the file; a key that says the same in
/// another way goes.
///
/// # Errors
/// The text is no TOML, or a set names no key of a section or a row that is there. Whether
/// the file is right then is for [`RunFile::parse`](super::RunFile::parse) to say.
///
/// ```
/// use hil_core::runfile::with_sets;
///
/// let text = "[controller]\nkp = 3.2 # codes per count\n";
/// let tuned = with_sets("x.toml", text, &["controller.kp=4.25".to_owned()])?;
/// assert_eq!(tuned, "[controller]\nkp = 4.25 # codes per count\n");
/// # Ok::<(), hil_core::runfile::RunFileErrors>(())
/// ```
pub fn with_sets(source_name: &str, text: &str, sets: &[String]) -> Result<String, RunFileErrors> {
    let unreadable = |because: String| RunFileErrors::unreadable(source_name, because);
    let parsed = text.parse::<DocumentMut>();
    let mut document = parsed.map_err(|error| unreadable(error.to_string()))?;
    for set in sets {
        if put(&mut document, set).is_none() {
            let because = "it names no key of a section, or of a row that the file has".to_owned();
            let (place, problem) = (Place::Set(set.clone()), Problem::Override(because));
            return Err(RunFileErrors::one(source_name, place, problem));
        }
    }
    Ok(document.to_string())
}

/// Puts one set into a document; none if it has no place there.
fn put(document: &mut DocumentMut, set: &str) -> Option<()> {
    let (path, text) = set.split_once('=')?;
    let path: Vec<&str> = path.split('.').map(str::trim).collect();
    // A bare word is a string.
    let value = text.trim().parse();
    let value = value.unwrap_or_else(|_| Value::from(text.trim()));
    match *path.as_slice() {
        [key] => put_key(document.as_table_mut(), table::find("")?, key, value),
        [section, key] => {
            let table = section_of(document, section)?;
            put_key(table, table::find(section)?, key, value)
        }
        [list, row, key] => {
            let rows = document.get_mut(list)?;
            let place = row.parse::<usize>().ok()?.checked_sub(1)?;
            let row: &mut dyn TableLike = match rows {
                Item::ArrayOfTables(rows) => rows.get_mut(place)?,
                other => {
                    let row = other.as_array_mut()?.get_mut(place)?;
                    row.as_inline_table_mut()?
                }
            };
            put_key(row, &table::find_list(list)?.row, key, value)
        }
        _ => None,
    }
}

/// A section, new if it is not there; an inline table becomes one.
fn section_of<'d>(document: &'d mut DocumentMut, name: &str) -> Option<&'d mut Table> {
    let section = document.entry(name);
    let section = section.or_insert_with(|| Item::Table(Table::new()));
    if !section.is_table() {
        let inline = core::mem::take(section).into_table().ok()?;
        *section = Item::Table(inline);
        // The space before its `=`.
        document.key_mut(name)?.leaf_decor_mut().clear();
    }
    document.get_mut(name)?.as_table_mut()
}

fn put_key(
    table: &mut dyn TableLike,
    section: &Section,
    key: &str,
    mut value: Value,
) -> Option<()> {
    let key = section.key(key)?.name;
    for other in section.others(key) {
        table.remove(other);
    }
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(known) => {
            *value.decor_mut() = known.decor().clone();
            *known = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edited(text: &str, sets: &[&str]) -> Result<String, String> {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        with_sets("x.toml", text, &sets).map_err(|errors| errors.to_string())
    }

    #[test]
    fn comments_stay_and_other_ways_go() {
        let text = "# axis\nname = \"a\" # short\n\n[encoder]\nlines = 500 # of the disc\n\n[[load]]\n\
                    force_n = 1 # N\n";
        let sets = [
            "encoder.counts_per_rad=400",
            "name=b",
            "load.1.force_n=2",
            "run.solver=rk4",
        ];
        let wanted = "# axis\nname = \"b\" # short\n\n[encoder]\ncounts_per_rad = 400\n\n[[load]]\n\
                      force_n = 2 # N\n\n[run]\nsolver = \"rk4\"\n";
        assert_eq!(edited(text, &sets).as_deref(), Ok(wanted));
        let inline = "load = [{ force_n = 1 }]\nmotor = { resistance_ohm = 1 }\n";
        let wanted = "load = [{ force_n = 2 }]\n\n[motor]\nresistance_ohm = 3\n";
        let sets = ["load.1.force_n=2", "motor.resistance_ohm=3"];
        assert_eq!(edited(inline, &sets).as_deref(), Ok(wanted));
    }

    #[test]
    fn what_has_no_place_is_told() {
        for set in [
            "load.2.force_n=1",
            "motor.strange=1",
            "strange.key=1",
            "kp",
            "a.b.c.d=1",
        ] {
            let error = edited("[[load]]\nforce_n = 1\n", &[set]).unwrap_err();
            assert!(
                error.starts_with(&format!("--set {set}: it names no key")),
                "{error}"
            );
        }
        assert!(edited("[[load\n", &[]).unwrap_err().starts_with("x.toml: "));
    }
}
