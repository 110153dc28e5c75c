//! Memory of the law, and what the next sample makes of it.

/// Memory of the law. The default is the state before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LawState {
    /// `(Ki·Δt)·Σe` \[2^−F codes\].
    pub(super) integral: i64,
    /// The filter's memory.
    pub(super) filtered: i64,
    /// `e(k−1)` \[counts\].
    pub(super) previous_error: i32,
    pub(super) phase: Phase,
    /// `h` of the filter whose memory that is.
    pub(super) filter_bits: Option<u8>,
}

impl LawState {
    /// Before a first sample that goes on from `code`, the last one that the
    /// converter was given: after enabling, or with other gains than before.
    /// A code outside the window of that sample counts as its nearer end.
    pub const fn take_over(code: i32) -> Self {
        Self {
            integral: 0,
            filtered: 0,
            previous_error: 0,
            phase: Phase::TakeOver(code),
            filter_bits: None,
        }
    }

    /// The next sample comes with other words; it goes on from `code`, the last
    /// one that the converter was given.
    pub(crate) const fn change_over(&mut self, code: i32) {
        self.phase = match self.phase {
            Phase::First | Phase::TakeOver(_) => Phase::TakeOver(code),
            Phase::Running | Phase::ChangeOver(_) => Phase::ChangeOver(code),
        };
    }

    /// `(Ki·Δt)·Σe` \[2^−F codes\].
    pub const fn integral(&self) -> i64 {
        self.integral
    }
}

/// Memory that a sample begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Phase {
    /// Nothing: no error and no difference came before.
    #[default]
    First,
    /// As the first, but the output goes on from this code.
    TakeOver(i32),
    /// The memory of the sample before, but the output goes on from this code.
    ChangeOver(i32),
    /// The memory of the sample before.
    Running,
}

impl Phase {
    /// Tells whether the sample before was one of this law's.
    pub(super) const fn goes_on(self) -> bool {
        matches!(self, Self::Running | Self::ChangeOver(_))
    }
}
