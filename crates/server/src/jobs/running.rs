//! Jobs take turns: a piece of one after a piece of another.
//!
//! As many pieces are computed at once as there are places (`analyses`), on threads that all jobs share. Of those that wait for a place
//! each client gets one before any gets its second, whatever it has submitted, and so do the jobs of one client among themselves. Which
//! pieces are computed beside each other changes no row.

use super::super::fair_semaphore::{FairSemaphore, Waiter};
use super::super::limits::Limits;
use super::super::status;
use super::super::work::caught;
use super::job::Job;
use bimorph_base::Bundle;
use bimorph_jobs::sweep::{self, Executor, SweepError, ThreadPool};
use bimorph_model::options::CompileOptions;
use std::sync::{Arc, OnceLock};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;
use tonic::Status;

/// The threads of all jobs, and their turns.
pub(super) struct JobExecutors {
    turns: Arc<FairSemaphore>,
    places: usize,
    pool: OnceLock<Result<ThreadPool, SweepError>>,
    runtime: Handle,
}

/// The turns of one job.
struct JobPermits<'a> {
    crews: &'a JobExecutors,
    pool: &'a ThreadPool,
    party: Waiter,
    stopped: &'a CancellationToken,
    /// Called for each piece that begins.
    begin: &'a (dyn Fn() + Sync),
}

impl JobExecutors {
    /// As many places as analyses have. Within a runtime.
    pub(super) fn new(limits: &Limits) -> Self {
        let places = limits.analyses.max(1);
        Self { turns: FairSemaphore::new(places), places, pool: OnceLock::new(), runtime: Handle::current() }
    }

    /// Computes what a job has no row of yet. A thread of its own waits for permits, not one of those that handle
    /// calls: waiting jobs block nothing, however many there are.
    pub(super) fn start(self: &Arc<Self>, job: &Arc<Job>, bundle: Bundle, options: CompileOptions) {
        let (crews, running) = (Arc::clone(self), Arc::clone(job));
        let run = move || {
            let job = running;
            let outcome = caught(&job.budget, || crews.run(&job, &bundle, &options));
            job.finish(match outcome {
                Some(Ok(Ok(_))) => None,
                Some(Ok(Err(SweepError::Owner(why)))) => Some(status::stopped(why)),
                Some(Ok(Err(error @ SweepError::TooLarge { .. }))) => {
                    Some(Status::resource_exhausted(error.to_string()))
                }
                Some(Ok(Err(error))) => Some(Status::unavailable(error.to_string())),
                Some(Err(why)) => Some(status::stopped(why)),
                None => Some(status::fault()),
            });
        };
        if let Err(error) = std::thread::Builder::new().name("job".to_owned()).spawn(run) {
            job.finish(Some(Status::unavailable(format!("the system gives no thread for it: {error}"))));
        }
    }

    fn run(&self, job: &Arc<Job>, bundle: &Bundle, options: &CompileOptions) -> Result<bool, SweepError> {
        let pool = self.pool.get_or_init(|| ThreadPool::new(self.places)).as_ref().map_err(Clone::clone)?;
        let party = Waiter { client: job.asked.owner.as_str().into(), number: job.asked.sequence };
        let crew = JobPermits { crews: self, pool, party, stopped: &job.stopped, begin: &|| job.begin() };
        let known = job.points()?;
        let mut numbers = job.spec.point_numbers()?;
        numbers.retain(|number| !known.contains(number));
        sweep::run_by(&job.spec, bundle, options, &numbers, &crew, &|kept| job.found(kept, &self.runtime))
    }
}

impl Executor for JobPermits<'_> {
    fn size(&self) -> usize {
        self.crews.places
    }

    fn run(&self, count: usize, piece: &(dyn Fn(usize) -> bool + Sync)) {
        let over = CancellationToken::new();
        self.pool.threads().in_place_scope(|scope| {
            for number in 0..count {
                let place = self.crews.runtime.block_on(async {
                    tokio::select! {
                        place = self.crews.turns.place(self.party.clone()) => Some(place),
                        () = self.stopped.cancelled() => None,
                        () = over.cancelled() => None,
                    }
                });
                let stopped = self.stopped.is_cancelled() || over.is_cancelled();
                let Some(place) = place.filter(|_| !stopped) else { return };
                (self.begin)();
                let over = over.clone();
                scope.spawn(move |_| {
                    if !piece(number) {
                        over.cancel();
                    }
                    drop(place);
                });
            }
        });
    }
}

#[cfg(test)]
mod tests {
    //! Permits rotate among clients by counted pieces: a client with many pieces does not delay one with few.
    use super::*;
    use std::sync::Mutex;

    fn other() -> Waiter {
        Waiter { client: "other".into(), number: 9 }
    }

    /// One place. While it is taken, two jobs of one client and one of another queue up for it. From then on every second piece is the
    /// other's until it is done, and the two of one client alternate.
    #[test]
    fn clients_take_turns_by_pieces() {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).build().expect("a runtime");
        let crews = {
            let _within = runtime.enter();
            JobExecutors::new(&Limits { analyses: 1, ..Limits::default() })
        };
        let (pool, order, stopped) =
            (ThreadPool::new(1).expect("a thread"), Mutex::new(String::new()), CancellationToken::new());
        let jobs = [("one", 'a', 40), ("one", 'b', 40), ("two", 'c', 10)];
        let run = |client: &str, job: char, count: usize| {
            let party = Waiter { client: client.into(), number: u64::from(job) };
            let crew = JobPermits { crews: &crews, pool: &pool, party, stopped: &stopped, begin: &|| {} };
            crew.run(count, &|_| {
                let mut order = order.lock().expect("no panic");
                order.push(job);
                // a piece takes until all that have more to do wait for the next place
                let more = jobs.iter().filter(|(_, job, count)| order.matches(*job).count() < *count).count();
                while crews.turns.waiting() < more {
                    std::thread::yield_now();
                }
                true
            });
        };
        std::thread::scope(|scope| {
            let place = runtime.block_on(crews.turns.place(other()));
            for (client, job, count) in jobs {
                let run = &run;
                scope.spawn(move || run(client, job, count));
            }
            while crews.turns.waiting() < 3 {
                std::thread::yield_now();
            }
            drop(place);
        });
        let order = order.into_inner().expect("no panic");
        let last = order.rfind('c').expect("it ran");
        assert!(last <= 20, "ten pieces of the other client among the first {}: {order}", last + 1);
        let ahead = |order: &str| order.matches('a').count().abs_diff(order.matches('b').count());
        assert!((0..=order.len()).all(|end| ahead(&order[..end]) <= 1), "{order}");
        assert_eq!(order.len(), 90);
    }

    /// A stopped executor begins nothing more, also while it waits for a permit.
    #[test]
    fn a_crew_that_is_stopped_comes_back() {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).build().expect("a runtime");
        let _within = runtime.enter();
        let crews = JobExecutors::new(&Limits { analyses: 1, ..Limits::default() });
        let (pool, stopped) = (ThreadPool::new(1).expect("a thread"), CancellationToken::new());
        let place = std::thread::scope(|scope| {
            let place = scope.spawn(|| runtime.block_on(crews.turns.place(other()))).join().expect("no panic");
            let crew = JobPermits {
                crews: &crews,
                pool: &pool,
                party: Waiter { client: "one".into(), number: 1 },
                stopped: &stopped,
                begin: &|| {},
            };
            let waits = scope.spawn(move || crew.run(5, &|_| panic!("nothing is begun")));
            while crews.turns.waiting() < 1 {
                std::thread::yield_now();
            }
            stopped.cancel();
            waits.join().expect("it comes back");
            place
        });
        drop(place);
    }
}
