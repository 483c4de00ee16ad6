//! The points of a sweep in pieces: as many at once as are laid out side by side.

use super::crew::Crew;
use super::error::SweepError;
use super::family::Family;
use super::point::{self, Failed, Outcome};
use super::spec::{SweepAnalysis, SweepSpec};
use super::together::{self, Together};
use super::transient::{self, Transients};
use crate::budget::{self, Budget, Stopped};
use crate::compile::CompileOptions;
use crate::netlist::{Bundle, Source};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Runs points of a sweep by a crew. `each` is told of every one as soon as it is done, from any thread, and says whether to go on; `take` is
/// given those of a piece once all of it are done. Whether all were run.
///
/// # Errors
/// [`SweepError::TooLarge`] where the points need more memory than the budget of this thread has, and [`SweepError::Owner`] where its owner's is
/// used up.
pub(super) fn run(
    (spec, bundle, options): (&SweepSpec, &Bundle, &CompileOptions),
    numbers: &[usize],
    crew: &dyn Crew,
    each: &(dyn Fn(&Outcome) -> bool + Sync),
    take: &(dyn Fn(Vec<Outcome>) + Sync),
) -> Result<bool, SweepError> {
    let stop = AtomicBool::new(false);
    let (budget, full) = (budget::current(), OnceLock::new());
    let end = |why: SweepError| {
        let _ = full.set(why);
        stop.store(true, Ordering::Relaxed);
    };
    let source = Source::new(bundle);
    let go_on = || !stop.load(Ordering::Relaxed);
    let counted = |outcome: &Outcome| {
        // it may have a result another time: it is no row
        if let Err(Failed::Owner(why)) = outcome.values {
            end(SweepError::Owner(why));
            return false;
        }
        match budget.as_ref().map(|budget| budget.take(outcome.bytes())) {
            Some(Err(Stopped::Bytes { most, .. })) => end(SweepError::TooLarge { most }),
            Some(Err(why)) => end(SweepError::Owner(why)),
            Some(Ok(())) | None => {}
        }
        if !each(outcome) {
            stop.store(true, Ordering::Relaxed);
        }
        go_on()
    };
    for (options, numbers) in spec.by_options(options, numbers) {
        let variants = Variants::new(spec, &source, &options);
        let at_once = variants.at_once(numbers.len(), crew.size());
        crew.run(numbers.len().div_ceil(at_once), &|piece| {
            let piece = numbers.chunks(at_once).nth(piece).unwrap_or_default();
            match go_on().then(|| variants.run(piece, budget.as_ref(), &counted, &go_on)).flatten() {
                Some(outcomes) => take(outcomes),
                None => stop.store(true, Ordering::Relaxed),
            }
        });
    }
    let more = go_on();
    full.into_inner().map_or(Ok(more), Err)
}

/// Points with the same options.
struct Variants<'a> {
    spec: &'a SweepSpec,
    source: &'a Source,
    options: &'a CompileOptions,
    family: Arc<Family<'a>>,
    together: Together<'a>,
    transients: Transients<'a>,
}

impl<'a> Variants<'a> {
    fn new(spec: &'a SweepSpec, source: &'a Source, options: &'a CompileOptions) -> Self {
        let family = Arc::new(Family::new(spec, source, options));
        let together = Together::new(spec, source, options, Arc::clone(&family));
        Self { spec, source, options, family, together, transients: Transients::new(spec, source, options) }
    }

    /// How many of `points` are a piece: no thread goes without while another has many. A row does not depend on who is beside it.
    fn at_once(&self, points: usize, threads: usize) -> usize {
        match self.spec.analysis {
            SweepAnalysis::Transient { .. } => transient::CHUNK,
            SweepAnalysis::PullIn { .. } => 1,
            _ if self.family.shares() => points.div_ceil(2 * threads.max(1)).clamp(1, together::CHUNK),
            _ => 1,
        }
    }

    /// A piece; none where it was to stop.
    fn run(
        &self,
        numbers: &[usize],
        budget: Option<&Budget>,
        counted: &(dyn Fn(&Outcome) -> bool + Sync),
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<Outcome>> {
        match self.spec.analysis {
            SweepAnalysis::Transient { .. } => {
                self.transients.run(numbers, budget, &|outcome| outcome.is_none_or(counted) && go_on())
            }
            SweepAnalysis::Static { .. } | SweepAnalysis::Modes { .. } => self.together.run(numbers, budget, counted),
            SweepAnalysis::PullIn { .. } => {
                let one = |&number: &usize| {
                    let part = budget.map(Budget::part);
                    let outcome = point::run(self.spec, number, self.source, self.options, &self.family, part);
                    counted(&outcome).then_some(outcome)
                };
                numbers.iter().map(one).collect()
            }
        }
    }
}
