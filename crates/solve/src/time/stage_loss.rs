//! Forces of contact that loses energy and of gas in the stages of Rodas4: functions of displacements and rates.
//! ```text
//! W += L_q + L_v/(γh),     force of stage i += l(q_i, v_i) − L_v·r₁
//! ```
//! with L_q and L_v the derivatives of l at the start of the step. In joint coordinates L_v multiplies the drift of the bodies instead of r₁.
//!
//! The force on a state z of a gas changes by cᵀx with displacements x of bodies that the state acts on otherwise. W is symmetric and holds half of it on either
//! side; the other half is skew. A state is coupled to nothing else, so that a shear with s = c/(2d) takes the skew part away, d the state's diagonal entry:
//! ```text
//! (W + skew)·u = f     ⇔     (W + Σ d·s·sᵀ)·w = f + Σ s·f_z,     w_x = u_x,   w_z = u_z + sᵀ·u_x
//! ```
//! The matrix on the right is symmetric. Joint coordinates leave the skew part out of W, which costs them order where the gas compresses.

use super::gyration::held_out;
use crate::equations::linear::LinearSolver;
use bimorph_domains::System;
use bimorph_domains::domain::SkewCoupling;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_domains::system::ApartMembers;
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyId, BodyMatrix, Model, Pattern};
use nalgebra::Vector6;

/// Derivatives in a step.
#[derive(Debug, Clone)]
pub(super) struct StageLoss {
    /// At its start.
    pub(super) start: LossDerivatives,
    /// In the stage at hand; none without sensitivities.
    now: Option<LossDerivatives>,
    /// s of each state in the matrix of the step.
    shears: Vec<Shear>,
}

/// State, bodies and s.
#[derive(Debug, Clone, Copy)]
struct Shear {
    state: (usize, usize),
    bodies: [BodyId; 2],
    s: Vector6<f64>,
}

/// The linear systems of a step: a solver with the factor of W.
pub(super) struct StepMatrix<'a, S> {
    pub(super) solver: &'a S,
    pub(super) pattern: &'a Pattern,
    pub(super) w: &'a BodyMatrix,
    pub(super) loss: Option<&'a StageLoss>,
}

impl<S: LinearSolver> StepMatrix<'_, S> {
    /// `x` becomes (W + skew)⁻¹·x.
    pub(super) fn solve(&self, x: &mut [Pose]) {
        let shears = self.loss.map_or(&[][..], |loss| &loss.shears);
        for Shear { state: (k, i), bodies, s } in shears {
            for (side, body) in bodies.iter().enumerate() {
                if let BodyId::Free(b) = *body {
                    let part = s.fixed_rows::<DOF>(DOF * side) * x[*k][*i];
                    x[b] += part;
                }
            }
        }
        self.solver.solve(self.pattern, self.w, x);
        for Shear { state: (k, i), bodies, s } in shears {
            for (side, body) in bodies.iter().enumerate() {
                if let BodyId::Free(b) = *body {
                    x[*k][*i] -= s.fixed_rows::<DOF>(DOF * side).dot(&x[b]);
                }
            }
        }
    }
}

impl StageLoss {
    /// Storage; none for a system whose contacts lose nothing.
    pub(super) fn new(system: &System, sensitivities: bool) -> Option<Self> {
        let start = LossDerivatives::of(system)?;
        Some(Self { now: sensitivities.then(|| start.clone()), start, shears: Vec::new() })
    }

    /// Adds the forces of a stage at displacements, with members known to be apart there, and the rate of each body; the first stage is the start of the step.
    pub(super) fn add_forces(
        &mut self,
        system: &System,
        first: bool,
        at: (&[Pose], ApartMembers),
        rate: impl Fn(usize) -> Pose,
        force: &mut [Pose],
    ) {
        if first {
            self.start.near(system, at, &rate);
        }
        match &mut self.now {
            Some(now) => now.near(system, at, &rate),
            // without derivatives there is no force
            None if first && !self.start.is_nonzero() => return,
            None => {}
        }
        system.add_loss_near(at, rate, force);
    }

    /// Adds the symmetric part of the matrix of a step.
    pub(super) fn add_matrix(&self, gh: f64, w: &mut BodyMatrix) {
        self.start.add_to([1.0, 1.0 / gh], w);
    }

    /// Shears the matrix of a step, which has all its parts and whose held directions have been removed.
    pub(super) fn shear(&mut self, model: &Model, w: &mut BodyMatrix) {
        self.shears.clear();
        for SkewCoupling { state: (k, i), bodies, half } in self.start.skew() {
            let d = w.diagonal[*k][(*i, *i)];
            if d <= 0.0 || d.is_nan() {
                continue; // no pivot, or one that lets the factorization fail
            }
            let mut s = half / d;
            for (side, body) in bodies.iter().enumerate() {
                if let BodyId::Free(b) = *body {
                    let free = held_out(&model.bodies[b], s.fixed_rows::<DOF>(DOF * side).into());
                    s.fixed_rows_mut::<DOF>(DOF * side).copy_from(&free);
                }
            }
            let [a, b] = *bodies;
            locate(&model.pattern, a, b).add(w, &(s * s.transpose() * d));
            self.shears.push(Shear { state: (*k, *i), bodies: *bodies, s });
        }
    }

    /// Adds the derivatives with displacements in the stage at hand to its tangent.
    pub(super) fn add_tangent(&self, tangent: &mut BodyMatrix) {
        if let Some(now) = &self.now {
            now.add_stiffness(1.0, tangent);
        }
    }

    /// Adds the part of those derivatives that a symmetric tangent lacks, at the displacements of a sensitivity.
    pub(super) fn add_skew(&self, dq: &[Pose], force: &mut [Pose]) {
        if let Some(now) = &self.now {
            now.add_skew(dq, force);
        }
    }

    /// Adds what the rates of a sensitivity bring to the force of the stage at hand.
    pub(super) fn add_change(&self, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
        if let Some(now) = &self.now {
            now.add_damping(rate, force);
        }
    }
}
