//! Margin between the reference and a contact surface that it does not go through,
//! or only by a little: if it is small, rounding decides what happens.
//!
//! Two surfaces part the modes of the joint: `|ε| = b`, and with `no_pull`
//! the flank's torque `Ψ = 0`, here as the angle `Ψ/k`. Between two passes
//! through a surface the distance from it has a largest value, at a turning
//! point or at the end of the sample: the depth of that excursion. The
//! *margin* of a sample is the smallest of these depths, on either side of
//! the surface, so that a dip that just fails to happen counts like one that
//! just happens. Only the reference is asked: the solver under test has no say
//! in what it is excused from.

use plant::{AxisParameters, ContactChange, ElasticJoint, Joint, Span, State, Watch};

/// Within this of a surface, in units of what a step can move, turning points
/// are looked for.
const NEAR: f64 = 4.0;

/// A contact change and how fast its surface was passed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passage {
    pub(crate) change: ContactChange,
    /// Rate of the angle that reached its limit \[rad/s\].
    pub(crate) rate_radps: f64,
}

/// Follows the reference through one sample.
#[derive(Debug)]
pub(crate) struct Margin {
    axis: AxisParameters,
    joint: Option<ElasticJoint>,
    pub(crate) passages: Vec<Passage>,
    /// Smallest depth of an excursion so far \[rad\].
    margin_rad: f64,
    /// Distances from both surfaces and their rates at the end of the last span.
    last: [Option<(f64, f64)>; 2],
}

impl Margin {
    pub(crate) fn new(axis: &AxisParameters) -> Self {
        let joint = match axis.transmission.joint {
            Joint::Elastic(joint) if joint.backlash_half_rad > 0.0 => Some(joint),
            _ => None,
        };
        Self {
            axis: *axis,
            joint,
            passages: Vec::new(),
            margin_rad: f64::INFINITY,
            last: [None; 2],
        }
    }

    /// The margin of the sample, its end included \[rad\].
    pub(crate) fn margin_rad(&self) -> f64 {
        let ends = self.last.iter().flatten();
        ends.fold(self.margin_rad, |margin, (distance, _)| {
            margin.min(distance.abs())
        })
    }

    fn releases(joint: &ElasticJoint) -> bool {
        joint.no_pull && joint.damping_nms_per_rad > 0.0
    }

    /// Distances from `|ε| = b` and, with `no_pull` beyond the gap, from
    /// `Ψ = 0`, each with its rate.
    fn distances(
        &self,
        joint: &ElasticJoint,
        span: &Span<'_>,
        theta: f64,
    ) -> [Option<(f64, f64)>; 2] {
        let state = span.state_at(theta);
        let side = if state.epsilon_rad < 0.0 { -1.0 } else { 1.0 };
        let (open, open_rate) = (
            side * state.epsilon_rad - joint.backlash_half_rad,
            side * state.epsilon_dot_radps,
        );
        if !Self::releases(joint) || open < 0.0 {
            return [Some((open, open_rate)), None];
        }
        let relaxation_s = joint.damping_nms_per_rad / joint.stiffness_nm_per_rad;
        let bend = side * self.epsilon_ddot(joint, span, theta, &state);
        [
            Some((open, open_rate)),
            Some((
                open + relaxation_s * open_rate,
                open_rate + relaxation_s * bend,
            )),
        ]
    }

    /// `ε̈ = (k_m·I/z − Ψ)/J1 − γ̈`.
    fn epsilon_ddot(
        &self,
        joint: &ElasticJoint,
        span: &Span<'_>,
        theta: f64,
        state: &State,
    ) -> f64 {
        let (motor, t) = (&self.axis.motor, &self.axis.transmission);
        let side = f64::from(span.contact().sign());
        let squeeze = state.epsilon_rad - side * joint.backlash_half_rad;
        let psi = side.abs()
            * (joint.stiffness_nm_per_rad * squeeze
                + joint.damping_nms_per_rad * state.epsilon_dot_radps);
        let j1 = motor.inertia_kg_m2 / (t.gear_ratio * t.gear_ratio);
        let drive = motor.torque_nm(state.current_a) / t.gear_ratio;
        (drive - psi) / j1 - span.acceleration_at_mps2(theta) / t.screw_pitch_m_per_rad
    }

    /// Takes in the turning points of both distances within a span.
    fn turning_points(&mut self, joint: &ElasticJoint, span: &Span<'_>) {
        let (start, end) = (
            self.distances(joint, span, 0.0),
            self.distances(joint, span, 1.0),
        );
        let mut margin_rad = self.margin_rad;
        for surface in 0..2 {
            let (Some(first), Some(last)) = (start[surface], end[surface]) else {
                continue;
            };
            let reach = NEAR * span.length_s() * first.1.abs().max(last.1.abs()) + 1e-11;
            if first.0.abs().min(last.0.abs()) > reach {
                continue;
            }
            let look = |theta| self.distances(joint, span, theta)[surface];
            let nodes = [0.0, 0.25, 0.5, 0.75, 1.0].map(|theta| (theta, look(theta)));
            for pair in nodes.windows(2) {
                if let [(from, Some(a)), (to, Some(b))] = pair
                    && a.1 * b.1 < 0.0
                    && let Some((distance, _)) = turning_point(&look, *from, *to, a.1)
                {
                    margin_rad = margin_rad.min(distance.abs());
                }
            }
        }
        self.margin_rad = margin_rad;
        self.last = end;
    }
}

/// The instant at which the rate changes its sign, by halving.
fn turning_point(
    look: &impl Fn(f64) -> Option<(f64, f64)>,
    mut from: f64,
    mut to: f64,
    rate_from: f64,
) -> Option<(f64, f64)> {
    for _ in 0..50 {
        let middle = 0.5 * (from + to);
        let (_, rate) = look(middle)?;
        if rate * rate_from > 0.0 {
            from = middle;
        } else {
            to = middle;
        }
    }
    look(to)
}

impl Watch for Margin {
    fn span(&mut self, span: &Span<'_>) {
        if let Some(joint) = self.joint {
            self.turning_points(&joint, span);
        }
    }

    fn contact_change(&mut self, change: &ContactChange) {
        // With `no_pull` load comes and goes where Ψ = 0, but begins where the
        // gap closes.
        let surface = match self.joint {
            Some(joint) if Self::releases(&joint) && !change.impact => 1,
            _ => 0,
        };
        let rate = self.last[surface]
            .or(self.last[0])
            .map_or(0.0, |(_, rate)| rate);
        self.passages.push(Passage {
            change: *change,
            rate_radps: rate.abs(),
        });
    }
}
