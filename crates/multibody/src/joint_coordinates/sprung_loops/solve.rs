//! Solves with the factors of a form over joint coordinates: wrenches leaf → root, motions root → leaf.
//!
//! With L_r = C_r·H⁻¹ and a body's own right side x + Sᵀ·f, f the wrench on its subtree, its parent takes over
//! ```text
//! Xᵀ·f − L_p·(x + Sᵀ·f) = P·f − L_p·x                P = Xᵀ − L_p·Sᵀ
//! ```
//! and outward, with V_p the parent's motion and s′ = H⁻¹·(x + Sᵀ·f) − Σ L_rᵀ·V_r over the other bodies of the column,
//! ```text
//! V = Pᵀ·V_p + S·s′                                  s = s′ − L_pᵀ·V_p
//! ```
//! Along a beam each body waits for the one before it, and one product is all that it waits for.

use super::columns::{ColumnBlock, Four, in_fours};
use super::kinematics::{MotionMap, triple};
use super::tree::{Tree, TreeJoint};
use crate::joint_coordinates::TreeParent;
use crate::planar::Pose;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// A coupling L and its transpose.
#[derive(Debug, Clone, Copy)]
struct BodyCoupling {
    row: u32,
    lower: ColumnBlock,
    upper: ColumnBlock,
}

/// Data of one body for a solve.
#[derive(Debug, Clone)]
struct BodySolve {
    /// Sᵀ and S.
    share: ColumnBlock,
    along: ColumnBlock,
    /// H⁻¹, zero in what is locked.
    inverse: ColumnBlock,
    /// P and its transpose; zero without a parent.
    pass: ColumnBlock,
    back: ColumnBlock,
    /// The coupling with its parent; without one, zero, and with a body beyond the last.
    parent: BodyCoupling,
    /// Couplings with other bodies.
    others: Range<usize>,
}

/// Factors of a form.
#[derive(Debug, Clone)]
pub(super) struct Factors {
    turns: Vec<BodySolve>,
    others: Vec<BodyCoupling>,
    /// The place of each block of the pattern among the others.
    places: Vec<u32>,
}

impl Factors {
    pub(super) fn new(tree: &Tree) -> Self {
        let (pattern, mut others) = (&tree.pattern, Vec::new());
        let none = BodyCoupling { row: tree.links.len() as u32, lower: ColumnBlock::ZERO, upper: ColumnBlock::ZERO };
        let mut places = vec![u32::MAX; pattern.off_blocks()];
        let mut turn = |(j, link): (usize, &TreeJoint)| {
            let (first, mut parent) = (others.len(), none);
            for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
                if link.parent == TreeParent::Body(row) {
                    parent.row = row;
                } else {
                    places[k] = others.len() as u32;
                    others.push(BodyCoupling { row, ..none });
                }
            }
            let (zero, others) = (ColumnBlock::ZERO, first..others.len());
            BodySolve { share: zero, along: zero, inverse: zero, pass: zero, back: zero, parent, others }
        };
        let turns = tree.links.iter().enumerate().map(&mut turn).collect();
        Self { turns, others, places }
    }

    /// Keeps S and H⁻¹ of body `j`, whose directions that do not move are zero in both.
    #[inline(always)]
    pub(super) fn keep(&mut self, j: usize, (along, share): (&ColumnBlock, &ColumnBlock), inverse: &ColumnBlock) {
        let turn = &mut self.turns[j];
        (turn.along, turn.share, turn.inverse) = (*along, *share, *inverse);
    }

    /// Keeps L of block `k`, which couples body `j` with its parent, where it `is_parent`, or with another.
    #[inline(always)]
    pub(super) fn keep_coupling<S: Simd>(
        &mut self,
        simd: S,
        (j, k, is_parent): (usize, usize, bool),
        map: &MotionMap<f64>,
        lower: &ColumnBlock,
    ) {
        let turn = &mut self.turns[j];
        let coupling = if is_parent {
            let pass = ColumnBlock::passing(map).less(simd, &lower.product(simd, &turn.share));
            (turn.pass, turn.back) = (pass, pass.transposed());
            &mut turn.parent
        } else {
            &mut self.others[self.places[k] as usize]
        };
        (coupling.lower, coupling.upper) = (*lower, lower.transposed());
    }
}

pub(super) struct Solve<'a> {
    pub(super) factors: &'a Factors,
    pub(super) wrench: &'a mut [Four],
    pub(super) x: &'a mut [Four],
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { factors, wrench, x } = self;
        for (j, turn) in factors.turns.iter().enumerate() {
            let (f, own) = (wrench[j], x[j]);
            let whole = own.plus(simd, turn.share.times(simd, f));
            for other in &factors.others[turn.others.clone()] {
                let to = &mut wrench[other.row as usize];
                *to = to.less(simd, other.lower.times(simd, whole));
            }
            let to = &mut wrench[turn.parent.row as usize];
            *to = to.less(simd, turn.parent.lower.times(simd, own)).plus(simd, turn.pass.times(simd, f));
            x[j] = turn.inverse.times(simd, whole);
        }
        wrench[factors.turns.len()] = Four::ZERO;
        for (j, turn) in factors.turns.iter().enumerate().rev() {
            let (mut s, above) = (x[j], wrench[turn.parent.row as usize]);
            for other in &factors.others[turn.others.clone()] {
                s = s.less(simd, other.upper.times(simd, wrench[other.row as usize]));
            }
            wrench[j] = turn.along.times(simd, s).plus(simd, turn.back.times(simd, above));
            x[j] = s.less(simd, turn.parent.upper.times(simd, above));
        }
    }
}

/// Motions of the bodies with coordinates' motions `s` and `t`, by maps of motion. In one sweep: along a
/// beam each body waits for the one before it, and the second fills the time.
#[inline]
pub(super) fn both_motions(
    tree: &Tree,
    maps: &[MotionMap<f64>],
    (s, t): (&[Pose], &[Pose]),
    (to_s, to_t): (&mut [Pose], &mut [Pose]),
) {
    for (j, link) in tree.links.iter().enumerate().rev() {
        let moved = |parent: &Pose, s: &Pose| Pose::from(maps[j].apply(link.sign, &triple(parent), &triple(s)));
        let still = Pose::zeros();
        (to_s[j], to_t[j]) = match link.parent {
            TreeParent::Free => (s[j], t[j]),
            TreeParent::Ground => (moved(&still, &s[j]), moved(&still, &t[j])),
            TreeParent::Body(p) => (moved(&to_s[p as usize], &s[j]), moved(&to_t[p as usize], &t[j])),
        };
    }
}

impl Factors {
    /// Solves; see the form that they are of.
    pub(super) fn solve(&self, wrench: &mut [Four], x: &mut [Four]) {
        in_fours(Solve { factors: self, wrench, x });
    }
}
