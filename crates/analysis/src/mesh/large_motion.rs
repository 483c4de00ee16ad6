//! The mesh for a transient with large motion. Where stiffness changes during the motion, the initial and final states
//! and the modes about them do not determine the error in between.
//!
//! A beam that a step of load throws to twice its rest is stiffer there than anywhere it rests, and one that heat
//! carries through buckling is softer. Such a run is made on its mesh and on one of half the segments (with odd
//! numbers, on one of twice as many), at ten times the tolerance of the steps. The difference of the two is measured
//! signal by signal ([`largest_error`]). By Richardson's rule it is the error of the finer one where the order of
//! convergence is 1, as it is taken to be until it is measured, and three times that where it is 2. Where it is beyond
//! the tolerance segments are doubled, until the tolerance holds. A coarser intermediate mesh that should hold it as
//! well is run and compared; if it does, it is used. The reported error always belongs to a mesh that was actually run.
//!
//! A run to a state in which parts touch is compared up to its first contact, and in the time of that: impacts on two meshes have nothing else in common
//! than their means. Where the contact comes early in the run, meshes are compared in the time up to it (`to_first_contact.rs`).
//!
//! The first coarse run propagates the error of its steps. Steps that differ on both meshes are no error of a mesh. So where the difference is beyond the
//! goal and this error may explain it, both runs are made again with sharper steps before segments are doubled. These are at the tolerance of the run at most, and
//! sharper where doubled segments left the difference as it was. Where another formulation may be
//! taken, a judge of the first coarse run ends the search ([`SearchLimits`]).
//!
//! If stiffness stays constant, but the motion outside the modes of the mesh exceeds the tolerance, only a bound could
//! be reported. Such a run is made twice, too, and the difference of the two is reported instead.

use super::super::AnalysisError;
use super::super::after_contact::{apart_in_time, first_closing};
use super::super::chart::error::largest_error;
use super::super::statics::{OperatingPoint, operating_point};
use super::super::step_error;
use super::super::transient::{TransientOptions, TransientResult, Until, transient};
use super::excited_modes;
use super::remeshed::{chosen, meshed};
use super::signal_amplitudes::reach;
use super::to_first_contact::{self, SearchEnd};
use crate::readout::expression::Expression;
use bimorph_base::ErrorBudget;
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::doubling;
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_multibody::planar::Pose;

/// Largest difference between the run and its linear prediction with the final stiffness, as a fraction of the travel,
/// for which its modes determine the mesh.
const STRAIGHT: f64 = 0.03;
/// Output times that are compared, at least and at most, whatever is printed.
const POINTS: (usize, usize) = (201, 1001);
/// Times as many of a run that ends at an event.
const SOONER: usize = 5;
/// Unknowns times steps of one run, at most.
const MAX_WORK: f64 = 3e6;
/// Output times that a run must have reached to say something.
const MIN_SAMPLES: usize = 16;
/// Meshes that are tried, at most.
const MAX_PASSES: usize = 6;
/// Segments of all beams together, at most.
const MAX_SEGMENTS: usize = 4000;
const AIM: f64 = 0.7;
/// Ratio of the differences of two pairs of meshes from which on segments do not reduce them.
const STALLS: f64 = 0.7;
/// The order of convergence until it is measured, and the highest accepted one. Stretching has 2; among coarse meshes
/// and near buckling the measured order is lower, or seems higher.
const ORDERS: (f64, f64) = (1.0, 2.0);

/// Limits of a search.
pub(super) struct SearchLimits<'j> {
    /// Work of the first coarse run, and of all runs (unknowns times steps), at most; a search that takes more ends without a mesh.
    pub(super) work: [f64; 2],
    /// Whether to go on after the first coarse run, where the error of its steps has an estimate.
    pub(super) judge: Option<&'j mut dyn FnMut(&CoarseRun) -> bool>,
}

impl SearchLimits<'_> {
    /// Of the only search.
    pub(super) fn none() -> Self {
        Self { work: [f64::INFINITY; 2], judge: None }
    }
}

/// The mesh for a run, from that for its initial and final states and modes; the error of the motion outside the modes
/// is at most `left` of the amplitude. None where the judge of the first coarse run ends the search.
pub(super) fn order(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    order: Mesh,
    left: f64,
    limits: SearchLimits<'_>,
) -> Result<Option<Mesh>, AnalysisError> {
    let at_least =
        |error: f64| Mesh { estimated_error: order.estimated_error.map(|own| own.max(error)), ..order.clone() };
    let beams = !moving.structure.beams.is_empty() && order.segments.len() == moving.order.segments.len();
    let same = options.release.is_none_or(|start| start.order.segments.len() == order.segments.len());
    if !beams || !same || options.signals.is_empty() {
        return Ok(Some(at_least(left)));
    }
    let goal = moving.options.errors().large_motion();
    let closes = ends_in_contact(moving, options);
    let until = if closes { options.until.clone().or(Some(Until::Contact)) } else { options.until.clone() };
    let options = &options.with_end(until);
    if !closes && !bends(moving, options, &order)? {
        let found =
            (left > moving.options.errors().requested()).then(|| compared(moving, options, &order.segments)).flatten();
        return Ok(Some(match found {
            // both runs include the error of the modes, too
            Some(error) if error <= goal => Mesh { estimated_error: Some(error), ..order },
            error => at_least(error.map_or(left, |error| error.min(left))),
        }));
    }
    if options.until == Some(Until::Contact) {
        let SearchLimits { work, mut judge } = limits;
        return to_first_contact::order(options, &order, &mut |options, order| {
            let limits = SearchLimits { work, judge: judge.as_mut().map(|judge| &mut **judge as _) };
            search(moving, options, order, limits)
        });
    }
    Ok(match search(moving, options, &order, limits)? {
        SearchEnd::Found(mesh, _) => Some(mesh),
        SearchEnd::Limit | SearchEnd::EarlyContact(_) => None,
    })
}

/// Doubles the segments of a mesh until the run on it holds the tolerance.
fn search(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    order: &Mesh,
    limits: SearchLimits<'_>,
) -> Result<SearchEnd, AnalysisError> {
    let goal = moving.options.errors().large_motion();
    let given = chosen(moving) || moving.options.band.is_some();
    let on = |segments: &[usize], error: Option<f64>| {
        let estimated_error = order.estimated_error.zip(error).map(|(own, error)| own.max(error));
        Mesh { segments: segments.to_vec(), estimated_error, ..order.clone() }
    };
    let SearchLimits { work: [first_work, mut work], judge } = limits;
    let errors = moving.options.errors();
    let first = pair(moving, &order.segments).and_then(|(from, to)| {
        // steps at a looser tolerance may fail where those of the run do not
        let mut runs = [errors.mesh_runs(), errors].into_iter();
        let (run, steps) =
            runs.find_map(|steps| Some((run_on(moving, options, &from, (steps, true), first_work)?, steps)))?;
        Some((run, steps, from, to))
    });
    // a failure is reported when the run is made; a result without a comparison has no estimate
    let Some((run, steps, mut from, mut segments)) = first else {
        return Ok(SearchEnd::Found(on(&order.segments, None), None));
    };
    if run.is_beyond || run.steps.zip(judge).is_some_and(|(steps, goes_on)| !goes_on(&steps)) {
        return Ok(SearchEnd::Limit);
    }
    let is_early = options.until == Some(Until::Contact) && run.samples.count() < POINTS.0;
    if let Some(contact) = run.samples.contact.filter(|_| is_early) {
        return Ok(SearchEnd::EarlyContact(contact));
    }
    let error = run.steps.map(|steps| steps.error);
    let mut coarse = CoarseSamples { samples: run.samples, steps, error };
    work -= run.work;
    let (mut before, mut convergence) = (None, ORDERS.0);
    let mut last = SearchEnd::Found(on(&order.segments, None), None);
    for _ in 0..MAX_PASSES {
        let steps = coarse.steps;
        let compared = coarse.compared(moving, options, [&from, &segments], (convergence, before), &mut work);
        let (difference, fine, of_fine) = match compared {
            Comparison::Made(difference, run) => (difference, run.samples, run.work),
            Comparison::Failed => break,
            Comparison::BeyondLimit => return Ok(SearchEnd::Limit),
        };
        let contact = fine.contact;
        before = before.filter(|_| coarse.steps == steps);
        if let Some(before) = before {
            convergence = f64::log2(before / difference).clamp(ORDERS.0, ORDERS.1);
        }
        let error = difference / (convergence.exp2() - 1.0);
        let of_coarse = difference + error;
        if from == order.segments && (given || of_coarse <= goal) {
            return Ok(SearchEnd::Found(on(&from, Some(of_coarse)), contact));
        }
        if segments == order.segments && error <= goal {
            return Ok(SearchEnd::Found(on(&segments, Some(error)), contact));
        }
        let next = twice(moving, &segments).filter(|next| next.iter().sum::<usize>() <= MAX_SEGMENTS);
        if error <= goal || next.is_none() {
            let least = between(&order.segments, &segments, (error / (AIM * goal)).powf(1.0 / convergence));
            let of_least = (least != segments).then(|| sample_run(moving, options, &least, coarse.steps)).flatten();
            let of_least = of_least.and_then(|run| apart(moving, options, &run, &fine)).map(|apart| apart + error);
            let found = match of_least.filter(|error| *error <= goal) {
                Some(error) => on(&least, Some(error)),
                None => on(&segments, Some(error)),
            };
            return Ok(SearchEnd::Found(found, contact));
        }
        // the next mesh has twice the unknowns
        if 2.0 * of_fine > work {
            return Ok(SearchEnd::Limit);
        }
        last = SearchEnd::Found(on(&segments, Some(error)), contact);
        (before, coarse.samples, from) = (Some(difference), fine, segments);
        segments = next.unwrap_or_default();
    }
    Ok(last)
}

/// True where the run goes from rest to a state in which parts touch, on a mesh that is to be found.
pub(super) fn ends_in_contact(moving: &CompiledModel, options: &TransientOptions<'_>) -> bool {
    let free = !chosen(moving) && moving.options.band.is_none();
    free && options.release.is_none() && !options.signals.is_empty() && rests_in_contact(moving, options)
}

/// True where parts touch in the state to which the run goes, the sides of fingers included.
pub(super) fn rests_in_contact(moving: &CompiledModel, options: &TransientOptions<'_>) -> bool {
    let system = &moving.parts.system;
    let touches = |point: OperatingPoint| (0..system.members.len()).any(|g| system.touches(g, &point.q));
    system.has_contacts() && operating_point(moving, &options.voltages).is_ok_and(touches)
}

/// A mesh, and the one compared with it: half its segments, or twice as many for odd numbers. The coarser first.
fn pair(moving: &CompiledModel, segments: &[usize]) -> Option<(Vec<usize>, Vec<usize>)> {
    if segments.iter().all(|n| n % 2 == 0) {
        Some((segments.iter().map(|n| n / 2).collect(), segments.to_vec()))
    } else {
        twice(moving, segments).map(|more| (segments.to_vec(), more))
    }
}

/// Estimated error of the run on this mesh, relative to the amplitude; `None` where the runs fail.
fn compared(moving: &CompiledModel, options: &TransientOptions<'_>, segments: &[usize]) -> Option<f64> {
    let (from, to) = pair(moving, segments)?;
    let run = |segments: &[usize]| sample_run(moving, options, segments, moving.options.errors().mesh_runs());
    let difference = apart(moving, options, &run(&from)?, &run(&to)?)?;
    let of_finer = difference / (ORDERS.0.exp2() - 1.0);
    Some(if from == segments { difference + of_finer } else { of_finer })
}

/// A fraction of the segments, and no fewer than at least.
fn between(least: &[usize], segments: &[usize], share: f64) -> Vec<usize> {
    let share = share.clamp(0.5, 1.0);
    segments.iter().zip(least).map(|(n, least)| ((*n as f64 * share).ceil() as usize).max(*least)).collect()
}

/// Twice the segments; none where they are too many.
fn twice(moving: &CompiledModel, segments: &[usize]) -> Option<Vec<usize>> {
    let order = Mesh { segments: segments.to_vec(), ..moving.order.clone() };
    doubling::twice(&moving.options, &order).map(|order| order.segments)
}

/// Whether stiffness changes during the motion: the run differs from its linear prediction with the final stiffness.
fn bends(moving: &CompiledModel, options: &TransientOptions<'_>, order: &Mesh) -> Result<bool, AnalysisError> {
    let model = meshed(moving, &order.segments)?;
    let rest = OperatingPoint::rest(&model, &options.voltages)?;
    let from = match options.release {
        Some(start) => operating_point(&*meshed(start, &order.segments)?, &options.voltages)?,
        None => rest,
    };
    // without an equilibrium to go to it goes far
    let Ok(to) = operating_point(&model, &options.voltages) else { return Ok(true) };
    let Some(straight) = excited_modes::linear_way(&model, &from, &to) else { return Ok(true) };
    let way: Vec<Pose> = from.q.iter().zip(&to.q).map(|(a, b)| a - b).collect();
    let off: Vec<Pose> = way.iter().zip(&straight).map(|(a, b)| a - b).collect();
    Ok(reach(&model, &off) > STRAIGHT * reach(&model, &way))
}

/// Steps of a coarse run that came to its end.
#[derive(Debug, Clone, Copy)]
pub(super) struct CoarseRun {
    /// Unknowns times steps, rejected ones included.
    pub(super) work: f64,
    /// Of all beams.
    pub(super) segments: usize,
    /// Error of the steps, of the amplitude (1).
    pub(super) error: f64,
    /// Largest change of the amplitude by the energy that the steps took (1).
    pub(super) damped: f64,
}

/// The part of a run that is compared.
struct MeshSamples {
    /// Samples of each signal.
    columns: Vec<Vec<f64>>,
    /// When parts first touch (s).
    contact: Option<f64>,
}

impl MeshSamples {
    fn count(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// A run on a mesh, as far as it came.
struct MeshRun {
    samples: MeshSamples,
    /// Of a run that was to be judged and came to its end.
    steps: Option<CoarseRun>,
    /// Unknowns times steps.
    work: f64,
    /// It was ended by the limit of the search.
    is_beyond: bool,
}

/// A run on the coarser of two meshes.
struct CoarseSamples {
    samples: MeshSamples,
    /// The tolerance of its steps.
    steps: ErrorBudget,
    /// Their error, of the amplitude (1).
    error: Option<f64>,
}

/// A comparison of two meshes.
enum Comparison {
    /// The difference, of the amplitude, and the run on the finer mesh.
    Made(f64, MeshRun),
    Failed,
    BeyondLimit,
}

impl CoarseSamples {
    /// Compares a mesh with the finer one, in at most so much `work`; `before` is the difference of the meshes before. Steps that differ on both meshes are no
    /// error of a mesh: where they may be the difference, both runs are made again with sharper steps.
    fn compared(
        &mut self,
        moving: &CompiledModel,
        options: &TransientOptions<'_>,
        [coarse, fine]: [&[usize]; 2],
        (convergence, before): (f64, Option<f64>),
        work: &mut f64,
    ) -> Comparison {
        loop {
            let Some(run) = run_on(moving, options, fine, (self.steps, false), *work) else {
                return Comparison::Failed;
            };
            *work -= run.work;
            if run.is_beyond {
                return Comparison::BeyondLimit;
            }
            let Some(difference) = apart(moving, options, &self.samples, &run.samples) else {
                return Comparison::Failed;
            };
            let error = difference / (convergence.exp2() - 1.0);
            let found = (error, before.is_some_and(|before| difference > STALLS * before));
            let sharper = self.error.and_then(|own| moving.options.errors().sharper_mesh_runs(self.steps, own, found));
            let again = sharper.and_then(|steps| Some((run_on(moving, options, coarse, (steps, true), *work)?, steps)));
            let Some((again, steps)) = again else { return Comparison::Made(difference, run) };
            *work -= again.work;
            if again.is_beyond {
                return Comparison::BeyondLimit;
            }
            *self = Self { samples: again.samples, steps, error: again.steps.map(|steps| steps.error) };
        }
    }
}

/// The samples of a run on a mesh, as far as it came; none where it failed.
fn sample_run(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    segments: &[usize],
    steps: ErrorBudget,
) -> Option<MeshSamples> {
    run_on(moving, options, segments, (steps, false), f64::INFINITY).map(|run| run.samples)
}

/// The same with steps of this tolerance, with the error of its steps where `judged`, in at most so much work.
fn run_on(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    segments: &[usize],
    (tolerance, judged): (ErrorBudget, bool),
    most: f64,
) -> Option<MeshRun> {
    let model = meshed(moving, segments).ok()?;
    let start = options.release.map(|start| meshed(start, segments)).transpose().ok()?;
    let loose = options.for_mesh(tolerance.requested(), points(options), start.as_deref());
    let mut columns = vec![Vec::new(); options.signals.len()];
    let mut keep = |_: f64, values: &[f64]| {
        bimorph_base::budget::lay_out(size_of_val(values));
        columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
    };
    let (mut steps, unknowns) = (0.0, model.unknowns() as f64);
    let mut few = |_: f64| {
        steps += 1.0;
        steps * unknowns <= MAX_WORK.min(most)
    };
    let loose = if judged { loose.with_estimate() } else { loose };
    let mut contact = None;
    let coarse = match transient(&model, &loose, &mut keep, &mut few) {
        Ok(run) => {
            contact = first_closing(&run);
            run.step_error.map(|error| CoarseRun {
                work: (run.counters.steps + run.counters.rejected) as f64 * unknowns,
                segments: segments.iter().sum(),
                error,
                damped: run.damped.unwrap_or(0.0),
            })
        }
        Err(AnalysisError::Cancelled) => None,
        Err(_) => return None,
    };
    let work = steps * unknowns;
    let samples = MeshSamples { columns, contact };
    let reached = contact.is_some() || samples.count() >= MIN_SAMPLES;
    let run = MeshRun { samples, steps: coarse.filter(|_| judged), work, is_beyond: work > most };
    (reached || run.is_beyond).then_some(run)
}

fn points(options: &TransientOptions<'_>) -> usize {
    // one that ends at an event may be over soon
    match options.until {
        Some(_) => options.points.max(SOONER * POINTS.1),
        None => options.points.clamp(POINTS.0, POINTS.1),
    }
}

/// How far two runs are apart, of the amplitude, and where they end at a contact in its time, of the time up to it.
fn apart(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    coarse: &MeshSamples,
    fine: &MeshSamples,
) -> Option<f64> {
    let both = coarse.count().min(fine.count());
    if both == 0 {
        return None;
    }
    let named = |columns: &[Vec<f64>]| {
        let signal = |(name, column): (&String, &Vec<f64>)| {
            let unit = Expression::of_run(moving, name, &[]).ok()?.unit().to_owned();
            Some((name.clone(), unit, column[..both].to_vec()))
        };
        let signals = options.signals.iter().zip(columns).map(signal).collect::<Option<_>>()?;
        Some(TransientResult { signals, ..TransientResult::default() })
    };
    let error = largest_error(&named(&fine.columns)?, &named(&coarse.columns)?, &|unit| {
        step_error::least(unit, options, moving)
    });
    if options.until == Some(Until::Contact) {
        let spacing = options.stop / (points(options) - 1) as f64;
        return Some(error.max(apart_in_contact(spacing, coarse, fine)));
    }
    // a run that ends at an event is whole
    let whole = options.until.is_some();
    let share = if whole { 1.0 } else { (both - 1) as f64 / (points(options) - 1) as f64 };
    Some(error / share.min(1.0))
}

/// Difference of the times of the first contact of two runs, of the larger one (1); at least, where one of them ended before. Output times have this
/// distance (s).
fn apart_in_contact(spacing: f64, coarse: &MeshSamples, fine: &MeshSamples) -> f64 {
    let reached = |run: &MeshSamples| (run.count() - 1) as f64 * spacing;
    match (coarse.contact, fine.contact) {
        (Some(coarse), Some(fine)) => apart_in_time(coarse, fine),
        (Some(contact), None) => (1.0 - contact / reached(fine)).max(0.0),
        (None, Some(contact)) => (1.0 - contact / reached(coarse)).max(0.0),
        (None, None) => 0.0,
    }
}
