//! The second-order axial strain of a segment that ends in the springs of junctions.
//!
//! A joint's strain e = u + [g p]·Q·[g p]ᵀ lets a bent segment keep its length. With a junction spring at the segment's
//! end, part of g and p belongs to the spring, which has no length. The chord of the segment itself, of length h, is
//! shorter because of the bending of the segment alone, and the spring's part rotates one relative to the other. With
//! spring, segment and spring (a, o, b) in a row, each turning by p and giving way by g, and the middle direction of
//! all of them as the joint's,
//! ```text
//! e = u + qₒᵀ·Qₒ·qₒ − [g_a·(p_o + p_b) − g_o·(p_a − p_b) − g_b·(p_a + p_o)]/2 − h·[p_o·(p_a + p_b) + 2·p_a·p_b]/4
//! ```
//! to second order, q_o = (g_o, p_o). The parts follow from the whole by the compliances, which all bear one shear force and moment. As the
//! segment becomes short all of it vanishes with h; with the straight segment's Q over the whole, a spring's g²/h would not.

use super::junction_springs::JunctionEnd;
use nalgebra::{Matrix2, RowVector2};

/// Q of a joint in the middle of a segment of length `h` (m), over the total (g, p). `own` is the segment's alone,
/// `compliance` its compliance over (V, M), and `ends` the springs at its start and its end, if any.
pub(super) fn second_strain(
    own: &Matrix2<f64>,
    h: f64,
    compliance: &Matrix2<f64>,
    ends: [Option<&JunctionEnd>; 2],
) -> Matrix2<f64> {
    let d = 0.5 * h;
    let springs = [(ends[0], 1.0), (ends[1], -1.0)];
    // strains of each spring, as the beam runs, per load at the joint
    let [at_a, at_b] = springs.map(|(end, sign)| {
        let spring = end.map_or_else(Matrix2::zeros, |end| end.spring.fixed_view::<2, 2>(1, 1).into_owned());
        let carry = Matrix2::new(1.0, 0.0, d, sign);
        (spring * carry, carry, sign)
    });
    let seen = |(strain, carry, _): &(Matrix2<f64>, Matrix2<f64>, f64)| carry.transpose() * strain;
    let Some(load) = (compliance + seen(&at_a) + seen(&at_b)).try_inverse() else { return *own };
    let parts = |(strain, _, sign): &(Matrix2<f64>, Matrix2<f64>, f64)| {
        let part = strain * load;
        (part.row(0).into_owned(), part.row(1) * *sign)
    };
    let ((ga, pa), (gb, pb)) = (parts(&at_a), parts(&at_b));
    let segment = compliance * load;
    let (go, po): (RowVector2<f64>, RowVector2<f64>) = (segment.row(0).into_owned(), segment.row(1).into_owned());
    let both = |x: &RowVector2<f64>, y: &RowVector2<f64>| (x.transpose() * y + y.transpose() * x) * 0.5;
    let turned = both(&ga, &(po + pb)) - both(&go, &(pa - pb)) - both(&gb, &(pa + po));
    let levers = both(&po, &(pa + pb)) + both(&pa, &pb) * 2.0;
    segment.transpose() * own * segment - turned * 0.5 - levers * (0.25 * h)
}
