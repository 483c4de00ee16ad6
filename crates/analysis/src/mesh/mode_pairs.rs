//! Pairing of the modes of a mesh with those of twice the segments, and their frequency errors.
//!
//! Modes are paired by the modal assurance criterion over points that both meshes have: the nodes of one mesh along each beam, with the mass of
//! the beam shared between them, and the nodes that bear masses. In the order of frequencies alone, two modes that change places from
//! one mesh to the other would each get the error of the pair.

use super::super::BeamMotions;
use super::super::modes::ModesResult;
use bimorph_model::refine::doubling::relative;
use bimorph_solve::frequency::mac::pair;
use bimorph_structure::Structure;
use nalgebra::DMatrix;

/// Modes that have less than this in common are no pair; then the order of frequencies decides (1).
const ALIKE: f64 = 0.5;

/// Modes with the displacement of points along every beam.
type ModeShapes<'a> = (&'a ModesResult, &'a [BeamMotions]);

/// The relative error of each frequency of the coarser mesh, signed (1); none where the finer one has no such mode.
pub(super) fn errors(structure: &Structure, coarse: ModeShapes<'_>, fine: ModeShapes<'_>) -> Vec<Option<f64>> {
    let vectors = |shapes: ModeShapes<'_>| -> Vec<Vec<f64>> {
        (0..shapes.0.frequencies_hz.len()).map(|k| sampled(structure, coarse.1, shapes, k)).collect()
    };
    let (a, b) = (vectors(coarse), vectors(fine));
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let alike = DMatrix::from_fn(a.len(), b.len(), |i, k| {
        let mac = dot(&a[i], &b[k]).powi(2) / (dot(&a[i], &a[i]) * dot(&b[k], &b[k]));
        if mac.is_finite() { mac } else { 0.0 }
    });
    let (from, to) = (&coarse.0.frequencies_hz, &fine.0.frequencies_hz);
    let highest = to.last().copied().unwrap_or(0.0);
    let error = |(i, paired): (usize, Option<usize>)| {
        let k = paired.filter(|&k| alike[(i, k)] >= ALIKE).unwrap_or(i);
        let finer = *to.get(k)?;
        // a rigid-body motion has no frequency of its own
        let scale = finer.max(1e-3 * highest).max(f64::MIN_POSITIVE);
        Some(relative(1.0 + (from[i] - finer) / scale, 1.0))
    };
    pair(&alike).into_iter().enumerate().map(error).collect()
}

/// Mode `k` at the points of the coarser mesh, each displacement times the root of the mass there.
fn sampled(structure: &Structure, points: &[BeamMotions], (modes, curves): ModeShapes<'_>, k: usize) -> Vec<f64> {
    let mut values = Vec::new();
    let Some(coarse) = points.first() else { return values };
    for ((beam, along), coarse) in structure.beams.iter().zip(&curves[k]).zip(coarse) {
        let mass = beam.material.density * beam.width * beam.thickness * beam.length;
        let (last, intervals) = (along.len().saturating_sub(1), coarse.len().saturating_sub(1).max(1));
        let root = (mass / coarse.len().max(1) as f64).sqrt();
        for point in 0..coarse.len() {
            // the same place; between two points where one mesh is no multiple of the other
            let at = point as f64 * last as f64 / intervals as f64;
            let (before, share) = (at.floor() as usize, at.fract());
            let (Some(one), Some(next)) = (along.get(before), along.get((before + 1).min(last))) else { continue };
            let between = |a: f64, b: f64| root * (a + share * (b - a));
            values.extend([between(one.x, next.x), between(one.y, next.y)]);
        }
    }
    for mass in &structure.masses {
        let name = &structure.nodes[mass.node.0].name;
        if let Some((_, motion)) = modes.shapes[k].iter().find(|(node, _)| node == name) {
            let (m, j) = (mass.mass.sqrt(), mass.inertia.sqrt());
            values.extend([m * motion.x, m * motion.y, j * motion.rz]);
        }
    }
    values
}
