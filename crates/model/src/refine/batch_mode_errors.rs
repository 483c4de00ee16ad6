//! Estimated mode errors of a batch of variants: the estimate of [`super::mode_errors`] over lanes, about the drawn
//! geometry.
//!
//! Beams of a variant stand beside those of the others, with the same points. Matrices of a segment inside a beam have no terms between along and across;
//! those of the segments at its ends have, where the springs of junctions do.

// small matrices are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::mode_errors::{own_stiffness, relative};
use super::span::{BeamSpan, spans};
use crate::discretize::Assembly;
use crate::options::CompileOptions;
use bimorph_multibody::BodyId;
use bimorph_multibody::batch::{Kernel, LANES, Lane8, LanePose, SimdReal, ZERO_POSE, across, forces, load, store};
use bimorph_multibody::planar::DOF;
use bimorph_multibody::scalar::StoredReal;
use bimorph_solve::frequency::batch::{LaneModes, RitzMatrices, dot, weigh};
use bimorph_solve::frequency::mac;
use bimorph_structure::Structure;
use nalgebra::{DMatrix, Matrix6};

/// Frequencies this close, relatively, in λ, count as equal.
const NEAR: f64 = 1e-2;
/// Places of a segment's matrix along and across the beam.
const LONG: [usize; 2] = [0, 3];
const ACROSS: [usize; 4] = [1, 2, 4, 5];

/// A matrix of a segment: axial entries, then transverse ones, row by row.
type Segment<T = Lane8> = [T; 20];
/// The whole matrix of a segment, row by row.
type EndSegment<T = Lane8> = [T; 36];

/// A point of a beam.
#[derive(Debug, Clone, Copy)]
struct LanePoint {
    /// Its body; none: ground.
    body: Option<u32>,
    arm: [Lane8; 2],
    /// Mass, first and second moment of the model's lump there.
    lump: [Lane8; 3],
}

/// A beam in each variant, see [`BeamSpan`].
#[derive(Debug, Clone)]
struct LaneSpan {
    points: Vec<LanePoint>,
    along: [Lane8; 2],
    mass: Segment,
    second: Segment,
    /// Of the first and the last segment, mass and M₂.
    ends: [[EndSegment; 2]; 2],
}

/// Beams of as many variants as there are lanes, with storage.
#[derive(Debug, Clone)]
pub struct LaneReference {
    spans: Vec<LaneSpan>,
    local: Vec<LanePose>,
    force: Vec<LanePose>,
    plain: Vec<Vec<LanePose>>,
    x: Vec<Vec<LanePose>>,
    kx: Vec<Vec<LanePose>>,
    mx: Vec<Vec<LanePose>>,
    bent: Vec<Vec<LanePose>>,
    /// λ of the reference.
    lambda: Vec<Lane8>,
    /// xᵀM_r·x and yᵀM·x, row by row, and yᵀMy.
    own: Vec<Lane8>,
    common: Vec<Lane8>,
    lengths: Vec<Lane8>,
    small: RitzMatrices,
}

/// A structure, its options, and its model.
pub type BatchVariant<'a> = (&'a Structure, &'a CompileOptions, &'a Assembly);

/// The beams of a variant.
fn beams((structure, options, parts): BatchVariant<'_>) -> Vec<BeamSpan> {
    let bars = parts.bars(structure, options);
    spans(structure, options, (&parts.beams, parts.junctions(), &bars), true)
}

fn body(id: BodyId) -> Option<u32> {
    if let BodyId::Free(k) = id { Some(k as u32) } else { None }
}

impl LaneReference {
    /// For variants like `first` and so many modes; none where the model's stiffness is not that of its beams.
    pub fn new(first: BatchVariant<'_>, modes: usize) -> Option<Self> {
        if !own_stiffness(first.1, first.2) {
            return None;
        }
        let none = Lane8::NONE;
        let point =
            |p: &bimorph_domains::MaterialPoint| LanePoint { body: body(p.body), arm: [none; 2], lump: [none; 3] };
        let span = |span: &BeamSpan| LaneSpan {
            points: span.points.iter().map(point).collect(),
            along: [none; 2],
            mass: [none; 20],
            second: [none; 20],
            ends: [[[none; 36]; 2]; 2],
        };
        let spans: Vec<LaneSpan> = beams(first).iter().map(span).collect();
        let longest = spans.iter().map(|span| span.points.len()).max().unwrap_or(0);
        let block = vec![vec![ZERO_POSE; first.2.system.bodies()]; modes];
        Some(Self {
            spans,
            local: vec![ZERO_POSE; longest],
            force: vec![ZERO_POSE; longest],
            plain: block.clone(),
            x: block.clone(),
            kx: block.clone(),
            mx: block.clone(),
            bent: block,
            lambda: vec![none; modes],
            own: vec![none; modes * modes],
            common: vec![none; modes * modes],
            lengths: vec![none; modes],
            small: RitzMatrices::default(),
        })
    }

    /// Signed relative error of each mode's frequency and how much of it is in the reference, for each variant whose modes `modes` has
    /// found last; none for one that has other points.
    pub fn compare(&mut self, modes: &LaneModes, variants: &[BatchVariant<'_>]) -> Vec<Option<Vec<(f64, f64)>>> {
        let fits: Vec<bool> =
            variants.iter().enumerate().map(|(lane, variant)| self.set_lane(lane, *variant)).collect();
        for lane in variants.len()..LANES {
            if let Some(last) = variants.last() {
                self.set_lane(lane, *last);
            }
        }
        across(ReferenceKernel { reference: self, modes });
        self.small.sort(&mut self.lambda);
        let found = |(lane, fits): (usize, bool)| fits.then(|| self.mode_errors(modes, lane));
        fits.into_iter().enumerate().map(found).collect()
    }

    /// Puts the beams of a variant into one lane; false where they have other points.
    fn set_lane(&mut self, lane: usize, variant: BatchVariant<'_>) -> bool {
        let spans = beams(variant);
        let alike = |(own, other): (&LaneSpan, &BeamSpan)| {
            own.points.len() == other.points.len()
                && own.points.iter().zip(&other.points).all(|(own, other)| own.body == body(other.body))
        };
        if spans.len() != self.spans.len() || !self.spans.iter().zip(&spans).all(alike) {
            return false;
        }
        for (to, from) in self.spans.iter_mut().zip(&spans) {
            set(lane, &mut to.along, from.along.as_slice());
            set(lane, &mut to.mass, &segment(&from.mass.inner));
            set(lane, &mut to.second, &segment(&from.second.inner));
            let ends = [[from.mass.first, from.second.first], [from.mass.last, from.second.last]];
            for (to, from) in to.ends.as_flattened_mut().iter_mut().zip(ends.as_flattened()) {
                set(lane, to, from.transpose().as_slice());
            }
            for ((to, point), lump) in to.points.iter_mut().zip(&from.points).zip(&from.lumps) {
                set(lane, &mut to.arm, point.arm.as_slice());
                set(lane, &mut to.lump, &[lump.mass, lump.first, lump.second]);
            }
        }
        true
    }

    /// Errors of the modes in one lane: [`super::reference::compare`] from where the small matrices are known.
    fn mode_errors(&self, modes: &LaneModes, lane: usize) -> Vec<(f64, f64)> {
        let count = self.lambda.len();
        let of = |numbers: &[Lane8]| numbers.iter().map(|x| x.lane(lane)).collect::<Vec<f64>>();
        let (found, lambda, lengths) = (of(&self.lambda), of(modes.lambda()), of(&self.lengths));
        let (own, common) = (of(&self.own), of(&self.common));
        let v = |i: usize, k: usize| self.small.vector(i, k).lane(lane);
        let size = |k: usize| {
            let row = |i: usize| (0..count).map(|j| own[i * count + j] * v(j, k)).sum::<f64>();
            (0..count).map(|i| v(i, k) * row(i)).sum::<f64>()
        };
        let sizes: Vec<f64> = (0..count).map(size).collect();
        let share = |i: usize, k: usize| (0..count).map(|j| common[i * count + j] * v(j, k)).sum::<f64>();
        let alike = DMatrix::from_fn(count, count, |i, k| (share(i, k).powi(2) / (lengths[i] * sizes[k])).min(1.0));
        let pairs = mac::pair(&alike);
        let reference: Vec<f64> = pairs.iter().map(|k| k.map_or(f64::NAN, |k| found[k])).collect();
        // equal frequencies share their shapes
        let near = |k: usize, r: f64| (found[k] - r).abs() <= NEAR * r.abs();
        let like = |i: usize| {
            let near = (0..count).filter(|&k| near(k, reference[i]));
            near.map(|k| alike[(i, k)]).sum::<f64>().min(1.0)
        };
        relative(&lambda, &reference).into_iter().enumerate().map(|(i, error)| (error, like(i))).collect()
    }
}

fn set(lane: usize, to: &mut [Lane8], from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.set_lane(lane, *from);
    }
}

/// Axial and transverse entries of a segment's matrix.
fn segment(matrix: &Matrix6<f64>) -> [f64; 20] {
    let mut segment = [0.0; 20];
    for (i, row) in LONG.into_iter().enumerate() {
        for (j, column) in LONG.into_iter().enumerate() {
            segment[2 * i + j] = matrix[(row, column)];
        }
    }
    for (i, row) in ACROSS.into_iter().enumerate() {
        for (j, column) in ACROSS.into_iter().enumerate() {
            segment[4 + 4 * i + j] = matrix[(row, column)];
        }
    }
    segment
}

struct ReferenceKernel<'a> {
    reference: &'a mut LaneReference,
    modes: &'a LaneModes,
}

impl Kernel for ReferenceKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let LaneReference { spans, local, force, plain, x, kx, mx, bent, lambda, own, common, lengths, small } =
            self.reference;
        let (model, factor, shapes, values) = self.modes.found();
        let (one, zero) = (W::splat(simd, 1.0), W::splat(simd, 0.0));
        let count = lambda.len();
        for k in 0..count {
            let value = W::load(simd, &values[k]);
            let scratch = (&mut local[..], &mut force[..]);
            weigh::<W>(simd, model, &shapes[k], &mut plain[k]);
            kx[k].copy_from_slice(&plain[k]);
            add_beams::<W>(simd, spans, &shapes[k], [one, value, one], scratch, &mut kx[k]);
            for force in kx[k].iter_mut().flatten() {
                (W::load(simd, force) * value).store(force);
            }
            forces::project::<W>(simd, model, &mut kx[k]);
            x[k].copy_from_slice(&kx[k]);
            factor.solve::<W>(simd, &model.pattern, &mut x[k]);
            forces::project::<W>(simd, model, &mut x[k]);
            weigh::<W>(simd, model, &x[k], &mut mx[k]);
            let scratch = (&mut local[..], &mut force[..]);
            add_beams::<W>(simd, spans, &x[k], [one, zero, one], scratch, &mut mx[k]);
            bent[k].fill(ZERO_POSE);
            let scratch = (&mut local[..], &mut force[..]);
            add_beams::<W>(simd, spans, &x[k], [zero, one, zero], scratch, &mut bent[k]);
        }
        small.resize(count);
        for i in 0..count {
            dot::<W>(simd, &shapes[i], &plain[i]).store(&mut lengths[i]);
            for j in 0..count {
                dot::<W>(simd, &plain[i], &x[j]).store(&mut common[i * count + j]);
                dot::<W>(simd, &x[i], &mx[j]).store(&mut own[i * count + j]);
            }
        }
        for i in 0..count {
            for j in 0..=i {
                let half = |a: &Vec<LanePose>, b: &Vec<LanePose>| dot::<W>(simd, a, b) * 0.5;
                // λ·M₂ between two modes at the geometric mean of theirs, which keeps the sum definite
                let mean = (W::load(simd, &values[i]) * W::load(simd, &values[j])).sqrt();
                let bending = (half(&x[i], &bent[j]) + half(&x[j], &bent[i])) * mean;
                let both = W::load(simd, &own[i * count + j]) + W::load(simd, &own[j * count + i]);
                (half(&x[i], &kx[j]) + half(&x[j], &kx[i])).store(small.a(i, j));
                (both * 0.5 + bending).store(small.b(i, j));
            }
        }
        small.solve::<W>(simd, lambda);
    }
}

/// `out +=` (a·(consistent mass) + b·M₂ − c·(the model's lumps))·x of all beams.
#[inline(always)]
fn add_beams<W: SimdReal>(
    simd: W::Simd,
    spans: &[LaneSpan],
    x: &[LanePose],
    [a, b, c]: [W; 3],
    (local, force): (&mut [LanePose], &mut [LanePose]),
    out: &mut [LanePose],
) {
    let none = [W::splat(simd, 0.0); DOF];
    for span in spans {
        let [cos, sin] = load::<W, 2>(simd, &span.along);
        let matrix = weighted::<W, 20>(simd, &span.mass, &span.second, [a, b]);
        for ((point, local), force) in span.points.iter().zip(&mut *local).zip(&mut *force) {
            let mut moved = none;
            if let Some(body) = point.body {
                let ([x, y, turn], [ax, ay]) =
                    (load::<W, DOF>(simd, &x[body as usize]), load::<W, 2>(simd, &point.arm));
                let (dx, dy) = (x - turn * ay, y + turn * ax);
                moved = [dx * cos + dy * sin, dy * cos - dx * sin, turn];
            }
            let [mass, first, second] = load::<W, 3>(simd, &point.lump);
            let [u, w, turn] = moved;
            let lump = [mass * u, mass * w + first * turn, first * w + second * turn];
            store([-(lump[0] * c), -(lump[1] * c), -(lump[2] * c)], force);
            store(moved, local);
        }
        let segments = span.points.len() - 1;
        add_end::<W>(simd, &span.ends[0], [a, b], &local[..2], &mut force[..2]);
        if segments > 1 {
            let last = segments - 1..segments + 1;
            add_end::<W>(simd, &span.ends[1], [a, b], &local[last.clone()], &mut force[last]);
        }
        for k in 1..segments.max(2) - 1 {
            let (p, q) = (load::<W, DOF>(simd, &local[k]), load::<W, DOF>(simd, &local[k + 1]));
            let (long, bending) = ([p[0], q[0]], [p[1], p[2], q[1], q[2]]);
            let (mut f, mut g) = (load::<W, DOF>(simd, &force[k]), load::<W, DOF>(simd, &force[k + 1]));
            for j in 0..2 {
                f[0] += matrix[j] * long[j];
                g[0] += matrix[2 + j] * long[j];
            }
            for j in 0..4 {
                f[1] += matrix[4 + j] * bending[j];
                f[2] += matrix[8 + j] * bending[j];
                g[1] += matrix[12 + j] * bending[j];
                g[2] += matrix[16 + j] * bending[j];
            }
            store(f, &mut force[k]);
            store(g, &mut force[k + 1]);
        }
        for (point, force) in span.points.iter().zip(&*force) {
            let Some(body) = point.body else { continue };
            let ([fu, fw, moment], [ax, ay]) = (load::<W, DOF>(simd, force), load::<W, 2>(simd, &point.arm));
            let (fx, fy) = (fu * cos - fw * sin, fu * sin + fw * cos);
            let mut sum = load::<W, DOF>(simd, &out[body as usize]);
            sum[0] += fx;
            sum[1] += fy;
            sum[2] += moment + ax * fy - ay * fx;
            store(sum, &mut out[body as usize]);
        }
    }
}

/// a·(mass) + b·M₂, entry by entry.
#[inline(always)]
fn weighted<W: SimdReal, const N: usize>(
    simd: W::Simd,
    mass: &[Lane8; N],
    second: &[Lane8; N],
    [a, b]: [W; 2],
) -> [W; N] {
    let mut matrix = load::<W, N>(simd, mass);
    for (entry, second) in matrix.iter_mut().zip(second) {
        *entry = *entry * a + W::load(simd, second) * b;
    }
    matrix
}

/// `force +=` the matrix of a segment at the end of a beam, times the motion of its two points.
#[inline(always)]
fn add_end<W: SimdReal>(
    simd: W::Simd,
    [mass, second]: &[EndSegment; 2],
    weights: [W; 2],
    local: &[LanePose],
    force: &mut [LanePose],
) {
    let matrix = weighted::<W, 36>(simd, mass, second, weights);
    let moved = local.as_flattened();
    for (force, row) in force.as_flattened_mut().iter_mut().zip(matrix.chunks_exact(2 * DOF)) {
        let mut sum = W::load(simd, force);
        for (entry, moved) in row.iter().zip(moved) {
            sum += *entry * W::load(simd, moved);
        }
        sum.store(force);
    }
}
