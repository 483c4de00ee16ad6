//! Motion in time in joint coordinates: the recursion of the paper, loops closed after each step.
//!
//! Accelerations come from [`bimorph_multibody::joint_coordinates::constrained_loops`] in O(n + m). Dormand and Prince's
//! pair advances them explicitly, or an implicit method does, whose stages the same recursion solves
//! ([`bimorph_solve::equations::constrained`]). An explicit step is about 1/ω long, ω the highest natural frequency of the
//! model, whatever the tolerance: joints that only turn have a moderate one, elastic axial directions a very high one.
//! The number of explicit steps is predicted, and a run beyond [`MAX_STEPS`] is rejected; implicit steps follow the
//! requested motion.
//!
//! A release starts from the equilibrium of the same mechanism: the compliant model with its locked directions [`RIGID`]
//! times as stiff, mapped to joint coordinates and projected onto the loops.

mod in_joints;
mod locked_directions;
mod on_tree;
mod report;

use super::formulation::{Formulation, coordinate_scales, linkage, locked_model};
use super::integrator::{IntegrationRule, Integrator};
use super::transient::options::TransientOptions;
use super::transient::record::record;
use super::transient::result::TransientResult;
use super::{AnalysisError, ProgressCallback};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::joint_coordinates::constrained_loops::Linkage;
use bimorph_solve::equations::Motion;
use bimorph_solve::fastest::{Fastest, fastest};
use in_joints::JointPropagator;
pub use locked_directions::RIGID;
use on_tree::on_tree;
pub use report::JointReport;
use std::f64::consts::TAU;

/// Steps beyond which a run is refused before it begins.
pub const MAX_STEPS: f64 = 2e7;

/// Integrates the motion in joint coordinates, with one of [`Integrator::IN_JOINTS`]. As [`super::transient::transient`]
/// otherwise, with a report on the formulation.
///
/// # Errors
/// See [`AnalysisError`]; [`AnalysisError::BadRequest`] where joint coordinates, the method or explicit steps will not do.
pub fn joint_transient(
    compiled: &CompiledModel,
    formulation: Formulation,
    options: &TransientOptions<'_>,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<(TransientResult, JointReport), AnalysisError> {
    if options.shock.is_some() {
        return Err(AnalysisError::BadRequest {
            what: "shock".into(),
            detail: "a shock acts in the bodies' own coordinates; take formulation compliant".into(),
        });
    }
    if options.method == Integrator::Rodas4 {
        return on_tree(compiled, formulation, options, sample, watch);
    }
    let rule = rule(formulation, options)?;
    let system = &compiled.parts.system;
    let linkage = linkage(formulation, system)?;
    let counts = locked_model(formulation, &system.model).counts();
    let scale = coordinate_scales(&linkage, system.length_scale);
    let top = fastest(&linkage, &scale, system.electrics.heating.heaters.len());
    if let (Some(top), IntegrationRule::Rk45, None) = (&top, rule, options.step) {
        affordable(formulation, &linkage, top, options.stop)?;
    }
    let start = options.release.map(|start| locked_directions::locked(start, formulation));
    let mut carrier = JointPropagator {
        formulation,
        system,
        now: Motion::zeros(linkage.coordinates),
        rule,
        control: options.control(),
        report: JointReport {
            coordinates: linkage.coordinates,
            constraints: linkage.constraints,
            coordinates_uncut: counts.coordinates,
            constraints_uncut: counts.constraints,
            accelerations: 0,
            singular_evaluations: 0,
            largest_gap_m: 0.0,
            highest_frequency_hz: top.map(|t| t.omega / TAU),
        },
        linkage,
        scale,
    };
    let warning = locked_directions::locked_directions_warning(compiled, formulation, options);
    let options = options.with_release(start.as_ref());
    let mut result = record(compiled, &options, &mut carrier, sample, watch)?;
    result.warnings.extend(warning);
    result.warnings.extend(open(carrier.report.largest_gap_m, options.errors().within(system.length_scale)));
    result.unknowns = carrier.linkage.coordinates.saturating_sub(carrier.linkage.constraints);
    Ok((result, carrier.report))
}

/// Warning about loops that were open by more than `most` (m).
fn open(gap: f64, most: f64) -> Option<String> {
    (gap > most).then(|| {
        format!(
            "a loop was open by {gap:.1e} m after a step, more than {most:.1e} m: its joints do not meet there, and this is no motion of the \
             mechanism; take shorter steps, or --formulation compliant"
        )
    })
}

/// The requested method, which must work for any equations.
fn rule(formulation: Formulation, options: &TransientOptions<'_>) -> Result<IntegrationRule, AnalysisError> {
    let method = options.method;
    method.rule().ok_or_else(|| AnalysisError::BadRequest {
        what: format!("method {}", method.name()),
        detail: format!(
            "formulation {} has {}; take one of them, or compliant for {}",
            formulation.name(),
            Integrator::IN_JOINTS.join(", "),
            method.name()
        ),
    })
}

fn affordable(formulation: Formulation, linkage: &Linkage, top: &Fastest, stop: f64) -> Result<(), AnalysisError> {
    let steps = stop * top.omega;
    if steps <= MAX_STEPS {
        return Ok(());
    }
    Err(AnalysisError::BadRequest {
        what: format!("formulation {}", formulation.name()),
        detail: format!(
            "its explicit steps of about {:.2e} s ({:.3e} Hz at body \"{}\") would take {steps:.1e} steps to {stop:e} s; \
             take an implicit method such as tr-bdf2, or compliant",
            1.0 / top.omega,
            top.omega / TAU,
            linkage.names[top.body]
        ),
    })
}
