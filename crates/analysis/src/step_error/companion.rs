//! A run compared with a companion at ten times the tolerance, or in steps of twice the length: of methods that do not propagate their
//! error, of equal steps, and of parts that touch.
//!
//! If the error were proportional to the tolerance, a ninth of the difference would be the error of the finer run.
//! Measured ratios of the two errors lie between 1 and 12, so that half of it is reported. For methods of second order,
//! whose ratios are about two, all of it is reported.
//!
//! Where the error exceeds the part of the tolerance that the mesh leaves, and the run is short, it is repeated at a
//! tenth of the tolerance, with the previous run as its companion. For a method of order four or more this costs less
//! than twice the steps.
//!
//! Runs that touch are compared up to the first contact, and in the time at which a gap first closes.
//!
//! A companion has a third to a half of the steps. One that would take long is given up after 3e6 unknowns times steps, and its difference
//! is continued in proportion to time, as phases go.

use super::super::after_contact::{CompanionRuns, MeshOrSteps, apart_in_time, first_closing, first_contact, judge};
use super::super::chart::error::largest_error;
use super::super::integrator::Integrator;
use super::super::transient::error_log::least;
use super::super::transient::{TransientOptions, TransientResult};
use super::super::{AnalysisError, ProgressCallback};
use super::finer_mesh::judge_mesh;
use super::run::{AT_THE_END, MAX_AGAIN, MAX_WORK, RunFunction, beyond, unknown};
use super::samples::{BufferedSamples, SelectedSamples, columns, resolved, spacing, stride};
use crate::formulation;
use crate::reduced::Directions;
use bimorph_base::ErrorBudget;
use bimorph_model::compile::CompiledModel;

/// Fraction of the difference that is reported.
const REPORTED_FRACTION: f64 = 0.5;
/// The same for methods of second order, and explicit ones, whose error falls little with the tolerance.
const SHARE_OF_SECOND: f64 = 1.0;
/// The same of a run in a reduced model, which has more directions than its companion: the next ones may matter as much.
const SHARE_OF_REDUCED: f64 = 1.0;
/// Times the steps of a run that one at a tenth of its tolerance takes, of the methods that are run again.
const MORE: f64 = 2.0;
/// Output times that a companion must reach, at least.
const MIN_SAMPLES: usize = 16;

/// Makes a run whose first one at a looser tolerance, its companion, came as far as this; returns the tolerance of its steps, too.
pub(super) fn compared<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (companion, whole): (Option<TransientResult>, bool),
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T, f64), AnalysisError> {
    let first = (companion, whole);
    if !is_made_again(options, model, &first) {
        let mut made = once(options, model, first, run, sample, watch)?;
        made.judge_mesh(options, model, watch)?;
        made.result.warnings.extend(made.result.step_error.and_then(|e| beyond(options, e, AT_THE_END)));
        return Ok((made.result, made.more, options.errors().requested()));
    }
    let mut kept = BufferedSamples::default();
    let made = once(options, model, first, run, &mut |t, values| kept.keep(t, values), watch)?;
    sharper(options, model, (made, kept, options.errors()), run, sample, watch)
}

/// Makes a compared run again at a tenth of its tolerance, with itself as the companion, until its error is within what the mesh leaves of the tolerance of
/// `options`; returns the tolerance of its steps, too.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
pub(super) fn sharper<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (mut made, mut kept, mut now): (EstimatedRun<T>, BufferedSamples, ErrorBudget),
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T, f64), AnalysisError> {
    let unknowns = model.unknowns() as f64;
    let room = options.errors().left_for_steps(made.result.estimated_error);
    while made.result.step_error.is_some_and(|error| error > room)
        && MORE * made.result.counters.steps as f64 * unknowns <= MAX_AGAIN
        && now.requested() > options.errors().sharpest_run()
        && !made.result.directions.as_ref().is_some_and(Directions::are_all)
    {
        let sharper = options.with_tolerance(now.sharper_run());
        let mut others = BufferedSamples::default();
        let companion = (Some(made.picked.clone()), true);
        match once(&sharper, model, companion, run, &mut |t, values| others.keep(t, values), watch) {
            Ok(found) if found.result.step_error.is_some() => (made, kept, now) = (found, others, sharper.errors()),
            Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
            _ => break,
        }
    }
    made.judge_mesh(options, model, watch)?;
    kept.send(sample);
    made.result.warnings.extend(made.result.step_error.and_then(|e| beyond(options, e, AT_THE_END)));
    Ok((made.result, made.more, now.requested()))
}

/// A run that has been made and propagates its error, with its companion: the one `before`, if that is looser enough, or one that is made.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
pub(super) fn with_companion<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (result, picked, before): (&TransientResult, SelectedSamples, Option<LooserRun>),
    run: RunFunction<'_, T>,
    watch: ProgressCallback<'_>,
) -> Result<ComparedRun, AnalysisError> {
    let (steps, first) = match before.filter(|before| options.errors().has_as_companion(before.steps)) {
        Some(before) => (before.steps, (Some(before.picked), true)),
        None => {
            let first = companion(&options.with_estimate(), model.unknowns(), run, watch)?;
            (ErrorBudget::of(options.errors().companion()), first)
        }
    };
    let resolved = options.step.is_some() || resolved(&picked, result, options, model);
    let picked = picked_of(picked, result);
    let damped = result.damped.zip(first.0.as_ref().and_then(|companion| companion.damped));
    let error = difference(options, model, (result, &picked), &first, resolved).map(|apart| {
        let reported = fraction(options, model, result, steps) * apart;
        damped.map_or(reported, |(own, of_companion)| reported.min(by_damping(own, of_companion, apart)))
    });
    Ok(ComparedRun { error, picked, is_made_again: is_made_again(options, model, &first) })
}

/// Change of the amplitude by the energy that the steps of a run took (1). The part of that energy that matters to the signals is taken to be that of the
/// companion, from which they are so far `apart`. No more than all of an amplitude is lost.
fn by_damping(own: f64, of_companion: f64, apart: f64) -> f64 {
    own * (apart / of_companion.min(1.0)).min(1.0)
}

/// Whether a run with this companion is made again where its error is too large: the samples of a long run are sent as they come.
pub(super) fn is_made_again(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (companion, whole): &(Option<TransientResult>, bool),
) -> bool {
    let steps = companion.as_ref().map_or(0, |c| c.counters.steps) as f64;
    *whole
        && options.step.is_none()
        && is_high(formulation::of_run(model, options).1)
        && MORE * MORE * steps * model.unknowns() as f64 <= MAX_AGAIN
        && options.samples_are_kept()
}

/// A run with its estimate, and what a sharper one is compared with.
pub(super) struct EstimatedRun<T> {
    pub(super) result: TransientResult,
    pub(super) more: T,
    pub(super) picked: TransientResult,
}

impl<T> EstimatedRun<T> {
    /// Compares the run after a contact with one on a finer mesh.
    fn judge_mesh(
        &mut self,
        options: &TransientOptions<'_>,
        model: &CompiledModel,
        watch: ProgressCallback<'_>,
    ) -> Result<(), AnalysisError> {
        let least = |unit: &str| least(unit, options, model);
        judge_mesh(options, model, (&mut self.result, &self.picked), &least, watch)
    }
}

/// A run at a looser tolerance that has been made.
pub(super) struct LooserRun {
    /// Its samples that are compared.
    pub(super) picked: TransientResult,
    /// The tolerance of its steps.
    pub(super) steps: ErrorBudget,
}

/// A comparison of a run that has been made.
pub(super) struct ComparedRun {
    /// The error by the companion (1); none where they cannot be compared.
    pub(super) error: Option<f64>,
    /// The samples of the run that are compared.
    pub(super) picked: TransientResult,
    /// Whether the run is short enough to be made again.
    pub(super) is_made_again: bool,
}

/// One run, compared with its companion, which may have come to its end.
fn once<T>(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (companion, whole): (Option<TransientResult>, bool),
    run: RunFunction<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<EstimatedRun<T>, AnalysisError> {
    let mut picked = SelectedSamples::new(options);
    let directions = companion.as_ref().and_then(|c| c.directions.clone());
    let options = &options.with_directions(directions.or(options.directions.clone()));
    let mut both = |t: f64, values: &[f64]| {
        picked.add(values);
        sample(t, values);
    };
    let (mut result, more) = run(options, &mut both, watch)?;
    // what both do not resolve they have in common
    let resolved = options.step.is_some() || resolved(&picked, &result, options, model);
    let picked = picked_of(picked, &result);
    let least = |unit: &str| least(unit, options, model);
    let contact = first_contact(&result);
    let companion = (companion, whole);
    match difference(options, model, (&result, &picked), &companion, resolved) {
        Some(apart) => {
            let looser = ErrorBudget::of(options.errors().companion());
            result.step_error = Some(fraction(options, model, &result, looser) * apart);
        }
        None => result.warnings.extend((!options.signals.is_empty()).then(|| unknown(options))),
    }
    let (companion, _) = companion;
    if contact.is_some() {
        let (run, companion) = (columns(&picked.signals), companion.as_ref().map(|run| columns(&run.signals)));
        let (spacing, companion) = (spacing(options), companion.as_deref());
        let pair = CompanionRuns { spacing, run: &run, companion, differs_in: MeshOrSteps::LooserSteps };
        judge(&pair, options, &least, &mut result);
    }
    Ok(EstimatedRun { result, more, picked })
}

/// The samples of a run that are compared, as a result.
pub(super) fn picked_of(picked: SelectedSamples, result: &TransientResult) -> TransientResult {
    TransientResult {
        signals: picked.signals(&result.signals),
        counters: result.counters,
        directions: result.directions.clone(),
        events: result.events.clone(),
        damped: result.damped,
        ..TransientResult::default()
    }
}

/// The difference of a run to its companion, which may have come to its end (1); none where they cannot be compared.
fn difference(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (result, picked): (&TransientResult, &TransientResult),
    (companion, whole): &(Option<TransientResult>, bool),
    resolved: bool,
) -> Option<f64> {
    let reached = companion.as_ref().map_or(0, sampled);
    // one that took the same steps proves nothing
    let other = |c: &&TransientResult| c.counters.steps != result.counters.steps;
    let companion = companion.as_ref().filter(|_| (*whole || reached >= MIN_SAMPLES) && resolved).filter(other)?;
    let contact = first_contact(result);
    // single values after a contact are judged on their own
    let last = contact.map_or(usize::MAX, |t| (t / spacing(options)) as usize + 1);
    let count = reached.min(sampled(picked)).min(last);
    let in_time = first_closing(result).zip(first_closing(companion)).map(|(run, other)| apart_in_time(run, other));
    // the start alone says nothing of the steps
    if count < 2 && in_time.is_none() {
        return None;
    }
    let apart = largest_error(&cut(picked, count), &cut(companion, count), &|unit| least(unit, options, model));
    let apart = apart.max(in_time.unwrap_or(0.0));
    let share = match options.until.is_some() || contact.is_some() {
        true => 1.0,
        false => ((reached - 1) * stride(options)) as f64 / (options.points - 1) as f64,
    };
    Some(apart / share.min(1.0))
}

/// Fraction of the difference to a companion whose steps follow `looser` that is reported. Of a companion that is hardly looser it is more than all, since
/// the error is at best in proportion to the tolerance.
fn fraction(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    result: &TransientResult,
    looser: ErrorBudget,
) -> f64 {
    if result.directions.is_some() {
        return SHARE_OF_REDUCED;
    }
    let (_, method) = formulation::of_run(model, options);
    let share = if is_high(method) { REPORTED_FRACTION } else { SHARE_OF_SECOND };
    match options.step {
        Some(_) => REPORTED_FRACTION,
        None => share.max(options.errors().of_difference_to(looser)),
    }
}

/// Number of samples of a run.
fn sampled(run: &TransientResult) -> usize {
    run.signals.first().map_or(0, |(_, _, column)| column.len())
}

/// The first samples of a run.
fn cut(run: &TransientResult, count: usize) -> TransientResult {
    let cut =
        |(name, unit, column): &(String, String, Vec<f64>)| (name.clone(), unit.clone(), column[..count].to_vec());
    TransientResult { signals: run.signals.iter().map(cut).collect(), ..TransientResult::default() }
}

/// Of a method whose error falls fast with the length of its steps.
fn is_high(method: Integrator) -> bool {
    matches!(method, Integrator::Rodas4 | Integrator::Radau5 | Integrator::Sdirk4)
}

/// The companion of a run as far as it came, none where it failed; and whether it came to the end.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
pub(super) fn companion<T>(
    options: &TransientOptions<'_>,
    unknowns: usize,
    run: RunFunction<'_, T>,
    watch: ProgressCallback<'_>,
) -> Result<(Option<TransientResult>, bool), AnalysisError> {
    let looser = options.step.is_some() || options.errors().has_companion();
    if options.signals.is_empty() || options.points < 2 || !looser {
        return Ok((None, false));
    }
    let looser = options.for_companion();
    let mut picked = SelectedSamples::new(options);
    let mut keep = |_: f64, values: &[f64]| picked.add(values);
    let (mut steps, mut stopped) = (0.0, false);
    let mut few = |_: f64| {
        steps += 1.0;
        stopped = !watch(0.0);
        !stopped && steps * unknowns as f64 <= MAX_WORK
    };
    let ended = run(&looser, &mut keep, &mut few);
    let counters = ended.as_ref().map_or_else(|_| Default::default(), |(result, _)| result.counters);
    let directions = ended.as_ref().ok().and_then(|(result, _)| result.directions.clone());
    let damped = ended.as_ref().ok().and_then(|(result, _)| result.damped);
    let events = ended.as_ref().map_or_else(|_| Vec::new(), |(result, _)| result.events.clone());
    if stopped {
        return Err(AnalysisError::Cancelled);
    }
    let whole = ended.is_ok();
    match ended {
        Ok(_) | Err(AnalysisError::Cancelled) => {
            let names: Vec<_> = options.signals.iter().map(|name| (name.clone(), String::new(), Vec::new())).collect();
            Ok((
                Some(TransientResult {
                    signals: picked.signals(&names),
                    counters,
                    directions,
                    events,
                    damped,
                    ..TransientResult::default()
                }),
                whole,
            ))
        }
        Err(_) => Ok((None, false)),
    }
}

#[cfg(test)]
mod tests {
    use super::by_damping;

    /// Energy counts by the part of it that mattered to the companion, which is at most all of it, also where the companion lost none.
    #[test]
    fn energy_counts_by_what_its_companion_lost() {
        assert_eq!(by_damping(0.1, 50.0, 0.02), 0.1 * 0.02);
        assert_eq!(by_damping(0.02, 0.5, 0.25), 0.02 * 0.5);
        assert_eq!([by_damping(0.02, 0.5, 0.7), by_damping(0.02, 0.0, 0.0), by_damping(0.02, 0.0, 0.1)], [0.02; 3]);
    }
}
