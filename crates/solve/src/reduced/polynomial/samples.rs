//! Equilibria of the full model in the box of inputs, with those beyond a pull-in: those that make the polynomials, and those that test them.

use super::super::branches::{BranchState, StaticBranch, branch_states};
use super::super::energy::{EnergyProduct, EnergyVector};
use super::super::inputs::InputBox;
use super::super::space::ReducedSpace;
use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::Pose;

/// Points of the box within, for the polynomials and for the tests.
const MADE: usize = 20;
const TESTED: usize = 16;

/// An equilibrium of the full model.
#[derive(Debug, Clone)]
pub(super) struct FullEquilibrium {
    /// The drive.
    pub(super) drive: Drive,
    /// Where the bodies are.
    pub(super) q: Vec<Pose>,
    /// The nearest state of the space, in the energy at rest.
    pub(super) z: Vec<f64>,
    /// Whether it tests: corners of the box do, and points that make no polynomial, where parts do not just release.
    pub(super) tests: bool,
    /// Whether it lies beyond a pull-in, on the way back.
    pub(super) beyond: bool,
    /// Whether it makes polynomials.
    pub(super) makes: bool,
}

/// The equilibria at corners and points of a box.
pub(super) fn equilibria(space: &ReducedSpace, system: &System, inputs: &InputBox) -> Vec<FullEquilibrium> {
    let product = EnergyProduct::at_rest(&space.joints);
    let directions: Vec<EnergyVector> = space.directions.iter().map(|b| product.of(b.clone())).collect();
    let points = inputs.points(MADE + TESTED, true);
    let corners = points.len() - MADE - TESTED;
    let state = |found: BranchState| {
        let mut s = vec![Pose::zeros(); found.q.len()];
        space.joints.tree.coordinates_at(&found.q, &mut s);
        let s = product.of(s);
        let z = directions.iter().map(|b| product.product(b, &s)).collect();
        let BranchState { point, branch, drive, q } = found;
        let makes = point < corners + MADE || branch == StaticBranch::Release;
        // an error next to the end of a branch is large, whatever its polynomials
        let tests = (point < corners || !makes) && branch != StaticBranch::Release;
        FullEquilibrium { drive, q, z, tests, beyond: branch == StaticBranch::Beyond, makes }
    };
    branch_states(system, inputs, &points).into_iter().map(state).collect()
}
