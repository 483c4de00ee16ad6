//! Linear motion by the trapezoidal rule: Newmark's method with constant mean acceleration, β = ¼, γ = ½.
//!
//! For M·q̈ + C·q̇ + K·q = f(t) a step of length h is
//! ```text
//! (4M/h² + 2C/h + K)·Δq = 4M·v/h + f(t) + f(t + h) − 2K·q,   q ← q + Δq,   v ← 2Δq/h − v
//! ```
//! The matrix is factored once for a step length. The rule is of second order, damps nothing, and conserves the energy of a
//! free linear motion.
//!
//! Reference: N. M. Newmark, "A method of computation for structural dynamics", J. Eng. Mech. Div. ASCE 85 (1959).

use crate::linear::LinearSolver;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::linear_system::LinearSystem;
use bimorph_multibody::planar::Pose;

/// The rule for one step length, with its factor and storage.
#[derive(Debug)]
pub struct Newmark<S> {
    solver: S,
    matrix: BodyMatrix,
    h: f64,
    force: Vec<Pose>,
    momentum: Vec<Pose>,
    elastic: Vec<Pose>,
}

impl<S: LinearSolver> Newmark<S> {
    /// Factors the step matrix for steps of length `h` (s).
    ///
    /// # Errors
    /// [`ZeroPivot`] where it is singular.
    pub fn new(mut solver: S, system: &LinearSystem, h: f64) -> Result<Self, ZeroPivot> {
        let mut matrix = system.combine(1.0, 4.0 / (h * h), 2.0 / h);
        solver.factor(&system.pattern, &mut matrix)?;
        let zeros = vec![Pose::zeros(); system.bodies()];
        Ok(Self { solver, matrix, h, force: zeros.clone(), momentum: zeros.clone(), elastic: zeros })
    }

    /// One step from `q`, `v` under the forces `before` and `after` at its two ends.
    pub fn step(&mut self, system: &LinearSystem, before: &[Pose], after: &[Pose], q: &mut [Pose], v: &mut [Pose]) {
        let h = self.h;
        self.momentum.fill(Pose::zeros());
        system.mass.multiply_add(&system.pattern, v, &mut self.momentum);
        self.elastic.fill(Pose::zeros());
        system.stiffness.multiply_add(&system.pattern, q, &mut self.elastic);
        for (k, f) in self.force.iter_mut().enumerate() {
            *f = self.momentum[k] * (4.0 / h) + before[k] + after[k] - self.elastic[k] * 2.0;
        }
        system.project(&mut self.force);
        self.solver.solve(&system.pattern, &self.matrix, &mut self.force);
        for ((q, v), step) in q.iter_mut().zip(v).zip(&self.force) {
            *q += step;
            *v = step * (2.0 / h) - *v;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Recursion;
    use bimorph_multibody::BodyId;

    /// A body of 1 kg on a spring of 4π² N/m, released at 1 m. After a period of 1 s it is back, with a phase error of
    /// 2π·(ωh)²/12, and the energy is the initial one, to rounding.
    #[test]
    fn an_oscillator_keeps_its_energy_and_its_phase() {
        let (mut system, _) = LinearSystem::new(vec![("m".into(), None)], &[(BodyId::Ground, BodyId::Free(0))]);
        let stiffness = std::f64::consts::TAU.powi(2);
        system.stiffness.diagonal[0].fill_diagonal(stiffness);
        system.mass.diagonal[0].fill_diagonal(1.0);
        let steps = 200;
        let h = 1.0 / f64::from(steps);
        let mut rule = Newmark::new(Recursion, &system, h).unwrap();
        let (mut q, mut v) = (vec![Pose::new(1.0, 0.0, 0.0)], vec![Pose::zeros()]);
        let none = vec![Pose::zeros()];
        for _ in 0..steps {
            rule.step(&system, &none, &none, &mut q, &mut v);
        }
        let energy = 0.5 * v[0].x * v[0].x + 0.5 * stiffness * q[0].x * q[0].x;
        assert!((energy / (0.5 * stiffness) - 1.0).abs() < 1e-12, "{energy}");
        let omega_h = std::f64::consts::TAU * h;
        let lag = std::f64::consts::TAU * omega_h * omega_h / 12.0;
        assert!((v[0].x / stiffness.sqrt() / lag - 1.0).abs() < 1e-2, "{} {lag}", v[0].x);
    }
}
