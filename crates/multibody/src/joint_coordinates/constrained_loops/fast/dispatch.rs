//! The recursion in the widest instructions of the processor at hand.
//!
//! The code is one and the same over either number ([`crate::scalar`]). It is compiled for each instruction
//! set and chosen at run time (AVX-512, AVX2, NEON or the base set); as nothing is fused, the bits do not depend on the
//! choice.

use crate::joint_coordinates::constrained_loops::data::ReductionTask;
use crate::joint_coordinates::constrained_loops::reduction::{Reduction, Traversal, Traversed};
use pulp::{Arch, Simd, WithSimd};

/// Places the bodies.
struct PlaceBodies<'a, T: Traversed>(&'a mut Reduction<T>, &'a [T], &'a [T]);
/// Reduces.
struct ReduceBodies<'a, T: Traversed>(&'a mut Reduction<T>, ReductionTask, &'a mut [T]);
impl<T: Traversed> WithSimd for PlaceBodies<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        T::Traversal::place(self.0, self.1, self.2);
    }
}

impl<T: Traversed> WithSimd for ReduceBodies<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        T::Traversal::reduce(self.0, self.1, self.2);
    }
}

/// [`Traversal::place`] in the widest instructions.
pub(in crate::joint_coordinates::constrained_loops) fn place<T: Traversed>(
    reduction: &mut Reduction<T>,
    q: &[T],
    v: &[T],
) {
    Arch::new().dispatch(PlaceBodies(reduction, q, v));
}

/// [`Traversal::reduce`] in the widest instructions.
pub(in crate::joint_coordinates::constrained_loops) fn reduce<T: Traversed>(
    reduction: &mut Reduction<T>,
    task: ReductionTask,
    out: &mut [T],
) {
    Arch::new().dispatch(ReduceBodies(reduction, task, out));
}

/// Runs `work` over lanes in the widest instructions. It is not compiled for a processor without any: that copy would be the
/// largest, and never run.
#[inline(always)]
pub(crate) fn across<W: WithSimd<Output: Default>>(work: W) -> W::Output {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(simd, work),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Simd::vectorize(simd, work),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(simd) => Simd::vectorize(simd, work),
        _ => W::Output::default(),
    }
}
