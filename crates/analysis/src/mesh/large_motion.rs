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
//! A run to a state in which parts touch is compared up to its first contact: impacts on two meshes have nothing else in common than their means.
//!
//! Where another formulation may be taken, the first coarse run propagates the error of its steps, by which a judge ends the search
//! ([`SearchLimits`]).
//!
//! If stiffness stays constant, but the motion outside the modes of the mesh exceeds the tolerance, only a bound could
//! be reported. Such a run is made twice, too, and the difference of the two is reported instead.

use super::super::AnalysisError;
use super::super::chart::error::largest_error;
use super::super::statics::{OperatingPoint, operating_point};
use super::super::step_error;
use super::super::transient::{TransientOptions, TransientResult, Until, transient};
use super::excited_modes;
use super::remeshed::{chosen, meshed};
use crate::readout::expression::Expression;
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
/// The order of convergence until it is measured, and the highest accepted one. Stretching has 2; among coarse meshes
/// and near buckling the measured order is lower, or seems higher.
const ORDERS: (f64, f64) = (1.0, 2.0);

/// Limits of a search.
pub(super) struct SearchLimits<'j> {
    /// Meshes that are tried, at most.
    pub(super) passes: usize,
    /// Whether to go on after the first coarse run, whose steps have this error of the amplitude; none: it is not estimated.
    pub(super) judge: Option<&'j mut dyn FnMut(f64) -> bool>,
}

impl SearchLimits<'_> {
    /// Of the only search.
    pub(super) fn none() -> Self {
        Self { passes: MAX_PASSES, judge: None }
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
    let given = chosen(moving) || moving.options.band.is_some();
    let on = |segments: &[usize], error: Option<f64>| {
        let estimated_error = order.estimated_error.zip(error).map(|(own, error)| own.max(error));
        Some(Mesh { segments: segments.to_vec(), estimated_error, ..order.clone() })
    };
    let SearchLimits { passes, judge } = limits;
    let first = pair(moving, &order.segments)
        .and_then(|(from, to)| Some((run_on(moving, options, &from, judge.is_some())?, from, to)));
    // a failure is reported when the run is made; a result without a comparison has no estimate
    let Some(((mut coarse, steps), mut from, mut segments)) = first else { return Ok(on(&order.segments, None)) };
    if let Some((error, goes_on)) = steps.zip(judge)
        && !goes_on(error)
    {
        return Ok(None);
    }
    let (mut before, mut convergence) = (None, ORDERS.0);
    let mut last = on(&order.segments, None);
    for _ in 0..passes {
        let both = sample_run(moving, options, &segments)
            .and_then(|fine| Some((apart(moving, options, &coarse, &fine)?, fine)));
        let Some((difference, fine)) = both else { return Ok(last) };
        if let Some(before) = before {
            convergence = f64::log2(before / difference).clamp(ORDERS.0, ORDERS.1);
        }
        let error = difference / (convergence.exp2() - 1.0);
        let of_coarse = difference + error;
        if from == order.segments && (given || of_coarse <= goal) {
            return Ok(on(&from, Some(of_coarse)));
        }
        if segments == order.segments && error <= goal {
            return Ok(on(&segments, Some(error)));
        }
        let next = twice(moving, &segments).filter(|next| next.iter().sum::<usize>() <= MAX_SEGMENTS);
        if error <= goal || next.is_none() {
            let least = between(&order.segments, &segments, (error / (AIM * goal)).powf(1.0 / convergence));
            let of_least = (least != segments).then(|| sample_run(moving, options, &least)).flatten();
            let of_least = of_least.and_then(|run| apart(moving, options, &run, &fine)).map(|apart| apart + error);
            return Ok(match of_least.filter(|error| *error <= goal) {
                Some(error) => on(&least, Some(error)),
                None => on(&segments, Some(error)),
            });
        }
        last = on(&segments, Some(error));
        (before, coarse, from) = (Some(difference), fine, segments);
        segments = next.unwrap_or_default();
    }
    Ok(last)
}

/// True where the run goes from rest to a state in which parts touch, on a mesh that is to be found.
pub(super) fn ends_in_contact(moving: &CompiledModel, options: &TransientOptions<'_>) -> bool {
    let system = &moving.parts.system;
    let free = !chosen(moving) && moving.options.band.is_none();
    let asked = free && options.release.is_none() && !options.signals.is_empty();
    let touches = |point: OperatingPoint| (0..system.members.len()).any(|g| system.touches(g, &point.q));
    asked && system.can_touch() && operating_point(moving, &options.voltages).is_ok_and(touches)
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
    let difference = apart(moving, options, &sample_run(moving, options, &from)?, &sample_run(moving, options, &to)?)?;
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
    Ok(excited_modes::reach(&model, &off) > STRAIGHT * excited_modes::reach(&model, &way))
}

/// The samples of a run on a mesh, as far as it came; none where it failed.
fn sample_run(moving: &CompiledModel, options: &TransientOptions<'_>, segments: &[usize]) -> Option<Vec<Vec<f64>>> {
    run_on(moving, options, segments, false).map(|(samples, _)| samples)
}

/// The same, with the error of its steps of the amplitude where `judged`.
fn run_on(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    segments: &[usize],
    judged: bool,
) -> Option<(Vec<Vec<f64>>, Option<f64>)> {
    let model = meshed(moving, segments).ok()?;
    let start = options.release.map(|start| meshed(start, segments)).transpose().ok()?;
    let loose = options.for_mesh(moving.options.errors().mesh_run(), points(options), start.as_deref());
    let mut columns = vec![Vec::new(); options.signals.len()];
    let mut keep = |_: f64, values: &[f64]| {
        bimorph_base::budget::lay_out(size_of_val(values));
        columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
    };
    let (mut steps, unknowns) = (0.0, model.unknowns() as f64);
    let mut few = |_: f64| {
        steps += 1.0;
        steps * unknowns <= MAX_WORK
    };
    let loose = if judged { loose.with_estimate() } else { loose };
    let error = match transient(&model, &loose, &mut keep, &mut few) {
        Ok(run) => run.step_error,
        Err(AnalysisError::Cancelled) => None,
        Err(_) => return None,
    };
    columns.first().is_some_and(|column| column.len() >= MIN_SAMPLES).then_some((columns, error))
}

fn points(options: &TransientOptions<'_>) -> usize {
    // one that ends at an event may be over soon
    match options.until {
        Some(_) => options.points.max(SOONER * POINTS.1),
        None => options.points.clamp(POINTS.0, POINTS.1),
    }
}

/// How far two runs are apart, of the amplitude.
fn apart(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    coarse: &[Vec<f64>],
    fine: &[Vec<f64>],
) -> Option<f64> {
    let both = coarse.first()?.len().min(fine.first()?.len());
    let named = |columns: &[Vec<f64>]| {
        let signal = |(name, column): (&String, &Vec<f64>)| {
            let unit = Expression::of_run(moving, name, &[]).ok()?.unit().to_owned();
            Some((name.clone(), unit, column[..both].to_vec()))
        };
        let signals = options.signals.iter().zip(columns).map(signal).collect::<Option<_>>()?;
        Some(TransientResult { signals, ..TransientResult::default() })
    };
    let (coarse, fine) = (named(coarse)?, named(fine)?);
    let error = largest_error(&fine, &coarse, &|unit| step_error::least(unit, options, moving));
    // a run that ends at an event is whole
    let whole = options.until.is_some();
    let share = if whole { 1.0 } else { (both - 1) as f64 / (points(options) - 1) as f64 };
    Some(error / share.min(1.0))
}
