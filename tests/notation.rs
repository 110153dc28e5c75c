//! Holds `NOTATION.md` true: its files, names, units and equation numbers are
//! looked up in the sources, and no symbol of the paper may be missing.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Ends of names, and the unit that such a name has.
const SUFFIXES: &str = "\
    _s s, _ns ns, _m m, _mps m/s, _mps2 m/s², _ms m s, _rad rad, _radps rad/s, _rads rad s, \
    _m_per_rad m/rad, _kg kg, _kg_m2 kg m², _n N, _ns_per_rad N s/rad, \
    _ns2_per_rad2 N s²/rad², _nm N m, _nm_per_rad N m/rad, _nms_per_rad N m s/rad, \
    _nm_per_a N m/A, _vs_per_rad V s/rad, _j J, _v V, _a A, _as A s, _ohm Ω, _h H, _per_s 1/s, _counts counts, \
    _counts_per_rad counts/rad";

fn suffixes() -> impl Iterator<Item = (&'static str, &'static str)> {
    let suffixes = SUFFIXES.split(", ");
    suffixes.filter_map(|suffix| suffix.split_once(' '))
}

/// The paper's list of symbols.
const LIST_OF_SYMBOLS: [&str; 42] = [
    "T", "U", "D", "W", "α_ref", "α", "β", "γ", "ε", "x", "e", "e_s", "y", "J_m", "J_v", "M", "z",
    "p", "k", "c", "b", "τ_m", "F_r", "k_m", "R", "L", "I", "V_m", "V_max", "V_out", "n", "ΔV",
    "K_dac", "N", "K_enc", "K_a", "K_0", "K_p", "K_i", "K_d", "h", "T_0",
];

/// Symbols that the paper introduces later, as the second table names them.
const INTRODUCED_LATER: [&str; 16] = [
    "Ψ",
    "Ψ_e, Ψ_v",
    "a_0",
    "a_1",
    "a_2",
    "𝒢_1",
    "𝒢_2, 𝒢",
    "J_eq",
    "E",
    "ℋ",
    "ê",
    "α̂_ref",
    "β̂",
    "u_0 … u_5",
    "u̇_0 … u̇_5",
    "t_1 … t_7",
];

/// Marks a cell for which there is nothing to say.
const NOTHING: &str = "–";

/// One row of a table of symbols.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    symbol: String,
    name: String,
    unit: String,
    file: String,
    equations: String,
    meaning: String,
}

fn cells(line: &str) -> Option<Vec<String>> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    let cells = inner.split('|').map(|cell| cell.trim().to_owned());
    Some(cells.collect())
}

/// The rows of all tables that start with the given heads.
fn tables(page: &str, heads: &[&str]) -> Vec<Vec<String>> {
    let (mut rows, mut inside) = (Vec::new(), false);
    for line in page.lines() {
        match cells(line) {
            None => inside = false,
            Some(row) if row == heads => inside = true,
            Some(row) if inside && !row.iter().all(|cell| cell == "---") => rows.push(row),
            Some(_) => {}
        }
    }
    rows
}

const HEADS: &str = "symbol|name in code|unit|file|equation|meaning";

fn rows(page: &str) -> Result<Vec<Row>, String> {
    let row = |cells: Vec<String>| {
        let cells: [String; 6] = cells
            .try_into()
            .map_err(|cells| format!("a row has not six cells: {cells:?}"))?;
        let [symbol, name, unit, file, equations, meaning] = cells;
        let name = name.trim_matches('`').to_owned();
        Ok(Row {
            symbol,
            name,
            unit,
            file,
            equations,
            meaning,
        })
    };
    let heads: Vec<&str> = HEADS.split('|').collect();
    tables(page, &heads).into_iter().map(row).collect()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// True if `word` occurs in `text` with no letter, digit or `_` beside it.
fn has_word(text: &str, word: &str) -> bool {
    text.match_indices(word).any(|(at, _)| {
        !text[..at].ends_with(is_word) && !text[at + word.len()..].starts_with(is_word)
    })
}

/// A number at the start of `text`, and what follows; not "2nd".
fn leading_number(text: &str) -> Option<(u32, &str)> {
    let digits = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    let (number, rest) = text.split_at(digits);
    let ordinal = rest.starts_with(char::is_alphabetic);
    Some((number.parse().ok().filter(|_| !ordinal)?, rest))
}

/// The numbers of `8-10, 13 and 15`, up to where the list ends.
fn numbers(mut text: &str) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    while let Some((first, mut rest)) = leading_number(text) {
        let mut last = first;
        if let Some((end, beyond)) = rest.strip_prefix('-').and_then(leading_number) {
            (last, rest) = (end, beyond);
        }
        found.extend(first..=last);
        let next = [", ", " and "]
            .iter()
            .find_map(|between| rest.strip_prefix(between));
        text = next.unwrap_or("");
    }
    found
}

/// All equations that a source names.
fn equations_of(source: &str) -> BTreeSet<u32> {
    let lower = source.to_lowercase();
    lower
        .match_indices("eq. ")
        .flat_map(|(at, mark)| numbers(&lower[at + mark.len()..]))
        .collect()
}

/// The fault of a row's equation cell.
fn wrong_equations(row: &Row, source: &str) -> Vec<String> {
    let (cell, file) = (row.equations.as_str(), &row.file);
    if cell == NOTHING {
        return Vec::new();
    }
    if let Some(figure) = cell.strip_prefix("Fig. ") {
        let named = has_word(source, &format!("Fig. {figure}"));
        let wrong = (!named).then(|| format!("{}: {file} does not name Fig. {figure}", row.symbol));
        return wrong.into_iter().collect();
    }
    let wanted = numbers(cell);
    if wanted.is_empty() {
        return vec![format!("{}: \"{cell}\" is no equation", row.symbol)];
    }
    let symbol = &row.symbol;
    let named = equations_of(source);
    let missing = wanted.difference(&named);
    let wrong = missing.map(|n| format!("{symbol}: {file} does not name eq. {n}"));
    wrong.collect()
}

/// The unit that the longest fitting suffix stands for.
fn unit_of_name(name: &str) -> Option<&'static str> {
    let name = format!("_{}", name.rsplit("::").next().unwrap_or(name));
    let fitting = suffixes().filter(|(suffix, _)| name.ends_with(suffix));
    let longest = fitting.max_by_key(|(suffix, _)| suffix.len());
    longest.map(|(_, unit)| unit)
}

/// The faults of one row.
fn wrong_row(row: &Row, root: &Path) -> Vec<String> {
    let symbol = &row.symbol;
    if row.meaning.is_empty() || row.unit.is_empty() || symbol.is_empty() {
        return vec![format!("{symbol}: a cell is empty")];
    }
    if row.name == NOTHING {
        let cells = [&row.file, &row.equations];
        let wrong = cells.iter().any(|cell| *cell != NOTHING);
        return Vec::from_iter(wrong.then(|| format!("{symbol}: a file but no name")));
    }
    let Ok(source) = fs::read_to_string(root.join(&row.file)) else {
        return vec![format!("{symbol}: no file {}", row.file)];
    };
    let mut wrong = wrong_equations(row, &source);
    for word in row.name.split("::").filter(|word| !has_word(&source, word)) {
        wrong.push(format!("{symbol}: no {word} in {}", row.file));
    }
    if let Some(unit) = unit_of_name(&row.name) {
        // The gains leave out "codes/count", which the page says.
        if row.unit != unit && row.unit != format!("codes/count · {unit}") {
            let (name, not) = (&row.name, &row.unit);
            wrong.push(format!("{symbol}: {name} is in {unit}, not in {not}"));
        }
    }
    wrong
}

/// Everything that is wrong with a page.
fn wrong(page: &str, root: &Path) -> Vec<String> {
    let rows = match rows(page) {
        Ok(rows) => rows,
        Err(error) => return vec![error],
    };
    let mut wrong: Vec<String> = rows.iter().flat_map(|row| wrong_row(row, root)).collect();
    let mut seen = BTreeSet::new();
    for row in rows.iter().filter(|row| !seen.insert(row.symbol.as_str())) {
        wrong.push(format!("{}: two rows", row.symbol));
    }
    let needed = LIST_OF_SYMBOLS.iter().chain(&INTRODUCED_LATER);
    for symbol in needed.filter(|&&symbol| !seen.contains(symbol)) {
        wrong.push(format!("{symbol}: no row"));
    }
    let suffixes = suffixes().map(|(s, unit)| vec![format!("`{s}`"), unit.into()]);
    if !tables(page, &["suffix", "unit"]).into_iter().eq(suffixes) {
        wrong.push("the table of suffixes is not the one of this test".into());
    }
    wrong
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

fn page() -> String {
    fs::read_to_string(root().join("NOTATION.md")).unwrap()
}

#[test]
fn the_page_is_true() {
    let wrong = wrong(&page(), root());
    assert!(wrong.is_empty(), "NOTATION.md:\n{}", wrong.join("\n"));
}

/// The paper's list is complete and in its order, and nothing was skipped by
/// the reader of the tables.
#[test]
fn the_first_table_is_the_papers_list() {
    let rows = rows(&page()).unwrap();
    let symbols: Vec<&str> = rows.iter().map(|row| row.symbol.as_str()).collect();
    assert_eq!(symbols[..LIST_OF_SYMBOLS.len()], LIST_OF_SYMBOLS);
    let lines = page().lines().filter(|line| line.starts_with("| ")).count();
    // Two lines of head per table, three tables of symbols and one of suffixes.
    assert_eq!(rows.len() + suffixes().count() + 2 * 4, lines);
}

/// The contrast: each kind of mistake is reported, and nothing else.
#[test]
fn mistakes_are_reported() {
    let inertia = "| J_m | `Motor::inertia_kg_m2` | kg m² | plant/src/model/motor.rs | 2 |";
    let mass = "| M | `Carriage::mass_kg` |";
    let file = "plant/src/model/motor.rs";
    let of_inertia = [
        (file, "plant/src/motor.rs", "no file plant/src/motor.rs"),
        (
            "| 2 |",
            "| 37 |",
            "plant/src/model/motor.rs does not name eq. 37",
        ),
        ("| 2 |", "| ? |", "\"?\" is no equation"),
        (
            "| 2 |",
            "| Fig. 6 |",
            "plant/src/model/motor.rs does not name Fig. 6",
        ),
        ("kg m²", "kg", "Motor::inertia_kg_m2 is in kg m², not in kg"),
        ("kg m²", "", "a cell is empty"),
    ];
    let of_mass = [
        (
            "mass_kg",
            "mass_k",
            "no mass_k in plant/src/model/resistance.rs",
        ),
        (
            "Carriage",
            "Carriages",
            "no Carriages in plant/src/model/resistance.rs",
        ),
        ("`Carriage::mass_kg`", "–", "a file but no name"),
    ];
    let of_inertia = of_inertia.map(|it| (inertia, "J_m: ", it));
    let of_mass = of_mass.map(|it| (mass, "M: ", it));
    let of_a_suffix = "the table of suffixes is not the one of this test";
    let of_a_suffix = ("| `_v` | V |", "", ("V |", "A |", of_a_suffix));
    for (good, symbol, (part, other, report)) in
        of_inertia.into_iter().chain(of_mass).chain([of_a_suffix])
    {
        let (bad, report) = (good.replace(part, other), format!("{symbol}{report}"));
        assert_eq!(page().matches(good).count(), 1, "{good}");
        assert_eq!(wrong(&page().replace(good, &bad), root()), [report]);
    }
    let without = |symbol: &str| {
        let row = format!("| {symbol} |");
        let page = page();
        let lines = page.lines().filter(|line| !line.starts_with(&row));
        lines.map(|line| format!("{line}\n")).collect::<String>()
    };
    for symbol in LIST_OF_SYMBOLS.iter().chain(&INTRODUCED_LATER) {
        let none = format!("{symbol}: no row");
        assert_eq!(wrong(&without(symbol), root()), [none]);
    }
    let page = page();
    let mut lines = page.lines();
    let line = lines.find(|line| line.starts_with("| K_enc |")).unwrap();
    let twice = page.replace(line, &format!("{line}\n{line}"));
    assert_eq!(wrong(&twice, root()), ["K_enc: two rows"]);
    let short = page.replace(line, "| K_enc | `Encoder` |");
    assert!(wrong(&short, root())[0].contains("not six cells"));
}

#[test]
fn equations_are_read_as_they_are_written() {
    for (source, found) in [
        ("(paper, eq. 8-10, Fig. 3)", vec![8, 9, 10]),
        ("eq. 12, 25-26, Fig. 5", vec![12, 25, 26]),
        ("Eq. 13, or with 2 of them", vec![13]),
        ("eq. 34 and 37 in the state", vec![34, 37]),
        ("eq. 23, 1st and 3rd term", vec![23]),
        ("eq. 2. Also eq. 5", vec![2, 5]),
        ("eq. nn, seq 4", vec![]),
    ] {
        let read: Vec<u32> = equations_of(source).into_iter().collect();
        assert_eq!(read, found, "{source}");
    }
    assert_eq!(unit_of_name("Encoder::counts_per_rad"), Some("counts/rad"));
    assert_eq!(unit_of_name("PidGains::kp"), None);
    assert!(has_word("let e = 1", "e") && !has_word("let error = 1", "e"));
}
