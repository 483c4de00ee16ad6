//! The fall from where a branch ends to the next stable equilibrium: an overdamped motion whose every step leads down in the
//! potential. Without that, iterations jump in and out of stiff contacts for ever.
//!
//! Reference: Kelley & Keyes, "Convergence analysis of pseudo-transient continuation", SIAM J. Numer. Anal. 35 (1998).

use super::path::LoadPath;
use super::{Equilibrium, Path, size};
use crate::domains::System;
use crate::multibody::BlockMatrix;
use crate::multibody::planar::{Block, Pose};
use crate::solve::SolveError;
use nalgebra::Vector2;

/// Smallest damping that is tried, as a share of the softest translation of a body by its own joints: what keeps a part back just
/// beyond a fold is a direction much softer than that.
const LEAST_DAMPING: f64 = 1e-14;
/// Smallest ratio of a body's two stiffnesses that is told from rounding.
const LEAST_RATIO: f64 = 1e-9;
/// A step is taken, down or not, after its damping was raised so often.
const STUBBORN: usize = 60;

impl Equilibrium {
    /// Lets the system fall at the loads of `s` from `q`, as an overdamped motion, to a stable equilibrium; `q` becomes that.
    ///
    /// # Errors
    /// [`SolveError::Lost`] where it falls without end.
    pub fn settle(&mut self, system: &System, path: &dyn LoadPath, s: f64, q: &mut [Pose]) -> Result<Path, SolveError> {
        let mut done = Path::default();
        self.fall(system, path, s, q, &mut done)?;
        Ok(done)
    }

    /// Lets the system fall at fixed loads, as an overdamped motion, to a stable equilibrium.
    pub(super) fn fall(
        &mut self,
        system: &System,
        path: &dyn LoadPath,
        s: f64,
        q: &mut [Pose],
        done: &mut Path,
    ) -> Result<(), SolveError> {
        path.at(s, &mut self.drive);
        self.disturb(system, q);
        // no step longer than a twentieth of the smallest gap
        let longest = 0.05 * system.length_scale;
        // the damping of now, and the last that was needed
        let (mut damping, mut needed): (f64, f64) = (0.0, 0.0);
        let mut height = system.potential(q, &self.drive);
        for _ in 0..self.options.fall_steps {
            crate::budget::check();
            done.iterations += 1;
            system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
            let least = LEAST_DAMPING * softest_ratio(system, &self.tangent);
            if !least.is_finite() {
                return Err(self.lost(system, s, done.iterations, q));
            }
            let mut tried = 0;
            loop {
                crate::budget::check();
                self.add_damping(system, damping);
                system.model.project_matrix(&mut self.tangent);
                let stable = matches!(self.tangent.factor(&system.model.pattern), Ok(i) if i.negative == 0);
                if stable {
                    self.step.copy_from_slice(&self.residual);
                    self.tangent.solve(&system.model.pattern, &mut self.step);
                    if size(system, &self.step) <= longest
                        && (tried > STUBBORN || self.descends(system, q, &mut height))
                    {
                        break;
                    }
                }
                // also where it is no number
                if damping.is_nan() || damping > 1e6 / LEAST_DAMPING * least.max(1e-300) {
                    return Err(self.lost(system, s, done.iterations, q));
                }
                tried += 1;
                damping = if damping == 0.0 { least.max(0.1 * needed) } else { 3.0 * damping };
                system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
            }
            for (q, step) in q.iter_mut().zip(&self.step) {
                *q -= step;
            }
            if tried > STUBBORN {
                height = system.potential(q, &self.drive);
            }
            let moved = size(system, &self.step);
            if damping == 0.0 && moved <= self.options.tolerance * size(system, q).max(system.length_scale) {
                return Ok(());
            }
            needed = damping;
            damping = if damping <= least { 0.0 } else { damping / 4.0 };
        }
        Err(self.lost(system, s, done.iterations, q))
    }

    /// True when `step` leads from `q`, at the potential `height`, down; that becomes the height there. What is too short to
    /// be told from rounding counts as down.
    fn descends(&mut self, system: &System, q: &[Pose], height: &mut f64) -> bool {
        for ((trial, q), step) in self.trial.iter_mut().zip(q).zip(&self.step) {
            *trial = q - step;
        }
        let there = system.potential(&self.trial, &self.drive);
        let down = there <= *height + 1e-12 * (height.abs() + there.abs());
        let short = size(system, &self.step) <= 1e-6 * system.length_scale;
        if down || short {
            *height = there;
        }
        down || short
    }

    /// Moves `q` a little along its softest direction. A bifurcation (a straight beam that buckles) leaves the system
    /// balanced on an unstable branch, from which nothing would fall; this is the imperfection that every real part has.
    fn disturb(&mut self, system: &System, q: &mut [Pose]) {
        let mut damping = 0.0;
        for _ in 0..200 {
            system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
            let first = 1e-6 * softest_ratio(system, &self.tangent);
            self.add_damping(system, damping);
            system.model.project_matrix(&mut self.tangent);
            if matches!(self.tangent.factor(&system.model.pattern), Ok(i) if i.negative == 0) {
                break;
            }
            damping = if damping == 0.0 { first } else { 3.0 * damping };
        }
        // inverse iteration from a fixed vector without symmetry
        let lightest = lightest(system);
        for (j, x) in self.step.iter_mut().enumerate() {
            let m = fall_mass(system, j, lightest);
            *x = Pose::new(m.x, m.y * (1.0 + 0.37 * ((j * 7) % 5) as f64), m.z / system.length_scale);
        }
        for _ in 0..3 {
            system.model.project(&mut self.step);
            self.tangent.solve(&system.model.pattern, &mut self.step);
            let scale = 1e-3 * system.length_scale / size(system, &self.step);
            for (j, x) in self.step.iter_mut().enumerate() {
                self.trial[j] = *x * scale;
                *x = fall_mass(system, j, lightest).component_mul(&self.trial[j]);
            }
        }
        if self.trial.iter().all(|x| x.iter().all(|v| v.is_finite())) {
            for (q, x) in q.iter_mut().zip(&self.trial) {
                *q += x;
            }
        }
    }

    /// `tangent += damping · mass-like weights`.
    fn add_damping(&mut self, system: &System, damping: f64) {
        if damping > 0.0 {
            let lightest = lightest(system);
            for (j, block) in self.tangent.diagonal.iter_mut().enumerate() {
                let m = fall_mass(system, j, lightest);
                for i in 0..3 {
                    block[(i, i)] += damping * m[i];
                }
            }
        }
    }
}

/// Mass-like weights of the overdamped motion; bodies without mass get `lightest` [kg].
fn fall_mass(system: &System, body: usize, lightest: f64) -> Pose {
    let m = system.model.mass(body);
    let turning = lightest * system.length_scale * system.length_scale;
    Pose::new(m.x.max(lightest), m.y.max(lightest), m.z.max(turning))
}

/// The smallest mass of a body that has some [kg]; 1 where none has: the overdamped motion knows ratios alone.
fn lightest(system: &System) -> f64 {
    let masses = (0..system.bodies()).map(|j| system.model.mass(j).x).filter(|m| *m > 0.0);
    let least = masses.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 1.0 }
}

/// The smallest stiffness over mass of a body along its softest free direction, its neighbours held, to begin damping with [1/s²].
/// Independent of the axes of the drawing.
fn softest_ratio(system: &System, tangent: &BlockMatrix<f64, 3>) -> f64 {
    let lightest = lightest(system);
    let ratio = |(j, block): (usize, &Block)| {
        softest(block, system.model.bodies[j].free.as_deref()).map(|k| k / fall_mass(system, j, lightest).x)
    };
    let least = tangent.diagonal.iter().enumerate().filter_map(ratio).fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        return least;
    }
    let turning = |(j, block): (usize, &Block)| block[(2, 2)].abs() / fall_mass(system, j, lightest).z;
    tangent.diagonal.iter().enumerate().map(turning).fold(f64::INFINITY, f64::min)
}

/// The smallest stiffness of a block against translations that `free` leaves [N/m]; none where a body cannot translate, or nothing resists.
fn softest(block: &Block, free: Option<&Block>) -> Option<f64> {
    let along = |d: Vector2<f64>| {
        let k = block.fixed_view::<2, 2>(0, 0);
        (d.dot(&(k * d))).abs()
    };
    if let Some(free) = free {
        let plane = free.fixed_view::<2, 2>(0, 0);
        match plane.trace() {
            none if none < 0.5 => return None,
            // the free direction: the longer column of its projector
            one if one < 1.5 => {
                let [x, y] = [plane.column(0).into_owned(), plane.column(1).into_owned()];
                let longer = if x.norm_squared() >= y.norm_squared() { x } else { y };
                return Some(along(longer.normalize())).filter(|k| *k > 0.0);
            }
            _ => {}
        }
    }
    let (a, b, c) = (block[(0, 0)], block[(1, 0)], block[(1, 1)]);
    let (mean, apart) = (0.5 * (a + c), (0.25 * (a - c) * (a - c) + b * b).sqrt());
    // where they cancel, rounding says nothing of the softer one
    Some((mean.abs() - apart).abs().max(LEAST_RATIO * (mean.abs() + apart))).filter(|k| *k > 0.0)
}
