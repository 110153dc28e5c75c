//! A chip that plans: the request for a motion, carried out.

use crate::request::kind;

/// Tells whether a request is a PLAN, which a server without a planner does not know.
pub(crate) const fn takes(kind: u8) -> bool {
    cfg!(feature = "planner") && kind == kind::PLAN
}

pub(crate) use self::server::remember;

#[cfg(not(feature = "planner"))]
mod server {
    use crate::reply::Nak;
    use firmware::SetpointTable;

    /// A server without a planner plans nothing.
    pub(crate) const fn remember<const N: usize>(
        _: &[u8],
        _: &mut SetpointTable<N>,
    ) -> Result<(), Nak> {
        Err(Nak::Request)
    }
}

#[cfg(feature = "planner")]
mod server {
    use firmware::motion::Planner;
    use firmware::{GainWord, SetpointTable, Stretch};

    use crate::body::Reader;
    use crate::reply::Nak;

    /// Bytes of the fields of a [`crate::Planned`].
    const BYTES: usize = 8 + 7 * 8 + 4 + 4 + 3 * 5;

    /// Plans a motion and appends its words to the memory, as if they had been sent.
    #[inline(never)]
    pub(crate) fn remember<const N: usize>(
        payload: &[u8],
        memory: &mut SetpointTable<N>,
    ) -> Result<(), Nak> {
        let mut from = Reader::new(payload);
        let travel = from.i64();
        let mut intervals_ps = [0; 7];
        intervals_ps.iter_mut().for_each(|t_ps| *t_ps = from.u64());
        let (period_ns, start) = (from.u32(), from.i32());
        if payload.len() != BYTES {
            return Err(Nak::Request);
        }
        let mut planner = Planner::NONE;
        let planned = planner.plan(travel, &intervals_ps, period_ns);
        planned.map_err(|_| Nak::Plan { stretch: 0 })?;
        let gain = || Some(GainWord::new(from.i32(), from.u8()));
        planner.begin(core::iter::from_fn(gain), start);

        let before = memory.as_counts().len();
        let mut words = [0; Stretch::WORDS];
        loop {
            let is_stretch = planner.next(&mut words);
            let end = [planner.end().wrapping_add(start)];
            let words: &[i32] = if is_stretch { &words } else { &end };
            for word in words {
                if memory.push(*word).is_err() {
                    memory.keep(before);
                    return Err(Nak::Memory);
                }
            }
            if !is_stretch {
                return Ok(());
            }
        }
    }
}
