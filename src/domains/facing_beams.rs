//! Two rows of beams that face each other: the field and the contact of [`super::facing`], stretch by stretch, over the bodies
//! of the segments that both are cut into.

use super::approach::Point;
use super::contact::touching_distance;
use super::domain::{At, Domain};
use super::drawn::{Drawing, Drawn};
use super::facing::Facing;
use super::facing_side::{Deflection, Flank, Opening, Walk, back, onto, values};
use super::facing_stretches::{BeamRows, Stretch, stretches};
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Pattern};
use crate::structure::GapVoltage;
use nalgebra::{Matrix4, Vector2, Vector4};

/// Facing beams: the upper side runs from a to b, the lower one from c to d.
#[derive(Debug, Clone, PartialEq)]
pub struct FacingBeams {
    /// Direction in which the gap opens.
    pub frame: Opening,
    /// The upper side, then the lower one.
    pub sides: [Flank; 2],
    /// From a to b.
    stretches: Vec<Stretch>,
}

/// A stretch at a configuration.
struct Local<'a> {
    stretch: &'a Stretch,
    /// Its relative end displacements and slopes.
    z: Vector4<f64>,
    /// The ends of its segments, upper then lower.
    ends: [&'a [Deflection; 2]; 2],
}

/// The sides' parts in a relative displacement.
const SIGNS: [f64; 2] = [1.0, -1.0];

impl FacingBeams {
    /// Calls `each` for the stretches in turn.
    #[inline(always)]
    fn along(&self, at: At<'_>, mut each: impl FnMut(&Local<'_>)) {
        let mut upper = Walk::new(self.frame, &self.sides[0], at.q, at.linear);
        let mut lower = Walk::new(self.frame, &self.sides[1], at.q, at.linear);
        for stretch in &self.stretches {
            let ends = [upper.to(stretch.segments[0]), lower.to(stretch.segments[1])];
            let part = |side: usize| match self.sides[side].fixed {
                true => Vector4::zeros(),
                false => onto(&stretch.weights[side], values(ends[side])),
            };
            each(&Local { stretch, z: part(0) - part(1), ends });
        }
    }

    /// The sum of `of` over the stretches.
    #[inline]
    fn sum(&self, at: At<'_>, mut of: impl FnMut(&Local<'_>) -> f64) -> f64 {
        let mut sum = 0.0;
        self.along(at, |local| sum += of(local));
        sum
    }

    /// The sides that move.
    #[inline]
    fn moving(&self) -> impl Iterator<Item = usize> + use<> {
        let fixed = [self.sides[0].fixed, self.sides[1].fixed];
        (0..2).filter(move |side| !fixed[*side])
    }

    /// The points at the ends of a stretch's segments.
    #[inline]
    fn points(&self, stretch: &Stretch, side: usize) -> [&Point; 2] {
        let segment = stretch.segments[side];
        [&self.sides[side].stations[segment].point, &self.sides[side].stations[segment + 1].point]
    }

    /// `r +=` the forces of what is `first` per z.
    #[inline]
    fn add(&self, local: &Local<'_>, first: Vector4<f64>, r: &mut [Pose]) {
        for side in self.moving() {
            let first = back(&local.stretch.weights[side], first) * SIGNS[side];
            for (end, point) in self.points(local.stretch, side).into_iter().enumerate() {
                if let BodyId::Free(k) = point.body {
                    r[k] += self.frame.force(&local.ends[side][end], [first[2 * end], first[2 * end + 1]]);
                }
            }
        }
    }

    /// Change of z.
    fn change(&self, local: &Local<'_>, dq: &[Pose]) -> Vector4<f64> {
        let [upper, lower] = [0, 1].map(|side| {
            let points = self.points(local.stretch, side);
            let [a, b] = [0, 1].map(|end| self.frame.change(&local.ends[side][end], points[end], dq));
            onto(&local.stretch.weights[side], Vector4::new(a[0], a[1], b[0], b[1]))
        });
        upper - lower
    }

    /// The stretch with the smallest distance, that distance [m], and its derivative with z.
    fn closest(&self, at: At<'_>, mut each: impl FnMut(&Local<'_>, f64, Vector4<f64>)) {
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
    fn add_stiffness(
        &self,
        local: &Local<'_>,
        (first, second): (Vector4<f64>, Matrix4<f64>),
        pattern: &Pattern,
        tangent: &mut BlockMatrix<f64, 3>,
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

impl Drawn for FacingBeams {
    fn lay<'a>(drawing: &Drawing<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        let drawn = &drawing.structure.beam_gaps;
        if drawn.is_empty() {
            return;
        }
        let beams = BeamRows::new(drawing.structure);
        for gap in drawn {
            let normal = gap.angle + gap.side * std::f64::consts::FRAC_PI_2;
            let frame = Opening { axis: Vector2::new(normal.cos(), normal.sin()), side: gap.side };
            let [a, b, c, d] = gap.nodes;
            let sides = [[a, b], [c, d]].map(|nodes| beams.side(drawing, gap, nodes));
            let cut = stretches(&sides);
            let facing = Facing {
                length: gap.length,
                gap: gap.gap,
                strength: gap.permittivity * gap.height * gap.fringe,
                height: gap.height,
                touch: gap.touch.unwrap_or(touching_distance(gap.gap)),
                chord: drawing.chord,
                alone: cut.len() == 1,
            };
            let stretches = cut.into_iter().map(|cut| Stretch {
                facing: Facing { length: cut.length, ..facing },
                segments: cut.segments,
                weights: cut.weights,
            });
            put(&gap.name, Some(&gap.voltage), Self { frame, sides, stretches: stretches.collect() });
        }
    }

    fn moved(mut self, to: &dyn Fn(Point) -> Point) -> Self {
        for station in self.sides.iter_mut().flat_map(|side| &mut side.stations) {
            station.point = to(station.point);
        }
        self
    }
}

impl Domain for FacingBeams {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.sides.iter().flat_map(|side| &side.stations).map(|station| station.point.body).for_each(see);
    }

    fn pairs(&self, mut see: impl FnMut(BodyId, BodyId)) {
        for stretch in &self.stretches {
            let ids = [0, 1].map(|side| self.points(stretch, side).map(|point| point.body));
            let ids = [ids[0][0], ids[0][1], ids[1][0], ids[1][1]];
            for (i, a) in ids.iter().enumerate() {
                ids[..i].iter().for_each(|b| see(*a, *b));
            }
        }
    }

    fn add_force(&self, at: At<'_>, volts: f64, r: &mut [Pose]) {
        self.along(at, |local| {
            if volts != 0.0 || !local.stretch.facing.apart(&local.z) {
                self.add(local, local.stretch.facing.load(&local.z, volts), r);
            }
        });
    }

    fn add_force_change(&self, at: At<'_>, volts: f64, change: f64, r: &mut [Pose]) {
        self.along(at, |local| {
            let first = local.stretch.facing.gradient(&local.z) * (-volts * change);
            self.add(local, first, r);
        });
    }

    fn add_tangent(&self, at: At<'_>, volts: f64, pattern: &Pattern, tangent: &mut BlockMatrix<f64, 3>) {
        self.along(at, |local| {
            if let Some(both) = local.stretch.facing.load_and_stiffness(&local.z, volts) {
                self.add_stiffness(local, both, pattern, tangent);
            }
        });
    }

    fn add_force_and_tangent(
        &self,
        at: At<'_>,
        volts: f64,
        pattern: &Pattern,
        (r, tangent): (&mut [Pose], &mut BlockMatrix<f64, 3>),
    ) {
        self.along(at, |local| {
            if let Some(both) = local.stretch.facing.load_and_stiffness(&local.z, volts) {
                self.add(local, both.0, r);
                self.add_stiffness(local, both, pattern, tangent);
            }
        });
    }

    fn levers(&self, at: At<'_>, volts: f64, mut lever: impl FnMut(Point, Vector2<f64>)) {
        self.along(at, |local| {
            let first = local.stretch.facing.load(&local.z, volts);
            for side in self.moving() {
                let first = back(&local.stretch.weights[side], first) * SIGNS[side];
                for (end, point) in self.points(local.stretch, side).into_iter().enumerate() {
                    lever(*point, self.frame.axis * -first[2 * end]);
                }
            }
        });
    }

    fn capacitance(&self, at: At<'_>) -> f64 {
        self.sum(at, |local| local.stretch.facing.capacitance(&local.z))
    }

    fn capacitance_change(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        self.sum(at, |local| local.stretch.facing.gradient(&local.z).dot(&self.change(local, dq)))
    }

    fn pull(&self, at: At<'_>) -> f64 {
        let mut sum = Vector4::zeros();
        self.along(at, |local| sum += local.stretch.facing.gradient(&local.z));
        -(sum[0] + sum[2])
    }

    fn pull_and_change(&self, at: At<'_>, dq: &[Pose]) -> (f64, f64) {
        let (mut sum, mut change) = (Vector4::zeros(), Vector4::zeros());
        self.along(at, |local| {
            let c = local.stretch.facing.at(&local.z);
            sum += c.gradient;
            change += c.hessian * self.change(local, dq);
        });
        (-(sum[0] + sum[2]), -(change[0] + change[2]))
    }

    fn add_shape_force(&self, at: At<'_>, volts: f64, r: &mut [Pose]) -> f64 {
        let (mut begin, mut size) = (0.0, 0.0);
        self.along(at, |local| {
            let Stretch { facing, segments, .. } = local.stretch;
            let first = local.stretch.facing.load(&local.z, volts);
            let load = (first[0] + first[2]) / facing.length;
            let bent = |s: f64| -> f64 {
                (0..2).map(|side| self.sides[side].bent(segments[side], begin + s * facing.length, load)).sum()
            };
            let change = facing.shape_force(&local.z, volts, bent);
            size += change[0].abs() + change[2].abs();
            self.add(local, change, r);
            begin += facing.length;
        });
        size
    }

    fn closes(&self) -> bool {
        true
    }

    /// The smallest along the beams.
    fn distance(&self, at: At<'_>) -> f64 {
        let mut least = f64::INFINITY;
        self.closest(at, |_, distance, _| least = distance);
        least
    }

    fn distance_change(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        let mut change = 0.0;
        self.closest(at, |local, _, weights| change = weights.dot(&self.change(local, dq)));
        change
    }

    fn touching(&self) -> Option<[f64; 2]> {
        let facing = &self.stretches.first()?.facing;
        Some([facing.touch, facing.least()])
    }

    fn bearing(&self, at: At<'_>) -> f64 {
        self.sum(at, |local| {
            let force = local.stretch.facing.contact(&local.z).0;
            force[0].abs() + force[2].abs()
        })
    }

    fn contact_energy(&self, at: At<'_>) -> f64 {
        self.sum(at, |local| local.stretch.facing.contact_energy(&local.z))
    }

    fn contact_work(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        self.sum(at, |local| match local.stretch.facing.apart(&local.z) {
            true => 0.0,
            false => local.stretch.facing.contact(&local.z).0.dot(&self.change(local, dq)),
        })
    }
}
