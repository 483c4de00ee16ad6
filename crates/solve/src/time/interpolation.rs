//! The motion inside a step: cubic Hermite interpolation between its two ends, for every method. Its error falls with the
//! fourth power of the step.

use super::method::Motion;

/// The motion at the fraction `x` of a step of length `h` from `before` to `after`.
pub fn interpolate(before: &Motion, after: &Motion, h: f64, x: f64, out: &mut Motion) {
    let (a, b) = ((1.0 + 2.0 * x) * (1.0 - x) * (1.0 - x), x * x * (3.0 - 2.0 * x));
    let (c, d) = (h * x * (1.0 - x) * (1.0 - x), -h * x * x * (1.0 - x));
    let (da, dc, dd) = (-6.0 * x * (1.0 - x) / h, (1.0 - x) * (1.0 - 3.0 * x), x * (3.0 * x - 2.0));
    for k in 0..out.q.len() {
        let (q0, q1, v0, v1) = (before.q[k], after.q[k], before.v[k], after.v[k]);
        out.q[k] = q0 * a + q1 * b + v0 * c + v1 * d;
        out.v[k] = (q0 - q1) * da + v0 * dc + v1 * dd;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_multibody::planar::Pose;

    /// Displacements that are cubic in time, and their rates, are exact anywhere in a step (1e-14).
    #[test]
    fn cubics_are_exact() {
        let at = |t: f64| {
            let mut motion = Motion::zeros(1);
            motion.q[0] = Pose::new(1.0 - 2.0 * t + 0.5 * t * t + 3.0 * t * t * t, t * t, -t);
            motion.v[0] = Pose::new(-2.0 + t + 9.0 * t * t, 2.0 * t, -1.0);
            motion
        };
        let (start, h) = (0.4, 0.3);
        for x in [0.0, 0.2, 0.7, 1.0] {
            let (mut found, expected) = (Motion::zeros(1), at(start + x * h));
            interpolate(&at(start), &at(start + h), h, x, &mut found);
            assert!((found.q[0] - expected.q[0]).norm() < 1e-14, "{x}");
            assert!((found.v[0] - expected.v[0]).norm() < 1e-14, "{x}");
        }
    }
}
