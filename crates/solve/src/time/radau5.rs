//! Radau IIA with three stages: order 5, L-stable, stiffly accurate, with an embedded estimate of order 3.
//!
//! The stages Z_i = Y_i − y₀ of y = (q, v) satisfy A⁻¹/h·Z = f(y₀ + Z). With T⁻¹A⁻¹T block diagonal (one real
//! eigenvalue λ, one pair μ, μ̄) and W = T⁻¹Z, a simplified Newton iteration with the tangent K at the start of the
//! step splits into two systems. One is real and one complex, and each is reduced to displacements by hand:
//! ```text
//! (λI − J)·(Δq, Δv) = (a, M⁻¹b):      (λ²·M + λ·C + K)·Δq = b + (λ·M + C)·a,      Δv = λ·Δq − a
//! ```
//! and the same with μ. So a step costs one real and one complex block factorization, both symmetric on the pattern of K.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.8; coefficients of its RADAU5.

use super::method::{Method, Motion, SolverCounters, StepFailure, StepResult};
use crate::equations::Bodies;
use crate::equations::newton::largest;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, forces};
use nalgebra::{Complex, Matrix3, Vector3};

/// Stage times: (4 ∓ √6)/10 and 1.
const NODES: [f64; 3] = [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0];
#[rustfmt::skip]
const T: [[f64; 3]; 3] = [
    [9.123_239_487_089_294e-2, -0.141_255_295_020_954_2, -3.002_919_410_514_742_4e-2],
    [0.241_717_932_707_107, 0.204_129_352_293_799_93, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
#[rustfmt::skip]
const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_87, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_44],
    [-0.502_872_634_945_786_9, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];
/// λ·h, and real and imaginary part of μ·h.
const LAMBDA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752_3;
const BETA: f64 = 3.050_430_199_247_410_5;
/// Weights of the error estimate: −(13 ± 7√6)/3 and −1/3.
const ESTIMATE: [f64; 3] = [-10.048_809_399_827_414, 1.382_142_733_160_748, -1.0 / 3.0];

/// Next correction allowed, relative to the displacement.
const TOLERANCE: f64 = 1e-11;
/// Corrections below this fraction that no longer shrink are rounding.
const STALLED: f64 = 1e-9;
/// Most iterations.
const MAX_ITERATIONS: usize = 15;

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Radau5 {
    tangent: BodyMatrix,
    damping: BodyMatrix,
    /// Derivatives of what contact loses with displacements and rates at the start of the step; none where it loses nothing.
    loss: Option<LossDerivatives>,
    real: BodyMatrix,
    complex: BodyMatrix<Complex<f64>>,
    /// Z and W.
    stages: [Motion; 3],
    transformed: [Motion; 3],
    /// f at the stages, rates as forces; then transformed residuals; then corrections.
    slopes: [Motion; 3],
    residuals: [Motion; 3],
    pair: Vec<Vector3<Complex<f64>>>,
    start_force: Vec<Pose>,
    at: Motion,
    drive: Drive,
    work: SolverCounters,
}

impl Radau5 {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        let n = system.bodies();
        let pattern = &system.model.pattern;
        let three = || std::array::from_fn(|_| Motion::zeros(n));
        let mut damping = BodyMatrix::new(pattern);
        forces::add_inertia(&system.model, 0.0, 1.0, &mut damping);
        Self {
            tangent: BodyMatrix::new(pattern),
            damping,
            loss: LossDerivatives::of(system),
            real: BodyMatrix::new(pattern),
            complex: BodyMatrix::new(pattern),
            stages: three(),
            transformed: three(),
            slopes: three(),
            residuals: three(),
            pair: vec![Vector3::zeros(); n],
            start_force: vec![Pose::zeros(); n],
            at: Motion::zeros(n),
            drive: system.electrics.drive(),
            work: SolverCounters::default(),
        }
    }

    /// Factors λ²·M + λ·C + K and μ²·M + μ·C + K.
    fn factor(&mut self, system: &System, h: f64) -> StepResult {
        let model = &system.model;
        let lambda = LAMBDA / h;
        self.real.diagonal.copy_from_slice(&self.tangent.diagonal);
        self.real.below.copy_from_slice(&self.tangent.below);
        forces::add_inertia(model, lambda * lambda, lambda, &mut self.real);
        if let Some(by_rate) = self.loss.as_ref().and_then(LossDerivatives::damping) {
            by_rate.add_to(lambda, &mut self.real);
        }
        model.project_matrix(&mut self.real);
        self.real.factor(&model.pattern)?;
        let mu = Complex::new(ALPHA, BETA) / h;
        let blend = |k: &Matrix3<f64>, c: &Matrix3<f64>| k.zip_map(c, |k, c| mu * c + k);
        let (complex, tangent, damping) = (&mut self.complex, &self.tangent, &self.damping);
        for (out, (k, c)) in complex.diagonal.iter_mut().zip(tangent.diagonal.iter().zip(&damping.diagonal)) {
            *out = blend(k, c);
        }
        for (out, (k, c)) in complex.below.iter_mut().zip(tangent.below.iter().zip(&damping.below)) {
            *out = blend(k, c);
        }
        if let Some(by_rate) = self.loss.as_ref().and_then(LossDerivatives::damping) {
            let scaled = |c: &Matrix3<f64>| c.map(|c| mu * c);
            complex.diagonal.iter_mut().zip(&by_rate.diagonal).for_each(|(out, c)| *out += scaled(c));
            complex.below.iter_mut().zip(&by_rate.below).for_each(|(out, c)| *out += scaled(c));
        }
        for (j, block) in complex.diagonal.iter_mut().enumerate() {
            let mass = model.mass(j);
            for i in 0..3 {
                block[(i, i)] += mu * mu * mass[i];
            }
        }
        model.project_matrix(complex);
        complex.factor(&model.pattern)?;
        self.work.factorizations += 2;
        Ok(())
    }

    /// Solves (λI − J)·(Δq, Δv) = (a, M⁻¹b) in place: (a, b) in, (Δq, Δv) out.
    fn solve_real(&mut self, system: &System, lambda: f64, x: &mut Motion) {
        let model = &system.model;
        let rhs = &mut self.at.q;
        for (k, out) in rhs.iter_mut().enumerate() {
            *out = x.v[k] + model.mass(k).component_mul(&x.q[k]) * lambda;
        }
        forces::add_damping(model, &x.q, rhs);
        if let Some(loss) = &self.loss {
            loss.add_damping(|k| x.q[k], rhs);
        }
        model.project(rhs);
        self.real.solve(&model.pattern, rhs);
        for (k, q) in rhs.iter().enumerate() {
            x.v[k] = q * lambda - x.q[k];
            x.q[k] = *q;
        }
        model.project(&mut x.v);
        self.work.solves += 1;
    }

    /// The same with μ, for (a, b) = re + i·im.
    fn solve_complex(&mut self, system: &System, mu: Complex<f64>, re: &mut Motion, im: &mut Motion) {
        let model = &system.model;
        // C·a: real part in at.q, imaginary part in at.v
        self.at.clear();
        forces::add_damping(model, &re.q, &mut self.at.q);
        forces::add_damping(model, &im.q, &mut self.at.v);
        if let Some(loss) = &self.loss {
            loss.add_damping(|k| re.q[k], &mut self.at.q);
            loss.add_damping(|k| im.q[k], &mut self.at.v);
        }
        for (k, out) in self.pair.iter_mut().enumerate() {
            let mass = model.mass(k);
            *out = Vector3::from_fn(|i, _| {
                let a = Complex::new(re.q[k][i], im.q[k][i]);
                let b = Complex::new(re.v[k][i], im.v[k][i]);
                let drag = Complex::new(self.at.q[k][i], self.at.v[k][i]);
                b + mu * a * mass[i] + drag
            });
            if let Some(free) = &model.bodies[k].free {
                *out = free.map(Complex::from) * *out;
            }
        }
        self.complex.solve(&model.pattern, &mut self.pair);
        for (k, q) in self.pair.iter().enumerate() {
            for i in 0..3 {
                let v = mu * q[i] - Complex::new(re.q[k][i], im.q[k][i]);
                (re.q[k][i], im.q[k][i]) = (q[i].re, q[i].im);
                (re.v[k][i], im.v[k][i]) = (v.re, v.im);
            }
        }
        model.project(&mut re.v);
        model.project(&mut im.v);
        self.work.solves += 1;
    }

    /// One simplified Newton iteration; the largest correction (m) and where.
    fn iterate(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        (s, h): (f64, f64),
        motion: &Motion,
    ) -> (f64, (usize, usize)) {
        let model = &system.model;
        let n = motion.q.len();
        for (stage, node) in NODES.iter().enumerate() {
            let (z, f) = (&self.stages[stage], &mut self.slopes[stage]);
            self.at.copy(motion);
            self.at.add(1.0, z);
            ramp.at(s + node * h, &mut self.drive);
            system.residual(&self.at.q, &self.drive, &mut f.v);
            forces::add_damping(model, &self.at.v, &mut f.v);
            if self.loss.is_some() {
                system.add_loss(&self.at.q, |k| self.at.v[k], &mut f.v);
                model.project(&mut f.v);
            }
            f.v.iter_mut().for_each(|x| *x = -*x);
            f.q.copy_from_slice(&self.at.v);
        }
        self.work.forces += 3;
        self.work.iterations += 1;
        let (lambda, mu) = (LAMBDA / h, Complex::new(ALPHA, BETA) / h);
        for (row, out) in T_INVERSE.iter().zip(&mut self.residuals) {
            out.clear();
            for (weight, f) in row.iter().zip(&self.slopes) {
                out.add(*weight, f);
            }
        }
        let [first, second, third] = &mut self.residuals;
        let [w1, w2, w3] = &self.transformed;
        for k in 0..n {
            let mass = model.mass(k);
            first.q[k] -= w1.q[k] * lambda;
            first.v[k] -= mass.component_mul(&w1.v[k]) * lambda;
            second.q[k] -= w2.q[k] * mu.re - w3.q[k] * mu.im;
            second.v[k] -= mass.component_mul(&(w2.v[k] * mu.re - w3.v[k] * mu.im));
            third.q[k] -= w3.q[k] * mu.re + w2.q[k] * mu.im;
            third.v[k] -= mass.component_mul(&(w3.v[k] * mu.re + w2.v[k] * mu.im));
        }
        let [mut first, mut second, mut third] = std::mem::replace(&mut self.residuals, empty());
        self.solve_real(system, lambda, &mut first);
        self.solve_complex(system, mu, &mut second, &mut third);
        self.residuals = [first, second, third];
        let mut worst = (0.0, (0, 0));
        for (w, d) in self.transformed.iter_mut().zip(&self.residuals) {
            w.add(1.0, d);
            let found = largest(system, &d.q);
            if found.0 > worst.0 {
                worst = found;
            }
        }
        for (row, z) in self.stages.iter_mut().enumerate() {
            z.clear();
            for (column, w) in self.transformed.iter().enumerate() {
                z.add(T[row][column], w);
            }
        }
        worst
    }
}

/// Place holders without storage.
fn empty() -> [Motion; 3] {
    std::array::from_fn(|_| Motion::zeros(0))
}

impl Method<Bodies<'_>> for Radau5 {
    fn error_order(&self) -> f64 {
        4.0
    }

    fn step(&mut self, bodies: &mut Bodies<'_>, s: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        let Bodies { system, ramp, .. } = *bodies;
        let model = &system.model;
        let n = motion.q.len();
        ramp.at(s, &mut self.drive);
        system.tangent(&motion.q, &self.drive, &mut self.tangent, &mut self.start_force);
        forces::add_damping(model, &motion.v, &mut self.start_force);
        if let Some(loss) = &mut self.loss {
            let rate = |k: usize| motion.v[k];
            loss.at(system, &motion.q, rate);
            if loss.is_nonzero() {
                loss.add_stiffness(1.0, &mut self.tangent);
                system.add_loss(&motion.q, rate, &mut self.start_force);
                model.project(&mut self.start_force);
            }
        }
        self.work.forces += 1;
        self.factor(system, h)?;
        for (z, node) in self.stages.iter_mut().zip(NODES) {
            z.v.fill(Pose::zeros());
            for (z, v) in z.q.iter_mut().zip(&motion.v) {
                *z = v * (node * h);
            }
        }
        for (row, w) in self.transformed.iter_mut().enumerate() {
            w.clear();
            for (column, z) in self.stages.iter().enumerate() {
                w.add(T_INVERSE[row][column], z);
            }
        }
        let mut last = f64::INFINITY;
        for iteration in 1..=MAX_ITERATIONS {
            let (correction, (body, direction)) = self.iterate(system, ramp, (s, h), motion);
            let size = largest(system, &motion.q).0.max(largest(system, &self.stages[2].q).0);
            let reach = size.max(1e-6 * system.length_scale);
            let rate = if iteration == 1 { 1.0 } else { correction / last };
            let next = if rate < 1.0 { correction * rate / (1.0 - rate) } else { correction };
            if next <= TOLERANCE * reach || (iteration > 1 && correction <= STALLED * reach && rate > 0.5) {
                break;
            }
            let grows = iteration > 2 && rate > 1.0;
            if !correction.is_finite() || grows || iteration == MAX_ITERATIONS {
                return Err(StepFailure::Diverged { iterations: iteration, body, direction });
            }
            last = correction;
        }
        for k in 0..n {
            let mut raw = motion.v[k];
            let mut push = Pose::zeros();
            for (z, weight) in self.stages.iter().zip(ESTIMATE) {
                raw += z.q[k] * (weight / h);
                push += z.v[k] * (weight / h);
            }
            error.q[k] = raw;
            error.v[k] = model.mass(k).component_mul(&push) - self.start_force[k];
        }
        self.solve_real(system, LAMBDA / h, error);
        motion.add(1.0, &self.stages[2]);
        Ok(())
    }

    fn work(&self) -> SolverCounters {
        self.work
    }
}
