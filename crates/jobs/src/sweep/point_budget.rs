//! Budget of the points of a sweep.

use super::point_error::Failed;
use bimorph_base::budget::{self, Budget, Stopped};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{PoisonError, RwLock};

/// Budget of one point: the sweep's allowance, capped by what remains of the owner's quota.
#[derive(Debug, Default)]
pub(super) struct PointBudget {
    budget: Option<Budget>,
    /// Held by all that is computed; by one alone where there was no room for it beside others of this sweep.
    room: RwLock<()>,
}

impl PointBudget {
    /// Those of the thread at hand.
    pub(super) fn here() -> Self {
        Self { budget: budget::current(), room: RwLock::default() }
    }

    /// Takes bytes for as long as the sweep lasts.
    ///
    /// # Errors
    /// [`Stopped`]; nothing is taken then.
    pub(super) fn take(&self, bytes: usize) -> Result<(), Stopped> {
        self.budget.as_ref().map_or(Ok(()), |budget| budget.take(bytes))
    }

    /// Runs a job with them. A fault inside is the error of that job: it must not take other points with it. A point
    /// that does not fit into memory beside others is retried alone.
    pub(super) fn guarded<T>(&self, job: impl Fn() -> Result<T, String>) -> Result<T, Failed> {
        let Some(budget) = &self.budget else { return caught(|| Ok(job()?)) };
        let attempt = || {
            let part = budget.child();
            let outcome = caught(|| Ok(budget::within(&part, &job)??));
            outcome.map_err(|why| of_itself(why, part.used()))
        };
        let beside = self.room.read().unwrap_or_else(PoisonError::into_inner);
        let outcome = attempt();
        drop(beside);
        if !matches!(outcome, Err(Failed::Owner(Stopped::OwnerBytes { .. }))) {
            return outcome;
        }
        let _alone = self.room.write().unwrap_or_else(PoisonError::into_inner);
        attempt()
    }
}

/// A point that needs more than its owner's whole quota fails for that reason, whenever it is tried.
fn of_itself(why: Failed, used: usize) -> Failed {
    match why {
        Failed::Owner(Stopped::OwnerBytes { most, more, .. }) if used.saturating_add(more) > most => {
            Failed::Point(Stopped::OwnerBytes { most, used, more }.to_string())
        }
        other => other,
    }
}

fn caught<T>(job: impl FnOnce() -> Result<T, Failed>) -> Result<T, Failed> {
    let fault = |_| Err(Failed::Point("internal fault at this point".to_owned()));
    catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(fault)
}

#[cfg(test)]
mod tests {
    //! A point that needs more than the whole quota is an error; one that needs more than the remainder runs alone.
    use super::*;
    use bimorph_base::budget::{Allowance, OwnerQuota};
    use std::sync::{Arc, Barrier};

    fn means(most: usize) -> (PointBudget, Arc<OwnerQuota>) {
        let purse = Arc::new(OwnerQuota::new(Some(most), None));
        let allowance = Allowance { purse: Some(Arc::clone(&purse)), ..Allowance::default() };
        (PointBudget { budget: Some(Budget::new(allowance)), room: RwLock::default() }, purse)
    }

    #[test]
    fn points_beside_each_other_do_not_use_up_their_owners_memory() {
        let (means, purse) = means(100);
        let (both, count) = (Barrier::new(2), std::sync::atomic::AtomicUsize::new(0));
        let point = || {
            means.guarded(|| {
                budget::lay_out(60);
                // the first two meet: one of them had no room before that, or they are tried one after the other
                if count.fetch_add(1, std::sync::atomic::Ordering::SeqCst) == 0 {
                    std::thread::sleep(std::time::Duration::from_millis(20));
                }
                Ok(())
            })
        };
        let outcomes = std::thread::scope(|scope| {
            let run = || {
                both.wait();
                point()
            };
            [scope.spawn(run), scope.spawn(run)].map(|thread| thread.join().expect("no panic"))
        });
        assert_eq!(outcomes, [Ok(()), Ok(())]);
        assert_eq!(purse.take(100), Ok(()), "all of it was given back");
    }

    #[test]
    fn what_never_has_room_is_an_error_of_its_own() {
        let (means, purse) = means(100);
        assert!(matches!(
            means.guarded(|| {
                budget::lay_out(101);
                Ok(())
            }),
            Err(Failed::Point(_))
        ));
        // another computation of the same owner has most of it
        purse.take(90).expect("there is room");
        assert!(matches!(
            means.guarded(|| {
                budget::lay_out(60);
                Ok(())
            }),
            Err(Failed::Owner(_))
        ));
        let text: Result<(), Failed> = means.guarded(|| panic!("a fault"));
        assert!(matches!(text, Err(Failed::Point(text)) if text.contains("internal fault")));
    }
}
