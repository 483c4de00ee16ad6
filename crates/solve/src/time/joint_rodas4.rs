//! Rodas4 in relative joint coordinates: one factorization a step, stages by inverse dynamics and one back-substitution.
//!
//! With q the coordinates of a [`Tree`](bimorph_multibody::joint_coordinates::sprung_loops::Tree), v their rates and z their accelerations, the motion is the differential-algebraic
//! system q̇ = v, v̇ = z, 0 = R(q, v, z, t): R is the force that the motion would take, inertia included. The accelerations are
//! carried from step to step, so that no stage needs a reduction of its own. In the variables U of a Rosenbrock method
//! ```text
//! r₁ = v_i + Σ c_ij/h·Uq_j          r₂ = z_i + Σ c_ij/h·Uv_j
//! W·Uq = −R(q_i, v_i, z_i, t_i) − γ_i·h·∂R/∂t + M·(r₁/(γh) + r₂) + C·r₁          W = M/(γh)² + C/(γh) + K
//! Uv = Uq/(γh) − r₁                 Uz = Uv/(γh) − r₂
//! ```
//! with M, C and K at the start of the step. K holds the springs of the tree's joints, the stiffness that forces and
//! inertia bring to them ([`geometric`]), and the exact tangent of closures and gaps. The change of accelerations with
//! coordinates and rates is unsymmetric. Where bodies turn far in a step it is taken to first order (`turning_inertia`).
//!
//! To its caller the motion is that of the bodies, as with every other method; coordinates are internal.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.7 (RODAS) and §VI.3 (the direct
//! approach to differential-algebraic systems).

mod defect;
mod error;
mod ports;
mod stages;
mod tableau;
mod turning_inertia;

use super::method::{Method, Motion, SolverCounters, StepResult};
use super::rodas4::tableau::{ALPHA, GAMMA, GAMMA_I};
use super::rosenbrock::{self, CONSISTENT, RosenbrockStep};
use super::stage_loss::StageLoss;
use crate::equations::{Bodies, Joints};
use bimorph_base::ErrorBudget;
use bimorph_domains::system::ApartMembers;
use bimorph_domains::{Drive, Ramp};
use bimorph_multibody::forces;
use bimorph_multibody::joint_coordinates::sprung_loops::JointMatrix;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::dynamics::Stresses;
use bimorph_multibody::joint_coordinates::sprung_loops::geometric::{self, Geometric};
use bimorph_multibody::joint_coordinates::sprung_loops::poses::{TreeKinematics, place_of};
use bimorph_multibody::planar::Pose;
use error::JointDefectEstimate;
use ports::JointPortSensitivities;
use stages::JointStages;
use std::sync::Arc;
use turning_inertia::TurningInertia;

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct JointRodas4 {
    joints: Arc<Joints>,
    w: JointMatrix,
    placed: TreeKinematics,
    stresses: Stresses,
    geometric: Vec<Geometric>,
    /// Coordinates and rates, and accelerations (with nothing beside them); then the same of each sensitivity.
    carried: Vec<Motion>,
    stages: JointStages,
    turning: TurningInertia,
    ports: JointPortSensitivities,
    /// ∂(bodies' motion)/∂(final voltage of a source), one for each source given to [`JointRodas4::new`].
    pub sensitivity: Vec<Motion>,
    force: Vec<Pose>,
    /// Right side of a stage over the coordinates, and over the bodies' motions; then what the solve has found.
    right: Vec<Four>,
    wrench: Vec<Four>,
    forcing: Vec<Pose>,
    drive: Drive,
    rate: Drive,
    /// The bodies have been placed at the argument of the stages.
    is_placed: bool,
    /// Derivatives of what contact loses, at the start of the step and in the stage at hand; none where it loses nothing.
    loss: Option<Box<StageLoss>>,
    /// Accelerations are those of the motion to come.
    resumed: bool,
    /// The error of the motion, where it is wanted.
    defect: Option<Box<JointDefectEstimate>>,
    /// About the shortest time in which something moves (s).
    shortest: f64,
    work: SolverCounters,
}

impl JointRodas4 {
    /// Storage for a tree, with sensitivities to the final voltages of `sources`; `shortest` is about the shortest time in
    /// which something moves (s).
    pub fn new(joints: Arc<Joints>, shortest: f64, sources: &[usize]) -> Self {
        let Joints { tree, closures, .. } = &*joints;
        let count = tree.links.len();
        let zeros = vec![Pose::zeros(); count];
        let electrics = &closures.electrics;
        Self {
            w: JointMatrix::new(tree),
            placed: TreeKinematics::new(tree),
            stresses: Stresses::new(tree),
            geometric: vec![Geometric::ZERO; count],
            carried: vec![Motion::zeros(count); 2 + 2 * sources.len()],
            stages: JointStages::new(count),
            turning: TurningInertia::new(tree),
            ports: JointPortSensitivities::new(&joints, sources),
            sensitivity: vec![Motion::zeros(count); sources.len()],
            force: zeros.clone(),
            right: vec![Four::ZERO; count],
            wrench: vec![Four::ZERO; count + 1],
            forcing: zeros,
            drive: electrics.drive(),
            rate: electrics.drive(),
            is_placed: false,
            loss: StageLoss::new(closures, !sources.is_empty()).map(Box::new),
            resumed: false,
            defect: None,
            shortest,
            work: SolverCounters::default(),
            joints,
        }
    }

    /// Coordinates, rates and accelerations, for [`JointRodas4::resume`].
    pub fn state(&self) -> &[Motion] {
        &self.carried[..2]
    }

    /// Continues from a state: the next start takes it as it is.
    pub fn resume(&mut self, state: &[Motion]) {
        for (to, from) in self.carried.iter_mut().zip(state) {
            to.copy(from);
        }
        self.resumed = true;
    }

    /// Drops the sensitivities of the motion.
    pub fn forget_sensitivities(&mut self) {
        self.carried[2..].iter_mut().chain(&mut self.sensitivity).for_each(Motion::clear);
    }

    /// Places the bodies at the argument of the stage at hand, unless that is where they are, and puts −R into `right`. The
    /// first stage also begins W.
    fn residual(&mut self, first: bool, stays: bool) {
        let Self { joints, w, placed, stresses, is_placed, stages, ports, force, right, drive, loss, .. } = self;
        let Joints { tree, closures, loops, inertias, .. } = &**joints;
        let model = &closures.model;
        if !(stays && *is_placed) {
            placed.place(tree, &stages.argument);
            *is_placed = true;
        }
        let moving = placed.acceleration.iter().zip(&placed.rate);
        for ((force, inertia), (push, speed)) in force.iter_mut().zip(inertias).zip(moving) {
            *force = inertia.force(push, speed);
        }
        if !model.dampers.is_empty() {
            forces::add_dampers(model, |k| placed.rate[k], force);
        }
        let poses = placed.at.as_slice();
        if let Some(loss) = loss {
            loss.add_forces(closures, first, (poses, ApartMembers::default()), |k| placed.rate[k], force);
        }
        if first {
            closures.add_tangent(poses, drive, &mut w.bodies, force);
            if !ports.is_empty() {
                ports.tangent.diagonal.copy_from_slice(&w.bodies.diagonal);
                ports.tangent.below.copy_from_slice(&w.bodies.below);
            }
        } else if ports.is_empty() {
            loops.add_forces(placed, &drive.rest(), force);
            forces::add_couplings(model, poses, force);
            closures.add_body_forces(poses, drive, force);
            model.project(force);
        } else {
            closures.add_tangent(poses, drive, &mut ports.tangent, force);
        }
        if !ports.is_empty() {
            if let Some(loss) = loss {
                loss.add_tangent(&mut ports.tangent);
            }
            ports.force.copy_from_slice(force);
        }
        stresses.fill(tree, &stages.argument, &drive.rest());
        placed.resist(tree, stresses, force, right);
        self.work.forces += 1;
    }

    fn factor(&mut self, gh: f64) -> StepResult {
        let Self { joints, w, placed, geometric, stages, force, loss, .. } = self;
        forces::add_inertia(&joints.closures.model, 1.0 / (gh * gh), 1.0 / gh, &mut w.bodies);
        if let Some(loss) = loss {
            loss.add_matrix(gh, &mut w.bodies);
        }
        let at = |j: usize| {
            let (tile, lane) = place_of(j);
            stages.argument[tile].of(lane)[0]
        };
        geometric::fill(&joints.tree, placed, at, force, geometric);
        w.factor(&joints.tree, placed, 1.0, Some(geometric))?;
        self.work.factorizations += 1;
        Ok(())
    }

    /// Begins what bodies that turn add to a step, where they have been placed at its start. Partials would need its derivative: steps with
    /// sensitivities go without.
    fn turn(&mut self, gh: f64, errors: ErrorBudget) {
        let Self { joints, placed, stages, turning, ports, .. } = self;
        if ports.is_empty() {
            turning.begin(&joints.tree, placed, &stages.argument, gh, errors);
        }
    }

    /// Completes the right side of stage `i` of a step of length `h` (s): `right` holds −R.
    fn inertia(&mut self, i: usize, h: f64) {
        let rate = GAMMA_I[i] * h;
        let Self { joints, stages, turning, right, wrench, forcing, force, loss, .. } = self;
        let Joints { tree, closures, inertias, drags, .. } = &**joints;
        let loses = loss.as_ref().is_some_and(|loss| loss.start.is_nonzero());
        stages.move_bodies(i, h, *drags || loses || turning.counts());
        for ((j, inertia), (wrench, forcing)) in inertias.iter().enumerate().zip(wrench.iter_mut().zip(forcing)) {
            *wrench = Four::from(inertia.force(&stages.push(j), &stages.drift(j)) - *forcing * rate);
        }
        if !closures.model.dampers.is_empty() {
            force.fill(Pose::zeros());
            forces::add_dampers(&closures.model, |k| stages.drift(k), force);
            for (wrench, force) in wrench.iter_mut().zip(force.iter()) {
                *wrench = Four::from(wrench.pose() + *force);
            }
        }
        if let Some(loss) = loss.as_ref().filter(|_| loses) {
            force.fill(Pose::zeros());
            loss.start.add_damping(|k| stages.drift(k), force);
            for (wrench, force) in wrench.iter_mut().zip(force) {
                *wrench = Four::from(wrench.pose() + *force);
            }
        }
        // ∂R/∂t of a heated joint is −K·ė₀
        let rest = self.rate.rest();
        for &j in &tree.heated {
            let link = &tree.links[j as usize];
            let more = link.stiffness.column(0) * (rate * link.offset(&rest));
            let right = &mut right[j as usize];
            *right = Four::from(right.pose() + more);
        }
    }
}

/// A step in joint coordinates under way.
struct JointStep<'a> {
    rodas: &'a mut JointRodas4,
    ramp: &'a Ramp<'a>,
    /// Its start and length (s).
    s: f64,
    h: f64,
    errors: ErrorBudget,
    motion: &'a mut Motion,
    error: &'a mut Motion,
    /// The stage at hand begins where the step before ended.
    stays: bool,
}

impl RosenbrockStep for JointStep<'_> {
    fn begin(&mut self) -> StepResult {
        self.ramp.at_and_rate(self.s, &mut self.rodas.drive, &mut self.rodas.rate);
        self.rodas.drive.load = 1.0;
        Ok(())
    }

    fn drive_at(&mut self, alpha: f64) {
        self.ramp.at(self.s + alpha * self.h, &mut self.rodas.drive);
        self.rodas.drive.load = 1.0;
    }

    fn argument(&mut self, i: usize) {
        let JointRodas4 { stages, carried, .. } = &mut *self.rodas;
        self.stays = stages.begin(i, self.h, &carried[0], &carried[1]);
    }

    fn residual(&mut self, i: usize) {
        self.rodas.residual(i == 0, self.stays);
    }

    fn factor(&mut self) -> StepResult {
        self.rodas.factor(GAMMA * self.h)?;
        self.rodas.turn(GAMMA * self.h, self.errors);
        let JointRodas4 { joints, w, placed, carried, stages, ports, forcing, drive, rate, .. } = &mut *self.rodas;
        stages.set_out(&joints.tree, w, &carried[0], &carried[1]);
        joints.closures.drive_force(&placed.at, drive, rate, forcing);
        ports.begin(joints, self.ramp, self.s, &placed.at, (drive, rate));
        Ok(())
    }

    fn solve(&mut self, i: usize) {
        let (at, h, rate) = (self.s + ALPHA[i] * self.h, self.h, GAMMA_I[i] * self.h);
        self.rodas.inertia(i, h);
        let JointRodas4 {
            joints, w, placed, carried, stages, turning, ports, right, wrench, drive, loss, work, ..
        } = &mut *self.rodas;
        w.solve(wrench, right);
        if turning.counts() {
            stages.fall_behind(i, h);
            let lags = (|j| stages.lag(j), |j| stages.drift(j).z);
            work.solves += turning.complete(joints, w, GAMMA * h, lags, (right, wrench));
        }
        let stage = (&*stages, placed.at.as_slice(), &*drive);
        work.solves += 1 + ports.stage(joints, self.ramp, (i, at, h, rate), stage, (w, loss.as_deref()), &carried[2..]);
        stages.keep(i, right, wrench);
    }

    fn finish(&mut self) {
        let JointRodas4 { joints, placed, carried, stages, ports, sensitivity, .. } = &mut *self.rodas;
        stages.last(self.h, &mut self.error.q, &mut self.error.v);
        let (own, sensitivities) = carried.split_at_mut(2);
        if let [now, push] = own {
            stages.finish(self.h, now, push);
        }
        placed.place(&joints.tree, &stages.argument);
        self.motion.q.copy_from_slice(&placed.at);
        self.motion.v.copy_from_slice(&placed.rate);
        ports.finish(&joints.tree, self.h, stages, sensitivities, sensitivity);
    }
}

impl Method<Bodies<'_>> for JointRodas4 {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn start(&mut self, bodies: &mut Bodies<'_>, motion: &Motion) -> StepResult {
        if std::mem::take(&mut self.resumed) {
            return Ok(());
        }
        bodies.ramp.at(0.0, &mut self.drive);
        self.drive.load = 1.0;
        let now = &mut self.carried[0];
        self.joints.tree.coordinates_at(&motion.q, &mut now.q);
        self.joints.tree.rates_at(&motion.q, &motion.v, &mut now.v);
        self.carried[1].clear();
        self.stages.begin_first(&self.carried[0], &self.carried[1]);
        self.residual(true, false);
        let gh = CONSISTENT * self.shortest;
        self.factor(gh)?;
        self.wrench.fill(Four::ZERO);
        self.w.solve(&mut self.wrench, &mut self.right);
        for (z, x) in self.carried[1].q.iter_mut().zip(&self.right) {
            *z = x.pose() / (gh * gh);
        }
        self.work.solves += 1;
        Ok(())
    }

    fn step(&mut self, bodies: &mut Bodies<'_>, s: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        let errors = bodies.errors;
        let step = &mut JointStep { rodas: self, ramp: bodies.ramp, s, h, errors, motion, error, stays: false };
        rosenbrock::take(step)
    }

    fn carried(&mut self) -> &mut [Motion] {
        &mut self.carried
    }

    fn work(&self) -> SolverCounters {
        self.work
    }
}
