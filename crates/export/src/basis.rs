//! The directions in which a reduced model moves: modes, and behind them the static correction.
//!
//! The static remainder of a basis, z_q = K⁻¹·b_q − Σ_j φ_j·(φ_jᵀ·b_q)/λ_j, is orthogonal to its modes in K and in M.
//! Its directions can serve as further modes with their own mass and damping: load-dependent Ritz vectors (Wilson,
//! Yuan, Dickens, Earthquake Eng. Struct. Dyn. 10 (1982)).

use super::ExportError;
use super::mechanism::{DENSE_WORK, InputExcitation, LinearizedMechanism, dot};
use bimorph_analysis::AnalysisError;
use bimorph_analysis::harmonic::modal;
use bimorph_multibody::planar::Pose;
use bimorph_solve::eigen::Modes;
use bimorph_solve::frequency::refined::Refined;
use nalgebra::{DMatrix, SymmetricEigen};

/// Fraction of its energy below which a direction of the static correction depends on others.
const DEPENDENT: f64 = 1e-9;

/// Directions in which a model moves, φᵀMφ = 1 and φᵀKφ = λ, orthogonal to each other.
#[derive(Debug, Clone, Default)]
pub struct Basis {
    /// Number of each among the modes, from 1; none for one of the static correction.
    pub(super) numbers: Vec<Option<usize>>,
    pub(super) lambda: Vec<f64>,
    pub(super) shapes: Vec<Vec<Pose>>,
}

impl Basis {
    /// Of the modes `kept`, indices in `found`.
    pub fn of(found: &Modes, kept: &[usize]) -> Self {
        Self {
            numbers: kept.iter().map(|j| Some(j + 1)).collect(),
            lambda: kept.iter().map(|&j| found.lambda[j]).collect(),
            shapes: kept.iter().map(|&j| found.shapes[j].clone()).collect(),
        }
    }

    /// How many of the static correction are in it.
    pub fn corrections(&self) -> usize {
        self.numbers.iter().filter(|n| n.is_none()).count()
    }

    /// The first `count` directions.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        Self {
            numbers: self.numbers[..count].to_vec(),
            lambda: self.lambda[..count].to_vec(),
            shapes: self.shapes[..count].to_vec(),
        }
    }
}

impl LinearizedMechanism<'_> {
    /// The `count` lowest modes, or all there are.
    ///
    /// # Errors
    /// [`AnalysisError::NotConverged`] rather than modes that cannot be trusted.
    pub fn modes(&self, count: usize) -> Result<Modes, ExportError> {
        let found = modal::lowest(self.system(), (&self.q, &self.drive), &self.tangent, count)?;
        if found.lambda.iter().any(|l| *l <= 0.0) {
            let detail = "the operating point is not stable: a mode there does not swing".to_owned();
            return Err(AnalysisError::NotConverged { detail }.into());
        }
        Ok(found)
    }

    /// Static response to an input in all directions outside a basis.
    pub(super) fn left(&self, push: &InputExcitation, basis: &Basis) -> Vec<Pose> {
        let mut rest = push.yielded.clone();
        for (x, lambda) in basis.shapes.iter().zip(&basis.lambda) {
            let share = dot(x, &push.force) / lambda;
            rest.iter_mut().zip(x).for_each(|(z, x)| *z -= x * share);
        }
        rest
    }

    /// The basis followed by the directions of its static correction, each as a dynamic coordinate. These are the z of
    /// all inputs; at `depth` 2 also the response K⁻¹·M·z to their inertia, and so on. They are made orthogonal in K
    /// and then in M, and are orthogonal to the basis in both already.
    #[must_use]
    pub fn corrected(&self, basis: &Basis, depth: usize) -> Basis {
        let model = &self.system().model;
        let mut out = basis.clone();
        let mut columns: Vec<Vec<Pose>> = Vec::new();
        let mut forces: Vec<Vec<Pose>> = Vec::new();
        for push in &self.pushes {
            let (whole, mut rest) = (dot(&push.force, &push.yielded), self.left(push, basis));
            let energy = dot(&push.force, &rest);
            if energy > DEPENDENT * whole {
                let scale = 1.0 / energy.sqrt();
                rest.iter_mut().for_each(|z| *z *= scale);
                columns.push(rest);
                forces.push(push.force.iter().map(|f| f * scale).collect());
            }
        }
        let mut refined = Refined::new(self.system(), &self.q, &self.drive);
        let mut last = 0..columns.len();
        for _ in 1..depth {
            for k in last.clone() {
                let weigh = |(j, z): (usize, &Pose)| model.mass(j).component_mul(z);
                let force: Vec<Pose> = columns[k].iter().enumerate().map(weigh).collect();
                let mut yielded = force.clone();
                self.yielded(&mut refined, &mut yielded);
                let scale = 1.0 / dot(&force, &yielded).sqrt();
                if scale.is_finite() {
                    columns.push(yielded.iter().map(|z| z * scale).collect());
                    forces.push(force.iter().map(|f| f * scale).collect());
                }
            }
            last = last.end..columns.len();
        }
        let m = columns.len();
        if m == 0 {
            return out; // every push is in the basis
        }
        bimorph_base::budget::modes(m, || DENSE_WORK * m);
        let stiff = SymmetricEigen::new(DMatrix::from_fn(m, m, |i, j| {
            bimorph_base::budget::check();
            0.5 * (dot(&columns[i], &forces[j]) + dot(&columns[j], &forces[i]))
        }));
        let kept: Vec<usize> = (0..m).filter(|&k| stiff.eigenvalues[k] > DEPENDENT).collect();
        let blend = |weights: &dyn Fn(usize) -> f64, of: &[Vec<Pose>]| -> Vec<Pose> {
            bimorph_base::budget::check();
            let mut sum = vec![Pose::zeros(); self.q.len()];
            for (k, x) in of.iter().enumerate() {
                let weight = weights(k);
                sum.iter_mut().zip(x).for_each(|(s, x)| *s += x * weight);
            }
            sum
        };
        let upright: Vec<Vec<Pose>> = (kept.iter())
            .map(|&k| blend(&|i| stiff.eigenvectors[(i, k)] / stiff.eigenvalues[k].sqrt(), &columns))
            .collect();
        let n = upright.len();
        if n == 0 {
            return out;
        }
        let mass = DMatrix::from_fn(n, n, |i, j| {
            bimorph_base::budget::check();
            model.mass_product(&upright[i], &upright[j])
        });
        let heavy = SymmetricEigen::new((&mass + mass.transpose()) * 0.5);
        let mut order: Vec<usize> = (0..n).filter(|&k| heavy.eigenvalues[k] > 0.0).collect();
        order.sort_by(|&i, &j| heavy.eigenvalues[j].total_cmp(&heavy.eigenvalues[i]));
        for k in order {
            let inertia = heavy.eigenvalues[k];
            out.numbers.push(None);
            out.lambda.push(1.0 / inertia);
            out.shapes.push(blend(&|i| heavy.eigenvectors[(i, k)] / inertia.sqrt(), &upright));
        }
        out
    }
}
