//! One step of the Dormand-Prince method of order 8(5,3), DOP853, with its
//! dense output of order 7.
//!
//! J. R. Dormand, P. J. Prince, "A family of embedded Runge-Kutta formulae",
//! J. Comput. Appl. Math. 6 (1980) 19-26; the pair of order 8 with the error
//! estimates of order 5 and 3 and its dense output from E. Hairer,
//! S. P. Nørsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd
//! ed., sections II.5, II.6 and II.10.
//!
//! The dense output takes three more derivatives than the step, and most steps
//! are never looked into: it is made when first asked for. Whether it need be
//! asked for is seen from [`Step::stray`].
//!
//! Stages are counted from 0; stage 12 is the derivative at the end of the step,
//! stages 13 to 15 serve the dense output alone. A digit that is wrong lowers the
//! order: the tests would see it.

use core::cell::OnceCell;

use crate::model::state::{Vector, gamma, gamma_dot};

/// Result of one trial step.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) start_s: f64,
    pub(crate) h: f64,
    pub(crate) y0: Vector,
    pub(crate) y1: Vector,
    /// Derivative at the end, also the first stage of the next step.
    pub(crate) f1: Vector,
    /// Derivatives of the twelve stages, the first at the start.
    stages: [Vector; 12],
    /// Coefficients of the dense output besides the ends.
    dense: OnceCell<[Vector; 4]>,
}

/// Distance of a solution from the cubic through the ends of its step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Stray {
    /// Of the step \[s\].
    pub(crate) length_s: f64,
    pub(crate) states: Vector,
    /// Of γ = β − ε and γ̇, where what β and ε share drops out.
    pub(crate) gamma: f64,
    pub(crate) gamma_dot: f64,
}

/// `Σ weight·stage`.
#[inline(always)]
fn sum(row: Row, stages: &[Vector]) -> Vector {
    let mut sum = Vector::zeros();
    for &(stage, weight) in row {
        sum += stages[stage] * weight;
    }
    sum
}

/// Takes one step of `dy/dt = f(t, y)` from `(t, y0)` with `f0 = f(t, y0)`.
#[inline(always)]
pub(crate) fn step(
    f: impl Fn(f64, &Vector) -> Vector,
    t: f64,
    y0: &Vector,
    f0: &Vector,
    h: f64,
) -> Step {
    let mut k = [*f0; 12];
    // Written out: what each row holds is then known where it is summed.
    macro_rules! stages {
        ($($i:literal)*) => {
            $(k[$i] = f(t + h * C[$i], &(y0 + sum(A[$i], &k) * h));)*
        };
    }
    stages!(1 2 3 4 5 6 7 8 9 10 11);
    let y1 = y0 + sum(A[12], &k) * h;
    Step {
        start_s: t,
        h,
        y0: *y0,
        y1,
        f1: f(t + h, &y1),
        stages: k,
        dense: OnceCell::new(),
    }
}

impl Step {
    /// Derivative at the start.
    pub(crate) fn f0(&self) -> &Vector {
        &self.stages[0]
    }

    /// Differences to the embedded solutions of order 5 and 3.
    #[inline(always)]
    pub(crate) fn errors(&self) -> (Vector, Vector) {
        let (k, h) = (&self.stages, self.h);
        (sum(E5, k) * h, sum(E3, k) * h)
    }

    /// The stages of the solution: the time of each within the step, its weight in the
    /// sum and its state. A rate that the state decides is integrated by them as the method
    /// would integrate a further state.
    pub(crate) fn stages(&self) -> impl Iterator<Item = (f64, f64, Vector)> + '_ {
        A[12].iter().map(|&(stage, weight)| {
            let y = self.y0 + sum(A[stage], &self.stages) * self.h;
            (C[stage], weight, y)
        })
    }

    /// Distance of the solution from the cubic through the ends of the
    /// step: less than this, by a factor of about two.
    ///
    /// The distance is zero at both ends, so half its steepest slope bounds it.
    /// That slope is taken at the five stages well inside the step that have
    /// more than a low order: times 1/4, 4/13, 0.6, 0.65 and 6/7.
    pub(crate) fn stray(&self) -> Stray {
        let h = self.h;
        let chord = self.y1 - self.y0;
        let (u, v) = (self.f0() * h - chord, self.f1 * h - chord);
        let mut stray = Stray {
            length_s: h,
            ..Stray::default()
        };
        for stage in [6, 7, 8, 9, 10] {
            let c = C[stage];
            // Slope of `Δ·θ + (u·(1 − θ) − v·θ)·θ·(1 − θ)`.
            let slope = chord + u * ((1.0 - c) * (1.0 - 3.0 * c)) + v * (c * (3.0 * c - 2.0));
            let off = self.stages[stage] * h - slope;
            stray.states = stray.states.zip_map(&off, |r, o: f64| r.max(o.abs()));
            stray.gamma = stray.gamma.max(gamma(&off).abs());
            stray.gamma_dot = stray.gamma_dot.max(gamma_dot(&off).abs());
        }
        stray
    }

    /// State at `t + θ·h`, 0 ≤ θ ≤ 1, to seventh order; `f` as for the step.
    pub(crate) fn at(&self, f: impl Fn(f64, &Vector) -> Vector, theta: f64) -> Vector {
        let [d3, d4, d5, d6] = self.dense.get_or_init(|| self.dense(f));
        let (h, rest) = (self.h, 1.0 - theta);
        let chord = self.y1 - self.y0;
        let bend = self.f0() * h - chord;
        let twist = chord - self.f1 * h - bend;
        let inner = d3 + (d4 + (d5 + d6 * theta) * rest) * theta;
        self.y0 + (chord + (bend + (twist + inner * rest) * theta) * rest) * theta
    }

    #[cold]
    fn dense(&self, f: impl Fn(f64, &Vector) -> Vector) -> [Vector; 4] {
        let (t, y0, h) = (self.start_s, &self.y0, self.h);
        let mut k = [self.f1; 16];
        k[..12].copy_from_slice(&self.stages);
        for i in 13..16 {
            k[i] = f(t + h * C[i], &(y0 + sum(A[i], &k) * h));
        }
        D.map(|row| sum(row, &k) * h)
    }
}

/// Stages and their weights in a sum, where these are not zero.
type Row = &'static [(usize, f64)];

/// Times of the stages within the step.
const C: [f64; 16] = [
    0.0,
    0.05260015195876773,
    0.0789002279381516,
    0.1183503419072274,
    0.2816496580927726,
    0.3333333333333333,
    0.25,
    0.3076923076923077,
    0.6512820512820513,
    0.6,
    0.8571428571428571,
    1.0,
    1.0,
    0.1,
    0.2,
    0.7777777777777778,
];

/// Weights of the stages before it in the state that each stage is the derivative at; row 12
/// is the solution, of order 8.
static A: [Row; 16] = [
    &[],
    &[(0, 0.05260015195876773)],
    &[(0, 0.0197250569845379), (1, 0.0591751709536137)],
    &[(0, 0.02958758547680685), (2, 0.08876275643042054)],
    &[
        (0, 0.2413651341592667),
        (2, -0.8845494793282861),
        (3, 0.924834003261792),
    ],
    &[
        (0, 0.037037037037037035),
        (3, 0.17082860872947386),
        (4, 0.12546768756682242),
    ],
    &[
        (0, 0.037109375),
        (3, 0.17025221101954405),
        (4, 0.06021653898045596),
        (5, -0.017578125),
    ],
    &[
        (0, 0.03709200011850479),
        (3, 0.17038392571223998),
        (4, 0.10726203044637328),
        (5, -0.015319437748624402),
        (6, 0.008273789163814023),
    ],
    &[
        (0, 0.6241109587160757),
        (3, -3.3608926294469414),
        (4, -0.868219346841726),
        (5, 27.59209969944671),
        (6, 20.154067550477894),
        (7, -43.48988418106996),
    ],
    &[
        (0, 0.47766253643826434),
        (3, -2.4881146199716677),
        (4, -0.590290826836843),
        (5, 21.230051448181193),
        (6, 15.279233632882423),
        (7, -33.28821096898486),
        (8, -0.020331201708508627),
    ],
    &[
        (0, -0.9371424300859873),
        (3, 5.186372428844064),
        (4, 1.0914373489967295),
        (5, -8.149787010746927),
        (6, -18.52006565999696),
        (7, 22.739487099350505),
        (8, 2.4936055526796523),
        (9, -3.0467644718982196),
    ],
    &[
        (0, 2.273310147516538),
        (3, -10.53449546673725),
        (4, -2.0008720582248625),
        (5, -17.9589318631188),
        (6, 27.94888452941996),
        (7, -2.8589982771350235),
        (8, -8.87285693353063),
        (9, 12.360567175794303),
        (10, 0.6433927460157636),
    ],
    &[
        (0, 0.054293734116568765),
        (5, 4.450312892752409),
        (6, 1.8915178993145003),
        (7, -5.801203960010585),
        (8, 0.3111643669578199),
        (9, -0.1521609496625161),
        (10, 0.20136540080403034),
        (11, 0.04471061572777259),
    ],
    &[
        (0, 0.056167502283047954),
        (6, 0.25350021021662483),
        (7, -0.2462390374708025),
        (8, -0.12419142326381637),
        (9, 0.15329179827876568),
        (10, 0.00820105229563469),
        (11, 0.007567897660545699),
        (12, -0.008298),
    ],
    &[
        (0, 0.03183464816350214),
        (5, 0.028300909672366776),
        (6, 0.053541988307438566),
        (7, -0.05492374857139099),
        (10, -0.00010834732869724932),
        (11, 0.0003825710908356584),
        (12, -0.00034046500868740456),
        (13, 0.1413124436746325),
    ],
    &[
        (0, -0.42889630158379194),
        (5, -4.697621415361164),
        (6, 7.683421196062599),
        (7, 4.06898981839711),
        (8, 0.3567271874552811),
        (12, -0.0013990241651590145),
        (13, 2.9475147891527724),
        (14, -9.15095847217987),
    ],
];

/// Difference to an embedded solution of order 5.
static E5: Row = &[
    (0, 0.01312004499419488),
    (5, -1.2251564463762044),
    (6, -0.4957589496572502),
    (7, 1.6643771824549864),
    (8, -0.35032884874997366),
    (9, 0.3341791187130175),
    (10, 0.08192320648511571),
    (11, -0.022355307863886294),
];

/// Difference to an embedded solution of order 3.
static E3: Row = &[
    (0, -0.18980075407240762),
    (5, 4.450312892752409),
    (6, 1.8915178993145003),
    (7, -5.801203960010585),
    (8, -0.4226823213237919),
    (9, -0.1521609496625161),
    (10, 0.20136540080403034),
    (11, 0.02265179219836082),
];

/// Coefficients 3 to 6 of the dense output.
static D: [Row; 4] = [
    &[
        (0, -8.428938276109013),
        (5, 0.5667149535193777),
        (6, -3.0689499459498917),
        (7, 2.38466765651207),
        (8, 2.117034582445028),
        (9, -0.871391583777973),
        (10, 2.2404374302607883),
        (11, 0.6315787787694688),
        (12, -0.08899033645133331),
        (13, 18.148505520854727),
        (14, -9.194632392478356),
        (15, -4.436036387594894),
    ],
    &[
        (0, 10.427508642579134),
        (5, 242.28349177525817),
        (6, 165.20045171727028),
        (7, -374.5467547226902),
        (8, -22.113666853125306),
        (9, 7.733432668472264),
        (10, -30.674084731089398),
        (11, -9.332130526430229),
        (12, 15.697238121770845),
        (13, -31.139403219565178),
        (14, -9.35292435884448),
        (15, 35.81684148639408),
    ],
    &[
        (0, 19.985053242002433),
        (5, -387.0373087493518),
        (6, -189.17813819516758),
        (7, 527.8081592054236),
        (8, -11.57390253995963),
        (9, 6.8812326946963),
        (10, -1.0006050966910838),
        (11, 0.7777137798053443),
        (12, -2.778205752353508),
        (13, -60.19669523126412),
        (14, 84.32040550667716),
        (15, 11.99229113618279),
    ],
    &[
        (0, -25.69393346270375),
        (5, -154.18974869023643),
        (6, -231.5293791760455),
        (7, 357.6391179106141),
        (8, 93.40532418362432),
        (9, -37.45832313645163),
        (10, 104.0996495089623),
        (11, 29.8402934266605),
        (12, -43.53345659001114),
        (13, 96.32455395918828),
        (14, -39.17726167561544),
        (15, -149.72683625798564),
    ],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// `ẏ = y·cos t`, `y = exp(sin t)`.
    fn f(t: f64, y: &Vector) -> Vector {
        y * libm::cos(t)
    }

    fn exact(t: f64) -> f64 {
        libm::exp(libm::sin(t))
    }

    /// Global error at t = 2 in `n` equal steps, and the largest error of the
    /// dense output within the steps.
    fn errors(n: u32) -> (f64, f64) {
        let h = 2.0 / f64::from(n);
        let (mut y, mut worst) = (Vector::repeat(1.0), 0.0_f64);
        for i in 0..n {
            let t = f64::from(i) * h;
            let step = step(f, t, &y, &f(t, &y), h);
            for theta in [0.3, 0.5, 0.85] {
                worst = worst.max((step.at(f, theta)[0] - exact(t + theta * h)).abs());
            }
            y = step.y1;
        }
        ((y[0] - exact(2.0)).abs(), worst)
    }

    #[test]
    fn converges_with_order_eight_and_dense_output_seven() {
        let ((coarse, coarse_dense), (fine, fine_dense)) = (errors(4), errors(8));
        let (order, dense_order) = ((coarse / fine).log2(), (coarse_dense / fine_dense).log2());
        assert!((7.5..=9.5).contains(&order), "order {order}");
        assert!((6.6..=8.8).contains(&dense_order), "{dense_order}");
    }

    /// The estimates go with h⁶ and h⁴ in one step, whatever the instant.
    #[test]
    fn estimates_have_their_orders() {
        let of = |h: f64| {
            (0..20).fold((0.0, 0.0), |(fifth, third), i| {
                let t = 0.1 * f64::from(i);
                let y0 = Vector::repeat(exact(t));
                let (e5, e3) = step(f, t, &y0, &f(t, &y0), h).errors();
                (fifth + e5[0].abs(), third + e3[0].abs())
            })
        };
        let (coarse, fine) = (of(0.2), of(0.1));
        let (fifth, third) = ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2());
        assert!((5.5..=6.5).contains(&fifth), "order {fifth}");
        assert!((3.5..=4.5).contains(&third), "order {third}");
    }

    /// The distance from the cubic is within reach, and the reach not wide.
    #[test]
    fn reach_bounds_the_distance_from_the_cubic() {
        for (t, h) in [(0.0, 0.5), (0.7, 0.2), (1.5, 1.0), (2.2, 0.05), (3.0, 2.0)] {
            let y0 = Vector::repeat(exact(t));
            let step = step(f, t, &y0, &f(t, &y0), h);
            let chord = step.y1[0] - step.y0[0];
            let (u, v) = (step.f0()[0] * h - chord, step.f1[0] * h - chord);
            let mut distance = 0.0_f64;
            for i in 1..100 {
                let theta = f64::from(i) / 100.0;
                let rest = 1.0 - theta;
                let cubic = step.y0[0] + chord * theta + (u * rest - v * theta) * (theta * rest);
                distance = distance.max((exact(t + theta * h) - cubic).abs());
            }
            let share = distance / step.stray().states[0];
            assert!(share < 1.0 && share > 1.0 / 8.0, "{share}");
        }
    }

    /// Each stage stands at its time, and the solution moves by one step.
    #[test]
    fn weights_add_up_to_the_times() {
        for (row, time) in A.iter().zip(C) {
            let total: f64 = row.iter().map(|(_, weight)| weight).sum();
            assert!((total - time).abs() < 1e-14, "{row:?}");
        }
    }

    /// Order 8 on quadratures: `Σ b·c^(q−1) = 1/q` up to q = 8, not 9; the
    /// errors end at orders 5 and 3.
    #[test]
    fn weights_integrate_powers() {
        let moment = |row: Row, q: i32| -> f64 {
            row.iter().map(|&(stage, b)| b * C[stage].powi(q - 1)).sum()
        };
        let off = |q: i32| (moment(A[12], q) - 1.0 / f64::from(q)).abs();
        assert!((1..=8).all(|q| off(q) < 1e-14));
        assert!(off(9) > 1e-6, "{}", off(9));
        assert!((1..=5).all(|q| moment(E5, q).abs() < 1e-14));
        assert!(moment(E5, 6).abs() > 1e-6);
        assert!((1..=3).all(|q| moment(E3, q).abs() < 1e-14));
        assert!(moment(E3, 4).abs() > 1e-6);
    }
}
