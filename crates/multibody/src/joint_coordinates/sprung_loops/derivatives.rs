//! The exact change of where the bodies are, and of what they feel: the kinematics over values with their derivatives.

use super::kinematics::{JointState, MotionMap, RelativeOffset, RotationState, offset_from_parent};
use super::poses::{LaneJointStates, place_of};
use super::tree::Tree;
use crate::joint_coordinates::TreeParent;
use crate::planar::{HalfTurn, Pose, Vec3};
use crate::scalar::Dual;

/// Intermediate state of a body: pose, rate and acceleration, and its rotation.
#[derive(Debug, Clone, Copy)]
struct ChangingBody {
    moved: [Vec3<Dual>; 3],
    turned: RotationState<Dual>,
}

const ZERO_COORDINATES: [Vec3<Dual>; 3] = [[Dual::ZERO; 3]; 3];
const REST: HalfTurn<Dual> =
    HalfTurn { sin: Dual::ZERO, cos: Dual::constant(1.0), less: Dual::ZERO, whole: Dual::ZERO };
const GROUND: ChangingBody = ChangingBody {
    moved: ZERO_COORDINATES,
    turned: RotationState { turn: REST, spin: Dual::ZERO, spin_rate: Dual::ZERO },
};

/// Where the bodies are, with its change. One entry for each body.
#[derive(Debug, Clone)]
pub struct Changes {
    places: Vec<ChangingBody>,
    maps: Vec<MotionMap<Dual>>,
    /// Sums of wrenches towards the root.
    sums: Vec<Vec3<Dual>>,
}

impl Changes {
    /// Storage for a tree.
    #[inline]
    pub fn new(tree: &Tree) -> Self {
        let none = MotionMap { lever: [Dual::ZERO; 2], columns: [[Dual::ZERO; 2]; 3] };
        let count = tree.links.len();
        Self { places: vec![GROUND; count], maps: vec![none; count], sums: Vec::with_capacity(count) }
    }

    /// Places the bodies at a motion `at` of the coordinates that changes by `change`.
    pub fn place(&mut self, tree: &Tree, at: &[LaneJointStates], change: &[LaneJointStates]) {
        for (j, up) in tree.upward.iter().enumerate().rev() {
            let (tile, lane) = place_of(j);
            let (value, change) = (at[tile].of(lane), change[tile].of(lane));
            let [q, v, z] = [0, 1, 2].map(|i| both((&value[i], &change[i])));
            let parent = match up.parent {
                TreeParent::Body(p) => &self.places[p as usize],
                TreeParent::Ground => &GROUND,
                TreeParent::Free => {
                    self.places[j] = ChangingBody { moved: [q, v, z], turned: turned(q[2], v[2], z[2]) };
                    let one = Dual::constant(1.0);
                    self.maps[j].columns = [[one, Dual::ZERO], [Dual::ZERO, one], [Dual::ZERO; 2]];
                    continue;
                }
            };
            let [mut at, mut rate, mut push] = parent.moved;
            at[2] += q[2] * up.sign;
            rate[2] += v[2] * up.sign;
            push[2] += z[2] * up.sign;
            let own = turned(at[2], rate[2], push[2]);
            let shape = tree.shapes[tile].of(lane, Dual::ZERO);
            let RelativeOffset { map, beyond } =
                offset_from_parent(&shape, &parent.turned, &own, &JointState { q, v, z });
            for i in 0..2 {
                at[i] += beyond[0][i];
                rate[i] += beyond[1][i];
                push[i] += beyond[2][i];
            }
            self.places[j] = ChangingBody { moved: [at, rate, push], turned: own };
            self.maps[j] = map;
        }
    }

    /// Changes of pose, rate and acceleration of body `j`.
    #[inline]
    pub fn of(&self, j: usize) -> [Pose; 3] {
        self.places[j].moved.map(|x| Pose::new(x[0].change, x[1].change, x[2].change))
    }

    /// Change of the share that wrenches on the bodies have in the coordinates, where the wrenches `force` change by `wrench`.
    pub fn gather(&mut self, tree: &Tree, force: &[Pose], wrench: &[Pose], out: &mut [Pose]) {
        self.sums.clear();
        self.sums.extend(force.iter().zip(wrench).map(both));
        for (j, up) in tree.upward.iter().enumerate() {
            let map = &self.maps[j];
            let f = self.sums[j];
            let share = map.gather(up.sign, &f);
            out[j] = Pose::new(share[0].change, share[1].change, share[2].change);
            if let TreeParent::Body(p) = up.parent {
                for (to, f) in self.sums[p as usize].iter_mut().zip(map.pass(&f)) {
                    *to += f;
                }
            }
        }
    }
}

fn turned(theta: Dual, spin: Dual, spin_rate: Dual) -> RotationState<Dual> {
    let (sin, cos) = (theta * 0.5).sin_cos();
    RotationState { turn: HalfTurn::of([sin, cos]), spin, spin_rate }
}

fn both((value, change): (&Pose, &Pose)) -> Vec3<Dual> {
    [0, 1, 2].map(|i| Dual { value: value[i], change: change[i] })
}
