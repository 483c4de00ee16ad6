//! Folds and bifurcations between two points of a path, and the branches that leave or return there.

use super::corrector::{Continuation, CorrectorPlane, PathState, inner};
use super::options::Branch;
use crate::family::LoadFamily;
use bimorph_multibody::planar::Pose;

/// Where bisection looks between its ends, in turn, and Illinois where its own place has none (1).
const ASIDE: [f64; 3] = [0.5, 0.3, 0.7];
/// Part of a step within which a bifurcation is located, where Newton's method comes no nearer (1).
const CLOSE: f64 = 1e-6;
/// Part of the load to which a fold is located, where rounding hides its place along the path (1).
const CLOSE_IN_S: f64 = 1e-7;

impl Continuation {
    /// Illinois on s′ over the step; and whether it came to its end. Where a branch returns to its path, rounding hides where s′ vanishes, but not s.
    pub(super) fn find_fold(
        &mut self,
        family: &mut LoadFamily,
        here: &PathState,
        next: &PathState,
        step: f64,
    ) -> (PathState, bool) {
        let (mut a, mut fa, mut b, mut fb) = (0.0, here.ds, step, next.ds);
        let mut best = next.clone();
        for _ in 0..40 {
            let places = std::iter::once((a * fb - b * fa) / (fb - fa)).chain(ASIDE.map(|share| a + share * (b - a)));
            let Some((middle, place)) = self.first_probe(family, here, places) else { break };
            let f = place.ds;
            best = place;
            if f.abs() < 1e-9 || (b - a).abs() < 1e-12 * step {
                return (best, true);
            }
            if f * fb < 0.0 {
                (a, fa) = (b, fb);
            } else {
                fa *= 0.5;
            }
            (b, fb) = (middle, f);
        }
        let located = (best.ds * (b - a)).abs() < CLOSE_IN_S;
        (best, located)
    }

    /// Bisection on the number of negative pivots; the place on the near side, and whether it came to its end.
    pub(super) fn find_bifurcation(
        &mut self,
        family: &mut LoadFamily,
        here: &PathState,
        after: usize,
        step: f64,
    ) -> (PathState, bool) {
        let (mut low, mut high) = (0.0, step);
        let mut best = here.clone();
        for _ in 0..60 {
            // Newton's method may fail next to the singular tangent itself
            match self.first_probe(family, here, ASIDE.iter().map(|share| low + share * (high - low))) {
                Some((middle, place)) if place.negative == after => high = middle,
                Some((middle, place)) => (low, best) = (middle, place),
                None => break,
            }
            if high - low < 1e-8 * step {
                return (best, true);
            }
        }
        (best, high - low < CLOSE * step)
    }

    /// The first of these distances from `here` at which Newton's method finds a place.
    fn first_probe(
        &mut self,
        family: &mut LoadFamily,
        here: &PathState,
        mut distances: impl Iterator<Item = f64>,
    ) -> Option<(f64, PathState)> {
        distances.find_map(|distance| self.probe(family, here, distance).map(|(place, _)| (distance, place)))
    }

    /// First point on the branch that leaves along the null vector.
    pub(super) fn branch_off(&mut self, family: &mut LoadFamily, at: &PathState) -> Option<PathState> {
        let mut way = at.clone();
        way.dq = self.null_vector(family, at)?;
        way.ds = 0.0;
        if self.options.branch == Branch::Minus {
            way.dq.iter_mut().for_each(|x| *x = -*x);
        }
        for k in 0..12 {
            let distance = 0.05 * 0.5f64.powi(k);
            let mut guess = way.clone();
            for (q, dq) in guess.q.iter_mut().zip(&way.dq) {
                *q += dq * distance;
            }
            let plane = CorrectorPlane { from: &way, dq: &way.dq, ds: 0.0, distance };
            if let Ok((mut place, _)) = self.correct(family, &plane, guess) {
                self.update_tangent(family, &mut place, &way);
                return Some(place);
            }
        }
        None
    }

    /// First point back on the path that a branch has come to: a little ahead or back, where it is more stable. The way
    /// is the tangent without its share of the null vector, along which the branch came.
    pub(super) fn rejoin(&mut self, family: &mut LoadFamily, at: &PathState) -> Option<PathState> {
        let null = self.null_vector(family, at)?;
        self.linearize(family, at).ok()?;
        let system = family.system();
        self.tangent.solve(&system.model.pattern, &mut self.slope);
        let share = inner(system, &null, &self.slope);
        let mut way = at.clone();
        for (dq, (slope, null)) in way.dq.iter_mut().zip(self.slope.iter().zip(&null)) {
            *dq = null * share - slope;
        }
        way.ds = 1.0 / (1.0 + inner(system, &way.dq, &way.dq)).sqrt();
        way.dq.iter_mut().for_each(|dq| *dq *= way.ds);
        let mut found: Option<PathState> = None;
        for sign in [1.0, -1.0] {
            let distance = sign * 0.25 * self.options.longest / way.ds;
            let mut guess = way.clone();
            for (q, dq) in guess.q.iter_mut().zip(&way.dq) {
                *q += dq * distance;
            }
            guess.s += distance * way.ds;
            let plane = CorrectorPlane { from: &way, dq: &way.dq, ds: way.ds, distance };
            let Ok((mut place, _)) = self.correct(family, &plane, guess) else { continue };
            let sense = PathState { dq: way.dq.iter().map(|dq| dq * sign).collect(), ds: sign * way.ds, ..way.clone() };
            self.update_tangent(family, &mut place, &sense);
            let moved: Vec<Pose> = place.q.iter().zip(&at.q).map(|(a, b)| a - b).collect();
            let aside = inner(family.system(), &null, &moved).abs() > 0.3 * distance.abs();
            if !aside && found.as_ref().is_none_or(|best| place.negative < best.negative) {
                found = Some(place);
            }
        }
        found
    }

    /// Null vector of the nearly singular tangent by inverse iteration, of length 1, to the side of [`System::side`](bimorph_domains::System::side).
    fn null_vector(&mut self, family: &mut LoadFamily, at: &PathState) -> Option<Vec<Pose>> {
        self.linearize(family, at).ok()?;
        let system = family.system();
        let mut x = vec![Pose::zeros(); at.q.len()];
        system.excite(&at.q, system.length_scale, &mut x);
        for _ in 0..4 {
            system.model.project(&mut x);
            self.tangent.solve(&system.model.pattern, &mut x);
            let length = inner(system, &x, &x).sqrt();
            if !length.is_finite() || length == 0.0 {
                return None;
            }
            x.iter_mut().for_each(|x| *x /= length);
        }
        if system.side(&at.q, &x, 1.0).0 < 0.0 {
            x.iter_mut().for_each(|x| *x = -*x);
        }
        Some(x)
    }
}
