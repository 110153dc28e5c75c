//! Where the setpoints of a run come from.

use std::collections::VecDeque;

use firmware::motion::{MotionPlan, MotionState};
use firmware::reference::TableSource;
use firmware::{CAPACITY, Next, Observed, Setpoint, SetpointSource, SetpointTable};

/// The sources of a run.
#[derive(Debug)]
pub(super) enum Source {
    /// The table in the controller's memory.
    Table(Box<TableSource<SetpointTable<CAPACITY>, CAPACITY>>),
    /// The firmware's generator.
    Generator(Generator),
    /// A queue that the host keeps filled.
    Queue(Box<StreamedQueue>),
}

impl SetpointSource for Source {
    fn next(&mut self, observed: &Observed) -> Next {
        match self {
            Self::Table(table) => table.next(observed),
            Self::Generator(generator) => generator.next(),
            Self::Queue(queue) => queue.next(),
        }
    }
}

/// The generator with its memory.
#[derive(Debug)]
pub(super) struct Generator {
    plan: MotionPlan,
    state: MotionState,
}

impl Generator {
    pub(super) fn new(plan: MotionPlan) -> Self {
        Self {
            plan,
            state: MotionState::default(),
        }
    }

    fn next(&mut self) -> Next {
        self.plan.next(&mut self.state)
    }
}
