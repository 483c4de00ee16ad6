//! Discrete gradients of the members' potentials over a step: forces whose work is the difference of the potential, whatever the step.
//! ```text
//! f* = (φ(u₁) − φ(u₀))/(u₁ − u₀)      force f*·∇*u,      ∇*u·(q₁ − q₀) = u₁ − u₀
//! ```
//! ∇*u is the gradient at the middle of the step with sin(Δθ/2)/(Δθ/2) times its part of each rotation, which is exact for the
//! displacement of a point. Where contact loses energy, f* has the fraction that the mean closing speed of the step adds.
//!
//! Reference: O. Gonzalez, "Time integration and discrete Hamiltonian systems", J. Nonlinear Sci. 6 (1996) 449–467.

use super::approach::Approach;
use super::domain::Chord;
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Model, Pattern};

/// Change of a distance below which Simpson's rule stands for the quotient (m).
pub(super) const SMALL: f64 = 1e-12;

impl Chord<'_> {
    /// sin(Δθ/2)/(Δθ/2) of a body; 1 in a linear model.
    pub(super) fn sinc(&self, id: BodyId) -> f64 {
        if self.at[0].linear {
            return 1.0;
        }
        let half = 0.5 * (Model::pose(self.at[2].q, id).z - Model::pose(self.at[0].q, id).z);
        if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half }
    }
}

/// f* and its derivative with x₁ of a potential with the derivative `slope` (first, second), from (x₀, φ₀) to (x₁, φ₁).
pub(super) fn quotient(
    (x0, phi0): (f64, f64),
    (x1, phi1): (f64, f64),
    slope: impl Fn(f64) -> (f64, f64),
) -> (f64, f64) {
    let dx = x1 - x0;
    if dx.abs() < SMALL {
        let middle = slope(0.5 * (x0 + x1));
        return ((slope(x0).0 + 4.0 * middle.0 + slope(x1).0) / 6.0, 0.5 * middle.1);
    }
    let mean = (phi1 - phi0) / dx;
    (mean, (slope(x1).0 - mean) / dx)
}

/// Adds the discrete forces of a law of one approach, and the symmetric part of their tangent. `law` has the values of the approach at
/// both ends and gives f* with its derivative.
pub(super) fn add(
    approach: &Approach,
    chord: &Chord<'_>,
    law: impl Fn(f64, f64) -> (f64, f64),
    pattern: &Pattern,
    r: &mut [Pose],
    tangent: &mut BodyMatrix,
) {
    let [start, middle, end] = chord.at;
    let (force, slope) = law(approach.value(start.q, start.linear), approach.value(end.q, end.linear));
    if force == 0.0 && slope == 0.0 {
        return;
    }
    let mut m = approach.measure(middle.q, middle.linear);
    m.gradient[2] *= chord.sinc(approach.a.body);
    m.gradient[5] *= chord.sinc(approach.b.body);
    approach.add_force(&m, force, r);
    m.bend = m.bend.map(|bend| 0.5 * bend);
    locate(pattern, approach.a.body, approach.b.body).add(tangent, &m.hessian(force, slope));
}

/// The same of a force along the approach that depends on it and its rate: at the middle of the step and the mean rate, so that its work over the step has the
/// sign of that force. `drag` gives it with its derivatives with both.
pub(super) fn add_drag(
    approach: &Approach,
    chord: &Chord<'_>,
    drag: impl Fn((f64, f64)) -> (f64, f64, f64),
    pattern: &Pattern,
    r: &mut [Pose],
    tangent: &mut BodyMatrix,
) {
    let law = |u0: f64, u1: f64| {
        let (force, by_u, by_rate) = drag((0.5 * (u0 + u1), (u1 - u0) / chord.h));
        (force, 0.5 * by_u + by_rate / chord.h)
    };
    add(approach, chord, law, pattern, r, tangent);
}
