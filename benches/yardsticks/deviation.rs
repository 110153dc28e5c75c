//! Prints how far each program is from the solution in quadruple precision:
//! max|x − x_ref|/max|x_ref| over the rows, for each state.
//!
//! `deviation FOLDER` wants `truth-w1.csv`, `truth-w2.csv` and `truth-w3.csv`
//! in the folder: `t_s, β, β̇, γ, γ̇, I, ε`, a row every millisecond, the laws
//! without encoder and DAC steps (`sampled`, `continuous`).

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use bench_benches::elastic_axis::{ElasticAxis, State};
use bench_benches::groups::RK4_STEP_NS;
use bench_benches::lockstep::Plan;
use bench_benches::rk4_axis::Rk4Axis;
use bench_benches::workload::{self, W1, W2, W3};
use hil_core::run::{RunOptions, run};
use yardsticks::{diffsol_axis, diffsol_continuous};

/// β, β̇, γ, γ̇, I, ε.
type Row = [f64; 6];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("deviation FOLDER")?;
    println!("w   solver        tolerance      β       β̇       γ       γ̇       I       ε     ms");
    for (w, workload, every, tolerances) in [
        (1, W1, 1, [1e-8, 1e-9, 1e-10, 1e-11]),
        (2, W2, 10, [1e-7, 1e-8, 1e-9, 1e-10]),
    ] {
        let truth = truth(&folder, w)?;
        let case = workload::case("sampled", workload, "rk4", 1e-10)?;
        let plan = Plan::new(&case).ok_or("no sample time")?;
        let axis = ElasticAxis::new(&case).ok_or("a rigid joint")?;
        for tolerance in tolerances {
            let name = format!("w{w}  diffsol       {tolerance:e}");
            let mut rows = Vec::new();
            let start = Instant::now();
            diffsol_axis::run(&plan, axis, tolerance, |_, _, y| rows.push(row(y)))?;
            print(&name, &thin(&rows, every), &truth, start);
        }
        for tolerance in tolerances {
            let case = workload::case("sampled", workload, "dopri5", tolerance)?;
            own(
                &format!("w{w}  own dopri5    {tolerance:e}"),
                &case,
                every,
                &truth,
            )?;
        }
        let exact = workload::case("sampled", workload, "exact", 1e-10)?;
        own(&format!("w{w}  own exact     –    "), &exact, every, &truth)?;
        let mut rows = Vec::new();
        let start = Instant::now();
        let mut rk4 = Rk4Axis::new(axis, RK4_STEP_NS);
        let _ = plan.run(&mut rk4, |_, _, rk4| rows.push(row(&rk4.y)));
        print(
            &format!("w{w}  rk4 10 µs     –    "),
            &thin(&rows, every),
            &truth,
            start,
        );
    }
    let truth = truth(&folder, 3)?;
    for tolerance in [1e-7, 1e-8, 1e-9, 1e-10] {
        let case = workload::case("continuous", W3, "dopri5", tolerance)?;
        let mut rows = Vec::new();
        let start = Instant::now();
        diffsol_continuous::run(&case, tolerance, |y| rows.push(row(y)))?;
        print(
            &format!("w3  diffsol       {tolerance:e}"),
            &rows,
            &truth,
            start,
        );
        own(
            &format!("w3  own dopri5    {tolerance:e}"),
            &case,
            1,
            &truth,
        )?;
    }
    let exact = workload::case("continuous", W3, "exact", 1e-8)?;
    own("w3  own exact     –    ", &exact, 1, &truth)
}

/// One of the project's own solvers, through the runner.
fn own(
    name: &str,
    case: &hil_core::case::Case,
    every: usize,
    truth: &[Row],
) -> Result<(), Box<dyn Error>> {
    let mut rows = Vec::new();
    let start = Instant::now();
    run(case, RunOptions::default(), &mut |r| {
        // ε is not in the trace; the difference loses digits.
        let epsilon = r.beta_rad - r.gamma_rad;
        rows.push([
            r.beta_rad,
            r.beta_dot_radps,
            r.gamma_rad,
            r.gamma_dot_radps,
            r.current_a,
            epsilon,
        ]);
        Ok(())
    })?;
    print(name, &thin(&rows, every), truth, start);
    Ok(())
}

fn row(y: &State) -> Row {
    let [gamma, gamma_dot, epsilon, epsilon_dot, current] = *y;
    let (beta, beta_dot) = (gamma + epsilon, gamma_dot + epsilon_dot);
    [beta, beta_dot, gamma, gamma_dot, current, epsilon]
}

fn thin(rows: &[Row], every: usize) -> Vec<Row> {
    rows.iter().step_by(every).copied().collect()
}

fn truth(folder: &str, w: u32) -> Result<Vec<Row>, Box<dyn Error>> {
    let text = std::fs::read_to_string(Path::new(folder).join(format!("truth-w{w}.csv")))?;
    let mut rows = Vec::new();
    for line in text.lines().skip(1) {
        let mut row = Row::default();
        for (value, text) in row.iter_mut().zip(line.split(',').skip(1)) {
            *value = text.parse()?;
        }
        rows.push(row);
    }
    Ok(rows)
}

fn print(name: &str, rows: &[Row], truth: &[Row], start: Instant) {
    let ms = 1e3 * start.elapsed().as_secs_f64();
    let mut line = format!("{name} ");
    for i in 0..6 {
        let largest = truth.iter().fold(0.0, |m: f64, row| m.max(row[i].abs()));
        let error = rows
            .iter()
            .zip(truth)
            .fold(0.0, |m: f64, (row, truth)| m.max((row[i] - truth[i]).abs()));
        line += &format!(" {:7.1e}", error / largest);
    }
    let complete = if rows.len() == truth.len() {
        ""
    } else {
        " (rows missing)"
    };
    println!("{line} {ms:6.2}{complete}");
}
