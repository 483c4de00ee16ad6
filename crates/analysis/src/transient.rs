//! Motion in time, in the formulation of the model.

mod contact_energy;
mod crossings;
pub(super) mod error_log;
mod film_pressure;
pub(super) mod first_step;
mod folded_segments;
mod in_frame;
pub(super) mod options;
mod peak_stress;
pub(super) mod record;
pub(super) mod result;
mod samples;

use super::formulation::{self, Formulation};
use super::integrator::{IntegrationRun, Integrator};
use super::joint_transient::joint_transient;
use super::reduced::reduced_transient;
use super::{AnalysisError, ProgressCallback};
use bimorph_domains::{Ramp, System};
use bimorph_model::compile::CompiledModel;
use bimorph_solve::baseline::{Solver, SolverKind};
use bimorph_solve::equations::Bodies;
use bimorph_solve::time::adaptive::{Advance, Observer};
use bimorph_solve::time::defect::SeeError;
use bimorph_solve::time::method::{Motion, SolverCounters};
use bimorph_solve::time::rodas4::Rodas4;
pub use first_step::first_step;
pub use options::{TransientOptions, Until};
use record::{Propagator, record};
pub use result::{CrossingEvent, Statistics, StressMaximum, TransientResult};

/// The bodies' own coordinates, joints as springs.
struct Compliant<'a> {
    system: &'a System,
    options: &'a TransientOptions<'a>,
}

impl Propagator for Compliant<'_> {
    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
        errors: Option<SeeError<'_>>,
    ) -> Result<(Advance, SolverCounters), AnalysisError> {
        let options = self.options;
        if options.solver != SolverKind::Recursion && !options.method.takes_solvers() {
            return Err(AnalysisError::BadRequest {
                what: "solver".into(),
                detail: format!(
                    "{} solves its own systems; the {} solver cannot",
                    options.method.name(),
                    options.solver.name()
                ),
            });
        }
        let solver = Solver::new(options.solver, &self.system.model.pattern)?;
        let h = first_step(self.system, options.stop);
        if let Some(see) = errors.filter(|_| options.method == Integrator::Rodas4 && !self.system.turns()) {
            let run = IntegrationRun { motion, h, control: options.control(), observe, corners: ramp.corners() };
            let method = Rodas4::with_solver(solver, self.system, &[]);
            let (end, work) = run.with_errors(&mut Bodies::new(self.system, ramp), method, Some(see));
            return Ok((end?, work));
        }
        let (end, work) = options.method.advance(self.system, solver, ramp, motion, h, options.control(), observe);
        Ok((end?, work))
    }
}

/// Integrates the motion in the formulation of the model. Each finished sample also goes to `sample` (t, values in signal order), for streaming.
///
/// # Errors
/// See [`AnalysisError`].
pub fn transient(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<TransientResult, AnalysisError> {
    let framed = in_frame::in_frame(compiled, options);
    let compiled = framed.as_ref().unwrap_or(compiled);
    let system = &compiled.parts.system;
    let (suited, method) = formulation::of_run(compiled, options);
    match suited.formulation {
        formulation @ (Formulation::Rcr | Formulation::RcrElastic) => {
            let options = options.with_method(method);
            joint_transient(compiled, formulation, &options, sample, watch).map(|(r, _)| r)
        }
        Formulation::Reduced => reduced_transient(compiled, options, sample, watch, &mut |sample, watch| {
            record(compiled, options, &mut Compliant { system, options }, sample, watch)
        }),
        _ => record(compiled, options, &mut Compliant { system, options }, sample, watch),
    }
}
