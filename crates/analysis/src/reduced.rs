//! Statics and motion in a reduced model: training for what acts in the analysis, the run, and the estimate of its error.
//!
//! A reduced model is trained for the drives of one analysis: the loads, voltages and temperatures from rest to their values, and
//! beyond where motion overshoots. Where it would not pay (a tolerance of 1e-4 or below, more directions than a fifth of the
//! strains) or cannot be trained, the full model is taken, and a warning says why.

pub mod batch;
pub mod circuit;
pub mod confirmed;
mod directions;
pub mod ranges;
pub mod shared;

use super::integrator::{IntegrationRun, Integrator};
use super::statics::{OperatingPoint, operating_point, source_vector};
use super::transient::first_step;
use super::transient::options::TransientOptions;
use super::transient::record::{Propagator, record};
use super::transient::result::TransientResult;
use super::{AnalysisError, ProgressCallback};
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_model::compile::{CompiledModel, Formulation};
use bimorph_solve::baseline::SolverKind;
use bimorph_solve::equations::Bodies;
use bimorph_solve::path::{LoadPath, SourcePath};
use bimorph_solve::reduced::check::FullCheck;
use bimorph_solve::reduced::enrichment::MotionCorrections;
use bimorph_solve::reduced::polynomial::moving::of_motion;
use bimorph_solve::reduced::space::spanned;
use bimorph_solve::reduced::statics::ReducedStatics;
use bimorph_solve::reduced::taylor::DriveRay;
use bimorph_solve::reduced::{InputBox, ReductionError, Training, TrainingCase, TrainingOptions, train};
use bimorph_solve::time::adaptive::{Advance, Observer};
use bimorph_solve::time::defect::SeeError;
use bimorph_solve::time::method::{Motion, SolverCounters};
pub use directions::Directions;
use ranges::inputs_beside;
use shared::{MotionReduction, TrainedMotion};
use std::sync::Arc;

/// Code of the warnings about a reduced model.
pub const WARNING: &str = "W053";
/// Tolerance from which on a reduced model does not pay (1).
const FULL: f64 = 1e-4;
/// How far the motion of a mechanism that is released exceeds the statics of what it is released from, and how far it swings back (1).
const RELEASED: [f64; 2] = [-1.0, 1.0];
/// Moments of each input for motion.
const MOMENTS: usize = 2;
/// Smallest tolerance of a motion (1): with more moments and Taylor terms errors of 3e-3 remain on a stage of beams.
const FULL_IN_TIME: f64 = 5e-3;
/// Excess over the trained states up to which a motion counts as trained (1).
pub const TRAINED: f64 = 1.1;

/// Rejects a reduced model in an analysis that has none.
///
/// # Errors
/// [`AnalysisError::BadRequest`].
pub fn not_reduced(compiled: &CompiledModel, analysis: &str) -> Result<(), AnalysisError> {
    match compiled.options.formulation {
        Formulation::Reduced => Err(AnalysisError::BadRequest {
            what: "formulation reduced".into(),
            detail: format!(
                "{analysis} has no reduced model; static, tran and circuits have, others take formulation compliant"
            ),
        }),
        _ => Ok(()),
    }
}

/// The space for the drives of an analysis; or why the full model is taken.
fn trained(cases: &[(&System, InputBox)], tol: f64, moments: usize) -> Result<Training, String> {
    if tol <= FULL {
        return Err(format!("at a tolerance of {tol:e} the full model costs less than a reduced one"));
    }
    let reason = |error: ReductionError| error.to_string();
    let (moving, _) = cases.first().ok_or_else(|| reason(ReductionError::NoInput))?;
    let joints = spanned(moving).map_err(reason)?;
    let cases: Vec<TrainingCase<'_>> =
        cases.iter().map(|(system, inputs)| TrainingCase { system, inputs: inputs.clone(), motions: &[] }).collect();
    train(&joints, &cases, TrainingOptions { errors: ErrorBudget::of(tol), moments, beyond: false }).map_err(reason)
}

/// The warning of an analysis that takes the full model instead.
pub fn taken(why: &str) -> String {
    format!("formulation reduced took the full model: {why}")
}

/// A reduced equilibrium.
pub(crate) struct ReducedEquilibrium {
    /// The equilibrium, with the bodies where the reduced model places them.
    pub(crate) point: OperatingPoint,
    /// Directions.
    pub(crate) directions: usize,
    /// Estimated relative error by the reduction (1).
    pub(crate) error: f64,
}

/// The reduced equilibrium at the voltages of `point`, or why the full model's is taken.
pub(crate) fn equilibrium(compiled: &CompiledModel, point: &OperatingPoint) -> Result<ReducedEquilibrium, String> {
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    if !point.path.passed.is_empty() {
        return Err("the mechanism pulled in, snapped or buckled on the way to this equilibrium".into());
    }
    let rest = vec![0.0; point.sources.len()];
    let path = SourcePath::new(electrics, &rest, &point.sources, [0.0, 1.0]);
    let mut drive = electrics.drive();
    path.at(1.0, &mut drive);
    let inputs = InputBox::around(system, std::slice::from_ref(&drive), [0.0, 1.0]);
    let Training { space, .. } = trained(&[(system, inputs)], compiled.options.errors().requested(), 0)?;
    let mut statics = ReducedStatics::new(&space);
    let mut z = vec![0.0; space.size()];
    let found = statics.follow(&space, &path, &mut z);
    if found.reached < 1.0 {
        return Err(format!("the reduced branch ends at {:.4} of the load", found.reached));
    }
    let mut point = point.clone();
    point.q.clone_from(&statics.forces.placed.at);
    point.path.iterations = found.iterations;
    let error = FullCheck::new(system).of(system, &point.q, &drive, None).error;
    Ok(ReducedEquilibrium { point, directions: space.size(), error })
}

/// Trains for what acts in a run, unless that has directions from a run before. With the option `ranges` that is all within the ranges of ports; ports without a range keep what the run
/// gives them, and a value beyond its range widens this. Runs with the same ranges have the same coordinates.
///
/// # Errors
/// [`AnalysisError::BadRequest`] for ports that the model does not have, and those of the equilibrium that a run is released from.
pub fn train_motion(compiled: &CompiledModel, options: &TransientOptions<'_>) -> Result<TrainedMotion, AnalysisError> {
    // the tolerance of the model: runs that are compared with each other for their steps have one space
    let errors = compiled.options.errors();
    let tol = errors.requested();
    if tol < FULL_IN_TIME {
        return Ok(Err(format!(
            "at a tolerance of {tol:e} its error in time may be larger; --tol {FULL_IN_TIME:e} or more takes it"
        )));
    }
    if options.shock.is_some() {
        return Ok(Err("a shock is none of the inputs that it is trained for".to_owned()));
    }
    let cases = cases(compiled, options)?;
    let largest = cases.first().map(|(_, inputs)| inputs.drive(&vec![1.0; inputs.inputs.len()]));
    let found = match &options.directions {
        Some(Directions::Trained { training, polynomials }) => Ok((Arc::clone(training), *polynomials)),
        Some(Directions::Full(why)) => Err(why.clone()),
        None => trained(&cases, tol, MOMENTS).map(|training| (Arc::new(training), errors)),
    };
    let (training, polynomials) = match found {
        Ok(found) => found,
        Err(why) => return Ok(Err(why)),
    };
    let system = &compiled.parts.system;
    let fitted = largest.and_then(|drive| of_motion(&training, system, &drive, polynomials));
    let space = Arc::new(match &fitted {
        Some(fitted) => fitted.space.clone(),
        None => training.space.of_system(system),
    });
    Ok(Ok(MotionReduction { space, training, fitted, polynomials }))
}

/// The systems of a run with what acts on them: what moves first, then what it is released from.
fn cases<'a>(
    compiled: &'a CompiledModel,
    options: &TransientOptions<'a>,
) -> Result<Vec<(&'a System, InputBox)>, AnalysisError> {
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    let sources = source_vector(compiled, &options.voltages)?;
    let Some(start) = options.release else {
        return Ok(vec![(system, in_ranges(compiled, &sources))]);
    };
    let mut steady = electrics.drive();
    electrics.steady(&sources, &mut vec![0.0; electrics.heating.states()], &mut steady);
    let point = operating_point(start, &options.voltages)?;
    let begun = point.drive(start);
    let own = &start.parts.system;
    Ok(vec![(system, InputBox::around(system, &[steady], RELEASED)), (own, InputBox::around(own, &[begun], RELEASED))])
}

/// The box of a run from rest with these sources, whose ports may have ranges.
fn in_ranges(compiled: &CompiledModel, sources: &[f64]) -> InputBox {
    let system = &compiled.parts.system;
    let ports = &system.electrics.names[..system.electrics.ports];
    let given = compiled.options.ranges.as_ref();
    let mut ranged: Vec<(usize, [f64; 2])> = Vec::new();
    for (port, name) in ports.iter().enumerate() {
        if let Some([low, high]) = given.and_then(|ranges| ranges.of(name)) {
            ranged.push((port, [low.min(sources[port]), high.max(sources[port])]));
        }
    }
    let (ports, ranges): (Vec<usize>, Vec<[f64; 2]>) = ranged.into_iter().unzip();
    inputs_beside(system, sources, (&ports, &ranges))
}

/// A run of the full model, for given samples and progress.
pub type FullRun<'a> =
    dyn FnMut(&mut dyn FnMut(f64, &[f64]), ProgressCallback<'_>) -> Result<TransientResult, AnalysisError> + 'a;

/// Integrates the motion in a reduced model, as [`transient`](super::transient::transient) otherwise; with the full model and a warning
/// where that is taken.
///
/// # Errors
/// See [`AnalysisError`].
pub fn reduced_transient(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
    full: &mut FullRun<'_>,
) -> Result<TransientResult, AnalysisError> {
    if options.solver != SolverKind::Recursion || options.method != Integrator::Rodas4 {
        return Err(AnalysisError::BadRequest {
            what: "formulation reduced".into(),
            detail:
                "it has the recursion and the method rodas4 alone; leave out --solver and --method, or take compliant"
                    .into(),
        });
    }
    let shared = options.reduction.as_ref().filter(|_| options.directions.is_none());
    let trained = match shared {
        Some(trained) => Arc::clone(trained),
        None => Arc::new(train_motion(compiled, options)?),
    };
    let reduction = match &*trained {
        Ok(reduction) => reduction,
        Err(why) => {
            let mut result = full(sample, watch)?;
            result.warnings.push(coded(taken(why)));
            return Ok(result);
        }
    };
    let corrects = shared.is_none();
    let mut carrier =
        ReducedPropagator { compiled, options, reduction, corrects, corrections: None, error: None, excess: 0.0 };
    let result = record(compiled, options, &mut carrier, sample, watch)?;
    let ReducedPropagator { corrections, error, excess, .. } = carrier;
    let mut result = concluded(result, compiled, reduction, (error, excess));
    if let Some(corrections) = corrections {
        let MotionReduction { training, polynomials, .. } = reduction;
        let directions = Directions::Trained { training: Arc::clone(training), polynomials: *polynomials };
        result.directions = Some(directions.after(&compiled.parts.system, &corrections, compiled.options.errors()));
    }
    Ok(result)
}

/// The result of a reduced run with its estimated error by the reduction (1) and its excess over the trained states (1).
fn concluded(
    mut result: TransientResult,
    compiled: &CompiledModel,
    reduction: &MotionReduction,
    (error, excess): (Option<f64>, f64),
) -> TransientResult {
    result.unknowns = reduction.space.size();
    if let Some(error) = error {
        result.estimated_error = result.estimated_error.map(|mesh| mesh + error);
        let reported = beyond(error, compiled.options.errors().requested());
        result.warnings.extend(reported.map(|text| coded(format!("{text}; {REMEDY}"))));
    }
    result.warnings.extend(left(excess).map(coded));
    result
}

fn coded(message: String) -> String {
    format!("{WARNING}: {message}")
}

/// The remedy that an analysis names.
pub(crate) const REMEDY: &str = "take --formulation compliant, or a smaller --tol, which adds directions";

/// Warning about an error by the reduction above the tolerance.
pub fn beyond(error: f64, tol: f64) -> Option<String> {
    (error > tol).then(|| format!("estimated error of the reduced model {error:.1e}, more than the tolerance {tol:e}"))
}

/// Warning about a motion beyond what the model was trained for.
pub fn left(excess: f64) -> Option<String> {
    (excess > TRAINED).then(|| {
        format!(
            "the motion left the range of the reduced model: {excess:.2} times the largest trained amplitude; take --formulation compliant"
        )
    })
}

/// The drive of a system on which nothing acts.
fn rest(system: &System) -> Drive {
    Drive { load: 0.0, ..system.electrics.drive() }
}

/// The reduced coordinates during a motion.
struct ReducedPropagator<'a> {
    compiled: &'a CompiledModel,
    options: &'a TransientOptions<'a>,
    reduction: &'a MotionReduction,
    /// Whether the directions that the motion lacks are wanted: not where it shares its training.
    corrects: bool,
    /// Corrections of the full model along the motion.
    corrections: Option<MotionCorrections>,
    /// Estimated error by the reduction (1).
    error: Option<f64>,
    excess: f64,
}

impl Propagator for ReducedPropagator<'_> {
    /// A release begins at the equilibrium of the reduced model: that of the full one is not among its states.
    fn begin(&mut self, _: &Ramp<'_>, motion: &mut Motion) -> Result<(), AnalysisError> {
        let Some(start) = self.options.release else { return Ok(()) };
        let point = operating_point(start, &self.options.voltages)?;
        let own = self.reduction.space.of_system(&start.parts.system);
        let (none, to) = (rest(&start.parts.system), point.drive(start));
        let mut statics = ReducedStatics::new(&own);
        let found = statics.follow(&own, &DriveRay { none: &none, to: &to }, &mut vec![0.0; own.size()]);
        if found.reached == 1.0 {
            motion.q.copy_from_slice(&statics.forces.placed.at);
        }
        Ok(())
    }

    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
        _: Option<SeeError<'_>>,
    ) -> Result<(Advance, SolverCounters), AnalysisError> {
        let system = &self.compiled.parts.system;
        let h = first_step(system, self.options.stop);
        let run = IntegrationRun { motion, h, control: self.options.control(), observe, corners: Vec::new() };
        let mut method = self.reduction.method(system, h);
        if self.corrects {
            method = method.with_corrections();
        }
        let (end, stepper) = run.stepped(&mut Bodies::new(system, ramp), method);
        (self.error, self.excess) = (stepper.method.error(), stepper.method.excess);
        self.corrections = stepper.method.corrections().cloned();
        Ok((end?, stepper.work()))
    }
}
