//! Forces of contact that loses energy: functions of displacements and rates of the bodies.

use crate::domains::System;
use crate::multibody::planar::Pose;
use crate::multibody::relative::placed::Placed;
use crate::multibody::{BlockMatrix, Model};

/// Derivatives of the force with displacements and rates.
#[derive(Debug, Clone)]
struct Derivatives {
    stiffness: BlockMatrix<f64, 3>,
    damping: BlockMatrix<f64, 3>,
    /// They are not zero.
    act: bool,
}

impl Derivatives {
    fn new(model: &Model) -> Self {
        let zeros = BlockMatrix::new(&model.pattern);
        Self { stiffness: zeros.clone(), damping: zeros, act: false }
    }

    fn at(&mut self, system: &System, placed: &Placed) {
        if self.act {
            self.stiffness.clear();
            self.damping.clear();
        }
        let rate = |k: usize| placed.rate[k];
        self.act = system.add_loss_tangent(&placed.at, rate, &mut self.stiffness, &mut self.damping);
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

    /// Adds the forces where the bodies are placed.
    pub(super) fn add_forces(&mut self, system: &System, first: bool, placed: &Placed, force: &mut [Pose]) {
        if first {
            self.start.at(system, placed);
        }
        if let Some(now) = &mut self.now {
            now.at(system, placed);
        }
        system.add_loss(&placed.at, |k| placed.rate[k], force);
    }

    /// True where contact loses energy at the start of the step.
    pub(super) fn acts(&self) -> bool {
        self.start.act
    }

    /// Adds its part of the matrix of a step.
    pub(super) fn add_matrix(&self, gh: f64, w: &mut BlockMatrix<f64, 3>) {
        if self.start.act {
            self.start.stiffness.add_to(1.0, w);
            self.start.damping.add_to(1.0 / gh, w);
        }
    }

    /// Adds the derivatives with displacements in the stage at hand to its tangent.
    pub(super) fn add_tangent(&self, tangent: &mut BlockMatrix<f64, 3>) {
        if let Some(now) = self.now.as_ref().filter(|now| now.act) {
            now.stiffness.add_to(1.0, tangent);
        }
    }

    /// Adds what rates bring to the forces of the stage at hand.
    pub(super) fn add_change(&self, model: &Model, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
        if let Some(now) = self.now.as_ref().filter(|now| now.act) {
            multiply_add(&now.damping, model, rate, force);
        }
    }

    /// Adds the damping at the start of the step.
    pub(super) fn add_drift(&self, model: &Model, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
        if self.start.act {
            multiply_add(&self.start.damping, model, rate, force);
        }
    }
}

fn multiply_add(matrix: &BlockMatrix<f64, 3>, model: &Model, rate: impl Fn(usize) -> Pose, force: &mut [Pose]) {
    for (j, block) in matrix.diagonal.iter().enumerate() {
        force[j] += block * rate(j);
        for at in model.pattern.column(j) {
            let (row, block) = (model.pattern.row(at), &matrix.below[at]);
            force[row] += block * rate(j);
            force[j] += block.transpose() * rate(row);
        }
    }
}
