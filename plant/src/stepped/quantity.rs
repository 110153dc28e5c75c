//! One quantity over a span of the solution, looked into only where its ends
//! do not answer the question.

use crate::model::state::Vector;
use crate::numerics::bernstein::Polynomial;
use crate::numerics::septic::Ends;
use crate::observe::span::Span;
use crate::stepped::dop853::NODES;

/// A quantity over a span. Its values between the ends cost more than those at
/// the ends, which most questions can do without.
#[derive(Debug)]
pub(crate) struct Quantity<'a, V> {
    pub(crate) span: &'a Span<'a>,
    pub(crate) ends: Ends,
    /// How far it may be from the cubic through its ends.
    pub(crate) reach: f64,
    /// Of time and state within the span.
    pub(crate) value: V,
}

impl<V: Fn(f64, &Vector) -> f64> Quantity<'_, V> {
    /// The polynomial through the ends and the nodes between them.
    pub(crate) fn septic(&self) -> Polynomial<8> {
        let span = self.span;
        self.ends.septic(NODES.map(|theta| {
            let time_s = span.start_s + theta * span.length_s;
            (self.value)(time_s, &span.vector_at(theta))
        }))
    }

    /// Upper bound of |q| over the span, without looking into it.
    pub(crate) fn bound(&self) -> f64 {
        self.ends.bound(self.reach)
    }

    /// Raises `peak` to the supremum of |q| over the span.
    pub(crate) fn raise(&self, peak: &mut f64) {
        let bound = self.bound();
        if bound > *peak {
            *peak = peak.max(self.ends.start.abs()).max(self.ends.end.abs());
            // Where the quantity grows throughout, the end is the largest.
            if bound > *peak {
                *peak = self.septic().peak_above(*peak);
            }
        }
    }
}
