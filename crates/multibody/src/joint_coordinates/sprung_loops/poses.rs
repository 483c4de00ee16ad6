//! Poses, rates and accelerations of the bodies from the coordinates, root → leaf, eight bodies per vector.
//!
//! Bodies stand in tiles of eight as they are eliminated. First the rotations are summed along the tree, one body after
//! the other. Then each body of a tile computes its offset from its parent in a lane of its own
//! ([`super::kinematics`]). Finally displacements are summed. Lanes beyond the last body hold nothing.

use super::kinematics::{JointGeometry, JointState, MotionMap, RelativeOffset, RotationState, offset_from_parent};
use super::tree::Tree;
use crate::batch::{Kernel, LANES, Lane8, SimdReal, ZERO_POSE, everywhere, load, store};
use crate::joint_coordinates::TreeParent;
use crate::planar::{HalfTurn, Pose, Vec2};
use crate::scalar::Real;

/// Coordinates, rates and accelerations of eight bodies.
pub type LaneJointStates = JointState<Lane8>;

impl LaneJointStates {
    /// Nothing moves.
    pub const REST: Self = Self { q: ZERO_POSE, v: ZERO_POSE, z: ZERO_POSE };

    /// Tiles of coordinates `q`, rates `v` and accelerations `z`, one for each body.
    #[inline]
    pub fn tiles(q: &[Pose], v: &[Pose], z: &[Pose]) -> Vec<Self> {
        let mut given = vec![Self::REST; tiles(q.len())];
        for (j, ((q, v), z)) in q.iter().zip(v).zip(z).enumerate() {
            given[j / LANES].set(j % LANES, [q, v, z]);
        }
        given
    }

    /// Tiles of coordinates `q` at rest.
    #[inline]
    pub fn at_rest(q: &[Pose]) -> Vec<Self> {
        let zeros = vec![Pose::zeros(); q.len()];
        Self::tiles(q, &zeros, &zeros)
    }

    /// Sets those of one body: q, v, z.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, [q, v, z]: [&Pose; 3]) {
        for i in 0..3 {
            (self.q[i].0[lane], self.v[i].0[lane], self.z[i].0[lane]) = (q[i], v[i], z[i]);
        }
    }

    /// Those of one body: q, v, z.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> [Pose; 3] {
        [&self.q, &self.v, &self.z].map(|x| Pose::new(x[0].0[lane], x[1].0[lane], x[2].0[lane]))
    }

    /// All lanes, in registers.
    #[inline(always)]
    pub fn load<W: SimdReal>(&self, simd: W::Simd) -> JointState<W> {
        JointState { q: load(simd, &self.q), v: load(simd, &self.v), z: load(simd, &self.z) }
    }

    /// Writes all lanes.
    #[inline(always)]
    pub fn store<W: SimdReal>(&mut self, given: JointState<W>) {
        store(given.q, &mut self.q);
        store(given.v, &mut self.v);
        store(given.z, &mut self.z);
    }
}

/// Tile and lane of a body.
#[inline(always)]
pub const fn place_of(body: usize) -> (usize, usize) {
    (body / LANES, body % LANES)
}

/// Number of tiles of `count` bodies.
pub const fn tiles(count: usize) -> usize {
    count.div_ceil(LANES)
}

/// Eight bodies in progress.
#[derive(Debug, Clone, Copy)]
struct BodyTile {
    /// Rotation; then sine and cosine of half of it.
    theta: Lane8,
    half: [Lane8; 2],
    /// Rate of the rotation, and the rate of that.
    spin: [Lane8; 2],
    /// Lever, then columns.
    map: [Lane8; 8],
    /// Displacement, rate and acceleration less the parent's.
    beyond: [Lane8; 6],
}

const GROUND: [f64; 4] = [0.0, 1.0, 0.0, 0.0];

const REST: BodyTile = BodyTile {
    theta: Lane8::NONE,
    half: [Lane8::NONE, Lane8::of(1.0)],
    spin: [Lane8::NONE; 2],
    map: [Lane8::NONE; 8],
    beyond: [Lane8::NONE; 6],
};

/// Poses of the bodies, with the maps of their motion.
#[derive(Debug, Clone)]
pub struct TreeKinematics {
    tiles: Vec<BodyTile>,
    /// Displacement and rotation of each body.
    pub at: Vec<Pose>,
    /// Their rates.
    pub rate: Vec<Pose>,
    /// Their accelerations.
    pub acceleration: Vec<Pose>,
}

impl TreeKinematics {
    /// Storage for a tree.
    #[inline]
    pub fn new(tree: &Tree) -> Self {
        let zeros = vec![Pose::zeros(); tree.links.len()];
        Self { tiles: vec![REST; tiles(zeros.len())], at: zeros.clone(), rate: zeros.clone(), acceleration: zeros }
    }

    /// Sine and cosine of half the rotation of body `j`.
    #[inline(always)]
    pub(super) fn half(&self, j: usize) -> [f64; 2] {
        let (tile, lane) = place_of(j);
        self.tiles[tile].half.map(|x| x.0[lane])
    }

    /// Places the bodies at a motion of the coordinates.
    #[inline]
    pub fn place(&mut self, tree: &Tree, given: &[LaneJointStates]) {
        everywhere(PlaceTree { placed: self, tree, given });
    }

    /// How body `j` moves with its parent and its coordinates.
    #[inline(always)]
    pub fn map(&self, j: usize) -> MotionMap<f64> {
        let (tile, lane) = place_of(j);
        let of = |i: usize| self.tiles[tile].map[i].0[lane];
        MotionMap { lever: [of(0), of(1)], columns: [[of(2), of(3)], [of(4), of(5)], [of(6), of(7)]] }
    }
}

pub(super) struct PlaceTree<'a> {
    pub(super) placed: &'a mut TreeKinematics,
    pub(super) tree: &'a Tree,
    pub(super) given: &'a [LaneJointStates],
}

impl Kernel for PlaceTree<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { placed, tree, given } = self;
        // along an arm each sum waits for the one before it: those of other arms fill the time
        for (t, given) in given.iter().enumerate().rev() {
            placed.rotate(tree, t, given);
        }
        for tile in &mut placed.tiles {
            let (sin, cos) = (W::load(simd, &tile.theta) * 0.5).sin_cos(simd);
            store([sin, cos], &mut tile.half);
        }
        for (t, given) in given.iter().enumerate() {
            placed.attach_to_parents::<W>(simd, tree, t, given);
        }
        for (t, given) in given.iter().enumerate().rev() {
            placed.sum(tree, t, given);
        }
    }
}

impl TreeKinematics {
    /// Rotations of a tile's bodies, and their rates.
    #[inline(always)]
    fn rotate(&mut self, tree: &Tree, t: usize, given: &LaneJointStates) {
        let tile = &mut self.tiles[t];
        for (k, up) in tree.upward[t * LANES..].iter().take(LANES).enumerate().rev() {
            let j = t * LANES + k;
            let own = [given.q[2].0[k], given.v[2].0[k], given.z[2].0[k]].map(|x| x * up.sign);
            let [theta, spin, rate] = match up.parent {
                TreeParent::Body(p) => {
                    let p = p as usize;
                    [self.at[p].z + own[0], self.rate[p].z + own[1], self.acceleration[p].z + own[2]]
                }
                TreeParent::Ground | TreeParent::Free => own,
            };
            (self.at[j].z, self.rate[j].z, self.acceleration[j].z) = (theta, spin, rate);
            (tile.theta.0[k], tile.spin[0].0[k], tile.spin[1].0[k]) = (theta, spin, rate);
        }
    }

    /// Rotations of the parents of a tile's bodies, and of these.
    #[inline(always)]
    pub(super) fn rotations<W: SimdReal>(
        &self,
        simd: W::Simd,
        tree: &Tree,
        t: usize,
    ) -> (RotationState<W>, RotationState<W>) {
        let (mut half, mut spin) = (REST.half, REST.spin);
        for (k, up) in tree.upward[t * LANES..].iter().take(LANES).enumerate() {
            let [sin, cos, rate, push] = match up.parent {
                TreeParent::Body(p) => {
                    let (tile, lane) = place_of(p as usize);
                    let of = &self.tiles[tile];
                    [of.half[0].0[lane], of.half[1].0[lane], of.spin[0].0[lane], of.spin[1].0[lane]]
                }
                TreeParent::Ground | TreeParent::Free => GROUND,
            };
            (half[0].0[k], half[1].0[k], spin[0].0[k], spin[1].0[k]) = (sin, cos, rate, push);
        }
        let tile = &self.tiles[t];
        (turned::<W>(simd, &half, &spin), turned::<W>(simd, &tile.half, &tile.spin))
    }

    /// Offset of each body of a tile from its parent.
    #[inline(always)]
    fn attach_to_parents<W: SimdReal>(&mut self, simd: W::Simd, tree: &Tree, t: usize, given: &LaneJointStates) {
        let (parent, own) = self.rotations::<W>(simd, tree, t);
        let tile = &mut self.tiles[t];
        let (shape, given) = (tree.shapes[t].load::<W>(simd), given.load::<W>(simd));
        let RelativeOffset { map, beyond } = offset_from_parent(&shape, &parent, &own, &given);
        let [u, g, p] = map.columns;
        store([map.lever[0], map.lever[1], u[0], u[1], g[0], g[1], p[0], p[1]], &mut tile.map);
        let [at, rate, push] = beyond;
        store([at[0], at[1], rate[0], rate[1], push[0], push[1]], &mut tile.beyond);
    }

    /// Sums displacements, rates and accelerations along the tree.
    #[inline(always)]
    fn sum(&mut self, tree: &Tree, t: usize, given: &LaneJointStates) {
        for (k, up) in tree.upward[t * LANES..].iter().take(LANES).enumerate().rev() {
            let j = t * LANES + k;
            let beyond = |i: usize| -> Vec2<f64> {
                let of = &self.tiles[t].beyond;
                [of[2 * i].0[k], of[2 * i + 1].0[k]]
            };
            let (at, rate, push) = (beyond(0), beyond(1), beyond(2));
            match up.parent {
                TreeParent::Free => {
                    [self.at[j], self.rate[j], self.acceleration[j]] = given.of(k);
                    // its coordinates are its own displacement and rotation
                    for (to, x) in self.tiles[t].map.iter_mut().zip([0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]) {
                        to.0[k] = x;
                    }
                }
                TreeParent::Ground => {
                    (self.at[j].x, self.at[j].y) = (at[0], at[1]);
                    (self.rate[j].x, self.rate[j].y) = (rate[0], rate[1]);
                    (self.acceleration[j].x, self.acceleration[j].y) = (push[0], push[1]);
                }
                TreeParent::Body(p) => {
                    let p = p as usize;
                    (self.at[j].x, self.at[j].y) = (self.at[p].x + at[0], self.at[p].y + at[1]);
                    (self.rate[j].x, self.rate[j].y) = (self.rate[p].x + rate[0], self.rate[p].y + rate[1]);
                    let above = self.acceleration[p];
                    (self.acceleration[j].x, self.acceleration[j].y) = (above.x + push[0], above.y + push[1]);
                }
            }
        }
    }
}

#[inline(always)]
fn turned<W: SimdReal>(simd: W::Simd, half: &[Lane8; 2], spin: &[Lane8; 2]) -> RotationState<W> {
    let [spin, spin_rate] = load(simd, spin);
    RotationState { turn: HalfTurn::of(load(simd, half)), spin, spin_rate }
}

impl JointGeometry<Lane8> {
    #[inline(always)]
    pub(super) fn load<W: SimdReal>(&self, simd: W::Simd) -> JointGeometry<W> {
        JointGeometry {
            sign: W::load(simd, &self.sign),
            arms: [load(simd, &self.arms[0]), load(simd, &self.arms[1])],
            axis: load(simd, &self.axis),
            second: load(simd, &self.second),
        }
    }

    /// Of one body.
    pub(super) fn of<T: Real>(&self, lane: usize, one: T) -> JointGeometry<T> {
        let like = |x: &Lane8| one.splat_like(x.0[lane]);
        let pair = |x: &Vec2<Lane8>| [like(&x[0]), like(&x[1])];
        let second = &self.second;
        JointGeometry {
            sign: like(&self.sign),
            arms: [pair(&self.arms[0]), pair(&self.arms[1])],
            axis: pair(&self.axis),
            second: [like(&second[0]), like(&second[1]), like(&second[2])],
        }
    }
}
