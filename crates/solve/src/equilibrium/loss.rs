//! Where a branch loses its stability: which kind of loss it is, and to which side the part goes.
//!
//! The softest motion φ of the last stable equilibrium comes from inverse iteration with W of [`super::fall`]. A little beyond
//! the loss the unbalanced force −r works on φ at a limit point and hardly does at a bifurcation,
//! ```text
//! p = |φᵀr| / (‖φ‖·‖r‖)
//! ```
//! in the units of W. At a limit point the part goes where the force does work. At a bifurcation both sides are alike, and
//! [`System::side`] decides by a rule that turns with the drawing.

use super::fall::{FallFailure, MAX_SHIFT, Units};
use super::path::LoadPath;
use super::{Equilibrium, Path};
use crate::SolveError;
use bimorph_domains::System;
use bimorph_multibody::forces::axial_force;
use bimorph_multibody::planar::Pose;
use serde::{Deserialize, Serialize};

/// Participation of the load in the softest motion that divides bifurcations (up to 4e-6 seen) from limit points (from 1.7e-4).
const PARTICIPATION: f64 = 3e-5;
/// Residual force that is rounding, as a fraction of the largest section force.
const ROUNDED_FORCE: f64 = 1e-8;
/// Inverse iterations for the softest motion.
const ROUNDS: usize = 6;
/// Largest displacement of the disturbance with which a fall begins, in the units of W.
const DISTURBANCE: f64 = 1e-3;
/// Loads at which a fall is tried, in units of the load at the loss.
const BEYOND: [f64; 2] = [1.02, 1.1];
/// Stability losses on one path at most.
pub(super) const MAX_LOSSES: usize = 60;
/// How far beyond its loss a path that begins under load falls, as a fraction of the path, and its first step from there.
const BEYOND_LOADED: [f64; 2] = [1e-2, 0.25];

/// A kind of stability loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossKind {
    /// The branch turns back: pull-in, release, snap-through.
    LimitPoint,
    /// Another branch crosses: buckling of an ideal part.
    Bifurcation,
}

/// A loss of stability that a path passed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StabilityLoss {
    /// Its kind.
    pub kind: LossKind,
    /// Fraction of the path where it lies (1).
    pub share: f64,
    /// Where the part went: the beam that bends and its side, seen along its drawn direction; without one the body that moves most.
    pub direction: String,
}

/// Where a part goes at a loss of stability.
#[derive(Debug, Clone)]
pub(super) struct EscapeDirection {
    pub(super) kind: LossKind,
    /// Of the softest motion.
    pub(super) sign: f64,
    direction: String,
}

impl Equilibrium {
    /// Leads from the last stable equilibrium `q` at `s` past the loss of stability that follows to a stable equilibrium at a larger fraction,
    /// which it returns with the next load step.
    pub(super) fn pass(
        &mut self,
        system: &System,
        path: &dyn LoadPath,
        (s, next): (f64, f64),
        q: &mut [Pose],
        done: &mut Path,
    ) -> Result<(f64, f64), SolveError> {
        if done.passed.len() >= MAX_LOSSES {
            return Err(Self::too_many(s, done));
        }
        let loaded = path.begins_loaded();
        let beyond = |factor: f64| {
            let to = if loaded { s + BEYOND_LOADED[0] * (factor - 1.0) / (BEYOND[0] - 1.0) } else { factor * s };
            to.max(next).min(1.0)
        };
        self.before.copy_from_slice(q);
        path.at(s, &mut self.drive);
        let known = self.softest(system, q).is_some();
        let mut why = FallFailure::Stuck;
        for factor in BEYOND {
            let to = beyond(factor);
            path.at(to, &mut self.drive);
            let towards = known.then(|| self.judge(system, q));
            self.lean(q, towards.as_ref().map_or(0.0, |towards| towards.sign));
            match self.fall(system, path, to, q, done) {
                // a segment far from its chord stretches without strain: its energy is not that of a beam
                Ok(()) if Self::beyond_beams(system, q).is_none() => {
                    let EscapeDirection { kind, direction, .. } = towards.unwrap_or_else(EscapeDirection::unknown);
                    done.passed.push(StabilityLoss { kind, share: s, direction });
                    return Ok((to, if loaded { BEYOND_LOADED[1] } else { 0.25 * to }));
                }
                Ok(()) => why = FallFailure::Stuck,
                Err(unsettled) => why = unsettled,
            }
            self.stopped.copy_from_slice(q);
            q.copy_from_slice(&self.before);
        }
        let stopped = std::mem::take(&mut self.stopped);
        let error = self.lost(system, s, why, done, &stopped);
        self.stopped = stopped;
        Err(error)
    }

    /// Rejects a state beyond losses of stability whose segments do not represent beams.
    pub(super) fn check_beams(&mut self, system: &System, s: f64, done: &Path, q: &[Pose]) -> Result<(), SolveError> {
        if done.passed.is_empty() || Self::beyond_beams(system, q).is_none() {
            return Ok(());
        }
        Err(self.lost(system, s, FallFailure::Stuck, done, q))
    }

    /// Puts the softest motion at `q` into `soft`, its largest displacement 1 in the units of W; none where it is not finite.
    pub(super) fn softest(&mut self, system: &System, q: &[Pose]) -> Option<()> {
        let (units, model) = (Units::of(system), &system.model);
        let mut shift = 0.0;
        loop {
            bimorph_base::budget::check();
            system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
            let least = 1e-8 * units.median_stiffness(&self.tangent);
            units.add_shift(shift, &mut self.tangent);
            model.project_matrix(&mut self.tangent);
            if self.is_definite(system) {
                break;
            }
            shift = if shift == 0.0 { least } else { 2.0 * shift };
            if shift.is_nan() || least.is_nan() || shift >= MAX_SHIFT * least {
                return None;
            }
        }
        system.excite(q, units.length, &mut self.soft);
        for round in 0..=ROUNDS {
            model.project(&mut self.soft);
            self.tangent.solve(&model.pattern, &mut self.soft);
            let size = units.size(&self.soft);
            if !(size.is_finite() && size > 0.0) {
                return None;
            }
            self.soft.iter_mut().for_each(|x| *x /= size);
            if round < ROUNDS {
                self.soft.iter_mut().for_each(|x| *x = units.weighted(x));
            }
        }
        Some(())
    }

    /// Kind and direction of a loss from the softest motion in `soft` and the force at `q` and the drive of now.
    pub(super) fn judge(&mut self, system: &System, q: &[Pose]) -> EscapeDirection {
        let length = Units::of(system).length;
        system.residual(q, &self.drive, &mut self.residual);
        let (mut work, mut motion, mut force) = (0.0, 0.0, 0.0);
        for (x, r) in self.soft.iter().zip(&self.residual) {
            work -= x.dot(r);
            motion += (x.x * x.x + x.y * x.y) / (length * length) + x.z * x.z;
            force += (r.x * r.x + r.y * r.y) * length * length + r.z * r.z;
        }
        let axial = |joint| axial_force(&system.model, joint, q, &self.drive.rest()).abs();
        let stress = system.model.joints.iter().map(axial).fold(0.0, f64::max) * length;
        // a straight part under uniform stress is balanced at any load
        let unbalanced = force.sqrt() > ROUNDED_FORCE * stress;
        let norm = (motion * force).sqrt();
        if unbalanced && norm > 0.0 && work.abs() > PARTICIPATION * norm {
            let sign = work.signum();
            return EscapeDirection { kind: LossKind::LimitPoint, sign, direction: system.side(q, &self.soft, sign).1 };
        }
        let sign = system.side(q, &self.soft, 1.0).0 * if self.options.mirrored { -1.0 } else { 1.0 };
        EscapeDirection { kind: LossKind::Bifurcation, sign, direction: system.side(q, &self.soft, sign).1 }
    }

    /// Moves `q` a little along `sign`·`soft`: the imperfection that every real part has.
    pub(super) fn lean(&self, q: &mut [Pose], sign: f64) {
        if sign != 0.0 {
            for (q, x) in q.iter_mut().zip(&self.soft) {
                *q += x * (sign * DISTURBANCE);
            }
        }
    }
}

impl EscapeDirection {
    fn unknown() -> Self {
        Self { kind: LossKind::LimitPoint, sign: 0.0, direction: String::new() }
    }
}
