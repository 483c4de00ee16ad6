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
//! * the number of negative pivots changes without a fold at a bifurcation, found by bisection; there the null vector φ of
//!   the tangent is the way out, and the first point of the new branch is looked for in the plane ⟨φ, q − q₀⟩ = τ.
//!
//! References: E. Riks, Int. J. Solids Structures 15 (1979) 529; H. B. Keller, "Numerical solution of bifurcation and
//! nonlinear eigenvalue problems" (1977); W. Wagner, P. Wriggers, Eng. Comput. 5 (1988) 103, for switching along φ.

mod branching;
pub mod family;
mod stepping;

use super::SolveError;
use crate::gaps::System;
use crate::multibody::BlockMatrix;
use crate::multibody::factor::ZeroPivot;
use crate::multibody::planar::Pose;
use crate::options::analysis::PATH_POINTS;
use family::Blend;

/// Where to go at a bifurcation that takes the path's stability away.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Branch {
    /// Straight on, along the unstable path.
    Stay,
    /// Along the null vector whose largest translation is positive.
    #[default]
    Plus,
    /// Against it.
    Minus,
}

/// How a path is traced. `Default` is the only place where the numbers stand.
#[derive(Debug, Clone, PartialEq)]
pub struct ContinuationOptions {
    /// Newton stops when a correction is below this share of the displacement, default 1e-9. Smaller: one more iteration.
    pub tolerance: f64,
    /// Newton iterations before a step is halved, default 8.
    pub iterations: usize,
    /// Longest step in s, default 0.04 of the way. Smaller: more points.
    pub longest: f64,
    /// Longest step as a share of s, default 0: where it exceeds `longest`, steps grow with s.
    pub growth: f64,
    /// The path arrives where s comes to this, default 1.
    pub target: f64,
    /// Largest change of a gap in one step, as a share of what is left of it, default 0.2: no step leads across a gap to
    /// another branch. Smaller: more points.
    pub closing: f64,
    /// Largest distance of a point from where the tangent led, in steps, default 0.5. Tangents as straight as `straightness`
    /// asks for lead within 0.1; what is further off lies on another branch.
    pub aside: f64,
    /// End where stability is lost, at a fold or a bifurcation; default false.
    pub stop_at_loss: bool,
    /// Smallest step, in s and in length scales, default 1e-9: below it the path is lost.
    pub smallest: f64,
    /// Smallest cosine between the tangents at both ends of a step, default 0.98. Larger: more points where the path bends.
    pub straightness: f64,
    /// Most points.
    pub points: usize,
    /// The path ends where s falls below this, default −1.
    pub lowest: f64,
    /// What to do at bifurcations.
    pub branch: Branch,
}

impl Default for ContinuationOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            iterations: 8,
            longest: 0.04,
            growth: 0.0,
            target: 1.0,
            closing: 0.2,
            aside: 0.5,
            stop_at_loss: false,
            smallest: 1e-9,
            straightness: 0.98,
            points: PATH_POINTS.count(),
            lowest: -1.0,
            branch: Branch::Plus,
        }
    }
}

/// A point of the path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// The family's number.
    pub s: f64,
    /// Displacements.
    pub q: Vec<Pose>,
    /// Negative eigenvalues of the tangent: 0 where stable under fixed loads and voltages.
    pub negative: usize,
}

/// What happened at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// s turns back.
    Fold,
    /// Another path crosses.
    Bifurcation,
}

/// Why a path ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PathEnd {
    /// It came to the last s asked for.
    #[default]
    Arrived,
    /// s fell below the lowest one asked for.
    TurnedBack,
    /// It lost its stability, and was to end there.
    Unstable,
    /// It has as many points as asked for.
    Full,
    /// The next point was not found even with the smallest step.
    Lost,
    /// [`Continuation::trace`]'s watch said stop.
    Stopped,
}

/// A traced path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Traced {
    /// Its points; folds and bifurcations are among them.
    pub points: Vec<PathPoint>,
    /// What happened, with the index of its point.
    pub events: Vec<(Event, usize)>,
    /// Why it ends.
    pub end: PathEnd,
    /// Newton iterations, each with one factorization.
    pub iterations: usize,
}

/// Position and unit tangent.
#[derive(Debug, Clone, Default)]
struct Place {
    q: Vec<Pose>,
    s: f64,
    dq: Vec<Pose>,
    ds: f64,
    negative: usize,
}

/// The plane that a corrector returns across: ⟨n_q, q − q₀⟩ + n_s·(s − s₀) = distance.
struct Plane<'a> {
    from: &'a Place,
    dq: &'a [Pose],
    ds: f64,
    distance: f64,
}

/// Tracer with its storage.
#[derive(Debug)]
pub struct Continuation {
    /// Options.
    pub options: ContinuationOptions,
    tangent: BlockMatrix<f64, 3>,
    residual: Vec<Pose>,
    slope: Vec<Pose>,
    iterations: usize,
}

impl Continuation {
    /// Storage for a system.
    pub fn new(system: &System, options: ContinuationOptions) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            options,
            tangent: BlockMatrix::new(&system.model.pattern),
            residual: zeros.clone(),
            slope: zeros,
            iterations: 0,
        }
    }

    /// Traces the path from the equilibrium `q` at s = 0 until the last s asked for. `watch` hears of each point's s and may stop.
    ///
    /// # Errors
    /// [`SolveError::Singular`] where a body moves freely at the start; [`SolveError::Lost`] where `q` is no equilibrium.
    pub fn trace(
        &mut self,
        family: &mut Blend,
        q: &[Pose],
        watch: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Traced, SolveError> {
        self.iterations = 0;
        let mut here = self.start(family, q)?;
        let mut traced = Traced::default();
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
            let lost = next.negative > here.negative;
            let branched = self.note(family, &here, &next, step, &mut traced);
            if lost && self.options.stop_at_loss {
                break PathEnd::Unstable;
            }
            let arrived = next.s >= self.options.target && branched.is_none();
            here = branched.unwrap_or(next);
            if arrived {
                let last = self.land(family, &traced, here);
                traced.points.push(last);
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
    fn start(&mut self, family: &mut Blend, q: &[Pose]) -> Result<Place, SolveError> {
        let zeros = vec![Pose::zeros(); q.len()];
        let guess = Place { q: q.to_vec(), s: 0.0, dq: zeros, ds: 1.0, negative: 0 };
        let plane = Plane { from: &guess, dq: &guess.dq, ds: 1.0, distance: 0.0 };
        match self.correct(family, &plane, guess.clone()) {
            Ok((mut place, _)) => {
                self.turn(family, &mut place, &guess);
                Ok(place)
            }
            Err(Some(pivot)) => Err(SolveError::singular(family.system(), pivot)),
            Err(None) => {
                let residual = self.residual.iter().map(|r| r.amax()).fold(0.0, f64::max);
                let body = family.system().model.bodies.first().map(|b| b.name.to_string()).unwrap_or_default();
                Err(SolveError::Lost { share: 0.0, iterations: self.iterations, residual, body, unheld: String::new() })
            }
        }
    }

    /// Newton across a plane. Leaves the factored tangent of the last iterate. The error is a vanished pivot, or none where
    /// the iteration did not settle.
    fn correct(
        &mut self,
        family: &mut Blend,
        plane: &Plane<'_>,
        mut at: Place,
    ) -> Result<(Place, usize), Option<ZeroPivot>> {
        let mut last = f64::INFINITY;
        for count in 1..=self.options.iterations {
            crate::budget::check();
            self.iterations += 1;
            at.negative = self.linearize(family, &at)?;
            let system = family.system();
            self.tangent.solve(&system.model.pattern, &mut self.residual);
            self.tangent.solve(&system.model.pattern, &mut self.slope);
            let mut off = plane.ds * (at.s - plane.from.s) - plane.distance;
            off += plane
                .dq
                .iter()
                .zip(at.q.iter().zip(&plane.from.q))
                .map(|(n, (a, b))| dot(system, n, &(a - b)))
                .sum::<f64>()
                / at.q.len() as f64;
            let lean = plane.ds - inner(system, plane.dq, &self.slope);
            let ds = (inner(system, plane.dq, &self.residual) - off) / lean;
            let mut correction = ds.abs() * system.length_scale;
            for (q, (a, b)) in at.q.iter_mut().zip(self.residual.iter().zip(&self.slope)) {
                let dq = -a - b * ds;
                *q += dq;
                correction = correction.max(extent(system, &dq));
            }
            at.s += ds;
            if !correction.is_finite() || (count > 2 && correction > last && correction > 1e-3 * system.length_scale) {
                return Err(None);
            }
            let reach = at.q.iter().map(|q| extent(system, q)).fold(system.length_scale, f64::max);
            // rounding: corrections that are small and no longer shrink. In stiff contacts they shrink by a quarter each time
            let small = correction <= 1e-6 * reach && correction > 0.8 * last;
            let stalled = small || (correction <= 1e-8 * reach && correction > 0.1 * last);
            last = correction;
            if correction <= self.options.tolerance * reach || stalled {
                return Ok((at, count));
            }
        }
        Err(None)
    }

    /// Factors the tangent at a place, with residual and slope; counts negative pivots.
    fn linearize(&mut self, family: &mut Blend, at: &Place) -> Result<usize, Option<ZeroPivot>> {
        family.slope(&at.q, at.s, &mut self.slope);
        family.tangent(&at.q, &mut self.tangent, &mut self.residual);
        let inertia = self.tangent.factor(&family.system().model.pattern).map_err(Some)?;
        Ok(inertia.negative)
    }

    /// Sets the unit tangent of a place, in the sense of the one before, and its inertia. Where the tangent matrix is
    /// singular to the last digit the secant stands in.
    fn turn(&mut self, family: &mut Blend, at: &mut Place, before: &Place) {
        match self.linearize(family, at) {
            Ok(negative) => {
                let system = family.system();
                at.negative = negative;
                self.tangent.solve(&system.model.pattern, &mut self.slope);
                let mut ds = 1.0 / (1.0 + inner(system, &self.slope, &self.slope)).sqrt();
                if ds * (before.ds - inner(system, &before.dq, &self.slope)) < 0.0 {
                    ds = -ds;
                }
                at.ds = ds;
                for (dq, slope) in at.dq.iter_mut().zip(&self.slope) {
                    *dq = slope * -ds;
                }
            }
            Err(_) => {
                let system = family.system();
                for (dq, (a, b)) in at.dq.iter_mut().zip(at.q.iter().zip(&before.q)) {
                    *dq = a - b;
                }
                at.ds = at.s - before.s;
                let length = (inner(system, &at.dq, &at.dq) + at.ds * at.ds).sqrt();
                if length > 0.0 {
                    at.dq.iter_mut().for_each(|dq| *dq /= length);
                    at.ds /= length;
                }
            }
        }
    }

    /// Records what happened between two points; at a bifurcation that is to be left, the first point of the new branch.
    fn note(
        &mut self,
        family: &mut Blend,
        here: &Place,
        next: &Place,
        step: f64,
        traced: &mut Traced,
    ) -> Option<Place> {
        if here.ds * next.ds < 0.0 {
            let fold = self.find_fold(family, here, next, step);
            // a fold changes the inertia; where s turns back without, this is a branch that comes back to its path
            let crossing = here.negative == next.negative;
            traced.events.push((if crossing { Event::Bifurcation } else { Event::Fold }, traced.points.len()));
            traced.points.push(point(&fold));
            return if crossing { self.rejoin(family, &fold) } else { None };
        }
        if here.negative == next.negative {
            return None;
        }
        let at = self.find_bifurcation(family, here, next.negative, step);
        traced.events.push((Event::Bifurcation, traced.points.len()));
        traced.points.push(point(&at));
        if self.options.branch == Branch::Stay || next.negative < here.negative {
            return None;
        }
        self.branch_off(family, &at)
    }

    /// The point at the last s exactly, from the two points around it.
    fn land(&mut self, family: &mut Blend, traced: &Traced, past: Place) -> PathPoint {
        let Some(before) = traced.points.last() else { return point(&past) };
        let share = if past.s > before.s { (self.options.target - before.s) / (past.s - before.s) } else { 1.0 };
        let mut guess = past.clone();
        for (q, before) in guess.q.iter_mut().zip(&before.q) {
            *q = before + (*q - before) * share;
        }
        guess.s = self.options.target;
        let zeros = vec![Pose::zeros(); guess.q.len()];
        let plane = Plane { from: &guess, dq: &zeros, ds: 1.0, distance: 0.0 };
        match self.correct(family, &plane, guess.clone()) {
            Ok((place, _)) => PathPoint { s: self.options.target, ..point(&place) },
            Err(_) => point(&past),
        }
    }
}

fn point(place: &Place) -> PathPoint {
    PathPoint { s: place.s, q: place.q.clone(), negative: place.negative }
}

fn dot(system: &System, a: &Pose, b: &Pose) -> f64 {
    let l = system.length_scale;
    (a.x * b.x + a.y * b.y) / (l * l) + a.z * b.z
}

/// ⟨a, b⟩ of the module's text.
fn inner(system: &System, a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(system, a, b)).sum::<f64>() / a.len() as f64
}

/// Largest displacement [m]: translation, or rotation times the length scale.
fn extent(system: &System, p: &Pose) -> f64 {
    let e = p.x.abs().max(p.y.abs()).max(p.z.abs() * system.length_scale);
    if p.iter().all(|v| v.is_finite()) { e } else { f64::INFINITY }
}
