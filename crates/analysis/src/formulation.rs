//! Effect of a formulation on bodies and joints (locked directions, tree and loops), and the choice of a formulation.
//!
//! **Choice of `auto`.** With joints that are elastic in every direction, a step in joint coordinates costs as much as
//! one of the bodies or more, and both take the same steps (docs/explanation/recursion.md has the measurements): compliant. Now consider
//! joints that only rotate and close no loops, as rigid plates on flexure pivots under a scheme of the paper. The
//! bodies' own coordinates then need stiff springs in the rigid directions, and short steps. The recursion needs
//! neither, and its explicit steps cost a few evaluations without any factorization: rcr with rk45, as long as the
//! steps are few. In circuits and sessions, whose steps the caller sets, compliant.
//!
//! Rigid parts on flexures are the other case. Where they outweigh the flexures and close no loop, large rotations are linear in the
//! joint coordinates and curved in those of the bodies. Steps in joint coordinates are as long as those of small rotations then:
//! rcr with the method of the bodies ([`outweighed_tree`]), unless parts may touch. Loops cancel the advantage. Flexures of many segments may do so, and
//! then coarse runs decide. Beams are cut otherwise in joint coordinates, so that this choice comes before the mesh ([`in_joints`]), and the other after it
//! ([`of_run`]).
//!
//! Other mechanisms have bodies first. The first coarse run of the search for their mesh propagates the error of its steps. This and the number of its steps
//! predict the work of all runs until the tolerance holds ([`super::step_error`]). Where it is large enough for a trial, a coarse run in joint coordinates
//! makes the same prediction. They are taken if the work is less, and if a mesh of their own holds the tolerance ([`may_take_joints`], `mesh::fitted_in_time`).
//!
//! Every front end has all of them by the search for the mesh and by the run. [`taken`] reports the choice.

use super::AnalysisError;
use super::integrator::Integrator;
use super::transient::options::TransientOptions;
use bimorph_domains::System;
use bimorph_model::compile::{CompiledModel, Scheme};
use bimorph_multibody::joint_coordinates::TreeParent;
use bimorph_multibody::joint_coordinates::constrained_loops::Linkage;
use bimorph_multibody::joint_coordinates::sprung_loops::UnsupportedModel;
use bimorph_multibody::planar::DOF;
use bimorph_multibody::{BodyId, Model};
use bimorph_solve::baseline::SolverKind;
use bimorph_solve::fastest::fastest;
use std::borrow::Cow;

pub use bimorph_model::options::Formulation;

/// Largest phase (rad) of the fastest joint motion in a run with explicit steps. A step is stable up to about three, so
/// that this means a thousand steps, as many as the bodies' coordinates take for such a motion at a tolerance of 1e-3.
const FEW: f64 = 3e3;

/// Least mass of rigid parts, of that of the flexures, for which joint coordinates are taken (1). Of 60 random trees those below took 1.0 to 1.9 times the time
/// of bodies, and up to 34 times where flexures were soft; those above took 0.005 to 1.5 times.
const OUTWEIGHING: f64 = 30.0;

/// Segments of a flexure up to which no coarse run of the bodies is needed: short ones that move fast shorten the steps in joint coordinates, whose
/// matrix omits their rates. Of ten random trees with 4 and more eight took 1.07 to 7.6 times the time of bodies.
const MOST_SEGMENTS: usize = 3;

/// Choice of `auto`.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenFormulation {
    /// Compliant or rcr.
    pub formulation: Formulation,
    /// Why, in words.
    pub why: String,
}

impl std::fmt::Display for ChosenFormulation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.formulation.name(), self.why)
    }
}

/// The choice that `auto` made for a run of a model on its mesh; none where another formulation was requested.
pub fn taken(moving: &CompiledModel, options: &TransientOptions<'_>) -> Option<ChosenFormulation> {
    match (moving.requested.formulation, moving.options.formulation) {
        (Formulation::Auto, Formulation::Auto) => Some(of_run(moving, options).0),
        (Formulation::Auto, formulation @ Formulation::Rcr) => {
            let why = outweighed_tree(moving)
                .unwrap_or_else(|| "coarse runs predict less work of the steps in joint coordinates".to_owned());
            Some(ChosenFormulation { formulation, why })
        }
        _ => None,
    }
}

/// Whether a run is that of default steps: a method, equal steps, a baseline's solver, a shock and moving anchors are those of the bodies.
fn has_default_steps(options: &TransientOptions<'_>) -> bool {
    options.method == Integrator::Rodas4
        && options.step.is_none()
        && options.solver == SolverKind::Recursion
        && options.shock.is_none()
        && options.motions.is_empty()
}

/// Whether `auto` may take joint coordinates for a run of this model. A given scheme is that of the bodies.
pub fn may_take_joints(drawn: &CompiledModel, options: &TransientOptions<'_>) -> bool {
    let system = &drawn.parts.system;
    drawn.options.formulation == Formulation::Auto
        && drawn.requested.scheme == Scheme::Auto
        && has_default_steps(options)
        && !system.model.linear
        && system.anchors.is_empty()
        && !system.turns()
}

/// Whether `auto` takes joint coordinates for a run of this model before there is a mesh.
pub fn takes_joints(drawn: &CompiledModel, options: &TransientOptions<'_>) -> bool {
    may_take_joints(drawn, options) && outweighed_tree(drawn).is_some()
}

/// Whether joint coordinates suit a mesh with these numbers of segments.
pub fn suits_joints(segments: &[usize]) -> bool {
    segments.iter().all(|&n| n <= MOST_SEGMENTS)
}

/// The model in joint coordinates and what it is released from, where `auto` takes them before there is a mesh and they can describe both.
pub fn in_joints(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Option<(CompiledModel, Option<CompiledModel>)> {
    if takes_joints(drawn, options) { in_possible_joints(drawn, options) } else { None }
}

/// The same where `auto` may take joint coordinates.
pub fn in_possible_joints(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Option<(CompiledModel, Option<CompiledModel>)> {
    if !may_take_joints(drawn, options) {
        return None;
    }
    let compiled = |model: &CompiledModel| {
        let compiled = model.parsed().in_formulation(Formulation::Rcr).compile().ok()?;
        matches!(compiled.joints, Some(Ok(_))).then_some(compiled)
    };
    let start = options.release.map(|start| compiled(start).ok_or(())).transpose().ok()?;
    Some((compiled(drawn)?, start))
}

/// Why a run in joint coordinates takes fewer steps than one of the bodies, in words: rigid parts outweigh the flexures of an open tree.
pub fn outweighed_tree(compiled: &CompiledModel) -> Option<String> {
    let system = &compiled.parts.system;
    let model = &system.model;
    // impacts take more steps in joint coordinates than in those of bodies
    if model.linear || !system.anchors.is_empty() || system.turns() || system.may_touch() {
        return None;
    }
    let beams = compiled.structure.beams.iter().zip(&compiled.order.segments).filter(|(_, segments)| **segments > 0);
    let flexures: f64 = beams.map(|(b, _)| b.material.density * b.length * b.width * b.thickness).sum();
    let moving: f64 = model.bodies.iter().map(|body| body.mass).sum();
    let rigid = moving - flexures;
    if flexures == 0.0 || rigid < OUTWEIGHING * flexures {
        return None;
    }
    is_forest(model).then(|| {
        format!(
            "rigid parts of {:.1} times the mass of the flexures close no loop: fewer steps in joint coordinates",
            rigid / flexures
        )
    })
}

/// Whether the joints close no loop: no body has two of them to ground or to bodies that are eliminated later.
fn is_forest(model: &Model) -> bool {
    let mut taken = vec![false; model.bodies.len()];
    (0..model.joints.len()).all(|k| {
        let joint = model.joint(k);
        let first = match (joint.a, joint.b) {
            (BodyId::Free(a), BodyId::Free(b)) => a.min(b),
            (BodyId::Free(a), BodyId::Ground) | (BodyId::Ground, BodyId::Free(a)) => a,
            (BodyId::Ground, BodyId::Ground) => return true,
        };
        !std::mem::replace(&mut taken[first], true)
    })
}

/// Choice of `auto` for a run of `stop` (s), or for steps of the caller (`None`).
pub fn suited(compiled: &CompiledModel, stop: Option<f64>) -> ChosenFormulation {
    let system = &compiled.parts.system;
    let model = &system.model;
    let compliant = |why: &str| ChosenFormulation { formulation: Formulation::Compliant, why: why.to_owned() };
    let mut beams = model.sections.iter().filter(|s| s.is_segment());
    if model.linear {
        return compliant("small displacements");
    }
    if beams.clone().next().is_none() || beams.any(|s| !s.only_turns()) {
        return compliant("joints are elastic in every direction, where a step in joint coordinates costs more");
    }
    if system.may_touch() {
        return compliant("joints only turn, but parts may touch, whose forces are too stiff for explicit steps");
    }
    let Ok(linkage) = linkage(Formulation::Rcr, system) else { return compliant("joint coordinates do not suit it") };
    if linkage.constraints > 0 {
        return compliant("joints that only turn close loops, which may be singular as drawn");
    }
    let Some(stop) = stop else {
        return compliant("joints only turn, but steps are the caller's: explicit ones might be too long");
    };
    let scale = coordinate_scales(&linkage, system.length_scale);
    let omega = fastest(&linkage, &scale, system.electrics.heating.heaters.len()).map_or(0.0, |top| top.omega);
    if omega * stop > FEW {
        return compliant("joints only turn, but the fastest is too fast for explicit steps");
    }
    let (n, unknowns) = (linkage.coordinates, model.unknowns());
    ChosenFormulation {
        formulation: Formulation::Rcr,
        why: format!(
            "joints only turn and close no loop: {n} coordinates for {unknowns}, explicit steps with rk45, stable from some {:.0} on",
            (omega * stop / 3.0).ceil().max(1.0)
        ),
    }
}

/// The formulation and the method of a run on its mesh: `auto` resolved, with the reason, everything else as requested. A
/// method other than the default, equal steps and a baseline's solver are those of the bodies; so is the
/// equilibrium that a release starts from.
pub fn of_run(compiled: &CompiledModel, options: &TransientOptions<'_>) -> (ChosenFormulation, Integrator) {
    let method = options.method;
    let asked = compiled.options.formulation;
    if asked != Formulation::Auto {
        return (ChosenFormulation { formulation: asked, why: "as asked".into() }, method);
    }
    if !has_default_steps(options) || options.release.is_some() {
        let why = "a release, a shock, a method, equal steps or a solver was given".into();
        return (ChosenFormulation { formulation: Formulation::Compliant, why }, method);
    }
    let chosen = suited(compiled, Some(options.stop));
    let method = if chosen.formulation == Formulation::Rcr { Integrator::Rk45 } else { method };
    (chosen, method)
}

/// The model with the directions locked that this formulation locks.
pub fn locked_model(formulation: Formulation, model: &Model) -> Cow<'_, Model> {
    match formulation {
        Formulation::Rcr => Cow::Owned(model.rotary()),
        Formulation::Auto | Formulation::Compliant | Formulation::RcrElastic | Formulation::Reduced => {
            Cow::Borrowed(model)
        }
    }
}

/// Tree and loops of a system in joint coordinates.
///
/// # Errors
/// [`AnalysisError::BadRequest`] where joint coordinates cannot describe it.
pub fn linkage(formulation: Formulation, system: &System) -> Result<Linkage, AnalysisError> {
    let refuse =
        |detail: String| Err(AnalysisError::BadRequest { what: format!("formulation {}", formulation.name()), detail });
    let model = locked_model(formulation, &system.model);
    if model.linear {
        return refuse("joint coordinates are not small displacements; leave out --linear or take compliant".into());
    }
    if !system.anchors.is_empty() {
        return refuse(UnsupportedModel::DrivenAnchor.to_string());
    }
    if !model.couplings.is_empty() {
        return refuse(
            "joint coordinates know no coupling between joints, which --scheme c1 has; take another scheme, or \
             compliant"
                .into(),
        );
    }
    for (k, body) in model.bodies.iter().enumerate() {
        let touches = |(a, b)| a == BodyId::Free(k) || b == BodyId::Free(k);
        let mut joints = model.joints.iter().filter(|j| touches(j.bodies()));
        let elastic = |s: usize| model.sections[s].locked == [false; 3];
        if body.inertia == 0.0 && body.free.is_none() && joints.all(|j| elastic(j.section())) {
            return refuse(format!(
                "body \"{}\" turns without inertia, and all its joints are elastic in every direction; \
                 take rcr, whose joints only turn, or compliant",
                body.name
            ));
        }
    }
    Ok(Linkage::new(&model))
}

/// Size of each coordinate: `length` (m) for a displacement, an angle that moves a body's end by as much for a rotation.
pub fn coordinate_scales(linkage: &Linkage, length: f64) -> Vec<f64> {
    let mut scale = vec![length; linkage.coordinates];
    for link in &linkage.links {
        let moving = (0..DOF).filter(|&i| link.parent == TreeParent::Free || link.moving[i]);
        for (next, i) in moving.enumerate() {
            if i == 2 {
                scale[link.first + next] = length / link.lever;
            }
        }
    }
    scale
}
