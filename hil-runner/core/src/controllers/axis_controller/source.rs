//! Where the setpoints of a run come from.

use firmware::motion::{MotionPlan, MotionState};
use firmware::reference::TableSource;
use firmware::{
    CAPACITY, Next, Observed, Setpoint, SetpointSource, SetpointTable, Stream, Streamed,
};

/// The sources of a run.
#[derive(Debug, Clone)]
pub enum Source {
    /// The table in the controller's memory.
    Table(Box<TableSource<SetpointTable<CAPACITY>, CAPACITY>>),
    /// The firmware's generator.
    Generator(Box<Generator>),
    /// A queue that the host keeps filled.
    Queue(Box<StreamedQueue>),
}

impl SetpointSource for Source {
    fn next(&mut self, observed: &Observed) -> Next {
        match self {
            Self::Table(table) => table.next(observed),
            Self::Generator(generator) => generator.next(),
            Self::Queue(queue) => queue.next(observed),
        }
    }
}

/// The generator with its memory.
#[derive(Debug, Clone)]
pub struct Generator {
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

    /// What it runs.
    pub fn plan(&self) -> &MotionPlan {
        &self.plan
    }

    fn next(&mut self) -> Next {
        self.plan.next(&mut self.state)
    }
}

/// Setpoints that wait between the link and the axis.
const WAITING: usize = 16;

/// A queue that the host keeps full from a generator of its own.
#[derive(Debug, Clone)]
pub struct StreamedQueue {
    generator: Generator,
    stream: Stream<WAITING>,
    /// Whether the end of the motion was sent.
    ended: bool,
    /// Where the motion ended, once the axis has taken it.
    last: Option<Setpoint>,
}

impl StreamedQueue {
    pub(super) fn new(generator: Generator) -> Self {
        Self {
            generator,
            stream: Stream::new(),
            ended: false,
            last: None,
        }
    }

    /// Sends what there is room for; nothing where the link is `broken`.
    pub fn fill(&mut self, broken: bool) {
        let (mut sender, _) = self.stream.split();
        while !broken && !self.ended && sender.room() > 0 {
            let item = match self.generator.next() {
                Next::Setpoint(setpoint) => Streamed::Setpoint(setpoint),
                Next::Last(setpoint) => Streamed::Last(setpoint),
                Next::Underrun => break,
            };
            self.ended = matches!(item, Streamed::Last(_));
            // There is room, by the loop's condition.
            let _ = sender.send(item);
        }
    }

    /// The next setpoint.
    pub fn next(&mut self, observed: &Observed) -> Next {
        if let Some(last) = self.last {
            return Next::Last(last);
        }
        let (_, mut receiver) = self.stream.split();
        let next = receiver.next(observed);
        if let Next::Last(last) = next {
            self.last = Some(last);
        }
        next
    }
}
