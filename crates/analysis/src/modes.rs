//! Natural frequencies and shapes about the operating point.
use super::contact_range::comb_beyond_reported;
use super::loose_parts;
use super::rotary_inertia_error;
use super::sensitivity::LinearizationPoint;
use super::statics::{NodeMotion, notes_at, operating_point, too_hot};
use super::{AnalysisError, BeamMotions, NodeMotions, PortVoltages};
use crate::readout::signal::{Signal, SignalView};
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_domains::{Domain, Drive, MaterialPoint};
use bimorph_model::compile::{CompiledModel, HigherMode, LowestMode};
use bimorph_model::refine::axial::axial_forces;
use bimorph_model::refine::doubling;
use bimorph_model::refine::mode_errors::{own_stiffness, relative_of_loaded_modes};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::forces::{add_damping, add_inertia};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_solve::eigen::{Modes, RELIABLE, lowest_modes};
use serde::Serialize;
use std::f64::consts::TAU;

/// Undamped modes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModesResult {
    /// Frequencies, ascending (Hz).
    pub frequencies_hz: Vec<f64>,
    /// For each mode, the displacement of every mechanical node (largest translation 1), in netlist order.
    pub shapes: Vec<Vec<(String, NodeMotion)>>,
    /// For each mode, the residual ‖(K + λM)⁻¹(Kx − λMx)‖ in the mass norm, approximately the relative error of its
    /// shape; the error of the frequency is its square (1).
    pub residuals: Vec<f64>,
    /// For each mode, the estimated relative error of its frequency by the number of segments (1); none where no estimate can be made, as
    /// for the baselines. About the drawing it is signed. About a loaded equilibrium it includes the error of that, and is a size where it
    /// does not come from a comparison with twice the segments.
    pub errors: Vec<Option<f64>>,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Largest displacement of a node at the equilibrium that the modes are about (m).
    pub deflection_m: f64,
    /// How much faster each frequency moves than the equilibrium, |d ln f / d ln q| (1); for the search for a mesh, and empty in what it
    /// ends with and about the drawing.
    #[serde(skip)]
    pub per_deflection: Vec<f64>,
    /// Warnings about the result.
    pub warnings: Vec<String>,
    /// Largest estimated relative error from the mesh, of every frequency and of their equilibrium (1); `None` without
    /// an estimate, and where the mesh was not fitted to them.
    pub estimated_error: Option<f64>,
}

/// Additional modes, which separate the last requested ones from the next.
pub(super) const GUARDS: usize = 2;
/// Deflection, as a fraction of the drawing's size, from which a note says that modes are about another shape.
const FAR: f64 = 0.02;
/// Below this overlap of a mode with its reference its error is unknown.
const ALIKE: f64 = 0.5;
/// Estimates of this size and more say only that the mesh is far too coarse for one.
const BELIEVED: f64 = 1.0;
/// No estimate is reported where rounding in the stiffness may exceed it.
const ROUNDED: f64 = 1e-4;

/// The `count` lowest modes about the static equilibrium at these voltages.
///
/// # Errors
/// See [`AnalysisError`]; `NotConverged` rather than a frequency that cannot be trusted.
pub fn modes(compiled: &CompiledModel, count: usize, voltages: &PortVoltages) -> Result<ModesResult, AnalysisError> {
    let (mut result, q, shapes) = shapeless(compiled, count, voltages)?;
    result.shapes = shapes.iter().map(|x| shape(compiled, &q, x, false).0).collect();
    Ok(result)
}

/// The lowest mode about the equilibrium without voltages; none where its error is not known. A scheme that has no estimate of its own is
/// compared with `twice` the segments.
pub(super) fn lowest(compiled: &CompiledModel, twice: impl FnOnce() -> Option<CompiledModel>) -> Option<LowestMode> {
    let (found, _, shapes) = shapeless(compiled, 1, &[]).ok()?;
    let frequency_hz = *found.frequencies_hz.first()?;
    let quality = quality(compiled, shapes.first()?, frequency_hz);
    let error = match *found.errors.first()? {
        Some(error) => error,
        None => {
            let (finer, ..) = shapeless(&twice()?, 1, &[]).ok()?;
            doubling::relative(frequency_hz, *finer.frequencies_hz.first()?)
        }
    };
    Some(LowestMode { frequency_hz, quality, error })
}

/// The modes above the lowest, of the `count` lowest about the equilibrium without voltages, whose errors are known; none where they cannot be found.
pub(super) fn higher(compiled: &CompiledModel, count: usize) -> Vec<HigherMode> {
    let Ok((found, _, shapes)) = shapeless(compiled, count, &[]) else { return Vec::new() };
    let modes = found.frequencies_hz.iter().zip(&found.errors).zip(shapes).skip(1);
    let known = modes.filter_map(|((frequency, error), shape)| {
        let quality = quality(compiled, &shape, *frequency);
        let scale = 1.0 / compiled.parts.system.model.mass_product(&shape, &shape).sqrt();
        let shape: Vec<Pose> = shape.iter().map(|x| x * scale).collect();
        let sound = *frequency > 0.0 && scale.is_finite();
        sound.then_some(HigherMode { frequency_hz: *frequency, quality, error: (*error)?, shape })
    });
    known.collect()
}

/// Quality of a mode about the drawing by drag, dampers and gas (1).
fn quality(compiled: &CompiledModel, shape: &[Pose], frequency_hz: f64) -> f64 {
    let system = &compiled.parts.system;
    let model = &system.model;
    let mut drag = vec![Pose::zeros(); shape.len()];
    if let Some(mut loss) = LossDerivatives::of(system) {
        loss.at(system, &drag, |_| Pose::zeros());
        loss.add_damping(|k| shape[k], &mut drag);
    }
    add_damping(model, shape, &mut drag);
    let power: f64 = drag.iter().zip(shape).map(|(force, rate)| force.dot(rate)).sum();
    TAU * frequency_hz * model.mass_product(shape, shape) / power.abs()
}

/// True where modes are about an equilibrium that is not the drawing. As SUGAR has it, that is where voltages pull across gaps: its beams
/// are as stiff as drawn, whatever they bear.
pub(super) fn about_equilibrium(compiled: &CompiledModel, voltages: &PortVoltages) -> bool {
    let system = &compiled.parts.system;
    let driven = !voltages.is_empty() || system.electrics.fixed.iter().any(|v| *v != 0.0);
    if compiled.options.as_sugar {
        return driven && system.members.iter().any(Domain::is_gap);
    }
    driven
        || system.loads.iter().any(|l| l.moment != 0.0 || l.force.norm() > 0.0)
        || system.model.joints.iter().any(|j| j.rest != 0.0)
}

/// The same, with the displacement of points along every beam for pictures, mode by mode.
///
/// # Errors
/// See [`modes`].
pub fn modes_with_curves(
    compiled: &CompiledModel,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(ModesResult, Vec<BeamMotions>), AnalysisError> {
    let (mut result, q, shapes) = shapeless(compiled, count, voltages)?;
    let curves;
    (result.shapes, curves) = shapes.iter().map(|x| shape(compiled, &q, x, true)).unzip();
    Ok((result, curves))
}

/// Modes without the motion of nodes; the equilibrium that they are about, and shapes of the bodies.
pub(super) type Shapeless = (ModesResult, Vec<Pose>, Vec<Vec<Pose>>);

pub(super) fn shapeless(
    compiled: &CompiledModel,
    count: usize,
    voltages: &PortVoltages,
) -> Result<Shapeless, AnalysisError> {
    let system = &compiled.parts.system;
    let mut drive = system.electrics.drive();
    let (as_sugar, loaded) = (compiled.options.as_sugar, about_equilibrium(compiled, voltages));
    if as_sugar {
        // neither loads nor built-in strain
        drive.load = 0.0;
    }
    let mut way = Vec::new();
    let q = if loaded {
        let point = operating_point(compiled, voltages)?;
        way = notes_at(compiled, &point);
        way.extend(comb_beyond_reported(compiled, &point.q));
        way.extend(too_hot(compiled, &point));
        let driven = point.drive(compiled);
        // as SUGAR: heat and loads move what the field pulls at, and do nothing to the stiffness of beams
        drive = if as_sugar { Drive { volts: driven.volts, ..drive } } else { driven };
        point.q
    } else {
        vec![Pose::zeros(); system.bodies()]
    };
    let mut tangent = BodyMatrix::new(&system.model.pattern);
    let mut residual = q.clone();
    system.tangent(&q, &drive, &mut tangent, &mut residual);
    if !as_sugar {
        // what stress and heat do to the stiffness belongs to the vibration, in a linear model too
        system.add_stress_stiffness(&q, &drive, &mut tangent);
    }
    let rigid = DOF * system.model.loose().count();
    let mut found = lowest_modes(system, (&q, &drive), &tangent, count + GUARDS + rigid)?;
    if found.lambda.is_empty() {
        let detail = match compiled.unknowns() {
            0 => "there are no modes: anchors, guides and pins leave no node free to move".into(),
            _ => "there are no modes: nothing that moves has mass (give the layer a `density`), or the stiffness is not finite".into(),
        };
        return Err(AnalysisError::NotConverged { detail });
    }
    if let Some(k) = found.residuals.iter().take(count).position(|&r| r.is_nan() || r > RELIABLE) {
        let (residual, rounding) = (found.residuals[k], found.rounding);
        let size = if residual.is_nan() { "that rounding hides".into() } else { format!("of {residual:.1e}") };
        let detail = format!(
            "mode {} of {count} keeps a residual {size}, more than {RELIABLE:.0e}; rounding leaves the stiffness uncertain \
             by {rounding:.0e}: ask for fewer modes or segments, or draw what is far stiffer than the rest as a rigid link",
            k + 1
        );
        return Err(AnalysisError::NotConverged { detail });
    }
    if found.missed {
        return Err(AnalysisError::NotConverged {
            detail: format!("there are more than {count} modes below the highest one found; request more modes"),
        });
    }
    let rigid = loose_parts::settle_rigid(system, &tangent, &mut found);
    let forces =
        if loaded && !as_sugar { axial_forces(&compiled.structure, &compiled.parts, &q, &drive) } else { Vec::new() };
    let mut errors = estimated(compiled, &tangent, &forces, &found);
    errors.iter_mut().zip(&rigid).filter(|(_, rigid)| **rigid).for_each(|(error, _)| *error = Some(0.0));
    let modes = (&found.lambda[..count.min(found.lambda.len())], found.shapes.as_slice());
    let about = LinearizationPoint { compiled, q: &q, drive: &drive, stressed: !as_sugar, modes };
    let per_deflection = if loaded { about.to_deflection() } else { Vec::new() };
    let way = way.into_iter().map(|way| format!("the equilibrium that these modes are about: {way}"));
    let rigid = rigid.iter().take(count).filter(|rigid| **rigid).count();
    let warnings = way.chain(loose_parts::warning(system, rigid)).collect();
    let result = assess(compiled, count, &q, (errors, warnings), &mut found);
    Ok((ModesResult { per_deflection, ..result }, q, found.shapes))
}

/// Result of `count` modes about `q`; any further modes are removed. With the estimated errors of them all, and what is
/// to be warned of besides.
fn assess(
    compiled: &CompiledModel,
    count: usize,
    q: &[Pose],
    (mut errors, more): (Vec<Option<f64>>, Vec<String>),
    found: &mut Modes,
) -> ModesResult {
    let mut warnings = notes(compiled, count, q, (&found.lambda, found.rounding));
    warnings.extend(more);
    errors.truncate(count);
    found.lambda.truncate(count);
    found.shapes.truncate(count);
    found.residuals.truncate(count);
    warnings.extend(rotary_inertia_error::rotary_inertia_note(compiled, &found.shapes));
    ModesResult {
        estimated_error: None,
        frequencies_hz: found.lambda.iter().map(|&l| l.max(0.0).sqrt() / std::f64::consts::TAU).collect(),
        shapes: Vec::new(),
        residuals: std::mem::take(&mut found.residuals),
        errors,
        unknowns: compiled.parts.system.model.unknowns(),
        deflection_m: deflection(compiled, q),
        per_deflection: Vec::new(),
        warnings,
    }
}

/// The result of modes that have been found about the drawn geometry, on which nothing acts, with their errors and likeness; without the
/// motion of nodes.
pub(super) fn unloaded(
    compiled: &CompiledModel,
    count: usize,
    mut found: Modes,
    errors: Vec<(f64, f64)>,
) -> ModesResult {
    let q = vec![Pose::zeros(); compiled.parts.system.bodies()];
    assess(compiled, count, &q, (errors.into_iter().map(sure).collect(), Vec::new()), &mut found)
}

/// The estimate of a mode that is in its reference; none where it says nothing.
fn sure((error, like): (f64, f64)) -> Option<f64> {
    (error.abs() < BELIEVED && like >= ALIKE).then_some(error)
}

/// Estimated errors of modes about an equilibrium with this tangent, where the beams carry these axial forces.
fn estimated(compiled: &CompiledModel, tangent: &BodyMatrix, forces: &[f64], found: &Modes) -> Vec<Option<f64>> {
    let options = &compiled.options;
    let model = &compiled.parts.system.model;
    let (lambda, none) = (&found.lambda, vec![None; found.lambda.len()]);
    let own = own_stiffness(options, &compiled.parts);
    let (Some(highest), true) = (lambda.last(), (own || forces.is_empty()) && found.rounding < ROUNDED) else {
        return none;
    };
    let mut shift = 0.0;
    let mut factor = tangent.clone();
    model.project_matrix(&mut factor);
    if factor.factor(&model.pattern).is_err() {
        shift = -1e-3 * highest.abs();
        factor.clone_from(tangent);
        add_inertia(model, -shift, 0.0, &mut factor);
        model.project_matrix(&mut factor);
        if factor.factor(&model.pattern).is_err() {
            return none;
        }
    }
    let modes = (lambda.as_slice(), found.shapes.as_slice());
    let factor = (&factor, shift);
    let compared = relative_of_loaded_modes(&compiled.structure, options, &compiled.parts, factor, forces, modes);
    compared.map_or(none, |errors| errors.into_iter().map(sure).collect())
}

/// Largest displacement of a node (m).
fn deflection(compiled: &CompiledModel, q: &[Pose]) -> f64 {
    let linear = compiled.parts.system.model.linear;
    let moved = |point: &Option<MaterialPoint>| point.map_or(0.0, |p| p.displacement(q, linear).norm());
    compiled.parts.nodes.iter().map(moved).fold(0.0, f64::max)
}

/// Warnings about modes: fewer than requested, or an equilibrium that is far from the drawing or unstable.
fn notes(compiled: &CompiledModel, count: usize, q: &[Pose], (lambda, rounding): (&[f64], f64)) -> Vec<String> {
    let mut warnings = Vec::new();
    if lambda.len() < count {
        let found = lambda.len();
        warnings.push(format!(
            "only {found} of {count} modes: the model has no more; take a higher --band, or more --segments"
        ));
    }
    let size = compiled.structure.extent();
    let moved = deflection(compiled, q);
    if size > 0.0 && moved > FAR * size {
        let share = 100.0 * moved / size;
        let moved = 1e6 * moved;
        warnings.push(format!(
            "these modes are about a largely deflected equilibrium: {moved:.3} µm away from the drawing, {share:.0} % of its size"
        ));
    }
    // zero within the rounding of the stiffness
    let least = lambda.iter().find(|l| **l > 0.0).map_or(0.0, |l| rounding * l);
    let unstable = lambda.iter().filter(|l| **l < -least).count();
    if unstable > 0 {
        warnings.push(format!(
            "the equilibrium is unstable: {unstable} of the modes do not swing but grow, and are shown at 0 Hz (buckled, if \
             compressed)"
        ));
    }
    warnings
}

/// Displacements of the nodes and, on request, along the beams in a mode, the largest translation of a node scaled to
/// 1.
fn shape(compiled: &CompiledModel, q: &[Pose], x: &[Pose], along: bool) -> (NodeMotions, BeamMotions) {
    let zeros = vec![Pose::zeros(); q.len()];
    let (state, change) =
        (SignalView { q, v: &zeros, rise: &[], volts: &[] }, SignalView { q: x, v: &zeros, rise: &[], volts: &[] });
    let at = |point: MaterialPoint| {
        let at = |d: usize| Signal::Displacement(point, d).slope(compiled, &state, &change);
        NodeMotion { x: at(0), y: at(1), rz: at(2) }
    };
    let nodes: NodeMotions = (compiled.structure.nodes.iter().zip(&compiled.parts.nodes))
        .filter_map(|(node, point)| Some((node.name.clone(), at((*point)?))))
        .collect();
    let curves: BeamMotions =
        compiled.parts.beams.iter().filter(|_| along).map(|points| points.iter().map(|p| at(*p)).collect()).collect();
    normalized(nodes, curves)
}

/// Scales a shape so that the largest translation of a node is 1.
pub(crate) fn normalized(mut nodes: NodeMotions, mut curves: BeamMotions) -> (NodeMotions, BeamMotions) {
    let largest = nodes.iter().map(|(_, m)| m.x.hypot(m.y)).fold(0.0, f64::max);
    let scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
    for m in nodes.iter_mut().map(|(_, m)| m).chain(curves.iter_mut().flatten()) {
        *m = NodeMotion { x: m.x * scale, y: m.y * scale, rz: m.rz * scale };
    }
    (nodes, curves)
}
