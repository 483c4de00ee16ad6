//! The axial force that each beam carries at an operating point.

use crate::discretize::Assembly;
use bimorph_domains::{Drive, MaterialPoint};
use bimorph_multibody::BodyId;
use bimorph_multibody::forces::axial_force;
use bimorph_multibody::planar::Pose;
use bimorph_structure::Structure;
use std::collections::HashMap;

/// Axis of a joint, x and y, and the axial force in it (N).
type Along = (f64, f64, f64);

/// Cosine of the largest angle between a joint's axis and its beam.
const ALONG: f64 = 0.99;

/// Mean over the segments of each beam, tension positive (N); 0 for a rigid beam.
pub fn axial_forces(structure: &Structure, parts: &Assembly, q: &[Pose], drive: &Drive) -> Vec<f64> {
    let model = &parts.system.model;
    let key = |a: BodyId, b: BodyId| (a.min(b), a.max(b));
    let mut between: HashMap<(BodyId, BodyId), Vec<Along>> = HashMap::new();
    for joint in &model.joints {
        let (a, b) = joint.bodies();
        let axis = model.section(joint).axis;
        between.entry(key(a, b)).or_default().push((axis.x, axis.y, axial_force(model, joint, q, &drive.rest())));
    }
    let of = |(beam, points): (&bimorph_structure::Beam, &std::sync::Arc<[MaterialPoint]>)| {
        let along = |&&(x, y, _): &&Along| (x * beam.angle.cos() + y * beam.angle.sin()).abs() > ALONG;
        let one = |pair: &[MaterialPoint]| {
            let joints = between.get(&key(pair[0].body, pair[1].body))?;
            Some(joints.iter().find(along)?.2)
        };
        let found: Vec<f64> = points.windows(2).filter_map(one).collect();
        if found.is_empty() { 0.0 } else { found.iter().sum::<f64>() / found.len() as f64 }
    };
    structure.beams.iter().zip(&parts.beams).map(of).collect()
}
