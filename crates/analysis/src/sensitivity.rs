//! How much faster frequencies move than the equilibrium that they are about.
//!
//! Next to a fold the lowest frequency goes to zero as the fourth root of what is left of the voltage: an error of the deflection there is
//! one of a hundred times that in the frequency. Seen by moving the equilibrium by a fraction of itself, mode by mode:
//! ```text
//! d ln f / d ln q = xᵀ·[K(q·(1 + δ)) − K(q·(1 − δ))]·x / (4·δ·λ),   xᵀMx = 1
//! ```
//! The shape stays as it is, by which the quotient changes in the second order only (Rayleigh).

use bimorph_domains::Drive;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;

/// δ of the equilibrium: far above rounding, far below what a gap closes by.
const STEP: f64 = 1e-5;
/// A mode below this fraction of the highest one is one without stiffness, whose frequency is rounding.
const FREE: f64 = 1e-9;

/// Modes about an equilibrium: `q` under `drive`, with the stiffness that stress adds where `stressed`, their λ and shapes.
#[derive(Clone, Copy)]
pub(super) struct LinearizationPoint<'a> {
    pub(super) compiled: &'a CompiledModel,
    pub(super) q: &'a [Pose],
    pub(super) drive: &'a Drive,
    pub(super) stressed: bool,
    pub(super) modes: (&'a [f64], &'a [Vec<Pose>]),
}

impl LinearizationPoint<'_> {
    /// |d ln f / d ln q| of each mode (1).
    pub(super) fn to_deflection(self) -> Vec<f64> {
        if self.q.iter().all(|q| *q == Pose::zeros()) {
            return vec![0.0; self.modes.0.len()];
        }
        let moved = |factor: f64| self.quotients(&self.q.iter().map(|q| q * factor).collect::<Vec<_>>(), self.drive);
        self.changes(&moved(1.0 + STEP), &moved(1.0 - STEP), 2.0 * STEP)
    }

    /// The relative change of each frequency from `less` to `more`, over `apart`.
    fn changes(&self, more: &[f64], less: &[f64], apart: f64) -> Vec<f64> {
        let highest = self.modes.0.iter().fold(0.0, |m: f64, l| m.max(l.abs()));
        let one = |((more, less), lambda): ((&f64, &f64), &f64)| {
            let swings = lambda.abs() > FREE * highest;
            if swings { ((more - less) / (2.0 * apart * lambda)).abs() } else { 0.0 }
        };
        more.iter().zip(less).zip(self.modes.0).map(one).collect()
    }

    /// xᵀ·K·x of each shape at `q` under `drive`.
    fn quotients(&self, q: &[Pose], drive: &Drive) -> Vec<f64> {
        let system = &self.compiled.parts.system;
        let mut tangent = BodyMatrix::new(&system.model.pattern);
        let mut force = q.to_vec();
        system.tangent(q, drive, &mut tangent, &mut force);
        if self.stressed {
            system.add_stress_stiffness(q, drive, &mut tangent);
        }
        let quotient = |x: &Vec<Pose>| -> f64 {
            let mut product = vec![Pose::zeros(); x.len()];
            tangent.multiply_add(&system.model.pattern, x, &mut product);
            x.iter().zip(&product).map(|(x, y)| x.dot(y)).sum()
        };
        self.modes.1.iter().map(quotient).collect()
    }
}
