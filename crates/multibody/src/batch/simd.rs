//! A number in every lane, in registers.
//!
//! In memory eight lanes are an array ([`Lane8`]); a kernel loads what it needs, computes in [`SimdReal`] numbers and stores what it has
//! found. As long as arrays themselves were added and multiplied, compilers moved them through the stack between any two
//! operations, which took half of the time. (For the same reason there are loops here, and no closures over arrays: those are not always
//! inlined, and a call of one vector instruction costs more than it.) Operations are those of `f64`, lane by lane; none is fused.

use crate::scalar::{Lanes, Real};
use crate::sine;
use pulp::{Arch, Simd, WithSimd};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Number of lanes.
pub const LANES: usize = 8;
/// A number in each lane, in memory.
pub type Lane8 = Lanes<LANES>;

/// A number in every lane, in registers.
pub trait SimdReal: Real {
    /// The instructions at hand.
    type Simd: Copy;
    /// `x` in every lane.
    fn splat(simd: Self::Simd, x: f64) -> Self;
    /// From memory.
    fn load(simd: Self::Simd, from: &Lane8) -> Self;
    /// To memory.
    fn store(self, to: &mut Lane8);
    /// |x|.
    fn abs(self) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// The larger one; `other` where either is not a number.
    fn max(self, other: Self) -> Self;
    /// `mark`, but not a number in lanes where this is at most `bound`.
    fn mark_nan(self, bound: Self, mark: Self) -> Self;
    /// `this` in lanes that are above `bound`, 0 elsewhere.
    fn above(self, bound: Self, this: Self) -> Self;
    /// `this` in lanes that are zero, `other` elsewhere.
    fn if_zero(self, this: Self, other: Self) -> Self;

    /// Sine and cosine (rad).
    #[inline(always)]
    fn sin_cos(self, simd: Self::Simd) -> (Self, Self) {
        let mut angles = Lane8::of(0.0);
        self.store(&mut angles);
        let (mut near, mut cosines) = (true, angles);
        for x in angles.0 {
            near &= x.abs() <= sine::SMALL;
        }
        if near {
            return sine::small(self);
        }
        for k in 0..LANES {
            (angles.0[k], cosines.0[k]) = sine::sin_cos(angles.0[k]);
        }
        (Self::load(simd, &angles), Self::load(simd, &cosines))
    }
}

/// Some numbers from memory.
#[inline(always)]
pub fn load<W: SimdReal, const K: usize>(simd: W::Simd, from: &[Lane8; K]) -> [W; K] {
    let mut numbers = [W::splat(simd, 0.0); K];
    for i in 0..K {
        numbers[i] = W::load(simd, &from[i]);
    }
    numbers
}

/// Some numbers to memory.
#[inline(always)]
pub fn store<W: SimdReal, const K: usize>(numbers: [W; K], to: &mut [Lane8; K]) {
    for (to, x) in to.iter_mut().zip(numbers) {
        x.store(to);
    }
}

/// `to += x`, in memory.
#[inline(always)]
pub fn add<W: SimdReal, const K: usize>(simd: W::Simd, to: &mut [Lane8; K], x: &[W; K]) {
    for (to, x) in to.iter_mut().zip(x) {
        (W::load(simd, to) + *x).store(to);
    }
}

/// Eight lanes in `M` registers of the instructions `S`.
#[derive(Clone, Copy)]
struct Registers<S: Simd, const M: usize> {
    simd: S,
    x: [S::f64s; M],
}

macro_rules! register_wise {
    ($($trait:ident $method:ident $instruction:ident)*) => {$(
        impl<S: Simd, const M: usize> $trait for Registers<S, M> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..M {
                    self.x[i] = self.simd.$instruction(self.x[i], other.x[i]);
                }
                self
            }
        }
    )*};
}
register_wise!(Add add add_f64s  Sub sub sub_f64s  Mul mul mul_f64s  Div div div_f64s);

macro_rules! with_one_number {
    ($($trait:ident $method:ident $instruction:ident)*) => {$(
        impl<S: Simd, const M: usize> $trait<f64> for Registers<S, M> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: f64) -> Self {
                let other = self.simd.splat_f64s(other);
                for i in 0..M {
                    self.x[i] = self.simd.$instruction(self.x[i], other);
                }
                self
            }
        }
    )*};
}
with_one_number!(Add add add_f64s  Mul mul mul_f64s);

impl<S: Simd, const M: usize> Neg for Registers<S, M> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for i in 0..M {
            self.x[i] = self.simd.neg_f64s(self.x[i]);
        }
        self
    }
}

impl<S: Simd, const M: usize> AddAssign for Registers<S, M> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd, const M: usize> SubAssign for Registers<S, M> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Simd, const M: usize> Real for Registers<S, M> {
    #[inline(always)]
    fn splat_like(self, x: f64) -> Self {
        Self::splat(self.simd, x)
    }
}

impl<S: Simd, const M: usize> SimdReal for Registers<S, M> {
    type Simd = S;

    #[inline(always)]
    fn splat(simd: S, x: f64) -> Self {
        Self { simd, x: [simd.splat_f64s(x); M] }
    }

    #[inline(always)]
    fn load(simd: S, from: &Lane8) -> Self {
        let (registers, _) = S::as_simd_f64s(&from.0);
        let mut to = Self::splat(simd, 0.0);
        to.x.copy_from_slice(&registers[..M]);
        to
    }

    #[inline(always)]
    fn store(self, to: &mut Lane8) {
        let (registers, _) = S::as_mut_simd_f64s(&mut to.0);
        registers[..M].copy_from_slice(&self.x);
    }

    #[inline(always)]
    fn abs(mut self) -> Self {
        for i in 0..M {
            self.x[i] = self.simd.abs_f64s(self.x[i]);
        }
        self
    }

    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for i in 0..M {
            self.x[i] = self.simd.sqrt_f64s(self.x[i]);
        }
        self
    }

    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for i in 0..M {
            let above = self.simd.less_than_f64s(other.x[i], self.x[i]);
            self.x[i] = self.simd.select_f64s(above, self.x[i], other.x[i]);
        }
        self
    }

    #[inline(always)]
    fn above(self, bound: Self, mut this: Self) -> Self {
        let (simd, zero) = (self.simd, self.simd.splat_f64s(0.0));
        for i in 0..M {
            let above = simd.less_than_f64s(bound.x[i], self.x[i]);
            this.x[i] = simd.select_f64s(above, this.x[i], zero);
        }
        this
    }

    #[inline(always)]
    fn mark_nan(self, bound: Self, mut mark: Self) -> Self {
        let (simd, nan) = (self.simd, self.simd.splat_f64s(f64::NAN));
        for i in 0..M {
            let small = simd.less_than_or_equal_f64s(self.x[i], bound.x[i]);
            mark.x[i] = simd.select_f64s(small, nan, mark.x[i]);
        }
        mark
    }

    #[inline(always)]
    fn if_zero(self, this: Self, mut other: Self) -> Self {
        let (simd, zero) = (self.simd, self.simd.splat_f64s(0.0));
        for i in 0..M {
            let none = simd.equal_f64s(self.x[i], zero);
            other.x[i] = simd.select_f64s(none, this.x[i], other.x[i]);
        }
        other
    }
}

/// Work over lanes.
pub trait Kernel {
    /// Does it with these registers.
    fn run<W: SimdReal>(self, simd: W::Simd);
}

struct Over<K, const M: usize>(K);

impl<K: Kernel, const M: usize> WithSimd for Over<K, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.run::<Registers<S, M>>(simd);
    }
}

/// Runs a kernel in the widest instructions of the processor at hand; `alone` has it where the processor has none.
#[inline(always)]
fn widest<K: Kernel>(kernel: K, alone: impl FnOnce(K)) {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(simd, Over::<K, 1>(kernel)),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Simd::vectorize(simd, Over::<K, 2>(kernel)),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(simd) => Simd::vectorize(simd, Over::<K, 4>(kernel)),
        _ => alone(kernel),
    }
}

/// Runs a kernel in the widest instructions of the processor at hand. It is not compiled for a processor without any: that copy would
/// be the largest, and never run.
#[inline(always)]
pub fn across<K: Kernel>(kernel: K) {
    widest(kernel, |_| {});
}

/// The same, one number after the other where the processor has no vector instructions.
#[inline(always)]
pub fn everywhere<K: Kernel>(kernel: K) {
    widest(kernel, one_by_one);
}

/// Runs a kernel as a processor without vector instructions does.
pub(crate) fn one_by_one<K: Kernel>(kernel: K) {
    Simd::vectorize(pulp::Scalar::new(), Over::<K, LANES>(kernel));
}

#[cfg(test)]
mod tests {
    //! Every operation has the bits of `f64` in every lane.
    use super::*;

    struct Check([f64; LANES], [f64; LANES]);

    impl WithSimd for Check {
        type Output = [[f64; LANES]; 13];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            match S::F64_LANES {
                8 => operations::<Registers<S, 1>>(simd, &self.0, &self.1),
                4 => operations::<Registers<S, 2>>(simd, &self.0, &self.1),
                2 => operations::<Registers<S, 4>>(simd, &self.0, &self.1),
                _ => operations::<Registers<S, 8>>(simd, &self.0, &self.1),
            }
        }
    }

    #[inline(always)]
    fn operations<W: SimdReal>(simd: W::Simd, a: &[f64; LANES], b: &[f64; LANES]) -> [[f64; LANES]; 13] {
        let (x, y) = (W::load(simd, &Lanes(*a)), W::load(simd, &Lanes(*b)));
        let (sin, cos) = x.sin_cos(simd);
        let (sum, scaled) = (x + y, x * 0.3 + 0.7);
        let (chosen, larger, above) = (y.if_zero(x, sum), x.max(y), x.above(y, sum));
        let all = [sum, x - y, x * y, x / y, -x, x.abs(), scaled, x.abs().sqrt(), chosen, sin, cos, larger, above];
        all.map(|x| {
            let mut to = Lane8::of(0.0);
            x.store(&mut to);
            to.0
        })
    }

    /// The instruction sets of this processor that kernels are compiled for, and none.
    fn everywhere(a: [f64; LANES], b: [f64; LANES]) -> Vec<[[f64; LANES]; 13]> {
        let mut found = vec![Arch::new().dispatch(Check(a, b)), pulp::Scalar::new().vectorize(Check(a, b))];
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = pulp::x86::V3::try_new() {
            found.push(Simd::vectorize(simd, Check(a, b)));
        }
        found
    }

    #[test]
    fn lanes_are_numbers() {
        for turn in [0.1, 3.0] {
            let a = std::array::from_fn(|k| (k as f64 - 2.7) * turn);
            let b = std::array::from_fn(|k| if k == 3 { 0.0 } else { 1.0 / (k as f64 - 5.1) });
            for found in everywhere(a, b) {
                for k in 0..LANES {
                    let (x, y) = (a[k], b[k]);
                    let (sin, cos) = crate::sine::sin_cos(x);
                    let chosen = if y == 0.0 { x } else { x + y };
                    let (scaled, above) = (x * 0.3 + 0.7, if x > y { x + y } else { 0.0 });
                    let root = x.abs().sqrt();
                    let alone =
                        [x + y, x - y, x * y, x / y, -x, x.abs(), scaled, root, chosen, sin, cos, x.max(y), above];
                    for (found, alone) in found.iter().zip(alone) {
                        assert_eq!(found[k].to_bits(), alone.to_bits(), "{x} {y}");
                    }
                }
            }
        }
    }
}
