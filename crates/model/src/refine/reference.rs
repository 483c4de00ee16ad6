//! The modes of a model with the beams' consistent mass, after one inverse iteration and Rayleigh–Ritz.
//!
//! ```text
//! K·x = λ·M_r·y
//! ```
//! for each mode (λ, y) of the model, then Rayleigh–Ritz with K and M_r over the block of all x.

use super::span::{BeamSpan, SpanScratch};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Pattern};
use bimorph_solve::frequency::mac;
use bimorph_solve::subspace::{columns, ritz};
use nalgebra::DMatrix;

/// Frequencies this close, relatively, in λ, count as equal.
const NEAR: f64 = 1e-2;

/// K − σM of a mesh, factored, and its mass matrix.
pub(super) struct Pencil<'a> {
    pub(super) factor: &'a BodyMatrix,
    pub(super) pattern: &'a Pattern,
    pub(super) shift: f64,
    pub(super) mass: &'a dyn Fn(&[Pose]) -> Vec<Pose>,
    pub(super) project: &'a dyn Fn(&mut [Pose]),
}

/// Reference values of each mode.
pub(super) struct ReferenceModes {
    /// λ_r.
    pub(super) reference: Vec<f64>,
    pub(super) likeness: Vec<f64>,
    /// The inverse iterates.
    pub(super) x: Vec<Vec<Pose>>,
    /// xᵀM_r·y.
    pub(super) norms: Vec<f64>,
}

/// Modes by inverse iteration and Rayleigh–Ritz with the reference.
pub(super) fn compare(
    pencil: &Pencil<'_>,
    spans: &[BeamSpan],
    lambda: &[f64],
    shapes: &[Vec<Pose>],
) -> Option<ReferenceModes> {
    let count = lambda.len();
    let tight: Vec<&BeamSpan> = spans.iter().filter(|span| !span.softer.is_zero()).collect();
    let softer = |x: &[Pose], scratch: &mut SpanScratch| {
        let mut f = vec![Pose::zeros(); x.len()];
        for span in &tight {
            span.add_segments(x, &span.softer, scratch, &mut f);
        }
        f
    };
    let weigh = |x: &[Pose], lambda: f64, scratch: &mut SpanScratch| {
        let mut z = (pencil.mass)(x);
        let base = z.clone();
        for span in spans {
            span.add_defect(x, lambda, scratch, &mut z);
        }
        (z, base)
    };
    let scratch = &mut SpanScratch::default();
    let (mut x, mut kx, mut norms) = (Vec::new(), Vec::new(), Vec::new());
    let (mut mx, mut second, mut plain) = (Vec::new(), Vec::new(), Vec::new());
    for (y, &lambda) in shapes.iter().zip(lambda) {
        let (full, base) = weigh(y, lambda, scratch);
        let give = softer(y, scratch);
        let mut z: Vec<Pose> =
            full.iter().zip(&base).zip(&give).map(|((f, b), s)| f * lambda + s - b * pencil.shift).collect();
        (pencil.project)(&mut z);
        let mut solved = z.clone();
        pencil.factor.solve(pencil.pattern, &mut solved);
        (pencil.project)(&mut solved);
        norms.push(dot(&solved, &full));
        plain.push(base);
        let (full, base) = weigh(&solved, 0.0, scratch);
        let give = softer(&solved, scratch);
        kx.push(z.iter().zip(&base).zip(&give).map(|((z, b), s)| z + b * pencil.shift - s).collect::<Vec<Pose>>());
        mx.push(full);
        let mut bent = vec![Pose::zeros(); solved.len()];
        for span in spans {
            span.add_segments(&solved, &span.second, scratch, &mut bent);
        }
        second.push(bent);
        x.push(solved);
    }
    let transposed = columns(&x).transpose();
    let a = &transposed * columns(&kx);
    let mut b = &transposed * columns(&mx);
    // where the mesh has a mode far too high, λ is the Rayleigh quotient of its iterate: its own λ would lower the values of other modes
    let own: Vec<f64> = (0..count).map(|i| lambda[i].min(a[(i, i)] / b[(i, i)]).max(0.0)).collect();
    // λ·M₂ between two modes at the geometric mean of theirs, which keeps the sum definite
    let mean = |i: usize, j: usize| (own[i] * own[j]).sqrt();
    let bent = &transposed * columns(&second);
    for i in 0..count {
        for j in 0..count {
            b[(i, j)] += mean(i, j) * bent[(i, j)];
        }
    }
    let (found, v) = ritz(&a, &b)?;
    // how much of mode i is in reference mode k
    let lengths: Vec<f64> = shapes.iter().zip(&plain).map(|(y, m)| dot(y, m)).collect();
    let common = columns(&plain).transpose() * columns(&x) * &v;
    let own = v.transpose() * (&transposed * columns(&mx)) * &v;
    let alike = DMatrix::from_fn(count, count, |i, k| (common[(i, k)].powi(2) / (lengths[i] * own[(k, k)])).min(1.0));
    let pairs = mac::pair(&alike);
    let reference: Vec<f64> = pairs.iter().map(|k| k.map_or(f64::NAN, |k| found[k])).collect();
    // equal frequencies share their shapes
    let near = |k: usize, r: f64| (found[k] - r).abs() <= NEAR * r.abs();
    let sum = |(i, r): (usize, &f64)| (0..count).filter(|&k| near(k, *r)).map(|k| alike[(i, k)]).sum::<f64>().min(1.0);
    let likeness = reference.iter().enumerate().map(sum).collect();
    Some(ReferenceModes { reference, likeness, x, norms })
}

fn dot(a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
