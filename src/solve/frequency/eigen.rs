//! Lowest natural frequencies of K·x = λ·M·x.
//!
//! Shift-invert Lanczos: the operator A = M^½·(K − σM)⁻¹·M^½ is symmetric, its largest eigenvalues 1/(λ − σ) belong to the
//! lowest modes, and one application is one solve with the block factor, O(n+m). Coordinates weighted by M^½ have one unit,
//! so no scaling is needed. The Lanczos iteration is faer's; small models go through a dense symmetric eigensolver. Each
//! mode is checked by its residual, and the number of modes below the highest found is checked against the inertia of
//! K − λM (Sylvester), which no lost mode survives.
//!
//! Reference: T. Ericsson, A. Ruhe, "The spectral transformation Lanczos method", Math. Comp. 35 (1980).

use crate::gaps::System;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, Model, Pattern};
use crate::solve::SolveError;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::LinOp;
use faer::matrix_free::eigen::{PartialEigenParams, partial_self_adjoint_eigen, partial_self_adjoint_eigen_scratch};
use faer::{Col, Mat, MatMut, MatRef, Par};
use nalgebra::{DMatrix, SymmetricEigen};

/// Models of at most this many coordinates are solved densely.
const DENSE: usize = 150;

/// Modes with their residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// λ = ω² of each mode, ascending [rad²/s²].
    pub lambda: Vec<f64>,
    /// Shapes with xᵀMx = 1.
    pub shapes: Vec<Vec<Pose>>,
    /// ‖x − (λ − σ)(K − σM)⁻¹Mx‖ in the mass norm, relative: about the relative error of the shape; or how far the
    /// Rayleigh quotients of K and of its factor differ, if that is more.
    pub residuals: Vec<f64>,
    /// The inertia below the highest mode counts more modes than were found.
    pub missed: bool,
}

/// M^½·(K − σM)⁻¹·M^½ over flat vectors.
#[derive(Debug)]
struct Operator<'a> {
    factor: &'a BlockMatrix<f64, 3>,
    pattern: &'a Pattern,
    model: &'a Model,
    root: &'a [Pose],
}

impl Operator<'_> {
    fn apply_to(&self, read: impl Fn(usize) -> f64, mut write: impl FnMut(usize, f64)) {
        let mut x: Vec<Pose> = self
            .root
            .iter()
            .enumerate()
            .map(|(k, r)| Pose::new(r.x * read(3 * k), r.y * read(3 * k + 1), r.z * read(3 * k + 2)))
            .collect();
        self.model.project(&mut x);
        self.factor.solve(self.pattern, &mut x);
        self.model.project(&mut x);
        for (k, (x, r)) in x.iter().zip(self.root).enumerate() {
            for i in 0..3 {
                write(3 * k + i, x[i] * r[i]);
            }
        }
    }
}

impl LinOp<f64> for Operator<'_> {
    fn apply_scratch(&self, _: usize, _: Par) -> StackReq {
        StackReq::EMPTY
    }
    fn nrows(&self) -> usize {
        3 * self.root.len()
    }
    fn ncols(&self) -> usize {
        3 * self.root.len()
    }
    fn apply(&self, mut out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        for c in 0..rhs.ncols() {
            self.apply_to(|i| rhs[(i, c)], |i, v| out[(i, c)] = v);
        }
    }
    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

/// The `count` lowest modes of a system whose tangent is `stiffness` (held directions not yet projected).
///
/// A structure that floats freely is solved with a small negative shift and shows its rigid motions as λ ≈ 0.
///
/// # Errors
/// [`SolveError::Singular`] when even the shifted matrix cannot be factored.
pub fn lowest_modes(system: &System, stiffness: &BlockMatrix<f64, 3>, count: usize) -> Result<Modes, SolveError> {
    let model = &system.model;
    let pattern = &model.pattern;
    let mut k = stiffness.clone();
    model.project_matrix(&mut k);
    let mut factor = k.clone();
    let mut shift = 0.0;
    if factor.factor(pattern).is_err() {
        shift = -1e-6 * typical(model, &k);
        factor = shifted(model, stiffness, shift);
        factor.factor(pattern).map_err(|p| SolveError::singular(system, p))?;
    }
    let root: Vec<Pose> = (0..system.bodies()).map(|j| model.mass(j).map(f64::sqrt)).collect();
    let n = 3 * root.len();
    let count = count.min(massive_directions(model));
    let operator = Operator { factor: &factor, pattern, model, root: &root };
    let (theta, vectors) = if n <= DENSE { dense(&operator, n, count) } else { lanczos(&operator, n, count) };
    let mut found: Vec<Vec<Pose>> = Vec::with_capacity(count);
    for (i, &theta) in theta.iter().enumerate() {
        if theta == 0.0 || !theta.is_finite() {
            continue;
        }
        // one inverse iteration takes the weighted vector back: x = (K − σM)⁻¹ M^½ y / θ
        let mut x: Vec<Pose> = (0..root.len())
            .map(|b| Pose::new(vectors(3 * b, i), vectors(3 * b + 1, i), vectors(3 * b + 2, i)).component_mul(&root[b]))
            .collect();
        model.project(&mut x);
        factor.solve(pattern, &mut x);
        model.project(&mut x);
        let norm = mass_product(model, &x, &x).sqrt();
        for x in &mut x {
            *x /= norm;
        }
        found.push(x);
    }
    let mut modes = Modes { lambda: Vec::new(), shapes: Vec::new(), residuals: Vec::new(), missed: false };
    for x in &found {
        // Rayleigh quotient and residual of the inverse operator: stiff directions, which K would drown them in, are quiet
        let mut y: Vec<Pose> = (x.iter().enumerate()).map(|(b, x)| model.mass(b).component_mul(x)).collect();
        factor.solve(pattern, &mut y);
        model.project(&mut y);
        let theta = mass_product(model, x, &y);
        for (y, x) in y.iter_mut().zip(x.iter()) {
            *y -= x * theta;
        }
        // the quotient of K itself is the better value; where rounding has spoiled the factor the two part
        let mut kx = vec![Pose::zeros(); x.len()];
        k.multiply_add(pattern, x, &mut kx);
        let lambda: f64 = x.iter().zip(&kx).map(|(x, k)| x.dot(k)).sum();
        let inverse = shift + 1.0 / theta;
        let apart = (lambda - inverse).abs() / (lambda.abs() + shift.abs());
        modes.lambda.push(lambda);
        modes.residuals.push((mass_product(model, &y, &y).sqrt() / theta.abs()).max(apart));
    }
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|&a, &b| modes.lambda[a].total_cmp(&modes.lambda[b]));
    modes.lambda = order.iter().map(|&i| modes.lambda[i]).collect();
    modes.residuals = order.iter().map(|&i| modes.residuals[i]).collect();
    modes.shapes = order.iter().map(|&i| std::mem::take(&mut found[i])).collect();
    if let Some(&highest) = modes.lambda.last() {
        let mut counted = shifted(model, stiffness, highest * 0.99);
        modes.missed = counted.factor(pattern).is_ok_and(|i| i.negative >= modes.lambda.len());
    }
    Ok(modes)
}

/// Free directions that carry mass: a model has as many modes. Inner bodies of a beam have no rotary inertia of their own.
fn massive_directions(model: &Model) -> usize {
    (model.bodies.iter())
        .map(|b| {
            let free = |i: usize| b.free.as_ref().map_or(1.0, |p| p[(i, i)]);
            let translations = if b.mass > 0.0 { (free(0) + free(1)).round() as usize } else { 0 };
            translations + usize::from(b.inertia > 0.0 && free(2) > 0.5)
        })
        .sum()
}

/// K − σM, held directions projected.
fn shifted(model: &Model, stiffness: &BlockMatrix<f64, 3>, sigma: f64) -> BlockMatrix<f64, 3> {
    let mut a = stiffness.clone();
    for (j, block) in a.diagonal.iter_mut().enumerate() {
        let m = model.mass(j);
        for i in 0..3 {
            block[(i, i)] -= sigma * m[i];
        }
    }
    model.project_matrix(&mut a);
    a
}

/// Smallest ratio of a body's stiffness to its mass [rad²/s²].
fn typical(model: &Model, k: &BlockMatrix<f64, 3>) -> f64 {
    (0..k.diagonal.len())
        .filter(|&j| model.mass(j).x > 0.0)
        .map(|j| k.diagonal[j][(0, 0)] / model.mass(j).x)
        .filter(|&r| r > 0.0)
        .fold(f64::INFINITY, f64::min)
        .min(1e18)
}

/// xᵀMy.
pub fn mass_product(model: &Model, x: &[Pose], y: &[Pose]) -> f64 {
    x.iter().zip(y).enumerate().map(|(j, (x, y))| x.dot(&model.mass(j).component_mul(y))).sum()
}

type Vectors = Box<dyn Fn(usize, usize) -> f64>;

fn dense(operator: &Operator<'_>, n: usize, count: usize) -> (Vec<f64>, Vectors) {
    let mut a = DMatrix::<f64>::zeros(n, n);
    for c in 0..n {
        operator.apply_to(|i| if i == c { 1.0 } else { 0.0 }, |i, v| a[(i, c)] = v);
    }
    let a = (&a + a.transpose()) * 0.5;
    let eigen = SymmetricEigen::new(a);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[j].abs().total_cmp(&eigen.eigenvalues[i].abs()));
    order.truncate(count);
    let theta = order.iter().map(|&i| eigen.eigenvalues[i]).collect();
    (theta, Box::new(move |row, i| eigen.eigenvectors[(row, order[i])]))
}

fn lanczos(operator: &Operator<'_>, n: usize, count: usize) -> (Vec<f64>, Vectors) {
    // a few more than asked for keep the last wanted one well separated
    let wanted = (count + 4).min(n);
    let params = PartialEigenParams { max_restarts: 1000, ..Default::default() };
    let mut vectors = Mat::<f64>::zeros(n, wanted);
    let mut theta = vec![0.0; wanted];
    // a fixed start with components everywhere: the same bits on every run
    let start = Col::<f64>::from_fn(n, |i| 1.0 + ((i * 7919) % 101) as f64 / 101.0);
    let start = &start / start.norm_l2();
    let scratch = partial_self_adjoint_eigen_scratch(operator, wanted, Par::Seq, params);
    let mut memory = MemBuffer::new(scratch);
    let info = partial_self_adjoint_eigen(
        vectors.as_mut(),
        &mut theta,
        operator,
        start.as_ref(),
        1e-13,
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    );
    let mut order: Vec<usize> = (0..info.n_converged_eigen.min(wanted)).collect();
    order.sort_by(|&i, &j| theta[j].abs().total_cmp(&theta[i].abs()));
    order.truncate(count);
    let kept = order.iter().map(|&i| theta[i]).collect();
    (kept, Box::new(move |row, i| vectors[(row, order[i])]))
}
