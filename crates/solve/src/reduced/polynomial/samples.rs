//! Equilibria of the full model in the box of inputs, with pull-in where that comes: those that make the polynomials, and those that test
//! them.

use super::super::energy::{EnergyProduct, EnergyVector};
use super::super::inputs::InputBox;
use super::super::space::ReducedSpace;
use super::super::taylor::DriveRay;
use crate::equilibrium::{Equilibrium, EquilibriumOptions};
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
    /// Whether it tests: corners of the box do, and points that make no polynomial.
    pub(super) tests: bool,
    /// Whether it makes polynomials.
    pub(super) makes: bool,
}

/// The equilibria at corners and points of a box.
pub(super) fn equilibria(space: &ReducedSpace, system: &System, inputs: &InputBox) -> Vec<FullEquilibrium> {
    let product = EnergyProduct::at_rest(&space.joints);
    let directions: Vec<EnergyVector> = space.directions.iter().map(|b| product.of(b.clone())).collect();
    let mut solver = Equilibrium::new(system, EquilibriumOptions::default());
    let points = inputs.points(MADE + TESTED, true);
    let corners = points.len() - MADE - TESTED;
    let mut found = Vec::new();
    for (k, u) in points.iter().enumerate() {
        let drive = inputs.drive(u);
        if drive == inputs.none {
            continue;
        }
        let mut q = vec![Pose::zeros(); system.bodies()];
        let path = solver.follow(system, &DriveRay { none: &inputs.none, to: &drive }, &mut q);
        if path.is_ok_and(|path| path.reached == 1.0) {
            let mut s = vec![Pose::zeros(); q.len()];
            space.joints.tree.coordinates_at(&q, &mut s);
            let s = product.of(s);
            let z = directions.iter().map(|b| product.product(b, &s)).collect();
            let makes = k < corners + MADE;
            found.push(FullEquilibrium { drive, q, z, tests: k < corners || !makes, makes });
        }
    }
    found
}
