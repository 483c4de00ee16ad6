//! Strains of a joint, its forces and its tangent: [`crate::multibody::planar`] over lanes.

use super::{LaneBlock, LanePose, Lanes, Real};

/// Two numbers of the plane.
pub type Pair<const N: usize> = [Lanes<N>; 2];

/// Sine and cosine of half of a body's rotation, with R(θ) − 1.
#[derive(Debug, Clone, Copy)]
pub struct LaneTurn<const N: usize> {
    sin: Lanes<N>,
    cos: Lanes<N>,
    less: Lanes<N>,
    whole: Lanes<N>,
}

impl<const N: usize> LaneTurn<N> {
    /// Of ground.
    const REST: Self =
        Self { sin: Lanes([0.0; N]), cos: Lanes([1.0; N]), less: Lanes([0.0; N]), whole: Lanes([0.0; N]) };

    /// Of a rotation [rad].
    #[inline(always)]
    fn new(theta: Lanes<N>) -> Self {
        let half = Lanes::splat(0.5) * theta;
        let (sin, cos) = crate::multibody::sine::sin_cos_lanes(half.0);
        let (sin, cos) = (Lanes(sin), Lanes(cos));
        Self { sin, cos, less: Lanes::splat(-2.0) * sin * sin, whole: Lanes::splat(2.0) * sin * cos }
    }

    #[inline(always)]
    fn swing(&self, v: &Pair<N>) -> Pair<N> {
        [self.less * v[0] - self.whole * v[1], self.whole * v[0] + self.less * v[1]]
    }

    #[inline(always)]
    fn mean(&self, other: &Self, v: &Pair<N>) -> Pair<N> {
        let c = self.cos * other.cos - self.sin * other.sin;
        let s = self.sin * other.cos + self.cos * other.sin;
        [c * v[0] - s * v[1], s * v[0] + c * v[1]]
    }
}

/// Where a body is: its displacement and its turn, looked up by each of its joints.
#[derive(Debug, Clone, Copy)]
pub struct LanePlaced<const N: usize> {
    q: LanePose<N>,
    turn: LaneTurn<N>,
}

impl<const N: usize> LanePlaced<N> {
    /// Ground.
    pub const GROUND: Self = Self { q: [Lanes([0.0; N]); 3], turn: LaneTurn::REST };

    /// A body at `q`.
    #[inline(always)]
    pub fn put(&mut self, q: &LanePose<N>) {
        self.q = *q;
        self.turn = LaneTurn::new(q[2]);
    }
}

/// What joints of one section share.
#[derive(Debug, Clone, Copy)]
pub struct LaneSection<const N: usize> {
    /// Cosine and sine of the drawn angle.
    pub axis: Pair<N>,
    /// Stiffness: uu, ug, up, gg, gp, pp.
    pub stiffness: [Lanes<N>; 6],
    /// Q over (g, p): gg, gp, pp.
    pub second: [Lanes<N>; 3],
}

impl<const N: usize> LaneSection<N> {
    /// Stress of a strain.
    #[inline(always)]
    pub fn stress(&self, e: &LanePose<N>) -> LanePose<N> {
        multiply(&self.stiffness, e)
    }
}

/// Strains with what their derivatives need.
#[derive(Debug, Clone, Copy)]
pub struct LaneKinematics<const N: usize> {
    /// e_u [m], g [m], p [rad].
    pub strain: LanePose<N>,
    axial: Lanes<N>,
    shear: Lanes<N>,
    bent: Pair<N>,
    opening: Pair<N>,
    radius_a: Pair<N>,
    radius_b: Pair<N>,
    e1: Pair<N>,
}

/// The tangent of a pair of bodies, see [`crate::multibody::planar::PairTangent`].
#[derive(Debug, Clone, Copy)]
pub struct LanePair<const N: usize> {
    shift: [Lanes<N>; 3],
    shift_a: Pair<N>,
    shift_b: Pair<N>,
    turn: [Lanes<N>; 3],
}

#[inline(always)]
fn turn<const N: usize>(v: &Pair<N>) -> Pair<N> {
    [-v[1], v[0]]
}

#[inline(always)]
fn dot<const N: usize>(a: &Pair<N>, b: &Pair<N>) -> Lanes<N> {
    a[0] * b[0] + a[1] * b[1]
}

#[inline(always)]
fn dot3<const N: usize>(a: &LanePose<N>, b: &LanePose<N>) -> Lanes<N> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a·x + b·y.
#[inline(always)]
fn combine<const N: usize>(a: &Pair<N>, x: Lanes<N>, b: &Pair<N>, y: Lanes<N>) -> Pair<N> {
    [a[0] * x + b[0] * y, a[1] * x + b[1] * y]
}

#[inline(always)]
fn multiply<const N: usize>(k: &[Lanes<N>; 6], x: &LanePose<N>) -> LanePose<N> {
    let [uu, ug, up, gg, gp, pp] = *k;
    [uu * x[0] + ug * x[1] + up * x[2], ug * x[0] + gg * x[1] + gp * x[2], up * x[0] + gp * x[1] + pp * x[2]]
}

/// Strains of a joint with these arms between two bodies.
#[inline(always)]
pub fn kinematics<const N: usize>(
    section: &LaneSection<N>,
    (arm_a, arm_b): (&Pair<N>, &Pair<N>),
    LanePlaced { q: qa, turn: a }: &LanePlaced<N>,
    LanePlaced { q: qb, turn: b }: &LanePlaced<N>,
) -> LaneKinematics<N> {
    let (swing_a, swing_b) = (a.swing(arm_a), b.swing(arm_b));
    let radius_a = [arm_a[0] + swing_a[0], arm_a[1] + swing_a[1]];
    let radius_b = [arm_b[0] + swing_b[0], arm_b[1] + swing_b[1]];
    let opening = [qb[0] - qa[0] + swing_b[0] - swing_a[0], qb[1] - qa[1] + swing_b[1] - swing_a[1]];
    let e1 = a.mean(b, &section.axis);
    let (u, g, p) = (dot(&opening, &e1), dot(&opening, &turn(&e1)), qb[2] - qa[2]);
    let second = &section.second;
    let bent = [second[0] * g + second[1] * p, second[1] * g + second[2] * p];
    let strain = [u + bent[0] * g + bent[1] * p, g, p];
    LaneKinematics { strain, axial: u, shear: g, bent, opening, radius_a, radius_b, e1 }
}

impl<const N: usize> LaneKinematics<N> {
    /// Forces on bodies a and b.
    #[inline(always)]
    pub fn forces(&self, stress: &LanePose<N>) -> (LanePose<N>, LanePose<N>) {
        let double = Lanes::splat(2.0) * stress[0];
        let (shear, moment) = (stress[1] + double * self.bent[0], stress[2] + double * self.bent[1]);
        let n = combine(&self.e1, stress[0], &turn(&self.e1), shear);
        let frame = Lanes::splat(0.5) * (self.shear * stress[0] - self.axial * shear);
        let (at_a, at_b) = (dot(&turn(&self.radius_a), &n), dot(&turn(&self.radius_b), &n));
        ([-n[0], -n[1], frame - at_a - moment], [n[0], n[1], frame + at_b + moment])
    }

    /// The tangent under a stress.
    #[inline(always)]
    pub fn tangent(&self, section: &LaneSection<N>, stress: &LanePose<N>) -> LanePair<N> {
        let half = Lanes::splat(0.5);
        let double = Lanes::splat(2.0) * stress[0];
        let [uu, ug, up, gg, gp, pp] = section.stiffness;
        let [q_gg, q_gp, q_pp] = section.second.map(|q| double * q);
        let mut h = self.elastic(&[uu, ug, up, gg + q_gg, gp + q_gp, pp + q_pp]);
        let n = combine(&self.e1, stress[0], &turn(&self.e1), stress[1] + double * self.bent[0]);
        let across = turn(&n).map(|x| x * half);
        for i in 0..2 {
            h.shift_a[i] += across[i];
            h.shift_b[i] += across[i];
        }
        let quarter = Lanes::splat(0.25) * dot(&n, &self.opening);
        h.turn[0] -= quarter;
        h.turn[2] -= quarter;
        h.turn[1] += half * (dot(&n, &self.radius_b) - dot(&n, &self.radius_a)) - quarter;
        h
    }

    #[inline(always)]
    fn elastic(&self, stiffness: &[Lanes<N>; 6]) -> LanePair<N> {
        let half = Lanes::splat(0.5);
        let (g, half_g, half_u) = (turn(&self.e1), half * self.shear, half * self.axial);
        let (ta, tb) = (turn(&self.radius_a), turn(&self.radius_b));
        let (u_a, u_b) = (half_g - dot(&self.e1, &ta), half_g + dot(&self.e1, &tb));
        let (g_a, g_b) = (-half_u - dot(&g, &ta), -half_u + dot(&g, &tb));
        let twice = self.bent.map(|x| x * Lanes::splat(2.0));
        let u = [self.e1[0] + g[0] * twice[0], self.e1[1] + g[1] * twice[0]];
        let turn_a = [u_a + g_a * twice[0] - twice[1], g_a, Lanes::splat(-1.0)];
        let turn_b = [u_b + g_b * twice[0] + twice[1], g_b, Lanes::ONE];
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

impl<const N: usize> LanePair<N> {
    /// Adds the block of body a twice.
    #[inline(always)]
    pub fn add_aa(&self, block: &mut LaneBlock<N>) {
        let ([xx, xy, yy], [cx, cy]) = (self.shift, self.shift_a);
        add(block, [[xx, xy, -cx], [xy, yy, -cy], [-cx, -cy, self.turn[0]]]);
    }

    /// Adds the block of body b twice.
    #[inline(always)]
    pub fn add_bb(&self, block: &mut LaneBlock<N>) {
        let ([xx, xy, yy], [cx, cy]) = (self.shift, self.shift_b);
        add(block, [[xx, xy, cx], [xy, yy, cy], [cx, cy, self.turn[2]]]);
    }

    /// Adds the block with rows of body a and columns of body b, or its transpose.
    #[inline(always)]
    pub fn add_ab(&self, block: &mut LaneBlock<N>, transposed: bool) {
        let ([xx, xy, yy], [ax, ay], [bx, by]) = (self.shift, self.shift_a, self.shift_b);
        if transposed {
            add(block, [[-xx, -xy, -bx], [-xy, -yy, -by], [ax, ay, self.turn[1]]]);
        } else {
            add(block, [[-xx, -xy, ax], [-xy, -yy, ay], [-bx, -by, self.turn[1]]]);
        }
    }
}

/// `block += more`, columns.
#[inline(always)]
fn add<const N: usize>(block: &mut LaneBlock<N>, more: LaneBlock<N>) {
    for (column, more) in block.iter_mut().zip(&more) {
        super::add(column, more);
    }
}
