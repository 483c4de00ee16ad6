//! Sensitivities with respect to final source voltages: the same stages with the exact change of each stage's forces.
//!
//! The forces are those of polynomials, whose change along a motion costs about as much as the forces. Bodies follow by the exact derivatives of the
//! kinematics of the tree, once at the end of a trial.

use super::coordinates::{ReducedMotion, add_product};
use crate::equations::Motion;
use crate::reduced::ReducedSpace;
use crate::reduced::polynomial::motion::{PolynomialForces, PolynomialMotion};
use crate::reduced::space::ReducedForces;
use crate::time::rodas4::tableau::{A, ALPHA};
use bimorph_domains::{Drive, Lags, Ramp};
use bimorph_multibody::joint_coordinates::sprung_loops::acceleration_change::AccelerationChange;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::LaneJointStates;
use bimorph_multibody::planar::Pose;
use nalgebra::DMatrix;

/// Sources whose final voltages the motion is differentiated by.
#[derive(Debug, Clone)]
pub(super) struct ReducedPortSensitivities {
    sources: Vec<usize>,
    /// Change of coordinates, rates and accelerations at the start of the step, where the stage at hand evaluates, and increments of each stage.
    now: Vec<ReducedMotion>,
    pub(super) at: ReducedMotion,
    pub(super) increments: Vec<Vec<ReducedMotion>>,
    /// Change of ∂R/∂t with each voltage.
    pub(super) forcing: Vec<Vec<f64>>,
    pub(super) force: Vec<f64>,
    change: Drive,
    also: Drive,
    turning: AccelerationChange,
    given: Vec<LaneJointStates>,
    /// ∂(bodies' motion)/∂(final voltage of a source).
    pub(super) bodies: Vec<Motion>,
    /// Whether the matrices at the start of a step stand for the change of the forces with the motion in all its stages.
    pub(super) first_tangent: bool,
}

impl ReducedPortSensitivities {
    pub(super) fn new(space: &ReducedSpace, sources: &[usize]) -> Self {
        let (m, tree) = (space.size(), &space.joints.tree);
        let count = tree.links.len();
        Self {
            sources: sources.to_vec(),
            now: vec![ReducedMotion::zeros(m); sources.len()],
            at: ReducedMotion::zeros(m),
            increments: vec![vec![ReducedMotion::zeros(m); ALPHA.len()]; sources.len()],
            forcing: vec![vec![0.0; m]; sources.len()],
            force: vec![0.0; m],
            change: space.joints.closures.electrics.drive(),
            also: space.joints.closures.electrics.drive(),
            turning: AccelerationChange::new(tree),
            given: LaneJointStates::at_rest(&vec![Pose::zeros(); count]),
            bodies: vec![Motion::zeros(count); sources.len()],
            first_tangent: false,
        }
    }

    /// Number of sources.
    pub(super) fn len(&self) -> usize {
        self.sources.len()
    }

    /// Takes what is carried between steps, two motions for each source.
    pub(super) fn take(&mut self, carried: &[Motion]) {
        for (now, carried) in self.now.iter_mut().zip(carried.chunks_exact(2)) {
            now.unpack(carried);
        }
    }

    /// Gives it back.
    pub(super) fn keep(&self, carried: &mut [Motion]) {
        for (now, carried) in self.now.iter().zip(carried.chunks_exact_mut(2)) {
            now.pack(carried);
        }
    }

    /// ∂(∂R/∂t)/∂(final voltage) of each source at time `s` (s) of the ramp, where a step begins.
    pub(super) fn begin(
        &mut self,
        (of, forces): (&PolynomialMotion, &mut PolynomialForces),
        ramp: &Ramp<'_>,
        s: f64,
        [drive, rate]: [&Drive; 2],
    ) {
        let Self { sources, forcing, also, change, .. } = self;
        let mut lags = Lags::new(s);
        for (forcing, &source) in forcing.iter_mut().zip(&*sources) {
            ramp.rate_sensitivity(&mut lags, source, change);
            // forces are quadratic in gap voltages: the voltage that rate acts on changes too
            ramp.sensitivity(&mut lags, source, also);
            let beside = also.volts.iter().any(|v| *v != 0.0).then_some([rate, &*also]);
            forces.forcing_beside(of, [drive, change], beside, forcing);
        }
    }

    /// The argument of stage `i` of source `p`, and ∂R/∂(final voltage) there in `force`, at the time of `lags` after the start of the ramp. `matrices` are
    /// stiffness, damping and mass at the start of the step.
    pub(super) fn stage(
        &mut self,
        (of, forces): (&PolynomialMotion, &mut PolynomialForces),
        (ramp, lags): (&Ramp<'_>, &mut Lags),
        (p, i): (usize, usize),
        (motion, drive): (&ReducedMotion, &Drive),
        matrices: [&DMatrix<f64>; 3],
    ) {
        let Self { sources, now, at, increments, force, change, first_tangent, .. } = self;
        at.set_sum(&now[p], &A[i], &increments[p][..i]);
        ramp.sensitivity(lags, sources[p], change);
        let parts = [&change.volts, &change.expansion, &change.inputs];
        if parts.iter().all(|x| x.iter().all(|x| *x == 0.0)) && at.is_zero() {
            // the start of a trial depends on no voltage yet
            return force.fill(0.0);
        }
        if *first_tangent {
            forces.forcing(of, drive, change, force);
            matrices.iter().zip(at.parts()).for_each(|(matrix, x)| add_product(matrix, x, force));
        } else {
            forces.change(of, (motion.parts(), at.parts()), (drive, change), force);
        }
    }

    /// After the last stage of a step.
    pub(super) fn finish(&mut self) {
        let Self { now, at, increments, .. } = self;
        let last = ALPHA.len() - 1;
        for (now, increments) in now.iter_mut().zip(&*increments) {
            at.set_sum(now, &A[last], &increments[..last]);
            now.set_sum(at, &[1.0], &increments[last..]);
        }
    }

    /// The change of the bodies' motion, where these are placed by `forces`.
    pub(super) fn place_bodies(&mut self, space: &ReducedSpace, forces: &ReducedForces) {
        let Self { now, turning, given, bodies, .. } = self;
        let tree = &space.joints.tree;
        turning.fill(tree, &forces.placed, &forces.given);
        for (now, bodies) in now.iter().zip(bodies) {
            let [z, v, _] = now.parts();
            space.place_strains([z, v, &[]], given);
            forces.placed.spread_motion(tree, given, [&mut bodies.q, &mut bodies.v]);
            turning.add_rates(tree, given, &bodies.q, &mut bodies.v);
        }
    }
}
