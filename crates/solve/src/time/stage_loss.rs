//! Forces of contact that loses energy in the stages of Rodas4: functions of displacements and rates.
//! ```text
//! W += L_q + L_v/(γh),     force of stage i += l(q_i, v_i) − L_v·r₁
//! ```
//! with L_q and L_v the derivatives of l at the start of the step. In joint coordinates L_v multiplies the drift of the bodies instead of r₁.

use bimorph_domains::System;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BlockMatrix, Model};

/// Derivatives in a step.
#[derive(Debug, Clone)]
pub(super) struct StageLoss {
    /// At its start.
    pub(super) start: LossDerivatives,
    /// In the stage at hand; none without sensitivities.
    now: Option<LossDerivatives>,
}

impl StageLoss {
    /// Storage; none for a system whose contacts lose nothing.
    pub(super) fn new(system: &System, sensitivities: bool) -> Option<Self> {
        let start = LossDerivatives::of(system)?;
        Some(Self { now: sensitivities.then(|| start.clone()), start })
    }

    /// Adds the forces of a stage at displacements `q` and the rate of each body; the first stage is the start of the step.
    pub(super) fn add_forces(
        &mut self,
        system: &System,
        first: bool,
        q: &[Pose],
        rate: impl Fn(usize) -> Pose,
        force: &mut [Pose],
    ) {
        if first {
            self.start.at(system, q, &rate);
        }
        if let Some(now) = &mut self.now {
            now.at(system, q, &rate);
        }
        system.add_loss(q, rate, force);
    }

    /// Adds the part of the matrix of a step.
    pub(super) fn add_matrix(&self, gh: f64, w: &mut BlockMatrix<f64, 3>) {
        self.start.add_to([1.0, 1.0 / gh], w);
    }

    /// Adds the derivatives with displacements in the stage at hand to its tangent.
    pub(super) fn add_tangent(&self, tangent: &mut BlockMatrix<f64, 3>) {
        if let Some(now) = &self.now {
            now.add_stiffness(1.0, tangent);
        }
    }

    /// Adds what the rates of a sensitivity bring to the force of the stage at hand.
    pub(super) fn add_change(&self, model: &Model, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
        if let Some(now) = &self.now {
            now.add_damping(model, rate, force);
        }
    }
}
