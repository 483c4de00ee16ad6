//! The error of a motion over bodies, see [`crate::time::defect`].

use super::tableau::GAMMA;
use crate::equations::linear::LinearSolver;
use crate::method::Motion;
use crate::time::defect::{Impulses, MotionError, NODES, POWERS, cubic_start, quartic};
use crate::time::stage_loss::StepMatrix;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::forces;
use bimorph_multibody::planar::Pose;

/// An acceleration is that of a resolved motion where it would change the rate in a step by no more than this many times the rates at the
/// ends.
const RESOLVED: f64 = 10.0;

/// The error, and storage for a step of it.
#[derive(Debug, Clone)]
pub(super) struct DefectEstimate {
    error: Motion,
    /// Energy that the residuals have taken (J).
    taken: f64,
    impulses: Impulses,
    /// r at the start of the step; then the acceleration there.
    start: Vec<Pose>,
    /// P and its rate at a node.
    at: Motion,
    rho: Vec<Pose>,
}

impl DefectEstimate {
    /// Storage for so many bodies, without an error.
    pub(super) fn zeros(count: usize) -> Self {
        let zeros = vec![Pose::zeros(); count];
        Self {
            error: Motion::zeros(count),
            taken: 0.0,
            impulses: Impulses::zeros(count),
            start: zeros.clone(),
            at: Motion::zeros(count),
            rho: zeros,
        }
    }

    /// Content of the first stage before r is added to it, and after.
    pub(super) fn before_forces(&mut self, force: &[Pose]) {
        self.start.copy_from_slice(force);
    }

    pub(super) fn after_forces(&mut self, force: &[Pose]) {
        self.start.iter_mut().zip(force).for_each(|(start, force)| *start = force - *start);
    }

    /// The error at the end of a step that left its factor in `w`.
    pub(super) fn advance<S: LinearSolver>(
        &mut self,
        system: &System,
        (ramp, drive): (&Ramp<'_>, &mut Drive),
        matrix: &StepMatrix<'_, S>,
        (s, h): (f64, f64),
        [before, after]: [&Motion; 2],
    ) -> MotionError<'_> {
        let model = &system.model;
        let gh = GAMMA * h;
        self.accelerate(system, h, before, after);
        let Self { taken, impulses, start, at, rho, .. } = self;
        impulses.clear();
        for node in NODES {
            ramp.at(s + node.0 * h, drive);
            let ends = before.q.iter().zip(&after.q).zip(before.v.iter().zip(&after.v)).zip(&*start);
            let places = at.q.iter_mut().zip(&mut at.v).zip(rho.iter_mut());
            for (body, (((q, v), rho), (((q0, q1), (v0, v1)), a0))) in model.bodies.iter().zip(places.zip(ends)) {
                let a;
                [*q, *v, a] = quartic(node.0, h, [q0, q1], [v0, v1], a0);
                *rho = body.mass_diagonal().component_mul(&a) + body.drag.force(v);
            }
            forces::add_dampers(model, |k| at.v[k], rho);
            system.add_residual(&at.q, drive, rho);
            *taken -= node.1 * h * at.v.iter().zip(&*rho).map(|(v, rho)| v.dot(rho)).sum::<f64>();
            rho.iter().enumerate().for_each(|(k, rho)| impulses.add(k, node, h, *rho));
        }
        self.propagate(system, matrix, gh);
        MotionError { motion: &self.error, taken: self.taken }
    }

    /// [`crate::time::defect::propagate`] in one sweep over the bodies between two solves.
    fn propagate<S: LinearSolver>(&mut self, system: &System, matrix: &StepMatrix<'_, S>, gh: f64) {
        let model = &system.model;
        let Self { error, impulses, at, rho, .. } = self;
        // between two sweeps the vector is z in the displacements and z/(γh) − drift in the rates
        let (drift, rate) = (&mut at.q, 1.0 / gh);
        rho.fill(Pose::zeros());
        drift.fill(Pose::zeros());
        for (number, power) in POWERS.into_iter().rev().enumerate() {
            let e = error.q.iter().zip(&error.v);
            let sweep = rho.iter_mut().zip(drift.iter_mut()).zip(e).zip(&model.bodies);
            for (k, (((z, drift), (e_q, e_v)), body)) in sweep.enumerate() {
                let v = *z * rate - *drift + e_v * power;
                *drift = (*z + e_q * power) * rate;
                let momentum = body.mass_diagonal().component_mul(&(*drift + v)) + impulses.of(number, k);
                *z = momentum * rate + body.drag.force(drift);
            }
            forces::add_dampers(model, |k| drift[k], rho);
            model.project(rho);
            matrix.solve(rho);
            model.project(rho);
        }
        for ((z, drift), (e_q, e_v)) in rho.iter().zip(&*drift).zip(error.q.iter_mut().zip(&mut error.v)) {
            (*e_q, *e_v) = (*z, *z * rate - drift);
        }
    }

    /// The acceleration at the start of the step. In directions without mass it is that of a cubic through both ends.
    /// The same applies to masses so small that they follow their springs within the step, where a residual of the
    /// force balance would be an acceleration.
    fn accelerate(&mut self, system: &System, h: f64, before: &Motion, after: &Motion) {
        let model = &system.model;
        let start = &mut self.start;
        forces::add_damping(model, &before.v, start);
        model.project(start);
        for (k, force) in start.iter_mut().enumerate() {
            let (mass, v) = (model.mass(k), [&before.v[k], &after.v[k]]);
            let within = |mass: f64, force: f64, rates: f64| mass > 0.0 && h * force <= RESOLVED * mass * rates;
            // of a translation as a whole: the directions of the axes decide nothing
            let moves = within(mass.x.min(mass.y), force.xy().norm(), v[0].xy().norm() + v[1].xy().norm());
            let turns = within(mass.z, force.z.abs(), v[0].z.abs() + v[1].z.abs());
            for (i, resolved) in [moves, moves, turns].into_iter().enumerate() {
                force[i] = match resolved {
                    true => -force[i] / mass[i],
                    false => cubic_start(h, [before.q[k][i], after.q[k][i]], [v[0][i], v[1][i]]),
                };
            }
        }
    }
}
