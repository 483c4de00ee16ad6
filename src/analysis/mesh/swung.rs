//! The mesh for a transient that swings far: where stiffness changes on the way, the states at its ends and the modes about them do not tell
//! what becomes of it in between.
//!
//! A beam that a step of load throws to twice its rest is stiffer there than anywhere it rests, and one that heat carries through buckling is
//! softer. So such a run is made on its mesh and on one of half the segments, at ten times the tolerance of the steps, and the difference of
//! the two is measured as charts measure errors ([`relative_error_above`]). By Richardson's rule, with the order 2 of what stretches, a third of
//! it is the error of the finer one. Where that is beyond the tolerance segments are doubled; each time the order is measured (what bends
//! converges faster), until the tolerance holds, and the mesh is the coarsest on the way that is predicted to hold it.

use super::super::AnalysisError;
use super::super::chart::error::relative_error_above;
use super::super::integrator::Integrator;
use super::super::signal::Signal;
use super::super::statics::{OperatingPoint, operating_point};
use super::super::step_error;
use super::super::transient::{TransientOptions, TransientResult, transient};
use super::excited;
use super::meshed::{chosen, meshed};
use crate::compile::Compiled;
use crate::multibody::planar::Pose;
use crate::refine::doubling;
use crate::refine::model_order::ModelOrder;

/// Share of the way by which what a run would do with the stiffness of its end may differ from what it does, for its modes to tell its mesh.
const STRAIGHT: f64 = 0.03;
/// How much looser than the run its steps are here.
const LOOSER: f64 = 10.0;
/// Loosest tolerance of them.
const LOOSEST: f64 = 0.1;
/// Output times that are compared, at most.
const POINTS: usize = 1001;
/// Unknowns times steps of one run, at most.
const MOST_WORK: f64 = 3e6;
/// Output times that a run must have reached to say something.
const FEWEST: usize = 16;
/// Meshes that are tried, at most.
const MOST_PASSES: usize = 5;
/// Segments of all beams together, at most.
const MOST_SEGMENTS: usize = 4000;
/// Share of the tolerance that the estimate may use.
const SAFETY: f64 = 0.6;
/// The order of convergence as long as it is not measured, and the highest that is believed.
const ORDER: f64 = 2.0;
const FASTEST: f64 = 4.0;

/// The mesh for a run, from that for its ends and modes.
pub(super) fn order(
    moving: &Compiled,
    options: &TransientOptions<'_>,
    order: ModelOrder,
) -> Result<ModelOrder, AnalysisError> {
    let beams = !moving.structure.beams.is_empty() && order.segments.len() == moving.order.segments.len();
    let same = options.release.is_none_or(|start| start.order.segments.len() == order.segments.len());
    if !beams || !same || options.signals.is_empty() || options.points < FEWEST || !bends(moving, options, &order)? {
        return Ok(order);
    }
    let given = chosen(moving) || moving.options.band.is_some();
    let goal = SAFETY * moving.options.tol;
    let halves: Vec<usize> = order.segments.iter().map(|n| n.div_ceil(2)).collect();
    // of one segment a beam there is no half
    let first = if halves == order.segments { twice(moving, &order.segments) } else { Some(order.segments.clone()) };
    let coarse = swing(moving, options, &halves);
    let (Some(mut segments), Some(mut coarse)) = (first, coarse) else { return Ok(order) };
    let (mut before, mut convergence, mut last) = (None, ORDER, order.clone());
    for _ in 0..MOST_PASSES {
        let both =
            swing(moving, options, &segments).and_then(|fine| Some((apart(moving, options, &coarse, &fine)?, fine)));
        // what fails says so when it is run
        let Some((difference, fine)) = both else { return Ok(last) };
        if let Some(before) = before {
            convergence = f64::log2(before / difference).clamp(1.0, FASTEST);
        }
        let error = difference / (convergence.exp2() - 1.0);
        // on the way from half the segments to these it falls with the order
        let on = |segments: Vec<usize>, error: f64| ModelOrder {
            segments,
            estimated_error: order.estimated_error.map(|own| own.max(error)),
            ..order.clone()
        };
        let share = |from: &[usize]| segments.iter().sum::<usize>() as f64 / from.iter().sum::<usize>() as f64;
        let at_first = error * share(&order.segments).powf(convergence);
        if at_first <= goal || given && (before.is_some() || at_first <= 2.0 * goal) {
            return Ok(on(order.segments.clone(), at_first));
        }
        let next = twice(moving, &segments).filter(|next| next.iter().sum::<usize>() <= MOST_SEGMENTS);
        if error <= goal || next.is_none() {
            let fewer = (error / goal).powf(1.0 / convergence).clamp(0.5, 1.0);
            let least =
                segments.iter().zip(&order.segments).map(|(n, own)| ((*n as f64 * fewer).ceil() as usize).max(*own));
            return Ok(on(least.collect(), error * fewer.powf(-convergence)));
        }
        last = on(segments.clone(), error);
        (before, coarse) = (Some(difference), fine);
        segments = next.unwrap_or(segments);
    }
    Ok(last)
}

/// Twice the segments; none where they are too many.
fn twice(moving: &Compiled, segments: &[usize]) -> Option<Vec<usize>> {
    let order = ModelOrder { segments: segments.to_vec(), ..moving.order.clone() };
    doubling::twice(&moving.options, &order).map(|order| order.segments)
}

/// Whether stiffness changes on the way: what the run would do with the stiffness of its end is not what it does.
fn bends(moving: &Compiled, options: &TransientOptions<'_>, order: &ModelOrder) -> Result<bool, AnalysisError> {
    let model = meshed(moving, &order.segments)?;
    let rest = OperatingPoint::rest(&model, &options.voltages)?;
    let from = match options.release {
        Some(start) => operating_point(&*meshed(start, &order.segments)?, &options.voltages)?,
        None => rest,
    };
    // without an equilibrium to go to it goes far
    let Ok(to) = operating_point(&model, &options.voltages) else { return Ok(true) };
    let Some(straight) = excited::linear_way(&model, &from, &to) else { return Ok(true) };
    let way: Vec<Pose> = from.q.iter().zip(&to.q).map(|(a, b)| a - b).collect();
    let off: Vec<Pose> = way.iter().zip(&straight).map(|(a, b)| a - b).collect();
    Ok(excited::reach(&model, &off) > STRAIGHT * excited::reach(&model, &way))
}

/// The samples of a run on a mesh, as far as it came; none where it failed.
fn swing(moving: &Compiled, options: &TransientOptions<'_>, segments: &[usize]) -> Option<Vec<Vec<f64>>> {
    let model = meshed(moving, segments).ok()?;
    let start = options.release.map(|start| meshed(start, segments)).transpose().ok()?;
    let loose = TransientOptions {
        tol: (LOOSER * options.tol).min(LOOSEST).max(options.tol),
        points: options.points.min(POINTS),
        release: start.as_deref(),
        method: Integrator::default(),
        step: None,
        events: Vec::new(),
        keep: false,
        ..options.clone()
    };
    let mut columns = vec![Vec::new(); options.signals.len()];
    let mut keep = |_: f64, values: &[f64]| {
        crate::budget::lay_out(size_of_val(values));
        columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
    };
    let (mut steps, unknowns) = (0.0, model.unknowns() as f64);
    let mut few = |_: f64| {
        steps += 1.0;
        steps * unknowns <= MOST_WORK
    };
    match transient(&model, &loose, &mut keep, &mut few) {
        Ok(_) | Err(AnalysisError::Cancelled) => {}
        Err(_) => return None,
    }
    columns.first().is_some_and(|column| column.len() >= FEWEST).then_some(columns)
}

/// How far two runs are apart, of the amplitude.
fn apart(moving: &Compiled, options: &TransientOptions<'_>, coarse: &[Vec<f64>], fine: &[Vec<f64>]) -> Option<f64> {
    let both = coarse.first()?.len().min(fine.first()?.len());
    let named = |columns: &[Vec<f64>]| {
        let signal = |(name, column): (&String, &Vec<f64>)| {
            let unit = Signal::find(moving, name).ok()?.unit().to_owned();
            Some((name.clone(), unit, column[..both].to_vec()))
        };
        let signals = options.signals.iter().zip(columns).map(signal).collect::<Option<_>>()?;
        Some(TransientResult { signals, ..TransientResult::default() })
    };
    let (coarse, fine) = (named(coarse)?, named(fine)?);
    let error = relative_error_above(&fine, &coarse, &|unit| step_error::least(unit, options, moving));
    let share = (both - 1) as f64 / (options.points.min(POINTS) - 1) as f64;
    Some(error / share.min(1.0))
}
