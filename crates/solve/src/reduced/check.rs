//! The error of a reduced state: one Newton step of the full model from there.
//!
//! With r and K the residual and the tangent of the full model at the reduced state, the step −K⁻¹·r is the error of every displacement
//! to first order. A signal cᵀ·q has the adjoint estimate −(K⁻ᵀ·c)ᵀ·r, which is the same number. The tangent at the reduced
//! state is essential: one at rest is useless at large rotations. Negative pivots say that the full model is unstable there.

use bimorph_domains::{Drive, System};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;

/// Newton iterations of [`FullCheck::corrected`], and the correction at which they end (1).
const ITERATIONS: usize = 12;
const CONVERGED: f64 = 1e-9;

/// Storage.
#[derive(Debug, Clone)]
pub struct FullCheck {
    tangent: BodyMatrix,
    /// r; then the step.
    step: Vec<Pose>,
    held: Vec<bimorph_multibody::factor::ZeroPivot>,
}

/// The result of a check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateCheck {
    /// Largest step of a body over the largest displacement (1).
    pub error: f64,
    /// Directions in which the full model is unstable there.
    pub negative: usize,
}

impl FullCheck {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        Self {
            tangent: BodyMatrix::new(&system.model.pattern),
            step: vec![Pose::zeros(); system.bodies()],
            held: Vec::new(),
        }
    }

    /// The check of a state with further forces `more` on the bodies; the step is left in [`FullCheck::step`].
    pub fn of(&mut self, system: &System, q: &[Pose], drive: &Drive, more: Option<&[Pose]>) -> StateCheck {
        system.tangent(q, drive, &mut self.tangent, &mut self.step);
        if let Some(more) = more {
            self.step.iter_mut().zip(more).for_each(|(r, more)| *r += more);
            system.model.project(&mut self.step);
        }
        system.model.project_matrix(&mut self.tangent);
        let Ok(signs) = system.model.factor_holding(&mut self.tangent, &mut self.held) else {
            return StateCheck { error: f64::INFINITY, negative: 1 };
        };
        self.tangent.solve(&system.model.pattern, &mut self.step);
        self.step.iter_mut().for_each(|x| *x = -*x);
        let extent = |x: &[Pose]| {
            x.iter()
                .map(|x| x.xy().norm().max(x.z.abs() * system.length_scale))
                .fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) })
        };
        let error = extent(&self.step) / extent(q).max(1e-6 * system.length_scale);
        StateCheck { error, negative: signs.negative }
    }

    /// The last step: the estimated error of every displacement, with its sign ((m), (rad)).
    pub fn step(&self) -> &[Pose] {
        &self.step
    }

    /// The stable equilibrium of the full model next to `q`; none where Newton's method finds none.
    pub fn corrected(&mut self, system: &System, q: &mut [Pose], drive: &Drive) -> bool {
        for _ in 0..ITERATIONS {
            bimorph_base::budget::check();
            let StateCheck { error, negative } = self.of(system, q, drive, None);
            if !error.is_finite() || error > 1.0 {
                return false;
            }
            q.iter_mut().zip(&self.step).for_each(|(q, step)| *q += step);
            if error < CONVERGED {
                return negative == 0;
            }
        }
        false
    }
}
