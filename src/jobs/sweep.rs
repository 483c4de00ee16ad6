//! A parameter grid over one analysis, on all cores, in a fixed order.
//!
//! The netlist is read once. Each point of the grid draws it with its own parameter values and runs one analysis, on a mesh
//! that was searched once for all (`family`) where the estimate of its error says so. Points do not know of each other, and
//! rows come back in grid order, so the table has the same bits on one thread and on many, and the shards of a sweep put
//! together are the whole sweep.

mod design;
mod distribution;
mod error;
mod family;
pub mod journal;
pub mod parse;
mod point;
mod samples;
mod spec;
mod table;
mod together;
mod transient;

pub use design::{DESIGNS, Design};
pub use distribution::{Distribution, Vary, number};
pub use error::SweepError;
pub use samples::{Samples, Sampling};
pub use spec::{Shard, SweepAnalysis, SweepParameter, SweepSpec};
pub use table::{SweepRow, SweepTable};

use crate::budget::{self, Budget, Stopped};
use crate::compile::{CompileError, CompileOptions, Drawn, draw};
use crate::netlist::{Bundle, Source};
use family::Family;
use journal::Kept;
use point::Outcome;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use together::Together;
use transient::Transients;

/// How far a sweep has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SweepProgress {
    /// Points finished, failed ones among them.
    pub done: u64,
    /// Points of this shard.
    pub points: u64,
    /// Points finished with an error.
    pub failed: u64,
}

/// Refuses a specification with names that the netlist does not have; compiles its first point for that. Other errors of a
/// point are rows of the table.
///
/// # Errors
/// [`SweepError::BadSpec`] with the first such parameter or output.
pub fn check_names(spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) -> Result<(), SweepError> {
    spec.point_numbers()?;
    point::check_names(spec, &Source::new(bundle), options)
}

/// What is drawn at the first point, with what the netlist is warned of there.
///
/// # Errors
/// What the point would have for an error.
pub fn first_drawn(spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) -> Result<Drawn, CompileError> {
    draw(&Source::new(bundle), &spec::at(options, &spec.settings(0)))
}

/// Runs a sweep; under a budget, each point has all of its allowance, and the rows together have it once more. `progress` is told after every point, from any thread, and answers whether to go on.
///
/// # Errors
/// [`SweepError`]; a point without a result is a row with its error, not an error here.
pub fn run(
    spec: &SweepSpec,
    bundle: &Bundle,
    options: &CompileOptions,
    progress: &(dyn Fn(SweepProgress) -> bool + Sync),
) -> Result<SweepTable, SweepError> {
    run_on(spec, bundle, options, Vec::new(), None, progress)
}

/// The same, going on from the points that are `known` from before. `keep`, if there is one, is given each point that is new as soon as
/// it is done, from any thread, and answers whether to go on.
///
/// # Errors
/// As [`run`].
pub fn run_on(
    spec: &SweepSpec,
    bundle: &Bundle,
    options: &CompileOptions,
    known: Vec<Kept>,
    keep: Option<&(dyn Fn(&Kept) -> bool + Sync)>,
    progress: &(dyn Fn(SweepProgress) -> bool + Sync),
) -> Result<SweepTable, SweepError> {
    let mut numbers = spec.point_numbers()?;
    let points = numbers.len() as u64;
    let mut known: BTreeMap<usize, Kept> = known.into_iter().map(|kept| (kept.point, kept)).collect();
    known.retain(|number, _| numbers.binary_search(number).is_ok());
    numbers.retain(|number| !known.contains_key(number));
    let before = known.values().filter(|kept| kept.error.is_some()).count();
    let (done, failed) = (AtomicU64::new(known.len() as u64), AtomicU64::new(before as u64));
    let stop = AtomicBool::new(false);
    let (budget, full) = (budget::current(), OnceLock::new());
    let source = Source::new(bundle);
    let family = Family::new(spec, &source, options);
    let counted = |outcome: &point::Outcome| {
        if let Some(Err(Stopped::Bytes { most, .. } | Stopped::OwnerBytes { most, .. })) =
            budget.as_ref().map(|budget| budget.take(outcome.bytes()))
        {
            let _ = full.set(most);
            stop.store(true, Ordering::Relaxed);
        }
        if outcome.values.is_err() {
            failed.fetch_add(1, Ordering::Relaxed);
        }
        if keep.is_some_and(|keep| !keep(&outcome.kept())) {
            stop.store(true, Ordering::Relaxed);
        }
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if !progress(SweepProgress { done, points, failed: failed.load(Ordering::Relaxed) }) {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let one = |&number: &usize| -> Option<Vec<point::Outcome>> {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let outcome = point::run(spec, number, &source, options, &family, budget.as_ref().map(Budget::part));
        counted(&outcome);
        Some(vec![outcome])
    };
    let transients = Transients::new(spec, &source, options);
    let some = |numbers: &[usize]| -> Option<Vec<point::Outcome>> {
        transients.run(numbers, budget.as_ref(), &|outcome| {
            outcome.into_iter().for_each(counted);
            !stop.load(Ordering::Relaxed)
        })
    };
    let together = Together::new(spec, &source, options, &family);
    let several = |numbers: &[usize]| -> Option<Vec<point::Outcome>> {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        together.run(numbers, budget.as_ref(), &|outcome| {
            counted(outcome);
            !stop.load(Ordering::Relaxed)
        })
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(spec.threads.unwrap_or(0))
        .build()
        .map_err(|error| SweepError::Threads { reason: error.to_string() })?;
    // no thread goes without while another has many; a row does not depend on who is beside it
    let at_once = match family.shares() {
        true => numbers.len().div_ceil(2 * pool.current_num_threads()).clamp(1, together::CHUNK),
        false => 1,
    };
    let outcomes: Option<Vec<Vec<_>>> = pool.install(|| match spec.analysis {
        SweepAnalysis::Transient { .. } => numbers.par_chunks(transient::CHUNK).map(some).collect(),
        SweepAnalysis::Static { .. } | SweepAnalysis::Modes { .. } => {
            numbers.par_chunks(at_once).map(several).collect()
        }
        SweepAnalysis::PullIn { .. } => numbers.par_iter().map(one).collect(),
    });
    if let Some(&most) = full.get() {
        return Err(SweepError::TooLarge { most });
    }
    match outcomes {
        Some(outcomes) => {
            let new = outcomes.into_iter().flatten();
            let mut all: Vec<Outcome> = known.into_values().map(|kept| kept.outcome(spec)).chain(new).collect();
            all.sort_by_key(|outcome| outcome.number);
            Ok(table::assemble(spec, all))
        }
        None => Err(SweepError::Cancelled { done: done.into_inner(), points }),
    }
}
