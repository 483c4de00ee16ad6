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

use crate::gaps::{Drive, Ramp, System};
use crate::multibody::factor::ZeroPivot;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, forces};

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

/// Displacements and rates, or changes of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Displacements.
    pub q: Vec<Pose>,
    /// Rates.
    pub v: Vec<Pose>,
}

impl Motion {
    /// All zero.
    pub fn zeros(bodies: usize) -> Self {
        Self { q: vec![Pose::zeros(); bodies], v: vec![Pose::zeros(); bodies] }
    }

    fn copy(&mut self, from: &Self) {
        self.q.copy_from_slice(&from.q);
        self.v.copy_from_slice(&from.v);
    }

    fn add(&mut self, factor: f64, other: &Self) {
        if factor != 0.0 {
            for (a, b) in self.q.iter_mut().zip(&other.q) {
                *a += b * factor;
            }
            for (a, b) in self.v.iter_mut().zip(&other.v) {
                *a += b * factor;
            }
        }
    }
}

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Rodas4 {
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
    ports: Vec<PortStages>,
    /// Factorizations so far.
    pub factorizations: u64,
    /// Solves so far.
    pub solves: u64,
}

/// Stage storage of one port's sensitivity.
#[derive(Debug, Clone)]
struct PortStages {
    stages: Vec<Motion>,
    at: Motion,
    forcing: Vec<Pose>,
}

impl Rodas4 {
    /// Storage for a system; `ports` sensitivities can be carried along.
    pub fn new(system: &System, ports: usize) -> Self {
        let n = system.bodies();
        let zeros = vec![Pose::zeros(); n];
        let stages = vec![Motion::zeros(n); 6];
        let port = PortStages { stages: stages.clone(), at: Motion::zeros(n), forcing: zeros.clone() };
        Self {
            w: BlockMatrix::new(&system.model.pattern),
            stage_tangent: BlockMatrix::new(&system.model.pattern),
            stages,
            at: Motion::zeros(n),
            force: zeros.clone(),
            forcing: zeros.clone(),
            scratch: zeros.clone(),
            change_work: zeros,
            drive: system.electrics.drive(),
            rate: system.electrics.drive(),
            change: system.electrics.drive(),
            ports: vec![port; ports],
            factorizations: 0,
            solves: 0,
        }
    }

    #[allow(clippy::too_many_arguments)]
    /// One step of length `h` from `motion` at time `s` of the ramp. The new motion replaces `motion`, and `error` receives
    /// the embedded estimate. `sensitivity[p]` holds ∂motion/∂(final voltage of source `ports[p]`) and is advanced too.
    ///
    /// # Errors
    /// [`ZeroPivot`] when W cannot be factored; `motion` is then unchanged.
    pub fn step(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
        ports: &[usize],
        sensitivity: &mut [Motion],
    ) -> Result<(), ZeroPivot> {
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
        self.w.factor(&model.pattern)?;
        self.factorizations += 1;
        ramp.rate(s, &mut self.rate);
        system.drive_force(&motion.q, &self.drive, &self.rate, &mut self.forcing);
        self.forcing_sensitivities(system, ramp, s, motion, ports);
        for i in 0..6 {
            self.at.copy(motion);
            for (stage, a) in self.stages[..i].iter().zip(A[i]) {
                self.at.add(a, stage);
            }
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
                self.sensitivity_stage(system, ramp, s, h, i, (p, ports[p]), start);
            }
            forces::add_damping(model, &self.at.v, &mut self.force);
            let (before, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            finish_stage(
                system,
                &self.w,
                before,
                i,
                h,
                &self.at.v,
                &self.force,
                &self.forcing,
                stage,
                &mut self.scratch,
            );
            self.solves += 1;
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
    fn forcing_sensitivities(&mut self, system: &System, ramp: &Ramp<'_>, s: f64, motion: &Motion, sources: &[usize]) {
        for (port, &source) in self.ports.iter_mut().zip(sources) {
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
        (p, source): (usize, usize),
        start: &Motion,
    ) {
        let port = &mut self.ports[p];
        port.at.copy(start);
        for (stage, a) in port.stages[..i].iter().zip(A[i]) {
            port.at.add(a, stage);
        }
        ramp.sensitivity(s + ALPHA[i] * h, source, &mut self.change);
        let force = &mut self.scratch;
        system.drive_force(&self.at.q, &self.drive, &self.change, force);
        self.stage_tangent.multiply_add(&system.model.pattern, &port.at.q, force);
        forces::add_damping(&system.model, &port.at.v, force);
        system.model.project(force);
        let force = std::mem::take(&mut self.scratch);
        let (before, rest) = port.stages.split_at_mut(i);
        let mut work = std::mem::take(&mut self.change_work);
        finish_stage(system, &self.w, before, i, h, &port.at.v, &force, &port.forcing, &mut rest[0], &mut work);
        self.scratch = force;
        self.change_work = work;
        self.solves += 1;
    }
}

/// Solves one stage: `force` is r + C·v at the stage, `forcing` ∂r/∂t at the start of the step.
#[allow(clippy::too_many_arguments)]
fn finish_stage(
    system: &System,
    w: &BlockMatrix<f64, 3>,
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
    // r₁ into stage.v, and its damping force into `damped`
    for (k, r1) in stage.v.iter_mut().enumerate() {
        *r1 = v[k];
        for (j, u) in before.iter().enumerate() {
            *r1 += u.q[k] * (C[i][j] / h);
        }
    }
    damped.fill(Pose::zeros());
    forces::add_damping(model, &stage.v, damped);
    for (k, b) in stage.q.iter_mut().enumerate() {
        let mut momentum = stage.v[k] / gh;
        for (j, u) in before.iter().enumerate() {
            momentum += u.v[k] * (C[i][j] / h);
        }
        *b = damped[k] - force[k] - forcing[k] * (GAMMA_I[i] * h) + model.mass(k).component_mul(&momentum);
    }
    model.project(&mut stage.q);
    w.solve(&model.pattern, &mut stage.q);
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
        let mut rodas = Rodas4::new(system, 1);
        let (mut motion, mut error) = (Motion::zeros(1), Motion::zeros(1));
        let mut sensitivity = vec![Motion::zeros(1)];
        let (from, to) = ([2.0], [end]);
        let ramp = Ramp { electrics: &system.electrics, from: &from, to: &to, rise: &[], dt: 4e-5 };
        let h = ramp.dt / steps as f64;
        for k in 0..steps {
            let s = k as f64 * h;
            rodas.step(system, &ramp, s, h, &mut motion, &mut error, &[0], &mut sensitivity).unwrap();
        }
        assert_eq!((rodas.factorizations, rodas.solves), (steps as u64, 12 * steps as u64));
        (motion.q[0].x, sensitivity[0].q[0].x)
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
