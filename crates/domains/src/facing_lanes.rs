//! The derivatives of the capacitances of facing beams, with a stretch in each lane.

use super::facing::FacingStretch;
use super::quadrature::GAUSS_3;
use bimorph_multibody::batch::SimdReal;

/// First and, where `CURVED`, second derivatives of the capacitances times a factor over their ends (w₁, φ₁, w₂, φ₂); slopes in `z` times length.
///
/// The outer points of the rule lie at s and 1 − s. With a = w₁ + w₂, b = w₁ − w₂, c = φ₁ + φ₂ and d = φ₁ − φ₂ the distances there are
/// g₀ + a/2 + δ·d ± (β·b + γ·c), and that at the middle is g₀ + a/2 + d/8. Sums over a, b, c and d are therefore products of few numbers.
#[inline(always)]
pub(super) fn derivatives<W: SimdReal, const CURVED: bool>(
    simd: W::Simd,
    facing: &FacingStretch,
    ([w, turn, w_end, turn_end], length): ([W; 4], W),
    factor: f64,
    (first, second): (&mut [W; 4], &mut [W; 10]),
) {
    let ([outer, middle, _], (gap, closest)) = (&GAUSS_3, facing.open());
    let n = &outer.shape;
    let (beta, gamma, delta) = (0.5 * (n[0] - n[2]), 0.5 * (n[1] + n[3]), 0.5 * (n[1] - n[3]));
    let eighth = middle.shape[1];
    let (mean, d) = ((w + w_end) * 0.5 + gap, turn - turn_end);
    let (even, odd) = (mean + d * delta, (w - w_end) * beta + (turn + turn_end) * gamma);
    let bounds = [W::splat(simd, 1.0), W::splat(simd, closest)];
    let start = inverse_law::<W, CURVED>(facing, even + odd, bounds);
    let end = inverse_law::<W, CURVED>(facing, even - odd, bounds);
    let mid = inverse_law::<W, CURVED>(facing, mean + d * eighth, bounds);
    let along = length * (factor * facing.strength);
    let (weight, mid_weight) = (along * outer.weight, along * middle.weight);
    let (even, odd, middle) = ((start[0] + end[0]) * weight, (start[0] - end[0]) * weight, mid[0] * mid_weight);
    let (a, b, c, d) = ((even + middle) * 0.5, odd * beta, odd * gamma, even * delta + middle * eighth);
    *first = [a + b, (c + d) * length, a - b, (c - d) * length];
    if CURVED {
        let (even, odd, middle) = ((start[1] + end[1]) * weight, (start[1] - end[1]) * weight, mid[1] * mid_weight);
        let (aa, dd) = ((even + middle) * 0.25, even * (delta * delta) + middle * (eighth * eighth));
        let (ad, bc) = ((even * delta + middle * eighth) * 0.5, even * (beta * gamma));
        let (bb, cc) = (even * (beta * beta), even * (gamma * gamma));
        let (two_ab, two_cd) = (odd * beta, odd * (2.0 * gamma * delta));
        let (ac, bd) = (odd * (0.5 * gamma), odd * (beta * delta));
        let square = length * length;
        *second = [
            (aa + bb) + two_ab,
            ((ac + bd) + (ad + bc)) * length,
            aa - bb,
            ((ac - bd) - (ad - bc)) * length,
            ((cc + dd) + two_cd) * square,
            ((ac - bd) + (ad - bc)) * length,
            (cc - dd) * square,
            (aa + bb) - two_ab,
            ((ac + bd) - (ad + bc)) * length,
            ((cc + dd) - two_cd) * square,
        ];
    }
}

/// First and, where `CURVED`, second derivative of 1/g + e(g) at the distance `g`; `bounds` are 1 and the least distance.
#[inline(always)]
fn inverse_law<W: SimdReal, const CURVED: bool>(facing: &FacingStretch, g: W, [one, closest]: [W; 2]) -> [W; 2] {
    let inverse = one / g.max(closest);
    if CURVED {
        let [slope, curvature] = facing.edges.derivatives(inverse);
        [slope, g.above(closest, curvature)]
    } else {
        [facing.edges.slope(inverse), one]
    }
}
