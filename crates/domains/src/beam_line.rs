//! The centreline of a beam between points of bodies: how a motion bends it, and how far its segments are strained and turned.
//!
//! Each segment is the cubic through its ends. All is measured along the beam as it lies at present, from its start to its end,
//! so that nothing depends on the directions of the global axes.

use super::approach::MaterialPoint;
use bimorph_multibody::Model;
use bimorph_multibody::planar::{self, Pose};
use nalgebra::Vector2;
use std::sync::Arc;

/// Places along a segment where its shape is taken.
const PLACES: usize = 8;
/// Fraction of the largest displacement across a beam at which its side is taken (1).
const HALF: f64 = 0.5;

/// The centreline of a beam.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamLine {
    /// Full element name.
    pub name: Arc<str>,
    /// Equally spaced points, ends included.
    pub points: Arc<[MaterialPoint]>,
    /// Direction as drawn (rad).
    pub angle: f64,
    /// Length (m).
    pub length: f64,
    /// Bending stiffness EI (N·m²).
    pub rigidity: f64,
    /// Width in the plane of bending (m).
    pub width: f64,
}

/// A side of a beam, seen along its drawn direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeamSide {
    /// Left.
    Left,
    /// Right.
    Right,
}

/// A segment at a configuration.
#[derive(Debug, Clone, Copy)]
pub struct SegmentState {
    /// Relative change of the distance between its ends (1).
    pub strain: f64,
    /// Rotations of its ends from its chord (rad).
    pub turns: [f64; 2],
}

impl BeamLine {
    /// Number of segments.
    #[inline]
    pub fn segments(&self) -> usize {
        self.points.len().saturating_sub(1)
    }

    /// Length of a segment (m).
    #[inline]
    pub fn segment_length(&self) -> f64 {
        self.length / self.segments().max(1) as f64
    }

    /// The chord of segment `k` at a configuration (m).
    fn chord(&self, k: usize, q: &[Pose], linear: bool) -> Vector2<f64> {
        let drawn = Vector2::new(self.angle.cos(), self.angle.sin()) * self.segment_length();
        drawn + self.points[k + 1].displacement(q, linear) - self.points[k].displacement(q, linear)
    }

    /// The state of segment `k`.
    #[inline]
    pub fn segment(&self, k: usize, q: &[Pose], linear: bool) -> SegmentState {
        let (chord, h) = (self.chord(k, q, linear), self.segment_length());
        let ends = [self.points[k].rotation(q), self.points[k + 1].rotation(q)];
        // counted on from the mean of the ends, so that whole turns are kept
        let mean = 0.5 * (ends[0] + ends[1]);
        let own = planar::rotate(-(self.angle + mean), chord);
        let turned = mean + own.y.atan2(own.x);
        SegmentState { strain: chord.norm() / h - 1.0, turns: ends.map(|end| end - turned) }
    }

    /// Energy (J) with which a motion `dq` from the configuration `q` bends the beam, and the side to which it carries the beam: that of the
    /// first place that moves across the beam by half of the largest such displacement.
    pub fn bending(&self, q: &[Pose], dq: &[Pose], linear: bool) -> (f64, BeamSide) {
        let (mut energy, mut shape) = (0.0, Vec::with_capacity(PLACES * self.segments()));
        for k in 0..self.segments() {
            let chord = self.chord(k, q, linear);
            let h = chord.norm().max(f64::MIN_POSITIVE);
            let across = planar::perpendicular(chord) / h;
            let [a, b] = [k, k + 1].map(|k| moved(&self.points[k], q, dq, linear));
            let ends = [a.0.dot(&across), b.0.dot(&across)];
            let turn = (ends[1] - ends[0]) / h;
            let (first, second) = (a.1 - turn, b.1 - turn);
            energy += 2.0 * self.rigidity / h * (first * first + first * second + second * second);
            for place in 1..=PLACES {
                let x = place as f64 / PLACES as f64;
                let bow = x * (1.0 - x) * ((1.0 - x) * first - x * second);
                shape.push((1.0 - x) * ends[0] + x * ends[1] + h * bow);
            }
        }
        (energy, first_side(&shape))
    }
}

/// Displacement and rotation of a point with a motion `dq`.
fn moved(point: &MaterialPoint, q: &[Pose], dq: &[Pose], linear: bool) -> (Vector2<f64>, f64) {
    let change = Model::pose(dq, point.body);
    let (lever, _) = planar::point_turn(&Model::pose(q, point.body), point.arm, linear);
    (Vector2::new(change.x, change.y) + lever * change.z, change.z)
}

/// The side of the first place with half of the largest displacement.
fn first_side(shape: &[f64]) -> BeamSide {
    let most = shape.iter().map(|v| v.abs()).fold(0.0, f64::max);
    match shape.iter().find(|v| v.abs() >= HALF * most) {
        Some(v) if *v < 0.0 => BeamSide::Right,
        _ => BeamSide::Left,
    }
}
