//! Rodas4: a stiffly accurate Rosenbrock method of order 4 with an embedded estimate of order 3.
//!
//! For M·q̈ + C·q̇ + r(q, t) = 0 with y = (q, v) each of its six stages solves (W)·U = right-hand side with one matrix per
//! step, W = M/(γh)² + C/(γh) + K(q_n): the velocity half is eliminated by hand, and W stays symmetric, so one block
//! factorization and six solves make a step. Nothing iterates and nothing is allocated.
//! ```text
//! r₁ = v_i + Σ c_ij/h·Uq_j                                 v-row of stage i
//! r₂ = −r(q_i, t_i) − C·v_i + M·Σ c_ij/h·Uv_j + γ_i·h·∂F/∂t
//! W·Uq_i = r₂ + (M/(γh) + C)·r₁,   Uv_i = Uq_i/(γh) − r₁
//! ```
//! Its stability function is L-stable: axial motions of stiff beams, a thousand times faster than the step, die out.
//!
//! Sensitivities with respect to the final port voltages go through the same stages with the exact tangent of each, so the
//! partials of a single step are those of the numbers it returns.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.7 and table 7.1 (RODAS).

use super::linear::{LinearSolver, Recursion};
pub use super::method::Motion;
use super::method::{Method, StepFailure, Work};
use crate::gaps::{Drive, Ramp, System};
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, Pattern, forces};

const GAMMA: f64 = 0.25;
/// Stage positions α_i and γ_i.
const ALPHA: [f64; 6] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
const GAMMA_I: [f64; 6] = [0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0];
#[rustfmt::skip]
const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
    [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0],
];
#[rustfmt::skip]
const C: [[f64; 5]; 6] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
    [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
    [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616, 0.0],
    [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
];

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Rodas4<S = Recursion> {
    solver: S,
    w: BlockMatrix<f64, 3>,
    stage_tangent: BlockMatrix<f64, 3>,
    stages: Vec<Motion>,
    at: Motion,
    force: Vec<Pose>,
    forcing: Vec<Pose>,
    scratch: Vec<Pose>,
    change_work: Vec<Pose>,
    drive: Drive,
    rate: Drive,
    change: Drive,
    sources: Vec<usize>,
    ports: Vec<PortStages>,
    /// ∂motion/∂(final voltage of a source), one for each source given to [`Rodas4::new`]; advanced with the motion.
    pub sensitivity: Vec<Motion>,
    work: Work,
}

/// Stage storage of one port's sensitivity.
#[derive(Debug, Clone)]
struct PortStages {
    stages: Vec<Motion>,
    at: Motion,
    forcing: Vec<Pose>,
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
        let n = system.bodies();
        let zeros = vec![Pose::zeros(); n];
        let nothing = Pattern::new(0, &[]);
        let port = |_| PortStages { stages: vec![Motion::zeros(n); 6], at: Motion::zeros(n), forcing: zeros.clone() };
        Self {
            solver,
            w: BlockMatrix::new(&system.model.pattern),
            // only sensitivities need the tangent of every stage
            stage_tangent: BlockMatrix::new(if sources.is_empty() { &nothing } else { &system.model.pattern }),
            stages: vec![Motion::zeros(n); 6],
            at: Motion::zeros(n),
            force: zeros.clone(),
            forcing: zeros.clone(),
            scratch: zeros.clone(),
            change_work: if sources.is_empty() { Vec::new() } else { zeros.clone() },
            drive: system.electrics.drive(),
            rate: system.electrics.drive(),
            change: system.electrics.drive(),
            sources: sources.to_vec(),
            ports: sources.iter().map(port).collect(),
            sensitivity: vec![Motion::zeros(n); sources.len()],
            work: Work::default(),
        }
    }

    /// The step of [`Method::step`], with the sensitivities of `sensitivity` beside the motion.
    #[allow(clippy::too_many_arguments)]
    fn step_with(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
        sensitivity: &mut [Motion],
    ) -> Result<(), StepFailure> {
        let model = &system.model;
        let gh = GAMMA * h;
        ramp.at(s, &mut self.drive);
        self.drive.load = 1.0;
        system.tangent(&motion.q, &self.drive, &mut self.w, &mut self.force);
        if !sensitivity.is_empty() {
            self.stage_tangent.diagonal.copy_from_slice(&self.w.diagonal);
            self.stage_tangent.below.copy_from_slice(&self.w.below);
        }
        forces::add_inertia(model, 1.0 / (gh * gh), 1.0 / gh, &mut self.w);
        model.project_matrix(&mut self.w);
        self.solver.factor(&model.pattern, &mut self.w)?;
        self.work.factorizations += 1;
        self.work.forces += 6;
        ramp.rate(s, &mut self.rate);
        system.drive_force(&motion.q, &self.drive, &self.rate, &mut self.forcing);
        self.forcing_sensitivities(system, ramp, s, motion);
        for i in 0..6 {
            combine(&mut self.at, motion, &self.stages[..i], &A[i]);
            if i > 0 {
                ramp.at(s + ALPHA[i] * h, &mut self.drive);
                if sensitivity.is_empty() {
                    system.residual(&self.at.q, &self.drive, &mut self.force);
                } else {
                    system.tangent(&self.at.q, &self.drive, &mut self.stage_tangent, &mut self.force);
                }
            }
            // sensitivities first: they need this stage's tangent, and `force` is consumed below
            for (p, start) in sensitivity.iter().enumerate() {
                self.sensitivity_stage(system, ramp, s, h, i, p, start);
            }
            forces::add_damping(model, &self.at.v, &mut self.force);
            let (before, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            finish_stage(
                system,
                (&self.solver, &self.w),
                before,
                i,
                h,
                &self.at.v,
                &self.force,
                &self.forcing,
                stage,
                &mut self.scratch,
            );
            self.work.solves += 1;
        }
        // stiffly accurate: the last stage's argument plus its increment is the new value, the increment the error
        motion.copy(&self.at);
        motion.add(1.0, &self.stages[5]);
        error.copy(&self.stages[5]);
        for (p, s) in sensitivity.iter_mut().enumerate() {
            s.copy(&self.ports[p].at);
            s.add(1.0, &self.ports[p].stages[5]);
        }
        Ok(())
    }

    /// ∂(∂r/∂drive·rate)/∂(final voltage) of each port at the start of the step.
    fn forcing_sensitivities(&mut self, system: &System, ramp: &Ramp<'_>, s: f64, motion: &Motion) {
        for (port, &source) in self.ports.iter_mut().zip(&self.sources) {
            ramp.rate_sensitivity(s, source, &mut self.change);
            system.drive_force(&motion.q, &self.drive, &self.change, &mut port.forcing);
            // forces are quadratic in gap voltages: the voltage that rate acts on changes too
            ramp.sensitivity(s, source, &mut self.change);
            self.change.expansion.fill(0.0);
            system.drive_force(&motion.q, &self.rate, &self.change, &mut self.scratch);
            for (f, x) in port.forcing.iter_mut().zip(&self.scratch) {
                *f += x;
            }
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn sensitivity_stage(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        i: usize,
        p: usize,
        start: &Motion,
    ) {
        let port = &mut self.ports[p];
        combine(&mut port.at, start, &port.stages[..i], &A[i]);
        ramp.sensitivity(s + ALPHA[i] * h, self.sources[p], &mut self.change);
        let force = &mut self.scratch;
        system.drive_force(&self.at.q, &self.drive, &self.change, force);
        self.stage_tangent.multiply_add(&system.model.pattern, &port.at.q, force);
        forces::add_damping(&system.model, &port.at.v, force);
        system.model.project(force);
        let force = std::mem::take(&mut self.scratch);
        let (before, rest) = port.stages.split_at_mut(i);
        let mut work = std::mem::take(&mut self.change_work);
        let matrix = (&self.solver, &self.w);
        finish_stage(system, matrix, before, i, h, &port.at.v, &force, &port.forcing, &mut rest[0], &mut work);
        self.scratch = force;
        self.change_work = work;
        self.work.solves += 1;
    }
}

impl<S: LinearSolver> Method for Rodas4<S> {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn step(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> Result<(), StepFailure> {
        let mut sensitivity = std::mem::take(&mut self.sensitivity);
        let done = self.step_with(system, ramp, s, h, motion, error, &mut sensitivity);
        self.sensitivity = sensitivity;
        done
    }

    fn carried(&mut self) -> &mut [Motion] {
        &mut self.sensitivity
    }

    fn work(&self) -> Work {
        self.work
    }
}

/// `at = from + Σ factors[j]·before[j]`, in one pass.
fn combine(at: &mut Motion, from: &Motion, before: &[Motion], factors: &[f64; 5]) {
    for (k, (q, v)) in at.q.iter_mut().zip(&mut at.v).enumerate() {
        let (mut sum_q, mut sum_v) = (from.q[k], from.v[k]);
        for (stage, &factor) in before.iter().zip(factors) {
            sum_q += stage.q[k] * factor;
            sum_v += stage.v[k] * factor;
        }
        (*q, *v) = (sum_q, sum_v);
    }
}

/// Solves one stage: `force` is r + C·v at the stage, `forcing` ∂r/∂t at the start of the step.
#[allow(clippy::too_many_arguments)]
fn finish_stage<S: LinearSolver>(
    system: &System,
    (solver, w): (&S, &BlockMatrix<f64, 3>),
    before: &[Motion],
    i: usize,
    h: f64,
    v: &[Pose],
    force: &[Pose],
    forcing: &[Pose],
    stage: &mut Motion,
    damped: &mut [Pose],
) {
    let model = &system.model;
    let gh = GAMMA * h;
    let c = C[i].map(|c| c / h);
    // r₁ into stage.v, and its damping force into `damped`
    for (k, r1) in stage.v.iter_mut().enumerate() {
        let mut sum = v[k];
        for (u, c) in before.iter().zip(c) {
            sum += u.q[k] * c;
        }
        *r1 = sum;
    }
    damped.fill(Pose::zeros());
    forces::add_damping(model, &stage.v, damped);
    for (k, b) in stage.q.iter_mut().enumerate() {
        let mut momentum = stage.v[k] / gh;
        for (u, c) in before.iter().zip(c) {
            momentum += u.v[k] * c;
        }
        *b = damped[k] - force[k] - forcing[k] * (GAMMA_I[i] * h) + model.mass(k).component_mul(&momentum);
    }
    model.project(&mut stage.q);
    solver.solve(&model.pattern, w, &mut stage.q);
    for (r1, u) in stage.v.iter_mut().zip(&stage.q) {
        *r1 = u / gh - *r1;
    }
    model.project(&mut stage.v);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::{CompileOptions, compile};
    use crate::netlist::Bundle;

    /// A lumped plate that a ramp of 2 V to 4 V pulls at (k = 1 N/m, m = 1e-10 kg, A = 1e-8 m², g = 2 µm).
    const PLATE: &str = "
        anchor * [f] [l=1u w=1u h=1u]
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        damper2d * [f m] [bx=2e-6]
        anchor * [e] [l=1u w=1u h=1u]
        plategap2d * [m e] [A=1e-8 gap=2u]
        eground * [e] []
        drive port * [m e] []";

    fn run(steps: usize, end: f64) -> (f64, f64) {
        let compiled = compile(&Bundle::from_text("plate", PLATE), &CompileOptions::default()).unwrap();
        let system = &compiled.parts.system;
        let mut rodas = Rodas4::new(system, &[0]);
        let (mut motion, mut error) = (Motion::zeros(1), Motion::zeros(1));
        let (from, to) = ([2.0], [end]);
        let ramp = Ramp { electrics: &system.electrics, from: &from, to: &to, rise: &[], dt: 4e-5 };
        let h = ramp.dt / steps as f64;
        for k in 0..steps {
            let s = k as f64 * h;
            rodas.step(system, &ramp, s, h, &mut motion, &mut error).unwrap();
        }
        assert_eq!((rodas.work.factorizations, rodas.work.solves), (steps as u64, 12 * steps as u64));
        (motion.q[0].x, rodas.sensitivity[0].q[0].x)
    }

    /// Halving the step divides the error by about 2⁴ on a nonlinear, driven oscillator.
    #[test]
    fn order_four() {
        let fine = run(3200, 4.0).0;
        let errors: Vec<f64> = [50, 100, 200].map(|n| (run(n, 4.0).0 - fine).abs()).to_vec();
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((3.7..4.6).contains(&order), "{order} of {errors:?}");
        }
    }

    /// The sensitivity of a single step is the derivative of its result (central difference of 1 mV, 1e-7 relative); over
    /// many steps it leaves out how later Jacobians depend on the voltage, an effect of the size of the step's own error.
    #[test]
    fn sensitivities() {
        for (steps, tolerance) in [(1, 1e-7), (200, 1e-4)] {
            let difference = (run(steps, 4.001).0 - run(steps, 3.999).0) / 2e-3;
            let carried = run(steps, 4.0).1;
            assert!((carried / difference - 1.0).abs() < tolerance, "{steps}: {carried:e} {difference:e}");
        }
    }
}
