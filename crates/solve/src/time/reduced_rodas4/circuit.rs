//! The method in a circuit: trials from given states with their sensitivities, and equilibria of the same polynomials.

use super::ReducedRodas4;
use super::coordinates::{StageForces, StepMatrices};
use super::ports::ReducedPortSensitivities;
use crate::equations::Motion;
use crate::reduced::ReducedSpace;
use crate::reduced::statics::solve;
use bimorph_domains::{Drive, Lags, Ramp};
use bimorph_multibody::planar::Pose;

/// Iterations of Newton's method for an equilibrium.
const ITERATIONS: usize = 12;
/// Newton ends at corrections below this fraction of the trained amplitude (1).
const TOLERANCE: f64 = 1e-13;
/// Corrections below this fraction that no longer shrink are rounding.
const STALLED: f64 = 1e-9;

impl ReducedRodas4 {
    /// The same with sensitivities to the final voltages of `sources`. Its stages are polynomials ([`ReducedRodas4::with_polynomials`]) throughout; the
    /// caller decides by [`ReducedRodas4::holds`] where the full model takes over.
    #[must_use]
    pub fn with_ports(mut self, sources: &[usize]) -> Self {
        let packed = self.carried[0].clone();
        self.carried.resize(2 + 2 * sources.len(), packed);
        self.ports = Some(Box::new(ReducedPortSensitivities::new(&self.space, sources)));
        self
    }

    /// Coordinates, rates and accelerations, for [`ReducedRodas4::resume`].
    pub fn state(&self) -> &[Motion] {
        &self.carried[..2]
    }

    /// Continues from a state, which no voltage has changed yet: the next start takes it as it is. None: from the bodies' motion.
    pub fn resume(&mut self, state: Option<&[Motion]>) {
        self.carried.iter_mut().for_each(Motion::clear);
        self.carried.iter_mut().zip(state.unwrap_or_default()).for_each(|(to, from)| to.copy(from));
        self.resumed = state.is_some();
        self.put_back();
    }

    /// Minus the change of the forces over the directions, at bodies at `q` under `drive`, with a change of the drive.
    pub fn drive_force(&mut self, q: &[Pose], drive: &Drive, change: &Drive) -> Vec<f64> {
        let [z, _] = super::projected(&self.space, &Motion { q: q.to_vec(), v: vec![Pose::zeros(); q.len()] });
        let mut force = vec![0.0; z.len()];
        if let Some(stages) = &mut self.polynomials {
            let rest = vec![0.0; z.len()];
            stages.forces.residual(&stages.of, [&z, &rest, &rest], drive, &mut force);
            stages.forces.forcing(&stages.of, drive, change, &mut force);
        }
        force.iter_mut().for_each(|force| *force = -*force);
        force
    }

    /// Sets the force over the directions that acts beside the drive: sums of some forces times lines in time, values and slopes (1/s).
    pub fn set_push<'a>(&mut self, lines: impl Iterator<Item = (&'a [f64], [f64; 2])>) {
        let push = self.push.get_or_insert_with(|| Box::new([(); 2].map(|()| vec![0.0; self.force.len()])));
        push.iter_mut().for_each(|part| part.fill(0.0));
        for (force, line) in lines {
            for (part, share) in push.iter_mut().zip(line) {
                part.iter_mut().zip(force).for_each(|(part, force)| *part += share * force);
            }
        }
    }

    /// The space.
    pub fn space(&self) -> &ReducedSpace {
        &self.space
    }

    /// ∂(bodies' motion)/∂(final voltage), one for each source.
    pub fn sensitivity(&self) -> &[Motion] {
        self.ports.as_ref().map_or(&[], |ports| &ports.bodies)
    }

    /// The same, to be filled from outside.
    pub fn sensitivity_mut(&mut self) -> &mut [Motion] {
        self.ports.as_mut().map_or(&mut [], |ports| &mut ports.bodies)
    }

    /// Makes the sensitivities of the bodies those of the motion now.
    pub fn place_sensitivities(&mut self) {
        if let Some(ports) = &mut self.ports {
            ports.take(&self.carried[2..]);
            ports.place_bodies(&self.space, &self.forces);
        }
    }

    /// Takes the coordinates to the end of a step, after which `carried` was carried, moved by their sensitivities times changes of the sources.
    pub fn move_by(&mut self, carried: &[Motion], changes: &[f64]) {
        self.carried.iter_mut().zip(carried).for_each(|(to, from)| to.copy(from));
        let (state, sensitivities) = self.carried.split_at_mut(2);
        for (of_source, change) in sensitivities.chunks_exact(2).zip(changes) {
            state.iter_mut().zip(of_source).for_each(|(to, s)| to.add(*change, s));
        }
        self.put_back();
    }

    /// Whether sensitivities take the matrices at the start of a step for all its stages.
    pub fn keep_first_tangent(&mut self, keep: bool) {
        if let Some(ports) = &mut self.ports {
            ports.first_tangent = keep;
        }
    }

    /// The bodies where the last step or equilibrium placed them.
    pub fn bodies(&self) -> &[Pose] {
        &self.forces.placed.at
    }

    /// The largest coordinates in the mass norm, of equilibria of the training (√(N·m)·s).
    pub fn largest(&self) -> f64 {
        self.polynomials.as_ref().map_or(0.0, |stages| stages.largest)
    }

    /// Accelerations of the bodies that the forces at `drive` bring in a state; one that carries nothing is that of the bodies' `motion`. Those that a state
    /// carries have an error after a step in which a voltage jumps.
    pub fn consistent_accelerations(&mut self, state: &[Motion], motion: (&[Pose], &[Pose]), drive: &Drive) -> &[Pose] {
        if state.is_empty() {
            self.resume(None);
            self.project(&Motion { q: motion.0.to_vec(), v: motion.1.to_vec() });
        } else {
            self.resume(Some(state));
        }
        self.drive.clone_from(drive);
        if self.make_consistent().is_err() {
            let [_, _, w] = self.now.parts_mut();
            w.fill(f64::NAN);
        }
        self.forces.place(&self.space, self.now.parts());
        &self.forces.placed.acceleration
    }

    /// How far the state is beyond the trained ones (1), see [`ReducedSpace::excess`].
    pub fn excess_now(&self) -> f64 {
        self.space.excess(self.now.z())
    }

    /// Whether the polynomials are within their part of the tolerance at the end of the last step, where the drive is `drive`.
    pub fn holds(&mut self, drive: &Drive) -> bool {
        let Some(mut stages) = self.polynomials.take() else { return false };
        self.drive.clone_from(drive);
        let [error, size] = self.compared(&mut stages);
        let holds = error <= stages.share * stages.largest.max(size);
        self.polynomials = Some(stages);
        holds
    }

    /// The equilibrium of the polynomials at a drive next to `z`, where the bodies are placed at rest. Returns how far it is from `z`, of the trained
    /// amplitude; none where there is none, or it is unstable.
    pub fn balance(&mut self, z: &[f64], drive: &Drive) -> Option<f64> {
        self.carried.iter_mut().for_each(Motion::clear);
        self.now.clear();
        self.now.parts_mut()[0].copy_from_slice(z);
        let (mut last, mut done) = (f64::INFINITY, false);
        for _ in 0..ITERATIONS {
            let negative = self.tangent(drive)?;
            let size = self.right.norm() / self.space.amplitude;
            let [z, _, _] = self.now.parts_mut();
            z.iter_mut().zip(self.right.iter()).for_each(|(z, dz)| *z -= dz);
            done = size <= TOLERANCE || size <= STALLED && size > 0.1 * last;
            last = size;
            if !size.is_finite() || negative > 0 {
                return None;
            }
            if done {
                break;
            }
        }
        if !done {
            return None;
        }
        // the tangent of the sensitivities is that of the state
        self.tangent(drive)?;
        self.keep();
        self.forces.place_at_rest(&self.space, self.now.z());
        let off = self.now.z().iter().zip(z).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        Some(off / self.space.amplitude)
    }

    /// Residual and tangent at rest at the motion now; K⁻¹·r is left on the right side. Returns the number of negative pivots.
    fn tangent(&mut self, drive: &Drive) -> Option<usize> {
        let Self { polynomials, now, mass, damping, stiffness, force, right, .. } = self;
        let stages = polynomials.as_mut()?;
        stages.forces.residual(&stages.of, now.parts(), drive, force);
        stages.forces.matrices(&stages.of, mass, damping, stiffness);
        right.as_mut_slice().copy_from_slice(force);
        let (change, negative) = solve(stiffness, right)?;
        right.copy_from(&change);
        Some(negative)
    }

    /// The sensitivity of the equilibrium at `drive` to source `p`, with which the drive changes by `change`; after [`ReducedRodas4::balance`].
    pub fn balance_port(&mut self, p: usize, drive: &Drive, change: &Drive) {
        let Self { polynomials, now, at, stiffness, force, right, carried, .. } = self;
        let Some(stages) = polynomials else { return };
        at.clear();
        stages.forces.change(&stages.of, (now.parts(), at.parts()), (drive, change), force);
        right.as_mut_slice().copy_from_slice(force);
        if let Some((moved, _)) = solve(stiffness, right) {
            let [z, _, _] = at.parts_mut();
            z.iter_mut().zip(moved.iter()).for_each(|(to, x)| *to = -x);
        }
        at.pack(&mut carried[2 + 2 * p..4 + 2 * p]);
    }

    /// The increments of stage `i` of the sensitivities, at time `s` (s) of the ramp.
    pub(super) fn solve_ports(&mut self, ramp: &Ramp<'_>, (i, s, h): (usize, f64, f64)) {
        let Some(mut ports) = self.ports.take() else { return };
        let mut lags = Lags::new(s);
        for p in 0..ports.len() {
            let Self { polynomials: Some(stages), factor: Some(factor), at, drive, mass, damping, .. } = self else {
                break;
            };
            let matrices = [&self.stiffness, &*damping, &*mass];
            ports.stage((&stages.of, &mut stages.forces), (ramp, &mut lags), (p, i), (at, drive), matrices);
            let ReducedPortSensitivities { at, force, forcing, increments, .. } = &mut *ports;
            let damping = self.damped.then_some(&*damping);
            let step = StepMatrices { mass, damping, factor: factor.l_dirty(), h };
            self.stage.solve(step, StageForces { i, at, force, forcing: &forcing[p] }, &mut increments[p]);
            self.work.solves += 1;
        }
        self.ports = Some(ports);
    }
}
