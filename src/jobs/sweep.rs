//! A parameter grid over one analysis, on all cores, in a fixed order.
//!
//! The netlist is read once. Each point of the grid draws it with its own parameter values and runs one analysis, on a mesh
//! that was searched once for all (`family`) where the estimate of its error says so. Points do not know of each other, and
//! rows come back in grid order, so the table has the same bits on one thread and on many, and the shards of a sweep put
//! together are the whole sweep.

mod design;
mod distribution;
mod family;
pub mod journal;
pub mod parse;
mod point;
mod samples;
mod table;
mod transient;

pub use design::{DESIGNS, Design};
pub use distribution::{Distribution, Vary};
pub use samples::{Samples, Sampling};
pub use table::{SweepRow, SweepTable};

use crate::budget::{self, Budget, Stopped};
use crate::compile::{CompileError, CompileOptions, Drawn, draw};
use crate::netlist::{Bundle, Setting, Source};
use family::Family;
use journal::Kept;
use point::Outcome;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashSet};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use thiserror::Error;
use transient::Transients;

/// What to sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSpec {
    /// The full grid of these is run; the last one varies fastest. Empty: one point, as the netlist stands.
    pub parameters: Vec<SweepParameter>,
    /// Samples that are drawn at every point of the grid, and vary faster than it.
    pub samples: Option<Samples>,
    /// What to compute at each point.
    pub analysis: SweepAnalysis,
    /// Which part of the grid to run.
    pub shard: Shard,
    /// Worker threads; none: one per core. The table does not depend on it.
    pub threads: Option<usize>,
}

/// One axis of the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepParameter {
    /// A netlist parameter.
    pub name: String,
    /// The values it takes, in order. SI.
    pub values: Vec<Setting>,
}

/// What to compute at each point.
#[derive(Debug, Clone, PartialEq)]
pub enum SweepAnalysis {
    /// Static equilibrium.
    Static {
        /// Columns wanted: `NODE.x` [m], `NODE.y` [m], `NODE.rz` [rad], `PORT.i` [A], `PORT.q` [C], `BEAM.T` [K];
        /// empty: x, y and rz of every node.
        outputs: Vec<String>,
        /// Port voltages by name [V].
        voltages: Vec<(String, f64)>,
    },
    /// Natural frequencies [Hz].
    Modes {
        /// How many, from the lowest.
        count: usize,
        /// Port voltages of the operating point by name [V].
        voltages: Vec<(String, f64)>,
    },
    /// Pull-in and release voltages [V].
    PullIn {
        /// Port or netlist source to raise; none: the first.
        port: Option<String>,
        /// Highest voltage tried [V].
        max: f64,
    },
    /// Motion from rest, by Rodas4: signals at its end.
    Transient {
        /// End time [s].
        stop: f64,
        /// Columns wanted, as signals of a transient: `NODE.x` [m], `NODE.vx` [m/s], `BEAM.T` [K], `GAP.gap` [m], ….
        outputs: Vec<String>,
        /// Port voltages held during the run, by name [V].
        voltages: Vec<(String, f64)>,
    },
}

/// One of `count` equal parts of a grid: the points whose number modulo `count` is `index`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: usize,
    /// At least 1.
    pub count: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

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

/// Why a sweep has no table. A point that fails is not an error of the sweep: its row says why.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A specification that means nothing.
    #[error("{what}: expected {expected}, got {got}")]
    BadSpec {
        /// Which part.
        what: String,
        /// What was expected.
        expected: String,
        /// What came.
        got: String,
    },
    /// The progress callback said stop.
    #[error("cancelled after {done} of {points} points")]
    Cancelled {
        /// Points finished.
        done: u64,
        /// Points of this shard.
        points: u64,
    },
    /// The table would take more memory than the sweep may use.
    #[error("the table needs more than {most} bytes; name the outputs that are wanted, or split the sweep into shards")]
    TooLarge {
        /// What it may use [byte].
        most: usize,
    },
    /// The operating system gave no threads.
    #[error("no worker threads: {reason}")]
    Threads {
        /// What it said.
        reason: String,
    },
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
    draw(&Source::new(bundle), &point::at(options, &spec.settings(0)))
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
        if let Some(Err(Stopped::Bytes { most, .. })) = budget.as_ref().map(|budget| budget.take(outcome.bytes())) {
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
    let in_time = matches!(spec.analysis, SweepAnalysis::Transient { .. });
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(spec.threads.unwrap_or(0))
        .build()
        .map_err(|error| SweepError::Threads { reason: error.to_string() })?;
    let outcomes: Option<Vec<Vec<_>>> = pool.install(|| match in_time {
        true => numbers.par_chunks(transient::CHUNK).map(some).collect(),
        false => numbers.par_iter().map(one).collect(),
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

impl SweepSpec {
    /// Names of what varies, the slowest first.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let varying = self.samples.iter().flat_map(|samples| &samples.asked.vary);
        self.parameters.iter().map(|axis| axis.name.as_str()).chain(varying.map(|vary| vary.name.as_str()))
    }

    /// Samples at each point of the grid.
    fn sample_count(&self) -> usize {
        self.samples.as_ref().map_or(1, |samples| samples.asked.count)
    }

    /// Points of the whole grid with all samples, before sharding.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`] for an axis without values or a grid too large to number.
    pub fn grid_points(&self) -> Result<usize, SweepError> {
        self.parameters.iter().try_fold(self.sample_count(), |product, axis| {
            if axis.values.is_empty() {
                return Err(bad(format!("parameter {}", axis.name), "at least one value", "none"));
            }
            product
                .checked_mul(axis.values.len())
                .ok_or_else(|| bad("parameters".into(), "a grid that can be numbered", "too many points"))
        })
    }

    /// Numbers of the points this shard runs.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`].
    pub fn point_numbers(&self) -> Result<Vec<usize>, SweepError> {
        let Shard { index, count } = self.shard;
        if count == 0 || index >= count {
            return Err(bad("shard".into(), "i/N with 0 <= i < N", &format!("{index}/{count}")));
        }
        let mut seen = HashSet::with_capacity(self.parameters.len());
        for name in self.names() {
            if !seen.insert(name) {
                return Err(bad("parameters".into(), "each name once", &format!("\"{name}\" twice")));
            }
        }
        Ok((index..self.grid_points()?).step_by(count).collect())
    }

    /// Values of every parameter at one point of the grid.
    pub fn settings(&self, number: usize) -> Vec<(String, Setting)> {
        let count = self.sample_count();
        let mut settings = self.grid_settings(number / count);
        settings.extend(self.samples.iter().flat_map(|samples| samples.values(number % count)));
        settings
    }

    /// Values of the parameters of the grid at one of its points, samples aside.
    fn grid_settings(&self, mut number: usize) -> Vec<(String, Setting)> {
        let mut settings = Vec::with_capacity(self.parameters.len());
        for axis in self.parameters.iter().rev() {
            let n = axis.values.len().max(1);
            if let Some(value) = axis.values.get(number % n) {
                settings.push((axis.name.clone(), value.clone()));
            }
            number /= n;
        }
        settings.reverse();
        settings
    }
}

fn bad(what: String, expected: &str, got: &str) -> SweepError {
    SweepError::BadSpec { what, expected: expected.to_owned(), got: got.to_owned() }
}
