//! `docs/STATES.md` against the sources: the transition table cell by cell,
//! the power column, and the faults in the order of their priority.

use firmware::{Event, FaultCause, Refused, State};

const PAGE: &str = include_str!("../../docs/STATES.md");

/// The cells of the table whose head begins with `head`, without head and rule.
fn table<'a>(page: &'a str, head: &str) -> Vec<Vec<&'a str>> {
    let lines: Vec<&str> = page
        .lines()
        .skip_while(|line| !line.starts_with(head))
        .take_while(|line| line.starts_with('|'))
        .collect();
    assert!(lines.len() > 2, "no table with the head {head}");
    lines
        .into_iter()
        .skip(2)
        .map(|line| {
            // `\|` is a bar inside a cell; only whole words are compared.
            let inside = line.trim_start_matches('|').trim_end_matches('|');
            inside.split(" | ").map(str::trim).collect()
        })
        .collect()
}

const TRANSITIONS: &str = "| | Enable | Disable | Start | MotionEnded | Fail | Reset |";

/// Every cell of the page that `State::after` contradicts.
fn contradictions(page: &str) -> Vec<(State, Event)> {
    let rows = table(page, TRANSITIONS);
    assert_eq!(rows.len(), State::ALL.len());
    let mut wrong = Vec::new();
    for (state, row) in State::ALL.into_iter().zip(rows) {
        assert_eq!(row.len(), 1 + Event::ALL.len());
        assert_eq!(row[0], format!("{state:?}"));
        for (event, cell) in Event::ALL.into_iter().zip(&row[1..]) {
            let after = match state.after(event) {
                Ok(next) => format!("{next:?}"),
                Err(refused) => {
                    assert_eq!(refused, Refused { state, event });
                    "refused".to_owned()
                }
            };
            if after != *cell {
                wrong.push((state, event));
            }
        }
    }
    wrong
}

#[test]
fn the_table_of_the_page_is_the_function() {
    let names: Vec<String> = Event::ALL
        .iter()
        .map(|event| format!("{event:?}"))
        .collect();
    assert_eq!(TRANSITIONS, format!("| | {} |", names.join(" | ")));
    assert_eq!(contradictions(PAGE), []);
}

/// Contrast: each of the 30 cells, changed to anything else, is found.
#[test]
fn a_changed_cell_is_noticed() {
    let rows = table(PAGE, TRANSITIONS);
    let values = [
        "Disabled", "Enabled", "Moving", "Holding", "Fault", "refused",
    ];
    let mut changed = 0;
    for (state, row) in State::ALL.into_iter().zip(&rows) {
        for (column, event) in (1..).zip(Event::ALL) {
            for value in values.into_iter().filter(|value| *value != row[column]) {
                let mut cells = row.clone();
                cells[column] = value;
                let line = |cells: &[&str]| format!("| {} |", cells.join(" | "));
                let page = PAGE.replacen(&line(row), &line(&cells), 1);
                assert_eq!(contradictions(&page), [(state, event)]);
                changed += 1;
            }
        }
    }
    assert_eq!(changed, 30 * 5);
}

#[test]
fn the_page_says_where_the_axis_is_powered() {
    let rows = table(PAGE, "| state | what the axis does | powered |");
    for (state, row) in State::ALL.into_iter().zip(&rows) {
        assert_eq!(row[0], format!("{state:?}"));
        assert_eq!(row[2], if state.is_powered() { "yes" } else { "no" });
    }
    assert_eq!(rows.len(), State::ALL.len());
}

#[test]
fn the_page_lists_the_faults_by_priority() {
    let rows = table(PAGE, "| fault | trips when | measured | limit |");
    let listed: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    assert_eq!(listed, FaultCause::ALL.map(FaultCause::name));
    assert!(FaultCause::ALL.is_sorted_by(|a, b| a < b));
}

#[test]
fn power_comes_with_enable_only_and_goes_with_every_fault() {
    for state in State::ALL {
        assert_eq!(state.after(Event::Fail), Ok(State::Fault));
        for event in Event::ALL {
            let next = state.after(event).unwrap_or(state);
            let switched_on = next.is_powered() && !state.is_powered();
            assert_eq!(
                switched_on,
                (state, event) == (State::Disabled, Event::Enable)
            );
            let left_fault = state == State::Fault && next != State::Fault;
            assert_eq!(left_fault, (state, event) == (State::Fault, Event::Reset));
        }
    }
}

#[test]
fn a_refusal_says_what_would_be_allowed() {
    let refused = State::Disabled.after(Event::Start).expect_err("no power");
    assert_eq!(
        refused.to_string(),
        "the event start is refused in the state disabled; the axis must be enabled or holding"
    );
    let refused = State::Moving.after(Event::Start).expect_err("on its way");
    assert!(
        refused
            .to_string()
            .contains("start is refused in the state moving")
    );
}
