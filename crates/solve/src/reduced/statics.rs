//! Static equilibrium over z, along a path of loads: Newton's method with the exact tangent, steps halved where it leaves the branch.
//!
//! A step is accepted where Newton's method converges on a stable equilibrium (no negative pivot), no gap under voltage changes by more
//! than half, and the iteration corrects at most half of what its first iteration moved. The directions are orthonormal in the energy at
//! rest, so |z| is a norm of energy.

use super::space::{ReducedForces, ReducedSpace};
use crate::path::LoadPath;
use bimorph_domains::{Domain, Drive};
use nalgebra::{DMatrix, DVector};

/// Newton ends at corrections below this fraction of |z| (1).
const TOLERANCE: f64 = 1e-11;
/// MotionCorrections below this fraction that no longer shrink are rounding.
const STALLED: f64 = 1e-6;
/// Most iterations of a step.
const ITERATIONS: usize = 14;
/// Smallest step, as a fraction of the path.
const SMALLEST: f64 = 1e-6;
/// Fraction of the distance of electrodes that one step may change.
const LEAP: f64 = 0.5;

/// Where a path ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReducedPath {
    /// Fraction of the path that was reached (1).
    pub reached: f64,
    /// Newton iterations.
    pub iterations: usize,
}

/// Solver with its storage.
#[derive(Debug, Clone)]
pub struct ReducedStatics {
    /// Forces at the last state.
    pub forces: ReducedForces,
    residual: Vec<f64>,
    tangent: DMatrix<f64>,
    trial: Vec<f64>,
    drive: Drive,
}

impl ReducedStatics {
    /// Storage for a space.
    pub fn new(space: &ReducedSpace) -> Self {
        let m = space.size();
        Self {
            forces: ReducedForces::new(space),
            residual: vec![0.0; m],
            tangent: DMatrix::zeros(m, m),
            trial: vec![0.0; m],
            drive: space.joints.closures.electrics.drive(),
        }
    }

    /// Follows a path from the equilibrium `z` at its start; `z` becomes the last equilibrium, and the bodies are placed there.
    pub fn follow(&mut self, space: &ReducedSpace, path: &dyn LoadPath, z: &mut [f64]) -> ReducedPath {
        let (mut s, mut step) = (0.0, 1.0f64);
        let mut done = ReducedPath { reached: 0.0, iterations: 0 };
        while s < 1.0 && step >= SMALLEST {
            bimorph_base::budget::check();
            let to = if 1.0 - s - step < 1e-12 { 1.0 } else { s + step };
            path.at(to, &mut self.drive);
            self.trial.copy_from_slice(z);
            if self.correct(space, z, &mut done.iterations) {
                z.copy_from_slice(&self.trial);
                (s, step) = (to, (2.0 * step).min(1.0));
            } else {
                step *= 0.5;
            }
        }
        self.forces.place_at_rest(space, z);
        done.reached = s;
        done
    }

    /// Newton's method from `trial` at the drive; true where it ends on the branch of `from`.
    fn correct(&mut self, space: &ReducedSpace, from: &[f64], iterations: &mut usize) -> bool {
        let (mut first, mut last) = (0.0, f64::INFINITY);
        self.forces.place_at_rest(space, from);
        let before = self.distances(space);
        for k in 0..ITERATIONS {
            *iterations += 1;
            self.forces.tangent(space, &self.trial, &self.drive, &mut self.residual, &mut self.tangent);
            let right = DVector::from_column_slice(&self.residual);
            let Some((change, negative)) = solve(&self.tangent, &right) else { return false };
            let size = change.norm();
            if !size.is_finite() || (k > 1 && size > 2.0 * last) {
                return false;
            }
            self.trial.iter_mut().zip(change.iter()).for_each(|(z, dz)| *z -= dz);
            if k == 0 {
                first = size;
            }
            let reach = norm(&self.trial).max(1e-3 * norm(&space.reach));
            let stalled = size <= STALLED * reach && size > 0.1 * last;
            last = size;
            if size <= TOLERANCE * reach || stalled {
                if negative > 0 {
                    return false;
                }
                // the first iteration predicts: what the others add is its curvature
                let moved: f64 = self.trial.iter().zip(from).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
                self.forces.place_at_rest(space, &self.trial);
                return (moved - first).abs() <= 0.5 * first + 1e-3 * reach && !self.leaps(space, &before);
            }
        }
        false
    }

    fn distances(&self, space: &ReducedSpace) -> Vec<f64> {
        let system = &space.joints.closures;
        let at = &self.forces.placed.at;
        let gap = |g: usize| if system.members[g].is_electrostatic() { system.distance(g, at) } else { 0.0 };
        (0..system.members.len()).map(gap).collect()
    }

    fn leaps(&self, space: &ReducedSpace, before: &[f64]) -> bool {
        let electrics = &space.joints.closures.electrics;
        let far = |(gap, (before, after)): (usize, (&f64, f64))| {
            electrics.is_charged(gap, &self.drive.volts) && (after - before).abs() > LEAP * before.max(after)
        };
        before.iter().zip(self.distances(space)).enumerate().any(far)
    }
}

fn norm(z: &[f64]) -> f64 {
    z.iter().map(|z| z * z).sum::<f64>().sqrt()
}

/// A⁻¹·b of a symmetric matrix by its L·D·Lᵀ, and the number of negative pivots; none at a vanished pivot.
pub(crate) fn solve(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<(DVector<f64>, usize)> {
    let m = b.len();
    let (mut l, mut d, mut negative) = (DMatrix::<f64>::identity(m, m), vec![0.0; m], 0);
    for j in 0..m {
        let own: f64 = (0..j).map(|k| l[(j, k)] * l[(j, k)] * d[k]).sum();
        d[j] = a[(j, j)] - own;
        if d[j] == 0.0 || !d[j].is_finite() {
            return None;
        }
        negative += usize::from(d[j] < 0.0);
        for i in j + 1..m {
            let others: f64 = (0..j).map(|k| l[(i, k)] * l[(j, k)] * d[k]).sum();
            l[(i, j)] = (a[(i, j)] - others) / d[j];
        }
    }
    let mut x = b.clone();
    for i in 0..m {
        let known: f64 = (0..i).map(|k| l[(i, k)] * x[k]).sum();
        x[i] -= known;
    }
    for i in (0..m).rev() {
        x[i] /= d[i];
    }
    for i in (0..m).rev() {
        let known: f64 = (i + 1..m).map(|k| l[(k, i)] * x[k]).sum();
        x[i] -= known;
    }
    Some((x, negative))
}
