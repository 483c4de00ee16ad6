//! Error of a gap along beams by the shape within segments.
//!
//! Forces act on the bodies at the ends of segments, and the field is integrated along the cubic between them. Under the load p along it a
//! segment of length h bends further, by p·s²·(h − s)²/(24·EI) between its held ends. That changes the forces of the field by δr, and the
//! equilibrium by K⁻¹·δr, which is its error of order h⁴.

use super::statics::OperatingPoint;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;

/// The gap with the largest part in that error of an equilibrium, and the error of the largest displacement of a node (1): infinite
/// where the tangent is singular, none without gaps along beams.
pub(super) fn left_out(compiled: &CompiledModel, point: &OperatingPoint) -> Option<(String, f64)> {
    if compiled.structure.beam_gaps.is_empty() {
        return None;
    }
    let system = &compiled.parts.system;
    let (model, pattern, q) = (&system.model, &system.model.pattern, &point.q);
    let drive = point.drive(compiled);
    let mut change = vec![Pose::zeros(); system.bodies()];
    let mut largest = (0, 0.0);
    for (gap, &volts) in system.gap_voltages(q, &drive.volts).iter().enumerate() {
        let force = system.add_shape_force(gap, q, volts, &mut change);
        if force > largest.1 {
            largest = (gap, force);
        }
    }
    let name = compiled.parts.gap_names.get(largest.0)?.clone();
    let (mut tangent, mut residual) = (BodyMatrix::new(pattern), q.clone());
    system.tangent(q, &drive, &mut tangent, &mut residual);
    model.project_matrix(&mut tangent);
    model.project(&mut change);
    if tangent.factor(pattern).is_err() {
        return Some((name, f64::INFINITY));
    }
    tangent.solve(pattern, &mut change);
    let reach = |q: &[Pose], linear: bool| {
        let moved = compiled.parts.nodes.iter().flatten().map(|p| p.displacement(q, linear).norm());
        moved.fold(0.0, f64::max)
    };
    let (moved, whole) = (reach(&change, true), reach(q, model.linear));
    Some((name, if whole > 0.0 { moved / whole } else { 0.0 }))
}
