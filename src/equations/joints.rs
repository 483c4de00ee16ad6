//! A system in relative joint coordinates: the springs of the tree's joints act on the coordinates, everything else (closures,
//! gaps, loads, dampers) on the bodies.

use crate::domains::System;
use crate::multibody::relative::{Tree, Unfit};

/// A system on a tree. Immutable; shared by sessions.
#[derive(Debug, Clone)]
pub struct Joints {
    /// Which body hangs on which.
    pub tree: Tree,
    /// The system with the tree's joints taken out.
    pub closures: System,
}

impl Joints {
    /// The system with everything elastic that is drawn so.
    ///
    /// # Errors
    /// [`Unfit`].
    pub fn elastic(system: &System) -> Result<Self, Unfit> {
        Tree::elastic(&system.model).map(|tree| Self::new(system, tree))
    }

    /// `system` on a tree of its model.
    pub fn new(system: &System, tree: Tree) -> Self {
        let mut closures = system.clone();
        closures.model.joints.clone_from(&tree.closures);
        Self { tree, closures }
    }
}
