//! Motion in joint coordinates whose loops are closed after each step, explicitly or implicitly.

use super::super::AnalysisError;
use super::super::formulation::Formulation;
use super::super::transient::record::Carrier;
use super::report::JointReport;
use crate::domains::{Ramp, System};
use crate::multibody::rcr::Linkage;
use crate::multibody::rcr::Reduction;
use crate::solve::dormand_prince::SecondOrder;
use crate::solve::dormand_prince::{Dense, DormandPrince, IntegrationError, Pair, Tolerances};
use crate::solve::joint_adaptive::{JointAdaptive, JointStepError};
use crate::solve::joint_dirk::JointMethod;
use crate::solve::joint_dirk::Rule;
use crate::solve::joint_loads::{JointLoads, poses};
use crate::solve::joint_motion::{JointMotion, NotFinite};
use crate::solve::joint_stage::ImplicitMotion;
use crate::solve::time::adaptive::{Advance, Control, Observer};
use crate::solve::time::method::{Motion, Work};

/// Share of the size of a coordinate below which its relative error does not count.
const FLOOR: f64 = 1e-3;

/// Joint coordinates on the way.
pub(super) struct InJoints<'a> {
    pub(super) formulation: Formulation,
    pub(super) system: &'a System,
    pub(super) linkage: Linkage,
    pub(super) scale: Vec<f64>,
    /// None: explicit.
    pub(super) rule: Option<Rule>,
    pub(super) control: Control,
    pub(super) rtol: f64,
    pub(super) rate: f64,
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) report: JointReport,
}

impl Carrier for InJoints<'_> {
    fn begin(&mut self, ramp: &Ramp<'_>, motion: &mut Motion) -> Result<(), AnalysisError> {
        self.linkage.coordinates_at(&motion.q, &mut self.q);
        let mut loads = JointLoads::new(self.system, &self.linkage, ramp);
        let mut reduction = Reduction::new(&[&self.linkage]);
        loads.place(0.0, &self.q, &self.v, &mut reduction);
        let mut change = self.q.clone();
        self.report.largest_gap_m = reduction.project_positions(&mut self.q, &self.v, &mut change);
        poses(&reduction, &mut motion.q, &mut motion.v);
        Ok(())
    }

    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
    ) -> Result<(Advance, Work), AnalysisError> {
        match self.rule {
            Some(rule) => self.implicitly(rule, ramp, motion, observe),
            None => self.explicitly(ramp, motion, observe),
        }
    }
}

fn failed(formulation: Formulation, linkage: &Linkage, error: &IntegrationError<NotFinite>) -> AnalysisError {
    let n = linkage.coordinates;
    let (t, dt, worst) = match *error {
        IntegrationError::StepTooSmall { t, h, component, .. } => (t, h, Some(component % n)),
        IntegrationError::Accelerations { t, h, .. } => (t, h, None),
        IntegrationError::TooManySteps { t, .. } => (t, 0.0, None),
    };
    let at = worst.map_or(String::new(), |c| format!(" at body \"{}\"", linkage.names[linkage.body_of(c)]));
    AnalysisError::StepFailed {
        t,
        dt,
        detail: format!("{error}{at}; rk45 steps explicitly in formulation {}, tr-bdf2 implicitly", formulation.name()),
    }
}

impl InJoints<'_> {
    fn implicitly(
        &mut self,
        rule: Rule,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
    ) -> Result<(Advance, Work), AnalysisError> {
        let linkage = &self.linkage;
        let n = linkage.coordinates;
        let loads = JointLoads::new(self.system, linkage, ramp);
        let mut shown = loads.clone();
        let mut after = Reduction::<f64>::new(&[linkage]);
        let mut before = motion.clone();
        let mut joints = ImplicitMotion::new(linkage, loads, &self.scale);
        let mut now = Pair { q: std::mem::take(&mut self.q), v: std::mem::take(&mut self.v) };
        let mut see = |t: f64, h: f64, now: &Pair| {
            shown.place(t + h, &now.q, &now.v, &mut after);
            poses(&after, &mut motion.q, &mut motion.v);
            let on = observe(t, h, &before, motion);
            before.clone_from(motion);
            on
        };
        let mut method = JointAdaptive::new(JointMethod::new(rule, n), n);
        let end = method.advance(&mut joints, (0.0, ramp.dt), &mut now, self.control, &mut see);
        (self.q, self.v) = (now.q, now.v);
        self.report.accelerations = joints.work.forces;
        self.report.singular_evaluations = joints.singular;
        self.report.largest_gap_m = self.report.largest_gap_m.max(joints.gap);
        let end = end.map_err(|e| {
            let (t, dt) = match &e {
                JointStepError::Stage { t, h, .. } | JointStepError::TooSmall { t, h, .. } => (*t, *h),
            };
            AnalysisError::StepFailed { t, dt, detail: e.to_string() }
        })?;
        Ok((if end.is_some_and(|t| t < ramp.dt) { Advance::Stopped } else { Advance::Done }, joints.work))
    }

    fn explicitly(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
    ) -> Result<(Advance, Work), AnalysisError> {
        let linkage = &self.linkage;
        let mut loads = JointLoads::new(self.system, linkage, ramp);
        let mut shown = loads.clone();
        let mut after = Reduction::<f64>::new(&[linkage]);
        let mut before = motion.clone();
        let (mut q, mut v) = (self.q.clone(), self.v.clone());
        let mut joints =
            JointMotion::new(linkage, |t, q: &[f64], v: &[f64], r: &mut Reduction<f64>| loads.add(t, q, v, r));
        // offsets are prescribed by the first evaluation
        let mut see = |dense: &Dense<'_>| {
            dense.at(dense.t + dense.h, &mut q, &mut v);
            shown.place(dense.t + dense.h, &q, &v, &mut after);
            poses(&after, &mut motion.q, &mut motion.v);
            let on = observe(dense.t, dense.h, &before, motion);
            before.clone_from(motion);
            on
        };
        let tolerances = Tolerances {
            rtol: self.rtol,
            atol_q: self.scale.iter().map(|s| self.rtol * FLOOR * s).collect(),
            atol_v: self.scale.iter().map(|s| self.rtol * FLOOR * s * self.rate).collect(),
        };
        let mut method = DormandPrince::new(joints.dimension());
        let (span, mut h) = ((0.0, ramp.dt), 0.0);
        let end =
            method.integrate(&mut joints, span, &mut self.q, &mut self.v, &mut h, &tolerances, u64::MAX, &mut see);
        let effort = method.effort;
        self.report.accelerations = effort.accelerations;
        self.report.singular_evaluations = joints.singular;
        self.report.largest_gap_m = self.report.largest_gap_m.max(joints.gap);
        let end = match end.map_err(|e| failed(self.formulation, linkage, &e))? {
            Some(t) if t < ramp.dt => Advance::Stopped,
            _ => Advance::Done,
        };
        let work =
            Work { steps: effort.steps, rejected: effort.rejected, forces: effort.accelerations, ..Work::default() };
        Ok((end, work))
    }
}
