//! Prints the table of docs/PLANT.md: every program of W1, W2 and W3, all in one
//! run. They take turns, round by round, so that what else the machine does
//! meets all of them; a ratio is the median of the rounds' ratios.
//!
//! `cargo bench --bench table`; `-- 99` for so many rounds.

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use bench_benches::groups::{Program, or_exit, vectors};
use yardsticks::programs;

/// Rounds unless told otherwise.
const ROUNDS: usize = 31;

/// A turn of a program takes about this long.
const TURN: Duration = Duration::from_millis(10);

/// The program that the others are compared with.
const YARDSTICK: &str = "exact-bare";

/// A program with its times, a turn each.
struct Row {
    program: Program,
    runs: u32,
    times: Vec<Duration>,
}

fn main() {
    or_exit(table());
}

fn table() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let rounds = std::env::args().find_map(|word| word.parse().ok());
    let rounds: usize = rounds.unwrap_or(ROUNDS).max(1);
    let mut tables = [
        ("W1", rows(programs::w1(folder)?)),
        ("W2", rows(programs::w2(folder)?)),
        ("W3", rows(programs::w3(folder)?)),
    ];
    for _ in 0..rounds {
        for row in tables.iter_mut().flat_map(|(_, rows)| rows) {
            let time = (row.program.runs)(row.runs.into()) / row.runs;
            row.times.push(time);
        }
    }
    println!("{rounds} rounds, vectors: {}\n", vectors()?);
    println!("| | | least | median | times `{YARDSTICK}` |");
    println!("| --- | --- | --- | --- | --- |");
    for (workload, rows) in &tables {
        let own = rows
            .iter()
            .find(|row| row.program.id.ends_with(YARDSTICK))
            .ok_or("nothing to compare with")?;
        for row in rows {
            let mut times: Vec<f64> = row.times.iter().map(Duration::as_secs_f64).collect();
            let pairs = row.times.iter().zip(&own.times);
            let mut ratios: Vec<f64> = pairs.map(|(a, b)| a.div_duration_f64(*b)).collect();
            let (least, middle) = least_and_median(&mut times);
            println!(
                "| {workload} | `{}` | {:.1} µs | {:.1} µs | {:.2} |",
                row.program.id,
                1e6 * least,
                1e6 * middle,
                least_and_median(&mut ratios).1,
            );
        }
    }
    Ok(())
}

/// The programs with as many runs as fill a turn.
fn rows(programs: Vec<Program>) -> Vec<Row> {
    programs
        .into_iter()
        .map(|mut program| {
            // The first one fetches its code and its memory.
            (program.runs)(1);
            let once = (program.runs)(1).max(Duration::from_nanos(1));
            let runs = TURN.div_duration_f64(once).clamp(1.0, 1e6).round();
            Row {
                program,
                runs: runs as u32,
                times: Vec::new(),
            }
        })
        .collect()
}

fn least_and_median(numbers: &mut [f64]) -> (f64, f64) {
    numbers.sort_by(f64::total_cmp);
    (numbers[0], numbers[numbers.len() / 2])
}
