//! Inverse dynamics: the forces that a motion would take, over the coordinates. Bodies give wrenches, the tree's springs act
//! on the coordinates themselves, and one pass from the leaves to the root brings both together.

use super::columns::Four;
use super::kinematics::triple;
use super::poses::{LaneJointStates, TreeKinematics, place_of, tiles};
use super::tree::{Tree, TreeJoint};
use crate::batch::{Kernel, Lane8, LanePose, SimdReal, ZERO_POSE, everywhere, load, store};
use crate::forces::RestStrain;
use crate::joint_coordinates::TreeParent;
use crate::planar::{JointFrame, Pose, Symmetric};
use pulp::{Arch, Simd, WithSimd};

impl TreeJoint {
    /// Axial rest offset of the joint, or its change with `rest` (m).
    #[inline(always)]
    pub fn offset(&self, rest: &RestStrain<'_>) -> f64 {
        self.rest * rest.built_in + self.expansion.map_or(0.0, |(group, length)| length * rest.expansion[group])
    }

    /// Stress of the joint at coordinates `s`.
    #[inline(always)]
    pub fn stress(&self, s: &Pose, rest: &RestStrain<'_>) -> Pose {
        self.stiffness.times([s.x - self.offset(rest), s.y, s.z]).into()
    }
}

impl TreeKinematics {
    /// Minus the force over the coordinates from wrenches on the bodies and the tree's springs. `wrench` becomes its
    /// sum over the subtree of each body.
    #[inline]
    pub fn resist(&self, tree: &Tree, stresses: &Stresses, wrench: &mut [Pose], out: &mut [Four]) {
        Arch::new().dispatch(Resist { placed: self, tree, stresses, wrench, out });
    }

    /// Motion of the bodies with a change `s` of the coordinates.
    #[inline]
    pub fn spread(&self, tree: &Tree, s: &[Pose], out: &mut [Pose]) {
        for (j, up) in tree.upward.iter().enumerate().rev() {
            let s = &s[j];
            out[j] = match up.parent {
                TreeParent::Free => *s,
                TreeParent::Ground => Pose::from(self.map(j).apply(up.sign, &[0.0; 3], &triple(s))),
                TreeParent::Body(p) => Pose::from(self.map(j).apply(up.sign, &triple(&out[p as usize]), &triple(s))),
            };
        }
    }
}

impl TreeKinematics {
    /// Motions of the bodies with changes of the coordinates and of their rates at the place held: those of both together.
    #[inline]
    pub fn spread_motion(&self, tree: &Tree, s: &[LaneJointStates], [q, v]: [&mut [Pose]; 2]) {
        for (j, up) in tree.upward.iter().enumerate().rev() {
            let ((tile, lane), map) = (place_of(j), self.map(j));
            let [of_q, of_v, _] = s[tile].of(lane);
            for (out, s) in [(&mut *q, of_q), (&mut *v, of_v)] {
                let above = match up.parent {
                    TreeParent::Free => {
                        out[j] = s;
                        continue;
                    }
                    TreeParent::Ground => [0.0; 3],
                    TreeParent::Body(p) => triple(&out[p as usize]),
                };
                out[j] = Pose::from(map.apply(up.sign, &above, &triple(&s)));
            }
        }
    }
}

struct Resist<'a> {
    placed: &'a TreeKinematics,
    tree: &'a Tree,
    stresses: &'a Stresses,
    wrench: &'a mut [Pose],
    out: &'a mut [Four],
}

impl WithSimd for Resist<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { placed, tree, stresses, wrench, out } = self;
        for ((j, up), out) in tree.upward.iter().enumerate().zip(out) {
            let (map, f, stress) = (placed.map(j), triple(&wrench[j]), stresses.of(j));
            let [u, g, p] = map.gather(up.sign, &f);
            *out = Four([-(u + stress.x), -(g + stress.y), -(p + stress.z), 0.0]);
            if let TreeParent::Body(p) = up.parent {
                wrench[p as usize] += Pose::from(map.pass(&f));
            }
        }
    }
}

/// Stresses of the tree's joints, eight bodies per lane.
#[derive(Debug, Clone)]
pub struct Stresses {
    /// Axial rest offsets (m).
    offsets: Vec<Lane8>,
    /// By coordinates.
    out: Vec<LanePose>,
}

impl Stresses {
    /// Storage for a tree.
    #[inline]
    pub fn new(tree: &Tree) -> Self {
        let count = tiles(tree.links.len());
        Self { offsets: vec![Lane8::NONE; count], out: vec![ZERO_POSE; count] }
    }

    /// Fills in the stresses at coordinates `at`.
    #[inline]
    pub fn fill(&mut self, tree: &Tree, at: &[LaneJointStates], rest: &RestStrain<'_>) {
        for &j in &tree.offset {
            let (tile, lane) = place_of(j as usize);
            self.offsets[tile].0[lane] = tree.links[j as usize].offset(rest);
        }
        everywhere(Stress { stresses: self, tree, at });
    }

    /// Of the joint of body `j`.
    #[inline(always)]
    pub fn of(&self, j: usize) -> Pose {
        let (tile, lane) = place_of(j);
        let [u, g, p] = &self.out[tile];
        Pose::new(u.0[lane], g.0[lane], p.0[lane])
    }
}

struct Stress<'a> {
    stresses: &'a mut Stresses,
    tree: &'a Tree,
    at: &'a [LaneJointStates],
}

impl Kernel for Stress<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Stresses { offsets, out } = self.stresses;
        for (((at, offset), springs), out) in self.at.iter().zip(offsets).zip(&self.tree.springs).zip(out) {
            let [u, g, p] = load::<W, 3>(simd, &at.q);
            let springs = Symmetric(load::<W, 6>(simd, springs));
            store(springs.times([u - W::load(simd, offset), g, p]), out);
        }
    }
}

impl Tree {
    /// Coordinates `s` of the poses `q`: the strains of the tree's joints, what is locked left out.
    pub fn coordinates_at(&self, q: &[Pose], s: &mut [Pose]) {
        let ground = Pose::zeros();
        for (j, link) in self.links.iter().enumerate() {
            s[j] = match link.parent {
                TreeParent::Free => q[j],
                parent => {
                    let of = match parent {
                        TreeParent::Body(p) => &q[p as usize],
                        _ => &ground,
                    };
                    link.strains(of, &q[j])
                }
            };
        }
        self.project(s);
    }

    /// Rates of the coordinates at poses `q` with rates `v`.
    pub fn rates_at(&self, q: &[Pose], v: &[Pose], s: &mut [Pose]) {
        let ground = Pose::zeros();
        for (j, link) in self.links.iter().enumerate() {
            s[j] = match link.parent {
                TreeParent::Free => v[j],
                parent => {
                    let (of, moving) = match parent {
                        TreeParent::Body(p) => (&q[p as usize], &v[p as usize]),
                        _ => (&ground, &ground),
                    };
                    link.strain_rates((of, &q[j]), (moving, &v[j]))
                }
            };
        }
        self.project(s);
    }
}

impl TreeJoint {
    fn frame(&self) -> JointFrame {
        let (arm_a, arm_b) = if self.sign < 0.0 { (self.arm, self.arm_parent) } else { (self.arm_parent, self.arm) };
        JointFrame { arm_a, arm_b, axis: self.axis }
    }

    fn strains(&self, parent: &Pose, body: &Pose) -> Pose {
        let (a, b) = if self.sign < 0.0 { (body, parent) } else { (parent, body) };
        self.frame().kinematics(a, b, &self.second).strain.into()
    }

    fn strain_rates(&self, (parent, body): (&Pose, &Pose), (moving, own): (&Pose, &Pose)) -> Pose {
        let (a, b, va, vb) = if self.sign < 0.0 { (body, parent, own, moving) } else { (parent, body, moving, own) };
        let rows = self.frame().kinematics(a, b, &self.second).rows();
        rows * nalgebra::Vector6::new(va.x, va.y, va.z, vb.x, vb.y, vb.z)
    }
}
