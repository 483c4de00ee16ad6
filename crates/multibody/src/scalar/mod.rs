//! Numbers that bodies and joints are computed with. Each algorithm is written once, over one of these traits.
//!
//! | number | traits | used for |
//! |---|---|---|
//! | `f64` | [`Real`], [`StoredReal`] | one model |
//! | [`Lanes`] | [`Real`], [`StoredReal`] | a batch of variants in memory |
//! | registers of [`batch`](crate::batch) | [`Real`], [`SimdReal`](crate::batch::SimdReal) | the same lanes in vector instructions |
//! | [`Dual`] | [`Real`] | a value with its derivative |
//! | [`Double`] over any of them | | sums and products of twice the digits |
//!
//! No operation is fused, and sine and cosine are those of [`sine`](crate::sine). A number therefore has the same bits alone and in a lane.

mod double;
mod dual;
mod lanes;
mod stored;

pub use double::{Double, DoublePose};
pub use dual::Dual;
pub use lanes::{Lanes, has_lanes};
pub use stored::StoredReal;

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number: one, or one in each lane.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Add<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// `x`, in as many lanes as this has.
    fn splat_like(self, x: f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn splat_like(self, x: f64) -> Self {
        x
    }
}
