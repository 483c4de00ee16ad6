//! Solves of (K − σM)·x = b that are right to rounding, also where the assembled K is not.
//!
//! In a mechanism of very stiff and very soft parts, rounding in the entries of K hides the soft ones. The factor is
//! then approximate: each solve is corrected by its own residual, which is computed joint by joint in double-double
//! numbers, with x as a sum of two f64 as well. The error shrinks with every correction by the share that rounding has
//! in the factor.
//!
//! Reference: C. B. Moler, "Iterative refinement in floating point", J. ACM 14 (1967); J. Demmel et al., "Error bounds from
//! extra-precise iterative refinement", ACM Trans. Math. Software 32 (2006).

use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::{Block, DOF, Pose};
use bimorph_multibody::precise::PreciseTangent;
use bimorph_multibody::scalar::{Double, DoublePose};
use bimorph_multibody::{BodyMatrix, Model};

/// Corrections of one solve at most.
const MAX_CORRECTIONS: usize = 40;
/// An error below this fraction of the solution is rounding.
pub const ROUNDING: f64 = 1e-15;

/// K of a system at one place, unsummed, and storage for products with it.
#[derive(Debug, Clone)]
pub struct Refined<'a> {
    model: &'a Model,
    joints: PreciseTangent,
    /// Contributions of gaps, contacts and loads, in elimination order: row, column, block.
    bodies: Vec<(usize, usize, Block)>,
    x: Vec<DoublePose>,
    product: Vec<DoublePose>,
    correction: Vec<Pose>,
    /// About the relative error of a solve that is not corrected, as the first one showed (1).
    rounding: f64,
}

/// How a solve went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveAccuracy {
    /// Size of the first correction over that of the solution: about the relative error of the factor (1).
    pub first: f64,
    /// Fraction by which the solution may still be off (1).
    pub left: f64,
}

impl<'a> Refined<'a> {
    /// K = ∂r/∂q at `q` under `drive`.
    pub fn new(system: &'a System, q: &[Pose], drive: &Drive) -> Self {
        let model = &system.model;
        let mut added = BodyMatrix::<f64>::new(&model.pattern);
        system.add_body_tangent(q, drive, &mut added);
        system.add_levers(q, drive, &mut added);
        let mut bodies = Vec::new();
        for j in 0..model.bodies.len() {
            let below = model.pattern.column(j).map(|k| (model.pattern.row(k), j, added.below[k]));
            bodies.extend(std::iter::once((j, j, added.diagonal[j])).chain(below));
        }
        bodies.retain(|(_, _, block)| block.iter().any(|x| *x != 0.0));
        let zeros = vec![[Double::default(); DOF]; model.bodies.len()];
        Self {
            model,
            joints: PreciseTangent::new(model, q, &drive.rest()),
            bodies,
            x: zeros.clone(),
            product: zeros,
            correction: vec![Pose::zeros(); model.bodies.len()],
            rounding: f64::INFINITY,
        }
    }

    /// `product` = K·x for the stored x.
    fn multiply(&mut self) {
        self.product.fill([Double::default(); DOF]);
        self.joints.multiply_add(&self.x, &mut self.product);
        for &(row, column, block) in &self.bodies {
            for i in 0..DOF {
                for c in 0..DOF {
                    let term = self.x[column][c] * block[(i, c)];
                    self.product[row][i] += term;
                    if row != column {
                        let term = self.x[row][i] * block[(i, c)];
                        self.product[column][c] += term;
                    }
                }
            }
        }
    }

    /// K·x, rounded last; held directions are not removed.
    pub fn product(&mut self, x: &[Pose]) -> Vec<Pose> {
        for (to, x) in self.x.iter_mut().zip(x) {
            *to = [x.x.into(), x.y.into(), x.z.into()];
        }
        self.multiply();
        self.product.iter().map(|k| Pose::new(k[0].high, k[1].high, k[2].high)).collect()
    }

    /// xᵀKx, and K·x − λM·x with λ = xᵀKx (xᵀMx = 1) in `rest`, held directions removed. Both are rounded last.
    pub fn quotient(&mut self, x: &[Pose], rest: &mut [Pose]) -> f64 {
        for (to, x) in self.x.iter_mut().zip(x) {
            *to = [x.x.into(), x.y.into(), x.z.into()];
        }
        self.multiply();
        let mut sum = Double::default();
        for (x, k) in x.iter().zip(&self.product) {
            for i in 0..DOF {
                sum += k[i] * x[i];
            }
        }
        let lambda = sum.high;
        for (j, (rest, x)) in rest.iter_mut().zip(x).enumerate() {
            let m = self.model.mass(j);
            for i in 0..DOF {
                rest[i] = (self.product[j][i] - Double::from(x[i]) * m[i] * lambda).high;
            }
        }
        self.model.project(rest);
        lambda
    }

    /// Solves (K − σM)·x = b in place to about the relative error `goal`, with the factor of about that matrix. Corrections are left
    /// out where the first solve of all has shown that rounding is less than that.
    pub fn solve(&mut self, factor: &BodyMatrix, shift: f64, b: &mut [Pose], goal: f64) -> SolveAccuracy {
        let (model, pattern) = (self.model, &self.model.pattern);
        if self.rounding <= goal {
            model.project(b);
            factor.solve(pattern, b);
            model.project(b);
            return SolveAccuracy { first: self.rounding, left: self.rounding };
        }
        let right = b.to_vec();
        model.project(b);
        factor.solve(pattern, b);
        model.project(b);
        for (to, x) in self.x.iter_mut().zip(b.iter()) {
            *to = [x.x.into(), x.y.into(), x.z.into()];
        }
        let size = size(model, b);
        let mut settled = SolveAccuracy { first: 0.0, left: 0.0 };
        let mut last = 1.0;
        for round in 0..MAX_CORRECTIONS {
            bimorph_base::budget::check();
            self.multiply();
            for (j, (rest, b)) in self.correction.iter_mut().zip(&right).enumerate() {
                let m = model.mass(j) * shift;
                for i in 0..DOF {
                    rest[i] = (Double::from(b[i]) - self.product[j][i] + self.x[j][i] * m[i]).high;
                }
            }
            model.project(&mut self.correction);
            factor.solve(pattern, &mut self.correction);
            model.project(&mut self.correction);
            let now = size_of(model, &self.correction) / size;
            if round == 0 {
                settled.first = now;
            }
            if now.is_nan() || now > 0.9 * last {
                settled.left = now; // no nearer: rounding, or a factor too far off
                break;
            }
            settled.left = now * now / last;
            last = now;
            for (x, c) in self.x.iter_mut().zip(&self.correction) {
                for i in 0..DOF {
                    x[i] += c[i].into();
                }
            }
            if settled.left <= goal {
                break;
            }
        }
        for (b, x) in b.iter_mut().zip(&self.x) {
            *b = Pose::new(x[0].high, x[1].high, x[2].high);
        }
        if self.rounding.is_infinite() {
            self.rounding = settled.first.max(settled.left);
        }
        settled
    }
}

/// Size in the mass norm.
fn size_of(model: &Model, x: &[Pose]) -> f64 {
    model.mass_product(x, x).sqrt()
}

fn size(model: &Model, x: &[Pose]) -> f64 {
    size_of(model, x).max(f64::MIN_POSITIVE)
}
