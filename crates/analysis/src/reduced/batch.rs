//! Runs of one reduced model under different voltages in lanes, each with the bytes of its run alone.
//!
//! Such runs share a training, begin at rest, and have steps by Rodas4 that follow the tolerance. Each is recorded as one alone is. A run that lanes
//! cannot have, or that leaves them, is made alone by the caller, which also says what is wrong.

use super::concluded;
use super::shared::{MotionReduction, TrainedMotion};
use crate::formulation;
use crate::integrator::Integrator;
use crate::transient::first_step;
use crate::transient::options::TransientOptions;
use crate::transient::record::{Recording, RunStart};
use crate::transient::result::TransientResult;
use bimorph_domains::Ramp;
use bimorph_model::compile::{CompiledModel, Formulation};
use bimorph_solve::baseline::SolverKind;
use bimorph_solve::time::adaptive::Advance;
use bimorph_solve::time::batch::LaneWork;
use bimorph_solve::time::method::Motion;
use bimorph_solve::time::reduced_batch::{self, ReducedEnd, ReducedRun};
use bimorph_solve::time::reduced_rodas4::lanes::LaneReducedRodas4;
use std::sync::Arc;

/// A run: the model with its options, which have a training.
pub type SharedRun<'a> = (&'a CompiledModel, TransientOptions<'a>);

/// Makes the runs that lanes can have, and gives their results; none for one that has to be made alone. `finished` is called after each run and returns
/// whether to continue; the remaining ones are none otherwise.
pub fn transients(
    runs: &[SharedRun<'_>],
    finished: &mut dyn FnMut() -> bool,
) -> (Vec<Option<TransientResult>>, LaneWork) {
    let mut results: Vec<Option<TransientResult>> = runs.iter().map(|_| None).collect();
    let mut work = LaneWork::default();
    let mut left: Vec<(usize, &Arc<TrainedMotion>)> =
        runs.iter().enumerate().filter_map(|(k, run)| Some((k, shared(run)?))).collect();
    let mut goes_on = true;
    while let Some((first, trained)) = left.first().filter(|_| goes_on).copied() {
        let like = |k: usize, other: &Arc<TrainedMotion>| {
            let (one, two) = (&runs[first].1, &runs[k].1);
            Arc::ptr_eq(trained, other) && one.stop == two.stop && one.errors() == two.errors()
        };
        let (group, others): (Vec<_>, Vec<_>) = left.into_iter().partition(|(k, other)| like(*k, other));
        left = others;
        // a run by itself has nothing to go along with
        if let (Ok(reduction), true) = (&**trained, group.len() > 1) {
            let group: Vec<(usize, &SharedRun<'_>)> = group.into_iter().map(|(k, _)| (k, &runs[k])).collect();
            let mut put = |k: usize, result| results[k] = result;
            let round = in_lanes(reduction, &group, &mut put, finished, &mut goes_on);
            work.together += round.together;
            work.accepted += round.accepted;
            work.rejected += round.rejected;
        }
    }
    (results, work)
}

/// The training of a run that lanes may have.
fn shared<'a>((compiled, options): &'a SharedRun<'_>) -> Option<&'a Arc<TrainedMotion>> {
    let plain = options.release.is_none()
        && options.shock.is_none()
        && options.motions.is_empty()
        && options.method == Integrator::Rodas4
        && options.step.is_none()
        && options.until.is_none()
        && options.solver == SolverKind::Recursion
        && !options.estimate;
    let reduced = || formulation::of_run(compiled, options).0.formulation == Formulation::Reduced;
    options.reduction.as_ref().filter(|_| plain && reduced())
}

/// Makes runs of one training in lanes; `put` receives the result of each.
fn in_lanes(
    reduction: &MotionReduction,
    runs: &[(usize, &SharedRun<'_>)],
    put: &mut dyn FnMut(usize, Option<TransientResult>),
    finished: &mut dyn FnMut() -> bool,
    goes_on: &mut bool,
) -> LaneWork {
    let Some((_, (compiled, options))) = runs.first() else { return LaneWork::default() };
    let system = &compiled.parts.system;
    let h = first_step(system, options.stop);
    let mut method = reduction.method(system, h);
    // all begin at rest
    method.start_at(&Motion::zeros(system.bodies()));
    let Some(mut lanes) = LaneReducedRodas4::new(&method, system) else { return LaneWork::default() };
    let starts: Vec<Option<RunStart>> =
        runs.iter().map(|(_, (model, options))| RunStart::of(model, options).ok()).collect();
    let ramps: Vec<Option<Ramp<'_>>> = starts
        .iter()
        .zip(runs)
        .map(|(start, (_, (model, options)))| start.as_ref()?.ramp(model, options).ok())
        .collect();
    let volts: Vec<Vec<f64>> = ramps
        .iter()
        .map(|ramp| {
            let mut drive = system.electrics.drive();
            ramp.iter().for_each(|ramp| ramp.at(0.0, &mut drive));
            drive.volts
        })
        .collect();
    let mut samples: Vec<fn(f64, &[f64])> = vec![|_, _| (); runs.len()];
    let parts = starts.iter().zip(&ramps).zip(&volts).zip(&mut samples);
    let mut recordings: Vec<Option<Recording<'_>>> = (runs.iter().zip(parts))
        .map(|((_, (model, options)), (((start, ramp), volts), sample))| {
            let (start, ramp) = (start.as_ref()?, ramp.as_ref()?);
            Recording::start((model, options), start, (ramp, volts), sample, &start.motion).ok()
        })
        .collect();
    let mut ends: Vec<Option<ReducedEnd>> = vec![None; runs.len()];
    let stop = std::cell::Cell::new(false);
    let work = {
        let mut observers: Vec<_> = recordings
            .iter_mut()
            .map(|recording| {
                recording.as_mut().map(|recording| |s: f64, h: f64, a: &_, b: &_| recording.step(s, h, a, b))
            })
            .collect();
        let mut queue = observers.iter_mut().enumerate();
        let mut next = || {
            loop {
                let (number, observe) = queue.next().filter(|_| !stop.get())?;
                let (Some(observe), Some(start), Some(ramp)) = (observe, &starts[number], &ramps[number]) else {
                    continue;
                };
                let (motion, method) = (start.motion.clone(), method.clone());
                let tol = runs[number].1.1.errors().step();
                return Some((number, ReducedRun { system, ramp, motion, h, tol, method, observe }));
            }
        };
        let mut done = |number: usize, end: Option<ReducedEnd>| {
            ends[number] = end;
            if end.is_some() && !finished() {
                stop.set(true);
            }
        };
        reduced_batch::advance(&mut lanes, &mut next, &mut done)
    };
    *goes_on = !stop.get();
    for (((number, (model, _)), recording), end) in runs.iter().zip(recordings).zip(ends) {
        let Some((recording, end)) = recording.zip(end) else { continue };
        let result = recording.finish(Advance::Done, end.work, None).ok();
        put(*number, result.map(|result| concluded(result, model, reduction, (end.error, end.excess))));
    }
    work
}
