//! Sums over the bodies of each lane.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use bimorph_multibody::batch::{LaneModel, LanePose, SimdReal, load, store};
use bimorph_multibody::planar::DOF;

/// xᵀy.
#[inline(always)]
pub fn dot<W: SimdReal>(simd: W::Simd, x: &[LanePose], y: &[LanePose]) -> W {
    let mut sum = [W::splat(simd, 0.0); DOF];
    for (x, y) in x.iter().zip(y) {
        let (x, y) = (load::<W, DOF>(simd, x), load::<W, DOF>(simd, y));
        for i in 0..DOF {
            sum[i] += x[i] * y[i];
        }
    }
    sum[0] + sum[1] + sum[2]
}

/// xᵀMy.
#[inline(always)]
pub(crate) fn mass_product<W: SimdReal>(simd: W::Simd, model: &LaneModel, x: &[LanePose], y: &[LanePose]) -> W {
    let mut sum = [W::splat(simd, 0.0); DOF];
    for ((x, y), body) in x.iter().zip(y).zip(&model.bodies) {
        let (x, y, m) = (load::<W, DOF>(simd, x), load::<W, DOF>(simd, y), load::<W, DOF>(simd, &body.mass));
        for i in 0..DOF {
            sum[i] += x[i] * y[i] * m[i];
        }
    }
    sum[0] + sum[1] + sum[2]
}

/// `x *= s`.
#[inline(always)]
pub(crate) fn scale<W: SimdReal>(simd: W::Simd, x: &mut [LanePose], s: W) {
    for x in x {
        let mut scaled = load::<W, DOF>(simd, x);
        for i in 0..DOF {
            scaled[i] = scaled[i] * s;
        }
        store(scaled, x);
    }
}

/// `y` = M·x.
#[inline(always)]
pub fn weigh<W: SimdReal>(simd: W::Simd, model: &LaneModel, x: &[LanePose], y: &mut [LanePose]) {
    for ((y, x), body) in y.iter_mut().zip(x).zip(&model.bodies) {
        let (mut x, m) = (load::<W, DOF>(simd, x), load::<W, DOF>(simd, &body.mass));
        for i in 0..DOF {
            x[i] = x[i] * m[i];
        }
        store(x, y);
    }
}
