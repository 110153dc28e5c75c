//! What the dampers of all lanes' joints take in a step, in the order of
//! [`crate::exact::Dissipation::over`].

use super::group::Group;
use super::phase::DRIVING;
use super::step::Step;
use super::width::Width;
use crate::exact::HeldTable;
use crate::model::state::{BETA_DOT, CURRENT, EPSILON_DOT};

/// Numbers of the closed joint, in the order in which they are needed: β̈ from
/// δ, ε̇ and I; ε̈ from β̇, δ, ε̇ and I, and its constant part; İ from β̇, I and V; R
/// row by row, upper triangular; c.
const NUMBERS: usize = 3 + 5 + 3 + DRIVING * (DRIVING + 1) / 2 + 1;

/// The numbers, each in every lane: a vector in memory costs no instruction.
#[derive(Debug, Clone)]
pub(crate) struct LaneLoss<W: Width>([W::Array; NUMBERS]);

impl<W: Width> LaneLoss<W> {
    /// As long as no joint was closed.
    pub(crate) fn none() -> Self {
        Self([W::array(0.0); NUMBERS])
    }

    /// Takes over those of a table of the closed joint; without damping there are
    /// none.
    pub(crate) fn set(&mut self, table: &HeldTable) {
        let Some(loss) = &table.loss else {
            return;
        };
        let (damping_nms_per_rad, factor) = loss.whole();
        let system = &table.system;
        let row = |state: usize| -> [f64; DRIVING] {
            core::array::from_fn(|j| system.a[(state, BETA_DOT + j)])
        };
        let ([_, delta, speed, current], joint) = (row(BETA_DOT), row(EPSILON_DOT));
        let [induced, _, _, resistive] = row(CURRENT);
        let triangle = (0..DRIVING).flat_map(|i| (i..DRIVING).map(move |j| factor[(i, j)]));
        let numbers = [delta, speed, current]
            .into_iter()
            .chain(joint)
            .chain([
                system.load[EPSILON_DOT],
                induced,
                resistive,
                system.per_volt,
            ])
            .chain(triangle)
            .chain([damping_nms_per_rad]);
        for (to, number) in self.0.iter_mut().zip(numbers) {
            *to = W::array(number);
        }
    }

    /// Whether there is a damper that has been in contact.
    fn is_some(&self) -> bool {
        self.0[NUMBERS - 1].as_ref()[0] != 0.0
    }
}

impl<W: Width> Group<W> {
    /// What the dampers take in a step \[J\]: `c·|R·v|²` with the rates v at its
    /// start, 0 where the joint is open.
    #[inline(always)]
    pub(super) fn joint_loss_of(
        &self,
        phase: usize,
        step: &Step<W>,
        voltage_v: W::Vector,
    ) -> W::Vector {
        let (w, loss) = (self.width, &self.steps[phase].loss);
        let zero = w.splat(0.0);
        if !loss.is_some() {
            return zero;
        }
        let [beta_dot, delta, epsilon_dot, current] = step.from;
        let number = |place: usize| w.load(&loss.0[place]);
        // Without the terms that are zero, which change no sum.
        let gear = number(0) * delta + (number(1) * epsilon_dot + number(2) * current);
        let joint = (number(3) * beta_dot + number(4) * delta)
            + (number(5) * epsilon_dot + number(6) * current)
            + number(7);
        let armature = (number(8) * beta_dot + number(9) * current) + number(10) * voltage_v;
        let rates = [gear, epsilon_dot, joint, armature];
        let (mut sum, mut place) = (zero, 11);
        for i in 0..DRIVING {
            let mut part = number(place) * rates[i];
            for rate in &rates[i + 1..] {
                place += 1;
                part = part + number(place) * *rate;
            }
            place += 1;
            sum = sum + part * part;
        }
        let flank = w.load(&self.track.now().flank);
        let open = w.at_most(w.abs(flank), w.splat(0.5));
        w.select(open, zero, number(place) * sum)
    }
}
