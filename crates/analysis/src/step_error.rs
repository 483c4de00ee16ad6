//! Error of the steps of a run in time, and a run within the tolerance.
//!
//! Control of each step bounds what a step adds, not what becomes of it: phases add up, and parts that swing far exchange energy. So a run
//! carries the error of its motion along (`bimorph_solve::time::defect`), and reports the root mean square error of the worst signal, of its
//! amplitude. A run whose error is beyond what the mesh leaves of the tolerance is made again at
//! ```text
//! t₂ = t₁·min(max((0.7·room/e₁)^(1/q), r), 0.7)
//! ```
//! with q = 0.6 at first, and then as the two runs before say, within 0.35 and 1: ever higher modes carry the error, so it falls by less
//! than in proportion to the tolerance. An error above 0.1 is that of steps that do not resolve a motion. It falls faster than any power once they do, and r is
//! 0.1 there, else 0.01. There are five runs at most, none of which takes more than some seconds; the samples of a run that
//! does are sent as they come, and it is not made again.
//!
//! A propagated error may grow where that of the motion does not: the Jacobian of a step is that at its start. Where it says that nothing is predictable,
//! the run is compared as those without it, and is predictable if the comparison says so.
//!
//! Nor does a propagated error see what steps take from a motion that turns fast ones with it. Where half of the energy that they took, of what
//! moves, is beyond what the mesh leaves of the tolerance, the run is compared as well, and the larger of both errors is its error. The run before it is its
//! companion if there is one. The part of the energy that matters to the signals is taken to be that of the companion, so that the error is at most
//! ```text
//! d₁·min(D/min(d₂, 1), 1)
//! ```
//! with D the difference of both, and d₁ and d₂ half of what the steps of the run and of its companion took.
//!
//! Runs without such an estimate are compared with a companion run (`companion.rs`). These are other methods, equal
//! steps, rotating frames, and models whose parts may touch, where the error is propagated up to the first contact
//! only. A run whose parts touched is compared with one on twice the segments, too (`finer_mesh.rs`). The companion of a run in a reduced model also lacks directions that the run has (`reduced::directions`).

mod companion;
mod finer_mesh;
mod run;
mod samples;

use super::integrator::Integrator;
pub(super) use super::transient::error_log::least;
use super::transient::{TransientOptions, TransientResult, transient};
use super::{AnalysisError, ProgressCallback};
use crate::formulation;
use crate::reduced::Directions;
use bimorph_base::ErrorBudget;
use bimorph_model::compile::CompiledModel;
use bimorph_model::options::Formulation;
use companion::{EstimatedRun, LooserRun, companion, compared, is_made_again, picked_of, with_companion};
pub use run::RunFunction;
use run::{AT_THE_END, MAX_AGAIN};
pub use run::{beyond, unknown};
pub(crate) use samples::BufferedSamples;
use samples::{SelectedSamples, resolved};
use std::cell::Cell;

/// The exponent with which an error is supposed to fall with the tolerance, and the range in which two runs teach another.
const EXPONENT: f64 = 0.6;
const EXPONENTS: (f64, f64) = (0.35, 1.0);
/// The exponent with which the number of steps grows as the tolerance falls, and the steps of a companion run, of those of its run.
const STEPS: f64 = 0.25;
const COMPANION_STEPS: f64 = 0.56;
/// Least and largest ratio of the tolerances of two runs.
const RATIOS: (f64, f64) = (0.01, 0.7);
/// Error from which on steps do not resolve a motion (1), and the least ratio of the tolerances of such a run and the next one: there errors fall much faster
/// than any power that runs which resolve it have.
const UNRESOLVED: f64 = 0.1;
const UNRESOLVED_RATIO: f64 = 0.1;
/// Runs at most.
const RUNS: usize = 5;
/// Error of two runs from which on a third is not made (1): nothing seems predictable.
const HOPELESS: f64 = 0.3;

/// Makes the run that `options` specify, with [`TransientResult::step_error`], a warning where that is beyond the
/// tolerance, and [`TransientResult::formulation_taken`]. `model` is what moves; `sample` receives the samples of the run that is reported, and `watch` the
/// progress of each run in turn.
///
/// # Errors
/// Errors of the run; a failed companion run only removes its contribution.
pub fn with_step_error<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError> {
    let (mut result, more, _) = held(options, model, run, sample, watch)?;
    result.damped = None;
    result.formulation_taken = formulation::taken(model, options).map(|taken| taken.to_string());
    Ok((result, more))
}

/// As above, with the tolerance that the steps of the run followed.
fn held<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T, f64), AnalysisError> {
    if !propagates(options, model) {
        let first = companion(options, model.unknowns(), run, watch)?;
        if model.options.formulation == Formulation::Reduced && !options.takes_full_model() {
            return reduced(options, model, first, run, sample, watch);
        }
        return compared(options, model, first, run, sample, watch);
    }
    let estimated = options.with_estimate();
    let made = first(&estimated, model, run, sample, watch)?;
    let mut made = sharper(made, &estimated, model, run, watch)?;
    let found = made.result.step_error.unwrap_or(0.0);
    let room = options.errors().left_for_steps(made.result.estimated_error);
    let damped = made.result.damped.filter(|damped| *damped > room.max(found));
    let compared_run = match damped {
        Some(_) if !made.long => {
            let options = options.with_tolerance(made.steps.requested());
            Some(with_companion(&options, model, (&made.result, made.picked, made.before), run, watch)?)
        }
        _ => None,
    };
    // samples that have been sent cannot be compared
    let apart = compared_run.as_ref().map_or(damped, |compared| compared.error);
    if found > HOPELESS && !made.long {
        let mut kept = BufferedSamples::default();
        let companion = companion(options, model.unknowns(), run, watch)?;
        let again = compared(options, model, companion, run, &mut |t, values| kept.keep(t, values), watch)?;
        if again.0.step_error.is_some_and(|error| error <= HOPELESS) {
            kept.send(sample);
            return Ok(again);
        }
    } else if let Some(compared) = compared_run.filter(|c| c.is_made_again && c.error.is_some_and(|error| error > room))
    {
        let SampledRun { mut result, more, kept, steps, .. } = made;
        result.step_error = compared.error;
        let made = EstimatedRun { result, more, picked: compared.picked };
        return companion::sharper(options, model, (made, kept, steps), run, sample, watch);
    }
    made.result.step_error = made.result.step_error.map(|error| error.max(apart.unwrap_or(0.0)));
    made.kept.send(sample);
    let SampledRun { mut result, more, steps, .. } = made;
    result.warnings.extend(match result.step_error {
        Some(error) => beyond(options, error, AT_THE_END),
        None => (!options.signals.is_empty()).then(|| unknown(options)),
    });
    Ok((result, more, steps.requested()))
}

/// A run in a reduced model, compared as others; one of the full model where further directions leave an error beyond the tolerance.
fn reduced<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    first: (Option<TransientResult>, bool),
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T, f64), AnalysisError> {
    let full = |why: String| options.with_directions(Some(Directions::Full(why)));
    if first.0.is_none() && !options.signals.is_empty() && options.errors().has_companion() {
        return held(&full("it fails at a looser tolerance".to_owned()), model, run, sample, watch);
    }
    if !is_made_again(options, model, &first) {
        return compared(options, model, first, run, sample, watch);
    }
    let mut kept = BufferedSamples::default();
    let made = compared(options, model, first, run, &mut |t, values| kept.keep(t, values), watch);
    let why = match &made {
        Err(error) if !matches!(error, AnalysisError::Cancelled | AnalysisError::BadRequest { .. }) => {
            error.to_string()
        }
        Ok((result, ..))
            if result.directions.is_some() && !result.step_error.is_some_and(|e| options.errors().holds(e)) =>
        {
            match &result.directions {
                Some(Directions::Full(why)) => why.clone(),
                _ => "its error stays beyond the tolerance with more directions".to_owned(),
            }
        }
        _ => {
            kept.send(sample);
            return made;
        }
    };
    held(&full(why), model, run, sample, watch)
}

/// Whether a run of this model propagates its error.
fn propagates(options: &TransientOptions<'_>, model: &CompiledModel) -> bool {
    let system = &model.parts.system;
    formulation::of_run(model, options).1 == Integrator::Rodas4
        && (model.options.formulation != Formulation::Reduced || options.takes_full_model())
        && options.step.is_none()
        && options.points >= 2
        && !options.signals.is_empty()
        && !system.turns()
        && (0..system.members.len()).all(|member| system.touching(member).is_none())
}

/// A run with its samples and the tolerance of its steps.
struct SampledRun<T> {
    result: TransientResult,
    more: T,
    kept: BufferedSamples,
    /// The samples that are compared.
    picked: SelectedSamples,
    steps: ErrorBudget,
    /// Its samples have been sent.
    long: bool,
    /// The run that it follows.
    before: Option<LooserRun>,
}

/// The first run. Its samples are kept, since it may be made again, until it takes more than some seconds.
///
/// # Errors
/// Those of the run.
fn first<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<SampledRun<T>, AnalysisError> {
    let unknowns = model.unknowns() as f64;
    let long = Cell::new(!options.samples_are_kept());
    let (mut kept, mut picked) = (BufferedSamples::default(), SelectedSamples::new(options));
    let mut keep = |t: f64, values: &[f64]| {
        picked.add(values);
        if long.get() {
            std::mem::take(&mut kept).send(sample);
            sample(t, values);
        } else {
            kept.keep(t, values);
        }
    };
    let mut steps = 0.0;
    let mut count = |fraction: f64| {
        steps += 1.0;
        long.set(long.get() || steps * unknowns > MAX_AGAIN);
        watch(fraction)
    };
    let (mut result, more) = run(options, &mut keep, &mut count)?;
    result.step_error = result.step_error.filter(|_| resolved(&picked, &result, options, model));
    Ok(SampledRun { result, more, kept, picked, steps: options.errors(), long: long.get(), before: None })
}

/// Runs at sharper tolerances until one is within what its mesh leaves of the tolerance of `options`.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
fn sharper<T>(
    mut made: SampledRun<T>,
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    run: RunFunction<'_, T>,
    watch: ProgressCallback<'_>,
) -> Result<SampledRun<T>, AnalysisError> {
    let room = options.errors().left_for_propagated(made.result.estimated_error);
    let unknowns = model.unknowns() as f64;
    let mut exponent = EXPONENT;
    for _ in 1..RUNS {
        let error = match made.result.step_error {
            Some(error) if error > room && !made.long => error,
            _ => break,
        };
        let ratio = next_ratio(ErrorBudget::of(room).aim(error).powf(1.0 / exponent), error);
        // the length of a step goes with the fourth root of its tolerance
        if made.result.counters.steps as f64 * ratio.powf(-STEPS) * unknowns > MAX_AGAIN {
            break;
        }
        let options = options.with_tolerance(made.steps.within(ratio));
        let (mut kept, mut picked) = (BufferedSamples::default(), SelectedSamples::new(&options));
        let mut keep = |t: f64, values: &[f64]| {
            picked.add(values);
            kept.keep(t, values);
        };
        let (mut result, more) = match run(&options, &mut keep, watch) {
            Ok(found) => found,
            Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
            Err(_) => break,
        };
        result.step_error = result.step_error.filter(|_| resolved(&picked, &result, &options, model));
        let errors = made.result.step_error.zip(result.step_error);
        let before = LooserRun { picked: picked_of(made.picked, &made.result), steps: made.steps };
        made = SampledRun { result, more, kept, picked, steps: options.errors(), long: false, before: Some(before) };
        if let Some((before, after)) = errors {
            exponent = ((before / after).ln() / -ratio.ln()).clamp(EXPONENTS.0, EXPONENTS.1);
            if before.min(after) > HOPELESS {
                break;
            }
        }
    }
    Ok(made)
}

/// Ratio of the tolerance of the next run to that of one with this error (1), from the one that would mend it.
fn next_ratio(mends: f64, error: f64) -> f64 {
    mends.clamp(if error > UNRESOLVED { UNRESOLVED_RATIO } else { RATIOS.0 }, RATIOS.1)
}

/// Work of the runs that a run at this tolerance is made of, from the work of a coarse one that chooses its mesh ([`ErrorBudget::mesh_run`]), the error of
/// its steps and their damping (1). Errors fall at best in proportion to the tolerance, so that it is a lower bound.
pub(super) fn predicted_work(coarse: f64, [error, damped]: [f64; 2], errors: ErrorBudget) -> f64 {
    let mut ratio = errors.of_mesh_run();
    let mut total = 0.0;
    for run in 1.. {
        let last = coarse * ratio.powf(-STEPS);
        total += last;
        let left = ratio * error;
        if errors.holds(left) || run == RUNS || last > MAX_AGAIN {
            // a run before this one is its companion
            let compared = run == 1 && ratio * damped > errors.requested().max(left);
            return total + if compared { last * COMPANION_STEPS } else { 0.0 };
        }
        ratio *= next_ratio(errors.aim(left), left);
    }
    total
}

/// The estimate alone, for one of several runs that are alike, at `points` output times; and the tolerance that their steps have to follow
/// for it. None where nothing was compared.
pub fn step_error(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    watch: ProgressCallback<'_>,
) -> (Option<f64>, f64) {
    let mut run = |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: ProgressCallback<'_>| {
        Ok((transient(model, options, sample, watch)?, ()))
    };
    let found = held(options, model, &mut run, &mut |_, _| (), watch);
    // the others need somewhat coarser or sharper steps: whole tenths
    let tenths = |tol: f64| {
        let mut held = options.errors().requested();
        while held > tol {
            held = ErrorBudget::of(held).sharper_run();
        }
        held
    };
    found.map_or((None, options.errors().requested()), |(result, (), tol)| (result.step_error, tenths(tol)))
}
