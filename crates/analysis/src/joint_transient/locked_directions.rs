//! Effect of joints that only rotate: the lost axial compliance of beams.

use super::super::formulation::{Formulation, locked_model};
use super::super::statics::{OperatingPoint, operating_point};
use super::super::transient::options::TransientOptions;
use bimorph_model::compile::CompiledModel;

/// Stiffness of locked directions in the equilibrium that a release starts from, over that of the drawn beam.
pub const RIGID: f64 = 1e4;

/// The compiled model with the locked directions of the formulation [`RIGID`] times as stiff.
pub(super) fn locked(compiled: &CompiledModel, formulation: Formulation) -> CompiledModel {
    let mut locked = compiled.clone();
    locked.parts.system.model = locked_model(formulation, &compiled.parts.system.model).stiffened(RIGID);
    locked
}

/// A warning where the equilibrium that a run comes from, or goes to, is further than the tolerance from that of the elastic beams: the
/// largest difference of two displacements of a node over the largest displacement. None where one of the two has no equilibrium.
pub(super) fn locked_directions_warning(
    compiled: &CompiledModel,
    formulation: Formulation,
    options: &TransientOptions<'_>,
) -> Option<String> {
    let mut beams = compiled.parts.system.model.sections.iter().filter(|section| section.is_segment());
    // a scheme whose joints only turn leaves nothing out beyond itself
    if formulation != Formulation::Rcr || beams.all(|section| section.only_turns()) {
        return None;
    }
    let drawn = options.release.unwrap_or(compiled);
    let elastic = operating_point(drawn, &options.voltages).ok()?;
    let turning = operating_point(&locked(drawn, formulation), &options.voltages).ok()?;
    let share = apart(drawn, &elastic, &turning)?;
    (share > options.errors().requested()).then(|| {
        format!(
            "joints that only turn leave out how beams stretch: its equilibrium is {share:.1e} of the largest displacement away from that \
             of the elastic beams, more than the tolerance {:e}; take --formulation compliant, or --method rodas4, whose joints stretch",
            options.errors().requested()
        )
    })
}

/// How far two equilibria are apart (1).
fn apart(compiled: &CompiledModel, elastic: &OperatingPoint, turning: &OperatingPoint) -> Option<f64> {
    let linear = compiled.parts.system.model.linear;
    let nodes = || compiled.parts.nodes.iter().flatten();
    let moved = nodes().map(|p| p.displacement(&elastic.q, linear).norm()).fold(0.0, f64::max);
    let between = |p: &bimorph_domains::MaterialPoint| {
        (p.displacement(&elastic.q, linear) - p.displacement(&turning.q, linear)).norm()
    };
    let most = nodes().map(between).fold(0.0, f64::max);
    (moved > 0.0).then_some(most / moved)
}
