//! Sine and cosine together, inlined and the same bits on every machine: [`sin_cos`] for mostly small angles, without a
//! reduction of the argument; [`reduced`] for any within [`REDUCED`], without a branch.
//!
//! Reference: the minimax polynomials of K. C. Ng, FreeBSD msun `k_sin.c` and `k_cos.c` (1993), which carry |x| ≤ π/4 with an
//! error of the series below 2⁻⁵⁸.

use crate::scalar::Real;
use std::f64::consts::FRAC_PI_4;

/// Largest angle of [`small`] (rad).
pub const SMALL: f64 = FRAC_PI_4;

// digits as published
#[allow(clippy::excessive_precision)]
#[rustfmt::skip]
const SIN: [f64; 6] = [
    -1.666_666_666_666_663_243_48e-1, 8.333_333_333_322_489_461_24e-3, -1.984_126_982_985_794_931_34e-4,
    2.755_731_370_707_006_767_89e-6, -2.505_076_025_340_686_341_95e-8, 1.589_690_995_211_550_102_21e-10,
];
#[allow(clippy::excessive_precision)]
#[rustfmt::skip]
const COS: [f64; 6] = [
    4.166_666_666_666_660_190_37e-2, -1.388_888_888_887_410_957_49e-3, 2.480_158_728_947_672_941_78e-5,
    -2.755_731_435_139_066_330_35e-7, 2.087_572_321_298_174_827_90e-9, -1.135_964_755_778_819_482_65e-11,
];

/// (sin x, cos x) for x in rad, within 1 ulp for |x| ≤ π/4; larger angles go to the platform's library.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    // false for NaN too
    if x.abs() <= FRAC_PI_4 { small(x) } else { x.sin_cos() }
}

/// [`sin_cos`] for |x| ≤ [`SMALL`], of a number or of one in every lane.
#[inline(always)]
pub fn small<T: Real>(x: T) -> (T, T) {
    let z = x * x;
    let w = z * z;
    let s = z * (z * SIN[3] + SIN[2]) + SIN[1] + z * w * (z * SIN[5] + SIN[4]);
    let c = z * (z * (z * COS[2] + COS[1]) + COS[0]) + w * w * (z * (z * COS[5] + COS[4]) + COS[3]);
    let half = z * 0.5;
    let less = -half + 1.0;
    (x + z * x * (z * s + SIN[0]), less + (((-less + 1.0) - half) + z * c))
}

/// Largest angle of [`reduced`] (rad).
pub const REDUCED: f64 = 1e5;

/// (sin x, cos x) for |x| ≤ [`REDUCED`] to about one unit in the last place, without a branch, so that a loop over lanes
/// becomes vector instructions.
///
/// Reduction by π/2 in three parts: W. J. Cody, W. Waite, "Software Manual for the Elementary Functions" (1980).
#[inline(always)]
pub fn reduced(x: f64) -> (f64, f64) {
    const SHIFT: f64 = 6_755_399_441_055_744.0; // 1.5·2^52: adding it rounds to an integer in the lowest bits
    let shifted = x * std::f64::consts::FRAC_2_PI + SHIFT;
    let quadrant = shifted.to_bits();
    let k = shifted - SHIFT;
    let t = x - k * 1.570_796_326_734_125_6;
    let w = k * 6.077_100_506_303_966e-11;
    let r = t - w;
    let w = k * 2.022_266_248_795_950_6e-21 - ((t - r) - w);
    let y = r - w;
    let tail = (r - y) - w;
    let z = y * y;
    let v = z * y;
    let s = SIN[1] + z * (SIN[2] + z * (SIN[3] + z * (SIN[4] + z * SIN[5])));
    let sin = y - ((z * (0.5 * tail - v * s) - tail) - v * SIN[0]);
    let c = z * (COS[0] + z * (COS[1] + z * (COS[2] + z * (COS[3] + z * (COS[4] + z * COS[5])))));
    let half = 0.5 * z;
    let one = 1.0 - half;
    let cos = one + (((1.0 - one) - half) + (z * c - y * tail));
    // odd quadrants swap, and the sign bits follow the quadrant
    let odd = 0u64.wrapping_sub(quadrant & 1);
    let (sin_bits, cos_bits) = (sin.to_bits(), cos.to_bits());
    let swap = (sin_bits ^ cos_bits) & odd;
    let sin = f64::from_bits((sin_bits ^ swap) ^ ((quadrant & 2) << 62));
    let cos = f64::from_bits((cos_bits ^ swap) ^ ((quadrant.wrapping_add(1) & 2) << 62));
    (sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within 1 ulp of the platform's library, whose own error is below 1 ulp: hence 2; exact at zero, odd and even.
    #[test]
    fn agrees_with_the_library() {
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        for k in 0..200_000 {
            let x = FRAC_PI_4 * f64::from(k) / 2e5;
            let (s, c) = sin_cos(x);
            let apart = |a: f64, b: f64| a.to_bits().abs_diff(b.to_bits());
            assert!(apart(s, x.sin()) <= 2 && apart(c, x.cos()) <= 2, "{x}");
            assert_eq!(sin_cos(-x), (-s, c));
        }
        assert_eq!(sin_cos(2.0), 2f64.sin_cos());
        assert!(sin_cos(f64::NAN).0.is_nan());
    }
}
