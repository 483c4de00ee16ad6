//! Recursive coordinate reduction: accelerations in O(n + m).
//!
//! 1. outward: poses, rates and velocity parts (`kinematics`), rows of the closures (`closures`);
//! 2. inward, leaf → root: each body's joint coordinates are eliminated from its front (`front`), with its loops;
//! 3. outward, root → leaf: accelerations.
//!
//! No matrix is assembled: a body's front is its articulated inertia, its couplings to the few bodies that a loop ties it
//! to, and the constraint rows passing through.
//!
//! Reference: K. S. Anderson, J. H. Critchley, "Improved 'order-N' performance algorithm for the simulation of constrained
//! multi-rigid-body dynamic systems", Multibody System Dynamics 9 (2003) 185–212.

use super::data::{ReductionInput, ReductionTask, Workspace};
use super::schedule::EliminationKind;
use crate::scalar::StoredReal;
use std::ops::Range;

impl<T: StoredReal> Workspace<T> {
    /// Takes the coordinates of the bodies of `range` out, leaf → root.
    #[inline(always)]
    pub(super) fn inward(&mut self, given: ReductionInput<'_, T>, range: Range<usize>) {
        let (schedule, forced) = (&given.mechanism.schedule, given.task == ReductionTask::Accelerations);
        let mut body = range.start;
        while body < range.end {
            match schedule.steps[body].kind {
                EliminationKind::Pin if schedule.plan.fast => {
                    body = if forced {
                        self.pins_inward::<true>(given, body..range.end)
                    } else {
                        self.pins_inward::<false>(given, body..range.end)
                    };
                    continue;
                }
                EliminationKind::Pin if forced => self.pin_inward::<true>(given, body),
                EliminationKind::Pin => self.pin_inward::<false>(given, body),
                EliminationKind::Small(small) => self.small_inward(given, small, body),
                EliminationKind::Any => self.any_inward(given, body),
            }
            body += 1;
        }
    }

    /// Accelerations of the bodies of `range`, root → leaf, and of their coordinates.
    #[inline(always)]
    pub(super) fn outward(
        &mut self,
        given: ReductionInput<'_, T>,
        range: Range<usize>,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) {
        let (schedule, forced) = (&given.mechanism.schedule, given.task == ReductionTask::Accelerations);
        let mut end = range.end;
        while end > range.start {
            let body = end - 1;
            match schedule.steps[body].kind {
                EliminationKind::Pin if schedule.plan.fast => {
                    end = if forced {
                        self.pins_outward::<true>(given, range.start..end, accelerations, out)
                    } else {
                        self.pins_outward::<false>(given, range.start..end, accelerations, out)
                    };
                    continue;
                }
                EliminationKind::Pin if forced => self.pin_outward::<true>(given, body, accelerations, out),
                EliminationKind::Pin => self.pin_outward::<false>(given, body, accelerations, out),
                EliminationKind::Small(small) => self.small_outward(given, small, body, accelerations, out),
                EliminationKind::Any => self.any_outward(given, body, accelerations, out),
            }
            end = body;
        }
    }
}
