//! Friction of a part that slides along a stop: Coulomb's law, regularised over a slip speed.
//! ```text
//! T = −μ·N·v/√(v² + v_s²)      N the contact force with its loss, without adhesion; v the speed along the stop
//! ```
//! Far above v_s it is Coulomb's force. Below it a part sticks: under a tangential force Q < μ·N it creeps at v_s·Q/√((μ·N)² − Q²), which `slipspeed`
//! bounds. The force takes energy out of every motion, and has all derivatives.

use super::approach::{Approach, ApproachDerivatives};
use super::domain::Chord;
use super::loss_tangent::LossTangent;
use super::quotient;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Pattern};
use bimorph_structure::Friction;

/// v/√(v² + v_s²) and its derivative with v (s/m).
pub fn slip(friction: &Friction, v: f64) -> (f64, f64) {
    let size = v.hypot(friction.slip_speed);
    let share = friction.slip_speed / size;
    (v / size, share * share / size)
}

/// Adds the force against the speed along `along` under the contact force `normal` (N).
pub(super) fn add_force(
    friction: &Friction,
    (along, m): (&Approach, &ApproachDerivatives),
    rate: &impl Fn(usize) -> Pose,
    normal: f64,
    r: &mut [Pose],
) {
    let v = along.rate(m, rate);
    along.add_force(m, friction.coefficient * normal * slip(friction, v).0, r);
}

/// Its derivatives at a fixed contact force: with displacements the symmetric part.
pub(super) fn add_tangent(
    friction: &Friction,
    (along, m): (&Approach, &ApproachDerivatives),
    rate: &impl Fn(usize) -> Pose,
    normal: f64,
    to: &mut LossTangent<'_>,
) {
    let (share, slope) = slip(friction, along.rate(m, rate));
    let (force, by_rate) = (friction.coefficient * normal * share, friction.coefficient * normal * slope);
    along.add_rates(m, rate, (force, 0.0, by_rate), to);
}

/// Adds the force at the mean speed of a step, under the contact force `normal` (N) at its middle: its work is negative, whatever the step.
pub(super) fn add_quotient(
    friction: &Friction,
    along: &Approach,
    chord: &Chord<'_>,
    normal: f64,
    pattern: &Pattern,
    (r, tangent): (&mut [Pose], &mut BodyMatrix),
) {
    let law = |from: f64, to: f64| {
        let (share, slope) = slip(friction, (to - from) / chord.h);
        (friction.coefficient * normal * share, friction.coefficient * normal * slope / chord.h)
    };
    quotient::add(along, chord, law, pattern, r, tangent);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of Coulomb's force at v_s/√3, all but 5e-9 of it at 10⁴·v_s; the derivative is that of differences.
    #[test]
    fn slips() {
        let friction = Friction { coefficient: 0.3, slip_speed: 1e-5, stick_stiffness: None };
        assert!((slip(&friction, 1e-5 / 3f64.sqrt()).0 - 0.5).abs() < 1e-12);
        assert!((slip(&friction, 0.1).0 - 1.0).abs() < 6e-9);
        for v in [-3e-5, 0.0, 1e-6, 2e-5, 1e-3] {
            let h = 1e-5 * f64::max(1e-5, f64::abs(v));
            let found = (slip(&friction, v + h).0 - slip(&friction, v - h).0) / (2.0 * h);
            assert!((found / slip(&friction, v).1 - 1.0).abs() < 1e-7, "{v}");
        }
    }
}
