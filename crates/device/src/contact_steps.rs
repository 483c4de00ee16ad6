//! Steps of a circuit point in which parts touch.
//!
//! With error control of each trial the charge at the end is a staircase of the voltage: steps move with the impact, and bounces multiply what
//! that changes. Newton's method of the circuit finds no solution on a staircase. So all trials of a point take the steps of one motion: the
//! held motion of the point ([`crate::held_motion`]). A trial for which one of these steps errs by more
//! than [`MAX_ERROR`] times what is allowed takes its own. The list is a function of the accepted state and the length, so that trials
//! stay pure.

use bimorph_domains::System;
use bimorph_multibody::planar::Pose;

/// Largest error of a kept step, relative to the allowed one (1). Beyond it a trial chooses steps of its own.
pub(super) const MAX_ERROR: f64 = 3.0;
/// Parts may touch within a point where they would at so many times their closing speed (1).
const NEAR: f64 = 3.0;

/// True where parts touch at displacements `q`, or may within `dt` (s) at rates `v`.
pub(super) fn near(system: &System, q: &[Pose], v: &[Pose], dt: f64) -> bool {
    (0..system.members.len()).any(|g| {
        let soon = |left: f64, rate: f64| left < 0.0 || left < NEAR * dt * -rate;
        system.touching(g).is_some_and(|[touch, _]| soon(system.distance(g, q) - touch, system.distance_slope(g, q, v)))
            || system.side_contact(g, q).is_some_and(|side| soon(side.left - side.touch, system.side_slope(g, q, v)))
    })
}
