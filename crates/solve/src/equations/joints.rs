//! A system in relative joint coordinates: the springs of the tree's joints act on the coordinates, everything else (closures,
//! gaps, loads, dampers) on the bodies.

use bimorph_domains::System;
use bimorph_multibody::Drag;
use bimorph_multibody::joint_coordinates::sprung_loops::loops::Loops;
use bimorph_multibody::joint_coordinates::sprung_loops::{Tree, UnsupportedModel};
use bimorph_multibody::planar::Pose;

/// A system on a tree. Immutable; shared by sessions.
#[derive(Debug, Clone)]
pub struct Joints {
    /// Tree of bodies.
    pub tree: Tree,
    /// The system with the tree's joints taken out.
    pub closures: System,
    /// The joints that close loops, for their forces.
    pub loops: Loops,
    /// Inertia and drag of the bodies, close together.
    pub inertias: Vec<BodyInertia>,
    /// Something drags on bodies or between them.
    pub drags: bool,
}

/// Inertia of a body.
#[derive(Debug, Clone, Copy)]
pub struct BodyInertia {
    /// The mass matrix' diagonal.
    mass: Pose,
    drag: Drag,
}

impl BodyInertia {
    /// The force of an acceleration.
    #[inline(always)]
    pub(crate) fn of(&self, acceleration: &Pose) -> Pose {
        self.mass.component_mul(acceleration)
    }

    /// The force of an acceleration and a rate.
    #[inline(always)]
    pub(crate) fn force(&self, acceleration: &Pose, rate: &Pose) -> Pose {
        self.mass.component_mul(acceleration) + self.drag.force(rate)
    }
}

impl Joints {
    /// The system with everything elastic that is drawn so.
    ///
    /// # Errors
    /// [`UnsupportedModel`].
    pub fn elastic(system: &System) -> Result<Self, UnsupportedModel> {
        if !system.anchors.is_empty() {
            return Err(UnsupportedModel::DrivenAnchor);
        }
        Tree::elastic(&system.model).map(|tree| Self::new(system, tree))
    }

    /// `system` on a tree of its model.
    pub fn new(system: &System, tree: Tree) -> Self {
        let mut closures = system.clone();
        closures.model.joints.clone_from(&tree.closures);
        let bodies = &closures.model.bodies;
        Self {
            inertias: bodies.iter().map(|body| BodyInertia { mass: body.mass_diagonal(), drag: body.drag }).collect(),
            drags: bodies.iter().any(|b| b.drag.amount != 0.0) || !closures.model.dampers.is_empty(),
            loops: Loops::new(&closures.model, &tree.closures),
            tree,
            closures,
        }
    }
}
