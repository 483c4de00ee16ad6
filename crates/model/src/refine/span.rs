//! A beam over the points of what is cut of it, with the matrices of its segments along and across the beam.
//!
//! A segment at the end of a beam may end in the spring of a junction, with the compliance S over the motion of its end. Its own ends then move by
//! ```text
//! x' = T·x,   T = (I + S·K)⁻¹
//! ```
//! where x is the motion of the points and K the stiffness of the segment. The mass M and the next term M₂ of the segment become TᵀMT and
//! TᵀM₂T + TᵀM·T·S·MT.
//!
//! Directions along and across a beam are those of the drawing, also about an equilibrium: right as long as beams turn by
//! small angles.

use crate::discretize::cubic;
use crate::discretize::junction_springs::JunctionEnd;
use crate::discretize::scheme::{Bar, BeamSegment};
use crate::options::CompileOptions;
use bimorph_domains::MaterialPoint;
use bimorph_multibody::BodyId;
use bimorph_multibody::planar::Pose;
use bimorph_structure::{Beam, Structure};
use nalgebra::{Matrix3, Matrix6, Vector2, Vector3, Vector6};

/// A matrix of each segment of a beam: of the first, of those inside, and of the last. A single segment has `first`.
#[derive(Debug, Clone, Copy)]
pub(super) struct SegmentMatrices {
    pub(super) first: Matrix6<f64>,
    pub(super) inner: Matrix6<f64>,
    pub(super) last: Matrix6<f64>,
}

impl SegmentMatrices {
    fn zeros() -> Self {
        let zeros = Matrix6::zeros();
        Self { first: zeros, inner: zeros, last: zeros }
    }

    /// A matrix over the motion of a segment's own ends, carried over to the motion of the points.
    fn of(inner: Matrix6<f64>, ends: &[SprungEnd; 2]) -> Self {
        let [first, last] = ends.each_ref().map(|end| end.motion.transpose() * inner * end.motion);
        Self { first, inner, last }
    }

    /// The sum of this and another one times a factor.
    fn plus(&self, other: &Self, factor: f64) -> Self {
        Self {
            first: self.first + other.first * factor,
            inner: self.inner + other.inner * factor,
            last: self.last + other.last * factor,
        }
    }

    /// The matrix of segment `k` of `n`.
    fn at(&self, k: usize, n: usize) -> &Matrix6<f64> {
        if k == 0 {
            &self.first
        } else if k + 1 == n {
            &self.last
        } else {
            &self.inner
        }
    }

    pub(super) fn is_zero(&self) -> bool {
        self.inner == Matrix6::zeros()
    }
}

/// The segment at an end of a beam with the springs that it ends in.
#[derive(Debug, Clone, Copy)]
struct SprungEnd {
    /// T: the motion of the segment's own ends by that of the points.
    motion: Matrix6<f64>,
    /// T·S.
    compliance: Matrix6<f64>,
}

impl SprungEnd {
    /// Of segment `k` of `n`, with the junctions at the start and the end of the beam.
    fn new(bar: &Bar, n: usize, k: usize, [start, end]: &[JunctionEnd; 2]) -> Self {
        let mut springs = Matrix6::zeros();
        if k == 0 {
            springs.fixed_view_mut::<3, 3>(0, 0).copy_from(&start.spring);
        }
        if k + 1 == n {
            // seen from the end of the beam
            let turned = Matrix3::from_diagonal(&[-1.0, -1.0, 1.0].into());
            springs.fixed_view_mut::<3, 3>(3, 3).copy_from(&(turned * end.spring * turned));
        }
        let none = Self { motion: Matrix6::identity(), compliance: Matrix6::zeros() };
        if springs == Matrix6::zeros() {
            return none;
        }
        let whole = Matrix6::identity() + springs * cubic::stiffness(bar, bar.length / n as f64);
        whole.try_inverse().map_or(none, |motion| Self { motion, compliance: motion * springs })
    }
}

/// A beam over the points of what is cut of it: between the edges of junctions, where there are any.
pub(super) struct BeamSpan {
    pub(super) points: Vec<MaterialPoint>,
    pub(super) length: f64,
    pub(super) along: Vector2<f64>,
    ends: [SprungEnd; 2],
    /// Consistent mass of each segment, or zero where another matrix has it.
    pub(super) mass: SegmentMatrices,
    /// M₂ of each segment.
    pub(super) second: SegmentMatrices,
    /// N²·B of each segment.
    pub(super) softer: SegmentMatrices,
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
        self.fill(x, &self.mass.plus(&self.second, lambda), scratch);
        for ((f, x), lump) in scratch.f.iter_mut().zip(&scratch.x).zip(&self.lumps) {
            lighten(f, x, lump);
        }
        self.scatter(&scratch.f, out);
    }

    /// `out +=` the matrices of the segments, times x.
    pub(super) fn add_segments(
        &self,
        x: &[Pose],
        matrices: &SegmentMatrices,
        scratch: &mut SpanScratch,
        out: &mut [Pose],
    ) {
        self.fill(x, matrices, scratch);
        self.scatter(&scratch.f, out);
    }

    /// Motion of the points, and the matrices of the segments times it.
    fn fill(&self, x: &[Pose], matrices: &SegmentMatrices, scratch: &mut SpanScratch) {
        scratch.x.clear();
        scratch.x.extend(self.points_of(x));
        scratch.f.clear();
        scratch.f.resize(scratch.x.len(), Vector3::zeros());
        multiply(matrices, &scratch.x, &mut scratch.f);
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
        let mut f = self.segments(x, &self.mass.plus(&self.second, lambda));
        for ((f, x), lump) in f.iter_mut().zip(x).zip(&self.lumps) {
            lighten(f, x, lump);
        }
        f
    }

    /// Takes the axial force of the beam into account.
    pub(super) fn tighten(&mut self, bar: &Bar, force: f64) {
        let (cross, twice) = cubic::second_tension(bar, self.length / (self.points.len() - 1) as f64, force);
        self.mass = self.mass.plus(&SegmentMatrices::of(cross, &self.ends), 1.0);
        self.softer = SegmentMatrices::of(twice, &self.ends);
    }

    /// The matrices of the segments, times x.
    pub(super) fn segments(&self, x: &[Vector3<f64>], matrices: &SegmentMatrices) -> Vec<Vector3<f64>> {
        let mut f = vec![Vector3::zeros(); x.len()];
        multiply(matrices, x, &mut f);
        f
    }

    /// Stiffness of each segment of `bar`, with the springs that it ends in.
    pub(super) fn stiffness(&self, bar: &Bar) -> SegmentMatrices {
        let inner = cubic::stiffness(bar, self.length / (self.points.len() - 1) as f64);
        let [first, last] = self.ends.each_ref().map(|end| inner * end.motion);
        SegmentMatrices { first, inner, last }
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

/// `f +=` the matrices of the segments, times x.
fn multiply(matrices: &SegmentMatrices, x: &[Vector3<f64>], f: &mut [Vector3<f64>]) {
    let n = x.len() - 1;
    for k in 0..n {
        let (a, b) = (x[k], x[k + 1]);
        let both = matrices.at(k, n) * Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z);
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

/// Every beam over its `points`, less the junctions at both ends, as a bar.
pub(super) fn spans<P: AsRef<[MaterialPoint]>>(
    structure: &Structure,
    options: &CompileOptions,
    (beams, junctions, bars): (&[P], &[[JunctionEnd; 2]], &[Bar]),
    lumped: bool,
) -> Vec<BeamSpan> {
    let span = |(((beam, points), junctions), bar): (((&Beam, &P), &[JunctionEnd; 2]), &Bar)| {
        let points = points.as_ref();
        let n = points.len() - 1;
        let h = bar.length / n as f64;
        let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
        let mut points = points.to_vec();
        points[0] = points[0].beyond(along * junctions[0].offset);
        points[n] = points[n].beyond(along * -junctions[1].offset);
        let mut lumps = Vec::new();
        if lumped {
            options.scheme.parts_into(bar, n, &mut lumps);
        }
        let ends = [0, n - 1].map(|k| SprungEnd::new(bar, n, k, junctions));
        let mut second = SegmentMatrices::of(cubic::second_mass(bar, h), &ends);
        let mut mass = SegmentMatrices::zeros();
        if lumped {
            let own = cubic::mass(bar, h);
            mass = SegmentMatrices::of(own, &ends);
            let [first, last] = ends.each_ref().map(|end| {
                let pushed = own * end.motion;
                pushed.transpose() * end.compliance * pushed
            });
            second.first += first;
            second.last += last;
        }
        let softer = SegmentMatrices::zeros();
        BeamSpan { points, length: bar.length, along, ends, mass, second, softer, lumps }
    };
    structure.beams.iter().zip(beams).zip(junctions).zip(bars).map(span).collect()
}
