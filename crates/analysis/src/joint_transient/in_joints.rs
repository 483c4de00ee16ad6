//! Motion in joint coordinates whose loops are constraints, closed after each step.

use super::super::AnalysisError;
use super::super::formulation::Formulation;
use super::super::integrator::{IntegrationRule, IntegrationRun};
use super::super::transient::record::Propagator;
use super::report::JointReport;
use bimorph_domains::{Ramp, System};
use bimorph_multibody::joint_coordinates::constrained_loops::Linkage;
use bimorph_multibody::joint_coordinates::constrained_loops::Reduction;
use bimorph_solve::SolveError;
use bimorph_solve::equations::constrained::Constrained;
use bimorph_solve::equations::loads::{JointLoads, poses};
use bimorph_solve::time::adaptive::{Advance, Control, Observer, failed};
use bimorph_solve::time::defect::SeeError;
use bimorph_solve::time::method::{Motion, SolverCounters};

/// Joint coordinates during the motion.
pub(super) struct JointPropagator<'a> {
    pub(super) formulation: Formulation,
    pub(super) system: &'a System,
    pub(super) linkage: Linkage,
    pub(super) scale: Vec<f64>,
    pub(super) rule: IntegrationRule,
    pub(super) control: Control,
    pub(super) now: Motion<f64>,
    pub(super) report: JointReport,
}

impl Propagator for JointPropagator<'_> {
    fn begin(&mut self, ramp: &Ramp<'_>, motion: &mut Motion) -> Result<(), AnalysisError> {
        let Motion { q, v } = &mut self.now;
        self.linkage.coordinates_at(&motion.q, q);
        let mut loads = JointLoads::new(self.system, &self.linkage, ramp);
        let mut reduction = Reduction::new(&[&self.linkage]);
        loads.place(0.0, q, v, &mut reduction);
        let mut change = q.clone();
        self.report.largest_gap_m = reduction.project_positions(q, v, &mut change);
        poses(&reduction, &mut motion.q, &mut motion.v);
        Ok(())
    }

    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
        _: Option<SeeError<'_>>,
    ) -> Result<(Advance, SolverCounters), AnalysisError> {
        let linkage = &self.linkage;
        let loads = JointLoads::new(self.system, linkage, ramp);
        let mut shown = loads.clone();
        let mut after = Reduction::<f64>::new(&[linkage]);
        let mut before = motion.clone();
        let mut see = |t: f64, h: f64, _: &Motion<f64>, now: &Motion<f64>| {
            shown.place(t + h, &now.q, &now.v, &mut after);
            poses(&after, &mut motion.q, &mut motion.v);
            let on = observe(t, h, &before, motion);
            before.clone_from(motion);
            on
        };
        let mut equations = Constrained::new(linkage, loads, &self.scale, ramp.dt);
        let h = match self.control {
            Control::Tolerance(tol) => {
                equations.first_step(&self.now, tol).map_err(|e| failed(&equations, 0.0, ramp.dt, e))
            }
            Control::Fixed(step) => Ok(step),
        };
        let h = h.map_err(|error| failure(self.formulation, self.rule, error))?;
        let run =
            IntegrationRun { motion: &mut self.now, h, control: self.control, observe: &mut see, corners: Vec::new() };
        let (end, work) = self.rule.advance(&mut equations, run);
        self.report.accelerations = work.forces;
        self.report.singular_evaluations = equations.singular;
        self.report.largest_gap_m = self.report.largest_gap_m.max(equations.gap);
        Ok((end.map_err(|error| failure(self.formulation, self.rule, error))?, work))
    }
}

/// An error, with another way where explicit steps may be at fault.
fn failure(formulation: Formulation, rule: IntegrationRule, error: SolveError) -> AnalysisError {
    let (t, dt) = match &error {
        SolveError::StepFailed { t, dt, .. } | SolveError::StepTooSmall { t, dt, .. } => (*t, *dt),
        _ => return error.into(),
    };
    let way = match rule {
        IntegrationRule::Rk45 => {
            format!("; rk45 steps explicitly in formulation {}, tr-bdf2 implicitly", formulation.name())
        }
        _ => String::new(),
    };
    AnalysisError::StepFailed { t, dt, detail: format!("{error}{way}") }
}
