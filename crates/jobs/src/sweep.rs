//! A parameter grid over one analysis, on all cores, in a fixed order.
//!
//! The netlist is read once. Each point of the grid draws it with its own parameter values and runs one analysis, on a mesh
//! that was searched once for all (`shared_meshes`) where the estimate of its error says so. Points do not know of each other, and
//! rows come back in grid order, so the table has the same bits on one thread and on many, and the shards of a sweep put
//! together are the whole sweep.

mod axis;
mod batched;
mod design;
mod distribution;
mod error;
mod executor;
pub mod journal;
pub mod parse;
mod point;
mod point_budget;
mod point_error;
#[cfg(feature = "server")]
mod points;
mod reductions;
mod samples;
mod scheduling;
pub mod shard;
mod shared_meshes;
mod spec;
pub mod statistics;
mod table;
mod transient;
mod values;

pub use axis::SweepParameter;
pub use design::{DESIGNS, Design};
pub use distribution::{Distribution, Vary, number};
pub use error::SweepError;
pub use executor::{Executor, ThreadPool};
#[cfg(feature = "server")]
pub use points::points;
pub use samples::{SampleGenerator, Sampling};
pub use spec::{Shard, SweepAnalysis, SweepSpec};
pub use table::{SweepRow, SweepTable};
pub use values::Values;

use bimorph_base::{Bundle, Setting};
use bimorph_model::compile::{CompileError, CompileOptions, ParsedStructure, draw};
use bimorph_netlist::NetlistSource;
use journal::JournalRow;
use point::PointOutcome;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

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
    point::check_names(spec, &NetlistSource::new(bundle), options)
}

/// The structure at the first point, with the warnings of its netlist.
///
/// # Errors
/// The error that the point would have.
pub fn first_drawn(
    spec: &SweepSpec,
    bundle: &Bundle,
    options: &CompileOptions,
) -> Result<ParsedStructure, CompileError> {
    let settings = spec.settings(0);
    draw(&NetlistSource::new(bundle), &axis::at(&axis::chosen(options, &settings), &settings))
}

/// Runs a sweep; under a budget, each point has all of its allowance, and the rows together have it once more.
/// `progress` is called after every point, from any thread, and returns whether to continue.
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

/// The same, going on from the points that are `known` from before. `keep`, if there is one, receives each new point as
/// soon as it is finished, from any thread, and returns whether to continue.
///
/// # Errors
/// As [`run`].
pub fn run_on(
    spec: &SweepSpec,
    bundle: &Bundle,
    options: &CompileOptions,
    known: Vec<JournalRow>,
    keep: Option<&(dyn Fn(&JournalRow) -> bool + Sync)>,
    progress: &(dyn Fn(SweepProgress) -> bool + Sync),
) -> Result<SweepTable, SweepError> {
    let mut numbers = spec.point_numbers()?;
    let points = numbers.len() as u64;
    let mut known: BTreeMap<usize, JournalRow> = known.into_iter().map(|kept| (kept.point, kept)).collect();
    known.retain(|number, _| numbers.binary_search(number).is_ok());
    numbers.retain(|number| !known.contains_key(number));
    let before = known.values().filter(|kept| kept.error.is_some()).count();
    let (done, failed) = (AtomicU64::new(known.len() as u64), AtomicU64::new(before as u64));
    let each = |outcome: &PointOutcome| {
        if outcome.values.is_err() {
            failed.fetch_add(1, Ordering::Relaxed);
        }
        let kept = keep.is_none_or(|keep| keep(&outcome.kept()));
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(SweepProgress { done, points, failed: failed.load(Ordering::Relaxed) }) && kept
    };
    let found = Mutex::new(Vec::with_capacity(numbers.len()));
    let take = |outcomes| found.lock().unwrap_or_else(PoisonError::into_inner).extend(outcomes);
    let crew = ThreadPool::new(spec.threads.unwrap_or(0))?;
    if !scheduling::run((spec, bundle, options), &numbers, &crew, &each, &take)? {
        return Err(SweepError::Cancelled { done: done.into_inner(), points });
    }
    let mut all: Vec<PointOutcome> = known.into_values().map(|kept| kept.outcome(spec)).collect();
    all.extend(found.into_inner().unwrap_or_else(PoisonError::into_inner));
    all.sort_by_key(|outcome| outcome.number);
    Ok(table::assemble(spec.names().map(str::to_owned).collect(), all))
}

/// Runs the points `numbers` of a sweep by an executor; `keep` receives each as soon as it is finished, from any
/// thread, and returns whether to continue. Whether all were run.
///
/// # Errors
/// As [`run`].
pub fn run_by(
    spec: &SweepSpec,
    bundle: &Bundle,
    options: &CompileOptions,
    numbers: &[usize],
    crew: &dyn Executor,
    keep: &(dyn Fn(JournalRow) -> bool + Sync),
) -> Result<bool, SweepError> {
    scheduling::run((spec, bundle, options), numbers, crew, &|outcome| keep(outcome.kept()), &drop)
}

/// The table of points that came one by one, each with the values of its parameters, in any order.
pub fn table_of(parameters: Vec<String>, rows: Vec<(Vec<Setting>, JournalRow)>) -> SweepTable {
    let mut all: Vec<PointOutcome> = rows.into_iter().map(|(settings, kept)| kept.with(settings)).collect();
    all.sort_by_key(|outcome| outcome.number);
    table::assemble(parameters, all)
}
