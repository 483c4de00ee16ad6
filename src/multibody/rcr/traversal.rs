//! How the bodies of a mechanism are gone through: one after the other, or, where a number has a faster way, by that.

use super::data::{Offsets, Task};
use super::placed::{Placed, Placement};
use super::reduction::Reduction;
use super::scalar::Real;
use super::tree::Linkage;
use std::fmt::Debug;

/// The passes over all bodies. What comes out has the same bits whatever the way.
pub trait Traversal<T: Real>: Sized + Clone + Debug + Send + Sync + 'static {
    /// Lays the way out; none where one after the other is as good.
    fn new(linkage: &Linkage, reduction: &Reduction<T>) -> Option<Box<Self>>;

    /// Places all bodies.
    fn place(reduction: &mut Reduction<T>, q: &[T], v: &[T]);

    /// Writes the rows of all closures for `task`. Returns the largest residual.
    fn rows(reduction: &mut Reduction<T>, task: Task) -> T;

    /// Reduces for `task`.
    fn reduce(reduction: &mut Reduction<T>, task: Task, out: &mut [T]);

    /// Where a body is and how it moves, that went another way.
    fn placed(&self, body: usize) -> Option<Placed<T>>;

    /// Places all those bodies where one after the other would have.
    fn spread(&self, placement: &mut Placement<T>);

    /// Takes the offsets of locked directions over.
    fn prescribe(&mut self, offsets: &Offsets<T>);

    /// Number of bodies that go another way.
    fn side_by_side(&self) -> usize;
}

/// One body after the other.
#[derive(Debug, Clone, Copy)]
pub struct OneByOne;

impl<T: Real> Traversal<T> for OneByOne {
    fn new(_: &Linkage, _: &Reduction<T>) -> Option<Box<Self>> {
        None
    }

    #[inline(always)]
    fn place(reduction: &mut Reduction<T>, q: &[T], v: &[T]) {
        let Reduction { mechanism, offsets, placement, .. } = reduction;
        placement.place(mechanism, &offsets.joints, q, v, 0..mechanism.bodies());
    }

    #[inline(always)]
    fn rows(reduction: &mut Reduction<T>, task: Task) -> T {
        let (given, work, _) = reduction.parts(task);
        work.write_rows(given, 0..given.mechanism.closures.len())
    }

    #[inline(always)]
    fn reduce(reduction: &mut Reduction<T>, task: Task, out: &mut [T]) {
        let (given, work, accelerations) = reduction.parts(task);
        let (bodies, closures) = (0..given.mechanism.bodies(), 0..given.mechanism.closures.len());
        work.nearness = T::ZERO;
        work.write_rows(given, closures);
        work.inward(given, bodies.clone());
        work.outward(given, bodies, accelerations, out);
        reduction.nearness = reduction.work.nearness;
    }

    fn placed(&self, _: usize) -> Option<Placed<T>> {
        None
    }

    fn spread(&self, _: &mut Placement<T>) {}

    fn prescribe(&mut self, _: &Offsets<T>) {}

    fn side_by_side(&self) -> usize {
        0
    }
}
