//! Folded segments, a reason why the steps of a run become too small.
//!
//! A compression wave beyond the buckling load of a single segment, 24·E·I/h², turns neighbouring segments against each other in a zigzag that no mesh of that
//! length resolves. The axial and bending strains of a segment hold up to about half a radian between its ends.

use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, Model};

/// Angle between the ends of a folded segment, at least (rad).
const FOLDED: f64 = 0.5;

/// Addition to the message of a step that failed at `q`; empty without a folded segment.
pub(super) fn addition(compiled: &CompiledModel, q: &[Pose]) -> String {
    let model = &compiled.parts.system.model;
    let angle = |id: BodyId| Model::pose(q, id).z;
    let name = |id: BodyId| match id {
        BodyId::Free(k) => format!("\"{}\"", model.bodies[k].name),
        BodyId::Ground => "an anchor".to_owned(),
    };
    let segments = model.joints.iter().filter(|joint| model.section(joint).is_segment());
    let folds = segments.map(|joint| {
        let (a, b) = joint.bodies();
        ((angle(a) - angle(b)).abs(), a, b)
    });
    let Some((turned, a, b)) = folds.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|fold| fold.0 > FOLDED) else {
        return String::new();
    };
    format!(
        "; a segment is folded by {turned:.2} rad there, between {} and {}: it takes more --segments (or none given), or a tenth of --tol",
        name(a),
        name(b)
    )
}
