//! Vectors over the coordinates of a tree in the energy of the tangent at rest, ⟨x, y⟩ = xᵀ·K₀·y.
//!
//! K₀ = K_T + Jᵀ·K_b·J with the tree's springs K_T and the stiffness K_b over the bodies: closures, gaps under a bias. In this
//! product lengths and angles have one scale, and a closure counts as much as it stores.

use super::space::dot;
use crate::equations::Joints;
use bimorph_domains::Drive;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::{LaneJointStates, TreeKinematics};
use bimorph_multibody::planar::Pose;

/// The product at rest as drawn.
#[derive(Debug)]
pub struct EnergyProduct<'a> {
    joints: &'a Joints,
    placed: TreeKinematics,
    stiffness: BodyMatrix,
}

/// A vector with what its product with others takes.
#[derive(Debug, Clone)]
pub struct EnergyVector {
    /// The vector.
    pub x: Vec<Pose>,
    /// Motion of the bodies with it.
    moved: Vec<Pose>,
    /// K_T·x and K_b·J·x.
    force: [Vec<Pose>; 2],
}

impl<'a> EnergyProduct<'a> {
    /// Of a system on its tree without any drive.
    pub fn at_rest(joints: &'a Joints) -> Self {
        let closures = &joints.closures;
        let zeros = vec![Pose::zeros(); joints.tree.links.len()];
        let mut placed = TreeKinematics::new(&joints.tree);
        placed.place(&joints.tree, &LaneJointStates::at_rest(&zeros));
        let mut stiffness = BodyMatrix::new(&joints.tree.pattern);
        let mut room = zeros.clone();
        let drive = Drive { load: 0.0, ..closures.electrics.drive() };
        closures.tangent(&zeros, &drive, &mut stiffness, &mut room);
        Self { joints, placed, stiffness }
    }

    /// A vector with its products.
    pub fn of(&self, x: Vec<Pose>) -> EnergyVector {
        let tree = &self.joints.tree;
        let mut moved = vec![Pose::zeros(); x.len()];
        self.placed.spread(tree, &x, &mut moved);
        let mut force = vec![Pose::zeros(); x.len()];
        self.stiffness.multiply_add(&tree.pattern, &moved, &mut force);
        let own = tree.links.iter().zip(&x).map(|(link, x)| link.stiffness * *x).collect();
        EnergyVector { x, moved, force: [own, force] }
    }

    /// ⟨x, y⟩ (N·m).
    pub fn product(&self, x: &EnergyVector, y: &EnergyVector) -> f64 {
        dot(&x.x, &y.force[0]) + dot(&x.moved, &y.force[1])
    }

    /// Adds the part of `x` that is orthogonal to a basis, of norm 1, where it is more than `least` of x. Returns the
    /// coefficients of x in the basis, the new one last if there is one.
    pub fn extend(&self, basis: &mut Vec<EnergyVector>, x: Vec<Pose>, least: f64) -> Vec<f64> {
        bimorph_base::budget::check();
        let mut rest = self.of(x);
        let whole = self.product(&rest, &rest).max(0.0).sqrt();
        let mut coefficients = vec![0.0; basis.len()];
        // the second pass removes what rounding left in the first
        for _ in 0..2 {
            let shares: Vec<f64> = basis.iter().map(|b| self.product(b, &rest)).collect();
            let mut x = std::mem::take(&mut rest.x);
            for ((b, share), sum) in basis.iter().zip(&shares).zip(&mut coefficients) {
                x.iter_mut().zip(&b.x).for_each(|(x, b)| *x -= b * *share);
                *sum += share;
            }
            rest = self.of(x);
        }
        let norm = self.product(&rest, &rest).max(0.0).sqrt();
        if norm > least * whole && norm > 0.0 {
            let x = rest.x.iter().map(|x| x / norm).collect();
            basis.push(self.of(x));
            coefficients.push(norm);
        }
        coefficients
    }
}
