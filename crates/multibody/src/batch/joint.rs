//! Strains of a joint, its forces and its tangent: [`crate::planar`] over lanes.

use super::{Lane8, LaneBlock, LanePose, SimdReal, ZERO_POSE, add, load};
use crate::scalar::Real;

/// Two numbers of the plane.
pub type LaneVector<T = Lane8> = [T; 2];

/// Sine and cosine of half of a body's rotation, with R(θ) − 1.
#[derive(Debug, Clone, Copy)]
pub struct LaneTurn<T = Lane8> {
    sin: T,
    cos: T,
    less: T,
    whole: T,
}

impl LaneTurn {
    /// Of ground.
    const REST: Self = Self { sin: Lane8::NONE, cos: Lane8::of(1.0), less: Lane8::NONE, whole: Lane8::NONE };

    #[inline(always)]
    fn load<W: SimdReal>(&self, simd: W::Simd) -> LaneTurn<W> {
        let of = |x: &Lane8| W::load(simd, x);
        LaneTurn { sin: of(&self.sin), cos: of(&self.cos), less: of(&self.less), whole: of(&self.whole) }
    }
}

impl<T: Real> LaneTurn<T> {
    #[inline(always)]
    fn rotation_minus_identity(&self, v: &LaneVector<T>) -> LaneVector<T> {
        [self.less * v[0] - self.whole * v[1], self.whole * v[0] + self.less * v[1]]
    }

    #[inline(always)]
    fn mean(&self, other: &Self, v: &LaneVector<T>) -> LaneVector<T> {
        let c = self.cos * other.cos - self.sin * other.sin;
        let s = self.sin * other.cos + self.cos * other.sin;
        [c * v[0] - s * v[1], s * v[0] + c * v[1]]
    }
}

/// Where a body is: its displacement and its turn, looked up by each of its joints.
#[derive(Debug, Clone, Copy)]
pub struct LanePlaced<T = Lane8> {
    q: LanePose<T>,
    turn: LaneTurn<T>,
}

impl LanePlaced {
    /// Ground.
    pub const GROUND: Self = Self { q: ZERO_POSE, turn: LaneTurn::REST };

    /// A body at `q`.
    #[inline(always)]
    pub fn put<W: SimdReal>(&mut self, simd: W::Simd, q: &LanePose) {
        self.q = *q;
        let (sin, cos) = (W::load(simd, &q[2]) * 0.5).sin_cos(simd);
        sin.store(&mut self.turn.sin);
        cos.store(&mut self.turn.cos);
        (sin * -2.0 * sin).store(&mut self.turn.less);
        (sin * 2.0 * cos).store(&mut self.turn.whole);
    }

    /// From memory.
    #[inline(always)]
    pub fn load<W: SimdReal>(&self, simd: W::Simd) -> LanePlaced<W> {
        LanePlaced { q: load(simd, &self.q), turn: self.turn.load(simd) }
    }
}

impl<T: Real> LanePlaced<T> {
    /// A body at `q` with the sine and cosine of half its rotation.
    #[inline(always)]
    pub fn turned(q: LanePose<T>, sin: T, cos: T) -> Self {
        Self { q, turn: LaneTurn { sin, cos, less: sin * -2.0 * sin, whole: sin * 2.0 * cos } }
    }
}

/// Properties shared by the joints of one section.
#[derive(Debug, Clone, Copy)]
pub struct LaneSection<T = Lane8> {
    /// Cosine and sine of the drawn angle.
    pub axis: LaneVector<T>,
    /// Stiffness: uu, ug, up, gg, gp, pp.
    pub stiffness: [T; 6],
    /// Q over (g, p): gg, gp, pp.
    pub second: [T; 3],
}

impl LaneSection {
    /// From memory.
    #[inline(always)]
    pub fn load<W: SimdReal>(&self, simd: W::Simd) -> LaneSection<W> {
        let Self { axis, stiffness, second } = self;
        LaneSection { axis: load(simd, axis), stiffness: load(simd, stiffness), second: load(simd, second) }
    }
}

impl<T: Real> LaneSection<T> {
    /// Stress of a strain.
    #[inline(always)]
    pub fn stress(&self, e: &LanePose<T>) -> LanePose<T> {
        multiply(&self.stiffness, e)
    }
}

/// Strains with what their derivatives need.
#[derive(Debug, Clone, Copy)]
pub struct LaneKinematics<T = Lane8> {
    /// e_u (m), g (m), p (rad).
    pub strain: LanePose<T>,
    axial: T,
    shear: T,
    bent: LaneVector<T>,
    opening: LaneVector<T>,
    radius_a: LaneVector<T>,
    radius_b: LaneVector<T>,
    e1: LaneVector<T>,
}

/// The tangent of a pair of bodies, see [`crate::planar::PairTangent`].
#[derive(Debug, Clone, Copy)]
pub struct LanePair<T = Lane8> {
    shift: [T; 3],
    shift_a: LaneVector<T>,
    shift_b: LaneVector<T>,
    turn: [T; 3],
}

#[inline(always)]
fn perpendicular<T: Real>(v: &LaneVector<T>) -> LaneVector<T> {
    [-v[1], v[0]]
}

#[inline(always)]
fn dot<T: Real>(a: &LaneVector<T>, b: &LaneVector<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}

#[inline(always)]
fn dot3<T: Real>(a: &LanePose<T>, b: &LanePose<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a·x + b·y.
#[inline(always)]
fn combine<T: Real>(a: &LaneVector<T>, x: T, b: &LaneVector<T>, y: T) -> LaneVector<T> {
    [a[0] * x + b[0] * y, a[1] * x + b[1] * y]
}

#[inline(always)]
fn multiply<T: Real>(k: &[T; 6], x: &LanePose<T>) -> LanePose<T> {
    let [uu, ug, up, gg, gp, pp] = *k;
    [uu * x[0] + ug * x[1] + up * x[2], ug * x[0] + gg * x[1] + gp * x[2], up * x[0] + gp * x[1] + pp * x[2]]
}

/// Strains of a joint with these arms between two bodies.
#[inline(always)]
pub fn kinematics<T: Real>(
    section: &LaneSection<T>,
    (arm_a, arm_b): (&LaneVector<T>, &LaneVector<T>),
    LanePlaced { q: qa, turn: a }: &LanePlaced<T>,
    LanePlaced { q: qb, turn: b }: &LanePlaced<T>,
) -> LaneKinematics<T> {
    let (swing_a, swing_b) = (a.rotation_minus_identity(arm_a), b.rotation_minus_identity(arm_b));
    let radius_a = [arm_a[0] + swing_a[0], arm_a[1] + swing_a[1]];
    let radius_b = [arm_b[0] + swing_b[0], arm_b[1] + swing_b[1]];
    let opening = [qb[0] - qa[0] + swing_b[0] - swing_a[0], qb[1] - qa[1] + swing_b[1] - swing_a[1]];
    let e1 = a.mean(b, &section.axis);
    let (u, g, p) = (dot(&opening, &e1), dot(&opening, &perpendicular(&e1)), qb[2] - qa[2]);
    let second = &section.second;
    let bent = [second[0] * g + second[1] * p, second[1] * g + second[2] * p];
    let strain = [u + bent[0] * g + bent[1] * p, g, p];
    LaneKinematics { strain, axial: u, shear: g, bent, opening, radius_a, radius_b, e1 }
}

impl<T: Real> LaneKinematics<T> {
    /// Forces on bodies a and b.
    #[inline(always)]
    pub fn forces(&self, stress: &LanePose<T>) -> (LanePose<T>, LanePose<T>) {
        let double = stress[0] * 2.0;
        let (shear, moment) = (stress[1] + double * self.bent[0], stress[2] + double * self.bent[1]);
        let n = combine(&self.e1, stress[0], &perpendicular(&self.e1), shear);
        let frame = (self.shear * stress[0] - self.axial * shear) * 0.5;
        let (at_a, at_b) = (dot(&perpendicular(&self.radius_a), &n), dot(&perpendicular(&self.radius_b), &n));
        ([-n[0], -n[1], frame - at_a - moment], [n[0], n[1], frame + at_b + moment])
    }

    /// The tangent under a stress.
    #[inline(always)]
    pub fn tangent(&self, section: &LaneSection<T>, stress: &LanePose<T>) -> LanePair<T> {
        let double = stress[0] * 2.0;
        let [uu, ug, up, gg, gp, pp] = section.stiffness;
        let [q_gg, q_gp, q_pp] = section.second;
        let [q_gg, q_gp, q_pp] = [double * q_gg, double * q_gp, double * q_pp];
        let mut h = self.elastic(&[uu, ug, up, gg + q_gg, gp + q_gp, pp + q_pp]);
        let n = combine(&self.e1, stress[0], &perpendicular(&self.e1), stress[1] + double * self.bent[0]);
        let [x, y] = perpendicular(&n);
        let across = [x * 0.5, y * 0.5];
        for i in 0..2 {
            h.shift_a[i] += across[i];
            h.shift_b[i] += across[i];
        }
        let quarter = dot(&n, &self.opening) * 0.25;
        h.turn[0] -= quarter;
        h.turn[2] -= quarter;
        h.turn[1] += (dot(&n, &self.radius_b) - dot(&n, &self.radius_a)) * 0.5 - quarter;
        h
    }

    #[inline(always)]
    fn elastic(&self, stiffness: &[T; 6]) -> LanePair<T> {
        let (g, half_g, half_u) = (perpendicular(&self.e1), self.shear * 0.5, self.axial * 0.5);
        let one = self.shear.splat_like(1.0);
        let (ta, tb) = (perpendicular(&self.radius_a), perpendicular(&self.radius_b));
        let (u_a, u_b) = (half_g - dot(&self.e1, &ta), half_g + dot(&self.e1, &tb));
        let (g_a, g_b) = (-half_u - dot(&g, &ta), -half_u + dot(&g, &tb));
        let twice = [self.bent[0] * 2.0, self.bent[1] * 2.0];
        let u = [self.e1[0] + g[0] * twice[0], self.e1[1] + g[1] * twice[0]];
        let turn_a = [u_a + g_a * twice[0] - twice[1], g_a, -one];
        let turn_b = [u_b + g_b * twice[0] + twice[1], g_b, one];
        let [uu, ug, _, gg, ..] = *stiffness;
        let (to_u, to_g) = (combine(&u, uu, &g, ug), combine(&u, ug, &g, gg));
        let (a, b) = (multiply(stiffness, &turn_a), multiply(stiffness, &turn_b));
        LanePair {
            shift: [u[0] * to_u[0] + g[0] * to_g[0], u[0] * to_u[1] + g[0] * to_g[1], u[1] * to_u[1] + g[1] * to_g[1]],
            shift_a: combine(&u, a[0], &g, a[1]),
            shift_b: combine(&u, b[0], &g, b[1]),
            turn: [dot3(&turn_a, &a), dot3(&turn_a, &b), dot3(&turn_b, &b)],
        }
    }
}

impl<W: SimdReal> LanePair<W> {
    /// Adds the block of body a twice.
    #[inline(always)]
    pub fn add_aa(&self, simd: W::Simd, block: &mut LaneBlock) {
        let ([xx, xy, yy], [cx, cy]) = (self.shift, self.shift_a);
        add_block(simd, block, [[xx, xy, -cx], [xy, yy, -cy], [-cx, -cy, self.turn[0]]]);
    }

    /// Adds the block of body b twice.
    #[inline(always)]
    pub fn add_bb(&self, simd: W::Simd, block: &mut LaneBlock) {
        let ([xx, xy, yy], [cx, cy]) = (self.shift, self.shift_b);
        add_block(simd, block, [[xx, xy, cx], [xy, yy, cy], [cx, cy, self.turn[2]]]);
    }

    /// Adds the block with rows of body a and columns of body b, or its transpose.
    #[inline(always)]
    pub fn add_ab(&self, simd: W::Simd, block: &mut LaneBlock, transposed: bool) {
        let ([xx, xy, yy], [ax, ay], [bx, by]) = (self.shift, self.shift_a, self.shift_b);
        if transposed {
            add_block(simd, block, [[-xx, -xy, -bx], [-xy, -yy, -by], [ax, ay, self.turn[1]]]);
        } else {
            add_block(simd, block, [[-xx, -xy, ax], [-xy, -yy, ay], [-bx, -by, self.turn[1]]]);
        }
    }
}

/// `block += more`, columns.
#[inline(always)]
fn add_block<W: SimdReal>(simd: W::Simd, block: &mut LaneBlock, more: LaneBlock<W>) {
    for (column, more) in block.iter_mut().zip(&more) {
        add(simd, column, more);
    }
}
