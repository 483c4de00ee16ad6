//! How long steps are: the rule that every driver with error control shares (Hairer & Wanner 1996, §IV.8), and equal steps.

/// Aim for this fraction of the step that would just be allowed.
const SAFETY: f64 = 0.9;
/// Rejections in a row before giving up.
const MAX_REJECTED: usize = 40;

/// Where a motion is on its way, and how long its next step is. Errors are relative to what a step may make.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepController {
    /// Now (s).
    pub(super) t: f64,
    end: f64,
    /// The step that is wanted (s).
    pub(super) h: f64,
    /// −1/p: errors fall with the p-th power of the step.
    exponent: f64,
    /// Steps rejected in a row.
    pub(super) rejected: usize,
}

impl StepController {
    /// From `t` to `end` (s), with `h` (s) to begin with, by a method whose errors fall with the power `order` of the step.
    pub(super) fn new((t, end): (f64, f64), h: f64, order: f64) -> Self {
        Self { t, end, h, exponent: -1.0 / order, rejected: 0 }
    }

    /// At the end.
    pub(super) fn is_over(&self) -> bool {
        self.t >= self.end
    }

    /// The step to try (s): the last two share what is left, so that no sliver remains.
    pub(super) fn step(&self) -> f64 {
        let left = self.end - self.t;
        if self.h >= 0.999 * left { left } else { self.h.min(0.5 * left.max(self.h)) }
    }

    /// Where a step ends (s).
    pub(super) fn after(&self, step: f64) -> f64 {
        if self.t + step >= self.end * (1.0 - 1e-14) { self.end } else { self.t + step }
    }

    /// A step with this error is taken. One cut short by the end says nothing against the longer one that was wanted.
    pub(super) fn accept(&mut self, step: f64, error: f64) {
        let grown = (SAFETY * error.max(1e-10).powf(self.exponent)).clamp(0.2, 5.0) * step;
        self.h = if step < self.h { self.h.max(grown) } else { grown };
        (self.t, self.rejected) = (self.after(step), 0);
    }

    /// A step with this error is not taken; `lost` is the share of it to try where there is no error to go by. False: a
    /// shorter one is useless.
    pub(super) fn reject(&mut self, step: f64, error: f64, lost: f64) -> bool {
        let share = if error.is_finite() { (SAFETY * error.powf(self.exponent)).clamp(0.1, 0.8) } else { lost };
        self.h = step * share;
        self.rejected += 1;
        self.rejected <= MAX_REJECTED && self.t + self.h > self.t
    }
}

/// Starts and ends (s) of equal steps over a span, none longer than `length`, as few as that takes.
pub(super) fn equal((start, end): (f64, f64), length: f64) -> impl Iterator<Item = (f64, f64)> {
    let span = end - start;
    let count = (span / length * (1.0 - 1e-9)).ceil().max(1.0) as usize;
    let at = move |k: usize| if k == count { end } else { start + span * (k as f64 / count as f64) };
    (0..count).map(move |k| (at(k), at(k + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last two steps share what is left, a step that ends within rounding of the end is the last one, and one that was cut short
    /// keeps the longer one that was wanted.
    #[test]
    fn steps_cover_the_span() {
        let mut pace = StepController::new((2.0, 12.0), 6.0, 4.0);
        assert_eq!((pace.step(), pace.after(3.0), pace.after(10.0 - 1e-14)), (5.0, 5.0, 12.0));
        pace.accept(5.0, 1.0);
        assert_eq!((pace.t, pace.h, pace.step(), pace.is_over()), (7.0, 6.0, 5.0, false));
        pace.accept(5.0, 1.0);
        assert_eq!((pace.t, pace.is_over()), (12.0, true));
        assert_eq!(StepController::new((2.0, 12.0), 100.0, 4.0).step(), 10.0);
        let parts: Vec<(f64, f64)> = equal((1.0, 4.0), 0.9).collect();
        assert_eq!(parts, [(1.0, 1.75), (1.75, 2.5), (2.5, 3.25), (3.25, 4.0)]);
        assert_eq!(equal((1.0, 4.0), 1.0).count(), 3);
    }

    /// The next step is 0.9·err^(−1/p) times the last, between 0.2 and 5 times after an accepted one and 0.1 and 0.8 times after a rejected
    /// one (Hairer & Wanner 1996, §IV.8). 41 rejections in a row, or a step that does not move time, end the run.
    #[test]
    fn steps_follow_errors() {
        let next = |error: f64| {
            let mut pace = StepController::new((0.0, 100.0), 2.0, 4.0);
            pace.accept(2.0, error);
            pace.h
        };
        assert_eq!([next(1.0), next(0.0625), next(1e-9)], [1.8, 3.6, 10.0]);
        let shorter = |error: f64| {
            let mut pace = StepController::new((2.0, 100.0), 2.0, 4.0);
            (pace.reject(2.0, error, 0.5), pace.h)
        };
        let found = [16.0, 1.1, 1e9, f64::INFINITY].map(shorter);
        assert_eq!(found, [(true, 0.9), (true, 1.6), (true, 0.2), (true, 1.0)]);
        let mut pace = StepController::new((2.0, 100.0), 1.0, 4.0);
        assert_eq!((0..100).take_while(|_| pace.reject(1.0, 16.0, 0.5)).count(), 40);
        pace.accept(1.0, 1.0);
        assert_eq!(pace.rejected, 0);
        assert!(!pace.reject(1e-17, 16.0, 0.5));
    }
}
