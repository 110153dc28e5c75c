//! The golden vectors as arrays of C, for `firmware/c/example/main.c`: every file,
//! or those named. `wrong` as the first argument makes one code of the last row
//! another.

use std::error::Error;
use std::path::Path;

use firmware::{Event, FaultValues, Next, Settings};
use firmware_link::vectors::{Row, rows};

/// Arrays that rows point into.
#[derive(Default)]
struct Arrays {
    settings: Vec<String>,
    setpoints: Vec<String>,
    stretches: Vec<String>,
    faults: Vec<String>,
    rows: Vec<String>,
}

/// Appends to an array; the address in C.
fn place(of: &str, array: &mut Vec<String>, values: &[impl ToString]) -> String {
    let literal = |value: &dyn ToString| match value.to_string() {
        // A minus is no part of a literal in C.
        least if least == i64::MIN.to_string() => format!("(-{}-1)", i64::MAX),
        value => value,
    };
    let values: Vec<String> = values.iter().map(|value| literal(value)).collect();
    array.push(format!("{{{}}}", values.join(",")));
    format!("&{of}[{}]", array.len() - 1)
}

impl Arrays {
    fn add(&mut self, file: &str, starts: bool, row: &Row<'_>, wrong: i32) {
        let none = || "0".to_owned();
        let settings = row.axis.map_or_else(none, |axis| {
            place(
                "settings",
                &mut self.settings,
                &Settings::of(&axis).to_words(),
            )
        });
        let (mut setpoint, mut stretch) = (none(), none());
        match row.given.next {
            Next::Underrun => {}
            Next::Stretch(s) => {
                let numbers = [s.position, s.velocity, s.acceleration, s.jerk];
                let codes = [s.ahead, s.ahead_change, s.ahead_growth].map(|code| code.to_bits());
                let rest = [
                    s.samples.into(),
                    s.velocity_sign.into(),
                    s.acceleration_sign.into(),
                ];
                let values = [&numbers.map(|number| number.to_bits())[..], &codes, &rest].concat();
                stretch = place("stretches", &mut self.stretches, &values);
            }
            Next::Setpoint(s) | Next::Last(s) => {
                let last = matches!(row.given.next, Next::Last(_));
                let [last, has_ahead] = [last, s.ahead.is_some()].map(i64::from);
                let [p, v, a] = [s.position, s.velocity, s.acceleration].map(i64::from);
                let ahead = s.ahead.unwrap_or_default().to_bits();
                setpoint = place(
                    "setpoints",
                    &mut self.setpoints,
                    &[p, v, a, last, has_ahead, ahead],
                );
            }
        }
        let fault = row.wanted.fault.map_or_else(none, |fault| {
            let FaultValues {
                setpoint,
                position,
                error,
                code,
                measured,
                limit,
            } = fault.values;
            let [setpoint, position, error, code] =
                [setpoint, position, error, code].map(i64::from);
            let (tick, cause) = (fault.tick.cast_signed(), i64::from(fault.cause as u32));
            let values = [
                tick, measured, limit, setpoint, position, error, code, cause,
            ];
            place("faults", &mut self.faults, &values)
        });
        let (line, given, wanted) = (row.line, row.given.inputs, row.wanted.output);
        let events: Vec<Event> = row.given.events().collect();
        let numbers: Vec<String> = events
            .iter()
            .map(|event| (*event as u32).to_string())
            .collect();
        self.rows.push(format!(
            "{{\"{file}\",{line},{},{settings},{},{{{}}},{{{}u,{},{},{},{},{}}},{setpoint},{stretch},{{{},{},{},{},{}}},{fault}}}",
            u8::from(starts),
            events.len(),
            if numbers.is_empty() { none() } else { numbers.join(",") },
            given.tick,
            given.motor_register,
            given.load_register.unwrap_or(0),
            given.failed_transfers,
            u8::from(given.load_register.is_some()),
            u8::from(given.emergency_stop),
            wanted.code + wrong,
            wanted.error_counts,
            wanted.state as u32,
            wanted.power,
            wanted.out_of_range,
        ));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../link/vectors");
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    let wrong = names.first().is_some_and(|name| name == "wrong");
    names.drain(..usize::from(wrong));
    if names.is_empty() {
        for entry in std::fs::read_dir(&folder)? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            names.extend(name.strip_suffix(".txt").map(str::to_owned));
        }
    }
    names.sort();
    let (mut arrays, files) = (Arrays::default(), names.len());
    for (of, name) in names.iter().enumerate() {
        let text = std::fs::read_to_string(folder.join(name).with_extension("txt"))?;
        let all = rows(&text).collect::<Result<Vec<_>, _>>()?;
        for (index, row) in all.iter().enumerate() {
            let is_last = of + 1 == files && index + 1 == all.len();
            arrays.add(name, index == 0, row, i32::from(wrong && is_last));
        }
    }
    println!("#define FILES {files}");
    for (of, array) in [
        ("servo_settings settings", arrays.settings),
        ("servo_setpoint setpoints", arrays.setpoints),
        ("servo_stretch stretches", arrays.stretches),
        ("servo_fault faults", arrays.faults),
        ("struct row rows", arrays.rows),
    ] {
        if !array.is_empty() {
            println!("static const {of}[] = {{\n{},\n}};", array.join(",\n"));
        }
    }
    Ok(())
}
