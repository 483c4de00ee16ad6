//! Rodas4 over the coordinates z of a reduced model: kinematics through the tree stays exact, and every solve is m wide.
//!
//! With v the rates and w the accelerations the motion is ż = v, v̇ = w, 0 = R(z, v, w, t), as in
//! [`joint_rodas4`](super::joint_rodas4), with the force R over z that the motion would take. In the variables U of a Rosenbrock method
//! ```text
//! r₁ = v_i + Σ c_ij/h·Uz_j          r₂ = w_i + Σ c_ij/h·Uv_j
//! W·Uz = −R(z_i, v_i, w_i, t_i) − γ_i·h·∂R/∂t + M·(r₁/(γh) + r₂) + C·r₁          W = M/(γh)² + C/(γh) + K
//! Uv = Uz/(γh) − r₁                 Uw = Uv/(γh) − r₂
//! ```
//! M = Vᵀ·m·V and C = Vᵀ·c·V come from the motion V of the bodies per unit of z at the start of the step. K is the exact tangent of the
//! forces, with the stiffness that forces and inertia bring to the joints. The derivatives of M and of the forces quadratic in rates are
//! omitted: they are small where joints rotate little in a step.
//!
//! To its caller the motion is that of the bodies; the start is projected onto the directions in the energy at rest.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.7 (RODAS).

use super::method::{Method, Motion, SolverCounters, StepFailure};
use super::rodas4::tableau::{A, ALPHA, C, GAMMA, GAMMA_I, moves_on};
use super::stage_loss::StageLoss;
use crate::equations::{Bodies, Joints};
use crate::reduced::check::FullCheck;
use crate::reduced::energy::{EnergyProduct, EnergyVector};
use crate::reduced::{ReducedForces, ReducedSpace};
use bimorph_domains::{Drive, System};
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::directions::DirectionRows;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BlockMatrix, forces};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::sync::Arc;

/// Stages of the method.
const STAGES: usize = 6;
/// Fraction of the shortest time at which accelerations are made consistent.
const CONSISTENT: f64 = 1e-3;

/// Accepted steps between two estimates of the error by the reduction.
const EVERY: u64 = 20;

/// The error by the reduction, from the residual of the full model at states of the motion.
///
/// The full tangent turns the residual, inertia included, into a displacement. That is the error of all that follows its springs; the
/// error of motions at their own frequency may be a few times that.
#[derive(Debug, Clone)]
struct ReductionEstimate {
    check: FullCheck,
    /// Forces of inertia, drag and contact at a state.
    taken: Vec<Pose>,
    /// Sum of the squares of the errors in the mass norm (kg·m²), their number, and the largest displacement so far in that norm (√kg·m).
    squares: f64,
    count: u64,
    largest: f64,
    steps: u64,
}

/// Coordinates, rates and accelerations.
#[derive(Debug, Clone)]
struct ReducedMotion {
    z: Vec<f64>,
    v: Vec<f64>,
    w: Vec<f64>,
}

impl ReducedMotion {
    fn zeros(m: usize) -> Self {
        Self { z: vec![0.0; m], v: vec![0.0; m], w: vec![0.0; m] }
    }

    fn all(&mut self) -> [&mut Vec<f64>; 3] {
        [&mut self.z, &mut self.v, &mut self.w]
    }
}

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct ReducedRodas4 {
    space: Arc<ReducedSpace>,
    forces: ReducedForces,
    now: ReducedMotion,
    at: ReducedMotion,
    /// Increments of z, v and w in each stage.
    increments: Vec<ReducedMotion>,
    /// `now` as the caller keeps it: z and v, then w, three numbers to a pose.
    carried: Vec<Motion>,
    mass: DMatrix<f64>,
    damping: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
    /// Something drags on bodies, or contact loses.
    damped: bool,
    drag: BlockMatrix<f64, 3>,
    loss: Option<Box<StageLoss>>,
    force: Vec<f64>,
    forcing: Vec<f64>,
    right: DVector<f64>,
    room: Vec<Pose>,
    gathered: Vec<Four>,
    drive: Drive,
    rate: Drive,
    shortest: f64,
    estimate: Option<Box<ReductionEstimate>>,
    /// Largest excess over the trained states so far, see [`ReducedSpace::excess`].
    pub excess: f64,
    work: SolverCounters,
}

impl ReducedRodas4 {
    /// Storage for a space; `shortest` is about the shortest time in which something moves (s).
    pub fn new(space: Arc<ReducedSpace>, shortest: f64) -> Self {
        let (m, count) = (space.size(), space.joints.tree.links.len());
        let Joints { closures, drags, .. } = &*space.joints;
        let loss = StageLoss::new(closures, false).map(Box::new);
        let packed = m.div_ceil(3);
        Self {
            forces: ReducedForces::new(&space),
            now: ReducedMotion::zeros(m),
            at: ReducedMotion::zeros(m),
            increments: vec![ReducedMotion::zeros(m); STAGES],
            carried: vec![Motion::zeros(packed); 2],
            mass: DMatrix::zeros(m, m),
            damping: DMatrix::zeros(m, m),
            stiffness: DMatrix::zeros(m, m),
            factor: None,
            damped: *drags || loss.is_some(),
            drag: BlockMatrix::new(&space.joints.tree.pattern),
            loss,
            force: vec![0.0; m],
            forcing: vec![0.0; m],
            right: DVector::zeros(m),
            room: vec![Pose::zeros(); count],
            gathered: vec![Four::ZERO; count],
            drive: closures.electrics.drive(),
            rate: closures.electrics.drive(),
            shortest,
            estimate: None,
            excess: 0.0,
            work: SolverCounters::default(),
            space,
        }
    }

    /// The same with the estimate of the error by the reduction, from residuals of `system`, the full model.
    #[must_use]
    pub fn with_estimate(mut self, system: &System) -> Self {
        let (check, taken) = (FullCheck::new(system), vec![Pose::zeros(); system.bodies()]);
        let estimate = ReductionEstimate { check, taken, squares: 0.0, count: 0, largest: 0.0, steps: 0 };
        self.estimate = Some(Box::new(estimate));
        self
    }

    /// Estimated root mean square error of the motion by the reduction in the mass norm, of its largest displacement (1); none without an
    /// estimate.
    pub fn error(&self) -> Option<f64> {
        let estimate = self.estimate.as_ref().filter(|estimate| estimate.count > 0 && estimate.largest > 0.0)?;
        Some((estimate.squares / estimate.count as f64).sqrt() / estimate.largest)
    }

    /// Coordinates z.
    pub fn coordinates(&self) -> &[f64] {
        &self.now.z
    }

    /// Forces R at `at`; the first stage also begins K.
    fn residual(&mut self, first: bool) {
        let Self { space, forces, at, loss, force, drive, .. } = self;
        forces.place(space, [&at.z, &at.v, &at.w]);
        forces.set_motion_forces(space);
        if let Some(loss) = loss {
            let (placed, wrench) = forces.placed_and_wrench();
            loss.add_forces(&space.joints.closures, first, &placed.at, |k| placed.rate[k], wrench);
        }
        if first {
            forces.add_forces_and_tangent(space, drive);
        } else {
            forces.add_forces(space, drive);
        }
        forces.gather(space, drive, force);
        self.work.forces += 1;
    }

    /// M, C and W at the place of the first stage.
    fn factor(&mut self, gh: f64) -> Result<(), StepFailure> {
        let Self { space, forces, loss, drag, .. } = self;
        let model = &space.joints.closures.model;
        forces.stiffness(space, &mut self.stiffness);
        let mut add = |product: &dyn Fn(&mut DirectionRows, &DirectionRows), to: &mut DMatrix<f64>| {
            product(&mut forces.product, &forces.moved);
            forces.moved.add_products(&forces.product, to);
        };
        self.mass.fill(0.0);
        add(&|product, moved| product.scale(|j| model.mass(j), moved), &mut self.mass);
        if self.damped {
            drag.clear();
            forces::add_inertia(model, 0.0, 1.0, drag);
            if let Some(loss) = loss {
                loss.start.add_to([0.0, 1.0], drag);
            }
            self.damping.fill(0.0);
            add(&|product, moved| product.multiply(&model.pattern, drag, moved), &mut self.damping);
            if let Some(loss) = loss {
                drag.clear();
                loss.start.add_to([1.0, 0.0], drag);
                add(&|product, moved| product.multiply(&model.pattern, drag, moved), &mut self.stiffness);
            }
        }
        let mut w = &self.mass / (gh * gh) + &self.stiffness;
        if self.damped {
            w += &self.damping / gh;
        }
        self.factor = Cholesky::new(w);
        self.work.factorizations += 1;
        match self.factor {
            Some(_) => Ok(()),
            None => Err(StepFailure::Singular(ZeroPivot { body: 0, direction: 0 })),
        }
    }

    /// ∂R/∂t over z, after [`ReducedRodas4::factor`].
    fn fill_forcing(&mut self) {
        let Self { space, forces, forcing, drive, rate, room, gathered, .. } = self;
        let Joints { closures, tree, .. } = &*space.joints;
        closures.drive_force(&forces.placed.at, drive, rate, room);
        for (to, from) in gathered.iter_mut().zip(room.iter()) {
            *to = Four::from(-*from);
        }
        forces.moved.gather(gathered, forcing);
        let rest = rate.rest();
        for (forcing, direction) in forcing.iter_mut().zip(&space.directions) {
            for &j in &tree.heated {
                let link = &tree.links[j as usize];
                let stress = link.stiffness.column(0) * link.offset(&rest);
                *forcing -= direction[j as usize].dot(&stress);
            }
        }
    }

    fn solve_stage(&mut self, i: usize, h: f64) {
        let (gh, shift) = (GAMMA * h, GAMMA_I[i] * h);
        let m = self.space.size();
        let (r1, r2) = {
            let (mut r1, mut r2) = (DVector::from_column_slice(&self.at.v), DVector::from_column_slice(&self.at.w));
            for (j, u) in self.increments[..i].iter().enumerate() {
                for k in 0..m {
                    r1[k] += C[i][j] / h * u.z[k];
                    r2[k] += C[i][j] / h * u.v[k];
                }
            }
            (r1, r2)
        };
        self.right = &self.mass * (&r1 / gh + &r2);
        if self.damped {
            self.right += &self.damping * &r1;
        }
        for k in 0..m {
            self.right[k] -= self.force[k] + shift * self.forcing[k];
        }
        if let Some(factor) = &self.factor {
            factor.solve_mut(&mut self.right);
        }
        self.work.solves += 1;
        let u = &mut self.increments[i];
        for k in 0..m {
            u.z[k] = self.right[k];
            u.v[k] = u.z[k] / gh - r1[k];
            u.w[k] = u.v[k] / gh - r2[k];
        }
    }

    fn keep(&mut self) {
        let Self { carried, now, .. } = self;
        let [position, push] = &mut carried[..] else { return };
        for (to, from) in [(&mut position.q, &now.z), (&mut position.v, &now.v), (&mut push.q, &now.w)] {
            from.iter().enumerate().for_each(|(k, x)| to[k / 3][k % 3] = *x);
        }
    }

    fn put_back(&mut self) {
        let Self { carried, now, .. } = self;
        let [position, push] = &carried[..] else { return };
        for (to, from) in now.all().into_iter().zip([&position.q, &position.v, &push.q]) {
            to.iter_mut().enumerate().for_each(|(k, x)| *x = from[k / 3][k % 3]);
        }
    }
}

/// z and its rate of a motion of the bodies, by projection in the energy at rest.
pub fn projected(space: &ReducedSpace, motion: &Motion) -> [Vec<f64>; 2] {
    let (tree, count) = (&space.joints.tree, motion.q.len());
    let product = EnergyProduct::at_rest(&space.joints);
    let basis: Vec<EnergyVector> = space.directions.iter().map(|x| product.of(x.clone())).collect();
    let (mut s, mut rates) = (vec![Pose::zeros(); count], vec![Pose::zeros(); count]);
    tree.coordinates_at(&motion.q, &mut s);
    tree.rates_at(&motion.q, &motion.v, &mut rates);
    [s, rates].map(|x| {
        let x = product.of(x);
        basis.iter().map(|b| product.product(b, &x)).collect()
    })
}

impl Method<Bodies<'_>> for ReducedRodas4 {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn start(&mut self, bodies: &mut Bodies<'_>, motion: &Motion) -> Result<(), StepFailure> {
        let [z, v] = projected(&self.space, motion);
        (self.now.z, self.now.v) = (z, v);
        self.now.w.fill(0.0);
        bodies.ramp.at(0.0, &mut self.drive);
        self.drive.load = 1.0;
        self.at.clone_from(&self.now);
        self.residual(true);
        let gh = CONSISTENT * self.shortest;
        self.factor(gh)?;
        self.right.iter_mut().zip(&self.force).for_each(|(right, force)| *right = -force);
        if let Some(factor) = &self.factor {
            factor.solve_mut(&mut self.right);
        }
        self.now.w.iter_mut().zip(self.right.iter()).for_each(|(w, x)| *w = x / (gh * gh));
        self.work.solves += 1;
        self.keep();
        Ok(())
    }

    fn step(
        &mut self,
        bodies: &mut Bodies<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> Result<(), StepFailure> {
        self.put_back();
        let (gh, ramp) = (GAMMA * h, bodies.ramp);
        for i in 0..STAGES {
            if i == 0 {
                ramp.at_and_rate(s, &mut self.drive, &mut self.rate);
            } else if moves_on(i) {
                ramp.at(s + ALPHA[i] * h, &mut self.drive);
            }
            self.drive.load = 1.0;
            self.at.clone_from(&self.now);
            for (j, u) in self.increments[..i].iter().enumerate() {
                let [z, v, w] = self.at.all();
                for (to, u) in [(z, &u.z), (v, &u.v), (w, &u.w)] {
                    to.iter_mut().zip(u).for_each(|(to, u)| *to += A[i][j] * u);
                }
            }
            self.residual(i == 0);
            if i == 0 {
                self.factor(gh)?;
                self.fill_forcing();
            }
            self.solve_stage(i, h);
        }
        // stiffly accurate: the last argument plus its increment is the new value, the increment the error
        let last = &self.increments[STAGES - 1];
        for ((now, at), u) in self.now.all().into_iter().zip(self.at.all()).zip([&last.z, &last.v, &last.w]) {
            now.iter_mut().zip(at.iter()).zip(u).for_each(|((now, at), u)| *now = at + u);
        }
        self.forces.place(&self.space, [&self.now.z, &self.now.v, &self.now.w]);
        motion.q.copy_from_slice(&self.forces.placed.at);
        motion.v.copy_from_slice(&self.forces.placed.rate);
        let tree = &self.space.joints.tree;
        for (u, to) in [(&last.z, &mut error.q), (&last.v, &mut error.v)] {
            self.space.strains(u, &mut self.room);
            self.forces.placed.spread(tree, &self.room, to);
        }
        self.keep();
        Ok(())
    }

    fn accepted(&mut self, bodies: &mut Bodies<'_>, (t, h): (f64, f64), ends: [&Motion; 2], _: &[Motion]) {
        self.excess = self.excess.max(self.space.excess(&self.now.z));
        let Some(estimate) = &mut self.estimate else { return };
        let (system, end) = (bodies.system, ends[1]);
        let norm = |x: &[Pose]| system.model.mass_product(x, x).sqrt();
        estimate.largest = estimate.largest.max(norm(&end.q));
        estimate.steps += 1;
        if estimate.steps % EVERY != 1 {
            return;
        }
        let ReductionEstimate { check, taken, .. } = &mut **estimate;
        for (j, (taken, push)) in taken.iter_mut().zip(&self.forces.placed.acceleration).enumerate() {
            *taken = system.model.mass(j).component_mul(push);
        }
        forces::add_damping(&system.model, &end.v, taken);
        system.add_loss(&end.q, |k| end.v[k], taken);
        bodies.ramp.at(t + h, &mut self.drive);
        self.drive.load = 1.0;
        check.of(system, &end.q, &self.drive, Some(taken));
        let error = norm(check.step());
        if error.is_finite() {
            estimate.squares += error * error;
            estimate.count += 1;
        }
    }

    fn carried(&mut self) -> &mut [Motion] {
        &mut self.carried
    }

    fn work(&self) -> SolverCounters {
        self.work
    }
}
