//! Traversal of the bodies of a mechanism: one after the other, or by a faster method of the scalar type.

use super::data::{Offsets, ReductionTask};
use super::fast;
use super::poses::{BodyKinematics, MechanismKinematics};
use super::reduction::{Reduction, Traversal, Traversed};
use super::tree::Linkage;
use crate::scalar::Lanes;

impl<T: Traversed> Reduction<T> {
    /// Places all bodies for coordinates `q` and rates `v`.
    #[inline]
    pub fn place(&mut self, q: &[T], v: &[T]) {
        T::place(self, q, v);
    }

    /// Solves for `task` at the placed configuration; `out` receives q̈, or the change of the rates or coordinates.
    ///
    /// The result is right to rounding times the square of [`Reduction::nearness`].
    #[inline]
    pub fn reduce(&mut self, task: ReductionTask, out: &mut [T]) {
        T::reduce(self, task, out);
    }

    /// Places the bodies at `q`, `v` and finds q̈ in `out`, with the forces that [`Reduction::force`] and
    /// [`Reduction::torque`] hold: [`Reduction::place`] and [`Reduction::reduce`] at one go.
    #[inline]
    pub fn accelerate(&mut self, q: &[T], v: &[T], out: &mut [T]) {
        T::place(self, q, v);
        T::reduce(self, ReductionTask::Accelerations, out);
    }
}

/// One body after the other.
#[derive(Debug, Clone, Copy)]
pub struct OneByOne;

impl<T: Traversed> Traversal<T> for OneByOne {
    fn new(_: &Linkage, _: &Reduction<T>) -> Option<Box<Self>> {
        None
    }

    #[inline(always)]
    fn place(reduction: &mut Reduction<T>, q: &[T], v: &[T]) {
        let Reduction { mechanism, offsets, placement, .. } = reduction;
        placement.place(mechanism, &offsets.joints, q, v, 0..mechanism.bodies());
    }

    #[inline(always)]
    fn rows(reduction: &mut Reduction<T>, task: ReductionTask) -> T {
        let (given, work, _) = reduction.parts(task);
        work.write_rows(given, 0..given.mechanism.closures.len())
    }

    #[inline(always)]
    fn reduce(reduction: &mut Reduction<T>, task: ReductionTask, out: &mut [T]) {
        let (given, work, accelerations) = reduction.parts(task);
        let (bodies, closures) = (0..given.mechanism.bodies(), 0..given.mechanism.closures.len());
        work.nearness = T::ZERO;
        work.write_rows(given, closures);
        work.inward(given, bodies.clone());
        work.outward(given, bodies, accelerations, out);
        reduction.nearness = reduction.work.nearness;
    }

    fn placed(&self, _: usize) -> Option<BodyKinematics<T>> {
        None
    }

    fn spread(&self, _: &mut MechanismKinematics<T>) {}

    fn prescribe(&mut self, _: &Offsets<T>) {}

    fn packed_bodies(&self) -> usize {
        0
    }
}

/// Lanes are full already.
impl<const N: usize> Traversed for Lanes<N> {
    type Traversal = OneByOne;

    fn place(reduction: &mut Reduction<Self>, q: &[Self], v: &[Self]) {
        fast::place(reduction, q, v);
    }

    fn reduce(reduction: &mut Reduction<Self>, task: ReductionTask, out: &mut [Self]) {
        fast::reduce(reduction, task, out);
    }
}
