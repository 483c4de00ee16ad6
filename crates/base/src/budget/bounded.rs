//! A part of a computation that is given up where it takes too much.

use super::{Allowance, Budget, BudgetState, LATE, Stopped, current, unwind, within};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

impl Budget {
    /// The same allowance unused, for a part of the computation: stopped together with it.
    #[must_use]
    #[inline]
    pub fn child(&self) -> Self {
        self.part_with(Allowance::clone)
    }

    /// Whether it was stopped by its time limit.
    #[inline]
    pub fn is_late(&self) -> bool {
        self.0.order.load(Ordering::Relaxed) == LATE
    }

    fn part_with(&self, of: impl FnOnce(&Allowance) -> Allowance) -> Self {
        let BudgetState { allowance, order, .. } = &*self.0;
        Self(Arc::new(BudgetState { allowance: of(allowance), used: AtomicUsize::new(0), order: Arc::clone(order) }))
    }
}

/// Runs `job` with models of at most `unknowns`, as a part of this thread's budget whose bytes are those of the part alone; none where the
/// unknowns or the bytes do not suffice. Where the whole computation has to stop, this does not return.
pub fn bounded<T>(unknowns: usize, job: impl FnOnce() -> T) -> Option<T> {
    let of = |allowance: &Allowance| Allowance { unknowns: unknowns.min(allowance.unknowns), ..allowance.clone() };
    let part = match current() {
        Some(budget) => budget.part_with(of),
        None => Budget::new(of(&Allowance::default())),
    };
    match within(&part, job) {
        Ok(value) => Some(value),
        Err(
            Stopped::Unknowns { .. } | Stopped::Bytes { .. } | Stopped::OwnerBytes { .. } | Stopped::ModeWork { .. },
        ) => None,
        Err(why) => unwind(why),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{OwnerQuota, lay_out, thread_cpu, unknowns};
    use super::*;
    use std::time::Duration;

    /// A part beyond its bound is abandoned and the rest continues, with a budget and without; the part's bytes are its
    /// own.
    #[test]
    fn too_much_is_given_up() {
        assert_eq!(bounded(10, || unknowns(11)), None);
        assert_eq!(bounded(10, || unknowns(10)), Some(()));
        let whole = Budget::new(Allowance { bytes: 100, unknowns: 5, ..Allowance::default() });
        let went_on = within(&whole, || {
            lay_out(60);
            assert_eq!(bounded(10, || unknowns(6)), None, "the whole's own bound stays");
            assert_eq!(bounded(10, || lay_out(101)), None);
            assert_eq!(bounded(10, || lay_out(90)), Some(()));
            whole.used()
        });
        assert!(went_on.is_ok_and(|used| used == 60));
    }

    /// The processor time of a part is taken from its owner once: of 75 ms, 50 leave some.
    #[test]
    #[cfg(target_os = "linux")]
    fn time_is_taken_once() {
        let purse = Arc::new(OwnerQuota::new(None, Some(Duration::from_millis(75))));
        let whole = Budget::new(Allowance { purse: Some(Arc::clone(&purse)), ..Allowance::default() });
        let used = || thread_cpu().expect("a clock of the thread");
        let spun = within(&whole, || {
            let start = used();
            bounded(10, || while used() - start < Duration::from_millis(50) {})
        });
        assert_eq!(spun, Ok(Some(())));
        assert_eq!(purse.check_cpu(), Ok(()));
    }

    /// A computation that is cancelled stops as a whole.
    #[test]
    fn cancelled_is_not_given_up() {
        let whole = Budget::new(Allowance::default());
        let stopped = within(&whole, || {
            bounded(10, || {
                whole.cancel();
                super::super::check();
            });
        });
        assert!(matches!(stopped, Err(Stopped::Cancelled)));
    }
}
