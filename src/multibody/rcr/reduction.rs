//! Recursive coordinate reduction: accelerations in O(n + m).
//!
//! 1. outward: poses, rates and velocity parts (`motion`), rows of the closures (`closure`);
//! 2. inward, leaf → root: each body's joint coordinates leave its front (`front`), loops on the way;
//! 3. outward, root → leaf: accelerations.
//!
//! No matrix is assembled: a body's front is its articulated inertia, its couplings to the few bodies that a loop ties it
//! to, and the constraint rows passing through. All storage is laid out in elimination order by [`Reduction::new`].
//!
//! Reference: K. S. Anderson, J. H. Critchley, "Improved 'order-N' performance algorithm for the simulation of constrained
//! multi-rigid-body dynamic systems", Multibody System Dynamics 9 (2003) 185–212.

use super::closures::ClosureData;
use super::fast::packs::{Item, Packs};
use super::kinematics::{Arms, Hanging, JointData, LinkData, Placed, place_all};
use super::scalar::Real;
use super::schedule::{Kind, NONE, Schedule};
use super::stages::Added;
use super::tree::Linkage;
use std::ops::Range;
use std::slice::from_ref;

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
    pub(super) inertia: [T; 6],
    /// Wrench that they hand on.
    pub(super) momentum: [T; 3],
}

impl<T: Real> Node<T> {
    pub(super) const CLEAN: Self = Self { inertia: [T::ZERO; 6], momentum: [T::ZERO; 3] };
}

/// The recursion with its storage, over one model or over lanes of variants.
#[derive(Debug, Clone)]
pub struct Reduction<T> {
    pub(super) schedule: Schedule,
    pub(super) links: Vec<LinkData<T>>,
    pub(super) arms: Vec<Arms<T>>,
    /// See [`super::Link::sign`].
    pub(super) signs: Vec<T>,
    pub(super) joints: Vec<JointData<T>>,
    pub(super) closures: Vec<ClosureData<T>>,
    pub(super) units: Vec<T>,
    pub(super) placed: Vec<Placed<T>>,
    pub(super) hanging: Vec<Hanging<T>>,
    /// Axes of the coordinates of joints that are no pins.
    pub(super) axes: Vec<[T; 3]>,
    /// Wrench on each body: forces along x and y and moment about the centre of mass [N, N·m]. Set before reducing.
    pub force: Vec<[T; 3]>,
    /// Force on each coordinate [N or N·m]. Set before reducing.
    pub torque: Vec<T>,
    pub(super) nodes: Vec<Node<T>>,
    pub(super) coupling: Vec<[T; 9]>,
    pub(super) rows: Vec<T>,
    /// Acceleration of a coordinate per acceleration of the bodies of its front; a pin's per acceleration of its point.
    pub(super) coefficients: Vec<T>,
    /// Acceleration of a coordinate when its front rests; a pin's body's.
    pub(super) base: Vec<T>,
    pub(super) turned: Vec<[[T; 3]; 3]>,
    /// Acceleration of each body.
    pub accelerations: Vec<[T; 3]>,
    pub(super) front: Scratch<T>,
    /// What an implicit step adds to each body, see [`super::stages`]; empty otherwise.
    pub(super) added: Vec<Added<T>>,
    /// The same to each coupling, in the order of the pattern.
    pub(super) added_coupling: Vec<[T; 9]>,
    /// Worst of lever/pivot over the dependent coordinates of the last reduction: 1 in a well-conditioned loop, infinite in
    /// a singular configuration. The squares of it multiply rounding errors.
    pub nearness: T,
    /// Equal subtrees of the one mechanism, side by side.
    pub(super) packs: Option<Box<Packs>>,
}

/// Room for one front at a time.
#[derive(Debug, Clone)]
pub(super) struct Scratch<T> {
    pub(super) m: Vec<T>,
    pub(super) g: Vec<T>,
    pub(super) r: Vec<T>,
}

impl<T: Real> Reduction<T> {
    /// Multiplications of one reduction: the count that grows linearly with n + m.
    pub fn multiplications(&self) -> u64 {
        self.schedule.multiplications
    }

    /// Number of bodies that are reduced side by side with those of equal subtrees.
    pub fn side_by_side(&self) -> usize {
        self.links.len() - self.packs.as_ref().map_or(self.links.len(), |p| p.rest.iter().map(Range::len).sum())
    }

    /// Places all bodies for coordinates `q` and rates `v`.
    #[inline(always)]
    pub fn place(&mut self, linkage: &Linkage, q: &[T], v: &[T]) {
        let mut packs = self.take_packs();
        let all = 0..self.links.len();
        for range in packs.as_ref().map_or(from_ref(&all), |p| &p.rest).iter().rev() {
            self.place_bodies(linkage, range.clone(), q, v);
        }
        if let Some(packs) = &mut packs {
            packs.place(&self.placed, q, v);
        }
        self.packs = packs;
    }

    /// The packs, to be given back; lanes of variants have none.
    #[inline(always)]
    fn take_packs(&mut self) -> Option<Box<Packs>> {
        if T::LANES == 1 { self.packs.take() } else { None }
    }

    #[inline(always)]
    pub(super) fn place_bodies(&mut self, linkage: &Linkage, range: Range<usize>, q: &[T], v: &[T]) {
        let (steps, given) = (&self.schedule.steps, (&self.arms[..], &self.signs[..], &self.joints[..]));
        place_all(linkage, steps, given, q, v, &mut self.placed, (&mut self.hanging, &mut self.axes), range);
    }

    /// Axis of a coordinate of `body`.
    #[inline(always)]
    pub(super) fn axis(&self, body: usize, coordinate: usize) -> [T; 3] {
        if self.schedule.steps[body].pin {
            self.hanging[body].pin_axis(self.signs[body])
        } else {
            self.axes[coordinate]
        }
    }

    /// Displacement and rotation of a body from its drawn place [m, m, rad].
    pub fn pose(&self, body: usize) -> [T; 3] {
        self.packs.as_ref().and_then(|p| p.pose(body)).unwrap_or(self.placed[body].pose)
    }

    /// Rate of a body's pose.
    pub fn rate(&self, body: usize) -> [T; 3] {
        self.packs.as_ref().and_then(|p| p.rate(body)).unwrap_or(self.placed[body].rate)
    }

    /// Where a body is and how it moves.
    pub(super) fn placed(&self, body: usize) -> Placed<T> {
        self.packs.as_ref().and_then(|p| p.placed(body)).unwrap_or(self.placed[body])
    }

    /// Writes the constraint rows of every closure for `task`. Returns the largest residual of a row.
    #[inline(always)]
    pub(super) fn write_rows(&mut self, task: Task) -> T {
        let mut packs = self.take_packs();
        let mut largest = packs.as_mut().map_or(T::ZERO, |p| T::splat(p.rows(task)));
        let all = 0..self.closures.len();
        for range in packs.as_ref().map_or(from_ref(&all), |p| &p.rest_closures) {
            largest = largest.max(self.rows_of(task, range.clone()));
        }
        self.packs = packs;
        largest
    }

    /// The same for the closures of `range`.
    #[inline(always)]
    pub(super) fn rows_of(&mut self, task: Task, range: Range<usize>) -> T {
        let mut largest = T::ZERO;
        let rest = Placed::REST;
        for (closure, entry) in self.closures[range.clone()].iter().zip(&self.schedule.entries[range]) {
            let turn = self.schedule.turn(entry.body);
            let width = 3 + 3 * turn.front + 1;
            let [a, b] = entry.ends.map(|end| end.map_or(&rest, |body| &self.placed[body as usize]));
            let first_is_a = entry.ends[0] == Some(entry.body as u32);
            for (k, strain) in closure.constraints(a, b).iter().enumerate().take(entry.count) {
                let start = turn.row_start + (entry.row + k) * width;
                let row = &mut self.rows[start..start + width];
                row.fill(T::ZERO);
                let (own, other) = if first_is_a { (&strain.a, &strain.b) } else { (&strain.b, &strain.a) };
                row[..3].copy_from_slice(own);
                if entry.other != NONE {
                    let at = 3 + 3 * entry.other;
                    row[at..at + 3].copy_from_slice(other);
                }
                row[width - 1] = -match task {
                    Task::Accelerations => strain.bias,
                    Task::Rates => strain.rate,
                    Task::Positions => strain.value,
                };
                largest = largest.max(row[width - 1].abs());
            }
        }
        largest
    }

    /// Solves for `task` at the placed configuration; `out` receives q̈, or the change of the rates or coordinates.
    ///
    /// The result is right to rounding times the square of [`Reduction::nearness`].
    #[inline(always)]
    pub fn reduce(&mut self, linkage: &Linkage, task: Task, out: &mut [T]) {
        let mut packs = self.take_packs();
        let (bodies, closures) = (0..self.links.len(), 0..self.closures.len());
        let all = Item::Turns(bodies.clone());
        self.nearness = T::ZERO;
        if let Some(packs) = &mut packs {
            self.nearness = T::splat(packs.inward(task, &self.force, &self.torque));
        }
        for range in packs.as_ref().map_or(from_ref(&closures), |p| &p.rest_closures) {
            self.rows_of(task, range.clone());
        }
        for item in packs.as_ref().map_or(from_ref(&all), |p| &p.items) {
            match (item, &packs) {
                (Item::Turns(range), _) => self.turns_inward(task, range.clone()),
                (Item::Node(to, terms), Some(packs)) => {
                    let node = &mut self.nodes[self.schedule.steps[*to].node as usize];
                    packs.add_node(terms.clone(), &mut node.inertia, &mut node.momentum);
                }
                (Item::Block(to, terms), Some(packs)) => {
                    packs.add_block(terms.clone(), &mut self.coupling[self.schedule.blocks[*to] as usize]);
                }
                (_, None) => {}
            }
        }
        for range in packs.as_ref().map_or(from_ref(&bodies), |p| &p.rest).iter().rev() {
            self.turns_outward(linkage, task, range.clone(), out);
        }
        if let Some(packs) = &mut packs {
            packs.outward(task, &mut self.accelerations, out);
        }
        self.packs = packs;
    }

    #[inline(always)]
    pub(super) fn turns_inward(&mut self, task: Task, range: Range<usize>) {
        let mut body = range.start;
        while body < range.end {
            let Kind::Pin = self.schedule.steps[body].kind else {
                self.front_inward(task, body);
                body += 1;
                continue;
            };
            body = if task == Task::Accelerations {
                self.pins_inward::<true>(body, range.end)
            } else {
                self.pins_inward::<false>(body, range.end)
            };
        }
    }

    #[inline(always)]
    fn front_inward(&mut self, task: Task, body: usize) {
        match self.schedule.steps[body].kind {
            Kind::Pin => {}
            Kind::One(0) => self.one_inward::<1, 0>(task, body),
            Kind::One(1) => self.one_inward::<1, 1>(task, body),
            Kind::One(2) => self.one_inward::<1, 2>(task, body),
            Kind::One(_) => self.one_inward::<1, 3>(task, body),
            Kind::Two(0) => self.one_inward::<2, 0>(task, body),
            Kind::Two(1) => self.one_inward::<2, 1>(task, body),
            Kind::Two(2) => self.one_inward::<2, 2>(task, body),
            Kind::Two(_) => self.one_inward::<2, 3>(task, body),
            Kind::Any => self.any_inward(task, body),
        }
    }

    /// What the outer bodies have left at this one, with its own mass; their place is clean for the next reduction.
    #[inline(always)]
    pub(super) fn take_inertia(&mut self, body: usize) -> [T; 6] {
        let node = &mut self.nodes[self.schedule.steps[body].node as usize];
        let mut inertia = std::mem::replace(&mut node.inertia, [T::ZERO; 6]);
        let link = &self.links[body];
        inertia[0] += link.mass;
        inertia[2] += link.mass;
        inertia[5] += link.inertia;
        if let Some(added) = self.added.get(body) {
            for (sum, x) in inertia.iter_mut().zip(&added.body) {
                *sum += *x;
            }
        }
        inertia
    }

    /// What has gathered in a block of the pattern; its place is clean for the next.
    #[inline(always)]
    pub(super) fn take_coupling(&mut self, block: usize) -> [T; 9] {
        let at = self.schedule.blocks[block] as usize;
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
    pub(super) fn take_force(&mut self, task: Task, body: usize) -> [T; 3] {
        let node = &mut self.nodes[self.schedule.steps[body].node as usize];
        let mut force = std::mem::replace(&mut node.momentum, [T::ZERO; 3]);
        if task == Task::Accelerations {
            for (f, own) in force.iter_mut().zip(&self.force[body]) {
                *f += *own;
            }
        }
        force
    }

    #[inline(always)]
    pub(super) fn turns_outward(&mut self, linkage: &Linkage, task: Task, range: Range<usize>, out: &mut [T]) {
        let mut end = range.end;
        while end > range.start {
            let body = end - 1;
            match self.schedule.steps[body].kind {
                Kind::Pin if task == Task::Accelerations => end = self.pins_outward::<true>(range.start..end, out),
                Kind::Pin => end = self.pins_outward::<false>(range.start..end, out),
                Kind::One(_) => self.one_outward::<1>(task, body, out),
                Kind::Two(_) => self.one_outward::<2>(task, body, out),
                Kind::Any => self.any_outward(linkage, task, body, out),
            }
            end = end.min(body);
        }
    }
}
