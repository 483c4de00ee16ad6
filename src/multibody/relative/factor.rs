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

use super::geometric::Geometric;
use super::kinematics::Map;
use super::products::{gather, left, right, shift_columns, shift_rows, spread};
use super::tree::{Link, Parent, Tree};
use crate::multibody::factor::{Inertia, Scalar, ZeroPivot};
use crate::multibody::planar::Block;
use crate::multibody::{BlockMatrix, Pattern};
use nalgebra::{Matrix3, Vector3};

/// A pivot smaller than this share of what it came from is taken for zero.
const LOST: f64 = 1e-13;

/// A form over joint coordinates, and its factors.
#[derive(Debug, Clone)]
pub struct JointMatrix<T: Scalar> {
    /// Blocks over the bodies' motions; spoiled by factoring.
    pub bodies: BlockMatrix<T, 3>,
    /// H⁻¹ of each body.
    inverse: Vec<Matrix3<T>>,
    /// C_r·H⁻¹ of each block of the pattern, rows of the later body.
    coupling: Vec<Matrix3<T>>,
    /// C_r of the column at hand.
    column: Vec<Matrix3<T>>,
    /// For each block of a column, the block that takes over its motion with the column's parent; [`OWN`] where the row is
    /// the parent itself.
    heir: Vec<u32>,
    maps: Vec<Map<f64>>,
}

/// The parent's own diagonal.
const OWN: u32 = u32::MAX;

impl<T: Scalar> JointMatrix<T> {
    /// Storage.
    pub fn new(tree: &Tree) -> Self {
        let pattern = &tree.pattern;
        let count = pattern.bodies();
        Self {
            bodies: BlockMatrix::new(pattern),
            inverse: vec![Matrix3::zeros(); count],
            coupling: vec![Matrix3::zeros(); pattern.off_blocks()],
            column: Vec::with_capacity((0..count).map(|j| pattern.column(j).len()).max().unwrap_or(0)),
            heir: heirs(tree),
            maps: vec![Map::REST; count],
        }
    }

    /// Factors the form of [`JointMatrix::bodies`] and the joints' blocks `scale`·K (+ `geometric`) at the configuration of
    /// `maps`. Where a pivot vanishes, `vanished` decides: an error, or to hold the direction.
    ///
    /// # Errors
    /// [`ZeroPivot`].
    pub fn factor(
        &mut self,
        tree: &Tree,
        maps: &[Map<f64>],
        scale: f64,
        geometric: Option<&[Geometric]>,
        mut vanished: impl FnMut(ZeroPivot) -> Result<(), ZeroPivot>,
    ) -> Result<Inertia, ZeroPivot> {
        self.maps.copy_from_slice(maps);
        let pattern = &tree.pattern;
        let mut inertia = Inertia::default();
        for (j, link) in tree.links.iter().enumerate() {
            let map = &maps[j];
            let block = self.bodies.diagonal[j];
            let extra = geometric.map(|g| &g[j]);
            let mut own = joint_block::<T>(link, scale, extra);
            let (ds, free) = match &link.free {
                Some(free) => (block * free.map(T::from_real), Some(free)),
                None => (right(&block, map, link), None),
            };
            own += match free {
                Some(free) => free.map(T::from_real) * ds,
                None => left(&ds, map, link),
            };
            hold_locked(link, &mut own);
            let inverse = invert(&own, &mut inertia, &mut |direction| vanished(ZeroPivot { body: j, direction }))?;
            self.inverse[j] = inverse;
            let column = pattern.column(j);
            let parent = match link.parent {
                Parent::Body(p) => Some(p as usize),
                _ => None,
            };
            if let Some(p) = parent {
                self.hand_over(pattern, j, p, &block, map, extra);
            }
            let mut target = pattern.targets(j).iter();
            self.column.clear();
            for (k, &row) in column.clone().zip(pattern.rows(j)) {
                let row = row as usize;
                let below = self.bodies.below[k];
                let mut c = match free {
                    Some(free) => below * free.map(T::from_real),
                    None => right(&below, map, link),
                };
                if parent == Some(row) {
                    c += shift_rows(&ds, map);
                    if let Some(g) = extra {
                        for i in 0..3 {
                            c[(2, i)] += T::from_real(g.cross[i]);
                        }
                    }
                }
                clear_locked(link, &mut c);
                let scaled = c * inverse;
                for (other, &at) in self.column.iter().zip(target.by_ref()) {
                    self.bodies.below[at as usize] -= scaled * other.transpose();
                }
                self.bodies.diagonal[row] -= scaled * c.transpose();
                self.coupling[k] = scaled;
                self.column.push(c);
            }
        }
        Ok(inertia)
    }

    /// What moves with the parent: the body's own share, and its couplings to other bodies.
    #[inline(always)]
    fn hand_over(
        &mut self,
        pattern: &Pattern,
        j: usize,
        p: usize,
        block: &Matrix3<T>,
        map: &Map<f64>,
        extra: Option<&Geometric>,
    ) {
        let moved = shift_columns(block, map);
        let mut own = shift_rows(&moved, map);
        for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
            let below = self.bodies.below[k];
            // along a tree nothing but the joint itself couples the two
            if below == Matrix3::zeros() {
                continue;
            }
            let moved = shift_columns(&below, map);
            match self.heir[k] {
                OWN => own += moved + moved.transpose(),
                at => self.bodies.below[at as usize] += if row as usize > p { moved } else { moved.transpose() },
            }
        }
        if let Some(g) = extra {
            own[(2, 2)] += T::from_real(g.turn);
        }
        self.bodies.diagonal[p] += own;
    }

    /// Motions of the bodies with coordinates' motions `s` and `t`, at the configuration of the factor. In one sweep: along a
    /// beam each body waits for the one before it, and the second fills the time.
    #[inline]
    pub(crate) fn both_motions(
        &self,
        tree: &Tree,
        (s, t): (&[Vector3<T>], &[Vector3<T>]),
        (to_s, to_t): (&mut [Vector3<T>], &mut [Vector3<T>]),
    ) {
        for (j, link) in tree.links.iter().enumerate().rev() {
            let map = &self.maps[j];
            (to_s[j], to_t[j]) = match link.parent {
                Parent::Free => (s[j], t[j]),
                Parent::Ground => {
                    let still = Vector3::zeros();
                    (spread(map, link.sign, &still, &s[j]), spread(map, link.sign, &still, &t[j]))
                }
                Parent::Body(p) => {
                    let p = p as usize;
                    (spread(map, link.sign, &to_s[p], &s[j]), spread(map, link.sign, &to_t[p], &t[j]))
                }
            };
        }
    }

    /// Solves: `x` holds the right side over the coordinates and becomes the solution. `wrench` holds a right side over the
    /// bodies' motions (zero where there is none), and becomes the bodies' motions.
    pub fn solve(&self, tree: &Tree, wrench: &mut [Vector3<T>], x: &mut [Vector3<T>]) {
        let pattern = &tree.pattern;
        for (j, link) in tree.links.iter().enumerate() {
            let map = &self.maps[j];
            let f = wrench[j];
            let mut right_side = x[j]
                + match &link.free {
                    Some(free) => free.map(T::from_real) * f,
                    None => gather(map, link.sign, &f),
                };
            for i in 0..3 {
                if !link.moving[i] {
                    right_side[i] = T::zero();
                }
            }
            if let Parent::Body(p) = link.parent {
                let to = &mut wrench[p as usize];
                to.x += f.x;
                to.y += f.y;
                to.z += f.z + T::from_real(map.lever[0]) * f.x + T::from_real(map.lever[1]) * f.y;
            }
            for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
                wrench[row as usize] -= self.coupling[k] * right_side;
            }
            x[j] = self.inverse[j] * right_side;
        }
        for (j, link) in tree.links.iter().enumerate().rev() {
            let map = &self.maps[j];
            let mut s = x[j];
            for (k, &row) in pattern.column(j).zip(pattern.rows(j)) {
                s -= self.coupling[k].tr_mul(&wrench[row as usize]);
            }
            x[j] = s;
            wrench[j] = match link.parent {
                Parent::Free => s,
                Parent::Ground => spread(map, link.sign, &Vector3::zeros(), &s),
                Parent::Body(p) => spread(map, link.sign, &wrench[p as usize], &s),
            };
        }
    }
}

/// See [`JointMatrix::heir`].
fn heirs(tree: &Tree) -> Vec<u32> {
    let pattern = &tree.pattern;
    let mut heirs = vec![OWN; pattern.off_blocks()];
    for (j, link) in tree.links.iter().enumerate() {
        let Parent::Body(p) = link.parent else { continue };
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
fn joint_block<T: Scalar>(link: &Link, scale: f64, extra: Option<&Geometric>) -> Matrix3<T> {
    let [uu, ug, up, gg, gp, pp] = link.stiffness.0.map(|k| k * scale);
    let mut own = Matrix3::new(uu, ug, up, ug, gg, gp, up, gp, pp);
    if let Some(g) = extra {
        own += g.own;
    }
    own.map(T::from_real)
}

/// Gives locked directions the pivot 1 and no couplings.
#[inline(always)]
fn hold_locked<T: Scalar>(link: &Link, own: &mut Matrix3<T>) {
    if let Some(free) = &link.free {
        *own += (Block::identity() - **free).map(T::from_real);
    }
    for i in 0..3 {
        if !link.moving[i] {
            for k in 0..3 {
                own[(i, k)] = T::zero();
                own[(k, i)] = T::zero();
            }
            own[(i, i)] = T::one();
        }
    }
}

#[inline(always)]
fn clear_locked<T: Scalar>(link: &Link, c: &mut Matrix3<T>) {
    for i in 0..3 {
        if !link.moving[i] {
            c.column_mut(i).fill(T::zero());
        }
    }
}

/// The inverse of a symmetric block by its L·D·Lᵀ without exchanges, and the signs of its pivots.
#[inline(always)]
fn invert<T: Scalar>(
    a: &Matrix3<T>,
    inertia: &mut Inertia,
    vanished: &mut impl FnMut(usize) -> Result<(), ZeroPivot>,
) -> Result<Matrix3<T>, ZeroPivot> {
    let mut pivot = |d: T, direction: usize, from: T, inertia: &mut Inertia| -> Result<T, ZeroPivot> {
        let mut d = d;
        if d.modulus() <= LOST * from.modulus() || !d.is_finite() {
            vanished(direction)?;
            d = from;
        }
        if d.real() < 0.0 {
            inertia.negative += 1;
        }
        Ok(T::one() / d)
    };
    let r0 = pivot(a[(0, 0)], 0, a[(0, 0)], inertia)?;
    let (l10, l20) = (a[(1, 0)] * r0, a[(2, 0)] * r0);
    let r1 = pivot(a[(1, 1)] - l10 * a[(1, 0)], 1, a[(1, 1)], inertia)?;
    let c21 = a[(2, 1)] - l20 * a[(1, 0)];
    let l21 = c21 * r1;
    let r2 = pivot(a[(2, 2)] - l20 * a[(2, 0)] - l21 * c21, 2, a[(2, 2)], inertia)?;
    // L⁻ᵀ·D⁻¹·L⁻¹ with L⁻¹ = [1; −l10 1; m −l21 1]
    let m = l10 * l21 - l20;
    let (i22, i21, i20) = (r2, -l21 * r2, m * r2);
    let i11 = r1 - l21 * i21;
    let i10 = -l10 * r1 - l21 * i20;
    let i00 = r0 + l10 * l10 * r1 + m * i20;
    Ok(Matrix3::new(i00, i10, i20, i10, i11, i21, i20, i21, i22))
}
