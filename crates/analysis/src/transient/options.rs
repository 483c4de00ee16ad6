//! Options of a transient, and their errors.

use super::super::AnalysisError;
use super::super::integrator::Integrator;
use super::super::reduced::Directions;
use super::super::reduced::shared::TrainedMotion;
use bimorph_base::ErrorBudget;
use bimorph_domains::{InputWaveform, Shock};
use bimorph_model::compile::CompiledModel;
use bimorph_model::options::analysis::TRAN_POINTS;
use bimorph_solve::baseline::SolverKind;
use bimorph_solve::time::adaptive::Control;
use std::sync::Arc;

/// Samples of a run that may be made again, at most (1): eight megabytes.
const MAX_STORED_SAMPLES: usize = 1 << 20;

/// Condition that ends a run early.
#[derive(Debug, Clone, PartialEq)]
pub enum Until {
    /// The contact force of a gap or stop begins to act.
    Contact,
    /// A contact force ends.
    Release,
    /// A signal crosses a level, in the signal's unit.
    Level(String, f64),
}

impl std::fmt::Display for Until {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Contact => f.write_str("contact"),
            Self::Release => f.write_str("release"),
            Self::Level(name, level) => write!(f, "{name}={level}"),
        }
    }
}

/// Options of a transient.
#[derive(Debug, Clone)]
pub struct TransientOptions<'a> {
    /// End time (s).
    pub stop: f64,
    /// Names of the signals wanted, see [`of_run`](crate::readout::expression::Expression::of_run).
    pub signals: Vec<String>,
    /// Number of equally spaced output times, ends included.
    pub points: usize,
    /// Relative error of a step (1).
    pub tol: f64,
    /// Voltages held during the run, by port name (V).
    pub voltages: Vec<(String, f64)>,
    /// A variant of the same netlist whose static equilibrium is the initial state; none: at rest as drawn.
    pub release: Option<&'a CompiledModel>,
    /// Acceleration of the frame from the start on; in the bodies' own coordinates.
    pub shock: Option<Shock>,
    /// Displacements (m) and rotations (rad) of driven anchors over time, by the names of their inputs.
    pub motions: Vec<(String, InputWaveform)>,
    /// Integrator.
    pub method: Integrator,
    /// Length of equal steps (s); none: steps follow `tol`.
    pub step: Option<f64>,
    /// Crossings to find: (signal name, level in the signal's unit).
    pub events: Vec<(String, f64)>,
    /// Condition that ends the run before `stop`.
    pub until: Option<Until>,
    /// Solver of the linear systems of the method. The result is the same to rounding; all but the recursion are
    /// baselines, and Radau5 and rk45 have none.
    pub solver: SolverKind,
    /// Whether the run estimates the error of its steps, see
    /// [`TransientResult::step_error`](super::TransientResult::step_error): Rodas4 with steps that follow the
    /// tolerance, in a frame that does not rotate. The motion is bit-identical.
    pub estimate: bool,
    /// Whether the result stores the samples, default true; otherwise only the callback receives them.
    pub keep: bool,
    /// Directions of a reduced model, from a run before; none: those of a training.
    pub directions: Option<Directions>,
    /// A training that several runs share, where no directions are given; none: a run with a reduced model is trained for what acts in it.
    pub reduction: Option<Arc<TrainedMotion>>,
}

impl Default for TransientOptions<'_> {
    /// From rest to 1 s by default.
    fn default() -> Self {
        Self {
            stop: 1.0,
            signals: Vec::new(),
            points: TRAN_POINTS.count(),
            tol: 1e-3,
            voltages: Vec::new(),
            release: None,
            shock: None,
            motions: Vec::new(),
            method: Integrator::default(),
            step: None,
            events: Vec::new(),
            until: None,
            solver: SolverKind::default(),
            estimate: false,
            keep: true,
            directions: None,
            reduction: None,
        }
    }
}

pub(crate) fn check(options: &TransientOptions<'_>) -> Result<(), AnalysisError> {
    let bad = |what: &str, detail: String| Err(AnalysisError::BadRequest { what: what.into(), detail });
    if !(options.stop.is_finite() && options.stop > 0.0) {
        return bad("stop", format!("{} is not a positive time in seconds", options.stop));
    }
    if options.points < 2 {
        return bad("points", format!("{} output times; at least 2 are needed", options.points));
    }
    if !(options.tol.is_finite() && options.tol > 0.0 && options.tol < 1.0) {
        return bad("tol", format!("{} is not a relative error between 0 and 1", options.tol));
    }
    if let Some(step) = options.step.filter(|step| *step > options.stop) {
        return bad("step", format!("{step} s is longer than the run, which takes {} s", options.stop));
    }
    if let Some(step) = options.step
        && !(step.is_finite() && step > 0.0 && options.stop / step < 1e9)
    {
        return bad("step", format!("{step} is not a positive time in seconds, of which at most 1e9 make the run"));
    }
    if let Integrator::GeneralizedAlpha { rho } = options.method
        && !(0.0..=1.0).contains(&rho)
    {
        return bad("rho", format!("{rho} is not between 0 and 1"));
    }
    if let Some(Shock { peak, duration }) = options.shock
        && !(duration.is_finite() && duration > 0.0 && peak.iter().all(|peak| peak.is_finite()))
    {
        return bad("shock", format!("{peak:?} m/s² during {duration} s is no acceleration over a positive time"));
    }
    for (name, wave) in &options.motions {
        if let Err(expected) = wave.check() {
            return bad("motion", format!("\"{name}\": expected {expected}"));
        }
        if options.voltages.iter().any(|(held, _)| held == name) {
            return bad(
                "motion",
                format!("\"{name}\" is held at a value and follows a waveform; expected one of them"),
            );
        }
    }
    if let Some((name, level)) = options.events.iter().find(|(_, level)| !level.is_finite()) {
        return bad("event", format!("{name}={level}: the level is not finite"));
    }
    Ok(())
}

/// The same options with one of them changed: no other place copies them to change one.
impl<'a> TransientOptions<'a> {
    /// With another tolerance (1).
    #[must_use]
    pub fn with_tolerance(&self, tolerance: f64) -> Self {
        Self { tol: tolerance, ..self.clone() }
    }

    /// With the directions of a reduced model, from a run before.
    #[must_use]
    pub fn with_directions(&self, directions: Option<Directions>) -> Self {
        Self { directions, ..self.clone() }
    }

    /// With a training that this run shares with others.
    #[must_use]
    pub fn with_reduction(&self, reduction: Arc<TrainedMotion>) -> Self {
        Self { reduction: Some(reduction), ..self.clone() }
    }

    /// With another integrator.
    #[must_use]
    pub fn with_method(&self, method: Integrator) -> Self {
        Self { method, ..self.clone() }
    }

    /// With another end time (s).
    #[must_use]
    pub fn with_stop(&self, stop: f64) -> Self {
        Self { stop, ..self.clone() }
    }

    /// With another condition that ends the run.
    #[must_use]
    pub fn with_end(&self, until: Option<Until>) -> Self {
        Self { until, ..self.clone() }
    }

    /// With the estimate of the error of the steps.
    #[must_use]
    pub fn with_estimate(&self) -> Self {
        Self { estimate: true, ..self.clone() }
    }

    /// From the equilibrium of `release`; none: from rest as drawn.
    #[must_use]
    pub fn with_release<'b>(&self, release: Option<&'b CompiledModel>) -> TransientOptions<'b>
    where
        'a: 'b,
    {
        TransientOptions { release, ..self.clone() }
    }

    /// For the companion of this run, in looser steps: without events, and whose samples only the callback receives.
    #[must_use]
    pub(crate) fn for_companion(&self) -> Self {
        let (tol, step) = (self.errors().companion(), self.step.map(|step| 2.0 * step));
        Self { tol, step, events: Vec::new(), keep: false, ..self.clone() }
    }

    /// Whether the samples are few enough to be kept until the run has ended, which may be made again.
    pub(crate) fn samples_are_kept(&self) -> bool {
        self.points * self.signals.len() <= MAX_STORED_SAMPLES
    }

    /// For a run that measures the error of a mesh, with this tolerance (1) and so many output times, from the equilibrium of `release`: by
    /// the default integrator and solver, without events, and whose samples only the callback receives.
    #[must_use]
    pub(crate) fn for_mesh<'b>(
        &self,
        tolerance: f64,
        points: usize,
        release: Option<&'b CompiledModel>,
    ) -> TransientOptions<'b>
    where
        'a: 'b,
    {
        let (method, solver) = (Integrator::default(), SolverKind::default());
        let (step, events) = (None, Vec::new());
        // directions that lack something may lack it on one mesh and not on another
        let directions = Some(Directions::Full("the error of a mesh is that of the full model".to_owned()));
        TransientOptions {
            tol: tolerance,
            points,
            release,
            method,
            solver,
            step,
            events,
            directions,
            keep: false,
            ..self.clone()
        }
    }

    /// With other signals.
    #[must_use]
    pub fn with_signals(&self, signals: Vec<String>) -> Self {
        Self { signals, ..self.clone() }
    }

    /// With other voltages held during the run, by port name (V).
    #[must_use]
    pub fn with_voltages(&self, voltages: Vec<(String, f64)>) -> Self {
        Self { voltages, ..self.clone() }
    }

    /// With another number of output times.
    #[must_use]
    pub fn with_points(&self, points: usize) -> Self {
        Self { points, ..self.clone() }
    }
}

impl TransientOptions<'_> {
    /// Whether a run in a reduced model takes the full one.
    pub(crate) fn takes_full_model(&self) -> bool {
        self.directions.as_ref().is_some_and(Directions::are_all)
    }

    /// Values of ports and anchors at the start of the run.
    pub(crate) fn at_start(&self) -> Vec<(String, f64)> {
        let motions = self.motions.iter().map(|(name, wave)| (name.clone(), wave.at(0.0)[0]));
        self.voltages.iter().cloned().chain(motions).collect()
    }

    /// The division of the tolerance.
    pub fn errors(&self) -> ErrorBudget {
        ErrorBudget::of(self.tol)
    }

    /// Control of the step length.
    pub(crate) fn control(&self) -> Control {
        self.step.map_or(Control::Tolerance(self.errors().step()), Control::Fixed)
    }
}
