//! Tests of the corrections of Newton's method: divergence, convergence and change of branch, for one model or a lane of variants.

use bimorph_base::ErrorBudget;
use bimorph_domains::{Domain, System};
use bimorph_multibody::planar::Pose;
use std::ops::Deref;

/// Corrections below this fraction of the displacement that no longer shrink are rounding.
const STALLED: f64 = 1e-5;
/// Fraction of the distance of electrodes that one step may change. A plate on a spring folds at a third.
const LEAP: f64 = 0.5;

/// Corrections of an iteration so far, in a system with this length scale (m).
#[derive(Debug, Clone, Copy)]
pub(super) struct Corrections {
    scale: f64,
    last: f64,
}

impl Corrections {
    /// None so far.
    pub(super) fn new(scale: f64) -> Self {
        Self { scale, last: f64::INFINITY }
    }

    /// Whether the next correction (m) leads away.
    pub(super) fn diverge(&self, correction: f64) -> bool {
        !correction.is_finite() || (correction > self.last && correction > 1e-3 * self.scale)
    }

    /// Whether it has converged to `tolerance` (1) at displacements up to `reach` (m), or come as close as rounding lets it: quadratic convergence that has
    /// come to a stand. `is_rounding` decides that where it looks so.
    pub(super) fn settle(
        &mut self,
        correction: f64,
        (reach, tolerance): (f64, f64),
        is_rounding: impl FnOnce() -> bool,
    ) -> bool {
        let reach = reach.max(1e-6 * self.scale);
        let stands = correction <= STALLED * reach && correction > 0.1 * self.last;
        self.last = correction;
        correction <= ErrorBudget::of(tolerance).within(reach) || (stands && is_rounding())
    }

    /// Whether an equilibrium at this distance from its prediction (m), which went so far (m), lies on the same branch.
    pub(super) fn is_near(&self, corrected: f64, predicted: f64) -> bool {
        corrected <= 0.5 * predicted + 1e-3 * self.scale
    }
}

/// True where the distance of electrodes changes by more than half of it in one step: a tangent step through the fold may reach the closed
/// branch accidentally.
pub(super) fn leaps<Q: Deref<Target = [Pose]>>(
    system: &System,
    volts: &[f64],
    before: &[Pose],
    after: impl FnOnce() -> Q,
) -> bool {
    let closes = |gap: &usize| system.electrics.is_charged(*gap, volts) && system.members[*gap].is_electrostatic();
    let mut closing = (0..volts.len()).filter(closes).peekable();
    if closing.peek().is_none() {
        return false;
    }
    let end = after();
    closing.any(|gap| {
        let (before, after) = (system.distance(gap, before), system.distance(gap, &end));
        (after - before).abs() > LEAP * before.max(after)
    })
}
