//! Sensitivities with respect to final source voltages: the same stages with the exact tangent of each.

use super::stages::Stages;
use super::tableau::GAMMA;
use crate::equations::linear::LinearSolver;
use crate::method::Motion;
use crate::time::gyration::{Gyration, held_out, skew};
use crate::time::stage_loss::StepMatrix;
use bimorph_domains::{Drive, Lags, Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Model, Pattern};

/// How the frame turns: at the start of a step, and in the stage at hand.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameRotation {
    pub(super) start: Gyration,
    pub(super) now: Gyration,
    /// Terms of the series that a solve takes.
    pub(super) terms: usize,
}

/// Sources whose final voltages the motion is differentiated by, with the stages of each derivative.
#[derive(Debug, Clone)]
pub(super) struct PortSensitivities {
    sources: Vec<usize>,
    stages: Vec<Stages>,
    /// ∂r/∂q of the stage at hand; without sources on an empty pattern.
    tangent: BodyMatrix,
    change: Drive,
    scratch: Vec<Pose>,
}

impl PortSensitivities {
    pub(super) fn new(system: &System, sources: &[usize]) -> Self {
        let model = &system.model;
        let nothing = Pattern::new(0, &[]);
        Self {
            sources: sources.to_vec(),
            stages: (sources.iter())
                .map(|_| {
                    bimorph_base::budget::check();
                    Stages::new(model)
                })
                .collect(),
            tangent: BodyMatrix::new(if sources.is_empty() { &nothing } else { &model.pattern }),
            change: system.electrics.drive(),
            scratch: vec![Pose::zeros(); if sources.is_empty() { 0 } else { model.bodies.len() }],
        }
    }

    /// Where to put the tangent of the stage at hand; none where nothing needs it.
    pub(super) fn tangent(&mut self) -> Option<&mut BodyMatrix> {
        (!self.sources.is_empty()).then_some(&mut self.tangent)
    }

    /// Keeps the tangent of the first stage.
    pub(super) fn keep_tangent(&mut self, tangent: &BodyMatrix) {
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
        let mut lags = Lags::new(s);
        for (stages, &source) in self.stages.iter_mut().zip(&self.sources) {
            ramp.rate_sensitivity(&mut lags, source, &mut self.change);
            system.drive_force(q, drive, &self.change, &mut stages.forcing);
            // forces are quadratic in gap voltages: the voltage that rate acts on changes too
            ramp.sensitivity(&mut lags, source, &mut self.change);
            self.change.keep_quadratic(&system.electrics);
            system.add_drive_force(q, rate, &self.change, &mut stages.forcing);
        }
    }

    /// Adds to that how Coriolis' force changes with a frame whose rate changes at `rate`: at the start of a step with the
    /// rates `v` of the motion and `start` of the sensitivities.
    pub(super) fn begin_turning(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        (v, rate): (&[Pose], Gyration),
        start: &[Motion],
    ) {
        let mut lags = Lags::new(s);
        for ((stages, &source), start) in self.stages.iter_mut().zip(&self.sources).zip(start) {
            ramp.rate_sensitivity(&mut lags, source, &mut self.change);
            let change = system.frame(&self.change).map(Gyration::new).unwrap_or_default();
            for (k, body) in system.model.bodies.iter().enumerate() {
                let force = skew(body, change.rate, &v[k]) + skew(body, rate.rate, &start.v[k]);
                stages.forcing[k] += held_out(body, force);
            }
        }
    }

    /// Stage `i` at time `s` (s) of the ramp, of a step of length `h` (s) from the sensitivities `start`, where the motion
    /// is at `q` under `drive`. Returns the number of solves.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn stage<S: LinearSolver>(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        (i, s, h): (usize, f64, f64),
        (q, drive): (&[Pose], &Drive),
        matrix: &StepMatrix<'_, S>,
        turning: Option<(&Stages, FrameRotation)>,
        start: &mut [Motion],
    ) -> u64 {
        let model = &system.model;
        let (mut solves, mut lags) = (self.sources.len(), Lags::new(s));
        for ((stages, &source), start) in self.stages.iter_mut().zip(&self.sources).zip(start) {
            stages.begin(model, i, h, start);
            if let Some((_, turning)) = turning {
                stages.add_gyration(model, (i, h), turning.now, turning.start);
            }
            if let Some(loss) = matrix.loss {
                let mut force = std::mem::take(&mut stages.force);
                loss.add_change(|k| stages.speed(i, h, k), &mut force);
                loss.start.add_damping(|k| -stages.r1()[k], &mut force);
                stages.force = force;
            }
            let (at, force) = stages.place(i, start);
            self.tangent.multiply_add(&model.pattern, at, force);
            if let Some(loss) = matrix.loss {
                loss.add_skew(at, force);
            }
            ramp.sensitivity(&mut lags, source, &mut self.change);
            if let Some((motion, turning)) = turning {
                let change = system.frame(&self.change).map(Gyration::new).unwrap_or_default();
                for (k, body) in model.bodies.iter().enumerate() {
                    // the stage's matrix holds Euler's share and changes with it, times minus the increment
                    force[k] += skew(body, turning.now.turning, &at[k])
                        + skew(body, change.rate, &motion.speed(i, h, k))
                        - skew(body, change.turning, &motion.force[k]);
                }
            }
            system.add_drive_force(q, drive, &self.change, force);
            matrix.solve(force);
            if let Some((_, turning)) = turning {
                turning.start.complete(model, GAMMA * h, turning.terms, &mut self.scratch, force, |x| matrix.solve(x));
                solves += turning.terms;
            }
        }
        solves as u64
    }

    /// After the last stage: the new sensitivities.
    pub(super) fn finish(&self, model: &Model, h: f64, sensitivity: &mut [Motion]) {
        for (stages, sensitivity) in self.stages.iter().zip(sensitivity) {
            stages.finish(model, h, sensitivity, None);
        }
    }
}
