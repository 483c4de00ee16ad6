//! Dormand–Prince on a system of bodies: explicit, order 5 with an embedded order 4.
//!
//! Steps are bound by the fastest motion of all, the axial one of the shortest segment, and every free direction needs
//! inertia: q̈ = −M⁻¹·(r + C·q̇). See [`super::dormand_prince`] for the method.

use super::dormand_prince::{DormandPrince, SecondOrder};
use super::method::{Method, Motion, StepFailure, Work};
use crate::domains::{Drive, Ramp, System};
use crate::multibody::forces;
use crate::multibody::planar::Pose;
use crate::solve::{DIRECTIONS, SolveError};

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct Rk45 {
    core: DormandPrince,
    bodies: Bodies,
    /// Start of the step last tried: time and flat motion; none before the first.
    begun: Option<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    /// End of it.
    ended: f64,
}

/// What an evaluation of the accelerations works in.
#[derive(Debug, Clone)]
struct Bodies {
    inverse: Vec<Pose>,
    at: Motion,
    force: Vec<Pose>,
    drive: Drive,
}

/// A system under a ramp, solved for its accelerations.
struct Accelerations<'a> {
    system: &'a System,
    ramp: &'a Ramp<'a>,
    bodies: &'a mut Bodies,
}

impl SecondOrder for Accelerations<'_> {
    type Error = StepFailure;

    fn dimension(&self) -> usize {
        3 * self.system.bodies()
    }

    fn accelerations(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), StepFailure> {
        let b = &mut *self.bodies;
        unflatten(q, &mut b.at.q);
        unflatten(v, &mut b.at.v);
        self.ramp.at(t, &mut b.drive);
        self.system.residual(&b.at.q, &b.drive, &mut b.force);
        forces::add_damping(&self.system.model, &b.at.v, &mut b.force);
        for (f, inverse) in b.force.iter_mut().zip(&b.inverse) {
            *f = -f.component_mul(inverse);
        }
        self.system.model.project(&mut b.force);
        flatten(&b.force, a);
        Ok(())
    }
}

fn flatten(poses: &[Pose], out: &mut [f64]) {
    for (p, out) in poses.iter().zip(out.chunks_exact_mut(3)) {
        out.copy_from_slice(p.as_slice());
    }
}

fn unflatten(x: &[f64], out: &mut [Pose]) {
    for (x, out) in x.chunks_exact(3).zip(out) {
        out.copy_from_slice(x);
    }
}

fn same(poses: &[Pose], flat: &[f64]) -> bool {
    poses.iter().zip(flat.chunks_exact(3)).all(|(p, x)| p.as_slice() == x)
}

impl Rk45 {
    /// Storage for a system.
    ///
    /// # Errors
    /// [`SolveError::Massless`] where a free direction has no inertia.
    pub fn new(system: &System) -> Result<Self, SolveError> {
        let n = system.bodies();
        let mut inverse = vec![Pose::zeros(); n];
        for (j, body) in system.model.bodies.iter().enumerate() {
            let mass = system.model.mass(j);
            for i in 0..3 {
                if mass[i] > 0.0 {
                    inverse[j][i] = 1.0 / mass[i];
                } else if body.free.as_ref().is_none_or(|p| p[(i, i)] > 0.0) {
                    return Err(SolveError::Massless { body: body.name.to_string(), direction: DIRECTIONS[i] });
                }
            }
        }
        let bodies =
            Bodies { inverse, at: Motion::zeros(n), force: vec![Pose::zeros(); n], drive: system.electrics.drive() };
        let core = DormandPrince::new(3 * n);
        Ok(Self { core, bodies, begun: None, q: vec![0.0; 3 * n], v: vec![0.0; 3 * n], ended: 0.0 })
    }
}

impl Method for Rk45 {
    fn error_order(&self) -> f64 {
        5.0
    }

    fn start(&mut self, _: &System, _: &Ramp<'_>, _: &Motion) -> Result<(), StepFailure> {
        self.begun = None;
        Ok(())
    }

    fn step(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        s: f64,
        h: f64,
        motion: &mut Motion,
        error: &mut Motion,
    ) -> Result<(), StepFailure> {
        let mut problem = Accelerations { system, ramp, bodies: &mut self.bodies };
        let (q, v) = (&mut self.q, &mut self.v);
        let begun = self.begun.take();
        let at = |q: &[f64], v: &[f64]| same(&motion.q, q) && same(&motion.v, v);
        if begun.is_some() && s == self.ended && at(&self.core.next.q, &self.core.next.v) {
            // the last step was accepted: its last stage is the first of this one
            self.core.advance();
            flatten(&motion.q, q);
            flatten(&motion.v, v);
        } else if begun != Some(s) || !at(q, v) {
            flatten(&motion.q, q);
            flatten(&motion.v, v);
            self.core.forget();
            self.core.begin(&mut problem, s, q, v)?;
        }
        self.core.attempt(&mut problem, s, h, q, v)?;
        (self.begun, self.ended) = (Some(s), s + h);
        unflatten(&self.core.next.q, &mut motion.q);
        unflatten(&self.core.next.v, &mut motion.v);
        unflatten(&self.core.error.q, &mut error.q);
        unflatten(&self.core.error.v, &mut error.v);
        Ok(())
    }

    fn work(&self) -> Work {
        Work { forces: self.core.effort.accelerations, ..Work::default() }
    }
}
