//! The immutable model: bodies in elimination order, joints, dampers; and the state that a snapshot holds.

use super::BodyMatrix;
use super::body::Body;
use super::factor::{HELD, PivotSigns, ZeroPivot};
use super::joint::{BodyId, Coupling, Damper, Joint};
use super::layout::EliminationLayout;
use super::pattern::Pattern;
use super::planar::{Block, Pose, Symmetric};
use super::section::{JointSection, NONE, PackedJoint, PairSlot, Sections};
use bimorph_base::sets::Sets;
use nalgebra::{Matrix3, Matrix6, Vector2};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Bodies, joints and their elimination order. Never changed after [`Model::new`]; share it in an `Arc`.
#[derive(Debug, Clone)]
pub struct Model {
    /// Bodies in elimination order.
    pub bodies: Vec<Body>,
    /// Joints, along the elimination order of their earlier body.
    pub joints: Vec<PackedJoint>,
    /// Properties shared by joints.
    pub sections: Vec<JointSection>,
    /// Couplings of joints, see [`Model::couple`].
    pub couplings: Vec<Coupling>,
    /// Dampers.
    pub dampers: Vec<Damper>,
    /// Pattern of the tangent.
    pub pattern: Arc<Pattern>,
    /// Small displacements about the drawn geometry.
    pub linear: bool,
    /// Bodies with a projector.
    held: Vec<u32>,
    /// The bodies of each part that no joint connects to ground and no support holds.
    loose: Vec<Vec<u32>>,
    pub(crate) damper_place: Vec<PairSlot>,
    /// Force per rate of each damper, over the bodies (a, b).
    pub damper_matrix: Vec<Matrix6<f64>>,
}

/// State in a snapshot of a motion: displacement and rate of every body, in elimination order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Displacements (x (m), y (m), θ (rad)).
    pub q: Vec<Pose>,
    /// Rates.
    pub v: Vec<Pose>,
}

impl State {
    /// At rest, as drawn.
    #[inline]
    pub fn rest(bodies: usize) -> Self {
        Self { q: vec![Pose::zeros(); bodies], v: vec![Pose::zeros(); bodies] }
    }
}

/// Where the bodies and joints that a model is made of went.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelOrder {
    /// Place of each body in the elimination order.
    pub bodies: Vec<usize>,
    /// Place of each joint among [`Model::joints`].
    pub joints: Vec<u32>,
}

impl Model {
    /// Builds a model in elimination order. `bodies` come in any order; `Free(k)` in joints, dampers and `couplings`
    /// (further pairs that forces will couple) means `bodies[k]`. Also returns where each given body went.
    pub fn new(
        bodies: Vec<Body>,
        joints: Vec<Joint>,
        dampers: Vec<Damper>,
        couplings: &[(BodyId, BodyId)],
        linear: bool,
    ) -> (Self, Vec<usize>) {
        let (model, ModelOrder { bodies, .. }) = Self::ordered(bodies, joints, dampers, couplings, linear);
        (model, bodies)
    }

    /// The same, with the order of the joints too.
    pub fn ordered(
        bodies: Vec<Body>,
        joints: Vec<Joint>,
        mut dampers: Vec<Damper>,
        couplings: &[(BodyId, BodyId)],
        linear: bool,
    ) -> (Self, ModelOrder) {
        let pairs = joints.iter().map(|j| (j.a, j.b)).chain(dampers.iter().map(|d| (d.a, d.b)));
        let mut edges: Vec<(usize, usize)> = Vec::with_capacity(joints.len() + dampers.len() + couplings.len());
        edges.extend(pairs.chain(couplings.iter().copied()).filter_map(|pair| match pair {
            (BodyId::Free(a), BodyId::Free(b)) => Some((a, b)),
            _ => None,
        }));
        let grounded: Vec<usize> = (joints.iter().map(|j| (j.a, j.b)))
            .filter_map(|pair| match pair {
                (BodyId::Free(k), BodyId::Ground) | (BodyId::Ground, BodyId::Free(k)) => Some(k),
                _ => None,
            })
            .collect();
        let layout = EliminationLayout::of(bodies.len(), edges, grounded);
        let EliminationLayout { order, place, pattern, .. } = &*layout;
        let moved = |id: BodyId| match id {
            BodyId::Ground => BodyId::Ground,
            BodyId::Free(k) => BodyId::Free(place[k]),
        };
        for d in &mut dampers {
            (d.a, d.b) = (moved(d.a), moved(d.b));
        }
        let mut sections = Sections::new(joints.len());
        let given: Vec<PackedJoint> =
            joints.iter().map(|j| sections.lay(j, locate(pattern, moved(j.a), moved(j.b)))).collect();
        drop(joints);
        let mut sorted: Vec<((u32, u32), u32)> = given.iter().map(|j| j.place.order()).zip(0..).collect();
        sorted.sort_unstable();
        let laid: Vec<PackedJoint> = sorted.iter().map(|(_, k)| given[*k as usize]).collect();
        let mut slots: Vec<Option<Body>> = bodies.into_iter().map(Some).collect();
        let mut bodies = Vec::with_capacity(order.len());
        bodies.extend(order.iter().filter_map(|&k| slots[k].take()));
        let damper_place = dampers.iter().map(|d| locate(pattern, d.a, d.b)).collect();
        let damper_matrix = dampers.iter().map(Damper::matrix).collect();
        let sections = sections.all;
        let held = (0..).zip(&bodies).filter(|(_, b)| b.free.is_some()).map(|(k, _)| k).collect();
        let couplings = Vec::new();
        let loose = loose_parts(&bodies, &laid);
        let model = Self {
            bodies,
            joints: laid,
            sections,
            couplings,
            dampers,
            pattern: Arc::clone(pattern),
            linear,
            held,
            loose,
            damper_place,
            damper_matrix,
        };
        let mut joint_place = vec![0; model.joints.len()];
        (0..).zip(&sorted).for_each(|(at, (_, k))| joint_place[*k as usize] = at);
        (model, ModelOrder { bodies: place.clone(), joints: joint_place })
    }

    /// Couples joints, bodies numbered in elimination order. Their [`Coupling::pairs`] must have been among the couplings
    /// given to [`Model::new`].
    #[must_use]
    #[inline]
    pub fn couple(mut self, couplings: Vec<Coupling>) -> Self {
        self.couplings = couplings;
        self
    }

    /// Mechanical unknowns: three per body, less the directions that supports hold.
    #[inline]
    pub fn unknowns(&self) -> usize {
        self.bodies.iter().map(|b| b.free.as_ref().map_or(3.0, |p| p.trace()).round() as usize).sum()
    }

    /// True when joints connect a body to ground.
    #[inline]
    pub fn grounded(&self, body: usize) -> bool {
        // joints in any order join sets of bodies; ground is one more
        let ground = self.bodies.len();
        let mut joined = Sets::new(ground + 1);
        let index = |id: u32| if id == NONE { ground } else { id as usize };
        for joint in &self.joints {
            joined.join(index(joint.place.a), index(joint.place.b));
        }
        joined.together(body, ground)
    }

    /// The last body of each part that no joint connects to ground and no support holds, ascending.
    #[inline]
    pub fn loose(&self) -> impl Iterator<Item = usize> {
        self.loose.iter().filter_map(|part| part.last()).map(|&k| k as usize)
    }

    /// The bodies of each part that no joint connects to ground and no support holds, ascending.
    #[inline]
    pub fn loose_parts(&self) -> &[Vec<u32>] {
        &self.loose
    }

    /// The same model with a spring to ground at the centre of each of these bodies, of a stiffness for displacements (N/m) and one for
    /// rotations (N·m/rad). These joints stand after all others.
    #[must_use]
    pub fn with_springs_to_ground(&self, bodies: &[usize], [moves, turns]: [f64; 2]) -> Self {
        let mut model = self.clone();
        let section = model.sections.len() as u32;
        model.sections.push(JointSection {
            axis: Vector2::x(),
            stiffness: Symmetric([moves, 0.0, 0.0, moves, 0.0, turns]),
            second: [0.0; 3],
            expansion: None,
            locked: [false; 3],
        });
        let spring = |&body: &usize| {
            let place = PairSlot { a: NONE, b: body as u32, block: NONE };
            PackedJoint::at_center(place, section)
        };
        model.joints.extend(bodies.iter().map(spring));
        model
    }

    /// [`BodyMatrix::factor_holding`] of a stiffness whose held directions are projected: the last body of each loose part is held, too.
    ///
    /// # Errors
    /// [`ZeroPivot`].
    pub fn factor_holding(
        &self,
        stiffness: &mut BodyMatrix,
        held: &mut Vec<ZeroPivot>,
    ) -> Result<PivotSigns, ZeroPivot> {
        for body in self.loose() {
            let block = &mut stiffness.diagonal[body];
            let own = block.diagonal();
            block.set_diagonal(&(own * (1.0 + HELD)));
        }
        let inertia = stiffness.factor_holding(&self.pattern, held)?;
        held.extend(self.loose().flat_map(|body| (0..3).map(move |direction| ZeroPivot { body, direction })));
        Ok(inertia)
    }

    /// The properties that a joint shares with others.
    #[inline]
    pub fn section(&self, joint: &PackedJoint) -> &JointSection {
        &self.sections[joint.section()]
    }

    /// Joint `k` as it was given, its bodies numbered in elimination order.
    #[inline]
    pub fn joint(&self, k: usize) -> Joint {
        self.joints[k].whole(self.section(&self.joints[k]))
    }

    /// The mass matrix' diagonal of one body.
    #[inline]
    pub fn mass(&self, body: usize) -> Pose {
        self.bodies[body].mass_diagonal()
    }

    /// xᵀMy.
    #[inline]
    pub fn mass_product(&self, x: &[Pose], y: &[Pose]) -> f64 {
        x.iter().zip(y).enumerate().map(|(j, (x, y))| x.dot(&self.mass(j).component_mul(y))).sum()
    }

    /// Bodies with held directions, ascending, and the projectors onto the free ones.
    #[inline]
    pub fn held(&self) -> impl Iterator<Item = (usize, &Block)> {
        self.held.iter().filter_map(|&k| Some((k as usize, self.bodies[k as usize].free.as_deref()?)))
    }

    /// Removes the held directions from a vector.
    #[inline]
    pub fn project(&self, x: &mut [Pose]) {
        for (k, free) in self.held() {
            x[k] = free * x[k];
        }
    }

    /// Removes the held directions from a matrix and gives them pivots, so that solutions have no part in them.
    pub fn project_matrix<T: super::Scalar>(&self, matrix: &mut BodyMatrix<T>) {
        if self.held.is_empty() {
            return;
        }
        for (j, body) in self.bodies.iter().enumerate() {
            if let Some(p) = &body.free {
                matrix.diagonal[j] = projected(p, &matrix.diagonal[j]);
                let p: Matrix3<T> = p.map(T::from_real);
                for k in self.pattern.column(j) {
                    matrix.below[k] *= p;
                }
            }
            for k in self.pattern.column(j) {
                if let Some(p) = &self.bodies[self.pattern.row(k)].free {
                    matrix.below[k] = p.map(T::from_real) * matrix.below[k];
                }
            }
        }
    }

    /// Pose of a body; zero for ground.
    #[inline]
    pub fn pose(q: &[Pose], id: BodyId) -> Pose {
        match id {
            BodyId::Ground => Pose::zeros(),
            BodyId::Free(k) => q[k],
        }
    }
}

/// Least pivot of a translation that is held (N/m): where the body's own stiffness passes through 0, as at a fold, its pivot does not.
pub(super) const MIN_HELD: f64 = 1.0;

/// P·A·P with pivots in what the projector P takes away: 1 for a rotation. A translation that is held at an angle mixes with the one that is free, so its
/// pivot is of the size of both: beside a contact of 10¹³ N/m a pivot of 1 would be rounding.
pub(super) fn projected<T: super::Scalar>(p: &Matrix3<f64>, a: &Matrix3<T>) -> Matrix3<T> {
    let lifted: Matrix3<T> = p.map(T::from_real);
    let block = lifted * a * lifted;
    let size = a[(0, 0)].modulus() + a[(1, 1)].modulus() + MIN_HELD;
    let mut held = Matrix3::identity() - p;
    held.fixed_view_mut::<2, 2>(0, 0).apply(|x| *x *= size);
    block + held.map(T::from_real)
}

/// See [`Model::loose_parts`].
fn loose_parts(bodies: &[Body], joints: &[PackedJoint]) -> Vec<Vec<u32>> {
    let ground = bodies.len();
    let mut joined = Sets::new(ground + 1);
    let index = |id: u32| if id == NONE { ground } else { id as usize };
    for joint in joints {
        joined.join(index(joint.place.a), index(joint.place.b));
    }
    for (k, body) in bodies.iter().enumerate() {
        if body.free.is_some() {
            joined.join(k, ground);
        }
    }
    let mut parts: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for k in 0..ground {
        if !joined.together(k, ground) {
            parts.entry(joined.first(k)).or_default().push(k as u32);
        }
    }
    let mut loose: Vec<Vec<u32>> = parts.into_values().collect();
    loose.sort_unstable_by_key(|part| part.last().copied());
    loose
}

/// Where a pair's blocks lie on a pattern.
#[inline]
pub fn locate(pattern: &Pattern, a: BodyId, b: BodyId) -> PairSlot {
    let index = |id| match id {
        BodyId::Ground => NONE,
        BodyId::Free(k) => k as u32,
    };
    let block = match (a, b) {
        (BodyId::Free(a), BodyId::Free(b)) if a != b => pattern.block(a.max(b), a.min(b)).map_or(NONE, |k| k as u32),
        _ => NONE,
    };
    PairSlot { a: index(a), b: index(b), block }
}
