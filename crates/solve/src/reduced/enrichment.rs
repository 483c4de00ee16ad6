//! Directions that a motion lacks: those in which the full model corrects it.
//!
//! At states of a run the residual of the full model, inertia included, over its tangent is a correction of the displacement ([`super::check`]).
//! Their span contains whatever the directions lack: slow modes that no moment has, the share of other modes by which the
//! frequencies of a reduced model are too high, and the curvature of large motions. The corrections of a run are compressed by their
//! singular values in the mass norm, and the leading ones join the directions. A run in the space of both differs from the first one by the
//! error of the first.
//!
//! A new direction may have hardly any mass, as the rotation of a body within a beam has. Small errors of the polynomials would accelerate it more than all others. So
//! it joins only if it has a part of the energy or of the moving mass of the motion.

use super::ReducedForces;
use super::energy::{EnergyProduct, EnergyVector};
use super::space::ReducedSpace;
use super::training::Training;
use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_multibody::joint_coordinates::sprung_loops::Tree;
use bimorph_multibody::planar::Pose;
use nalgebra::{DMatrix, SymmetricEigen};
use std::sync::Arc;

/// MotionCorrections that are kept, at most: of longer runs every second, every fourth and so on.
const KEPT: usize = 64;
/// Directions that one run adds, at most.
const MOST: usize = 6;
/// Singular value over the largest from which on a correction becomes a direction (1).
const COUNTS: f64 = 1e-3;
/// Part of a correction that must be new (1).
const NEW: f64 = 1e-6;
/// How far a new direction moves, over the largest correction in it (1): motion at its own frequency goes further than what follows its springs.
const REACH: f64 = 4.0;

/// A correction: of the displacements of the bodies ((m), (rad)), and of the coordinates of the tree.
#[derive(Debug, Clone)]
struct Correction {
    moved: Vec<Pose>,
    strains: Vec<Pose>,
}

/// The corrections along a run.
#[derive(Debug, Clone, Default)]
pub struct MotionCorrections {
    kept: Vec<Correction>,
    /// The largest motion in the mass norm (√(kg)·m).
    largest: f64,
    /// One of so many is kept.
    stride: usize,
    seen: usize,
}

impl MotionCorrections {
    /// Adds that of the displacements at a place of the bodies, in a motion that has been as large as `largest` in the mass norm (√(kg)·m).
    pub fn add(&mut self, tree: &Tree, (at, largest): (&[Pose], f64), correction: &[Pose]) {
        self.largest = largest;
        let due = self.seen.is_multiple_of(self.stride.max(1));
        self.seen += 1;
        if !due || correction.iter().any(|c| !c.iter().all(|x| x.is_finite())) {
            return;
        }
        if self.kept.len() == KEPT {
            let mut number = 0;
            self.kept.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.stride = 2 * self.stride.max(1);
        }
        bimorph_base::budget::lay_out(2 * size_of_val(correction));
        let mut strains = vec![Pose::zeros(); at.len()];
        tree.rates_at(at, correction, &mut strains);
        self.kept.push(Correction { moved: correction.to_vec(), strains });
    }

    /// Their leading shapes over the coordinates of the tree.
    fn shapes(&self, system: &System) -> Vec<Vec<Pose>> {
        let count = self.kept.len();
        let gram =
            DMatrix::from_fn(count, count, |k, l| system.model.mass_product(&self.kept[k].moved, &self.kept[l].moved));
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(gram);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| eigenvalues[*b].total_cmp(&eigenvalues[*a]));
        let least = COUNTS * COUNTS * order.first().map_or(0.0, |k| eigenvalues[*k]);
        let leading = order.into_iter().take(MOST).filter(|k| eigenvalues[*k] > least && eigenvalues[*k] > 0.0);
        leading
            .map(|k| {
                let mut sum = vec![Pose::zeros(); system.bodies()];
                for (correction, weight) in self.kept.iter().zip(eigenvectors.column(k).iter()) {
                    sum.iter_mut().zip(&correction.strains).for_each(|(sum, x)| *sum += x * *weight);
                }
                sum
            })
            .collect()
    }
}

/// The training with the directions of the corrections of a run to a tolerance; none where they add none.
pub fn enriched(
    training: &Training,
    system: &System,
    corrections: &MotionCorrections,
    errors: ErrorBudget,
) -> Option<Training> {
    let space = &training.space;
    let product = EnergyProduct::at_rest(&space.joints);
    let strains: Vec<EnergyVector> = corrections.kept.iter().map(|kept| product.of(kept.strains.clone())).collect();
    let mut placed = ReducedForces::new(space);
    placed.place_at_rest(space, &vec![0.0; space.size()]);
    let mut moved = vec![Pose::zeros(); system.bodies()];
    let mut basis: Vec<EnergyVector> = space.directions.iter().map(|x| product.of(x.clone())).collect();
    let mut reach = space.reach.clone();
    for shape in corrections.shapes(system) {
        let before = basis.len();
        product.extend(&mut basis, shape, NEW);
        let Some(direction) = basis.get(before) else { continue };
        let most = strains.iter().map(|x| product.product(direction, x).abs()).fold(0.0, f64::max);
        placed.placed.spread(&space.joints.tree, &direction.x, &mut moved);
        let mass = system.model.mass_product(&moved, &moved).sqrt();
        if errors.is_negligible_direction([most / space.amplitude, most * mass / corrections.largest]) {
            basis.pop();
        } else {
            reach.push(REACH * most);
        }
    }
    let (before, m) = (space.size(), basis.len());
    if m == before {
        return None;
    }
    let further: f64 = reach[before..].iter().map(|reach| reach * reach).sum();
    let amplitude = space.amplitude.hypot(further.sqrt());
    let directions = basis.into_iter().map(|b| b.x).collect();
    let longer = |z: &Vec<f64>| z.iter().copied().chain(std::iter::repeat(0.0)).take(m).collect();
    Some(Training {
        space: ReducedSpace::new(Arc::clone(&space.joints), directions, reach, amplitude),
        added: training.added + m - before,
        equilibria: training.equilibria.iter().map(longer).collect(),
        ..training.clone()
    })
}
