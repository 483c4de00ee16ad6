//! Steps of a circuit point in which parts touch.
//!
//! With error control of each trial the charge at the end is a staircase of the voltage: steps move with the impact, and bounces multiply what
//! that changes. Newton's method of the circuit finds no solution on a staircase. So all trials of a point take the steps of one motion: that
//! from the accepted state at its voltages, held over the length of the point, with error control. A trial for which one of these steps errs by more
//! than [`MAX_ERROR`] times what is allowed takes its own. The list is a function of the accepted state and the length, so that trials
//! stay pure.

use super::Token;
use bimorph_domains::System;
use bimorph_multibody::planar::Pose;

/// Largest error of a kept step, relative to the allowed one (1). Beyond it a trial chooses steps of its own.
pub(super) const MAX_ERROR: f64 = 3.0;
/// Parts may touch within a point where they would at so many times their closing speed (1).
const NEAR: f64 = 3.0;

/// The steps of one point.
#[derive(Debug, Clone, Default)]
pub(super) struct ContactSteps {
    /// The accepted state and the length (s) that they are of.
    of: Option<(Token, u64)>,
    /// Where they end (s); empty where nothing touches during the step, or the motion failed.
    pub(super) ends: Vec<f64>,
    /// The step that would come next (s).
    pub(super) next: f64,
}

impl ContactSteps {
    /// True where the list is that of this state and length; else it is emptied for them.
    pub(super) fn is_of(&mut self, state: Token, dt: f64) -> bool {
        let of = Some((state, dt.to_bits()));
        if self.of == of {
            return true;
        }
        (self.of, self.next) = (of, dt);
        self.ends.clear();
        false
    }
}

/// True where parts touch at displacements `q`, or may within `dt` (s) at rates `v`.
pub(super) fn near(system: &System, q: &[Pose], v: &[Pose], dt: f64) -> bool {
    (0..system.members.len()).any(|g| {
        let soon = |left: f64, rate: f64| left < 0.0 || left < NEAR * dt * -rate;
        system.touching(g).is_some_and(|[touch, _]| soon(system.distance(g, q) - touch, system.distance_slope(g, q, v)))
            || system.side_contact(g, q).is_some_and(|side| soon(side.left - side.touch, system.side_slope(g, q, v)))
    })
}
