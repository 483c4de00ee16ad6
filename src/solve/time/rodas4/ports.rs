//! Sensitivities with respect to final source voltages: the same stages with the exact tangent of each.

use super::stages::Stages;
use crate::gaps::{Drive, Ramp, System};
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, Model, Pattern};
use crate::solve::linear::LinearSolver;
use crate::solve::method::Motion;

/// Sources whose final voltages the motion is differentiated by, with the stages of each derivative.
#[derive(Debug, Clone)]
pub(super) struct Ports {
    sources: Vec<usize>,
    stages: Vec<Stages>,
    /// ∂r/∂q of the stage at hand; without sources on an empty pattern.
    tangent: BlockMatrix<f64, 3>,
    change: Drive,
}

impl Ports {
    pub(super) fn new(system: &System, sources: &[usize]) -> Self {
        let model = &system.model;
        let nothing = Pattern::new(0, &[]);
        Self {
            sources: sources.to_vec(),
            stages: sources.iter().map(|_| Stages::new(model)).collect(),
            tangent: BlockMatrix::new(if sources.is_empty() { &nothing } else { &model.pattern }),
            change: system.electrics.drive(),
        }
    }

    /// Where to put the tangent of the stage at hand; none where nothing needs it.
    pub(super) fn tangent(&mut self) -> Option<&mut BlockMatrix<f64, 3>> {
        (!self.sources.is_empty()).then_some(&mut self.tangent)
    }

    /// Keeps the tangent of the first stage.
    pub(super) fn keep_tangent(&mut self, tangent: &BlockMatrix<f64, 3>) {
        if let Some(own) = self.tangent() {
            own.diagonal.copy_from_slice(&tangent.diagonal);
            own.below.copy_from_slice(&tangent.below);
        }
    }

    /// ∂(∂r/∂drive·rate)/∂(final voltage) of each source at the start of a step, displacements `q`.
    pub(super) fn begin(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        q: &[Pose],
        (drive, rate): (&Drive, &Drive),
    ) {
        for (stages, &source) in self.stages.iter_mut().zip(&self.sources) {
            ramp.rate_sensitivity(s, source, &mut self.change);
            system.drive_force(q, drive, &self.change, &mut stages.forcing);
            // forces are quadratic in gap voltages: the voltage that rate acts on changes too
            ramp.sensitivity(s, source, &mut self.change);
            self.change.expansion.fill(0.0);
            system.add_drive_force(q, rate, &self.change, &mut stages.forcing);
        }
    }

    /// Stage `i` at time `s` [s] of the ramp, of a step of length `h` [s] from the sensitivities `start`, where the motion
    /// is at `q` under `drive`. Returns the number of solves.
    pub(super) fn stage<S: LinearSolver>(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        (i, s, h): (usize, f64, f64),
        (q, drive): (&[Pose], &Drive),
        (solver, w): (&S, &BlockMatrix<f64, 3>),
        start: &mut [Motion],
    ) -> u64 {
        let model = &system.model;
        for ((stages, &source), start) in self.stages.iter_mut().zip(&self.sources).zip(start) {
            stages.begin(model, i, h, start);
            let (at, force) = stages.place(i, start);
            self.tangent.multiply_add(&model.pattern, at, force);
            ramp.sensitivity(s, source, &mut self.change);
            system.add_drive_force(q, drive, &self.change, force);
            solver.solve(&model.pattern, w, force);
        }
        self.sources.len() as u64
    }

    /// After the last stage: the new sensitivities.
    pub(super) fn finish(&self, model: &Model, h: f64, sensitivity: &mut [Motion]) {
        for (stages, sensitivity) in self.stages.iter().zip(sensitivity) {
            stages.finish(model, h, sensitivity, None);
        }
    }
}
