//! Sums over the bodies of each lane.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use bimorph_multibody::batch::{LaneModel, LanePose, SimdReal, load, store};

/// xᵀy.
#[inline(always)]
pub fn dot<W: SimdReal>(simd: W::Simd, x: &[LanePose], y: &[LanePose]) -> W {
    let mut sum = [W::splat(simd, 0.0); 3];
    for (x, y) in x.iter().zip(y) {
        let (x, y) = (load::<W, 3>(simd, x), load::<W, 3>(simd, y));
        for i in 0..3 {
            sum[i] += x[i] * y[i];
        }
    }
    sum[0] + sum[1] + sum[2]
}

/// xᵀMy.
#[inline(always)]
pub(crate) fn mass_product<W: SimdReal>(simd: W::Simd, model: &LaneModel, x: &[LanePose], y: &[LanePose]) -> W {
    let mut sum = [W::splat(simd, 0.0); 3];
    for ((x, y), body) in x.iter().zip(y).zip(&model.bodies) {
        let (x, y, m) = (load::<W, 3>(simd, x), load::<W, 3>(simd, y), load::<W, 3>(simd, &body.mass));
        for i in 0..3 {
            sum[i] += x[i] * y[i] * m[i];
        }
    }
    sum[0] + sum[1] + sum[2]
}

/// `x *= s`.
#[inline(always)]
pub(crate) fn scale<W: SimdReal>(simd: W::Simd, x: &mut [LanePose], s: W) {
    for x in x {
        let mut scaled = load::<W, 3>(simd, x);
        for i in 0..3 {
            scaled[i] = scaled[i] * s;
        }
        store(scaled, x);
    }
}

/// `y` = M·x.
#[inline(always)]
pub fn weigh<W: SimdReal>(simd: W::Simd, model: &LaneModel, x: &[LanePose], y: &mut [LanePose]) {
    for ((y, x), body) in y.iter_mut().zip(x).zip(&model.bodies) {
        let (mut x, m) = (load::<W, 3>(simd, x), load::<W, 3>(simd, &body.mass));
        for i in 0..3 {
            x[i] = x[i] * m[i];
        }
        store(x, y);
    }
}
