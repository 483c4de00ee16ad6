//! Variants of one mechanism side by side: the bodies' own coordinates with a lane for each variant.
//!
//! What the variants have in common (which bodies, joints and blocks there are, and in which order they are eliminated) stands
//! once; every number stands as a lane of as many numbers as there are variants, and each operation is done for all of them
//! by vector instructions. Operations and their order are those of the modules that work on one variant, without fused
//! ones, so that a lane has the bits of its variant alone, whatever the other lanes hold. `tests/variants.rs` says so.
//!
//! | file | what it holds | as for one variant in |
//! |---|---|---|
//! | [`model`] | bodies and joints | [`super::model`] |
//! | [`joint`] | strains, forces and tangents of joints | [`super::planar`] |
//! | [`forces`] | their sums over a mechanism | [`super::forces`] |
//! | [`matrix`] | the factorization and solves | [`super::factor`] |

// fixed-size blocks are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

pub mod forces;
pub mod joint;
pub mod matrix;
pub mod model;

pub use super::rcr::{Lanes, Real};
pub use matrix::LaneMatrix;
pub use model::LaneModel;

/// Displacement, rate or force of a body in each variant: x, y, θ.
pub type LanePose<const N: usize> = [Lanes<N>; 3];
/// A block of a matrix in each variant, column by column.
pub type LaneBlock<const N: usize> = [[Lanes<N>; 3]; 3];

/// Zero in every lane.
#[inline(always)]
pub fn zero<const N: usize>() -> LanePose<N> {
    [Lanes::ZERO; 3]
}

/// `y += x`.
#[inline(always)]
pub fn add<const N: usize>(y: &mut LanePose<N>, x: &LanePose<N>) {
    for i in 0..3 {
        y[i] += x[i];
    }
}

/// `y += x·s`.
#[inline(always)]
pub fn add_scaled<const N: usize>(y: &mut LanePose<N>, x: &LanePose<N>, s: Lanes<N>) {
    for i in 0..3 {
        y[i] += x[i] * s;
    }
}

/// Block times vector.
#[inline(always)]
pub fn times<const N: usize>(block: &LaneBlock<N>, x: &LanePose<N>) -> LanePose<N> {
    std::array::from_fn(|i| block[2][i] * x[2] + (block[1][i] * x[1] + block[0][i] * x[0]))
}

/// Product of two blocks.
#[inline(always)]
pub fn product<const N: usize>(a: &LaneBlock<N>, b: &LaneBlock<N>) -> LaneBlock<N> {
    std::array::from_fn(|j| times(a, &b[j]))
}
