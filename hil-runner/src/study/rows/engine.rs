//! Makes the rows of a study on several threads and hands them over in order.
//!
//! A thread takes a block of rows, computes and formats it; the calling thread
//! puts the blocks in order. No more than a few blocks for each thread are
//! under way, so memory does not grow with the number of rows, and what a block
//! holds does not depend on who makes it.

use std::collections::BTreeMap;
use std::ops::Range;

use super::RowMaker;
use super::cell::{Cell, checksum, to_csv};
use crate::study::plan::Study;
use hil_core::lanes::{OneByOne, Runs};

/// Blocks under way for each thread, at most: enough to hide a slow block.
const BLOCKS_A_THREAD: usize = 8;

/// Samples of a block, about: some tens of milliseconds of work.
const SAMPLES_A_BLOCK: u64 = 1 << 19;

/// Rows of a block at most.
const MOST_ROWS: u64 = 256;

/// Blocks of a study, for several threads, if each has this many points then.
const FEWEST_BLOCKS: u64 = 32;
const LEAST_POINTS: u64 = 8;

/// A block of rows as it is written.
#[derive(Debug)]
pub struct Block {
    /// Its number.
    pub number: u64,
    /// The rows.
    pub rows: Vec<Vec<Cell>>,
    /// The same as CSV.
    pub csv: Vec<u8>,
    /// Checksum of the CSV.
    pub crc: u32,
    /// How many of its runs were not made side by side with others, and why; nothing of a
    /// block that was read back.
    pub one_by_one: BTreeMap<OneByOne, u64>,
}

impl Study {
    /// Rows of a block: fewer where runs are long, so that results come soon
    /// and little is lost; all rungs of a point are in one. A property of the
    /// study alone.
    pub fn block_rows(&self) -> u64 {
        let samples = self.rungs.iter().map(|(_, template)| {
            let case = template.base();
            let period_ns = case.controller.sample_time_ns;
            let interval_ns = period_ns.unwrap_or(case.run.row_interval_ns);
            case.run.duration_ns / interval_ns.max(1)
        });
        let most = samples.max().unwrap_or(0).max(1);
        let rungs = self.rungs.len() as u64;
        let some_blocks = (self.plan.points() / FEWEST_BLOCKS).max(LEAST_POINTS);
        let points = (SAMPLES_A_BLOCK / most).min(MOST_ROWS) / rungs;
        // Each rung fills the lanes, if it can.
        let load = Runs::AT_A_TIME as u64;
        let points = match points.min(some_blocks) {
            few if few < load => few.max(1),
            points => points / load * load,
        };
        points * rungs
    }

    /// Numbers of the rows of a block.
    fn rows_of(&self, block: u64) -> Range<u64> {
        let first = block * self.block_rows();
        first..(first + self.block_rows()).min(self.rows())
    }
}

/// A study that could not go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// The threads could not be started; says why.
    #[error("the threads could not be started: {0}")]
    Threads(String),
    /// A thread ended abnormally.
    #[error("a thread of the study ended abnormally")]
    Lost,
}

/// Makes blocks of a study and hands them to `each` in their order, until all are
/// made or `each` ends it with `false`; true if all are made.
///
/// # Errors
/// [`EngineError`], and those of `each`.
pub fn make<E: From<EngineError> + Send>(
    study: &Study,
    blocks: Range<u64>,
    threads: usize,
    mut each: impl FnMut(Block) -> Result<bool, E> + Send,
) -> Result<bool, E> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|number| format!("study-{number}"))
        .build()
        .map_err(|error| EngineError::Threads(error.to_string()))?;
    let under_way = threads * BLOCKS_A_THREAD;
    let (ask, asked) = crossbeam_channel::bounded::<u64>(under_way);
    let (give, given) = crossbeam_channel::bounded::<Block>(under_way);
    pool.in_place_scope(|scope| {
        // The threads alone hold the sender: once they are gone, so is it.
        scope.spawn_broadcast(move |_, _| {
            let mut maker = RowMaker::new(study);
            for number in &asked {
                let rows = maker.rows(study.rows_of(number));
                // A vector takes the bytes; nothing can fail.
                let csv = to_csv(&rows).unwrap_or_default();
                let block = Block {
                    number,
                    rows,
                    crc: checksum(&csv),
                    csv,
                    one_by_one: maker.runs.take_one_by_one(),
                };
                if give.send(block).is_err() {
                    return;
                }
            }
        });
        let mut to_ask = blocks.clone();
        for number in to_ask.by_ref().take(under_way) {
            // The channel has room for all of them.
            let _ = ask.send(number);
        }
        let mut early = BTreeMap::new();
        let mut next = blocks.start;
        let mut outcome = Ok(true);
        'blocks: while next < blocks.end {
            let Ok(block) = given.recv() else {
                outcome = Err(EngineError::Lost.into());
                break;
            };
            early.insert(block.number, block);
            while let Some(block) = early.remove(&next) {
                next += 1;
                if let Some(number) = to_ask.next() {
                    let _ = ask.send(number);
                }
                outcome = each(block);
                if !matches!(outcome, Ok(true)) {
                    break 'blocks;
                }
            }
        }
        // No more questions, and no one to take the answers: the threads end.
        drop((ask, given));
        outcome
    })
}
