//! Inverse dynamics: the forces that a motion would take, over the coordinates. Bodies give wrenches, the tree's springs act
//! on the coordinates themselves, and one pass from the leaves to the root brings both together.

use super::kinematics::{Coordinates, Map, Placed, triple};
use super::number::Dual;
use super::tree::{Link, Parent, Tree};
use crate::multibody::forces::RestStrain;
use crate::multibody::planar::{JointFrame, Pose};
use nalgebra::Vector3;

impl Link {
    /// Axial rest offset of the joint, or its change with `rest` [m].
    #[inline(always)]
    pub fn offset(&self, rest: &RestStrain<'_>) -> f64 {
        self.rest * rest.built_in + self.expansion.map_or(0.0, |(group, length)| length * rest.expansion[group])
    }

    /// Stress of the joint at coordinates `s`.
    #[inline(always)]
    pub fn stress(&self, s: &Pose, rest: &RestStrain<'_>) -> Pose {
        self.stiffness * Vector3::new(s.x - self.offset(rest), s.y, s.z)
    }
}

impl Placed<f64> {
    /// Places the bodies at coordinates `q`.
    pub fn put(&mut self, tree: &Tree, q: &[Pose]) {
        let none = |_: usize| [0.0; 3];
        self.place::<false>(tree, &Coordinates { at: |j: usize| triple(&q[j]), rate: none, acceleration: none });
    }

    /// Places the bodies at coordinates `q` with rates `v` and accelerations `z`.
    pub fn move_on(&mut self, tree: &Tree, q: &[Pose], v: &[Pose], z: &[Pose]) {
        let given = Coordinates {
            at: |j: usize| triple(&q[j]),
            rate: |j: usize| triple(&v[j]),
            acceleration: |j: usize| triple(&z[j]),
        };
        self.place::<true>(tree, &given);
    }

    /// Places the bodies at a motion that is given body by body.
    #[inline]
    pub(crate) fn place_at<'a>(
        &mut self,
        tree: &Tree,
        q: impl Fn(usize) -> &'a Pose,
        v: impl Fn(usize) -> &'a Pose,
        z: impl Fn(usize) -> &'a Pose,
    ) {
        let given = Coordinates {
            at: |j: usize| triple(q(j)),
            rate: |j: usize| triple(v(j)),
            acceleration: |j: usize| triple(z(j)),
        };
        self.place::<true>(tree, &given);
    }

    /// Pose of body `j`.
    #[inline(always)]
    pub(crate) fn pose(&self, j: usize) -> Pose {
        Pose::from(*self.at(j))
    }

    /// Rate of body `j`.
    #[inline(always)]
    pub(crate) fn speed(&self, j: usize) -> Pose {
        Pose::from(*self.rate(j))
    }

    /// Acceleration of body `j`.
    #[inline(always)]
    pub(crate) fn pushed(&self, j: usize) -> Pose {
        Pose::from(*self.acceleration(j))
    }

    /// Poses of the bodies.
    pub fn poses(&self, out: &mut [Pose]) {
        for (j, out) in out.iter_mut().enumerate() {
            *out = Pose::from(*self.at(j));
        }
    }

    /// Rates of the bodies.
    pub fn rates(&self, out: &mut [Pose]) {
        for (j, out) in out.iter_mut().enumerate() {
            *out = Pose::from(*self.rate(j));
        }
    }

    /// Accelerations of the bodies.
    pub fn accelerations(&self, out: &mut [Pose]) {
        for (j, out) in out.iter_mut().enumerate() {
            *out = Pose::from(*self.acceleration(j));
        }
    }

    /// How each body moves with its parent and its coordinates.
    pub fn maps(&self) -> &[Map<f64>] {
        &self.maps
    }

    /// Sums wrenches over everything that hangs on each body: `wrench` becomes the sum, `out` its share in the coordinates.
    #[inline]
    pub fn gather(&self, tree: &Tree, wrench: &mut [Pose], out: &mut [Pose]) {
        for (j, link) in tree.links.iter().enumerate() {
            let map = &self.maps[j];
            let f = triple(&wrench[j]);
            out[j] = Pose::from(map.gather(link.sign, &f));
            if let Parent::Body(p) = link.parent {
                wrench[p as usize] += Pose::from(map.pass(&f));
            }
        }
    }

    /// Motion of the bodies with a change `s` of the coordinates.
    #[inline]
    pub fn spread(&self, tree: &Tree, s: &[Pose], out: &mut [Pose]) {
        for (j, link) in tree.links.iter().enumerate().rev() {
            let s = &s[j];
            out[j] = match link.parent {
                Parent::Free => *s,
                Parent::Ground => Pose::from(self.maps[j].apply(link.sign, &[0.0; 3], &triple(s))),
                Parent::Body(p) => Pose::from(self.maps[j].apply(link.sign, &triple(&out[p as usize]), &triple(s))),
            };
        }
    }
}

impl Placed<Dual> {
    /// Places the bodies at a motion and its change, given body by body.
    pub(crate) fn place_with<'a>(
        &mut self,
        tree: &Tree,
        q: impl Fn(usize) -> (&'a Pose, &'a Pose),
        v: impl Fn(usize) -> (&'a Pose, &'a Pose),
        z: impl Fn(usize) -> (&'a Pose, &'a Pose),
    ) {
        let given =
            Coordinates { at: |j: usize| both(q(j)), rate: |j: usize| both(v(j)), acceleration: |j: usize| both(z(j)) };
        self.place::<true>(tree, &given);
    }

    /// Changes of pose, rate and acceleration of body `j`.
    pub(crate) fn changes(&self, j: usize) -> (Pose, Pose, Pose) {
        let change = |x: &[Dual; 3]| Pose::new(x[0].change, x[1].change, x[2].change);
        (change(self.at(j)), change(self.rate(j)), change(self.acceleration(j)))
    }

    /// Change of [`Placed::gather`]'s result where the wrenches `force` change by `wrench`, which becomes its sum.
    pub(crate) fn gather_changes(&mut self, tree: &Tree, force: &[Pose], wrench: &[Pose], out: &mut [Pose]) {
        self.sums.clear();
        self.sums.extend(force.iter().zip(wrench).map(both));
        for (j, link) in tree.links.iter().enumerate() {
            let map = &self.maps[j];
            let f = self.sums[j];
            let share = map.gather(link.sign, &f);
            out[j] = Pose::new(share[0].change, share[1].change, share[2].change);
            if let Parent::Body(p) = link.parent {
                for (to, f) in self.sums[p as usize].iter_mut().zip(map.pass(&f)) {
                    *to += f;
                }
            }
        }
    }
}

fn both((value, change): (&Pose, &Pose)) -> [Dual; 3] {
    [0, 1, 2].map(|i| Dual { value: value[i], change: change[i] })
}

impl Tree {
    /// Coordinates `s` of the poses `q`: the strains of the tree's joints, what is locked left out.
    pub fn coordinates_at(&self, q: &[Pose], s: &mut [Pose]) {
        let ground = Pose::zeros();
        for (j, link) in self.links.iter().enumerate() {
            s[j] = match link.parent {
                Parent::Free => q[j],
                parent => {
                    let of = match parent {
                        Parent::Body(p) => &q[p as usize],
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
                Parent::Free => v[j],
                parent => {
                    let (of, moving) = match parent {
                        Parent::Body(p) => (&q[p as usize], &v[p as usize]),
                        _ => (&ground, &ground),
                    };
                    link.strain_rates((of, &q[j]), (moving, &v[j]))
                }
            };
        }
        self.project(s);
    }
}

impl Link {
    fn frame(&self) -> JointFrame {
        let (arm_a, arm_b) = if self.sign < 0.0 { (self.arm, self.arm_parent) } else { (self.arm_parent, self.arm) };
        JointFrame { arm_a, arm_b, axis: self.axis }
    }

    fn strains(&self, parent: &Pose, body: &Pose) -> Pose {
        let (a, b) = if self.sign < 0.0 { (body, parent) } else { (parent, body) };
        self.frame().kinematics(a, b, &self.second).strain
    }

    fn strain_rates(&self, (parent, body): (&Pose, &Pose), (moving, own): (&Pose, &Pose)) -> Pose {
        let (a, b, va, vb) = if self.sign < 0.0 { (body, parent, own, moving) } else { (parent, body, moving, own) };
        let rows = self.frame().kinematics(a, b, &self.second).rows();
        rows * nalgebra::Vector6::new(va.x, va.y, va.z, vb.x, vb.y, vb.z)
    }
}
