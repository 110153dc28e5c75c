//! Evaluations that the own CMA-ES needs to reach a target, median over 20 seeds, as JSON:
//! `scripts/python-check` holds them against `cma` of PyPI.

use hil_core::tune::cma::{Cma, Judged, rank};

type Problem = (&'static str, f64, fn(&[f64]) -> Judged);

fn main() {
    let problems: [Problem; 6] = [
        ("sphere", 1e-10, sphere),
        ("ellipsoid", 1e-10, ellipsoid),
        ("rosenbrock", 1e-8, rosenbrock),
        ("boundary", 1e-8, boundary),
        ("ridge", 1e-4, ridge),
        ("corner", 1e-6, corner),
    ];
    let mut rows = Vec::new();
    for (name, target, problem) in problems {
        for (n, population) in [(2, 6), (5, 8), (5, 12), (10, 10)] {
            let mut seen: Vec<usize> = (1..=20)
                .map(|seed| evaluations(problem, target, n, population, seed))
                .collect();
            seen.sort_unstable();
            let (least, median, most) = (seen[0], (seen[9] + seen[10]) / 2, seen[19]);
            rows.push(format!(
                r#"{{"problem":"{name}","n":{n},"population":{population},"target":{target:e},"median":{median},"least":{least},"most":{most}}}"#
            ));
        }
    }
    println!("[{}]", rows.join(",\n"));
}

fn evaluations(
    problem: fn(&[f64]) -> Judged,
    target: f64,
    n: usize,
    population: usize,
    seed: u64,
) -> usize {
    let mut search = Cma::new(&vec![0.5; n], 0.25, population, seed);
    let mut count = 0;
    while count < 20_000 {
        let judged: Vec<Judged> = search.ask().iter().map(|x| problem(x)).collect();
        for judged in &judged {
            count += 1;
            if matches!(judged, Judged::Feasible(f) if *f <= target) {
                return count;
            }
        }
        search.tell(&rank(&judged));
    }
    count
}

/// Mirrored in the plane across the vector 1, 2, .. n: no axis stays one.
fn turned(x: &[f64], centre: f64) -> Vec<f64> {
    let v = |i: usize| i as f64 + 1.0;
    let square: f64 = (0..x.len()).map(|i| v(i) * v(i)).sum();
    let along: f64 = x.iter().enumerate().map(|(i, x)| v(i) * (x - centre)).sum();
    x.iter()
        .enumerate()
        .map(|(i, x)| x - centre - 2.0 * v(i) * along / square)
        .collect()
}

fn sphere(x: &[f64]) -> Judged {
    Judged::Feasible(x.iter().map(|x| (x - 0.3) * (x - 0.3)).sum())
}

fn ellipsoid(x: &[f64]) -> Judged {
    let last = x.len() as f64 - 1.0;
    Judged::Feasible(
        turned(x, 0.4)
            .iter()
            .enumerate()
            .map(|(i, z)| 10f64.powf(6.0 * i as f64 / last) * z * z)
            .sum(),
    )
}

fn rosenbrock(x: &[f64]) -> Judged {
    let z: Vec<f64> = x.iter().map(|x| 4.0 * x - 2.0).collect();
    Judged::Feasible(
        z.windows(2)
            .map(|z| 100.0 * (z[1] - z[0] * z[0]).powi(2) + (1.0 - z[0]).powi(2))
            .sum(),
    )
}

/// The sphere around 0.3 where the mean of the variables is at least 0.5; zero at its optimum.
fn boundary(x: &[f64]) -> Judged {
    let n = x.len() as f64;
    let missing = 0.5 - x.iter().sum::<f64>() / n;
    let square: f64 = x.iter().map(|x| (x - 0.3) * (x - 0.3)).sum();
    if missing > 0.0 {
        Judged::Infeasible(missing)
    } else {
        Judged::Feasible(square - 0.04 * n)
    }
}

/// A slope that a requirement cuts at an angle: down along all variables, x_0 at least 0.2
/// and the mean of the others' squares.
fn ridge(x: &[f64]) -> Judged {
    let n = x.len() as f64;
    let others: f64 = x[1..].iter().map(|x| (x - 0.3) * (x - 0.3)).sum::<f64>() / (n - 1.0);
    let missing = 0.2 + others - x[0];
    if missing > 0.0 {
        Judged::Infeasible(missing)
    } else {
        Judged::Feasible(x[0] - 0.2)
    }
}

fn corner(x: &[f64]) -> Judged {
    Judged::Feasible(
        x.iter()
            .enumerate()
            .map(|(i, x)| (i as f64 + 1.0) * x)
            .sum(),
    )
}
