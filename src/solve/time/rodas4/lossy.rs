//! Forces of contact that loses energy in the stages: functions of displacements and rates.
//! ```text
//! W += L_q + L_v/(γh),     force of stage i += l(q_i, v_i) − L_v·r₁
//! ```
//! with L_q and L_v the derivatives of l at the start of the step.

use super::stages::Stages;
use crate::domains::System;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, Model};
use crate::solve::method::Motion;

/// Derivatives of the force with displacements and rates.
#[derive(Debug, Clone)]
pub(super) struct Derivatives {
    stiffness: BlockMatrix<f64, 3>,
    damping: BlockMatrix<f64, 3>,
    /// They are not zero.
    act: bool,
}

impl Derivatives {
    pub(super) fn new(model: &Model) -> Self {
        let zeros = BlockMatrix::new(&model.pattern);
        Self { stiffness: zeros.clone(), damping: zeros, act: false }
    }

    /// Those of bodies at displacements `q` and rates.
    pub(super) fn at(&mut self, system: &System, q: &[Pose], rate: impl Fn(usize) -> Pose) {
        if self.act {
            self.stiffness.clear();
            self.damping.clear();
        }
        self.act = system.add_loss_tangent(q, rate, &mut self.stiffness, &mut self.damping);
    }

    /// Adds their part of the matrix of a step.
    pub(super) fn add_matrix(&self, gh: f64, w: &mut BlockMatrix<f64, 3>) {
        if self.act {
            self.stiffness.add_to(1.0, w);
            self.damping.add_to(1.0 / gh, w);
        }
    }

    /// `force −=` the damping at rates `x`.
    pub(super) fn subtract_damping(&self, model: &Model, x: &[Pose], force: &mut [Pose]) {
        if self.act {
            force.iter_mut().for_each(|f| *f = -*f);
            self.damping.multiply_add(&model.pattern, x, force);
            force.iter_mut().for_each(|f| *f = -*f);
        }
    }
}

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct Lossy {
    start: Derivatives,
    /// Those of the stage at hand; none without sensitivities.
    now: Option<Derivatives>,
}

impl Lossy {
    /// Storage; none for a system whose contacts lose nothing.
    pub(super) fn new(system: &System, sensitivities: bool) -> Option<Self> {
        system.loses().then(|| Self {
            start: Derivatives::new(&system.model),
            now: sensitivities.then(|| Derivatives::new(&system.model)),
        })
    }

    /// Adds the forces of stage `i` of a step of length `h` [s], which has begun.
    pub(super) fn add_forces(
        &mut self,
        system: &System,
        (i, h): (usize, f64),
        (stages, motion): (&Stages, &Motion),
        force: &mut [Pose],
    ) {
        let q = stages.at(i, motion);
        let rate = |k: usize| stages.speed(i, h, k);
        if i == 0 {
            self.start.at(system, q, rate);
        }
        if let Some(now) = &mut self.now {
            now.at(system, q, rate);
        }
        system.add_loss(q, rate, force);
        self.start.subtract_damping(&system.model, stages.r1(), force);
    }

    /// Adds its part of the matrix of a step.
    pub(super) fn add_matrix(&self, gh: f64, w: &mut BlockMatrix<f64, 3>) {
        self.start.add_matrix(gh, w);
    }

    /// Adds the derivatives with displacements in the stage at hand to its tangent.
    pub(super) fn add_tangent(&self, tangent: &mut BlockMatrix<f64, 3>) {
        if let Some(now) = self.now.as_ref().filter(|now| now.act) {
            now.stiffness.add_to(1.0, tangent);
        }
    }

    /// Adds what the rates of a sensitivity bring to the force of its stage `i`, with `speeds` as room.
    pub(super) fn add_change(
        &self,
        model: &Model,
        (i, h): (usize, f64),
        stages: &Stages,
        force: &mut [Pose],
        speeds: &mut [Pose],
    ) {
        if let Some(now) = self.now.as_ref().filter(|now| now.act) {
            speeds.iter_mut().enumerate().for_each(|(k, speed)| *speed = stages.speed(i, h, k));
            now.damping.multiply_add(&model.pattern, speeds, force);
        }
        self.start.subtract_damping(model, stages.r1(), force);
    }
}
