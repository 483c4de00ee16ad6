//! Batch of eight variants of one mechanism in the bodies' own coordinates, one variant per lane.
//!
//! Common data (bodies, joints, blocks and their elimination order) are stored once. Every number is stored as a lane
//! with one entry per variant, and vector instructions apply each operation to all of them. Operations and their order
//! are those of the modules that work on one variant, without fused ones, so that a lane has the bits of its variant
//! alone, whatever the other lanes hold. `tests/variants.rs` says so.
//!
//! | file | what it holds | as for one variant in |
//! |---|---|---|
//! | `simd` | a number in every lane, in registers | |
//! | [`model`] | bodies and joints | [`super::model`] |
//! | [`joint`] | strains, forces and tangents of joints | [`super::planar`] |
//! | [`forces`] | their sums over a mechanism | [`super::forces`] |
//! | [`matrix`] | the factorization and solves | [`super::factor`] |
//! | `precise` | products with the tangent in them | [`super::precise`] |

// fixed-size blocks are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

pub mod forces;
pub mod joint;
pub mod matrix;
pub mod model;
mod precise;
mod simd;

pub use matrix::LaneMatrix;
pub use model::LaneModel;
pub use precise::{LanePrecise, PrecisePose};
#[cfg(test)]
pub(crate) use simd::one_by_one;
pub use simd::{Kernel, LANES, Lane8, SimdReal, across, add, everywhere, load, store};

use super::scalar::Real;

/// Displacement, rate or force of a body in each variant: x, y, θ.
pub type LanePose<T = Lane8> = [T; 3];
/// A block of a matrix in each variant, column by column.
pub type LaneBlock<T = Lane8> = [[T; 3]; 3];

impl Lane8 {
    /// Zero in every lane.
    pub const NONE: Self = Self([0.0; LANES]);

    /// `x` in every lane.
    pub const fn of(x: f64) -> Self {
        Self([x; LANES])
    }
}

/// Nothing in every lane.
pub const ZERO_POSE: LanePose = [Lane8::NONE; 3];
/// A block of zeros in every lane.
pub const BLANK: LaneBlock = [ZERO_POSE; 3];

/// `y += x·s`.
#[inline(always)]
pub fn add_scaled<T: Real>(y: &mut LanePose<T>, x: &LanePose<T>, s: T) {
    for i in 0..3 {
        y[i] += x[i] * s;
    }
}

/// Block times vector.
#[inline(always)]
pub fn times<T: Real>(block: &LaneBlock<T>, x: &LanePose<T>) -> LanePose<T> {
    let mut y = *x;
    for i in 0..3 {
        y[i] = block[2][i] * x[2] + (block[1][i] * x[1] + block[0][i] * x[0]);
    }
    y
}

/// Product of two blocks.
#[inline(always)]
pub fn product<T: Real>(a: &LaneBlock<T>, b: &LaneBlock<T>) -> LaneBlock<T> {
    [times(a, &b[0]), times(a, &b[1]), times(a, &b[2])]
}

/// A block from memory.
#[inline(always)]
pub fn load_block<W: SimdReal>(simd: W::Simd, from: &LaneBlock) -> LaneBlock<W> {
    [load(simd, &from[0]), load(simd, &from[1]), load(simd, &from[2])]
}

/// A block to memory.
#[inline(always)]
pub fn store_block<W: SimdReal>(block: LaneBlock<W>, to: &mut LaneBlock) {
    for (column, to) in block.into_iter().zip(to) {
        store(column, to);
    }
}
