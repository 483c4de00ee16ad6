//! Rodas4: a stiffly accurate Rosenbrock method of order 4 with an embedded estimate of order 3.
//!
//! For M·q̈ + C·q̇ + r(q, t) = 0 with y = (q, v) each of its six stages solves (W)·U = right-hand side with one matrix
//! per step, W = M/(γh)² + C/(γh) + K(q_n). The velocity half is eliminated by hand and W stays symmetric, so that a
//! step takes one block factorization and six solves. Nothing iterates and nothing is allocated.
//! ```text
//! r₁ = v_i + Σ c_ij/h·Uq_j                                 v-row of stage i
//! r₂ = −r(q_i, t_i) − C·v_i + M·Σ c_ij/h·Uv_j + γ_i·h·∂F/∂t
//! W·Uq_i = r₂ + (M/(γh) + C)·r₁,   Uv_i = Uq_i/(γh) − r₁
//! ```
//! Since r₁ − v_i = Σ c_ij/h·Uq_j, damping acts on that sum alone: everything but r itself is known before the forces are
//! evaluated, and the forces are added to it.
//!
//! Its stability function is L-stable: axial motions of stiff beams, a thousand times faster than the step, die out.
//!
//! Sensitivities with respect to the final port voltages go through the same stages with the exact tangent of each, so the
//! partials of a single step are those of the numbers it returns.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.7 and table 7.1 (RODAS).

mod body_stage;
mod defect;
pub mod lanes;
mod ports;
mod stages;
pub(crate) mod tableau;

use super::defect::{MotionError, Propagates};
pub use super::method::Motion;
use super::method::{Method, SolverCounters, StepResult};
use crate::equations::Bodies;
use crate::equations::linear::{LinearSolver, Recursion};
use crate::time::gyration::{Gyration, held_out, skew};
use crate::time::rosenbrock::{self, RosenbrockStep};
use crate::time::stage_loss::{StageLoss, StepMatrix};
use bimorph_domains::system::ApartMembers;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, forces};
use defect::DefectEstimate;
use ports::{FrameRotation, PortSensitivities};
use stages::Stages;
use tableau::{ALPHA, GAMMA};

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Rodas4<S = Recursion> {
    solver: S,
    w: BodyMatrix,
    stages: Stages,
    drive: Drive,
    rate: Drive,
    ports: PortSensitivities,
    loss: Option<Box<StageLoss>>,
    /// Terms of the series in a frame that turns; empty where no input turns it.
    scratch: Vec<Pose>,
    /// ∂motion/∂(final voltage of a source), one for each source given to [`Rodas4::new`]; advanced with the motion.
    pub sensitivity: Vec<Motion>,
    /// Sensitivities take the tangent at the start of a step for all its stages, which is a third of their work.
    pub first_tangent: bool,
    /// The error of the motion, where it is wanted.
    defect: Option<Box<DefectEstimate>>,
    work: SolverCounters,
}

impl Rodas4 {
    /// Storage for a system, with sensitivities to the final voltages of `sources`.
    pub fn new(system: &System, sources: &[usize]) -> Self {
        Self::with_solver(Recursion, system, sources)
    }
}

impl<S: LinearSolver> Rodas4<S> {
    /// [`Rodas4::new`] with another solver of its linear systems.
    pub fn with_solver(solver: S, system: &System, sources: &[usize]) -> Self {
        Self {
            solver,
            w: BodyMatrix::new(&system.model.pattern),
            stages: Stages::new(&system.model),
            drive: system.electrics.drive(),
            rate: system.electrics.drive(),
            ports: PortSensitivities::new(system, sources),
            loss: StageLoss::new(system, !sources.is_empty()).map(Box::new),
            scratch: vec![Pose::zeros(); if system.turns() { system.bodies() } else { 0 }],
            sensitivity: vec![Motion::zeros(system.bodies()); sources.len()],
            first_tangent: false,
            defect: None,
            work: SolverCounters::default(),
        }
    }
}

/// A step of the bodies under way.
struct BodyStep<'a, S> {
    rodas: &'a mut Rodas4<S>,
    system: &'a System,
    ramp: &'a Ramp<'a>,
    /// Its start and length (s).
    s: f64,
    h: f64,
    motion: &'a mut Motion,
    error: &'a mut Motion,
    /// Where an input turns the frame.
    turning: Option<FrameRotation>,
}

impl<S: LinearSolver> RosenbrockStep for BodyStep<'_, S> {
    fn begin(&mut self) -> StepResult {
        let Self { system, ramp, s, h, motion, .. } = self;
        let Rodas4 { stages, drive, rate, ports, sensitivity, .. } = &mut *self.rodas;
        ramp.at_and_rate(*s, drive, rate);
        drive.load = 1.0;
        system.drive_force(&motion.q, drive, rate, &mut stages.forcing);
        ports.begin(system, ramp, *s, &motion.q, (drive, rate));
        let Some(frame) = system.frame(drive).filter(|_| system.turns()) else { return Ok(()) };
        let start = Gyration::new(frame);
        self.turning = Some(FrameRotation { start, now: start, terms: start.terms(GAMMA * *h)? });
        let rate = system.frame(rate).map(Gyration::new).unwrap_or_default();
        for ((force, body), v) in stages.forcing.iter_mut().zip(&system.model.bodies).zip(&motion.v) {
            *force += held_out(body, skew(body, rate.rate, v));
        }
        ports.begin_turning(system, ramp, *s, (&motion.v, rate), sensitivity);
        Ok(())
    }

    fn drive_at(&mut self, alpha: f64) {
        self.ramp.at(self.s + alpha * self.h, &mut self.rodas.drive);
    }

    fn argument(&mut self, i: usize) {
        let Self { system, h, motion, turning, .. } = self;
        let Rodas4 { stages, drive, .. } = &mut *self.rodas;
        stages.begin(&system.model, i, *h, motion);
        if let Some(turning) = turning {
            turning.now = system.frame(drive).map(Gyration::new).unwrap_or_default();
            stages.add_gyration(&system.model, (i, *h), turning.now, turning.start);
        }
    }

    fn residual(&mut self, i: usize) {
        let (system, h, from) = (self.system, self.h, &*self.motion);
        let Rodas4 { stages, drive, loss, ports, defect, w, first_tangent, .. } = &mut *self.rodas;
        let keeps = i > 0 && *first_tangent;
        // what contact loses needs the stages beside their force
        let mut force = std::mem::take(&mut stages.force);
        let lose = |force: &mut [Pose], apart: ApartMembers| {
            if let Some(loss) = loss {
                loss.add_forces(system, i == 0, (stages.at(i, from), apart), |k| stages.speed(i, h, k), force);
                loss.start.add_damping(|k| -stages.r1()[k], force);
            }
        };
        let q = stages.at(i, from);
        if i == 0 {
            defect.iter_mut().for_each(|defect| defect.before_forces(&force));
            system.add_tangent_and(q, drive, w, &mut force, lose);
            defect.iter_mut().for_each(|defect| defect.after_forces(&force));
            ports.keep_tangent(w);
        } else if let Some(tangent) = ports.tangent().filter(|_| !keeps) {
            system.add_tangent_and(q, drive, tangent, &mut force, lose);
        } else {
            system.add_residual_and(q, drive, &mut force, lose);
        }
        stages.force = force;
        if let (Some(loss), Some(tangent)) = (&*loss, ports.tangent().filter(|_| !keeps)) {
            loss.add_tangent(tangent);
        }
    }

    fn factor(&mut self) -> StepResult {
        let (model, gh) = (&self.system.model, GAMMA * self.h);
        let Rodas4 { solver, w, loss, work, .. } = &mut *self.rodas;
        if let Some(loss) = loss {
            loss.add_matrix(gh, w);
        }
        forces::add_inertia(model, 1.0 / (gh * gh), 1.0 / gh, w);
        model.project_matrix(w);
        if let Some(loss) = loss {
            loss.shear(model, w);
        }
        solver.factor(&model.pattern, w)?;
        work.factorizations += 1;
        work.forces += 6;
        Ok(())
    }

    fn solve(&mut self, i: usize) {
        let Self { system, ramp, h, motion, turning, .. } = self;
        let (model, gh, at) = (&system.model, GAMMA * *h, self.s + ALPHA[i] * *h);
        let Rodas4 { solver, w, stages, drive, ports, loss, scratch, sensitivity, work, .. } = &mut *self.rodas;
        let matrix = StepMatrix { solver: &*solver, pattern: &model.pattern, w, loss: loss.as_deref() };
        matrix.solve(&mut stages.force);
        work.solves += 1;
        if let Some(turning) = turning {
            turning.start.complete(model, gh, turning.terms, scratch, &mut stages.force, |x| matrix.solve(x));
            work.solves += turning.terms as u64;
        }
        let turning = turning.map(|turning| (&*stages, turning));
        let place = (stages.at(i, motion), &*drive);
        work.solves += ports.stage(system, ramp, (i, at, *h), place, &matrix, turning, sensitivity);
    }

    fn finish(&mut self) {
        let (model, h) = (&self.system.model, self.h);
        let Rodas4 { stages, ports, sensitivity, .. } = &mut *self.rodas;
        stages.finish(model, h, self.motion, Some(&mut *self.error));
        ports.finish(model, h, sensitivity);
    }
}

impl<S: LinearSolver> Method<Bodies<'_>> for Rodas4<S> {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn step(&mut self, bodies: &mut Bodies<'_>, s: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        let Bodies { system, ramp, .. } = *bodies;
        rosenbrock::take(&mut BodyStep { rodas: self, system, ramp, s, h, motion, error, turning: None })
    }

    fn carried(&mut self) -> &mut [Motion] {
        &mut self.sensitivity
    }

    fn work(&self) -> SolverCounters {
        self.work
    }
}

impl<'s, S: LinearSolver> Propagates<'s> for Rodas4<S> {
    fn begin_error(&mut self) {
        self.defect = Some(Box::new(DefectEstimate::zeros(self.stages.forcing.len())));
    }

    fn error(
        &mut self,
        bodies: &mut Bodies<'s>,
        (s, h): (f64, f64),
        ends: [&Motion; 2],
        _: &[Motion],
    ) -> MotionError<'_> {
        let Self { solver, w, drive, defect, loss, .. } = self;
        let Bodies { system, ramp, .. } = *bodies;
        let defect = defect.get_or_insert_with(|| Box::new(DefectEstimate::zeros(system.bodies())));
        let matrix = StepMatrix { solver: &*solver, pattern: &system.model.pattern, w, loss: loss.as_deref() };
        defect.advance(system, (ramp, drive), &matrix, (s, h), ends)
    }
}
