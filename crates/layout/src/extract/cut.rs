//! Etch holes cut along the limbs and joints that they lie in.
//!
//! The areas of the axis tile a part, and each consists of two convex quadrangles. A hole is clipped by them (I. E.
//! Sutherland, G. W. Hodgman, CACM 17, 1974), so that each limb or joint loses exactly its share of the hole. Pieces of
//! outlines that cutting places on a border run there and back: they do not affect moments and further cuts.

use super::boxes::{self, Boxes, Extent};
use super::cells::Owner;
use super::holes::Hole;
use super::joints::LimbGraph;
use super::medial::Medial;
use super::moments::Moments;
use bimorph_base::budget;

/// An outline with its corners in order.
pub(super) type OrderedOutline = Vec<[f64; 2]>;

/// Area that holes remove from a limb or joint.
#[derive(Debug, Clone, Default)]
pub(super) struct MaterialCutout {
    /// Moments of all pieces.
    pub(super) moments: Moments,
    /// The pieces.
    pub(super) pieces: Vec<OrderedOutline>,
}

/// Areas that holes remove from the limbs and joints of a part, in axis coordinates.
#[derive(Debug, Clone, Default)]
pub(super) struct HoleCutouts {
    pub(super) limbs: Vec<MaterialCutout>,
    pub(super) joints: Vec<MaterialCutout>,
}

impl HoleCutouts {
    /// Cuts the holes of a part whose box has its lower left corner at `origin`. Cost: n log n, where cells overlap few holes.
    pub(super) fn of(axis: &Medial, parts: &LimbGraph, holes: &[Hole], origin: [f64; 2]) -> Self {
        let mut cut = Self {
            limbs: vec![MaterialCutout::default(); parts.limbs.len()],
            joints: vec![MaterialCutout::default(); parts.joints.len()],
        };
        if holes.is_empty() {
            return cut;
        }
        let extents: Vec<Extent> = holes
            .iter()
            .map(|hole| hole.extent().map(|corner| [corner[0] - origin[0], corner[1] - origin[1]]))
            .collect();
        let near = Boxes::of(&extents);
        let local = |p: &[f64; 2]| [p[0] - origin[0], p[1] - origin[1]];
        let outlines: Vec<OrderedOutline> = holes.iter().map(|hole| hole.outline.iter().map(local).collect()).collect();
        // for each hole: the area not assigned yet, the largest assigned area, and its owner
        let mut left: Vec<(f64, f64, Option<Owner>)> = holes.iter().map(|hole| (hole.area, 0.0, None)).collect();
        for (owner, edges) in owners(parts) {
            for e in edges {
                budget::check();
                let edge = &axis.edges[*e as usize];
                let cell = axis.outline(edge.ends, edge.sites);
                for k in near.overlapping(&boxes::around(cell)).into_iter().map(|k| k as usize) {
                    budget::check();
                    for half in halves(&cell) {
                        let piece = clipped(&outlines[k], &half);
                        let moments = Moments::of(&piece);
                        if moments.area > 0.0 {
                            let (rest, most, of) = &mut left[k];
                            *rest -= moments.area;
                            if moments.area > *most {
                                (*most, *of) = (moments.area, Some(owner));
                            }
                            cut.of_owner(owner).take(moments, piece);
                        }
                    }
                }
            }
        }
        // rounding of the cells: areas of holes are exact
        for (rest, _, of) in left {
            if let Some(owner) = of {
                cut.of_owner(owner).moments.grow(rest);
            }
        }
        cut
    }

    fn of_owner(&mut self, owner: Owner) -> &mut MaterialCutout {
        match owner {
            Owner::Limb(k) => &mut self.limbs[k],
            Owner::Joint(j) => &mut self.joints[j],
        }
    }
}

impl MaterialCutout {
    fn take(&mut self, moments: Moments, piece: OrderedOutline) {
        self.moments += moments;
        self.pieces.push(piece);
    }

    /// Moments of what lies in a convex outline.
    pub(super) fn within(&self, convex: &[[f64; 2]]) -> Moments {
        let mut sum = Moments::default();
        self.pieces.iter().for_each(|piece| sum += Moments::of(&clipped(piece, convex)));
        sum
    }
}

/// Limbs and joints with the edges of the axis whose areas they have.
fn owners(parts: &LimbGraph) -> impl Iterator<Item = (Owner, &[u32])> {
    let joints = parts.joints.iter().enumerate().map(|(j, joint)| (Owner::Joint(j), joint.edges.as_slice()));
    let limbs = parts.limbs.iter().enumerate().map(|(k, limb)| (Owner::Limb(k), limb.edges.as_slice()));
    joints.chain(limbs)
}

/// The two convex halves of an area of the axis, on either side of its edge.
fn halves(cell: &[[f64; 2]; 6]) -> [[[f64; 2]; 4]; 2] {
    let [p, ap, aq, q, bq, bp] = *cell;
    [[p, ap, aq, q], [p, q, bq, bp]]
}

/// Intersection of an outline with a convex one, in the direction of the first.
pub(super) fn clipped(outline: &[[f64; 2]], convex: &[[f64; 2]]) -> OrderedOutline {
    let mut kept = outline.to_vec();
    let middle = convex[0];
    let turns = convex
        .iter()
        .zip(convex.iter().cycle().skip(1))
        .map(|(a, b)| (a[0] - middle[0]) * (b[1] - middle[1]) - (b[0] - middle[0]) * (a[1] - middle[1]));
    let sign = if turns.sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    for (a, b) in convex.iter().zip(convex.iter().cycle().skip(1)) {
        let d = [b[0] - a[0], b[1] - a[1]];
        if d == [0.0; 2] || kept.is_empty() {
            continue;
        }
        let inside = |p: &[f64; 2]| sign * (d[0] * (p[1] - a[1]) - d[1] * (p[0] - a[0]));
        let mut next = Vec::with_capacity(kept.len() + 4);
        for (p, q) in kept.iter().zip(kept.iter().cycle().skip(1)) {
            let (s, t) = (inside(p), inside(q));
            if s >= 0.0 {
                next.push(*p);
            }
            if (s > 0.0 && t < 0.0) || (s < 0.0 && t > 0.0) {
                let u = s / (s - t);
                next.push([p[0] + u * (q[0] - p[0]), p[1] + u * (q[1] - p[1])]);
            }
        }
        kept = next;
    }
    kept
}

#[cfg(test)]
mod tests {
    //! A box cut by a triangle, in either direction of both; a hole shaped like a U cut across its legs leaves two boxes. By hand.
    use super::*;

    #[test]
    fn pieces_have_their_areas() {
        let mut cell = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]];
        let mut cut = vec![[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
        for _ in 0..2 {
            for _ in 0..2 {
                let m = Moments::of(&clipped(&cut, &cell));
                assert_eq!(m.area, 2.0);
                assert!((m.centroid()[0] - (1.0 + 2.0 / 3.0)).abs() < 1e-15, "{m:?}");
                cut.reverse();
            }
            cell.reverse();
        }
        let legs = vec![[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [4.0, 4.0], [4.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
        let upper = Moments::of(&clipped(&legs, &[[-1.0, 2.0], [6.0, 2.0], [6.0, 9.0], [-1.0, 9.0]]));
        let [x, y] = upper.centroid();
        assert!(upper.area == 4.0 && (x - 2.5).abs() < 1e-12 && (y - 3.0).abs() < 1e-12, "{upper:?}");
        // between the legs: edges that cancel at most
        let between = Moments::of(&clipped(&legs, &[[1.5, 2.0], [3.0, 2.0], [3.0, 3.0]]));
        assert!(between.area.abs() < 1e-12, "{between:?}");
    }
}
