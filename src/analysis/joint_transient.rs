//! Motion in time in joint coordinates: the recursion of the paper, loops closed after each step.
//!
//! Accelerations come from [`crate::multibody::rcr`] in O(n + m). Dormand and Prince's pair advances them explicitly, or an
//! implicit method does, whose stages the same recursion solves ([`crate::solve::joint_stage`]). An explicit step is about
//! 1/ω long, ω the highest natural frequency of the model, whatever the tolerance: joints that only turn have a moderate
//! one, elastic axial directions a very high one. The number of explicit steps is foretold, and refused when it is beyond
//! [`MOST_STEPS`]: implicit steps follow the motion that is asked for.
//!
//! A release starts from the equilibrium of the same mechanism: the compliant model with its locked directions [`RIGID`]
//! times as stiff, mapped to joint coordinates and projected onto the loops.

use super::formulation::{Formulation, coordinate_scales};
use super::integrator::Integrator;
use super::transient::{Carrier, STEP_SHARE, TransientOptions, TransientResult, first_step, record};
use super::{AnalysisError, Watch};
use crate::compile::Compiled;
use crate::equations::Joints;
use crate::gaps::{Ramp, System};
use crate::multibody::rcr::{Linkage, Reduction};
use crate::solve::baseline::SolverKind;
use crate::solve::dormand_prince::{Dense, DormandPrince, IntegrationError, Pair, SecondOrder, Tolerances};
use crate::solve::fastest::{Fastest, fastest};
use crate::solve::joint_adaptive::{JointAdaptive, JointStepError};
use crate::solve::joint_dirk::{JointMethod, Rule};
use crate::solve::joint_loads::{JointLoads, poses};
use crate::solve::joint_motion::{JointMotion, NotFinite};
use crate::solve::joint_stage::ImplicitMotion;
use crate::solve::time::adaptive::{Adaptive, Advance, Control, Observer};
use crate::solve::time::joint_rodas4::JointRodas4;
use crate::solve::time::method::{Motion, Work};
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Steps beyond which a run is refused before it begins.
pub const MOST_STEPS: f64 = 2e7;
/// Stiffness of locked directions in the equilibrium that a release starts from, over that of the drawn beam.
pub const RIGID: f64 = 1e4;
/// Share of the size of a coordinate below which its relative error does not count.
const FLOOR: f64 = 1e-3;

/// What a run in joint coordinates has to say beside its signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointReport {
    /// Generalized coordinates n of the tree.
    pub coordinates: usize,
    /// Independent loop constraints m.
    pub constraints: usize,
    /// n as the paper counts it: every joint a coordinate, one body afloat.
    pub coordinates_uncut: usize,
    /// m as the paper counts it: three for each loop.
    pub constraints_uncut: usize,
    /// Evaluations of the accelerations; each is one recursion.
    pub accelerations: u64,
    /// Evaluations near a singular configuration of the loops.
    pub singular_evaluations: u64,
    /// Largest gap of a loop after a step [m].
    pub largest_gap_m: f64,
    /// Highest natural frequency about the drawn place [Hz]; null: nothing is elastic.
    pub highest_frequency_hz: Option<f64>,
}

/// Integrates the motion in joint coordinates, with one of [`Integrator::IN_JOINTS`]. As [`super::transient::transient`]
/// otherwise, with a report on the formulation.
///
/// # Errors
/// See [`AnalysisError`]; [`AnalysisError::BadRequest`] where joint coordinates, the method or explicit steps will not do.
pub fn joint_transient(
    compiled: &Compiled,
    formulation: Formulation,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
) -> Result<(TransientResult, JointReport), AnalysisError> {
    if options.method == Integrator::Rodas4 {
        return on_tree(compiled, formulation, options, sample, watch);
    }
    let rule = rule(formulation, options)?;
    let system = &compiled.parts.system;
    let linkage = formulation.linkage(system)?;
    let counts = formulation.lock(&system.model).counts();
    let scale = coordinate_scales(&linkage, system.length_scale);
    let top = fastest(&linkage, &scale, system.electrics.heating.heaters.len());
    if let (Some(top), None) = (&top, rule) {
        affordable(formulation, &linkage, top, options.stop)?;
    }
    let start = options.release.map(|start| {
        let mut start = start.clone();
        start.parts.system.model = formulation.lock(&start.parts.system.model).stiffened(RIGID);
        start
    });
    let mut carrier = InJoints {
        formulation,
        system,
        q: vec![0.0; linkage.coordinates],
        v: vec![0.0; linkage.coordinates],
        rule,
        control: options.step.map_or(Control::Tolerance(STEP_SHARE * options.tol), Control::Fixed),
        rtol: STEP_SHARE * options.tol,
        rate: top.as_ref().map_or(1.0 / options.stop, |t| t.omega),
        report: JointReport {
            coordinates: linkage.coordinates,
            constraints: linkage.constraints,
            coordinates_uncut: counts.coordinates,
            constraints_uncut: counts.constraints,
            accelerations: 0,
            singular_evaluations: 0,
            largest_gap_m: 0.0,
            highest_frequency_hz: top.map(|t| t.omega / TAU),
        },
        linkage,
        scale,
    };
    let options = TransientOptions { release: start.as_ref(), ..options.clone() };
    let mut result = record(compiled, &options, &mut carrier, sample, watch)?;
    result.unknowns = carrier.linkage.coordinates.saturating_sub(carrier.linkage.constraints);
    Ok((result, carrier.report))
}

/// Loops closed by springs: one factorization a step, no constraint and no singular configuration.
fn on_tree(
    compiled: &Compiled,
    formulation: Formulation,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: Watch<'_>,
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
    let mut result = record(compiled, options, &mut OnTree { system, joints: &joints, options }, sample, watch)?;
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
struct OnTree<'a> {
    system: &'a System,
    joints: &'a Arc<Joints>,
    options: &'a TransientOptions<'a>,
}

impl Carrier for OnTree<'_> {
    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
    ) -> Result<(Advance, Work), AnalysisError> {
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
        let mut h = first_step(self.system, options.stop);
        let control = options.step.map_or(Control::Tolerance(STEP_SHARE * options.tol), Control::Fixed);
        let mut stepper = Adaptive::new(self.system, JointRodas4::new(Arc::clone(self.joints), h, &[]));
        let end = stepper.advance(self.system, ramp, motion, &mut h, control, usize::MAX, observe)?;
        Ok((end, stepper.work()))
    }
}

/// Joint coordinates on the way.
struct InJoints<'a> {
    formulation: Formulation,
    system: &'a System,
    linkage: Linkage,
    scale: Vec<f64>,
    /// None: explicit.
    rule: Option<Rule>,
    control: Control,
    rtol: f64,
    rate: f64,
    q: Vec<f64>,
    v: Vec<f64>,
    report: JointReport,
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

/// The implicit method asked for; none: explicit steps.
fn rule(formulation: Formulation, options: &TransientOptions<'_>) -> Result<Option<Rule>, AnalysisError> {
    let rule = match options.method {
        Integrator::Rk45 => None,
        Integrator::Midpoint => Some(Rule::Midpoint),
        Integrator::Newmark => Some(Rule::Newmark),
        Integrator::TrBdf2 => Some(Rule::TrBdf2),
        Integrator::Sdirk4 => Some(Rule::Sdirk4),
        Integrator::GeneralizedAlpha { rho } => Some(Rule::GeneralizedAlpha { rho }),
        other => {
            return Err(AnalysisError::BadRequest {
                what: format!("method {}", other.name()),
                detail: format!(
                    "formulation {} has {}; take one of them, or compliant for {}",
                    formulation.name(),
                    Integrator::IN_JOINTS.join(", "),
                    other.name()
                ),
            });
        }
    };
    if rule.is_none() && options.step.is_some() {
        return Err(AnalysisError::BadRequest {
            what: "step".into(),
            detail: "explicit steps follow the tolerance; leave it out, or take an implicit method".into(),
        });
    }
    Ok(rule)
}

fn affordable(formulation: Formulation, linkage: &Linkage, top: &Fastest, stop: f64) -> Result<(), AnalysisError> {
    let steps = stop * top.omega;
    if steps <= MOST_STEPS {
        return Ok(());
    }
    Err(AnalysisError::BadRequest {
        what: format!("formulation {}", formulation.name()),
        detail: format!(
            "its explicit steps of about {:.2e} s ({:.3e} Hz at body \"{}\") would take {steps:.1e} steps to {stop:e} s; \
             take an implicit method such as tr-bdf2, or compliant",
            1.0 / top.omega,
            top.omega / TAU,
            linkage.names[top.body]
        ),
    })
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
