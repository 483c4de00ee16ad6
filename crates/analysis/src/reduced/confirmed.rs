//! A training that runs share, confirmed by one of them.
//!
//! Runs that share a training have no companions. So one of them, at the largest drive, is made alone with its companions, and once more in the
//! shared directions. Where the two differ by more than a part of the tolerance, all runs take the directions of the first, or the
//! full model with it.

use super::super::chart::error::largest_error;
use super::super::step_error::with_step_error;
use super::super::transient::error_log::least;
use super::super::transient::{TransientOptions, transient};
use super::super::{AnalysisError, ProgressCallback};
use super::shared::TrainedMotion;
use super::train_motion;
use bimorph_model::compile::CompiledModel;
use std::sync::Arc;

/// Output times of the two runs.
const POINTS: usize = 101;

/// The training for runs of a model of which `options` are those at the largest drive.
///
/// # Errors
/// Those of [`train_motion`], and [`AnalysisError::Cancelled`].
pub fn train_confirmed(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    watch: ProgressCallback<'_>,
) -> Result<Arc<TrainedMotion>, AnalysisError> {
    let trained = Arc::new(train_motion(compiled, options)?);
    if trained.is_err() || options.signals.is_empty() {
        return Ok(trained);
    }
    let options = &options.with_points(POINTS);
    let mut run = |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: ProgressCallback<'_>| {
        Ok((transient(compiled, options, sample, watch)?, ()))
    };
    let known = match with_step_error(options, compiled, &mut run, &mut |_, _| (), watch) {
        Ok((known, ())) => known,
        Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
        // the runs say what is wrong
        Err(_) => return Ok(trained),
    };
    let shared = options.with_reduction(Arc::clone(&trained));
    let error = match transient(compiled, &shared, &mut |_, _| (), watch) {
        Ok(found) => largest_error(&known, &found, &|unit| least(unit, options, compiled)),
        Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
        Err(_) => f64::INFINITY,
    };
    if error <= compiled.options.errors().reduced_statics() {
        return Ok(trained);
    }
    let found = match known.directions {
        None => Err("so does the run at the largest values of the ports".to_owned()),
        directions => train_motion(compiled, &options.with_directions(directions))?,
    };
    Ok(Arc::new(found))
}
