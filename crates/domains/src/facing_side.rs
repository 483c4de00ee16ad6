//! One side of a gap along beams: the points that bear it, and the distances and slopes that they measure.

use super::approach::MaterialPoint;
use super::from_structure::Station;
use bimorph_multibody::BodyId;
use bimorph_multibody::planar::{self, Pose};
use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector3, Vector4};

/// The direction in which a gap opens, and the sign of the slope that a positive rotation makes along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Unit vector from the lower side to the upper one, as drawn.
    pub axis: Vector2<f64>,
    /// +1, or −1 where the element was mirrored.
    pub side: f64,
}

/// Deflection at a station, with the derivatives over the pose of its body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Deflection {
    /// Displacement along the axis (m), and its derivatives with x, y, θ.
    pub(super) w: f64,
    pub(super) gradient: Vector3<f64>,
    /// ∂²w/∂θ² (m).
    pub(super) bend: f64,
    /// Slope along the gap (1).
    pub(super) slope: f64,
}

impl Opening {
    /// A bound of the displacement along the axis of all points between stations (m). A body that rotates by θ moves a point at the arm r by at most |θ|·|r|.
    pub(super) fn bound(&self, side: &Flank, q: &[Pose]) -> f64 {
        let (mut most, mut sum) = (0.0, 0.0);
        for &(body, reach) in &side.reach {
            let pose = &q[body];
            let moved = (pose.x * self.axis.x + pose.y * self.axis.y).abs() + reach * pose.z.abs();
            most = if moved > most { moved } else { most };
            sum += moved;
        }
        // a comparison with NaN must not hide it
        if sum < f64::INFINITY { most } else { sum }
    }

    /// Deflection of a point in a configuration.
    #[inline]
    pub(super) fn deflection(&self, point: &MaterialPoint, q: &[Pose], linear: bool) -> Deflection {
        let BodyId::Free(k) = point.body else { return Deflection::default() };
        let (pose, axis) = (&q[k], self.axis);
        let moved = planar::point(pose, point.arm, linear);
        // the arm where its body has turned it
        let arm = if linear { point.arm } else { point.arm + moved - Vector2::new(pose.x, pose.y) };
        let gradient = Vector3::new(axis.x, axis.y, axis.dot(&planar::perpendicular(arm)));
        let bend = if linear { 0.0 } else { -axis.dot(&arm) };
        Deflection { w: moved.dot(&axis), gradient, bend, slope: self.side * pose.z }
    }

    /// The forces on the pose of a body where a potential changes by `first` with the displacement and the slope of a station.
    #[inline]
    pub(super) fn force(&self, seen: &Deflection, first: [f64; 2]) -> Pose {
        let mut force = seen.gradient * first[0];
        force.z += self.side * first[1];
        force
    }

    /// Over the poses of two bodies, what is `h` over the displacements and slopes of their stations.
    #[inline]
    pub(super) fn block(&self, a: &Deflection, b: &Deflection, h: &Matrix2<f64>) -> Matrix3<f64> {
        let side = self.side;
        let mut block = a.gradient * (b.gradient * h[(0, 0)]).transpose();
        let (row, column) = (b.gradient * (side * h[(1, 0)]), a.gradient * (side * h[(0, 1)]));
        for k in 0..3 {
            block[(2, k)] += row[k];
            block[(k, 2)] += column[k];
        }
        block[(2, 2)] += side * side * h[(1, 1)];
        block
    }

    /// Change of the displacement and of the slope of a station with a change of the pose of its body.
    #[inline]
    pub(super) fn change(&self, seen: &Deflection, pose: &Pose) -> [f64; 2] {
        [seen.gradient.dot(pose), self.side * pose.z]
    }
}

/// The stations along a side, two or more.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Flank {
    /// Where they are, from the start of the gap.
    pub stations: Vec<Station>,
    /// None of them moves.
    pub fixed: bool,
    /// h⁴/24EI of each segment between two stations (m²/N); empty where nothing bends.
    pub yields: Vec<f64>,
    /// Body of each station that moves, and how far the points around it may move where it rotates by 1 rad: its arm, and a third of the longest segment (m).
    reach: Vec<(usize, f64)>,
}

impl Flank {
    /// A side with these stations; see [`Flank::yields`].
    pub(super) fn new(stations: Vec<Station>, yields: Vec<f64>) -> Self {
        let third = stations.windows(2).map(|ends| ends[1].at - ends[0].at).fold(0.0, f64::max) / 3.0;
        let fixed = stations.iter().all(|station| station.point.body == BodyId::Ground);
        let reach = stations.iter().filter_map(|station| match station.point.body {
            BodyId::Free(body) => Some((body, station.point.arm.x.abs() + station.point.arm.y.abs() + third)),
            BodyId::Ground => None,
        });
        Self { reach: reach.collect(), stations, fixed, yields }
    }

    /// Deflection of a segment beyond its cubic, towards the other side, at distance `at` from the start of the gap
    /// (m), under the load per length `load` (N/m).
    pub(super) fn bent(&self, segment: usize, at: f64, load: f64) -> f64 {
        let Some(yields) = self.yields.get(segment) else { return 0.0 };
        let [begin, end] = [self.stations[segment].at, self.stations[segment + 1].at];
        let s = (at - begin) / (end - begin);
        load * yields * (s * (1.0 - s)).powi(2)
    }
}

/// How the two ends of a stretch follow from the ends of the segment that it lies on; none: they are those ends.
pub(super) type EndWeights = Option<Box<Matrix4<f64>>>;

/// (w₁, φ₁, w₂, φ₂) of a stretch from those of its segment.
#[inline]
pub(super) fn onto(weights: &EndWeights, ends: Vector4<f64>) -> Vector4<f64> {
    weights.as_ref().map_or(ends, |weights| **weights * ends)
}

/// Gradient over the ends of a segment, from the gradient `first` over the ends of a stretch on it.
#[inline]
pub(super) fn back(weights: &EndWeights, first: Vector4<f64>) -> Vector4<f64> {
    weights.as_ref().map_or(first, |weights| weights.tr_mul(&first))
}

/// A side as it is followed from its start to its end: each station is evaluated once.
pub(super) struct Walk<'a> {
    frame: Opening,
    side: &'a Flank,
    q: &'a [Pose],
    linear: bool,
    /// The segment whose ends are known, and those ends.
    segment: usize,
    ends: [Deflection; 2],
}

impl<'a> Walk<'a> {
    #[inline(always)]
    pub(super) fn new(frame: Opening, side: &'a Flank, q: &'a [Pose], linear: bool) -> Self {
        let mut walk = Self { frame, side, q, linear, segment: 0, ends: [Deflection::default(); 2] };
        if !side.fixed {
            walk.ends = [walk.at(0), walk.at(1)];
        }
        walk
    }

    #[inline]
    fn at(&self, station: usize) -> Deflection {
        self.frame.deflection(&self.side.stations[station].point, self.q, self.linear)
    }

    /// The two ends of a segment; segments come in ascending order.
    #[inline(always)]
    pub(super) fn to(&mut self, segment: usize) -> &[Deflection; 2] {
        while !self.side.fixed && self.segment < segment {
            self.segment += 1;
            self.ends[0] = self.ends[1];
            self.ends[1] = self.at(self.segment + 1);
        }
        &self.ends
    }
}

/// (w₁, φ₁, w₂, φ₂) of the ends of a segment.
#[inline]
pub(super) fn values(ends: &[Deflection; 2]) -> Vector4<f64> {
    Vector4::new(ends[0].w, ends[0].slope, ends[1].w, ends[1].slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bound of a side holds the displacements of its stations and, between them, of Hermite's cubics at 9 points: 200 random states of four bodies with
    /// rotations up to 1.5 rad, linear and not. A coordinate that is no number gives no bound.
    #[test]
    fn displacements_lie_within_their_bound() {
        let mut seed = 3_u64;
        let mut random = |size: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            size * (2.0 * (seed >> 11) as f64 / (1_u64 << 53) as f64 - 1.0)
        };
        for _ in 0..200 {
            let angle: f64 = random(3.0);
            let frame = Opening { axis: Vector2::new(angle.cos(), angle.sin()), side: random(1.0).signum() };
            let stations: Vec<Station> = (0..4)
                .map(|k| {
                    let arm = Vector2::new(random(5e-6), random(5e-6));
                    let point = MaterialPoint { body: BodyId::Free(k), arm };
                    Station { at: k as f64 * 20e-6 + random(5e-6), point }
                })
                .collect();
            let turned = random(1.0).abs().powi(4) * 1.5;
            let mut q: Vec<Pose> = (0..4).map(|_| Pose::new(random(3e-6), random(3e-6), random(turned))).collect();
            let side = Flank::new(stations.clone(), Vec::new());
            let bound = frame.bound(&side, &q);
            for linear in [true, false] {
                let at: Vec<Deflection> =
                    stations.iter().map(|station| frame.deflection(&station.point, &q, linear)).collect();
                for (ends, place) in at.windows(2).zip(stations.windows(2)) {
                    let h = place[1].at - place[0].at;
                    for s in 0..=8 {
                        let n = super::super::quadrature::hermite(f64::from(s) / 8.0);
                        let w = n[0] * ends[0].w + n[2] * ends[1].w + h * (n[1] * ends[0].slope + n[3] * ends[1].slope);
                        assert!(w.abs() <= bound * (1.0 + 1e-12), "{w:e} {bound:e}");
                    }
                }
            }
            q[1].z = f64::NAN;
            assert!(frame.bound(&side, &q).is_nan());
        }
    }
}
