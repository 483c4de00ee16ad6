//! Limits of a computation: bytes, unknowns, processor time, wall time; and its cancellation.
//!
//! A budget belongs to a thread for the time of [`within`], so that solvers ask it where their loops turn and no
//! signature carries it. Without one (the command, the plug-in, a library user) every check is a load of a thread-local
//! and nothing is refused. [`check`] stands in every inner loop that a request can make long; [`lay_out`] and
//! [`unknowns`] stand before what a request can make large.
//!
//! A stopped computation unwinds to its [`within`] like a panic, but without one: no hook runs and nothing is logged
//! (`std::panic::resume_unwind`; Salsa stops its queries this way). Partial results are dropped. A value that outlives
//! a stopped computation, as the storage of a device does, must be made anew:
//! `Device::recover`.

mod allowance;
mod bounded;
mod clock;
mod owner_quota;
mod stopped;

pub use allowance::Allowance;
pub use bounded::bounded;
pub use clock::thread_cpu;
pub use owner_quota::{OwnerQuota, WINDOW};
pub use stopped::Stopped;

use clock::{CHECKS_PER_LOOK, CPU_INTERVAL};
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// An allowance with what was used of it. Clones are the same budget.
#[derive(Debug, Clone)]
pub struct Budget(Arc<BudgetState>);

#[derive(Debug)]
struct BudgetState {
    allowance: Allowance,
    used: AtomicUsize,
    /// 0 while it may continue; shared with budgets that are parts of one another.
    order: Arc<AtomicU8>,
}

impl Drop for BudgetState {
    fn drop(&mut self) {
        if let Some(purse) = &self.allowance.purse {
            purse.give_back(self.used.load(Ordering::Relaxed));
        }
    }
}

const CANCELLED: u8 = 1;
const LATE: u8 = 2;

impl Budget {
    /// A fresh budget.
    #[inline]
    pub fn new(allowance: Allowance) -> Self {
        Self(Arc::new(BudgetState { allowance, used: AtomicUsize::new(0), order: Arc::default() }))
    }

    /// Takes `bytes` of what may be laid out.
    ///
    /// # Errors
    /// [`Stopped::Bytes`]; nothing is taken then.
    #[inline]
    pub fn take(&self, bytes: usize) -> Result<(), Stopped> {
        let most = self.0.allowance.bytes;
        let before = self.0.used.fetch_add(bytes, Ordering::Relaxed);
        let needed = before.saturating_add(bytes);
        let taken = match &self.0.allowance.purse {
            _ if needed > most => Err(Stopped::Bytes { most, needed }),
            Some(purse) => purse.take(bytes),
            None => Ok(()),
        };
        taken.inspect_err(|_| {
            self.0.used.fetch_sub(bytes, Ordering::Relaxed);
        })
    }

    /// Stops what runs under it, at its next check.
    #[inline]
    pub fn cancel(&self) {
        self.0.order.store(CANCELLED, Ordering::Relaxed);
    }

    /// Whether both are the same budget.
    #[inline]
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// As [`Budget::cancel`], with the time limit as the reason.
    #[inline]
    pub fn expire(&self) {
        self.0.order.store(LATE, Ordering::Relaxed);
    }

    /// Gives its bytes back to its owner, whose other computations may have them.
    #[inline]
    pub fn give_back(&self) {
        let used = self.0.used.swap(0, Ordering::Relaxed);
        if let Some(purse) = &self.0.allowance.purse {
            purse.give_back(used);
        }
    }

    /// Bytes laid out so far.
    #[inline]
    pub fn used(&self) -> usize {
        self.0.used.load(Ordering::Relaxed)
    }
}

/// The budget of a thread, and the time of its last check.
struct ThreadBudget {
    budget: Budget,
    checks: Cell<u32>,
    cpu_at_start: Option<Duration>,
    cpu_next: Cell<Instant>,
    /// Processor time charged to the quota so far.
    cpu_charged: Cell<Duration>,
}

thread_local! {
    static HELD: RefCell<Option<ThreadBudget>> = const { RefCell::new(None) };
}

/// Puts back what the thread held before, also while unwinding.
struct Restore(Option<ThreadBudget>);

impl Drop for Restore {
    fn drop(&mut self) {
        let before = self.0.take();
        HELD.with(|held| *held.borrow_mut() = before);
    }
}

/// The payload of the unwinding.
struct StopPayload(Stopped);

/// Runs `job` under a budget.
///
/// # Errors
/// Why it was stopped. A panic of the job continues as a panic.
pub fn within<T>(budget: &Budget, job: impl FnOnce() -> T) -> Result<T, Stopped> {
    let held = ThreadBudget {
        budget: budget.clone(),
        checks: Cell::new(0),
        cpu_at_start: budget.0.allowance.counts_cpu().then(thread_cpu).flatten(),
        cpu_next: Cell::new(Instant::now() + CPU_INTERVAL),
        cpu_charged: Cell::default(),
    };
    let restore = Restore(HELD.with(|h| h.borrow_mut().replace(held)));
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        check_quota();
        check();
        job()
    }));
    if budget.0.allowance.purse.is_some() {
        HELD.with(|held| held.borrow().as_ref().map(ThreadBudget::settle));
    }
    let reported = HELD.with(|held| held.borrow().as_ref().map_or(Duration::ZERO, |held| held.cpu_charged.get()));
    drop(restore);
    if budget.0.allowance.purse.is_some() {
        // time that a part has charged is not charged again by the whole
        HELD.with(|held| {
            held.borrow().iter().for_each(|whole| whole.cpu_charged.set(whole.cpu_charged.get() + reported))
        });
    }
    outcome.or_else(|payload| match payload.downcast::<StopPayload>() {
        Ok(stop) => Err(stop.0),
        Err(panic) => resume_unwind(panic),
    })
}

/// Stops here if the quota is used up.
fn check_quota() {
    let purse = HELD.with(|held| held.borrow().as_ref().and_then(|held| held.budget.0.allowance.purse.clone()));
    if let Some(Err(why)) = purse.map(|purse| purse.check_cpu()) {
        unwind(why);
    }
}

/// The budget of this thread, to be handed to others that work for it.
#[inline]
pub fn current() -> Option<Budget> {
    HELD.with(|held| held.borrow().as_ref().map(|held| held.budget.clone()))
}

/// Stops here if this thread's budget is used up or withdrawn.
#[inline]
pub fn check() {
    if let Some(why) = HELD.with(|held| held.borrow().as_ref().and_then(ThreadBudget::poll_limits)) {
        unwind(why);
    }
}

/// Stops here if `bytes` more are beyond the budget. Counts what is laid out in all, also what was freed since.
#[inline]
pub fn lay_out(bytes: usize) {
    let taken = HELD.with(|held| held.borrow().as_ref().map_or(Ok(()), |held| held.budget.take(bytes)));
    if let Err(why) = taken {
        unwind(why);
    }
}

/// [`lay_out`] for `rows`·`columns` doubles.
#[inline]
pub fn lay_out_matrix(rows: usize, columns: usize) {
    lay_out(rows.saturating_mul(columns).saturating_mul(8));
}

/// Stops here if a model of `got` unknowns is beyond the budget.
#[inline]
pub fn unknowns(got: usize) {
    let most = HELD.with(|held| held.borrow().as_ref().map_or(usize::MAX, |held| held.budget.0.allowance.unknowns));
    if got > most {
        unwind(Stopped::Unknowns { most, got });
    }
}

/// Stops here if so many modes of a model are beyond the budget. Its `unknowns` are evaluated only where it could be.
#[inline]
pub fn modes(count: usize, unknowns: impl FnOnce() -> usize) {
    let allowance = HELD.with(|held| held.borrow().as_ref().map(|held| held.budget.0.allowance.clone()));
    if let Some(Err(why)) = allowance.map(|allowance| allowance.modes(count, unknowns)) {
        unwind(why);
    }
}

fn unwind(why: Stopped) -> ! {
    resume_unwind(Box::new(StopPayload(why)))
}

impl ThreadBudget {
    #[inline]
    fn poll_limits(&self) -> Option<Stopped> {
        match self.budget.0.order.load(Ordering::Relaxed) {
            0 => {}
            LATE => return Some(Stopped::Late),
            _ => return Some(Stopped::Cancelled),
        }
        let checks = self.checks.get();
        self.checks.set(checks.wrapping_add(1));
        if checks.is_multiple_of(CHECKS_PER_LOOK) { self.look_at_clocks() } else { None }
    }

    fn look_at_clocks(&self) -> Option<Stopped> {
        let Allowance { deadline, cpu, .. } = self.budget.0.allowance;
        if deadline.is_none() && self.cpu_at_start.is_none() {
            return None;
        }
        let now = Instant::now();
        if deadline.is_some_and(|deadline| now >= deadline) {
            self.budget.expire();
            return Some(Stopped::Late);
        }
        if self.cpu_at_start.is_none() || now < self.cpu_next.get() {
            return None;
        }
        self.cpu_next.set(now + CPU_INTERVAL);
        let used = self.settle()?;
        if let Some(Err(why)) = self.budget.0.allowance.purse.as_ref().map(|purse| purse.check_cpu()) {
            return Some(why);
        }
        cpu.filter(|most| used > *most).map(|most| Stopped::Cpu { seconds: most.as_secs() })
    }

    /// Processor time since the start, charged to the quota.
    fn settle(&self) -> Option<Duration> {
        let used = thread_cpu()?.saturating_sub(self.cpu_at_start?);
        if let Some(purse) = &self.budget.0.allowance.purse {
            purse.charge_cpu(used.saturating_sub(self.cpu_charged.replace(used)));
        }
        Some(used)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn allowed(change: impl FnOnce(&mut Allowance)) -> Budget {
        let mut allowance = Allowance::default();
        change(&mut allowance);
        Budget::new(allowance)
    }

    /// Without a budget nothing is refused.
    #[test]
    fn nothing_is_refused_without_one() {
        check();
        lay_out(usize::MAX);
        unknowns(usize::MAX);
        assert!(current().is_none());
    }

    /// Each limit stops what would pass it, and says by how much; what is inside it passes.
    #[test]
    fn limits_stop() {
        let bytes = allowed(|a| a.bytes = 100);
        let laid = within(&bytes, || {
            lay_out(60);
            lay_out_matrix(2, 3);
        });
        assert_eq!(laid, Err(Stopped::Bytes { most: 100, needed: 108 }));
        assert_eq!(within(&bytes, || lay_out(40)), Ok(()), "what was refused was not laid out");
        assert_eq!(within(&bytes, || lay_out(usize::MAX)), Err(Stopped::Bytes { most: 100, needed: usize::MAX }));
        let small = allowed(|a| a.unknowns = 9);
        assert_eq!(within(&small, || unknowns(9)), Ok(()));
        assert_eq!(within(&small, || unknowns(10)), Err(Stopped::Unknowns { most: 9, got: 10 }));
        let few = allowed(|a| a.mode_work = 100);
        assert_eq!(within(&few, || modes(5, || 4)), Ok(()));
        assert_eq!(within(&few, || modes(5, || 5)), Err(Stopped::ModeWork { most: 100, got: 125 }));
        let late = allowed(|a| a.deadline = Some(Instant::now()));
        assert_eq!(within(&late, || ()), Err(Stopped::Late));
    }

    /// A cancelled loop stops at its next check, from another thread too, and the thread has no budget afterwards.
    #[test]
    fn cancelling_stops_a_loop() {
        let budget = Budget::new(Allowance::default());
        let other = budget.clone();
        std::thread::scope(|scope| {
            let loops = scope.spawn(|| {
                within(&budget, || {
                    loop {
                        check();
                    }
                })
            });
            other.cancel();
            assert_eq!(loops.join().expect("no panic"), Err(Stopped::Cancelled));
        });
        assert_eq!(within(&other, || ()), Err(Stopped::Cancelled), "and it stays so");
        assert!(current().is_none());
    }

    /// Processor time is that of the thread: a spinning one uses it up.
    #[test]
    #[cfg(target_os = "linux")]
    fn processor_time_ends() {
        let budget = allowed(|a| a.cpu = Some(Duration::from_millis(20)));
        let spun = within(&budget, || {
            loop {
                check();
            }
        });
        assert_eq!(spun, Err(Stopped::Cpu { seconds: 0 }));
    }

    /// A panic inside continues as a panic, and the budget of the outer computation is held again after an inner one.
    #[test]
    fn panics_pass_and_budgets_nest() {
        let outer = allowed(|a| a.unknowns = 5);
        let inner = allowed(|a| a.unknowns = 50);
        let nested = within(&outer, || {
            assert_eq!(within(&inner, || unknowns(20)), Ok(()));
            unknowns(20);
        });
        assert_eq!(nested, Err(Stopped::Unknowns { most: 5, got: 20 }));
        let panicked = catch_unwind(AssertUnwindSafe(|| within(&outer, || panic!("a fault"))));
        assert!(panicked.is_err());
        assert!(current().is_none());
    }
}
