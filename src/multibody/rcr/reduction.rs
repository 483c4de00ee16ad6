//! Recursive coordinate reduction: accelerations in O(n + m).
//!
//! 1. outward: poses, rates and velocity parts (`kinematics`), rows of the closures (`closures`);
//! 2. inward, leaf → root: each body's joint coordinates leave its front (`front`), loops on the way;
//! 3. outward, root → leaf: accelerations.
//!
//! No matrix is assembled: a body's front is its articulated inertia, its couplings to the few bodies that a loop ties it
//! to, and the constraint rows passing through.
//!
//! Reference: K. S. Anderson, J. H. Critchley, "Improved 'order-N' performance algorithm for the simulation of constrained
//! multi-rigid-body dynamic systems", Multibody System Dynamics 9 (2003) 185–212.

use super::data::Offsets;
use super::mechanism::Mechanism;
use super::pin::Handed;
use super::placed::Placement;
use super::scalar::Real;
use super::schedule::{Kind, Turn};
use super::stages::Added;
use std::ops::Range;

/// What the right-hand side of a reduction is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Accelerations under the forces, with velocity parts.
    Accelerations,
    /// The smallest change of the rates, in the mass norm, that makes them fulfil the loops.
    Rates,
    /// The same for the positions (one Gauss–Newton step).
    Positions,
}

/// What gathers at a body on the way in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node<T> {
    /// Inertia that outer bodies hand on: xx, xy, yy, xθ, yθ, θθ.
    pub inertia: [T; 6],
    /// Wrench that they hand on.
    pub momentum: [T; 3],
}

impl<T: Real> Node<T> {
    const CLEAN: Self = Self { inertia: [T::ZERO; 6], momentum: [T::ZERO; 3] };
}

/// What a reduction reads; nothing of it changes on the way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Given<'a, T> {
    pub task: Task,
    pub mechanism: &'a Mechanism<T>,
    pub offsets: &'a Offsets<T>,
    pub placement: &'a Placement<T>,
    pub force: &'a [[T; 3]],
    pub torque: &'a [T],
}

/// What a reduction works in.
#[derive(Debug, Clone)]
pub(super) struct Workspace<T> {
    pub nodes: Vec<Node<T>>,
    /// Couplings of pairs of bodies, by [`super::schedule::Schedule::blocks`].
    pub coupling: Vec<[T; 9]>,
    /// Constraint rows, by [`Turn::row_start`].
    pub rows: Vec<T>,
    /// Acceleration of a coordinate per acceleration of the bodies of its front; a pin's per acceleration of its point.
    pub coefficients: Vec<T>,
    /// Acceleration of a coordinate when its front rests; a pin's body's.
    pub base: Vec<T>,
    /// Which orthogonal combinations of a body's coordinates were taken out; none where no body has several.
    pub combined: Vec<[[T; 3]; 3]>,
    /// What a pin has handed to the next of its run.
    pub handed: Handed<T>,
    /// See [`super::Reduction::nearness`].
    pub nearness: T,
    /// What an implicit step adds to each body, see [`super::stages`]; empty otherwise.
    pub added: Vec<Added<T>>,
    /// The same to each coupling, in the order of the pattern.
    pub added_coupling: Vec<[T; 9]>,
    pub front: Scratch<T>,
}

/// Room for one front at a time.
#[derive(Debug, Clone)]
pub(super) struct Scratch<T> {
    pub m: Vec<T>,
    pub g: Vec<T>,
    pub r: Vec<T>,
}

impl<T: Real> Workspace<T> {
    pub(super) fn new(mechanism: &Mechanism<T>, coordinates: usize) -> Self {
        let schedule = &mechanism.schedule;
        let most = |f: &dyn Fn(Turn) -> usize| schedule.turns().map(f).max().unwrap_or(0);
        let size = most(&|t| t.freedom + 3 * t.front);
        Self {
            nodes: vec![Node::CLEAN; schedule.node_count],
            coupling: vec![[T::ZERO; 9]; schedule.block_count],
            rows: vec![T::ZERO; schedule.row_entries],
            coefficients: vec![T::ZERO; schedule.coefficient_entries],
            base: vec![T::ZERO; coordinates],
            combined: vec![[[T::ZERO; 3]; 3]; if most(&|t| t.freedom) > 1 { mechanism.bodies() } else { 0 }],
            handed: Handed::NOTHING,
            nearness: T::ZERO,
            added: Vec::new(),
            added_coupling: Vec::new(),
            front: Scratch {
                m: vec![T::ZERO; size * size],
                g: vec![T::ZERO; size],
                r: vec![T::ZERO; most(&|t| t.rows) * (size + 1)],
            },
        }
    }

    /// Takes the coordinates of the bodies of `range` out, leaf → root.
    #[inline(always)]
    pub(super) fn inward(&mut self, given: Given<'_, T>, range: Range<usize>) {
        let (schedule, forced) = (&given.mechanism.schedule, given.task == Task::Accelerations);
        let mut body = range.start;
        while body < range.end {
            match schedule.steps[body].kind {
                Kind::Pin if schedule.plan.fast => {
                    body = if forced {
                        self.pins_inward::<true>(given, body..range.end)
                    } else {
                        self.pins_inward::<false>(given, body..range.end)
                    };
                    continue;
                }
                Kind::Pin if forced => self.pin_inward::<true>(given, body),
                Kind::Pin => self.pin_inward::<false>(given, body),
                Kind::Small(small) => self.small_inward(given, small, body),
                Kind::Any => self.any_inward(given, body),
            }
            body += 1;
        }
    }

    /// Accelerations of the bodies of `range`, root → leaf, and of their coordinates.
    #[inline(always)]
    pub(super) fn outward(
        &mut self,
        given: Given<'_, T>,
        range: Range<usize>,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) {
        let (schedule, forced) = (&given.mechanism.schedule, given.task == Task::Accelerations);
        let mut end = range.end;
        while end > range.start {
            let body = end - 1;
            match schedule.steps[body].kind {
                Kind::Pin if schedule.plan.fast => {
                    end = if forced {
                        self.pins_outward::<true>(given, range.start..end, accelerations, out)
                    } else {
                        self.pins_outward::<false>(given, range.start..end, accelerations, out)
                    };
                    continue;
                }
                Kind::Pin if forced => self.pin_outward::<true>(given, body, accelerations, out),
                Kind::Pin => self.pin_outward::<false>(given, body, accelerations, out),
                Kind::Small(small) => self.small_outward(given, small, body, accelerations, out),
                Kind::Any => self.any_outward(given, body, accelerations, out),
            }
            end = body;
        }
    }

    /// What the outer bodies have left at this one, with its own mass; their place is clean for the next reduction.
    #[inline(always)]
    pub(super) fn take_inertia(&mut self, mechanism: &Mechanism<T>, body: usize) -> [T; 6] {
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

    /// What has gathered in a block of the pattern; its place is clean for the next.
    #[inline(always)]
    pub(super) fn take_coupling(&mut self, mechanism: &Mechanism<T>, block: usize) -> [T; 9] {
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
    pub(super) fn take_force(&mut self, given: Given<'_, T>, body: usize) -> [T; 3] {
        let node = &mut self.nodes[given.mechanism.schedule.steps[body].node as usize];
        let mut force = std::mem::replace(&mut node.momentum, [T::ZERO; 3]);
        if given.task == Task::Accelerations {
            for (f, own) in force.iter_mut().zip(&given.force[body]) {
                *f += *own;
            }
        }
        force
    }
}
