//! Blocks of three by three, and vectors of three, in registers of four: operands of a factorization and its solves.

use super::kinematics::MotionMap;
use super::tree::TreeJoint;
use crate::joint_coordinates::TreeParent;
use crate::planar::Pose;
use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};

/// Three numbers, and one that means nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub struct Four(pub [f64; 4]);

impl Four {
    /// Nothing.
    pub const ZERO: Self = Self([0.0; 4]);

    /// The three.
    #[inline(always)]
    pub fn pose(&self) -> Pose {
        Pose::new(self.0[0], self.0[1], self.0[2])
    }
}

impl From<Pose> for Four {
    #[inline(always)]
    fn from(pose: Pose) -> Self {
        Self([pose.x, pose.y, pose.z, 0.0])
    }
}

impl Four {
    /// `self`·s.
    #[inline(always)]
    pub(super) fn scaled<S: Simd>(mut self, simd: S, s: f64) -> Self {
        let s = simd.splat_f64s(s);
        for x in S::as_mut_simd_f64s(&mut self.0).0 {
            *x = simd.mul_f64s(*x, s);
        }
        self
    }

    /// `self` + `other`.
    #[inline(always)]
    pub(super) fn plus<S: Simd>(mut self, simd: S, other: Self) -> Self {
        for (x, y) in S::as_mut_simd_f64s(&mut self.0).0.iter_mut().zip(S::as_simd_f64s(&other.0).0) {
            *x = simd.add_f64s(*x, *y);
        }
        self
    }

    /// `self` − `other`.
    #[inline(always)]
    pub(super) fn less<S: Simd>(mut self, simd: S, other: Self) -> Self {
        for (x, y) in S::as_mut_simd_f64s(&mut self.0).0.iter_mut().zip(S::as_simd_f64s(&other.0).0) {
            *x = simd.sub_f64s(*x, *y);
        }
        self
    }
}

/// Does work on fours: in registers of four where the processor has any, in narrower ones elsewhere.
#[inline(always)]
pub(super) fn in_fours<W: WithSimd>(work: W) -> W::Output {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(*simd, work),
        arch => arch.dispatch(work),
    }
}

/// A block by its columns.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColumnBlock(pub(super) [Four; 3]);

impl ColumnBlock {
    pub(super) const ZERO: Self = Self([Four::ZERO; 3]);
    pub(super) const IDENTITY: Self =
        Self([Four([1.0, 0.0, 0.0, 0.0]), Four([0.0, 1.0, 0.0, 0.0]), Four([0.0, 0.0, 1.0, 0.0])]);

    #[inline(always)]
    pub(super) fn of(a: &Matrix3<f64>) -> Self {
        let a = &a.data.0;
        let column = |k: usize| Four([a[k][0], a[k][1], a[k][2], 0.0]);
        Self([column(0), column(1), column(2)])
    }

    /// S: one motion for each coordinate that moves.
    #[inline(always)]
    pub(super) fn motions(map: &MotionMap<f64>, link: &TreeJoint) -> Self {
        let mut motions = match (&link.free, link.parent) {
            (Some(free), _) => return Self::of(free),
            (None, TreeParent::Free) => return Self::IDENTITY,
            _ => {
                let [u, g, p] = &map.columns;
                Self([Four([u[0], u[1], 0.0, 0.0]), Four([g[0], g[1], 0.0, 0.0]), Four([p[0], p[1], link.sign, 0.0])])
            }
        };
        if link.moving != [true; 3] {
            for (column, moves) in motions.0.iter_mut().zip(link.moving) {
                if !moves {
                    *column = Four::ZERO;
                }
            }
        }
        motions
    }

    /// Xᵀ.
    #[inline(always)]
    pub(super) fn passing(map: &MotionMap<f64>) -> Self {
        let mut passing = Self::IDENTITY;
        (passing.0[0].0[2], passing.0[1].0[2]) = (map.lever[0], map.lever[1]);
        passing
    }

    /// A·X.
    #[inline(always)]
    pub(super) fn shifted<S: Simd>(&self, simd: S, map: &MotionMap<f64>) -> Self {
        let [x, y, z] = self.0;
        Self([x, y, z.plus(simd, x.scaled(simd, map.lever[0]).plus(simd, y.scaled(simd, map.lever[1])))])
    }

    #[inline(always)]
    pub(super) fn transposed(&self) -> Self {
        let a = &self.0;
        let row = |k: usize| Four([a[0].0[k], a[1].0[k], a[2].0[k], 0.0]);
        Self([row(0), row(1), row(2)])
    }

    #[inline(always)]
    pub(super) fn times<S: Simd>(&self, simd: S, x: Four) -> Four {
        let ([a, b, c], x) = (self.0, x.0);
        a.scaled(simd, x[0]).plus(simd, b.scaled(simd, x[1])).plus(simd, c.scaled(simd, x[2]))
    }

    /// A·B.
    #[inline(always)]
    pub(super) fn product<S: Simd>(&self, simd: S, b: &Self) -> Self {
        Self([self.times(simd, b.0[0]), self.times(simd, b.0[1]), self.times(simd, b.0[2])])
    }

    /// A·Bᵀ.
    #[inline(always)]
    pub(super) fn across<S: Simd>(&self, simd: S, b: &Self) -> Self {
        let [Four(x), Four(y), Four(z)] = b.0;
        let column = |i: usize| self.times(simd, Four([x[i], y[i], z[i], 0.0]));
        Self([column(0), column(1), column(2)])
    }

    /// A·s.
    #[inline(always)]
    pub(super) fn scaled<S: Simd>(&self, simd: S, s: f64) -> Self {
        let [x, y, z] = self.0;
        Self([x.scaled(simd, s), y.scaled(simd, s), z.scaled(simd, s)])
    }

    /// A + B.
    #[inline(always)]
    pub(super) fn plus<S: Simd>(&self, simd: S, b: &Self) -> Self {
        let ([x, y, z], b) = (self.0, &b.0);
        Self([x.plus(simd, b[0]), y.plus(simd, b[1]), z.plus(simd, b[2])])
    }

    /// A − B.
    #[inline(always)]
    pub(super) fn less<S: Simd>(&self, simd: S, b: &Self) -> Self {
        let ([x, y, z], b) = (self.0, &b.0);
        Self([x.less(simd, b[0]), y.less(simd, b[1]), z.less(simd, b[2])])
    }

    /// Whether nothing is there.
    #[inline(always)]
    pub(super) fn is_zero(&self) -> bool {
        let [a, b, c] = self.0.map(|column| column.0);
        (0..3).all(|i| (a[i] == 0.0) & (b[i] == 0.0) & (c[i] == 0.0))
    }
}
