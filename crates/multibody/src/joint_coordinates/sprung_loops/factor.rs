//! Factorization of a symmetric form over joint coordinates, leaf → root, and solves with it: no matrix over the coordinates
//! is ever assembled.
//!
//! The form is given in two parts: blocks over the bodies' own motions (inertia, closures, gaps, damping) on the pattern of
//! the graph, and one block a joint over its coordinates. Body j moves as V_j = X·V_p + S·s, with p its parent. When its turn
//! comes, D is its block and B_r its coupling to each later body r of its column (p among them); substituting V_j leaves
//! ```text
//! H = Sᵀ·D·S + K_j        C_r = B_r·S      C_p += Xᵀ·D·S            over its own coordinates s
//! A_pp += XᵀDX + B_p·X + XᵀB_pᵀ            A_rp += B_r·X            what the parent takes over
//! A_rt −= C_r·H⁻¹·C_tᵀ                                             elimination of s
//! ```
//! The first line is the articulated-body inertia of an open branch; the couplings are what a loop keeps alive until the
//! bodies that it joins have had their turn. Every block exists in the pattern of elimination in absolute coordinates, since
//! the rows of a column are coupled pair by pair. A fixed amount of work for each body and each closure: O(n + m).
//!
//! Reference: R. Featherstone, "The calculation of robot dynamics using articulated-body inertias", Int. J. Robotics Research
//! 2 (1983), for the branch; K. S. Anderson, J. H. Critchley (2003) for loops inside the recursion.

use super::columns::{ColumnBlock, Four, in_fours};
use super::geometric::Geometric;
use super::kinematics::MotionMap;
use super::poses::TreeKinematics;
use super::solve::{Factors, both_motions};
use super::tree::{Tree, TreeJoint};
use crate::factor::{PivotSigns, ZeroPivot};
use crate::joint_coordinates::TreeParent;
use crate::planar::Pose;
use crate::{BodyMatrix, Pattern};
use pulp::{Simd, WithSimd};

/// A pivot smaller than this fraction of what it came from is taken for zero.
const LOST: f64 = 1e-13;

/// A form over joint coordinates, and its factors.
#[derive(Debug, Clone)]
pub struct JointMatrix {
    /// Blocks over the bodies' motions.
    pub bodies: BodyMatrix,
    /// The same in the course of the elimination.
    diagonal: Vec<ColumnBlock>,
    below: Vec<ColumnBlock>,
    /// The factors.
    pub(super) factors: Factors,
    /// C_r of the column at hand.
    column: Vec<ColumnBlock>,
    /// For each block of a column, the block that takes over its motion with the column's parent; [`OWN`] where the row is
    /// the parent itself.
    heir: Vec<u32>,
    pub(super) maps: Vec<MotionMap<f64>>,
}

/// The parent's own diagonal.
const OWN: u32 = u32::MAX;

impl JointMatrix {
    /// Storage.
    #[inline]
    pub fn new(tree: &Tree) -> Self {
        let pattern = &tree.pattern;
        let count = pattern.bodies();
        Self {
            bodies: BodyMatrix::new(pattern),
            diagonal: vec![ColumnBlock::ZERO; count],
            below: vec![ColumnBlock::ZERO; pattern.off_blocks()],
            factors: Factors::new(tree),
            column: Vec::with_capacity((0..count).map(|j| pattern.column(j).len()).max().unwrap_or(0)),
            heir: heirs(tree),
            maps: vec![MotionMap::REST; count],
        }
    }

    /// Factors the form of [`JointMatrix::bodies`] and the joints' blocks `scale`·K (+ `geometric`) where the bodies are
    /// `placed`.
    ///
    /// # Errors
    /// [`ZeroPivot`].
    #[inline]
    pub fn factor(
        &mut self,
        tree: &Tree,
        placed: &TreeKinematics,
        scale: f64,
        geometric: Option<&[Geometric]>,
    ) -> Result<PivotSigns, ZeroPivot> {
        for (j, map) in self.maps.iter_mut().enumerate() {
            *map = placed.map(j);
        }
        in_fours(Eliminate { matrix: self, tree, scale, geometric })
    }

    #[inline(always)]
    fn eliminate<S: Simd>(
        &mut self,
        simd: S,
        tree: &Tree,
        scale: f64,
        geometric: Option<&[Geometric]>,
    ) -> Result<PivotSigns, ZeroPivot> {
        let pattern = &tree.pattern;
        let mut inertia = PivotSigns::default();
        let from = self.bodies.diagonal.iter().chain(&self.bodies.below);
        for (to, from) in self.diagonal.iter_mut().chain(&mut self.below).zip(from) {
            *to = ColumnBlock::of(from);
        }
        for (j, link) in tree.links.iter().enumerate() {
            let map = self.maps[j];
            let block = self.diagonal[j];
            let extra = geometric.map(|g| &g[j]);
            let along = ColumnBlock::motions(&map, link);
            let share = along.transposed();
            let ds = block.product(simd, &along);
            let own = share.product(simd, &ds).plus(simd, &joint_block(simd, link, scale, extra));
            let size = block.0[0].0[0].abs() + block.0[1].0[1].abs();
            let inverse = invert(simd, (own, size), link, &mut inertia, j)?;
            self.factors.keep(j, (&along, &share), &inverse);
            let parent = match link.parent {
                TreeParent::Body(p) => Some(p as usize),
                _ => None,
            };
            let handed = parent.map(|p| self.hand_over(simd, pattern, (j, p), &block, &map, extra));
            let mut target = pattern.targets(j).iter();
            self.column.clear();
            for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
                let row = row as usize;
                let is_parent = parent == Some(row);
                let below = &self.below[k];
                let (mut c, mut to) = (ColumnBlock::ZERO, self.diagonal[row]);
                if is_parent {
                    to = to.plus(simd, handed.as_ref().unwrap_or(&ColumnBlock::ZERO));
                    c = ColumnBlock::passing(&map).product(simd, &ds);
                    if let Some(g) = extra {
                        for (column, cross) in c.0.iter_mut().zip(g.cross) {
                            column.0[2] += cross;
                        }
                    }
                }
                // along a tree nothing but the joint itself couples the two
                if !is_parent || !below.is_zero() {
                    c = c.plus(simd, &below.product(simd, &along));
                }
                let scaled = c.product(simd, &inverse);
                for (other, &at) in self.column.iter().zip(target.by_ref()) {
                    let to = &mut self.below[at as usize];
                    *to = to.less(simd, &scaled.across(simd, other));
                }
                self.diagonal[row] = to.less(simd, &scaled.across(simd, &c));
                self.factors.keep_coupling(simd, (j, k, is_parent), &map, &scaled);
                self.column.push(c);
            }
        }
        Ok(inertia)
    }

    /// Solves: `x` holds the right side over the coordinates and becomes the solution. `wrench` holds a right side over
    /// the bodies' motions (or zeros), and becomes the bodies' motions; it has one entry more than there are bodies.
    #[inline]
    pub fn solve(&self, wrench: &mut [Four], x: &mut [Four]) {
        self.factors.solve(wrench, x);
    }

    /// Motions of the bodies with two motions of the coordinates, at the configuration of the factor.
    #[inline]
    pub fn both_motions(&self, tree: &Tree, of: (&[Pose], &[Pose]), to: (&mut [Pose], &mut [Pose])) {
        both_motions(tree, &self.maps, of, to);
    }

    /// The part that moves with the parent: the body's own block, which is returned, and its couplings to other bodies.
    #[inline(always)]
    fn hand_over<S: Simd>(
        &mut self,
        simd: S,
        pattern: &Pattern,
        (j, p): (usize, usize),
        block: &ColumnBlock,
        map: &MotionMap<f64>,
        extra: Option<&Geometric>,
    ) -> ColumnBlock {
        let mut own = ColumnBlock::passing(map).product(simd, &block.shifted(simd, map));
        for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
            let below = &self.below[k];
            if below.is_zero() {
                continue;
            }
            let moved = below.shifted(simd, map);
            match self.heir[k] {
                OWN => own = own.plus(simd, &moved).plus(simd, &moved.transposed()),
                at => {
                    let to = &mut self.below[at as usize];
                    *to = to.plus(simd, &if row as usize > p { moved } else { moved.transposed() });
                }
            }
        }
        if let Some(g) = extra {
            own.0[2].0[2] += g.turn;
        }
        own
    }
}

/// The elimination, in the widest instructions of the processor at hand.
pub(super) struct Eliminate<'a> {
    pub(super) matrix: &'a mut JointMatrix,
    pub(super) tree: &'a Tree,
    pub(super) scale: f64,
    pub(super) geometric: Option<&'a [Geometric]>,
}

impl WithSimd for Eliminate<'_> {
    type Output = Result<PivotSigns, ZeroPivot>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        self.matrix.eliminate(simd, self.tree, self.scale, self.geometric)
    }
}

/// See [`JointMatrix::heir`].
fn heirs(tree: &Tree) -> Vec<u32> {
    let pattern = &tree.pattern;
    let mut heirs = vec![OWN; pattern.off_blocks()];
    for (j, link) in tree.links.iter().enumerate() {
        let TreeParent::Body(p) = link.parent else { continue };
        let p = p as usize;
        for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
            let row = row as usize;
            if row != p {
                // rows of one column are coupled pair by pair
                heirs[k] = pattern.block(row.max(p), row.min(p)).map_or(OWN, |at| at as u32);
            }
        }
    }
    heirs
}

/// The joint's own block: springs and what its force brings.
#[inline(always)]
fn joint_block<S: Simd>(simd: S, link: &TreeJoint, scale: f64, extra: Option<&Geometric>) -> ColumnBlock {
    let [uu, ug, up, gg, gp, pp] = link.stiffness.0;
    let own = ColumnBlock([Four([uu, ug, up, 0.0]), Four([ug, gg, gp, 0.0]), Four([up, gp, pp, 0.0])]);
    let own = own.scaled(simd, scale);
    extra.map_or(own, |g| own.plus(simd, &ColumnBlock::of(&g.own)))
}

/// The inverse of a symmetric block over what moves, and the signs of its pivots. `size` is that of the body's own block before what a
/// guide holds was taken out of it: of a body that is held in every direction nothing is left but rounding.
#[inline(always)]
fn invert<S: Simd>(
    simd: S,
    (mut a, size): (ColumnBlock, f64),
    link: &TreeJoint,
    inertia: &mut PivotSigns,
    body: usize,
) -> Result<ColumnBlock, ZeroPivot> {
    if link.free.is_none() && link.moving == [true; 3] {
        return inverse(&a, inertia, body);
    }
    // what does not move has a pivot of its own, and no inverse; a guide at an angle mixes it with what moves, so it is of that size
    let (still, size) = match &link.free {
        Some(free) => (ColumnBlock::IDENTITY.less(simd, &ColumnBlock::of(free)), if size > 0.0 { size } else { 1.0 }),
        None => {
            let held = |i: usize| if link.moving[i] { 0.0 } else { 1.0 };
            let still =
                [Four([held(0), 0.0, 0.0, 0.0]), Four([0.0, held(1), 0.0, 0.0]), Four([0.0, 0.0, held(2), 0.0])];
            (ColumnBlock(still), 1.0)
        }
    };
    a = a.plus(simd, &still.scaled(simd, size));
    Ok(inverse(&a, inertia, body)?.less(simd, &still.scaled(simd, 1.0 / size)))
}

/// The inverse of a symmetric block by its L·D·Lᵀ without exchanges, and the signs of its pivots.
#[inline(always)]
fn inverse(a: &ColumnBlock, inertia: &mut PivotSigns, body: usize) -> Result<ColumnBlock, ZeroPivot> {
    let mut pivot = |d: f64, direction: usize, from: f64| {
        if d.abs() <= LOST * from.abs() || !d.is_finite() {
            return Err(ZeroPivot { body, direction });
        }
        if d < 0.0 {
            inertia.negative += 1;
        }
        Ok(1.0 / d)
    };
    let [[a00, a10, a20, _], [_, a11, a21, _], [_, _, a22, _]] = a.0.map(|column| column.0);
    let r0 = pivot(a00, 0, a00)?;
    let (l10, l20) = (a10 * r0, a20 * r0);
    let r1 = pivot(a11 - l10 * a10, 1, a11)?;
    let c21 = a21 - l20 * a10;
    let l21 = c21 * r1;
    let r2 = pivot(a22 - l20 * a20 - l21 * c21, 2, a22)?;
    // L⁻ᵀ·D⁻¹·L⁻¹ with L⁻¹ = [1; −l10 1; m −l21 1]
    let m = l10 * l21 - l20;
    let (i22, i21, i20) = (r2, -l21 * r2, m * r2);
    let i11 = r1 - l21 * i21;
    let i10 = -l10 * r1 - l21 * i20;
    let i00 = r0 + l10 * l10 * r1 + m * i20;
    Ok(ColumnBlock([Four([i00, i10, i20, 0.0]), Four([i10, i11, i21, 0.0]), Four([i20, i21, i22, 0.0])]))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::batch::one_by_one;
    use crate::joint_coordinates::sprung_loops::poses::{LaneJointStates, PlaceTree};
    use crate::joint_coordinates::sprung_loops::solve::Solve;
    use crate::planar::JointFrame;
    use crate::{Body, BodyId, Drag, Joint, Model};
    use nalgebra::{Matrix2, Vector2};
    use pulp::Scalar;

    /// A frame of eleven bodies with this quadratic strain, a whole tile and a part of one: two chains from the ground that meet in a loop, and a tail.
    pub(in super::super) fn frame(second: Matrix2<f64>) -> Model {
        let turns = [0.3, 0.3, 0.3, -0.2, -0.2, 2.1, 2.1, 2.1, 1.2, 1.2, 0.4f64];
        let befores = [None, Some(0), Some(1), Some(2), Some(3), None, Some(5), Some(6), Some(4), Some(8), Some(9)];
        let mut centers: Vec<Vector2<f64>> = Vec::new();
        for (turn, before) in turns.iter().zip(befores) {
            let from = before.map_or_else(Vector2::zeros, |k: usize| centers[k]);
            centers.push(from + 2e-5 * Vector2::new(turn.cos(), turn.sin()));
        }
        let end = |id: BodyId| match id {
            BodyId::Ground => Vector2::zeros(),
            BodyId::Free(k) => centers[k],
        };
        let joint = |a: BodyId, b: BodyId| {
            let middle = 0.5 * (end(a) + end(b));
            let way = (end(b) - end(a)).normalize();
            let arm = |id: BodyId| if id == BodyId::Ground { middle } else { middle - end(id) };
            Joint {
                a,
                b,
                frame: JointFrame { arm_a: arm(a), arm_b: arm(b), axis: way },
                stiffness: nalgebra::Matrix3::new(3e4, 0.0, 0.0, 0.0, 2e2, 0.0, 0.0, 0.0, 1e-8),
                second,
                expansion: None,
                rest: 0.0,
                locked: [false; 3],
            }
        };
        let parent = |before: Option<usize>| before.map_or(BodyId::Ground, BodyId::Free);
        let chain = befores.iter().enumerate().map(|(k, before)| joint(parent(*before), BodyId::Free(k)));
        let joints = chain.chain([joint(BodyId::Free(7), BodyId::Free(4))]).collect();
        let body = |center: &Vector2<f64>| Body {
            name: "body".into(),
            center: *center,
            mass: 2e-13,
            inertia: 1e-23,
            drag: Drag::default(),
            free: None,
        };
        Model::new(centers.iter().map(body).collect(), joints, Vec::new(), &[], false).0
    }

    /// Placing, factoring and solving as this processor does them, and one number after the other: the same bits.
    #[test]
    fn bits_do_not_depend_on_registers() {
        let model = &frame(Matrix2::zeros());
        let tree = Tree::elastic(model).unwrap();
        let mut angles = (0..).map(|k| (0.7 * f64::from(k)).sin());
        let mut noise = || angles.next().unwrap_or_default();
        let mut poses = |size: f64| -> Vec<Pose> {
            (0..model.bodies.len())
                .map(|_| Pose::new(noise() * size * 1e-6, noise() * size * 1e-6, noise() * size))
                .collect()
        };
        let given = LaneJointStates::tiles(&poses(2.0), &poses(1e5), &poses(1e11));
        let (mut here, mut alone) = (TreeKinematics::new(&tree), TreeKinematics::new(&tree));
        here.place(&tree, &given);
        one_by_one(PlaceTree { placed: &mut alone, tree: &tree, given: &given });
        assert_eq!((&here.at, &here.rate, &here.acceleration), (&alone.at, &alone.rate, &alone.acceleration));
        let mut matrix = JointMatrix::new(&tree);
        for (block, body) in matrix.bodies.diagonal.iter_mut().zip(&model.bodies) {
            *block = nalgebra::Matrix3::from_diagonal(&(body.mass_diagonal() * 1e16));
        }
        let mut other = matrix.clone();
        matrix.factor(&tree, &here, 1.0, None).unwrap();
        for (j, map) in other.maps.iter_mut().enumerate() {
            *map = alone.map(j);
        }
        Scalar::new().vectorize(Eliminate { matrix: &mut other, tree: &tree, scale: 1.0, geometric: None }).unwrap();
        let mut fours = |size: f64| poses(size).into_iter().chain([Pose::zeros()]).map(Four::from).collect::<Vec<_>>();
        let (mut wrench, mut x) = (fours(1e-6), fours(1e-6));
        let (mut wrench_alone, mut x_alone) = (wrench.clone(), x.clone());
        matrix.solve(&mut wrench, &mut x);
        Scalar::new().vectorize(Solve { factors: &other.factors, wrench: &mut wrench_alone, x: &mut x_alone });
        assert_eq!((wrench, x), (wrench_alone, x_alone));
    }
}
