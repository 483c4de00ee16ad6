//! Executors: threads that run the pieces of a sweep. The result of a point does not depend on the executor.

use super::error::SweepError;
use rayon::prelude::*;

/// Executor of the pieces of a sweep: its threads and its order.
pub trait Executor: Sync {
    /// How many pieces it may run at once.
    fn size(&self) -> usize;

    /// Runs the pieces 0 to `count`, each once, on any thread, and comes back when all are over. A piece returns
    /// whether to continue. After one that returns false, and when the executor is cancelled, the remaining pieces are
    /// skipped.
    fn run(&self, count: usize, piece: &(dyn Fn(usize) -> bool + Sync));
}

/// Threads of its own, all at work at once.
#[derive(Debug)]
pub struct ThreadPool(rayon::ThreadPool);

impl ThreadPool {
    /// So many threads; 0: one for each core.
    ///
    /// # Errors
    /// [`SweepError::Threads`].
    pub fn new(threads: usize) -> Result<Self, SweepError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(Self).map_err(|error| SweepError::Threads { reason: error.to_string() })
    }

    /// Its threads, for another executor that schedules them.
    pub fn threads(&self) -> &rayon::ThreadPool {
        &self.0
    }
}

impl Executor for ThreadPool {
    fn size(&self) -> usize {
        self.0.current_num_threads()
    }

    fn run(&self, count: usize, piece: &(dyn Fn(usize) -> bool + Sync)) {
        let run = |number| if piece(number) { Ok(()) } else { Err(()) };
        // the piece that returned `false` has recorded its error
        let _ = self.0.install(|| (0..count).into_par_iter().try_for_each(run));
    }
}
