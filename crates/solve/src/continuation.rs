//! Equilibrium paths r(q, s) = 0 by arc length, past limit points, with bifurcations and the branches that leave there.
//!
//! A point moves along the unit tangent (q′, s′) of the path by τ and returns to it across a plane (Keller's
//! pseudo-arclength), so that s may turn back where the path folds:
//! ```text
//! r(q, s) = 0,   ⟨n_q, q − q₀⟩ + n_s·(s − s₀) = τ,       ⟨x, y⟩ = mean over bodies of (x·y + ℓ²·θ_x·θ_y)/ℓ²
//! ```
//! ℓ is the system's length scale. Each Newton step costs one factorization of ∂r/∂q and two solves (block elimination).
//! The tangent keeps its sense against the one before. Between two points
//! * s′ changes sign at a fold (limit point), found by the secant rule of Illinois on s′(τ);
//! * at a bifurcation, found by bisection, the number of negative pivots changes without a fold. The null vector φ of
//!   the tangent is the direction of the new branch, and its first point is searched in the plane ⟨φ, q − q₀⟩ = τ.
//!
//! References: E. Riks, Int. J. Solids Structures 15 (1979) 529; H. B. Keller, "Numerical solution of bifurcation and
//! nonlinear eigenvalue problems" (1977); W. Wagner, P. Wriggers, Eng. Comput. 5 (1988) 103, for switching along φ.

mod branching;
mod corrector;
pub mod family;
mod options;
mod stepping;
mod traced;

pub use corrector::Continuation;
pub use options::{Branch, ContinuationOptions, DEFAULT_POINTS};
pub use traced::{PathEnd, PathEvent, PathPoint, TracedPath};

use corrector::{CorrectorPlane, PathState};

use super::SolveError;
use bimorph_domains::System;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use family::LoadFamily;

/// Step below which the path continues although its point at a given s was not found (1).
const NEAREST: f64 = 1e-10;

impl Continuation {
    /// Storage for a system.
    pub fn new(system: &System, options: ContinuationOptions) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            options,
            tangent: BodyMatrix::new(&system.model.pattern),
            residual: zeros.clone(),
            before: zeros.clone(),
            slope: zeros,
            iterations: 0,
        }
    }

    /// Traces the path from the equilibrium `q` at s = 0 until the last requested s. `watch` hears of each point's s
    /// and may stop.
    ///
    /// # Errors
    /// [`SolveError::Singular`] where a body moves freely at the start; [`SolveError::Lost`] where `q` is no equilibrium.
    pub fn trace(
        &mut self,
        family: &mut LoadFamily,
        q: &[Pose],
        watch: &mut dyn FnMut(f64) -> bool,
    ) -> Result<TracedPath, SolveError> {
        self.iterations = 0;
        let mut here = self.start(family, q)?;
        let mut traced = TracedPath::default();
        traced.points.push(point(&here));
        let mut step = 0.5 * self.options.longest;
        traced.end = loop {
            if !watch(here.s) {
                break PathEnd::Stopped;
            }
            if traced.points.len() >= self.options.points {
                break PathEnd::Full;
            }
            let longest = self.options.longest.max(self.options.growth * here.s.abs());
            step = step.min(longest / here.ds.abs().max(1e-3));
            let Some((next, cost)) = self.advance(family, &here, &mut step) else { break PathEnd::Lost };
            if next.s >= self.options.target {
                match self.land(family, &here, &next, self.options.target) {
                    // a critical point beyond the last s is not on this path
                    Some(last) if last.negative == here.negative && here.ds * next.ds > 0.0 => {
                        traced.points.push(last);
                        break PathEnd::Arrived;
                    }
                    None if step > NEAREST => {
                        step *= 0.5;
                        continue;
                    }
                    _ => {}
                }
            }
            // the same contact is an equilibrium at the opposite voltage: only one that is still there without any
            // voltage continues to it
            if let Some(still) = family.field_free_point()
                && (here.s - still) * (next.s - still) < 0.0
                && step > NEAREST
                && self.land(family, &here, &next, still).is_none()
            {
                step *= 0.5;
                continue;
            }
            let lost = next.negative > here.negative;
            let branched = self.note(family, &here, &next, step, &mut traced);
            if lost && self.options.stop_at_loss {
                break PathEnd::Unstable;
            }
            let arrived = next.s >= self.options.target && branched.is_none();
            here = branched.unwrap_or(next);
            if arrived {
                let before =
                    PathState { q: traced.points.last().map_or_else(Vec::new, |p| p.q.clone()), ..here.clone() };
                let before = PathState { s: traced.points.last().map_or(0.0, |p| p.s), ..before };
                let last = self.land(family, &before, &here, self.options.target);
                traced.points.push(last.unwrap_or_else(|| point(&here)));
                break PathEnd::Arrived;
            }
            traced.points.push(point(&here));
            if here.s < self.options.lowest {
                break PathEnd::TurnedBack;
            }
            step *= (4.0 / cost as f64).sqrt().clamp(0.6, 2.0);
        };
        traced.iterations = self.iterations;
        Ok(traced)
    }

    /// The first point with its tangent, towards growing s.
    fn start(&mut self, family: &mut LoadFamily, q: &[Pose]) -> Result<PathState, SolveError> {
        let zeros = vec![Pose::zeros(); q.len()];
        let guess = PathState { q: q.to_vec(), s: 0.0, dq: zeros, ds: 1.0, negative: 0 };
        let plane = CorrectorPlane { from: &guess, dq: &guess.dq, ds: 1.0, distance: 0.0 };
        match self.correct(family, &plane, guess.clone()) {
            Ok((mut place, _)) => {
                self.update_tangent(family, &mut place, &guess);
                Ok(place)
            }
            Err(Some(pivot)) => Err(SolveError::singular(family.system(), pivot)),
            Err(None) => {
                let reason = "Newton's iteration does not settle on an equilibrium where the path begins".into();
                Err(SolveError::Lost { share: 0.0, passed: String::new(), reason, coarse: Vec::new(), overbent: false })
            }
        }
    }

    /// Records what happened between two points; at a bifurcation that is to be left, the first point of the new branch.
    fn note(
        &mut self,
        family: &mut LoadFamily,
        here: &PathState,
        next: &PathState,
        step: f64,
        traced: &mut TracedPath,
    ) -> Option<PathState> {
        if here.ds * next.ds < 0.0 {
            let (mut fold, located) = self.find_fold(family, here, next, step);
            // a fold changes the inertia; where s turns back without, this is a branch that comes back to its path
            let crossing = here.negative == next.negative;
            if crossing {
                // the pivot that vanishes there has a sign by rounding
                fold.negative = here.negative;
            }
            traced.events.push((if crossing { PathEvent::Bifurcation } else { PathEvent::Fold }, traced.points.len()));
            traced.rough.extend((!located).then_some(traced.points.len()));
            traced.points.push(point(&fold));
            return if crossing { self.rejoin(family, &fold) } else { None };
        }
        if here.negative == next.negative {
            return None;
        }
        let (at, located) = self.find_bifurcation(family, here, next.negative, step);
        traced.events.push((PathEvent::Bifurcation, traced.points.len()));
        traced.rough.extend((!located).then_some(traced.points.len()));
        traced.points.push(point(&at));
        if self.options.branch == Branch::Stay || next.negative < here.negative {
            return None;
        }
        let branch = self.branch_off(family, &at);
        traced.stayed.extend(branch.is_none().then_some(traced.points.len() - 1));
        branch
    }

    /// The point at `s` exactly, from the two points around it; none where none is found, or only one of another branch.
    fn land(&mut self, family: &mut LoadFamily, before: &PathState, past: &PathState, s: f64) -> Option<PathPoint> {
        let share = if past.s == before.s { 1.0 } else { (s - before.s) / (past.s - before.s) };
        let mut guess = past.clone();
        for (q, before) in guess.q.iter_mut().zip(&before.q) {
            *q = before + (*q - before) * share;
        }
        guess.s = s;
        let zeros = vec![Pose::zeros(); guess.q.len()];
        let plane = CorrectorPlane { from: &guess, dq: &zeros, ds: 1.0, distance: 0.0 };
        let (place, _) = self.correct(family, &plane, guess.clone()).ok()?;
        let near = self.is_between(family, (before, past), (&guess, &place));
        near.then(|| PathPoint { s, ..point(&place) })
    }
}

fn point(place: &PathState) -> PathPoint {
    PathPoint { s: place.s, q: place.q.clone(), negative: place.negative }
}
