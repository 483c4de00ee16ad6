//! Facing beams stretch by stretch: relative displacements of their ends, and what is a function of them over the poses of the bodies.

use super::approach::MaterialPoint;
use super::contact_loss::Loss;
use super::domain::Configuration;
use super::facing_side::{Deflection, Flank, Opening, Walk, back, onto, values};
use super::facing_stretches::CubicStretch;
use super::facing_tiles::Tile;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use nalgebra::{Matrix4, Vector4};

/// Facing beams: the upper side runs from a to b, the lower one from c to d.
#[derive(Debug, Clone, PartialEq)]
pub struct FacingBeams {
    /// Direction in which the gap opens.
    pub frame: Opening,
    /// The upper side, then the lower one.
    pub sides: [Flank; 2],
    /// From a to b.
    pub(super) stretches: Vec<CubicStretch>,
    /// The same in tiles; none where a stretch lies alone or is measured along chords.
    pub(super) tiles: Vec<Tile>,
    /// Energy loss of an impact.
    pub loss: Loss,
}

/// A stretch at a configuration.
pub(super) struct Local<'a> {
    pub(super) stretch: &'a CubicStretch,
    /// Its relative end displacements and slopes.
    pub(super) z: Vector4<f64>,
    /// The ends of its segments, upper then lower.
    pub(super) ends: [&'a [Deflection; 2]; 2],
}

/// The sides' parts in a relative displacement.
pub(super) const SIGNS: [f64; 2] = [1.0, -1.0];

impl FacingBeams {
    pub(super) fn new(frame: Opening, sides: [Flank; 2], stretches: Vec<CubicStretch>, loss: Loss) -> Self {
        let tiled = stretches.iter().all(|stretch| !(stretch.facing.alone || stretch.facing.chord));
        let tiles = if tiled { Tile::all(&sides, &stretches) } else { Vec::new() };
        Self { frame, sides, stretches, tiles, loss }
    }

    /// Both sides at a configuration, to be followed from start to end.
    #[inline]
    pub(super) fn walks<'a>(&'a self, at: Configuration<'a>) -> [Walk<'a>; 2] {
        let walk = |side| Walk::new(self.frame, side, at.q, at.linear);
        [walk(&self.sides[0]), walk(&self.sides[1])]
    }

    /// Bound of the displacements of both sides together (m).
    pub(super) fn bound(&self, q: &[Pose]) -> f64 {
        // the Bernstein coefficients of a cubic lie within a third of its length times the slopes of the displacements at its ends
        self.moving().map(|side| self.frame.bound(&self.sides[side], q)).sum()
    }

    /// The next stretch along them.
    #[inline(always)]
    pub(super) fn local<'a>(&self, stretch: &'a CubicStretch, [upper, lower]: &'a mut [Walk<'_>; 2]) -> Local<'a> {
        let ends = [upper.to(stretch.segments[0]), lower.to(stretch.segments[1])];
        let part = |side: usize| match self.sides[side].fixed {
            true => Vector4::zeros(),
            false => onto(&stretch.weights[side], values(ends[side])),
        };
        Local { stretch, z: part(0) - part(1), ends }
    }

    /// Calls `each` for the stretches in turn.
    #[inline(always)]
    pub(super) fn along(&self, at: Configuration<'_>, mut each: impl FnMut(&Local<'_>)) {
        let mut walks = self.walks(at);
        for stretch in &self.stretches {
            each(&self.local(stretch, &mut walks));
        }
    }

    /// The sum of `of` over the stretches.
    #[inline]
    pub(super) fn sum(&self, at: Configuration<'_>, mut of: impl FnMut(&Local<'_>) -> f64) -> f64 {
        let mut sum = 0.0;
        self.along(at, |local| sum += of(local));
        sum
    }

    /// The sides that move.
    #[inline]
    pub(super) fn moving(&self) -> impl Iterator<Item = usize> + use<> {
        let fixed = [self.sides[0].fixed, self.sides[1].fixed];
        (0..2).filter(move |side| !fixed[*side])
    }

    /// The points at the ends of a stretch's segments.
    #[inline]
    pub(super) fn points(&self, stretch: &CubicStretch, side: usize) -> [&MaterialPoint; 2] {
        let segment = stretch.segments[side];
        [&self.sides[side].stations[segment].point, &self.sides[side].stations[segment + 1].point]
    }

    /// `r +=` the forces of what is `first` per z.
    #[inline]
    pub(super) fn add(&self, local: &Local<'_>, first: Vector4<f64>, r: &mut [Pose]) {
        for side in self.moving() {
            let first = back(&local.stretch.weights[side], first) * SIGNS[side];
            for (end, point) in self.points(local.stretch, side).into_iter().enumerate() {
                if let BodyId::Free(k) = point.body {
                    r[k] += self.frame.force(&local.ends[side][end], [first[2 * end], first[2 * end + 1]]);
                }
            }
        }
    }

    /// Change of z where the pose of a body changes by `of` it.
    pub(super) fn change(&self, local: &Local<'_>, of: impl Fn(BodyId) -> Pose) -> Vector4<f64> {
        let [upper, lower] = [0, 1].map(|side| {
            let points = self.points(local.stretch, side);
            let [a, b] = [0, 1].map(|end| self.frame.change(&local.ends[side][end], &of(points[end].body)));
            onto(&local.stretch.weights[side], Vector4::new(a[0], a[1], b[0], b[1]))
        });
        upper - lower
    }

    /// The stretch with the smallest distance, that distance (m), and its derivative with z.
    pub(super) fn closest(&self, at: Configuration<'_>, mut each: impl FnMut(&Local<'_>, f64, Vector4<f64>)) {
        let mut least = f64::INFINITY;
        self.along(at, |local| {
            let (distance, weights) = local.stretch.facing.closest(&local.z);
            if distance < least {
                least = distance;
                each(local, distance, weights);
            }
        });
    }

    /// `tangent +=` what `first` and `second` per z of a stretch add.
    #[inline]
    pub(super) fn add_stiffness(
        &self,
        local: &Local<'_>,
        (first, second): (Vector4<f64>, Matrix4<f64>),
        pattern: &Pattern,
        tangent: &mut BodyMatrix,
    ) {
        let weights = &local.stretch.weights;
        for (one, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            if self.sides[one].fixed || self.sides[other].fixed {
                continue;
            }
            let ids = [one, other].map(|side| self.points(local.stretch, side).map(|point| point.body));
            let mut h = second * (SIGNS[one] * SIGNS[other]);
            if let Some(weights) = &weights[one] {
                h = weights.tr_mul(&h);
            }
            if let Some(weights) = &weights[other] {
                h *= **weights;
            }
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (BodyId::Free(row), BodyId::Free(column)) = (ids[0][i], ids[1][j]) else { continue };
                if row < column {
                    continue;
                }
                let part = h.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
                let block = self.frame.block(&local.ends[one][i], &local.ends[other][j], &part);
                if row == column {
                    tangent.diagonal[row] += block;
                } else if let Some(at) = pattern.block(row, column) {
                    tangent.below[at] += block;
                }
            }
        }
        for side in self.moving() {
            let first = back(&weights[side], first) * SIGNS[side];
            for (end, point) in self.points(local.stretch, side).into_iter().enumerate() {
                if let BodyId::Free(k) = point.body {
                    tangent.diagonal[k][(2, 2)] += first[2 * end] * local.ends[side][end].bend;
                }
            }
        }
    }
}
