//! Sine and cosine of a small angle together, inlined: no call, no reduction of the argument, the same bits on every
//! machine. Within 1 ulp for |x| ≤ π/4; larger angles go to the platform's library.
//!
//! Reference: the minimax polynomials of K. C. Ng, FreeBSD msun `k_sin.c` and `k_cos.c` (1993), which carry |x| ≤ π/4 with an
//! error of the series below 2⁻⁵⁸.

use std::f64::consts::FRAC_PI_4;

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

/// (sin x, cos x) for x in rad.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    // false for NaN too
    if x.abs() <= FRAC_PI_4 { small(x) } else { x.sin_cos() }
}

#[inline]
fn small(x: f64) -> (f64, f64) {
    let z = x * x;
    let w = z * z;
    let s = SIN[1] + z * (SIN[2] + z * SIN[3]) + z * w * (SIN[4] + z * SIN[5]);
    let c = z * (COS[0] + z * (COS[1] + z * COS[2])) + w * w * (COS[3] + z * (COS[4] + z * COS[5]));
    let half = 0.5 * z;
    let less = 1.0 - half;
    (x + z * x * (SIN[0] + z * s), less + (((1.0 - less) - half) + z * c))
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
