//! A linear structure: M·q̈ + C·q̇ + K·q = f with full symmetric block matrices on one pattern.
//!
//! The models of the product have a diagonal mass matrix and nonlinear forces; this is what a linear frame of finite elements
//! is assembled into.

use super::model::projected;
use super::order::elimination_order;
use super::planar::{Block, Pose};
use super::{BodyId, BodyMatrix, Pattern};
use nalgebra::Matrix6;

/// Mass, damping and stiffness of bodies in elimination order.
#[derive(Debug, Clone)]
pub struct LinearSystem {
    /// Name of each body, for messages.
    pub names: Vec<String>,
    /// Pattern of all three matrices.
    pub pattern: Pattern,
    /// Stiffness (N/m, N, N·m).
    pub stiffness: BodyMatrix,
    /// Mass (kg, kg·m, kg·m²).
    pub mass: BodyMatrix,
    /// Damping (N·s/m, N·s, N·m·s).
    pub damping: BodyMatrix,
    /// Projector of each body onto the directions that supports leave free; none: all.
    pub free: Vec<Option<Block>>,
}

impl LinearSystem {
    /// Empty matrices for bodies that `couplings` connect. `Free(k)` means `bodies[k]`; also returns where each body went.
    pub fn new(bodies: Vec<(String, Option<Block>)>, couplings: &[(BodyId, BodyId)]) -> (Self, Vec<usize>) {
        let free_pair = |&(a, b): &(BodyId, BodyId)| match (a, b) {
            (BodyId::Free(a), BodyId::Free(b)) => Some((a, b)),
            _ => None,
        };
        let edges: Vec<(usize, usize)> = couplings.iter().filter_map(free_pair).collect();
        let ground_pair = |&pair: &(BodyId, BodyId)| match pair {
            (BodyId::Free(k), BodyId::Ground) | (BodyId::Ground, BodyId::Free(k)) => Some(k),
            _ => None,
        };
        let grounded: Vec<usize> = couplings.iter().filter_map(ground_pair).collect();
        let order = elimination_order(bodies.len(), &edges, &grounded);
        let mut place = vec![0; bodies.len()];
        for (k, &body) in order.iter().enumerate() {
            place[body] = k;
        }
        let edges: Vec<(usize, usize)> = edges.iter().map(|&(a, b)| (place[a], place[b])).collect();
        let pattern = Pattern::new(bodies.len(), &edges);
        let zero = BodyMatrix::new(&pattern);
        let (names, free) = order.iter().map(|&k| bodies[k].clone()).unzip();
        (Self { names, stiffness: zero.clone(), mass: zero.clone(), damping: zero, free, pattern }, place)
    }

    /// Number of bodies.
    #[inline]
    pub fn bodies(&self) -> usize {
        self.names.len()
    }

    /// Unknowns: three per body, less the directions that supports hold.
    #[inline]
    pub fn unknowns(&self) -> usize {
        self.free.iter().map(|p| p.map_or(3.0, |p| p.trace()).round() as usize).sum()
    }

    /// `k·K + m·M + c·C`, held directions projected.
    pub fn combine(&self, k: f64, m: f64, c: f64) -> BodyMatrix {
        let mut sum = BodyMatrix::new(&self.pattern);
        for (factor, part) in [(k, &self.stiffness), (m, &self.mass), (c, &self.damping)] {
            for (to, from) in sum.diagonal.iter_mut().zip(&part.diagonal) {
                *to += from * factor;
            }
            for (to, from) in sum.below.iter_mut().zip(&part.below) {
                *to += from * factor;
            }
        }
        for (j, free) in self.free.iter().enumerate() {
            if let Some(p) = free {
                sum.diagonal[j] = projected(p, &sum.diagonal[j]);
                for block in self.pattern.column(j) {
                    sum.below[block] *= p;
                }
            }
            for block in self.pattern.column(j) {
                if let Some(p) = &self.free[self.pattern.row(block)] {
                    sum.below[block] = p * sum.below[block];
                }
            }
        }
        sum
    }

    /// Removes the held directions from a vector.
    #[inline]
    pub fn project(&self, x: &mut [Pose]) {
        for (free, x) in self.free.iter().zip(x) {
            if let Some(p) = free {
                *x = p * *x;
            }
        }
    }
}

/// Adds a pair block (a then b) to a symmetric matrix, in the parts that belong to free bodies.
pub fn add_pair(matrix: &mut BodyMatrix, pattern: &Pattern, a: BodyId, b: BodyId, pair: &Matrix6<f64>) {
    for (id, at) in [(a, 0), (b, 3)] {
        if let BodyId::Free(k) = id {
            matrix.diagonal[k] += pair.fixed_view::<3, 3>(at, at);
        }
    }
    let (BodyId::Free(i), BodyId::Free(j)) = (a, b) else { return };
    if i == j {
        // both ends on one body: the coupling falls on its diagonal block
        matrix.diagonal[i] += pair.fixed_view::<3, 3>(0, 3) + pair.fixed_view::<3, 3>(3, 0);
    } else if let Some(block) = pattern.block(i.max(j), i.min(j)) {
        matrix.below[block] +=
            if i > j { pair.fixed_view::<3, 3>(0, 3).into_owned() } else { pair.fixed_view::<3, 3>(3, 0).into_owned() };
    }
}
