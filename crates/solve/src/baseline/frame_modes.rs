//! Natural frequencies of K·x = λ·M·x with a full mass matrix, densely: a baseline.
//!
//! With K = L·Lᵀ the matrix L⁻¹·M·L⁻ᵀ is symmetric, and its largest eigenvalues are 1/λ of the lowest modes. A structure that
//! floats is shifted, K + σM, and shows its rigid motions as λ ≈ 0. Cost: O(n³).
//!
//! Reference: G. H. Golub, C. F. Van Loan, "Matrix Computations" (2013), §8.7.2.

use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::linear_system::LinearSystem;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, Par, Side};

/// Modes with their residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentModes {
    /// λ = ω² of each mode, ascending (rad²/s²).
    pub lambda: Vec<f64>,
    /// Shapes.
    pub shapes: Vec<Vec<Pose>>,
    /// ‖x − λ·K⁻¹·M·x‖/‖x‖ in the norm of K: about the relative error of the shape.
    pub residuals: Vec<f64>,
}

/// The `count` lowest modes.
///
/// # Errors
/// [`ZeroPivot`] when even the shifted matrix is not definite: a direction with neither stiffness nor mass.
pub fn lowest_consistent_modes(system: &LinearSystem, count: usize) -> Result<ConsistentModes, ZeroPivot> {
    let stiffness = system.combine(1.0, 0.0, 0.0);
    let mut mass = system.combine(0.0, 1.0, 0.0);
    for (block, free) in mass.diagonal.iter_mut().zip(&system.free) {
        if let Some(p) = free {
            *block = p * *block * p; // held directions have no mass, and so no mode
        }
    }
    let mut shift = 0.0;
    if stiffness.clone().factor(&system.pattern).is_err() {
        shift = 1e-6 * typical(&stiffness, &mass);
    }
    let shifted = system.combine(1.0, shift, 0.0);
    shifted.clone().factor(&system.pattern)?;
    let n = DOF * system.bodies();
    let k = full(&system.pattern, &shifted);
    let m = full(&system.pattern, &mass);
    let none = ZeroPivot { body: 0, direction: 0 };
    let factor = k.llt(Side::Lower).map_err(|_| none)?;
    let l = factor.L();
    let mut b = m;
    solve_lower_triangular_in_place(l, b.as_mut(), Par::Seq);
    let mut b = b.transpose().to_owned();
    solve_lower_triangular_in_place(l, b.as_mut(), Par::Seq);
    let eigen = b.self_adjoint_eigen(Side::Lower).map_err(|_| none)?;
    let (theta, vectors) = (eigen.S(), eigen.U());
    let largest = theta[n - 1];
    let mut modes = ConsistentModes { lambda: Vec::new(), shapes: Vec::new(), residuals: Vec::new() };
    for i in (0..n).rev().take(count).filter(|&i| theta[i] > 1e-14 * largest) {
        // ‖b·y − θ·y‖/θ with b = L⁻¹MLᵀ⁻¹ is the residual in the norm of K
        let y = vectors.col(i).to_owned();
        let error = &b * &y - &y * faer::Scale(theta[i]);
        let mut x = Mat::from_fn(n, 1, |r, _| y[r]);
        solve_upper_triangular_in_place(l.transpose(), x.as_mut(), Par::Seq);
        modes.lambda.push(1.0 / theta[i] - shift);
        modes.shapes.push((0..system.bodies()).map(|k| Pose::from_fn(|d, _| x[(DOF * k + d, 0)])).collect());
        modes.residuals.push(error.norm_l2() / theta[i]);
    }
    Ok(modes)
}

fn full(pattern: &Pattern, matrix: &BodyMatrix) -> Mat<f64> {
    let mut dense = Mat::zeros(DOF * pattern.bodies(), DOF * pattern.bodies());
    super::plain::spread(pattern, matrix, |i, j, value| {
        dense[(i, j)] = value;
        dense[(j, i)] = value;
    });
    dense
}

/// Smallest ratio of a translation's stiffness to its mass (rad²/s²).
fn typical(stiffness: &BodyMatrix, mass: &BodyMatrix) -> f64 {
    (stiffness.diagonal.iter().zip(&mass.diagonal))
        .map(|(k, m)| k[(0, 0)] / m[(0, 0)])
        .filter(|r| r.is_finite() && *r > 0.0)
        .fold(1e18, f64::min)
}
