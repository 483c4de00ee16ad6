//! A part that bears on a stop with friction: its way along the stop, Coulomb's force there, and the return to it.

use super::approach::{Approach, ApproachDerivatives};

/// A part on a stop at a configuration.
#[derive(Debug, Clone, Copy)]
pub struct StickPoint {
    /// The way towards the stop and the way along it (m).
    pub approach: Approach,
    pub(super) toward: ApproachDerivatives,
    /// See [`StickPoint::approach`].
    pub along: Approach,
    pub(super) slide: ApproachDerivatives,
    /// Largest force along it, μ·N (N), and its derivative with the way towards it (N/m).
    pub limit: (f64, f64),
    /// Stiffness along it while it sticks (N/m).
    pub stiffness: f64,
}

/// Part of the largest force from which on a part counts as slipping in a prediction.
const AT_LIMIT: f64 = 1.0 - 1e-9;

impl StickPoint {
    /// The force along it where its anchor lies at `anchor` (m) (N), and whether it slips. In a prediction what is at its limit slips.
    pub(super) fn force(&self, anchor: f64, predicts: bool) -> (f64, bool) {
        let (trial, limit) = (self.stiffness * (self.slide.value - anchor), self.limit.0);
        let slips = trial.abs() > if predicts { AT_LIMIT * limit } else { limit };
        (trial.clamp(-limit, limit), slips)
    }
}
