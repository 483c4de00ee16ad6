//! The directions of a reduced model, its forces over z, and their tangent.
//!
//! With V = J·Φ the motion of the bodies per unit of each direction, f the wrenches on the bodies, K_T the springs of the
//! tree's joints and G the stiffness that forces bring to them ([`geometric`]),
//! ```text
//! r = Φᵀ·(K_T·s − K_T·s₀ + Jᵀ·f)          ∂r/∂z = Φᵀ·(K_T + G)·Φ + Vᵀ·(∂f/∂x)·V
//! ```
//! Both follow from the sum over the tree of [`TreeKinematics::resist`]; no matrix over the coordinates is assembled.

use super::ReductionError;
use crate::equations::Joints;
use bimorph_domains::{Drive, System};
use bimorph_multibody::batch::{Kernel, LanePose, SimdReal, add_scaled, everywhere, load, store};
use bimorph_multibody::forces;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::directions::DirectionRows;
use bimorph_multibody::joint_coordinates::sprung_loops::dynamics::Stresses;
use bimorph_multibody::joint_coordinates::sprung_loops::geometric::{self, Geometric};
use bimorph_multibody::joint_coordinates::sprung_loops::poses::{LaneJointStates, TreeKinematics, place_of};
use bimorph_multibody::joint_coordinates::sprung_loops::{Tree, UnsupportedModel};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyId, BodyMatrix};
use nalgebra::DMatrix;
use std::sync::Arc;

/// A mechanism on its tree with the directions in which it moves. Immutable; shared by sessions.
#[derive(Debug, Clone)]
pub struct ReducedSpace {
    /// The system on its tree.
    pub joints: Arc<Joints>,
    /// Φ: a vector over the coordinates of the tree for each direction, orthonormal in the energy of the tangent at rest.
    pub directions: Vec<Vec<Pose>>,
    /// Largest |z_k| of each direction in training (√(N·m)).
    pub reach: Vec<f64>,
    /// Largest |z| in training, the root of twice the strain energy in the tangent at rest (√(N·m)).
    pub amplitude: f64,
    /// The same by rows of the coordinates, and by tiles of bodies.
    rows: DirectionRows,
    tiles: Vec<Vec<LanePose>>,
    /// Φᵀ·K_T·Φ, the energy of the tree's springs (1).
    tree_energy: DMatrix<f64>,
}

/// The system on a spanning tree, every joint as elastic as drawn; bodies may turn without inertia.
///
/// # Errors
/// [`ReductionError`] where joint coordinates cannot describe it.
pub fn spanned(system: &System) -> Result<Arc<Joints>, ReductionError> {
    let model = &system.model;
    if model.linear {
        return Err(UnsupportedModel::Linear.into());
    }
    if !system.anchors.is_empty() {
        return Err(UnsupportedModel::DrivenAnchor.into());
    }
    if !model.couplings.is_empty() {
        return Err(ReductionError::Coupled);
    }
    if system.turns() {
        return Err(ReductionError::Turning);
    }
    let tree = Tree::new(model, |_| [false; 3]);
    if let Some(joint) = tree.closures.iter().find(|joint| model.section(joint).locked != [false; 3]) {
        let name = |id| match id {
            BodyId::Free(k) => Some(model.bodies[k].name.to_string()),
            BodyId::Ground => None,
        };
        let (a, b) = joint.bodies();
        let body = name(a).or_else(|| name(b)).unwrap_or_default();
        return Err(UnsupportedModel::RigidLoop { body }.into());
    }
    Ok(Arc::new(Joints::new(system, tree)))
}

impl ReducedSpace {
    /// With directions Φ, the largest |z_k| of each and the largest |z|.
    pub fn new(joints: Arc<Joints>, directions: Vec<Vec<Pose>>, reach: Vec<f64>, amplitude: f64) -> Self {
        let links = &joints.tree.links;
        let stressed: Vec<Vec<Pose>> =
            directions.iter().map(|x| links.iter().zip(x).map(|(link, x)| link.stiffness * *x).collect()).collect();
        let m = directions.len();
        let tree_energy = DMatrix::from_fn(m, m, |k, l| dot(&directions[k], &stressed[l]));
        let rows = DirectionRows::of(&directions);
        let tiled = |x: &Vec<Pose>| LaneJointStates::at_rest(x).into_iter().map(|tile| tile.q).collect();
        let tiles = directions.iter().map(tiled).collect();
        Self { joints, directions, reach, amplitude, rows, tiles, tree_energy }
    }

    /// The same directions of a system with the same bodies and joints and other loads.
    #[must_use]
    pub fn of_system(&self, system: &System) -> Self {
        Self { joints: Arc::new(Joints::new(system, self.joints.tree.clone())), ..self.clone() }
    }

    /// The same space with directions turned: z = R·z′ with R orthogonal.
    #[must_use]
    pub fn turned(&self, rotation: &DMatrix<f64>) -> Self {
        let m = self.size();
        let sum = |k: usize| {
            let mut x = vec![Pose::zeros(); self.joints.tree.links.len()];
            self.strains(rotation.column(k).as_slice(), &mut x);
            x
        };
        let reach = |k: usize| (0..m).map(|i| rotation[(i, k)].abs() * self.reach[i]).sum();
        let (directions, reach) = ((0..m).map(sum).collect(), (0..m).map(reach).collect());
        Self::new(Arc::clone(&self.joints), directions, reach, self.amplitude)
    }

    /// Number of directions m.
    pub fn size(&self) -> usize {
        self.directions.len()
    }

    /// Φᵀ·K_T·Φ, the energy of the tree's springs (1).
    pub fn tree_energy(&self) -> &DMatrix<f64> {
        &self.tree_energy
    }

    /// Strains s = Φ·z.
    #[inline]
    pub fn strains(&self, z: &[f64], s: &mut [Pose]) {
        s.fill(Pose::zeros());
        for (direction, z) in self.directions.iter().zip(z) {
            for (s, x) in s.iter_mut().zip(direction) {
                *s += x * *z;
            }
        }
    }

    /// Strains, their rates and accelerations of a motion of z, by tiles of bodies.
    #[inline]
    pub(crate) fn place_strains(&self, motion: [&[f64]; 3], given: &mut [LaneJointStates]) {
        everywhere(PlaceReduced { tiles: &self.tiles, motion, given });
    }

    /// How far a state is beyond the trained ones: |z| over the largest in training (1).
    pub fn excess(&self, z: &[f64]) -> f64 {
        z.iter().map(|z| z * z).sum::<f64>().sqrt() / self.amplitude.max(f64::MIN_POSITIVE)
    }
}

/// Σ x·y over bodies.
#[inline]
pub(crate) fn dot(x: &[Pose], y: &[Pose]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x.dot(y)).sum()
}

/// Storage of an evaluation. Nothing is allocated after [`ReducedForces::new`].
#[derive(Debug, Clone)]
pub struct ReducedForces {
    /// Coordinates, rates and accelerations of the tree where the bodies are placed.
    pub(crate) given: Vec<LaneJointStates>,
    /// The bodies there.
    pub placed: TreeKinematics,
    /// V: motion of the bodies per unit of each direction, after [`ReducedForces::tangent`].
    pub(crate) moved: DirectionRows,
    /// Wrench on each body; then on its subtree.
    pub(crate) wrench: Vec<Pose>,
    stresses: Stresses,
    geometric: Vec<Geometric>,
    out: Vec<Four>,
    stiffness: BodyMatrix,
    /// Room for a form over the bodies times V.
    pub(crate) product: DirectionRows,
    of_geometry: DirectionRows,
}

impl ReducedForces {
    /// Storage for a space.
    pub fn new(space: &ReducedSpace) -> Self {
        let tree = &space.joints.tree;
        let count = tree.links.len();
        let zeros = vec![Pose::zeros(); count];
        let none = DirectionRows::zeros(count, space.size());
        Self {
            given: LaneJointStates::at_rest(&zeros),
            placed: TreeKinematics::new(tree),
            moved: none.clone(),
            wrench: zeros,
            stresses: Stresses::new(tree),
            geometric: vec![Geometric::ZERO; count],
            out: vec![Four::ZERO; count],
            stiffness: BodyMatrix::new(&tree.pattern),
            product: none.clone(),
            of_geometry: none,
        }
    }

    /// Places the bodies at z, its rate and its acceleration.
    #[inline]
    pub fn place(&mut self, space: &ReducedSpace, motion: [&[f64]; 3]) {
        space.place_strains(motion, &mut self.given);
        self.placed.place(&space.joints.tree, &self.given);
    }

    /// Places the bodies at rest at z.
    #[inline]
    pub fn place_at_rest(&mut self, space: &ReducedSpace, z: &[f64]) {
        self.place(space, [z, &[], &[]]);
    }

    /// `wrench +=` closures, gaps, contact and loads at the place of the bodies, held directions removed.
    #[inline]
    pub(crate) fn add_forces(&mut self, space: &ReducedSpace, drive: &Drive) {
        let Joints { closures, loops, .. } = &*space.joints;
        let poses = self.placed.at.as_slice();
        loops.add_forces(&self.placed, &drive.rest(), &mut self.wrench);
        closures.add_body_forces(poses, drive, &mut self.wrench);
        closures.model.project(&mut self.wrench);
    }

    /// The same with ∂f/∂x, which is kept for [`ReducedForces::stiffness`].
    #[inline]
    pub(crate) fn add_forces_and_tangent(&mut self, space: &ReducedSpace, drive: &Drive) {
        let closures = &space.joints.closures;
        closures.add_tangent(&self.placed.at, drive, &mut self.stiffness, &mut self.wrench);
    }

    /// The bodies where they are placed, and the wrenches on them.
    #[inline]
    pub(crate) fn placed_and_wrench(&mut self) -> (&TreeKinematics, &mut [Pose]) {
        (&self.placed, &mut self.wrench)
    }

    /// The wrenches become what inertia and drag take, at the motion of the bodies.
    #[inline]
    pub(crate) fn set_motion_forces(&mut self, space: &ReducedSpace) {
        let Joints { inertias, closures, .. } = &*space.joints;
        let placed = &self.placed;
        let moving = placed.acceleration.iter().zip(&placed.rate);
        for ((wrench, inertia), (push, speed)) in self.wrench.iter_mut().zip(inertias).zip(moving) {
            *wrench = inertia.force(push, speed);
        }
        if !closures.model.dampers.is_empty() {
            forces::add_dampers(&closures.model, |k| placed.rate[k], &mut self.wrench);
        }
    }

    /// The force r over z of the wrenches and of the tree's springs. The wrenches become sums over subtrees.
    #[inline]
    pub(crate) fn gather(&mut self, space: &ReducedSpace, drive: &Drive, r: &mut [f64]) {
        let tree = &space.joints.tree;
        self.stresses.fill(tree, &self.given, &drive.rest());
        self.placed.resist(tree, &self.stresses, &mut self.wrench, &mut self.out);
        space.rows.gather(&self.out, r);
    }

    /// The force r = ∂Π/∂z − load at rest at z.
    pub fn residual(&mut self, space: &ReducedSpace, z: &[f64], drive: &Drive, r: &mut [f64]) {
        self.place_at_rest(space, z);
        self.wrench.fill(Pose::zeros());
        self.add_forces(space, drive);
        self.gather(space, drive, r);
    }

    /// r and its exact tangent ∂r/∂z at rest at z; V is left in the storage.
    pub fn tangent(&mut self, space: &ReducedSpace, z: &[f64], drive: &Drive, r: &mut [f64], k: &mut DMatrix<f64>) {
        self.place_at_rest(space, z);
        self.wrench.fill(Pose::zeros());
        self.add_forces_and_tangent(space, drive);
        self.gather(space, drive, r);
        self.stiffness(space, k);
    }

    /// ∂r/∂z at the place of the bodies, after [`ReducedForces::gather`]; V is left in the storage.
    pub(crate) fn stiffness(&mut self, space: &ReducedSpace, k: &mut DMatrix<f64>) {
        let tree = &space.joints.tree;
        let given = &self.given;
        let at = |j: usize| {
            let (tile, lane) = place_of(j);
            given[tile].of(lane)[0]
        };
        geometric::fill(tree, &self.placed, at, &self.wrench, &mut self.geometric);
        self.moved.spread(tree, &self.placed, &space.rows);
        self.product.multiply(&tree.pattern, &self.stiffness, &self.moved);
        self.of_geometry.geometry(tree, &self.geometric, &space.rows, &self.moved, &mut self.product);
        k.copy_from(&space.tree_energy);
        self.moved.add_products(&self.product, k);
        space.rows.add_products(&self.of_geometry, k);
    }
}

/// Coordinates, rates and accelerations of the tree at those over z.
struct PlaceReduced<'a> {
    tiles: &'a [Vec<LanePose>],
    motion: [&'a [f64]; 3],
    given: &'a mut [LaneJointStates],
}

impl Kernel for PlaceReduced<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { tiles, motion: [z, v, w], given } = self;
        for (t, given) in given.iter_mut().enumerate() {
            for (values, to) in [(z, &mut given.q), (v, &mut given.v), (w, &mut given.z)] {
                let mut sum = [W::splat(simd, 0.0); DOF];
                for (direction, value) in tiles.iter().zip(values) {
                    add_scaled(&mut sum, &load::<W, DOF>(simd, &direction[t]), W::splat(simd, *value));
                }
                store(sum, to);
            }
        }
    }
}
