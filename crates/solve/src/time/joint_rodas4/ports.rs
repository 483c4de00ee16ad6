//! Sensitivities with respect to final source voltages: the same stages, with the exact change of each stage's force.
//!
//! Where the bodies are is a function of the coordinates that curves; its change comes from the same kinematics run over
//! values with their derivatives, so that partials are those of the numbers that the step returns.

use super::stages::JointStages;
use crate::equations::Joints;
use crate::time::method::Motion;
use crate::time::stage_loss::StageLoss;
use bimorph_domains::{Drive, Lags, Ramp};
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::derivatives::Changes;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::place_of;
use bimorph_multibody::joint_coordinates::sprung_loops::{JointMatrix, Tree};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Pattern, forces};

/// Sources whose final voltages the motion is differentiated by.
#[derive(Debug, Clone)]
pub(super) struct JointPortSensitivities {
    sources: Vec<usize>,
    stages: Vec<JointStages>,
    /// ∂r/∂q of closures and gaps in the stage at hand; without sources on an empty pattern.
    pub(super) tangent: BodyMatrix,
    /// Wrenches of the stage at hand, not summed.
    pub(super) force: Vec<Pose>,
    /// Change of ∂R/∂t with each voltage: bodies, then joints.
    forcing: Vec<(Vec<Pose>, Vec<Pose>)>,
    changes: Changes,
    share: Vec<Pose>,
    wrench: Vec<Pose>,
    /// Right sides and what the solve has found, over the coordinates and the bodies' motions.
    right: Vec<Four>,
    moved: Vec<Four>,
    change: Drive,
}

impl JointPortSensitivities {
    pub(super) fn new(joints: &Joints, sources: &[usize]) -> Self {
        let Joints { tree, closures, .. } = joints;
        let count = tree.links.len();
        let zeros = vec![Pose::zeros(); count];
        let nothing = Pattern::new(0, &[]);
        let pattern = &tree.pattern;
        Self {
            sources: sources.to_vec(),
            stages: sources.iter().map(|_| JointStages::new(count)).collect(),
            tangent: BodyMatrix::new(if sources.is_empty() { &nothing } else { pattern }),
            force: zeros.clone(),
            forcing: sources.iter().map(|_| (zeros.clone(), zeros.clone())).collect(),
            changes: Changes::new(tree),
            share: zeros.clone(),
            wrench: zeros,
            right: vec![Four::ZERO; count],
            moved: vec![Four::ZERO; count + 1],
            change: closures.electrics.drive(),
        }
    }

    /// True where nothing is to be differentiated.
    pub(super) fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// ∂(∂R/∂t)/∂(final voltage) of each source at the start of a step, at `poses`.
    pub(super) fn begin(
        &mut self,
        joints: &Joints,
        ramp: &Ramp<'_>,
        s: f64,
        poses: &[Pose],
        (drive, rate): (&Drive, &Drive),
    ) {
        let Joints { tree, closures, .. } = joints;
        let mut lags = Lags::new(s);
        for ((bodies, springs), &source) in self.forcing.iter_mut().zip(&self.sources) {
            ramp.rate_sensitivity(&mut lags, source, &mut self.change);
            closures.drive_force(poses, drive, &self.change, bodies);
            let rest = self.change.rest();
            for (out, link) in springs.iter_mut().zip(&tree.links) {
                *out = link.stiffness.column(0) * -link.offset(&rest);
            }
            // forces are quadratic in gap voltages: the voltage that rate acts on changes too
            ramp.sensitivity(&mut lags, source, &mut self.change);
            self.change.keep_quadratic(&closures.electrics);
            closures.add_drive_force(poses, rate, &self.change, bodies);
        }
    }

    /// Stage `i` at time `s` (s) of the ramp, of a step of length `h` (s). `at` is the motion's own stage, `start` the
    /// sensitivities of coordinates, rates and accelerations, two motions for each source. Returns the number of solves.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn stage(
        &mut self,
        joints: &Joints,
        ramp: &Ramp<'_>,
        (i, s, h, rate): (usize, f64, f64, f64),
        (at, poses, drive): (&JointStages, &[Pose], &Drive),
        (w, loss): (&JointMatrix, Option<&StageLoss>),
        start: &[Motion],
    ) -> u64 {
        let Joints { tree, closures, .. } = joints;
        let (model, mut lags) = (&closures.model, Lags::new(s));
        for (p, &source) in self.sources.iter().enumerate() {
            let stages = &mut self.stages[p];
            if i == 0 {
                stages.set_out(tree, w, &start[2 * p], &start[2 * p + 1]);
            }
            stages.begin(i, h, &start[2 * p], &start[2 * p + 1]);
            let own = &stages.argument;
            self.changes.place(tree, &at.argument, own);
            // change of the wrenches
            for (j, (wrench, poses)) in self.wrench.iter_mut().zip(&mut self.share).enumerate() {
                let body = &model.bodies[j];
                let [place, speed, push] = self.changes.of(j);
                *wrench = body.mass_diagonal().component_mul(&push) + body.drag.force(&speed);
                *poses = place;
            }
            if !model.dampers.is_empty() {
                forces::add_dampers(model, |k| self.changes.of(k)[1], &mut self.wrench);
            }
            if let Some(loss) = loss {
                loss.add_change(|k| self.changes.of(k)[1], &mut self.wrench);
            }
            self.tangent.multiply_add(&model.pattern, &self.share, &mut self.wrench);
            if let Some(loss) = loss {
                loss.add_skew(&self.share, &mut self.wrench);
            }
            ramp.sensitivity(&mut lags, source, &mut self.change);
            closures.add_drive_force(poses, drive, &self.change, &mut self.wrench);
            self.changes.gather(tree, &self.force, &self.wrench, &mut self.share);
            let rest = self.change.rest();
            let (forcing, springs) = &self.forcing[p];
            for (j, (share, link)) in self.share.iter_mut().zip(&tree.links).enumerate() {
                let (tile, lane) = place_of(j);
                let [mut strain, ..] = own[tile].of(lane);
                strain.x -= link.offset(&rest);
                *share = -(*share + Pose::from(link.stiffness.times(strain.into()))) - springs[j] * rate;
            }
            // inertia and damping at the start of the step
            stages.move_bodies(i, h, true);
            for (j, body) in model.bodies.iter().enumerate() {
                self.wrench[j] = body.mass_diagonal().component_mul(&stages.push(j))
                    + body.drag.force(&stages.drift(j))
                    - forcing[j] * rate;
            }
            if !model.dampers.is_empty() {
                forces::add_dampers(model, |k| stages.drift(k), &mut self.wrench);
            }
            if let Some(loss) = loss {
                loss.start.add_damping(|k| stages.drift(k), &mut self.wrench);
            }
            for (to, from) in self.right.iter_mut().zip(&self.share).chain(self.moved.iter_mut().zip(&self.wrench)) {
                *to = Four::from(*from);
            }
            w.solve(&mut self.moved, &mut self.right);
            stages.keep(i, &self.right, &self.moved);
        }
        self.sources.len() as u64
    }

    /// After the last stage of a step of length `h` (s): the new sensitivities, and those of the bodies, whose coordinates
    /// are at `at`.
    pub(super) fn finish(
        &mut self,
        tree: &Tree,
        h: f64,
        at: &JointStages,
        carried: &mut [Motion],
        bodies: &mut [Motion],
    ) {
        for ((stages, carried), bodies) in self.stages.iter_mut().zip(carried.chunks_exact_mut(2)).zip(bodies) {
            let [now, push] = carried else { continue };
            stages.finish(h, now, push);
            self.changes.place(tree, &at.argument, &stages.argument);
            for (j, (q, v)) in bodies.q.iter_mut().zip(&mut bodies.v).enumerate() {
                [*q, *v, _] = self.changes.of(j);
            }
        }
    }
}
