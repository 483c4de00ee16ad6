//! Friction of parts at rest along stops: each sticks to an anchor by a spring, and slips where that pulls by more than Coulomb's force.
//! ```text
//! T = k_t·(s − a)      where |T| ≤ μ·N: it sticks
//! T = ±μ·N             elsewhere: it slips, and the anchor follows, a = s ∓ μ·N/k_t
//! ```
//! with s the way along the stop, N the contact force and k_t the stiffness of the contact along it. The anchors are the history of an equilibrium. Within
//! a load step they rest, and T is mapped back onto the cone |T| ≤ μ·N; at its end they follow. A spring with a constant stiffness and a bound takes
//! energy out of every closed way.
//!
//! A force that slips changes with the contact force: μ·N′·∇s∇uᵀ is not symmetric. The tangent is left symmetric and its factor is corrected by the few vectors of parts
//! that slip (M. A. Woodbury, "Inverting modified matrices", 1950).
//!
//! Reference: J. C. Simo, T. J. R. Hughes, "Computational Inelasticity" (1998), ch. 1 and 3, for return mapping and its consistent tangent.

use super::approach::{Approach, ApproachDerivatives};
use super::domain::Domain;
use super::system::System;
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Model};
use nalgebra::{DMatrix, DVector};

/// A force that changes with the contact force: its direction, and its derivative.
#[derive(Debug, Clone)]
struct SlipForce {
    force: Vec<Pose>,
    by: (Approach, ApproachDerivatives, f64),
}

/// The anchors of a system, and how its parts slip.
#[derive(Debug, Clone)]
pub struct Sticking {
    /// Members with friction at rest.
    stops: Vec<usize>,
    /// Of each where its anchor lies along it (m).
    anchors: Vec<f64>,
    /// Of each whether it is apart where the load step begins: it meets no friction in that step.
    apart: Vec<bool>,
    /// Of each whether it sticks in a prediction, whatever its force.
    stuck: Vec<bool>,
    slips: Vec<SlipForce>,
}

impl Sticking {
    /// With anchors as drawn.
    pub fn new(system: &System) -> Self {
        let has = |g: &usize| system.members[*g].sticks();
        let stops: Vec<usize> = (0..system.members.len()).filter(has).collect();
        let n = stops.len();
        Self { stops, anchors: vec![0.0; n], apart: vec![true; n], stuck: vec![false; n], slips: Vec::new() }
    }

    /// True where nothing has friction at rest.
    pub fn is_empty(&self) -> bool {
        self.stops.is_empty()
    }

    /// Where the anchors lie along their stops (m).
    pub fn anchors(&self) -> &[f64] {
        &self.anchors
    }

    /// Takes anchors, as many as there are; others: those at rest at `q`.
    pub fn set_anchors(&mut self, system: &System, q: &[Pose], anchors: &[f64]) {
        if anchors.len() == self.anchors.len() {
            self.anchors.copy_from_slice(anchors);
        } else {
            self.release(system, q);
        }
    }

    /// Puts the anchors where nothing pulls on them.
    pub fn release(&mut self, system: &System, q: &[Pose]) {
        for (g, anchor) in self.stops.iter().zip(&mut self.anchors) {
            if let Some(point) = system.stick_point(*g, q) {
                *anchor = point.slide.value;
            }
        }
    }

    /// Begins a load step at `q`.
    pub fn begin(&mut self, system: &System, q: &[Pose]) {
        self.stuck.fill(false);
        for (g, apart) in self.stops.iter().zip(&mut self.apart) {
            *apart = system.stick_point(*g, q).is_none_or(|point| point.limit.0 == 0.0);
        }
    }

    /// True where a part comes to bear in the step from where it began to `q`.
    pub fn closes(&self, system: &System, q: &[Pose]) -> bool {
        let bears = |g: usize| system.stick_point(g, q).is_some_and(|point| point.limit.0 > 0.0);
        self.stops.iter().zip(&self.apart).any(|(g, apart)| *apart && bears(*g))
    }

    /// Ends a load step at `q`: anchors follow what slips or is apart.
    pub fn accept(&mut self, system: &System, q: &[Pose]) {
        for ((g, anchor), apart) in self.stops.iter().zip(&mut self.anchors).zip(&self.apart) {
            let Some(point) = system.stick_point(*g, q) else { continue };
            let (s, bound) = (point.slide.value, point.limit.0 / point.stiffness);
            *anchor = if *apart { s } else { anchor.clamp(s - bound, s + bound) };
        }
    }

    /// Adds the forces at `q` and the symmetric part of their derivatives, and keeps the rest for [`Sticking::correct`]. In a prediction what is at its limit slips.
    pub fn add(&mut self, system: &System, q: &[Pose], predicts: bool, tangent: &mut BodyMatrix, r: &mut [Pose]) {
        self.slips.clear();
        for (k, g) in self.stops.iter().enumerate() {
            let Some(point) = system.stick_point(*g, q).filter(|_| !self.apart[k]) else { continue };
            let (force, slips) = point.force(self.anchors[k], predicts);
            let slips = slips && !self.stuck[k];
            point.along.add_force(&point.slide, force, r);
            let hessian = point.slide.hessian(force, if slips { 0.0 } else { point.stiffness });
            locate(&system.model.pattern, point.along.a.body, point.along.b.body).add(tangent, &hessian);
            if slips {
                let mut direction = vec![Pose::zeros(); q.len()];
                point.along.add_force(&point.slide, force.signum(), &mut direction);
                system.model.project(&mut direction);
                let by = (point.approach, point.toward, point.limit.1);
                self.slips.push(SlipForce { force: direction, by });
            }
        }
        system.model.project(r);
    }

    /// `x` = K⁻¹·f becomes the solution with the derivatives that the factor K leaves out.
    pub fn correct(&self, model: &Model, factor: &BodyMatrix, x: &mut [Pose]) {
        if self.slips.is_empty() {
            return;
        }
        let solved: Vec<Vec<Pose>> = (self.slips.iter())
            .map(|slip| {
                let mut z = slip.force.clone();
                factor.solve(&model.pattern, &mut z);
                z
            })
            .collect();
        let change = |slip: &SlipForce, x: &[Pose]| slip.by.2 * slip.by.0.change(&slip.by.1, x);
        let n = self.slips.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| f64::from(i == j) + change(&self.slips[i], &solved[j]));
        let right = DVector::from_fn(n, |i, _| change(&self.slips[i], x));
        let Some(sizes) = matrix.lu().solve(&right) else { return };
        for (z, size) in solved.iter().zip(sizes.iter()) {
            x.iter_mut().zip(z).for_each(|(x, z)| *x -= z * *size);
        }
    }

    /// True where a predicted step `dq` from `q` turns back what counts as slipping: that sticks from now on.
    pub fn turns_back(&mut self, system: &System, q: &[Pose], dq: &[Pose]) -> bool {
        let mut turned = false;
        for (k, g) in self.stops.iter().enumerate() {
            let Some(point) = system.stick_point(*g, q).filter(|_| !self.apart[k] && !self.stuck[k]) else { continue };
            let (force, slips) = point.force(self.anchors[k], true);
            let growth = point.stiffness * point.along.change(&point.slide, dq) * force.signum()
                - point.limit.1 * point.approach.change(&point.toward, dq);
            if slips && growth < 0.0 {
                self.stuck[k] = true;
                turned = true;
            }
        }
        turned
    }
}
