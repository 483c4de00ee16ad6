//! Bodies and sections of a batch of variants, as the joint law of [`crate::planar`] takes them.

use super::{Lane8, LanePose, SimdReal, ZERO_POSE, load};
use crate::planar::{HalfTurn, JointKinematics, PairTangent, Symmetric, Vec2, Vec3};
use crate::scalar::Real;

/// Where a body is: its displacement and its turn, looked up by each of its joints.
#[derive(Debug, Clone, Copy)]
pub struct LanePlaced<T = Lane8> {
    q: LanePose<T>,
    turn: HalfTurn<T>,
}

impl LanePlaced {
    /// Ground.
    pub const GROUND: Self = Self { q: ZERO_POSE, turn: HalfTurn::REST };

    /// A body at `q`.
    #[inline(always)]
    pub fn put<W: SimdReal>(&mut self, simd: W::Simd, q: &LanePose) {
        self.q = *q;
        let (sin, cos) = (W::load(simd, &q[2]) * 0.5).sin_cos(simd);
        let turn = HalfTurn::of([sin, cos]);
        turn.sin.store(&mut self.turn.sin);
        turn.cos.store(&mut self.turn.cos);
        turn.less.store(&mut self.turn.less);
        turn.whole.store(&mut self.turn.whole);
    }

    /// From memory.
    #[inline(always)]
    pub fn load<W: SimdReal>(&self, simd: W::Simd) -> LanePlaced<W> {
        let (of, HalfTurn { sin, cos, less, whole }) = (|x| W::load(simd, x), &self.turn);
        let turn = HalfTurn { sin: of(sin), cos: of(cos), less: of(less), whole: of(whole) };
        LanePlaced { q: load(simd, &self.q), turn }
    }
}

impl<T: Real> LanePlaced<T> {
    /// A body at `q` with the sine and cosine of half its rotation.
    #[inline(always)]
    pub fn turned(q: LanePose<T>, half: Vec2<T>) -> Self {
        Self { q, turn: HalfTurn::of(half) }
    }
}

/// Properties shared by the joints of one section.
#[derive(Debug, Clone, Copy)]
pub struct LaneSection<T = Lane8> {
    /// Cosine and sine of the drawn angle.
    pub axis: Vec2<T>,
    /// Stress per strain.
    pub stiffness: Symmetric<T>,
    /// Q over (g, p): gg, gp, pp.
    pub second: [T; 3],
}

impl LaneSection {
    /// Without any stiffness.
    pub const NONE: Self = Self { axis: [Lane8::NONE; 2], stiffness: Symmetric([Lane8::NONE; 6]), second: ZERO_POSE };

    /// From memory.
    #[inline(always)]
    pub fn load<W: SimdReal>(&self, simd: W::Simd) -> LaneSection<W> {
        let Self { axis, stiffness, second } = self;
        let stiffness = Symmetric(load(simd, &stiffness.0));
        LaneSection { axis: load(simd, axis), stiffness, second: load(simd, second) }
    }
}

impl<T: Real> LaneSection<T> {
    /// Strains of a joint with these arms between two bodies.
    #[inline(always)]
    pub fn kinematics(&self, arms: [Vec2<T>; 2], a: &LanePlaced<T>, b: &LanePlaced<T>) -> JointKinematics<T> {
        JointKinematics::new(arms, self.axis, &self.second, (a.q, &a.turn), (b.q, &b.turn))
    }

    /// The tangent of a joint under a stress.
    #[inline(always)]
    pub fn tangent(&self, k: &JointKinematics<T>, stress: &Vec3<T>) -> PairTangent<T> {
        k.tangent(&self.stiffness, stress, &self.second)
    }
}
