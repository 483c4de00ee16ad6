//! Motion in joint coordinates whose loops close by springs: one factorization a step, no constraint and no singular
//! configuration.

use super::super::formulation::Formulation;
use super::super::integrator::IntegrationRun;
use super::super::transient::first_step::first_step;
use super::super::transient::options::TransientOptions;
use super::super::transient::record::{Propagator, record};
use super::super::transient::result::TransientResult;
use super::super::{AnalysisError, ProgressCallback};
use super::report::JointReport;
use bimorph_domains::{Ramp, System};
use bimorph_model::compile::CompiledModel;
use bimorph_solve::baseline::SolverKind;
use bimorph_solve::equations::{Bodies, Joints};
use bimorph_solve::time::adaptive::{Advance, Observer};
use bimorph_solve::time::defect::SeeError;
use bimorph_solve::time::joint_rodas4::JointRodas4;
use bimorph_solve::time::method::{Motion, SolverCounters};
use std::sync::Arc;

/// Loops closed by springs: one factorization a step, no constraint and no singular configuration.
pub(super) fn on_tree(
    compiled: &CompiledModel,
    formulation: Formulation,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, JointReport), AnalysisError> {
    let system = &compiled.parts.system;
    let joints = match &compiled.joints {
        Some(joints) => joints.clone(),
        None => Joints::elastic(system).map(Arc::new),
    };
    let joints = joints.map_err(|unfit| AnalysisError::BadRequest {
        what: format!("formulation {}", formulation.name()),
        detail: unfit.to_string(),
    })?;
    let counts = system.model.counts();
    let mut result =
        record(compiled, options, &mut TreePropagator { system, joints: &joints, options }, sample, watch)?;
    result.unknowns = joints.tree.coordinates;
    let report = JointReport {
        coordinates: joints.tree.coordinates,
        constraints: 0,
        coordinates_uncut: counts.coordinates,
        constraints_uncut: counts.constraints,
        accelerations: result.counters.forces,
        singular_evaluations: 0,
        largest_gap_m: 0.0,
        highest_frequency_hz: None,
    };
    Ok((result, report))
}

/// Joint coordinates whose loops close by springs.
struct TreePropagator<'a> {
    system: &'a System,
    joints: &'a Arc<Joints>,
    options: &'a TransientOptions<'a>,
}

impl Propagator for TreePropagator<'_> {
    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
        errors: Option<SeeError<'_>>,
    ) -> Result<(Advance, SolverCounters), AnalysisError> {
        let options = self.options;
        if options.solver != SolverKind::Recursion {
            return Err(AnalysisError::BadRequest {
                what: "solver".into(),
                detail: format!(
                    "joint coordinates have the recursion only; the {} solver cannot",
                    options.solver.name()
                ),
            });
        }
        let h = first_step(self.system, options.stop);
        let run = IntegrationRun { motion, h, control: options.control(), observe, corners: Vec::new() };
        let method = JointRodas4::new(Arc::clone(self.joints), h, &[]);
        let (end, work) = run.with_errors(&mut Bodies::new(self.system, ramp), method, errors);
        Ok((end?, work))
    }
}
