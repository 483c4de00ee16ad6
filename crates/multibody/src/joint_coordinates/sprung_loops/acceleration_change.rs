//! How the accelerations of the bodies change with the coordinates and their rates, while the accelerations of the coordinates are held.
//!
//! With a = J·z + J̇·v this is (∂a/∂q)·δq + 2·J̇·δv: relative accelerations turn with the parent, and Coriolis and centrifugal terms change.
//! Beyond its parent's, a body's change is linear in the parent's rotation and its rate, and in the joint's
//! coordinates and their rates (`AccelerationMaps`). The maps are computed for eight bodies per vector; sums go root → leaf.

use super::kinematics::{AccelerationMaps, MotionMap, acceleration_maps, triple};
use super::poses::{LaneJointStates, TreeKinematics, place_of, tiles};
use super::tree::Tree;
use crate::batch::{Kernel, Lane8, SimdReal, everywhere, store};
use crate::joint_coordinates::TreeParent;
use crate::planar::{Pose, Vec2};

/// The maps of eight bodies: levers, then columns, of displacements and of rates.
type LaneMaps = [[Lane8; 8]; 2];

const NONE: LaneMaps = [[Lane8::NONE; 8]; 2];

/// Changes of accelerations about one motion.
#[derive(Debug, Clone)]
pub struct AccelerationChange {
    maps: Vec<LaneMaps>,
    sums: Vec<Vec2<f64>>,
}

impl AccelerationChange {
    /// Storage for a tree.
    pub fn new(tree: &Tree) -> Self {
        Self { maps: vec![NONE; tiles(tree.links.len())], sums: vec![[0.0; 2]; tree.links.len()] }
    }

    /// Becomes that about the motion `given` of the coordinates, where the bodies have been `placed`.
    #[inline]
    pub fn fill(&mut self, tree: &Tree, placed: &TreeKinematics, given: &[LaneJointStates]) {
        everywhere(Fill { change: self, tree, placed, given });
    }

    /// Becomes the change with changes `joint` of the coordinates and their rates, and `turn` of the bodies' rotations and their rates.
    #[inline]
    pub fn spread(&mut self, tree: &Tree, joint: impl Fn(usize) -> [Pose; 2], turn: impl Fn(usize) -> [f64; 2]) {
        for (j, up) in tree.upward.iter().enumerate().rev() {
            let (above, turns) = match up.parent {
                TreeParent::Free => {
                    self.sums[j] = [0.0; 2];
                    continue;
                }
                TreeParent::Ground => ([0.0; 2], [0.0; 2]),
                TreeParent::Body(p) => (self.sums[p as usize], turn(p as usize)),
            };
            let (tile, lane) = place_of(j);
            let mut sum = above;
            for ((map, turn), joint) in self.maps[tile].iter().zip(turns).zip(joint(j)) {
                let of = |i: usize| map[i].0[lane];
                let map =
                    MotionMap { lever: [of(0), of(1)], columns: [[of(2), of(3)], [of(4), of(5)], [of(6), of(7)]] };
                let [x, y] = map.along(turn, &triple(&joint));
                sum = [sum[0] + x, sum[1] + y];
            }
            self.sums[j] = sum;
        }
    }

    /// `rates +=` how the rates of the bodies change as these move by `turn`, with changes `joint` of the coordinates, at held rates of the coordinates.
    ///
    /// The accelerations have a part quadratic in the rates, J̇·v: that of the rates with the place is half of its change with the rates along the same
    /// direction.
    #[inline]
    pub fn add_rates(&mut self, tree: &Tree, joint: &[LaneJointStates], turn: &[Pose], rates: &mut [Pose]) {
        for (j, up) in tree.upward.iter().enumerate().rev() {
            let (above, turn) = match up.parent {
                TreeParent::Free => {
                    self.sums[j] = [0.0; 2];
                    continue;
                }
                TreeParent::Ground => ([0.0; 2], 0.0),
                TreeParent::Body(p) => (self.sums[p as usize], turn[p as usize].z),
            };
            let (tile, lane) = place_of(j);
            let of = |i: usize| self.maps[tile][1][i].0[lane];
            let map = MotionMap { lever: [of(0), of(1)], columns: [[of(2), of(3)], [of(4), of(5)], [of(6), of(7)]] };
            let [x, y] = map.along(turn, &joint[tile].q.map(|x| x.0[lane]));
            self.sums[j] = [above[0] + 0.5 * x, above[1] + 0.5 * y];
            rates[j] += self.of(j);
        }
    }

    /// Change of the acceleration of body `j`, which leaves that of its rotation.
    #[inline(always)]
    pub fn of(&self, j: usize) -> Pose {
        let [x, y] = self.sums[j];
        Pose::new(x, y, 0.0)
    }
}

struct Fill<'a> {
    change: &'a mut AccelerationChange,
    tree: &'a Tree,
    placed: &'a TreeKinematics,
    given: &'a [LaneJointStates],
}

impl Kernel for Fill<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { change, tree, placed, given } = self;
        for (t, (maps, given)) in change.maps.iter_mut().zip(given).enumerate() {
            let (parent, own) = placed.rotations::<W>(simd, tree, t);
            let AccelerationMaps { displacement, rate } =
                acceleration_maps(&tree.shapes[t].load::<W>(simd), &parent, &own, &given.load::<W>(simd));
            for (to, map) in maps.iter_mut().zip([displacement, rate]) {
                let [u, g, p] = map.columns;
                store([map.lever[0], map.lever[1], u[0], u[1], g[0], g[1], p[0], p[1]], to);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::derivatives::Changes;
    use super::super::factor::tests::frame;
    use super::*;
    use nalgebra::Matrix2;

    /// The changes of accelerations and of rates are those of the kinematics over values with their derivatives (1e-12), for any motion of a frame with a loop.
    #[test]
    fn the_change_is_the_derivative() {
        let tree = Tree::elastic(&frame(Matrix2::new(1e4, 0.1, 0.1, 1e-6))).unwrap();
        let mut angles = (0..).map(|k| (0.7 * f64::from(k)).sin());
        let mut noise = || angles.next().unwrap_or_default();
        let mut poses = |size: f64| -> Vec<Pose> {
            (0..tree.links.len())
                .map(|_| Pose::new(noise() * size * 1e-6, noise() * size * 1e-6, noise() * size))
                .collect()
        };
        let given = LaneJointStates::tiles(&poses(2.0), &poses(1e5), &poses(1e10));
        let (dq, dv) = (poses(1.0), poses(1e5));
        let mut placed = TreeKinematics::new(&tree);
        placed.place(&tree, &given);
        let mut exact = Changes::new(&tree);
        let zeros = vec![Pose::zeros(); tree.links.len()];
        exact.place(&tree, &given, &LaneJointStates::tiles(&dq, &dv, &zeros));
        let mut moved = [zeros.clone(), zeros];
        placed.spread(&tree, &dq, &mut moved[0]);
        placed.spread(&tree, &dv, &mut moved[1]);
        let mut change = AccelerationChange::new(&tree);
        change.fill(&tree, &placed, &given);
        change.spread(&tree, |j| [dq[j], dv[j]], |j| [moved[0][j].z, moved[1][j].z]);
        let mut rates = moved[1].clone();
        let joint = LaneJointStates::at_rest(&dq);
        change.add_rates(&tree, &joint, &moved[0], &mut rates);
        let fastest = (0..tree.links.len()).map(|j| exact.of(j)[1].norm()).fold(0.0, f64::max);
        for (j, rate) in rates.iter().enumerate() {
            assert!((rate - exact.of(j)[1]).norm() < 1e-12 * fastest, "{j}: {rate} {}", exact.of(j)[1]);
        }
        change.spread(&tree, |j| [dq[j], dv[j]], |j| [moved[0][j].z, moved[1][j].z]);
        let largest = (0..tree.links.len()).map(|j| exact.of(j)[2].norm()).fold(0.0, f64::max);
        for j in 0..tree.links.len() {
            let (found, exact) = (change.of(j), exact.of(j)[2]);
            assert!((found - exact).norm() < 1e-12 * largest, "{j}: {found} {exact}");
        }
        assert!(largest > 1.0);
    }
}
