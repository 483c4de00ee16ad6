//! The immutable model: bodies in elimination order, joints, dampers; and the state that a snapshot holds.

use super::order::elimination_order;
use super::pattern::Pattern;
use super::planar::{Block, JointFrame, Pose};
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A body of the model, or ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BodyId {
    /// Immovable.
    Ground,
    /// The body eliminated as the k-th.
    Free(usize),
}

/// A rigid body. Coordinates are those of its centre of mass, so that the mass matrix is constant and diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name for messages: the node or the beam segment it stands for.
    pub name: String,
    /// Centre of mass as drawn [m].
    pub center: Vector2<f64>,
    /// Mass [kg]; 0 for a body that only joints hold.
    pub mass: f64,
    /// Moment of inertia about the centre of mass [kg·m²].
    pub inertia: f64,
    /// Gas damping about the drawn place: force = −drag · rate, symmetric [N·s/m, N·s, N·m·s].
    pub drag: Block,
    /// Projector onto the directions that supports leave free; none: all.
    pub free: Option<Block>,
}

/// A flexible joint between two bodies, with three directions: axial, shear, rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// First body.
    pub a: BodyId,
    /// Second body.
    pub b: BodyId,
    /// Where it sits.
    pub frame: JointFrame,
    /// Stress (N, V, M) per strain (u, g, p) [N/m, N/rad, N·m/rad]; symmetric.
    pub stiffness: Matrix3<f64>,
    /// Second-order axial strain Q on (g, p); see [`super::planar`].
    pub second: Matrix2<f64>,
    /// Which entry of the strain vector sets its axial rest offset, and the length it acts on [m].
    pub expansion: Option<(usize, f64)>,
    /// Axial rest offset that does not change [m] (residual stress, prescribed temperature).
    pub rest: f64,
}

/// A linear damper between two bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Damper {
    /// First body.
    pub a: BodyId,
    /// Second body.
    pub b: BodyId,
    /// Where it sits.
    pub frame: JointFrame,
    /// Force per rate of the strains (u, g, p), about the drawn place [N·s/m, N·s/m, N·m·s/rad].
    pub coefficients: Vector3<f64>,
}

impl Damper {
    /// Force on the pair's six coordinates per rate: symmetric and constant.
    fn matrix(&self) -> Matrix6<f64> {
        let rest = Pose::zeros();
        let rows = self.frame.kinematics(&rest, &rest, &Matrix2::zeros()).rows;
        rows.transpose() * Matrix3::from_diagonal(&self.coefficients) * rows
    }
}

/// Where the couplings of a pair of bodies lie in the tangent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    a: usize,
    b: usize,
    block: usize,
}

const NONE: usize = usize::MAX;

impl Place {
    /// Adds a 6×6 pair block (a then b) to `matrix`, in the parts that belong to free bodies.
    #[inline]
    pub(crate) fn add(self, matrix: &mut super::BlockMatrix<f64, 3>, h: &Matrix6<f64>) {
        if self.a != NONE {
            matrix.diagonal[self.a] += h.fixed_view::<3, 3>(0, 0);
        }
        if self.b != NONE {
            matrix.diagonal[self.b] += h.fixed_view::<3, 3>(3, 3);
        }
        if self.block != NONE {
            // the block's row is the body eliminated later
            if self.a > self.b {
                matrix.below[self.block] += h.fixed_view::<3, 3>(0, 3);
            } else {
                matrix.below[self.block] += h.fixed_view::<3, 3>(3, 0);
            }
        }
    }
}

/// Bodies, joints and their elimination order. Never changed after [`Model::new`]; share it in an `Arc`.
#[derive(Debug, Clone)]
pub struct Model {
    /// Bodies in elimination order.
    pub bodies: Vec<Body>,
    /// Joints, along the elimination order of their earlier body.
    pub joints: Vec<Joint>,
    /// Dampers.
    pub dampers: Vec<Damper>,
    /// Pattern of the tangent.
    pub pattern: Pattern,
    /// Small displacements about the drawn geometry.
    pub linear: bool,
    pub(crate) joint_place: Vec<Place>,
    pub(crate) damper_place: Vec<Place>,
    pub(crate) damper_matrix: Vec<Matrix6<f64>>,
}

/// What a snapshot of a motion holds: displacement and rate of every body, in elimination order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Displacements (x [m], y [m], θ [rad]).
    pub q: Vec<Pose>,
    /// Rates.
    pub v: Vec<Pose>,
}

impl State {
    /// At rest, as drawn.
    pub fn rest(bodies: usize) -> Self {
        Self { q: vec![Pose::zeros(); bodies], v: vec![Pose::zeros(); bodies] }
    }
}

impl Model {
    /// Lays a model out in elimination order. `bodies` come in any order; `Free(k)` in joints, dampers and `couplings`
    /// (further pairs that forces will couple) means `bodies[k]`. Also returns where each given body went.
    pub fn new(
        bodies: Vec<Body>,
        mut joints: Vec<Joint>,
        mut dampers: Vec<Damper>,
        couplings: &[(BodyId, BodyId)],
        linear: bool,
    ) -> (Self, Vec<usize>) {
        let pairs = joints.iter().map(|j| (j.a, j.b)).chain(dampers.iter().map(|d| (d.a, d.b)));
        let edges: Vec<(usize, usize)> = pairs
            .chain(couplings.iter().copied())
            .filter_map(|pair| match pair {
                (BodyId::Free(a), BodyId::Free(b)) => Some((a, b)),
                _ => None,
            })
            .collect();
        let order = elimination_order(bodies.len(), &edges);
        let mut place = vec![0; bodies.len()];
        for (k, &body) in order.iter().enumerate() {
            place[body] = k;
        }
        let moved = |id: BodyId| match id {
            BodyId::Ground => BodyId::Ground,
            BodyId::Free(k) => BodyId::Free(place[k]),
        };
        for j in &mut joints {
            (j.a, j.b) = (moved(j.a), moved(j.b));
        }
        for d in &mut dampers {
            (d.a, d.b) = (moved(d.a), moved(d.b));
        }
        joints.sort_by_key(|j| (j.a.min_free(j.b), j.a.max_free(j.b)));
        let edges: Vec<(usize, usize)> = edges.iter().map(|&(a, b)| (place[a], place[b])).collect();
        let pattern = Pattern::new(bodies.len(), &edges);
        let mut slots: Vec<Option<Body>> = bodies.into_iter().map(Some).collect();
        let bodies = order.iter().filter_map(|&k| slots[k].take()).collect();
        let joint_place = joints.iter().map(|j| locate(&pattern, j.a, j.b)).collect();
        let damper_place = dampers.iter().map(|d| locate(&pattern, d.a, d.b)).collect();
        let damper_matrix = dampers.iter().map(Damper::matrix).collect();
        let model = Self { bodies, joints, dampers, pattern, linear, joint_place, damper_place, damper_matrix };
        (model, place)
    }

    /// Mechanical unknowns: three per body, less the directions that supports hold.
    pub fn unknowns(&self) -> usize {
        self.bodies.iter().map(|b| b.free.map_or(3.0, |p| p.trace()).round() as usize).sum()
    }

    /// True when joints connect a body to ground.
    pub fn grounded(&self, body: usize) -> bool {
        let mut reached = vec![false; self.bodies.len()];
        let mut stack = vec![body];
        reached[body] = true;
        let touching = |k: usize| self.joints.iter().filter(move |j| j.a == BodyId::Free(k) || j.b == BodyId::Free(k));
        while let Some(k) = stack.pop() {
            for joint in touching(k) {
                for end in [joint.a, joint.b] {
                    match end {
                        BodyId::Ground => return true,
                        BodyId::Free(next) if !reached[next] => {
                            reached[next] = true;
                            stack.push(next);
                        }
                        BodyId::Free(_) => {}
                    }
                }
            }
        }
        false
    }

    /// Where a pair's blocks lie.
    pub(crate) fn place(&self, a: BodyId, b: BodyId) -> Place {
        locate(&self.pattern, a, b)
    }

    /// The mass matrix' diagonal of one body.
    #[inline]
    pub fn mass(&self, body: usize) -> Pose {
        let b = &self.bodies[body];
        Pose::new(b.mass, b.mass, b.inertia)
    }

    /// Removes the held directions from a vector.
    pub fn project(&self, x: &mut [Pose]) {
        for (body, x) in self.bodies.iter().zip(x) {
            if let Some(p) = &body.free {
                *x = p * *x;
            }
        }
    }

    /// Removes the held directions from a matrix and gives them the pivot 1, so that solutions have no share in them.
    pub fn project_matrix<T: super::Scalar>(&self, matrix: &mut super::BlockMatrix<T, 3>) {
        for (j, body) in self.bodies.iter().enumerate() {
            if let Some(p) = &body.free {
                let p: Matrix3<T> = p.map(T::from_real);
                matrix.diagonal[j] = p * matrix.diagonal[j] * p + (Matrix3::identity() - p);
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

impl BodyId {
    fn min_free(self, other: Self) -> usize {
        match (self, other) {
            (Self::Free(a), Self::Free(b)) => a.min(b),
            (Self::Free(a), Self::Ground) | (Self::Ground, Self::Free(a)) => a,
            (Self::Ground, Self::Ground) => NONE,
        }
    }

    fn max_free(self, other: Self) -> usize {
        match (self, other) {
            (Self::Free(a), Self::Free(b)) => a.max(b),
            _ => NONE,
        }
    }
}

fn locate(pattern: &Pattern, a: BodyId, b: BodyId) -> Place {
    let index = |id| match id {
        BodyId::Ground => NONE,
        BodyId::Free(k) => k,
    };
    let (a, b) = (index(a), index(b));
    let block = if a == NONE || b == NONE || a == b { NONE } else { pattern.block(a.max(b), a.min(b)).unwrap_or(NONE) };
    Place { a, b, block }
}
