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

#[macro_use]
mod coordinates;
mod circuit;
pub mod lanes;
mod ports;

use super::method::{Method, Motion, SolverCounters, StepFailure, StepResult};
use super::rodas4::tableau::{A, ALPHA, GAMMA};
use super::rosenbrock::{self, CONSISTENT, RosenbrockStep};
use super::stage_loss::StageLoss;
use crate::equations::{Bodies, Joints};
use crate::reduced::check::FullCheck;
use crate::reduced::energy::{EnergyProduct, EnergyVector};
use crate::reduced::enrichment::MotionCorrections;
use crate::reduced::polynomial::motion::{PolynomialForces, PolynomialMotion};
use crate::reduced::statics::solve;
use crate::reduced::{ReducedForces, ReducedSpace};
use bimorph_domains::system::ApartMembers;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::directions::DirectionRows;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, forces};
use coordinates::{ReducedMotion, StageForces, StageRoom, StepMatrices, add_product};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use ports::ReducedPortSensitivities;
use std::sync::Arc;

/// Accepted steps between two estimates of the error by the reduction.
const EVERY: u64 = 20;
/// Accepted steps between two corrections of the first hundred steps: short runs have some, too.
const EVERY_OF_FIRST: u64 = 5;

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
    /// The corrections of the displacements at these states, where they are requested.
    corrections: Option<MotionCorrections>,
}

/// The forces as polynomials, which replace the exact kinematics of stages while their error is within a part of the tolerance.
#[derive(Debug, Clone)]
struct PolynomialStages {
    of: Arc<PolynomialMotion>,
    forces: PolynomialForces,
    /// Motion of the bodies per unit of each direction at rest, those of a body together: near enough for the size of an error.
    moved: Vec<Pose>,
    /// Largest error of z over the largest z, both in the mass norm (1).
    share: f64,
    /// The largest z in that norm, of equilibria of the training or so far.
    largest: f64,
}

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct ReducedRodas4 {
    space: Arc<ReducedSpace>,
    forces: ReducedForces,
    polynomials: Option<Box<PolynomialStages>>,
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
    drag: BodyMatrix,
    loss: Option<Box<StageLoss>>,
    force: Vec<f64>,
    forcing: Vec<f64>,
    right: DVector<f64>,
    product: DVector<f64>,
    stage: StageRoom,
    room: Vec<Pose>,
    gathered: Vec<Four>,
    drive: Drive,
    rate: Drive,
    /// Force over z beside that of the drive at the start of the ramp, and its rate; none: no such. The time at hand after that start (s).
    push: Option<Box<[Vec<f64>; 2]>>,
    time: f64,
    shortest: f64,
    /// Accepted steps.
    taken: u64,
    estimate: Option<Box<ReductionEstimate>>,
    /// Sensitivities, in a circuit. Its stages are those of polynomials throughout.
    ports: Option<Box<ReducedPortSensitivities>>,
    /// The accelerations are those of the motion to come.
    resumed: bool,
    /// The coordinates and their rates are those of the motion to come.
    projected: bool,
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
            polynomials: None,
            taken: 0,
            now: ReducedMotion::zeros(m),
            at: ReducedMotion::zeros(m),
            increments: vec![ReducedMotion::zeros(m); ALPHA.len()],
            carried: vec![Motion::zeros(packed); 2],
            mass: DMatrix::zeros(m, m),
            damping: DMatrix::zeros(m, m),
            stiffness: DMatrix::zeros(m, m),
            factor: None,
            damped: *drags || loss.is_some(),
            drag: BodyMatrix::new(&space.joints.tree.pattern),
            loss,
            force: vec![0.0; m],
            forcing: vec![0.0; m],
            right: DVector::zeros(m),
            product: DVector::zeros(m),
            stage: StageRoom::new(m),
            room: vec![Pose::zeros(); count],
            gathered: vec![Four::ZERO; count],
            drive: closures.electrics.drive(),
            rate: closures.electrics.drive(),
            push: None,
            time: 0.0,
            shortest,
            estimate: None,
            ports: None,
            resumed: false,
            projected: false,
            excess: 0.0,
            work: SolverCounters::default(),
            space,
        }
    }

    /// The same with the estimate of the error by the reduction, from residuals of `system`, the full model.
    #[must_use]
    pub fn with_estimate(mut self, system: &System) -> Self {
        let (check, taken) = (FullCheck::new(system), vec![Pose::zeros(); system.bodies()]);
        let estimate = ReductionEstimate { check, taken, squares: 0.0, count: 0, largest: 0.0, corrections: None };
        self.estimate = Some(Box::new(estimate));
        self
    }

    /// The same with the corrections of the full model along the motion, beside its estimate.
    #[must_use]
    pub fn with_corrections(mut self) -> Self {
        if let Some(estimate) = &mut self.estimate {
            estimate.corrections = Some(MotionCorrections::default());
        }
        self
    }

    /// The same with stages of polynomials whose directions are those of the space. Every some steps they are compared with the exact kinematics, which
    /// take over where the error of the coordinates exceeds `share` of the largest, in the mass norm; that begins with `largest` (√(N·m)·s).
    #[must_use]
    pub fn with_polynomials(mut self, of: PolynomialMotion, share: f64, largest: f64) -> Self {
        let Self { space, forces, .. } = &mut self;
        forces.place_at_rest(space, &vec![0.0; space.size()]);
        let moved = |x: &Vec<Pose>| {
            let mut to = vec![Pose::zeros(); x.len()];
            forces.placed.spread(&space.joints.tree, x, &mut to);
            to
        };
        let by_direction: Vec<Vec<Pose>> = space.directions.iter().map(moved).collect();
        let of_body = |j: usize| by_direction.iter().map(move |moved| moved[j]);
        let moved = (0..space.joints.tree.links.len()).flat_map(of_body).collect();
        let forces = PolynomialForces::new(&of);
        self.polynomials = Some(Box::new(PolynomialStages { of: Arc::new(of), forces, moved, share, largest }));
        self
    }

    /// Whether stages are those of polynomials.
    pub fn has_polynomials(&self) -> bool {
        self.polynomials.is_some()
    }

    /// Estimated root mean square error of the motion by the reduction in the mass norm, of its largest displacement (1); none without an
    /// estimate.
    pub fn error(&self) -> Option<f64> {
        let estimate = self.estimate.as_ref().filter(|estimate| estimate.count > 0 && estimate.largest > 0.0)?;
        Some((estimate.squares / estimate.count as f64).sqrt() / estimate.largest)
    }

    /// The corrections of the full model along the motion; none without [`ReducedRodas4::with_corrections`].
    pub fn corrections(&self) -> Option<&MotionCorrections> {
        self.estimate.as_ref()?.corrections.as_ref()
    }

    /// Coordinates z.
    pub fn coordinates(&self) -> &[f64] {
        self.now.z()
    }

    /// Forces R at `at`; the first stage also begins K.
    fn residual(&mut self, first: bool) {
        let Self { polynomials, at, force, drive, .. } = self;
        match polynomials {
            Some(stages) => stages.forces.residual(&stages.of, at.parts(), drive, force),
            None => self.exact_residual(first),
        }
        if let Some(push) = &self.push {
            let lines = push[0].iter().zip(&push[1]);
            self.force.iter_mut().zip(lines).for_each(|(force, (value, rate))| *force -= value + rate * self.time);
        }
        self.work.forces += 1;
    }

    /// The same by exact kinematics.
    fn exact_residual(&mut self, first: bool) {
        let Self { space, forces, at, loss, force, drive, .. } = self;
        forces.place(space, at.parts());
        forces.set_motion_forces(space);
        if let Some(loss) = loss {
            let (placed, wrench) = forces.placed_and_wrench();
            let at = (&placed.at[..], ApartMembers::default());
            loss.add_forces(&space.joints.closures, first, at, |k| placed.rate[k], wrench);
        }
        if first {
            forces.add_forces_and_tangent(space, drive);
        } else {
            forces.add_forces(space, drive);
        }
        forces.gather(space, drive, force);
    }

    /// M, C and K at the place of the first stage, by exact kinematics.
    fn exact_matrices(&mut self) {
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
    }

    /// M, C and W at the place of the first stage.
    fn factor(&mut self, gh: f64) -> StepResult {
        let Self { polynomials, mass, damping, stiffness, .. } = self;
        match polynomials {
            Some(stages) => stages.forces.matrices(&stages.of, mass, damping, stiffness),
            None => self.exact_matrices(),
        }
        let m = self.mass.nrows();
        let mut w = self.factor.take().map_or_else(|| DMatrix::zeros(m, m), Cholesky::unpack_dirty);
        w.copy_from(&self.mass);
        w /= gh * gh;
        w += &self.stiffness;
        if self.damped {
            self.damping.iter().zip(w.iter_mut()).for_each(|(c, w)| *w += c / gh);
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
        if let Some(stages) = &mut self.polynomials {
            stages.forces.forcing(&stages.of, &self.drive, &self.rate, &mut self.forcing);
            if let Some(push) = &self.push {
                self.forcing.iter_mut().zip(&push[1]).for_each(|(forcing, rate)| *forcing -= rate);
            }
            return;
        }
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
        let Self { mass, damping, damped, factor, at, force, forcing, increments, stage, work, .. } = self;
        if let Some(factor) = factor {
            let damping = damped.then_some(&*damping);
            let step = StepMatrices { mass, damping, factor: factor.l_dirty(), h };
            stage.solve(step, StageForces { i, at, force, forcing }, increments);
        }
        work.solves += 1;
    }

    /// Accelerations that the forces at z and its rate bring.
    fn make_consistent(&mut self) -> StepResult {
        self.now.parts_mut()[2].fill(0.0);
        self.at.copy(&self.now);
        self.residual(true);
        let gh = CONSISTENT * self.shortest;
        self.factor(gh)?;
        self.right.iter_mut().zip(&self.force).for_each(|(right, force)| *right = -force);
        if let Some(factor) = &self.factor {
            factor.solve_mut(&mut self.right);
        }
        let [_, _, w] = self.now.parts_mut();
        w.iter_mut().zip(self.right.iter()).for_each(|(w, x)| *w = x / (gh * gh));
        self.work.solves += 1;
        self.keep();
        Ok(())
    }

    /// Compares the polynomials with the exact kinematics at the motion now, and leaves them where their error is too large.
    fn check_polynomials(&mut self) {
        let Some(mut stages) = self.polynomials.take() else { return };
        let [error, size] = self.compared(&mut stages);
        stages.largest = stages.largest.max(size);
        if error <= stages.share * stages.largest {
            self.polynomials = Some(stages);
            return;
        }
        if self.make_consistent().is_err() {
            self.put_back(); // the next step fails, and says why
        }
        let Self { space, forces, now, .. } = self;
        forces.place(space, now.parts());
    }

    /// The error of z by the polynomials at the motion now, and z, both in the mass norm (√(N·m)·s).
    fn compared(&mut self, stages: &mut PolynomialStages) -> [f64; 2] {
        self.at.copy(&self.now);
        self.exact_residual(false);
        let Self { now, drive, force, forcing, right, product, mass, stiffness, .. } = self;
        stages.forces.residual(&stages.of, now.parts(), drive, forcing);
        right.iter_mut().zip(force.iter().zip(&*forcing)).for_each(|(r, (exact, found))| *r = exact - found);
        let mut norm = |x: &[f64]| {
            product.fill(0.0);
            add_product(mass, x, product.as_mut_slice());
            x.iter().zip(product.iter()).map(|(x, p)| x * p).sum::<f64>().max(0.0).sqrt()
        };
        let error = solve(stiffness, right).map_or(f64::INFINITY, |(off, _)| norm(off.as_slice()));
        [error, norm(now.z())]
    }

    /// Coordinates and rates become those of a motion of the bodies.
    pub fn project(&mut self, motion: &Motion) {
        let found = projected(&self.space, motion);
        self.now.parts_mut().into_iter().zip(&found).for_each(|(to, from)| to.copy_from_slice(from));
    }

    /// Places the bodies at the end of a step.
    fn place_end(&mut self, motion: &mut Motion) {
        let Self { space, forces, now, .. } = self;
        forces.place(space, now.parts());
        motion.q.copy_from_slice(&forces.placed.at);
        motion.v.copy_from_slice(&forces.placed.rate);
        self.keep();
    }

    /// The error of a step, its last increment, over the bodies where they are placed.
    pub(super) fn fill_error(&mut self, error: &mut Motion) {
        let Self { space, forces, increments, room, polynomials, .. } = self;
        let last = &increments[ALPHA.len() - 1];
        let [z, v, _] = last.parts();
        for (u, to) in [(z, &mut error.q), (v, &mut error.v)] {
            if let Some(stages) = polynomials {
                of_size!(u.len(), m => move_bodies(m, &stages.moved, u, to));
            } else {
                space.strains(u, room);
                forces.placed.spread(&space.joints.tree, room, to);
            }
        }
    }

    fn keep(&mut self) {
        self.now.pack(&mut self.carried[..2]);
    }

    fn put_back(&mut self) {
        self.now.unpack(&self.carried[..2]);
    }
}

/// The motion of the bodies with coordinates `u`, from that per unit of each, those of a body together.
#[inline(always)]
fn move_bodies(m: usize, moved: &[Pose], u: &[f64], to: &mut [Pose]) {
    let u = &u[..m];
    for (to, moved) in to.iter_mut().zip(moved.chunks_exact(m)) {
        let mut sum = Pose::zeros();
        moved.iter().zip(u).for_each(|(moved, u)| sum += moved * *u);
        *to = sum;
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

/// A step of a reduced model under way.
struct ReducedStep<'a> {
    rodas: &'a mut ReducedRodas4,
    ramp: &'a Ramp<'a>,
    /// Its start and length (s).
    s: f64,
    h: f64,
    motion: &'a mut Motion,
    error: &'a mut Motion,
}

impl RosenbrockStep for ReducedStep<'_> {
    fn begin(&mut self) -> StepResult {
        self.ramp.at_and_rate(self.s, &mut self.rodas.drive, &mut self.rodas.rate);
        (self.rodas.drive.load, self.rodas.time) = (1.0, self.s);
        Ok(())
    }

    fn drive_at(&mut self, alpha: f64) {
        let time = self.s + alpha * self.h;
        self.ramp.at(time, &mut self.rodas.drive);
        (self.rodas.drive.load, self.rodas.time) = (1.0, time);
    }

    fn argument(&mut self, i: usize) {
        let ReducedRodas4 { now, at, increments, .. } = &mut *self.rodas;
        at.set_sum(now, &A[i], &increments[..i]);
    }

    fn residual(&mut self, i: usize) {
        self.rodas.residual(i == 0);
    }

    fn factor(&mut self) -> StepResult {
        self.rodas.factor(GAMMA * self.h)?;
        self.rodas.fill_forcing();
        let ReducedRodas4 { ports, polynomials, drive, rate, .. } = &mut *self.rodas;
        if let (Some(ports), Some(stages)) = (ports, polynomials) {
            ports.begin((&stages.of, &mut stages.forces), self.ramp, self.s, [drive, rate]);
        }
        Ok(())
    }

    fn solve(&mut self, i: usize) {
        self.rodas.solve_stage(i, self.h);
        self.rodas.solve_ports(self.ramp, (i, self.s + ALPHA[i] * self.h, self.h));
    }

    fn finish(&mut self) {
        let ReducedRodas4 { now, at, increments, .. } = &mut *self.rodas;
        now.set_sum(at, &[1.0], &increments[ALPHA.len() - 1..]);
        self.rodas.place_end(self.motion);
        self.rodas.fill_error(self.error);
        let ReducedRodas4 { ports, carried, .. } = &mut *self.rodas;
        if let Some(ports) = ports {
            ports.finish();
            ports.keep(&mut carried[2..]);
        }
    }
}

impl Method<Bodies<'_>> for ReducedRodas4 {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn start(&mut self, bodies: &mut Bodies<'_>, motion: &Motion) -> StepResult {
        if std::mem::take(&mut self.resumed) {
            return Ok(());
        }
        if !std::mem::take(&mut self.projected) {
            self.project(motion);
        }
        bodies.ramp.at(0.0, &mut self.drive);
        (self.drive.load, self.time) = (1.0, 0.0);
        self.make_consistent()
    }

    fn step(&mut self, bodies: &mut Bodies<'_>, s: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        self.put_back();
        if let Some(ports) = &mut self.ports {
            ports.take(&self.carried[2..]);
        }
        rosenbrock::take(&mut ReducedStep { rodas: self, ramp: bodies.ramp, s, h, motion, error })
    }

    fn accepted(&mut self, bodies: &mut Bodies<'_>, (t, h): (f64, f64), ends: [&Motion; 2], _: &[Motion]) {
        self.excess = self.excess.max(self.space.excess(self.now.z()));
        if self.ports.is_some() {
            return; // a trial depends on its request alone
        }
        self.taken += 1;
        let (system, end, looks) = (bodies.system, ends[1], self.taken % EVERY == 1);
        if looks {
            bodies.ramp.at(t + h, &mut self.drive);
            self.drive.load = 1.0;
            self.check_polynomials();
        }
        let Some(estimate) = &mut self.estimate else { return };
        let norm = |x: &[Pose]| system.model.mass_product(x, x).sqrt();
        estimate.largest = estimate.largest.max(norm(&end.q));
        let is_early = self.taken < 5 * EVERY && self.taken % EVERY_OF_FIRST == 1;
        if !(looks || is_early && estimate.corrections.is_some()) {
            return;
        }
        if !looks {
            bodies.ramp.at(t + h, &mut self.drive);
            self.drive.load = 1.0;
        }
        let ReductionEstimate { check, taken, corrections, largest, .. } = &mut **estimate;
        for (j, (taken, push)) in taken.iter_mut().zip(&self.forces.placed.acceleration).enumerate() {
            *taken = system.model.mass(j).component_mul(push);
        }
        forces::add_damping(&system.model, &end.v, taken);
        system.add_loss(&end.q, |k| end.v[k], taken);
        check.of(system, &end.q, &self.drive, Some(taken));
        let error = norm(check.step());
        if error.is_finite() {
            // a correction beyond the motion is none
            if let Some(corrections) = corrections.as_mut().filter(|_| error < *largest) {
                corrections.add(&self.space.joints.tree, (&end.q, *largest), check.step());
            }
            if looks {
                estimate.squares += error * error;
                estimate.count += 1;
            }
        }
    }

    fn carried(&mut self) -> &mut [Motion] {
        &mut self.carried
    }

    fn work(&self) -> SolverCounters {
        self.work
    }
}
