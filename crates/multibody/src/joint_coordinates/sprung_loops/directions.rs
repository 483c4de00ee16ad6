//! Many motions of the coordinates at once, eight directions to a lane: motions of the bodies with them, products with forms over the
//! bodies, and the sums that a reduced model takes.
//!
//! A body has three rows with a number for each direction. Every operation goes over the bodies once, with as many vectors in flight
//! as there are eights of directions.

// rows of three are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::columns::Four;
use super::geometric::Geometric;
use super::poses::TreeKinematics;
use super::tree::Tree;
use crate::batch::{Kernel, LANES, LanePose, SimdReal, ZERO_POSE, everywhere, load, store};
use crate::joint_coordinates::TreeParent;
use crate::planar::Pose;
use crate::{BodyMatrix, Pattern};
use nalgebra::DMatrix;

/// Three numbers of each body for each direction.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionRows {
    /// Bodies, and the eights of directions of each.
    rows: Vec<LanePose>,
    /// Eights of directions.
    width: usize,
    /// Directions.
    count: usize,
}

impl DirectionRows {
    /// Zeros for `count` directions over `bodies` bodies.
    pub fn zeros(bodies: usize, count: usize) -> Self {
        let width = count.div_ceil(LANES);
        Self { rows: vec![ZERO_POSE; bodies * width], width, count }
    }

    /// Of vectors over the bodies, one for each direction.
    pub fn of(directions: &[Vec<Pose>]) -> Self {
        let mut all = Self::zeros(directions.first().map_or(0, Vec::len), directions.len());
        for (k, direction) in directions.iter().enumerate() {
            for (j, x) in direction.iter().enumerate() {
                let row = &mut all.rows[j * all.width + k / LANES];
                (0..3).for_each(|i| row[i].0[k % LANES] = x[i]);
            }
        }
        all
    }

    /// Sets every number to zero.
    pub fn clear(&mut self) {
        self.rows.fill(ZERO_POSE);
    }

    /// The part of body `j` in direction `k`.
    pub fn at(&self, j: usize, k: usize) -> Pose {
        let [x, y, z] = &self.rows[j * self.width + k / LANES];
        Pose::new(x.0[k % LANES], y.0[k % LANES], z.0[k % LANES])
    }

    /// Becomes the motions of the bodies with motions `s` of the coordinates.
    pub fn spread(&mut self, tree: &Tree, placed: &TreeKinematics, s: &Self) {
        everywhere(SpreadAll { out: self, tree, placed, s });
    }

    /// Becomes A·x with an unfactored matrix over the bodies.
    pub fn multiply(&mut self, pattern: &Pattern, matrix: &BodyMatrix, x: &Self) {
        self.clear();
        everywhere(MultiplyAll { out: self, pattern, matrix, x });
    }

    /// Becomes m·x with a diagonal of each body.
    pub fn scale(&mut self, diagonal: impl Fn(usize) -> Pose, x: &Self) {
        for (j, (to, from)) in self.rows.chunks_mut(self.width).zip(x.rows.chunks(self.width)).enumerate() {
            let m = diagonal(j);
            for (to, from) in to.iter_mut().zip(from) {
                for i in 0..3 {
                    for lane in 0..LANES {
                        to[i].0[lane] = from[i].0[lane] * m[i];
                    }
                }
            }
        }
    }

    /// Becomes what the stiffness that forces bring makes of motions `s` of the coordinates, over the coordinates; over the rotations of
    /// parents it is added to `bodies`. `moved` holds the motions of the bodies.
    pub fn geometry(&mut self, tree: &Tree, geometric: &[Geometric], s: &Self, moved: &Self, bodies: &mut Self) {
        everywhere(GeometryAll { out: self, tree, geometric, s, moved, bodies });
    }

    /// `to += selfᵀ·other`, of which the result is known to be symmetric.
    pub fn add_products(&self, other: &Self, to: &mut DMatrix<f64>) {
        everywhere(DirectionProducts { one: self, other, to });
    }

    /// The products with one vector over the bodies, negative.
    pub fn gather(&self, x: &[Four], to: &mut [f64]) {
        everywhere(GatherAll { of: self, x, to });
    }
}

struct SpreadAll<'a> {
    out: &'a mut DirectionRows,
    tree: &'a Tree,
    placed: &'a TreeKinematics,
    s: &'a DirectionRows,
}

impl Kernel for SpreadAll<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { out, tree, placed, s } = self;
        let width = out.width;
        for (j, up) in tree.upward.iter().enumerate().rev() {
            let map = placed.map(j);
            for c in 0..width {
                let s = load::<W, 3>(simd, &s.rows[j * width + c]);
                let parent = match up.parent {
                    TreeParent::Free => {
                        store(s, &mut out.rows[j * width + c]);
                        continue;
                    }
                    TreeParent::Ground => [W::splat(simd, 0.0); 3],
                    TreeParent::Body(p) => load::<W, 3>(simd, &out.rows[p as usize * width + c]),
                };
                let mut moved = parent;
                let [u, g, p] = &map.columns;
                for i in 0..2 {
                    moved[i] += parent[2] * map.lever[i] + (s[0] * u[i] + s[1] * g[i] + s[2] * p[i]);
                }
                moved[2] += s[2] * up.sign;
                store(moved, &mut out.rows[j * width + c]);
            }
        }
    }
}

struct MultiplyAll<'a> {
    out: &'a mut DirectionRows,
    pattern: &'a Pattern,
    matrix: &'a BodyMatrix,
    x: &'a DirectionRows,
}

impl Kernel for MultiplyAll<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { out, pattern, matrix, x } = self;
        let width = out.width;
        for j in 0..pattern.bodies() {
            let block = &matrix.diagonal[j];
            for c in 0..width {
                let own = load::<W, 3>(simd, &x.rows[j * width + c]);
                let mut sum = load::<W, 3>(simd, &out.rows[j * width + c]);
                for i in 0..3 {
                    sum[i] += own[0] * block[(i, 0)] + own[1] * block[(i, 1)] + own[2] * block[(i, 2)];
                }
                store(sum, &mut out.rows[j * width + c]);
            }
            for k in pattern.column(j) {
                let block = &matrix.below[k];
                if block.iter().all(|x| *x == 0.0) {
                    continue;
                }
                let row = pattern.row(k);
                for c in 0..width {
                    let (here, there) = (j * width + c, row * width + c);
                    let (own, other) = (load::<W, 3>(simd, &x.rows[here]), load::<W, 3>(simd, &x.rows[there]));
                    let mut sum = load::<W, 3>(simd, &out.rows[here]);
                    let mut below = load::<W, 3>(simd, &out.rows[there]);
                    for i in 0..3 {
                        below[i] += own[0] * block[(i, 0)] + own[1] * block[(i, 1)] + own[2] * block[(i, 2)];
                        sum[i] += other[0] * block[(0, i)] + other[1] * block[(1, i)] + other[2] * block[(2, i)];
                    }
                    store(sum, &mut out.rows[here]);
                    store(below, &mut out.rows[there]);
                }
            }
        }
    }
}

struct GeometryAll<'a> {
    out: &'a mut DirectionRows,
    tree: &'a Tree,
    geometric: &'a [Geometric],
    s: &'a DirectionRows,
    moved: &'a DirectionRows,
    bodies: &'a mut DirectionRows,
}

impl Kernel for GeometryAll<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { out, tree, geometric, s, moved, bodies } = self;
        let width = out.width;
        for (j, (up, geometric)) in tree.upward.iter().zip(geometric).enumerate() {
            for c in 0..width {
                let x = load::<W, 3>(simd, &s.rows[j * width + c]);
                let mut own = x;
                for i in 0..3 {
                    own[i] = x[0] * geometric.own[(i, 0)] + x[1] * geometric.own[(i, 1)] + x[2] * geometric.own[(i, 2)];
                }
                if let TreeParent::Body(p) = up.parent {
                    let at = p as usize * width + c;
                    let turn = W::load(simd, &moved.rows[at][2]);
                    let [a, b, c] = geometric.cross;
                    for (own, cross) in own.iter_mut().zip([a, b, c]) {
                        *own += turn * cross;
                    }
                    let more = x[0] * a + x[1] * b + x[2] * c + turn * geometric.turn;
                    (W::load(simd, &bodies.rows[at][2]) + more).store(&mut bodies.rows[at][2]);
                }
                store(own, &mut out.rows[j * width + c]);
            }
        }
    }
}

/// Directions whose products are summed together.
const TOGETHER: usize = 4;

struct DirectionProducts<'a> {
    one: &'a DirectionRows,
    other: &'a DirectionRows,
    to: &'a mut DMatrix<f64>,
}

impl Kernel for DirectionProducts<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { one, other, to } = self;
        let (width, count) = (one.width, one.count);
        for first in (0..count).step_by(TOGETHER) {
            for c in first / LANES..width {
                let mut sums = [W::splat(simd, 0.0); TOGETHER];
                for (own, other) in one.rows.chunks_exact(width).zip(other.rows.chunks_exact(width)) {
                    let (of, lane) = (&own[first / LANES], first % LANES);
                    for i in 0..3 {
                        let x = W::load(simd, &other[c][i]);
                        for (q, sum) in sums.iter_mut().enumerate() {
                            *sum += x * of[i].0[lane + q];
                        }
                    }
                }
                let mut lanes = crate::batch::Lane8::NONE;
                for (q, sum) in sums.into_iter().enumerate().take(count - first.min(count)) {
                    sum.store(&mut lanes);
                    let k = first + q;
                    for l in (c * LANES..((c + 1) * LANES).min(count)).filter(|l| *l >= k) {
                        to[(k, l)] += lanes.0[l % LANES];
                        if l != k {
                            to[(l, k)] += lanes.0[l % LANES];
                        }
                    }
                }
            }
        }
    }
}

struct GatherAll<'a> {
    of: &'a DirectionRows,
    x: &'a [Four],
    to: &'a mut [f64],
}

impl Kernel for GatherAll<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { of, x, to } = self;
        for c in 0..of.width {
            // three independent sums: each addition waits for the one before it
            let mut sums = [W::splat(simd, 0.0); 3];
            for (rows, x) in of.rows.chunks_exact(of.width).zip(x) {
                for i in 0..3 {
                    sums[i] += W::load(simd, &rows[c][i]) * x.0[i];
                }
            }
            let mut lanes = crate::batch::Lane8::NONE;
            (sums[0] + sums[1] + sums[2]).store(&mut lanes);
            for (to, sum) in to[c * LANES..].iter_mut().zip(lanes.0) {
                *to = -sum;
            }
        }
    }
}
