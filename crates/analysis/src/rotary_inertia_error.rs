//! Frequency error from missing rotary inertia.
//!
//! Bodies along a beam have none by default (docs/explanation/junctions.md): the sections of a wide beam rotate without inertia.
//! Let J = Σ ∫ ρ·t·w³/12·θ² dx for a mode of mass 1, with θ its rotation along the beams. Rayleigh's quotient with
//! rotary inertia is ω²/(1 + J) (Lord Rayleigh, *The Theory of Sound*, 1877, § 186). The reported frequency is
//! therefore too high by about √(1 + J) − 1.

use bimorph_domains::MaterialPoint;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_structure::Beam;

/// Accuracy of the models themselves (1): junctions agree with plane stress within about this (docs/explanation/junctions.md), and
/// smaller effects are not reported.
pub(super) const WORTH: f64 = 7e-3;

/// Warning about `modes` (xᵀMx = 1) whose frequency error from missing rotary inertia exceeds the tolerance and the
/// accuracy of the models.
pub(super) fn rotary_inertia_note(compiled: &CompiledModel, modes: &[Vec<Pose>]) -> Option<String> {
    let options = &compiled.options;
    let all = modes.iter().map(|x| too_high(compiled, x));
    let (mode, over) = all.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (over > options.errors().requested().max(WORTH)).then(|| {
        format!(
            "rotary inertia of wide beams is neglected: mode {} has the largest error, its frequency is too high by about {:.1} %; use --rotary-inertia",
            mode + 1,
            100.0 * over
        )
    })
}

/// Relative excess of the frequency of a mode (xᵀMx = 1) without rotary inertia (1).
pub(super) fn too_high(compiled: &CompiledModel, x: &[Pose]) -> f64 {
    let options = &compiled.options;
    // --as-sugar requests SUGAR's mass matrix, which has none either
    if options.rotary_inertia || options.as_sugar { 0.0 } else { (1.0 + share(compiled, x)).sqrt() - 1.0 }
}

/// J of a mode: the rotary inertia of beams that bend. Rigid ones (of no segment) have theirs.
fn share(compiled: &CompiledModel, x: &[Pose]) -> f64 {
    let parts = &compiled.parts;
    let of = |(beam, offsets): (&Beam, &[f64; 2]), points: &[MaterialPoint]| {
        let per_length = beam.material.density * beam.thickness * beam.width.powi(3) / 12.0;
        let step = (beam.length - offsets[0] - offsets[1]) / (points.len() - 1) as f64;
        let turn = |k: usize| points[k].rotation(x).powi(2);
        let ends = 0.5 * (turn(0) + turn(points.len() - 1));
        per_length * step * (ends + (1..points.len() - 1).map(turn).sum::<f64>())
    };
    let bends = compiled.order.segments.iter().map(|n| *n > 0);
    (compiled.structure.beams.iter().zip(&parts.offsets).zip(&parts.beams).zip(bends))
        .filter(|(_, bends)| *bends)
        .map(|((beam, points), _)| of(beam, points))
        .sum()
}
