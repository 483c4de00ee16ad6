//! When evaluations without a result end an analysis.
//!
//! ngspice answers a refusal by a shorter step or by another way to the operating point: gmin stepping, source stepping, a transient.
//! Each of these may be refused for a while and then succeed. Where they only repeat the refusal, ngspice needs thousands of
//! evaluations to give up and reports no reason.

/// Refusals in a row after which a step or an operating point has failed. Each attempt of a transient is eight times shorter than the
/// one before it.
const MAX_IN_A_ROW: u32 = 4;
/// Refusals of one operating point, or of one point of a sweep, after which it has failed, however many evaluations between them succeeded.
const MAX_AT_REST: u32 = 24;
/// A step that fails although it is shorter than this fraction of the longest one taken is hopeless, too (1): the steps
/// are creeping up to a point beyond which there is no answer.
const HOPELESS: f64 = 1e-4;

/// Refused evaluations of an instance.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FailedEvaluations {
    in_a_row: u32,
    at_rest: u32,
    /// Longest step so far (s).
    longest: f64,
}

impl FailedEvaluations {
    /// After an evaluation with a result. `step`: its length (s); none at rest.
    pub(crate) fn solved(&mut self, step: Option<f64>) {
        self.in_a_row = 0;
        if let Some(step) = step {
            self.longest = self.longest.max(step);
            self.at_rest = 0;
        }
    }

    /// After convergence at a point of a sweep.
    pub(crate) fn settled(&mut self) {
        self.at_rest = 0;
    }

    /// Whether a shorter step than this one (s) may still help.
    pub(crate) fn may_shorten(&self, step: f64) -> bool {
        step > HOPELESS * self.longest
    }

    /// After an evaluation without a result: whether the analysis has failed.
    pub(crate) fn refused(&mut self, step: Option<f64>) -> bool {
        self.in_a_row += 1;
        let hopeless = match step {
            Some(step) => !self.may_shorten(step),
            None => {
                self.at_rest += 1;
                self.at_rest >= MAX_AT_REST
            }
        };
        hopeless || self.in_a_row >= MAX_IN_A_ROW
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four refusals in a row end an analysis, at rest and in time.
    #[test]
    fn four_in_a_row() {
        for step in [None, Some(1.0)] {
            let mut refusals = FailedEvaluations::default();
            refusals.solved(step);
            assert_eq!([(); 4].map(|()| refusals.refused(step)), [false, false, false, true]);
        }
    }

    /// An operating point that is refused again and again between results has failed at the 24th refusal; points of a sweep that converge
    /// count anew.
    #[test]
    fn refusals_between_results_are_counted() {
        let count = |converges: bool| {
            let mut refusals = FailedEvaluations::default();
            (1..100).find(|_| {
                refusals.solved(None);
                if converges {
                    refusals.settled();
                }
                refusals.refused(None)
            })
        };
        assert_eq!((count(false), count(true)), (Some(24), None));
    }

    /// A step of a ten-thousandth of the longest one is the last attempt.
    #[test]
    fn creeping_steps_are_hopeless() {
        let mut refusals = FailedEvaluations::default();
        refusals.solved(Some(1.0));
        assert!(refusals.may_shorten(2e-4) && !refusals.may_shorten(1e-4) && refusals.refused(Some(1e-4)));
    }
}
