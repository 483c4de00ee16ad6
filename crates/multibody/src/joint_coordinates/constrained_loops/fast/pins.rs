//! Runs of pins: contributions pass from pin to pin in registers, and the arrays of a run are traversed together.

use crate::joint_coordinates::constrained_loops::data::{PinContribution, ReductionInput, Workspace};
use crate::joint_coordinates::constrained_loops::pin::{PinElimination, outward};
use crate::joint_coordinates::constrained_loops::schedule::{EliminationKind, Schedule};
use crate::scalar::StoredReal;
use std::ops::Range;

/// Pins searched at a time: their data stay in cache until they are eliminated.
const PIECE: usize = 256;

/// Pins of one run that begin `range`, at most [`PIECE`].
#[inline(always)]
fn run(schedule: &Schedule, range: Range<usize>) -> Range<usize> {
    let steps = &schedule.steps[range.start..range.end.min(range.start + PIECE)];
    range.start..range.start + steps.iter().position(|s| s.kind != EliminationKind::Pin).unwrap_or(steps.len())
}

/// Pins of one run that end `range`, at most [`PIECE`].
#[inline(always)]
fn run_before(schedule: &Schedule, range: Range<usize>) -> Range<usize> {
    let end = range.end;
    let start = end.saturating_sub(PIECE).max(range.start);
    let first = schedule.steps[start..end].iter().rposition(|s| s.kind != EliminationKind::Pin);
    first.map_or(start, |k| start + k + 1)..end
}

impl<T: StoredReal> Workspace<T> {
    /// Takes the coordinates of the run of pins out that begins `range`. Returns the body after the run. `FORCED`: with
    /// forces and velocity parts.
    #[inline(always)]
    pub(in crate::joint_coordinates::constrained_loops) fn pins_inward<const FORCED: bool>(
        &mut self,
        given: ReductionInput<'_, T>,
        range: Range<usize>,
    ) -> usize {
        let schedule = &given.mechanism.schedule;
        let (end, mut pins, mut handed) = (range.end, run(schedule, range), PinContribution::NOTHING);
        while !pins.is_empty() {
            handed = self.some_pins_inward::<FORCED>(given, pins.clone(), handed);
            pins = run(schedule, pins.end..end);
        }
        pins.end
    }

    /// The part `run` of a run of pins, to whose first body `handed` comes. Returns what its last one hands to the next.
    #[inline(always)]
    fn some_pins_inward<const FORCED: bool>(
        &mut self,
        given: ReductionInput<'_, T>,
        run: Range<usize>,
        mut handed: PinContribution<T>,
    ) -> PinContribution<T> {
        let ReductionInput { mechanism, placement, .. } = given;
        let steps = &mechanism.schedule.steps[run.clone()];
        // a pin has one coordinate, so those of a run follow each other
        let coordinates = steps[0].first as usize..steps[0].first as usize + steps.len();
        let (slopes, _) = self.coefficients[steps[0].coefficient_start as usize..].as_chunks_mut();
        let zipped = (steps.iter().zip(mechanism.inertias[run.clone()].iter().zip(&mechanism.signs[run.clone()])))
            .zip(placement.hanging[run.clone()].iter().zip(&given.force[run]))
            .zip(self.base[coordinates.clone()].iter_mut().zip(slopes).zip(&given.torque[coordinates]));
        for (((step, (inertia, sign)), (hanging, force)), ((to_base, to_slope), torque)) in zipped {
            let pinned = PinElimination { inertia, sign: *sign, hanging, force, torque: *torque };
            let node = step.gathers.then(|| &mut self.nodes[step.node as usize]);
            let left;
            (*to_base, *to_slope, left) = handed.inward::<FORCED>(pinned, node);
            handed = left;
            if !step.hands_on {
                handed = PinContribution::NOTHING;
                if step.parent().is_some() {
                    left.give(&mut self.nodes[mechanism.schedule.nodes[step.column as usize] as usize]);
                }
            }
        }
        handed
    }

    /// Accelerations of the bodies of the run of pins that ends `range`, root → leaf. Returns its first body.
    #[inline(always)]
    pub(in crate::joint_coordinates::constrained_loops) fn pins_outward<const FORCED: bool>(
        &self,
        given: ReductionInput<'_, T>,
        range: Range<usize>,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) -> usize {
        let schedule = &given.mechanism.schedule;
        // of the body after, which is the parent along a chain
        let (start, mut pins, mut after) = (range.start, run_before(schedule, range), [T::ZERO; 3]);
        while !pins.is_empty() {
            after = self.some_pins_outward::<FORCED>(given, pins.clone(), after, accelerations, out);
            pins = run_before(schedule, start..pins.start);
        }
        pins.start
    }

    /// The part `run` of a run of pins; `after` is the acceleration of the body after it. Returns that of its first one.
    #[inline(always)]
    fn some_pins_outward<const FORCED: bool>(
        &self,
        given: ReductionInput<'_, T>,
        run: Range<usize>,
        mut after: [T; 3],
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) -> [T; 3] {
        let first = run.start;
        let steps = &given.mechanism.schedule.steps[run.clone()];
        let coordinates = steps[0].first as usize..steps[0].first as usize + steps.len();
        let (slopes, _) = self.coefficients[steps[0].coefficient_start as usize..].as_chunks::<2>();
        let zipped = (steps.iter().zip(&given.mechanism.signs[run.clone()]))
            .zip(&given.placement.hanging[run])
            .zip(self.base[coordinates.clone()].iter().zip(&slopes[..steps.len()]).zip(&mut out[coordinates]));
        for (k, (((step, sign), hanging), ((base, slope), out))) in zipped.enumerate().rev() {
            let up = match step.parent() {
                _ if step.hands_on => after,
                Some(parent) => accelerations[parent],
                None => [T::ZERO; 3],
            };
            (after, *out) = outward::<FORCED, T>((*base, *slope), *sign, hanging, up);
            accelerations[first + k] = after;
        }
        after
    }
}
