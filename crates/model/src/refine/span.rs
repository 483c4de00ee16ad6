//! A beam over the points of what is cut of it, with the matrices of its segments along and across the beam.
//!
//! Directions along and across a beam are those of the drawing, also about an equilibrium: right as long as beams turn by
//! small angles.

use crate::discretize::cubic;
use crate::discretize::scheme::{Bar, BeamSegment};
use crate::options::CompileOptions;
use bimorph_domains::MaterialPoint;
use bimorph_multibody::BodyId;
use bimorph_multibody::planar::Pose;
use bimorph_structure::{Beam, Structure};
use nalgebra::{Matrix6, Vector2, Vector3, Vector6};

/// A beam over the points of what is cut of it: between the edges of junctions, where there are any.
pub(super) struct BeamSpan {
    pub(super) points: Vec<MaterialPoint>,
    pub(super) length: f64,
    pub(super) along: Vector2<f64>,
    /// Consistent mass of a segment, or zero where another matrix has it.
    pub(super) mass: Matrix6<f64>,
    /// M₂ of a segment.
    pub(super) second: Matrix6<f64>,
    /// N²·B of a segment.
    pub(super) softer: Matrix6<f64>,
    /// Lumps of the model at the points.
    pub(super) lumps: Vec<BeamSegment>,
}

/// Motions and forces at the points of a span.
#[derive(Default)]
pub(super) struct SpanScratch {
    x: Vec<Vector3<f64>>,
    f: Vec<Vector3<f64>>,
}

impl BeamSpan {
    /// `out +=` (M_r − M)·x of this beam, N·A included.
    pub(super) fn add_defect(&self, x: &[Pose], lambda: f64, scratch: &mut SpanScratch, out: &mut [Pose]) {
        self.fill(x, &(self.mass + self.second * lambda), scratch);
        for ((f, x), lump) in scratch.f.iter_mut().zip(&scratch.x).zip(&self.lumps) {
            lighten(f, x, lump);
        }
        self.scatter(&scratch.f, out);
    }

    /// `out +=` the same matrix for every segment, times x.
    pub(super) fn add_segments(&self, x: &[Pose], segment: &Matrix6<f64>, scratch: &mut SpanScratch, out: &mut [Pose]) {
        self.fill(x, segment, scratch);
        self.scatter(&scratch.f, out);
    }

    /// Motion of the points, and what the matrix of every segment makes of it.
    fn fill(&self, x: &[Pose], segment: &Matrix6<f64>, scratch: &mut SpanScratch) {
        scratch.x.clear();
        scratch.x.extend(self.points_of(x));
        scratch.f.clear();
        scratch.f.resize(scratch.x.len(), Vector3::zeros());
        multiply(segment, &scratch.x, &mut scratch.f);
    }

    /// Motion of the points along and across the beam.
    pub(super) fn local(&self, x: &[Pose]) -> Vec<Vector3<f64>> {
        self.points_of(x).collect()
    }

    fn points_of<'a>(&'a self, x: &'a [Pose]) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let at = move |p: &MaterialPoint| match p.body {
            BodyId::Ground => Vector3::zeros(),
            BodyId::Free(k) => {
                let (dx, dy) = (x[k].x - x[k].z * p.arm.y, x[k].y + x[k].z * p.arm.x);
                Vector3::new(dx * self.along.x + dy * self.along.y, dy * self.along.x - dx * self.along.y, x[k].z)
            }
        };
        self.points.iter().map(at)
    }

    /// (M_r − M)·x of this beam, over its points, N·A included.
    pub(super) fn defect(&self, x: &[Vector3<f64>], lambda: f64) -> Vec<Vector3<f64>> {
        let mut f = self.segments(x, &(self.mass + self.second * lambda));
        for ((f, x), lump) in f.iter_mut().zip(x).zip(&self.lumps) {
            lighten(f, x, lump);
        }
        f
    }

    /// Takes the axial force of the beam into account.
    pub(super) fn tighten(&mut self, bar: &Bar, force: f64) {
        let (cross, twice) = cubic::second_tension(bar, self.length / (self.points.len() - 1) as f64, force);
        self.mass += cross;
        self.softer = twice;
    }

    /// The same matrix for every segment, times x.
    pub(super) fn segments(&self, x: &[Vector3<f64>], segment: &Matrix6<f64>) -> Vec<Vector3<f64>> {
        let mut f = vec![Vector3::zeros(); x.len()];
        multiply(segment, x, &mut f);
        f
    }

    /// Adds forces at the points to those on the bodies.
    pub(super) fn scatter(&self, f: &[Vector3<f64>], out: &mut [Pose]) {
        for (p, f) in self.points.iter().zip(f) {
            if let BodyId::Free(k) = p.body {
                let (fx, fy) = (f.x * self.along.x - f.y * self.along.y, f.x * self.along.y + f.y * self.along.x);
                out[k] += Pose::new(fx, fy, f.z + p.arm.x * fy - p.arm.y * fx);
            }
        }
    }
}

/// `f +=` the same matrix for every segment, times x.
fn multiply(segment: &Matrix6<f64>, x: &[Vector3<f64>], f: &mut [Vector3<f64>]) {
    for k in 0..x.len() - 1 {
        let (a, b) = (x[k], x[k + 1]);
        let both = segment * Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z);
        f[k] += both.fixed_rows::<3>(0);
        f[k + 1] += both.fixed_rows::<3>(3);
    }
}

/// Takes away what a lump of the model has for itself.
fn lighten(f: &mut Vector3<f64>, x: &Vector3<f64>, lump: &BeamSegment) {
    f.x -= lump.mass * x.x;
    f.y -= lump.mass * x.y + lump.first * x.z;
    f.z -= lump.first * x.y + lump.second * x.z;
}

/// Every beam over its `points`, less the offsets at both ends, as a bar.
pub(super) fn spans<P: AsRef<[MaterialPoint]>>(
    structure: &Structure,
    options: &CompileOptions,
    (beams, offsets, bars): (&[P], &[[f64; 2]], &[Bar]),
    lumped: bool,
) -> Vec<BeamSpan> {
    let span = |(((beam, points), [first, last]), bar): (((&Beam, &P), &[f64; 2]), &Bar)| {
        let points = points.as_ref();
        let n = points.len() - 1;
        let h = bar.length / n as f64;
        let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
        let mut points = points.to_vec();
        points[0] = points[0].beyond(along * *first);
        points[n] = points[n].beyond(along * -*last);
        let mut lumps = Vec::new();
        if lumped {
            options.scheme.parts_into(bar, n, &mut lumps);
        }
        BeamSpan {
            points,
            length: bar.length,
            along,
            mass: if lumped { cubic::mass(bar, h) } else { Matrix6::zeros() },
            second: cubic::second_mass(bar, h),
            softer: Matrix6::zeros(),
            lumps,
        }
    };
    structure.beams.iter().zip(beams).zip(offsets).zip(bars).map(span).collect()
}
