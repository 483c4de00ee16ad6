//! A place on a path and its unit tangent, and Newton's return to the path across a plane.
//!
//! Each Newton step costs one factorization of ∂r/∂q and two solves (block elimination). The tangent keeps its sense against
//! the one before.

use super::family::LoadFamily;
use super::options::ContinuationOptions;
use crate::equilibrium::balanced;
use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::Pose;

/// Corrections below the first fraction of the displacement are rounding, and those below the second that no longer shrink.
const ROUNDING: [f64; 2] = [1e-12, 1e-10];
/// How many times as many iterations a light touch may take.
const IN_CONTACT: usize = 4;

/// Position and unit tangent.
#[derive(Debug, Clone, Default)]
pub(super) struct PathState {
    pub(super) q: Vec<Pose>,
    pub(super) s: f64,
    pub(super) dq: Vec<Pose>,
    pub(super) ds: f64,
    pub(super) negative: usize,
}

/// The plane that a corrector returns across: ⟨n_q, q − q₀⟩ + n_s·(s − s₀) = distance.
pub(super) struct CorrectorPlane<'a> {
    pub(super) from: &'a PathState,
    pub(super) dq: &'a [Pose],
    pub(super) ds: f64,
    pub(super) distance: f64,
}

/// Tracer with its storage.
#[derive(Debug)]
pub struct Continuation {
    /// Options.
    pub options: ContinuationOptions,
    pub(super) tangent: BodyMatrix,
    pub(super) residual: Vec<Pose>,
    pub(super) slope: Vec<Pose>,
    /// Positions before the last correction.
    pub(super) before: Vec<Pose>,
    pub(super) iterations: usize,
}

pub(super) fn dot(system: &System, a: &Pose, b: &Pose) -> f64 {
    let l = system.length_scale;
    (a.x * b.x + a.y * b.y) / (l * l) + a.z * b.z
}

/// ⟨a, b⟩ of [`continuation`](super).
pub(super) fn inner(system: &System, a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(system, a, b)).sum::<f64>() / a.len() as f64
}

/// Largest displacement (m): translation, or rotation times the length scale.
fn extent(system: &System, p: &Pose) -> f64 {
    let e = (p.x * p.x + p.y * p.y).sqrt().max(p.z.abs() * system.length_scale);
    if p.iter().all(|v| v.is_finite()) { e } else { f64::INFINITY }
}

impl Continuation {
    /// Newton across a plane. Leaves the factored tangent of the last iterate. The error is a vanished pivot, or none where
    /// the iteration did not settle.
    pub(super) fn correct(
        &mut self,
        family: &mut LoadFamily,
        plane: &CorrectorPlane<'_>,
        mut at: PathState,
    ) -> Result<(PathState, usize), Option<ZeroPivot>> {
        let mut last = f64::INFINITY;
        let mut most = self.options.iterations;
        let mut count = 0;
        while count < most {
            bimorph_base::budget::check();
            count += 1;
            self.iterations += 1;
            at.negative = self.linearize(family, &at)?;
            let system = family.system();
            let unbalanced = self.residual.iter().map(|r| r.xy().norm_squared()).fold(0.0, f64::max).sqrt();
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
            self.before.copy_from_slice(&at.q);
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
            let (fast, stands) = (correction <= 0.1 * last, correction > 0.9 * last);
            last = correction;
            if correction <= ErrorBudget::of(self.options.tolerance).within(reach) || stalled {
                // contact softens towards the touch, and Newton's method takes a quarter of the way each time there: a correction
                // is small long before forces balance
                let rounding = correction <= ROUNDING[0] * reach || (correction <= ROUNDING[1] * reach && stands);
                let settled = fast || rounding || balanced(family.contact_scale(&at.q), unbalanced);
                if settled && !self.crosses_touch(family.system(), &at.q) {
                    return Ok((at, count));
                }
                most = IN_CONTACT * self.options.iterations;
            }
        }
        Err(None)
    }

    /// True where the last correction, which led to `q`, closed or opened a contact: what bore is gone behind the touch, and a small
    /// correction is none there.
    fn crosses_touch(&self, system: &System, q: &[Pose]) -> bool {
        (0..system.members.len()).any(|g| system.touches(g, &self.before) != system.touches(g, q))
    }

    /// Factors the tangent at a place, with residual and slope; counts negative pivots.
    pub(super) fn linearize(&mut self, family: &mut LoadFamily, at: &PathState) -> Result<usize, Option<ZeroPivot>> {
        family.slope(&at.q, at.s, &mut self.slope);
        family.tangent(&at.q, &mut self.tangent, &mut self.residual);
        let inertia = self.tangent.factor(&family.system().model.pattern).map_err(Some)?;
        Ok(inertia.negative)
    }

    /// Sets the unit tangent of a place, in the sense of the one before, and its inertia. Where the tangent matrix is
    /// singular to the last digit the secant stands in.
    pub(super) fn update_tangent(&mut self, family: &mut LoadFamily, at: &mut PathState, before: &PathState) {
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
}
