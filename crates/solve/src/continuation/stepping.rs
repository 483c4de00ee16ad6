//! One step along a path: how long it may be, and whether it stayed on its branch.

use super::corrector::{Continuation, CorrectorPlane, PathState, dot, inner};
use crate::family::LoadFamily;
use bimorph_domains::System;

impl Continuation {
    /// One step of length `step` (shortened in place where needed), and the iterations it took.
    pub(super) fn advance(
        &mut self,
        family: &mut LoadFamily,
        here: &PathState,
        step: &mut f64,
    ) -> Option<(PathState, usize)> {
        loop {
            if let Some((next, cost)) = self.probe(family, here, *step) {
                let family_system = family.system();
                let cosine = inner(family_system, &here.dq, &next.dq) + here.ds * next.ds;
                let folded = here.ds * next.ds < 0.0;
                let changed = here.negative.abs_diff(next.negative);
                // one event a step, so that each is found
                let simple = if folded { changed == 1 } else { changed <= 1 };
                let near = self.keeps_branch(family, here, &next, *step);
                if near && cosine >= self.options.straightness && (simple || *step < 1e-3) {
                    return Some((next, cost));
                }
            }
            *step *= 0.5;
            if *step < self.options.smallest {
                return None;
            }
        }
    }

    /// True when a step stayed on its branch: it closed or opened no gap by much, and ends near where the tangent led.
    fn keeps_branch(&self, family: &LoadFamily, here: &PathState, next: &PathState, step: f64) -> bool {
        let system = family.system();
        let leap = self.leaps(system, here, next);
        let off = next.q.iter().zip(&here.q).zip(&here.dq).map(|((a, b), dq)| a - b - dq * step);
        let off: f64 = off.map(|x| dot(system, &x, &x)).sum::<f64>() / here.q.len() as f64;
        let aside = (off + (next.s - here.s - here.ds * step).powi(2)).sqrt();
        !leap && aside <= self.options.aside * step
    }

    /// True where a gap changes more from one place to the other than it may in a step.
    fn leaps(&self, system: &System, here: &PathState, next: &PathState) -> bool {
        let closing = self.options.closing;
        let sides = system.sides_leap([&here.q, &next.q], closing, f64::min);
        sides
            || (0..system.members.len()).filter(|&g| system.touching(g).is_some()).any(|g| {
                let (a, b) = (system.clearance(g, &here.q), system.clearance(g, &next.q));
                (a - b).abs() > closing * a.min(b)
            })
    }

    /// True when a `place` lies on the branch through the two `ends` of a step, between which it was expected at `guess`.
    pub(super) fn is_between(
        &self,
        family: &LoadFamily,
        ends: (&PathState, &PathState),
        (guess, place): (&PathState, &PathState),
    ) -> bool {
        let system = family.system();
        let apart = |a: &PathState, b: &PathState| -> f64 {
            let all = a.q.iter().zip(&b.q).map(|(a, b)| a - b);
            (all.map(|x| dot(system, &x, &x)).sum::<f64>() / a.q.len().max(1) as f64).sqrt()
        };
        let step = apart(ends.0, ends.1).hypot(ends.0.s - ends.1.s);
        !self.leaps(system, ends.0, place) && apart(guess, place) <= self.options.aside * step
    }

    /// The point at arc length `distance` from `here`, with its tangent.
    pub(super) fn probe(
        &mut self,
        family: &mut LoadFamily,
        here: &PathState,
        distance: f64,
    ) -> Option<(PathState, usize)> {
        let mut guess = here.clone();
        for (q, dq) in guess.q.iter_mut().zip(&here.dq) {
            *q += dq * distance;
        }
        guess.s += distance * here.ds;
        let plane = CorrectorPlane { from: here, dq: &here.dq, ds: here.ds, distance };
        let (mut next, cost) = self.correct(family, &plane, guess).ok()?;
        self.update_tangent(family, &mut next, here);
        Some((next, cost))
    }
}
