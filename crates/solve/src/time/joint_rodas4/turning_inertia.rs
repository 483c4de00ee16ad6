//! The part of inertia that the symmetric matrix of a step leaves out: how accelerations change with coordinates and rates.
//!
//! R contains Jᵀ·M·a with a = J·z + J̇·v. W has M and the change of Jᵀ at held forces; its derivative also has
//! ```text
//! N·u = Jᵀ·M·(∂a/∂q·u + 2·J̇·u_v)          u_v = u/(γh) − r₁
//! ```
//! which is unsymmetric: relative accelerations turn with the parent, and Coriolis and centrifugal forces change. Without it, a Rosenbrock method is of
//! first order where bodies turn far, and takes energy from the motion. A stage therefore solves twice,
//! ```text
//! u₀ = W⁻¹·f          u = u₀ − W⁻¹·N·u₀
//! ```
//! which leaves (γhΩ)⁴ with Ω the fastest rotation. The second solve is spared where γhΩ is small beside the root of the tolerance
//! ([`ErrorBudget::turn`]): what a step without N errs by goes with (γhΩ)².

use crate::equations::Joints;
use bimorph_base::ErrorBudget;
use bimorph_multibody::joint_coordinates::sprung_loops::acceleration_change::AccelerationChange;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::{LaneJointStates, TreeKinematics};
use bimorph_multibody::joint_coordinates::sprung_loops::{JointMatrix, Tree};
use bimorph_multibody::planar::Pose;

/// Rotation in γh beyond which the series of two terms is not better than one (rad).
const LARGE: f64 = 0.5;

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct TurningInertia {
    change: AccelerationChange,
    counts: bool,
    right: Vec<Four>,
    wrench: Vec<Four>,
}

impl TurningInertia {
    /// Storage for a tree.
    pub(super) fn new(tree: &Tree) -> Self {
        let count = tree.links.len();
        Self {
            change: AccelerationChange::new(tree),
            counts: false,
            right: vec![Four::ZERO; count],
            wrench: vec![Four::ZERO; count + 1],
        }
    }

    /// At the start of a step with γh = `gh` (s), from the motion `given` of the coordinates, where the bodies have been `placed`.
    pub(super) fn begin(
        &mut self,
        tree: &Tree,
        placed: &TreeKinematics,
        given: &[LaneJointStates],
        gh: f64,
        errors: ErrorBudget,
    ) {
        let turn = gh * placed.rate.iter().map(|rate| rate.z.abs()).fold(0.0, f64::max);
        self.counts = turn > errors.turn() && turn < LARGE;
        if self.counts {
            self.change.fill(tree, placed, given);
        }
    }

    /// Whether the part counts in the step at hand.
    pub(super) fn counts(&self) -> bool {
        self.counts
    }

    /// Completes what the first solve has found: `right` holds the increments of the coordinates, `wrench` the motions of the bodies with
    /// them. `lag` and `drift` are r₁ over the coordinates, and of the rotation of a body. Returns the number of solves.
    pub(super) fn complete(
        &mut self,
        joints: &Joints,
        w: &JointMatrix,
        gh: f64,
        (lag, drift): (impl Fn(usize) -> Pose, impl Fn(usize) -> f64),
        (right, wrench): (&mut [Four], &mut [Four]),
    ) -> u64 {
        if !self.counts {
            return 0;
        }
        let Self { change, right: more, wrench: force, .. } = self;
        change.spread(
            &joints.tree,
            |j| {
                let u = right[j].pose();
                [u, u / gh - lag(j)]
            },
            |j| {
                let turn = wrench[j].0[2];
                [turn, turn / gh - drift(j)]
            },
        );
        for (j, (force, inertia)) in force.iter_mut().zip(&joints.inertias).enumerate() {
            *force = Four::from(-inertia.of(&change.of(j)));
        }
        more.fill(Four::ZERO);
        w.solve(force, more);
        for (to, more) in right.iter_mut().zip(more.iter()).chain(wrench.iter_mut().zip(force.iter())) {
            *to = Four::from(to.pose() + more.pose());
        }
        1
    }
}
