//! The recursion in the widest instructions of the processor at hand, for one mechanism or for lanes of variants.
//!
//! The code is one and the same over either number ([`crate::multibody::rcr::scalar`]). It is compiled for each instruction set and chosen
//! at run time (AVX-512, AVX2, NEON or the base set); as nothing is fused, the bits do not depend on the choice.

use crate::multibody::rcr::reduction::{Reduction, Task};
use crate::multibody::rcr::scalar::Real;
use crate::multibody::rcr::tree::Linkage;
use pulp::{Arch, Simd, WithSimd};

/// One evaluation, for [`Arch::dispatch`].
struct Evaluation<'a, T> {
    reduction: &'a mut Reduction<T>,
    linkage: &'a Linkage,
    q: &'a [T],
    v: &'a [T],
    out: &'a mut [T],
}

impl<T: Real> WithSimd for Evaluation<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.reduction.place(self.linkage, self.q, self.v);
        self.reduction.reduce(self.linkage, Task::Accelerations, self.out);
    }
}

impl<T: Real> Reduction<T> {
    /// Places the bodies at `q`, `v` and finds q̈ in `out`, with the forces that [`Reduction::force`] and
    /// [`Reduction::torque`] hold: the same as [`Reduction::place`] and [`Reduction::reduce`], in wider instructions.
    pub fn accelerate(&mut self, linkage: &Linkage, q: &[T], v: &[T], out: &mut [T]) {
        Arch::new().dispatch(Evaluation { reduction: self, linkage, q, v, out });
    }
}
