//! Variable data of a reduction: its input beside the mechanism, and its workspace. Laid out once.

use super::mechanism::{MechanismConstants, lane};
use super::poses::MechanismKinematics;
use super::schedule::BodyElimination;
use super::tree::{Closure, Linkage};
use crate::scalar::StoredReal;

/// Right-hand side of a reduction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReductionTask {
    /// Accelerations under the forces, with velocity parts.
    Accelerations,
    /// The smallest change of the rates, in the mass norm, that makes them fulfil the loops.
    Rates,
    /// The same for the positions (one Gauss–Newton step).
    Positions,
}

/// Axial offsets of locked directions (m).
#[derive(Debug, Clone)]
pub struct Offsets<T> {
    /// One for each body on a joint that is no pin.
    pub joints: Vec<T>,
    /// One a loop closure.
    pub closures: Vec<T>,
}

/// Input of a reduction, constant during it.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReductionInput<'a, T> {
    pub task: ReductionTask,
    pub mechanism: &'a MechanismConstants<T>,
    pub offsets: &'a Offsets<T>,
    pub placement: &'a MechanismKinematics<T>,
    /// Wrench on each body.
    pub force: &'a [[T; 3]],
    /// Force on each coordinate.
    pub torque: &'a [T],
}

/// Sums accumulated at a body during the inward pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrontAccumulator<T> {
    /// Inertia that outer bodies hand on: xx, xy, yy, xθ, yθ, θθ.
    pub inertia: [T; 6],
    /// Wrench that they hand on.
    pub momentum: [T; 3],
}

/// Contribution of one pin's body to the next inward, about the pin between them.
#[derive(Debug, Clone, Copy)]
pub(super) struct PinContribution<T> {
    /// Inertia left at the pin: xx, xy, yy (kg).
    pub inertia: [T; 3],
    /// Force through the pin (N).
    pub force: [T; 2],
    /// Moment of the pin's drive on the next body (N·m).
    pub moment: T,
    /// From the next body's centre of mass to the pin (m).
    pub lever: [T; 2],
}

/// Contribution of an implicit step to the elimination of one body, see [`super::AddedInertia`].
#[derive(Debug, Clone, Copy)]
pub(super) struct StageInertia<T> {
    /// Over the coordinates of its joint, the lower triangle by rows.
    pub joint: [T; 6],
    /// On the body: xx, xy, yy, xθ, yθ, θθ.
    pub body: [T; 6],
}

/// Workspace of a reduction.
#[derive(Debug, Clone)]
pub(super) struct Workspace<T> {
    pub nodes: Vec<FrontAccumulator<T>>,
    /// Couplings of pairs of bodies, by [`super::schedule::Schedule::blocks`].
    pub coupling: Vec<[T; 9]>,
    /// Constraint rows, by [`BodyElimination::row_start`].
    pub rows: Vec<T>,
    /// Acceleration of a coordinate per acceleration of the bodies of its front; a pin's per acceleration of its point.
    pub coefficients: Vec<T>,
    /// Acceleration of a coordinate when its front rests; a pin's body's.
    pub base: Vec<T>,
    /// Which orthogonal combinations of a body's coordinates were taken out; none where no body has several.
    pub combined: Vec<[[T; 3]; 3]>,
    /// Contribution of a pin to the next of its run.
    pub handed: PinContribution<T>,
    /// See [`super::Reduction::nearness`].
    pub nearness: T,
    /// Contribution of an implicit step to each body; empty otherwise.
    pub added: Vec<StageInertia<T>>,
    /// The same to each coupling, in the order of the pattern.
    pub added_coupling: Vec<[T; 9]>,
    pub front: FrontScratch<T>,
}

/// Room for one front at a time: its M, its g and its rows.
#[derive(Debug, Clone)]
pub(super) struct FrontScratch<T> {
    pub m: Vec<T>,
    pub g: Vec<T>,
    pub r: Vec<T>,
}

impl<T: StoredReal> Offsets<T> {
    /// As built, for one variant per lane.
    pub(super) fn new(variants: &[&Linkage]) -> Self {
        let linkage = variants[0];
        let of = |b: usize| variants.iter().map(|v| &v.links[b]).collect::<Vec<_>>();
        let joints = (0..linkage.links.len()).filter(|&b| !linkage.links[b].pin);
        let closures = (0..linkage.closures.len()).map(|c| {
            let mut out = T::ZERO;
            for k in 0..T::LANES {
                if let Closure::Joint(joint) = &variants[k % variants.len()].closures[c] {
                    out.set_lane(k, joint.rest);
                }
            }
            out
        });
        Self {
            joints: joints.map(|b| lane(&of(b), &|l| if l.moving[0] { 0.0 } else { l.rest })).collect(),
            closures: closures.collect(),
        }
    }
}

impl<T: StoredReal> FrontAccumulator<T> {
    const CLEAN: Self = Self { inertia: [T::ZERO; 6], momentum: [T::ZERO; 3] };
}

impl<T: StoredReal> PinContribution<T> {
    pub(super) const NOTHING: Self =
        Self { inertia: [T::ZERO; 3], force: [T::ZERO; 2], moment: T::ZERO, lever: [T::ZERO; 2] };
}

impl<T: StoredReal> Workspace<T> {
    pub(super) fn new(mechanism: &MechanismConstants<T>, coordinates: usize) -> Self {
        let schedule = &mechanism.schedule;
        let most = |f: &dyn Fn(BodyElimination) -> usize| schedule.turns().map(f).max().unwrap_or(0);
        let size = most(&|t| t.freedom + 3 * t.front);
        Self {
            nodes: vec![FrontAccumulator::CLEAN; schedule.node_count],
            coupling: vec![[T::ZERO; 9]; schedule.block_count],
            rows: vec![T::ZERO; schedule.row_entries],
            coefficients: vec![T::ZERO; schedule.coefficient_entries],
            base: vec![T::ZERO; coordinates],
            combined: vec![[[T::ZERO; 3]; 3]; if most(&|t| t.freedom) > 1 { mechanism.bodies() } else { 0 }],
            handed: PinContribution::NOTHING,
            nearness: T::ZERO,
            added: Vec::new(),
            added_coupling: Vec::new(),
            front: FrontScratch {
                m: vec![T::ZERO; size * size],
                g: vec![T::ZERO; size],
                r: vec![T::ZERO; most(&|t| t.rows) * (size + 1)],
            },
        }
    }

    /// The accumulated inertia from outer bodies plus the body's own mass; clears the accumulator for the next
    /// reduction.
    #[inline(always)]
    pub(super) fn take_inertia(&mut self, mechanism: &MechanismConstants<T>, body: usize) -> [T; 6] {
        let node = &mut self.nodes[mechanism.schedule.steps[body].node as usize];
        let mut inertia = std::mem::replace(&mut node.inertia, [T::ZERO; 6]);
        let own = &mechanism.inertias[body];
        inertia[0] += own.mass;
        inertia[2] += own.mass;
        inertia[5] += own.moment;
        if let Some(added) = self.added.get(body) {
            for (sum, x) in inertia.iter_mut().zip(&added.body) {
                *sum += *x;
            }
        }
        inertia
    }

    /// The accumulated block of the pattern; clears the accumulator for the next.
    #[inline(always)]
    pub(super) fn take_coupling(&mut self, mechanism: &MechanismConstants<T>, block: usize) -> [T; 9] {
        let at = mechanism.schedule.blocks[block] as usize;
        let mut coupling = std::mem::replace(&mut self.coupling[at], [T::ZERO; 9]);
        if let Some(added) = self.added_coupling.get(block) {
            for (sum, x) in coupling.iter_mut().zip(added) {
                *sum += *x;
            }
        }
        coupling
    }

    /// The same for forces; accelerations add the body's own.
    #[inline(always)]
    pub(super) fn take_force(&mut self, given: ReductionInput<'_, T>, body: usize) -> [T; 3] {
        let node = &mut self.nodes[given.mechanism.schedule.steps[body].node as usize];
        let mut force = std::mem::replace(&mut node.momentum, [T::ZERO; 3]);
        if given.task == ReductionTask::Accelerations {
            for (f, own) in force.iter_mut().zip(&given.force[body]) {
                *f += *own;
            }
        }
        force
    }
}
