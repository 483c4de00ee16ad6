//! The points of a sweep in pieces: as many at once as are laid out side by side.

use super::crew::Crew;
use super::error::SweepError;
use super::family::Family;
use super::point::{self, Outcome};
use super::spec::{SweepAnalysis, SweepSpec};
use super::together::{self, Together};
use super::transient::{self, Transients};
use crate::budget::{self, Budget, Stopped};
use crate::compile::CompileOptions;
use crate::netlist::{Bundle, Source};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs points of a sweep by a crew. `each` is told of every one as soon as it is done, from any thread, and says whether to go on; `take` is
/// given those of a piece once all of it are done. Whether all were run.
///
/// # Errors
/// [`SweepError::TooLarge`] where the points need more memory than the budget of this thread has.
pub(super) fn run(
    (spec, bundle, options): (&SweepSpec, &Bundle, &CompileOptions),
    numbers: &[usize],
    crew: &dyn Crew,
    each: &(dyn Fn(&Outcome) -> bool + Sync),
    take: &(dyn Fn(Vec<Outcome>) + Sync),
) -> Result<bool, SweepError> {
    let stop = AtomicBool::new(false);
    let (budget, full) = (budget::current(), OnceLock::new());
    let source = Source::new(bundle);
    let family = Family::new(spec, &source, options);
    let go_on = || !stop.load(Ordering::Relaxed);
    let counted = |outcome: &Outcome| {
        if let Some(Err(Stopped::Bytes { most, .. } | Stopped::OwnerBytes { most, .. })) =
            budget.as_ref().map(|budget| budget.take(outcome.bytes()))
        {
            let _ = full.set(most);
            stop.store(true, Ordering::Relaxed);
        }
        if !each(outcome) {
            stop.store(true, Ordering::Relaxed);
        }
        go_on()
    };
    let transients = Transients::new(spec, &source, options);
    let together = Together::new(spec, &source, options, &family);
    let some = |numbers: &[usize]| match spec.analysis {
        SweepAnalysis::Transient { .. } => {
            transients.run(numbers, budget.as_ref(), &|outcome| outcome.is_none_or(counted) && go_on())
        }
        SweepAnalysis::Static { .. } | SweepAnalysis::Modes { .. } => {
            together.run(numbers, budget.as_ref(), &|outcome| counted(outcome))
        }
        SweepAnalysis::PullIn { .. } => {
            let one = |&number: &usize| {
                let outcome = point::run(spec, number, &source, options, &family, budget.as_ref().map(Budget::part));
                counted(&outcome).then_some(outcome)
            };
            numbers.iter().map(one).collect()
        }
    };
    // no thread goes without while another has many; a row does not depend on who is beside it
    let at_once = match spec.analysis {
        SweepAnalysis::Transient { .. } => transient::CHUNK,
        SweepAnalysis::PullIn { .. } => 1,
        _ if family.shares() => numbers.len().div_ceil(2 * crew.size().max(1)).clamp(1, together::CHUNK),
        _ => 1,
    };
    crew.run(numbers.len().div_ceil(at_once), &|piece| {
        let piece = numbers.chunks(at_once).nth(piece).unwrap_or_default();
        match go_on().then(|| some(piece)).flatten() {
            Some(outcomes) => take(outcomes),
            None => stop.store(true, Ordering::Relaxed),
        }
    });
    match full.get() {
        Some(&most) => Err(SweepError::TooLarge { most }),
        None => Ok(go_on()),
    }
}
