//! Equations of motion in joint coordinates, for the integrators that work on flat slices.
//!
//! Accelerations come from the recursion, and each accepted step is taken back to the loops ([`bimorph_multibody::joint_coordinates::constrained_loops`]).

use super::dormand_prince::SecondOrder;
use bimorph_multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask, Singularity};
use thiserror::Error;

/// Accelerations are not finite: forces are, so the mechanism has a coordinate without inertia.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("no finite acceleration of body \"{body}\" at {t:.6e} s; give it mass, or lock its direction")]
pub struct NotFinite {
    /// Name of the first such body.
    pub body: String,
    /// Time (s).
    pub t: f64,
}

/// A mechanism with its forces. `loads` adds to `force` and `torque` of the reduction, whose bodies are placed:
/// `loads(t, q, v, reduction)`.
pub struct JointMotion<'a, F> {
    linkage: &'a Linkage,
    /// The recursion with its storage; after an evaluation it holds poses, rates and accelerations.
    pub reduction: Reduction<f64>,
    loads: F,
    change: Vec<f64>,
    /// Evaluations that took the path for singular configurations.
    pub singular: u64,
    /// Diagnostics of the last of them.
    pub met: Singularity,
    /// Largest gap of a loop after a projection (m).
    pub gap: f64,
}

impl<'a, F: FnMut(f64, &[f64], &[f64], &mut Reduction<f64>)> JointMotion<'a, F> {
    /// Storage for `linkage`.
    pub fn new(linkage: &'a Linkage, loads: F) -> Self {
        Self {
            linkage,
            reduction: Reduction::new(&[linkage]),
            loads,
            change: vec![0.0; linkage.coordinates],
            singular: 0,
            met: Singularity::default(),
            gap: 0.0,
        }
    }
}

impl<F: FnMut(f64, &[f64], &[f64], &mut Reduction<f64>)> SecondOrder for JointMotion<'_, F> {
    type Error = NotFinite;

    fn dimension(&self) -> usize {
        self.linkage.coordinates
    }

    fn accelerations(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), NotFinite> {
        let reduction = &mut self.reduction;
        reduction.place(q, v);
        reduction.force.fill([0.0; 3]);
        reduction.torque.fill(0.0);
        (self.loads)(t, q, v, reduction);
        if let Some(met) = reduction.solve(ReductionTask::Accelerations, a) {
            self.singular += 1;
            self.met = met;
        }
        if a.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        let body = reduction.accelerations.iter().rposition(|a| !a.iter().all(|x| x.is_finite())).unwrap_or(0);
        Err(NotFinite { body: self.linkage.names[body].clone(), t })
    }

    fn project(&mut self, _: f64, q: &mut [f64], v: &mut [f64]) -> Result<(), NotFinite> {
        let gap = self.reduction.project_positions(q, v, &mut self.change);
        self.gap = self.gap.max(gap);
        self.reduction.project_rates(q, v, &mut self.change);
        Ok(())
    }
}
