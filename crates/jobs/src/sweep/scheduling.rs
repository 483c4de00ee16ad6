//! Scheduling of a sweep: its points are divided into pieces of as many as a batch holds.

use super::axis;
use super::batched::{self, BatchedSweep};
use super::error::SweepError;
use super::executor::Executor;
use super::point::{self, PointOutcome};
use super::point_budget::PointBudget;
use super::point_error::Failed;
use super::shared_meshes::SharedMeshes;
use super::spec::{SweepAnalysis, SweepSpec};
use super::transient::{self, TransientSweep};
use bimorph_base::Bundle;
use bimorph_base::budget::Stopped;
use bimorph_model::compile::CompileOptions;
use bimorph_netlist::NetlistSource;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Runs points of a sweep by a crew. `each` is called for every one as soon as it is finished, from any thread, and
/// returns whether to continue. `take` receives those of a piece once the whole piece is finished. Whether all were
/// run.
///
/// # Errors
/// [`SweepError::TooLarge`] where the points need more memory than the budget of this thread has, and [`SweepError::Owner`] where its owner's is
/// used up.
pub(super) fn run(
    (spec, bundle, options): (&SweepSpec, &Bundle, &CompileOptions),
    numbers: &[usize],
    crew: &dyn Executor,
    each: &(dyn Fn(&PointOutcome) -> bool + Sync),
    take: &(dyn Fn(Vec<PointOutcome>) + Sync),
) -> Result<bool, SweepError> {
    let stop = AtomicBool::new(false);
    let (means, full) = (PointBudget::here(), OnceLock::new());
    let end = |why: SweepError| {
        let _ = full.set(why);
        stop.store(true, Ordering::Relaxed);
    };
    let source = NetlistSource::new(bundle);
    let go_on = || !stop.load(Ordering::Relaxed);
    let counted = |outcome: &PointOutcome| {
        // it may have a result another time: it is no row
        if let Err(Failed::Owner(why)) = outcome.values {
            end(SweepError::Owner(why));
            return false;
        }
        match means.take(outcome.bytes()) {
            Err(Stopped::Bytes { most, .. }) => end(SweepError::TooLarge { most }),
            Err(why) => end(SweepError::Owner(why)),
            Ok(()) => {}
        }
        if !each(outcome) {
            stop.store(true, Ordering::Relaxed);
        }
        go_on()
    };
    let at_once = at_once(spec, numbers.len(), crew.size());
    let groups: Vec<PointGroup<'_>> =
        spec.by_options(numbers).into_iter().map(|numbers| PointGroup::new(numbers, at_once)).collect();
    let pieces: Vec<(&PointGroup<'_>, &[usize])> =
        groups.iter().flat_map(|group| group.numbers.chunks(at_once).map(move |piece| (group, piece))).collect();
    crew.run(pieces.len(), &|number| {
        let (group, piece) = pieces[number];
        let variants = || group.variants(spec, &source, options);
        match go_on().then(|| variants().run(piece, &means, &counted, &go_on)).flatten() {
            Some(outcomes) => take(outcomes),
            None => stop.store(true, Ordering::Relaxed),
        }
        group.leave();
        go_on()
    });
    let more = go_on();
    full.into_inner().map_or(Ok(more), Err)
}

/// How many of `points` are a piece: no thread goes without while another has many. A row does not depend on the other
/// points of its batch.
fn at_once(spec: &SweepSpec, points: usize, threads: usize) -> usize {
    match spec.analysis {
        SweepAnalysis::Transient { .. } => transient::CHUNK,
        SweepAnalysis::PullIn { .. } => 1,
        _ if spec.has_variants() => points.div_ceil(2 * threads.max(1)).clamp(1, batched::CHUNK),
        _ => 1,
    }
}

/// Points with the same options; what they share is there from their first piece to their last.
struct PointGroup<'a> {
    numbers: Vec<usize>,
    variants: Mutex<Option<Arc<Variants<'a>>>>,
    /// Pieces that are not over.
    left: AtomicUsize,
}

impl<'a> PointGroup<'a> {
    fn new(numbers: Vec<usize>, at_once: usize) -> Self {
        let left = AtomicUsize::new(numbers.len().div_ceil(at_once));
        Self { numbers, variants: Mutex::default(), left }
    }

    fn held(&self) -> MutexGuard<'_, Option<Arc<Variants<'a>>>> {
        self.variants.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn variants(&self, spec: &'a SweepSpec, source: &'a NetlistSource, options: &CompileOptions) -> Arc<Variants<'a>> {
        let new = || Arc::new(Variants::new(spec, source, axis::chosen(options, &spec.settings(self.numbers[0]))));
        Arc::clone(self.held().get_or_insert_with(new))
    }

    /// A piece is over.
    fn leave(&self) {
        if self.left.fetch_sub(1, Ordering::Relaxed) == 1 {
            *self.held() = None;
        }
    }
}

/// Data that points with the same options share.
struct Variants<'a> {
    spec: &'a SweepSpec,
    source: &'a NetlistSource,
    options: Arc<CompileOptions>,
    family: Arc<SharedMeshes<'a>>,
    together: BatchedSweep<'a>,
    transients: TransientSweep<'a>,
}

impl<'a> Variants<'a> {
    fn new(spec: &'a SweepSpec, source: &'a NetlistSource, options: CompileOptions) -> Self {
        let options = Arc::new(options);
        let family = Arc::new(SharedMeshes::new(spec, source, Arc::clone(&options)));
        let together = BatchedSweep::new(spec, source, Arc::clone(&options), Arc::clone(&family));
        let transients = TransientSweep::new(spec, source, Arc::clone(&options));
        Self { spec, source, options, family, together, transients }
    }

    /// A piece; none where it was to stop.
    fn run(
        &self,
        numbers: &[usize],
        means: &PointBudget,
        counted: &(dyn Fn(&PointOutcome) -> bool + Sync),
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<PointOutcome>> {
        match self.spec.analysis {
            SweepAnalysis::Transient { .. } => {
                self.transients.run(numbers, means, &|outcome| outcome.is_none_or(counted) && go_on())
            }
            SweepAnalysis::Static { .. } | SweepAnalysis::Modes { .. } => self.together.run(numbers, means, counted),
            SweepAnalysis::PullIn { .. } => {
                let one = |&number: &usize| {
                    let outcome = point::run(self.spec, number, self.source, &self.options, &self.family, means);
                    counted(&outcome).then_some(outcome)
                };
                numbers.iter().map(one).collect()
            }
        }
    }
}
