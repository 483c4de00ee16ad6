//! Runs in time in the formulation that `auto` takes, and in the other one where this fails.
//!
//! Joint coordinates were not requested where `auto` takes them. So a run of the bodies, on their own mesh, replaces one there that
//! fails or whose steps collapse. Samples are kept until a run in joint coordinates has ended, so that each is
//! sent once. A run with more samples than are kept is that of the bodies from the start.
//!
//! Where `auto` takes the bodies and their steps or their mesh fail ([`gives_way`]), a run in joint coordinates replaces theirs, under the same conditions.
//! Samples of the bodies are sent as they come. So a run that has sent some is not replaced: it has taken more than some seconds.
//!
//! Steps have collapsed where `SLOW` of them in a row cover so little that the whole run would take more than [`MAX_STEPS`] at that pace,
//! beyond which explicit steps are refused, too. The growth from a short first step is faster: five times a step.

use super::formulation::{self, ChosenFormulation, Formulation};
use super::joint_transient::MAX_STEPS;
use super::mesh::{fitted_in_joints, fitted_in_time};
use super::step_error::BufferedSamples;
use super::transient::{TransientOptions, TransientResult};
use super::{AnalysisError, ProgressCallback};
use bimorph_model::compile::CompiledModel;
use std::collections::VecDeque;

/// Steps in a row by which the pace of a run is judged.
const SLOW: usize = 100;

/// Models of a run on the mesh for it.
#[derive(Debug, Clone)]
pub struct FittedRun {
    /// The model that moves.
    pub moving: CompiledModel,
    /// The model that it is released from; none: it starts at rest as drawn.
    pub start: Option<CompiledModel>,
    /// Whether a failure may be followed by a run in the other formulation.
    pub is_tentative: bool,
}

/// Makes a run of what is given to it; calls back with each sample and with progress.
pub type Attempt<'r, T> = &'r mut dyn FnMut(
    FittedRun,
    &mut dyn FnMut(f64, &[f64]),
    ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError>;

/// Fits `drawn` to the run that `options` specify, and makes it by `attempt` in the formulation that `auto` takes: at most twice, and the
/// second time in the other one. `sample` receives the samples of the run whose result is returned.
///
/// # Errors
/// Those of the mesh and of the run; where both runs fail, those of the bodies.
pub fn run_as_chosen<T>(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
    attempt: Attempt<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError> {
    let fit = |drawn: &CompiledModel, is_tentative| {
        let (moving, start) = fitted_in_time(drawn, options)?;
        Ok::<_, AnalysisError>(FittedRun { moving, start, is_tentative })
    };
    let run = match fit(drawn, false) {
        Ok(run) => run,
        Err(error) => return instead_of_bodies(drawn, options, error, attempt, sample, watch),
    };
    let taken = formulation::taken(&run.moving, options);
    let Some(taken) = taken.filter(|taken| taken.formulation != Formulation::Compliant) else {
        return of_bodies(drawn, options, run, attempt, sample, watch);
    };
    let why = if options.samples_are_kept() {
        match in_joints(run, attempt, sample, watch)? {
            Ok(done) => return Ok(done),
            Err(why) => why,
        }
    } else {
        "more samples than are kept until its end".to_owned()
    };
    let run = fit(&drawn.clone().for_given_steps(), false)?;
    let (mut result, more) = attempt(run, sample, watch)?;
    result.formulation_taken = Some(instead_of(&taken, &why).to_string());
    Ok((result, more))
}

/// A run in joint coordinates that `auto` took, which sends its samples at its end; the reason where it was given up.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
fn in_joints<T>(
    run: FittedRun,
    attempt: Attempt<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<Result<(TransientResult, T), String>, AnalysisError> {
    let mut kept = BufferedSamples::default();
    let mut pace = Pace::default();
    let mut watched = |fraction: f64| pace.goes_on(fraction) && watch(fraction);
    let run = FittedRun { is_tentative: true, ..run };
    match attempt(run, &mut |t, values| kept.keep(t, values), &mut watched) {
        Ok(done) => {
            kept.send(sample);
            Ok(Ok(done))
        }
        Err(error) => pace.why(error).map(Err),
    }
}

/// A run of the bodies, or one in joint coordinates where `auto` may take them and the steps of the bodies fail before they have sent a sample.
///
/// # Errors
/// Those of the bodies.
fn of_bodies<T>(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
    run: FittedRun,
    attempt: Attempt<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError> {
    if !(formulation::may_take_joints(drawn, options) && options.samples_are_kept()) {
        return attempt(run, sample, watch);
    }
    let mut sent = false;
    let mut send = |t: f64, values: &[f64]| {
        sent = true;
        sample(t, values);
    };
    match attempt(FittedRun { is_tentative: true, ..run }, &mut send, watch) {
        Err(error) if !sent => instead_of_bodies(drawn, options, error, attempt, sample, watch),
        ended => ended,
    }
}

/// The run in joint coordinates after one of the bodies that ended with `error`, where that may be an error of the bodies alone.
///
/// # Errors
/// `error` where the run fails, too, and [`AnalysisError::Cancelled`].
fn instead_of_bodies<T>(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
    error: AnalysisError,
    attempt: Attempt<'_, T>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, T), AnalysisError> {
    if !gives_way(&error) || !options.samples_are_kept() {
        return Err(error);
    }
    let Ok(Some((moving, start))) = fitted_in_joints(drawn, options) else { return Err(error) };
    match in_joints(FittedRun { moving, start, is_tentative: true }, attempt, sample, watch)? {
        Ok((mut result, more)) => {
            let why = format!("a run of the bodies was given up ({error})");
            let taken = ChosenFormulation { formulation: Formulation::Rcr, why };
            result.formulation_taken = Some(taken.to_string());
            Ok((result, more))
        }
        Err(_) => Err(error),
    }
}

/// Whether a failure of a run of the bodies may be one of their coordinates or of their mesh, which joint coordinates cut otherwise. Input and the ranges of
/// laws are the same in every formulation.
pub fn gives_way(error: &AnalysisError) -> bool {
    matches!(
        error,
        AnalysisError::StepFailed { .. } | AnalysisError::NoEquilibrium { .. } | AnalysisError::NotConverged { .. }
    )
}

/// Makes a run of a model on its mesh alone, without samples, and gives up where steps collapse in joint coordinates that `auto` took.
/// None where the run of the bodies is to be made instead.
///
/// # Errors
/// Those of the run where it is of no such formulation.
pub fn tentative<R>(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    watch: ProgressCallback<'_>,
    run: &mut dyn FnMut(ProgressCallback<'_>) -> Result<R, AnalysisError>,
) -> Result<Option<R>, AnalysisError> {
    match formulation::taken(moving, options) {
        Some(taken) if taken.formulation != Formulation::Compliant => {
            let mut pace = Pace::default();
            match run(&mut |fraction| pace.goes_on(fraction) && watch(fraction)) {
                Ok(done) => Ok(Some(done)),
                Err(error) => pace.why(error).map(|_| None),
            }
        }
        _ => run(watch).map(Some),
    }
}

/// The bodies' run after one in joint coordinates.
fn instead_of(taken: &ChosenFormulation, why: &str) -> ChosenFormulation {
    let why = format!("a run in joint coordinates was given up ({why}), which were taken as {}", taken.why);
    ChosenFormulation { formulation: Formulation::Compliant, why }
}

/// The pace of a run, of which several may follow each other.
#[derive(Debug, Default)]
struct Pace {
    /// Parts of the run that were done after each of the last steps (1).
    done: VecDeque<f64>,
    /// It was given up.
    collapsed: bool,
}

impl Pace {
    /// After a step to this part of the run (1), or one of a companion run (0): false where steps have collapsed.
    fn goes_on(&mut self, fraction: f64) -> bool {
        if fraction == 0.0 {
            self.done.clear();
            return !self.collapsed;
        }
        if self.done.back().is_some_and(|last| fraction < *last) {
            // the next run
            self.done.clear();
        }
        if self.done.len() > SLOW {
            self.done.pop_front();
        }
        self.done.push_back(fraction);
        if let Some(first) = self.done.front().filter(|_| self.done.len() > SLOW) {
            self.collapsed = (fraction - first) * MAX_STEPS < SLOW as f64;
        }
        !self.collapsed
    }

    /// Why a run that ended with this error was given up, in words.
    ///
    /// # Errors
    /// [`AnalysisError::Cancelled`] where the caller cancelled it.
    fn why(&self, error: AnalysisError) -> Result<String, AnalysisError> {
        match error {
            _ if self.collapsed => Ok(format!("its steps fell below {:e} of the run", 1.0 / MAX_STEPS)),
            AnalysisError::Cancelled => Err(error),
            error => Ok(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps that grow from the shortest first one, 10⁷ equal ones, and those of a companion go on; 100 steps of 10⁻⁸ of the run do not, in a second run either.
    #[test]
    fn steps_that_collapse_end_a_run() {
        let mut pace = Pace::default();
        let mut step = 1e-30;
        let mut at = 0.0;
        while at + step < 0.1 {
            at += step;
            assert!(pace.goes_on(at), "{at:e}");
            step = f64::min(5.0 * step, 1e-7 * 1.01);
        }
        assert!((0..1000).all(|_| pace.goes_on(0.0)));
        for run in 0..2 {
            let goes_on = (1..=SLOW + 1).map(|k| pace.goes_on(1e-8 * k as f64)).take_while(|on| *on).count();
            assert_eq!(goes_on, SLOW, "run {run}");
            assert_eq!(pace.why(AnalysisError::Cancelled), Ok("its steps fell below 5e-8 of the run".to_owned()));
            pace.collapsed = false;
        }
        assert_eq!(pace.why(AnalysisError::Cancelled), Err(AnalysisError::Cancelled));
    }
}
