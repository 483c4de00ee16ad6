//! The mesh for a static equilibrium: displacements and charges are compared with those of twice the segments.
//!
//! Next to where the equilibrium ends the stiffness that is left is compared, too ([`super::softening`]).
//!
//! The error of a displacement is relative to the displacement of its node, or to a thirtieth of the largest of the
//! mechanism if that is more. The scale of a rotation is analogous; its minimum is the rotation that moves the extent
//! of the mechanism by a thirtieth of the largest displacement. The finer mesh starts from the state of the coarser
//! one, so that both are on one branch.

use super::super::beam_states::{BeamState, beam_states};
pub(super) use super::super::chart::error::SMALL;
use super::super::gap_shape;
use super::super::linear_stress::left_out;
use super::super::reduced;
use super::super::statics::{
    OperatingPoint, StaticResult, beam_motions, operating_point, operating_point_near, result_at,
};
use super::super::{AnalysisError, BeamMotions, PortVoltages};
use super::doubled_mesh::MAX_NEAR_LIMIT;
use super::hidden_instability::{Hidden, hidden};
use super::refined::Refinement;
use super::remeshed::{chosen, meshed, on};
use super::softening;
use super::warnings::{near_buckling, of_fingers, of_heat, of_segments, of_strength, of_stress};
use bimorph_base::Diagnostic;
use bimorph_model::compile::{CompiledModel, Formulation};
use bimorph_model::refine::doubling::{self, Output};
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_model::refine::transfer::carried;
use bimorph_solve::equilibrium::Equilibrium;
use std::borrow::Cow;

/// Fraction of the mechanism's size below which a displacement is rounding.
pub(super) const ROUNDING: f64 = 1e-12;

/// Fraction of the path beyond which a fold that it passed is looked for anew on each mesh: the one before may have passed it by mistake.
const NEAR_THE_END: f64 = 0.9;

/// The mesh for the equilibrium at these voltages, from `segments` upwards, and the equilibrium on it.
pub(super) fn order(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
    segments: Vec<usize>,
) -> Result<(Mesh, OperatingPoint), AnalysisError> {
    if chosen(compiled) {
        return estimated(compiled, voltages, segments);
    }
    let mut coarse = None;
    match refined(compiled, voltages, segments, &mut coarse) {
        // what a coarse mesh has and no finer one is unconfirmed, and says so
        Err(AnalysisError::NoEquilibrium { .. }) if coarse.is_some() => coarse.ok_or_else(no_mesh),
        result => result,
    }
}

/// The same on finer meshes where those on the way have no equilibrium; `coarse` becomes that of a mesh whose double has none.
fn refined(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
    segments: Vec<usize>,
    coarse: &mut Option<(Mesh, OperatingPoint)>,
) -> Result<(Mesh, OperatingPoint), AnalysisError> {
    let (mut segments, mut refinement, mut lost) = (segments, Refinement::default(), None);
    loop {
        let mut search = EquilibriumSearch::new(compiled, voltages);
        let from = segments.clone();
        let order = match doubling::fit(&compiled.structure, &compiled.options, segments, &mut |s| search.follow(s)) {
            Err(error @ AnalysisError::NoEquilibrium { .. }) => match refinement.next(compiled, &from, &error) {
                Some(finer) => {
                    segments = finer;
                    lost = Some(error);
                    continue;
                }
                None => return Err(error),
            },
            Err(error) => return Err(lost.unwrap_or(error)),
            Ok(order) => order,
        };
        // a long segment may bear a bend that shorter ones do not: further on they do
        let holds = order.estimated_error.is_some_and(|error| compiled.options.errors().holds(error));
        if let Some(error) = search.refused.take().filter(|_| !holds)
            && let Some(finer) = refinement.next(compiled, &order.segments, &error)
        {
            let (order, point, _) = search.ended(order)?;
            coarse.get_or_insert((order, point));
            segments = finer;
            lost = Some(error);
            continue;
        }
        let finer = if search.is_sure(&order) { None } else { doubling::twice(&compiled.options, &order) };
        match finer.filter(|finer| finer.segments.iter().sum::<usize>() <= MAX_NEAR_LIMIT) {
            Some(finer) => segments = finer.segments,
            None => match search.ended(order)? {
                (_, _, Some(buckled)) if buckled != from => segments = buckled,
                (order, point, _) => {
                    let Some(mut error) = lost.take() else { return Ok((order, point)) };
                    let model = meshed(compiled, &order.segments)?;
                    let system = &model.parts.system;
                    // a segment that is too long for its bend may stretch and be stable: that is no beam
                    if Equilibrium::beyond_beams(system, &point.q).is_none() {
                        return Ok((order, point));
                    }
                    if let AnalysisError::NoEquilibrium { coarse, .. } = &mut error {
                        *coarse = Equilibrium::coarse_beams(system, &point.q);
                    }
                    let Some(finer) = refinement.next(compiled, &order.segments, &error) else { return Err(error) };
                    segments = finer;
                    lost = Some(error);
                }
            },
        }
    }
}

/// A mesh as it is, with the estimate of its error and its equilibrium.
pub(super) fn estimated(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
    segments: Vec<usize>,
) -> Result<(Mesh, OperatingPoint), AnalysisError> {
    EquilibriumSearch::new(compiled, voltages).estimated(segments)
}

/// The estimate of a mesh whose equilibrium is known, and that on twice the segments; its equilibrium.
pub(super) fn estimated_from(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
    point: OperatingPoint,
    finer: (CompiledModel, OperatingPoint),
) -> Result<(OperatingPoint, Option<f64>), AnalysisError> {
    let search =
        EquilibriumSearch { known: Some(point), finer: Some(finer), ..EquilibriumSearch::new(compiled, voltages) };
    let (order, point) = search.estimated(compiled.order.segments.clone())?;
    Ok((point, order.estimated_error))
}

/// The equilibrium on the mesh as it is, and the estimate of its error.
pub(super) fn assess(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
) -> Result<(OperatingPoint, Option<f64>), AnalysisError> {
    if compiled.order.segments.is_empty() {
        return Ok((operating_point(compiled, voltages)?, Some(0.0)));
    }
    let (order, point) = estimated(compiled, voltages, compiled.order.segments.clone())?;
    Ok((point, order.estimated_error))
}

fn no_mesh() -> AnalysisError {
    AnalysisError::NotConverged { detail: "no mesh has an equilibrium".into() }
}

/// An equilibrium on a mesh.
struct MeshEquilibrium {
    segments: Vec<usize>,
    point: OperatingPoint,
    /// The stiffness that is left; none where that is much on the first mesh.
    left: Option<f64>,
}

/// How far beyond its fold an equilibrium is, as a fraction of the way, where that is little: the mesh may have passed it by mistake.
fn beyond(point: &OperatingPoint) -> Option<f64> {
    point.path.passed.last().map(|passed| passed.share).filter(|share| *share > NEAR_THE_END).map(|share| 1.0 - share)
}

/// Equilibria on one mesh after the other.
struct EquilibriumSearch<'a> {
    compiled: &'a CompiledModel,
    voltages: &'a PortVoltages,
    /// The last model.
    last: Option<Cow<'a, CompiledModel>>,
    /// Its equilibrium, after those of all before.
    points: Vec<MeshEquilibrium>,
    /// The first equilibrium, and that of another mesh next to it, where they have been found before.
    known: Option<OperatingPoint>,
    finer: Option<(CompiledModel, OperatingPoint)>,
    /// Why the last mesh that has no equilibrium has none.
    refused: Option<AnalysisError>,
}

impl<'a> EquilibriumSearch<'a> {
    fn new(compiled: &'a CompiledModel, voltages: &'a PortVoltages) -> Self {
        Self { compiled, voltages, last: None, points: Vec::new(), known: None, finer: None, refused: None }
    }

    /// A mesh with the estimate of its error and its equilibrium.
    fn estimated(mut self, segments: Vec<usize>) -> Result<(Mesh, OperatingPoint), AnalysisError> {
        let order = doubling::estimate(&self.compiled.options, segments, &mut |segments| self.follow(segments))?;
        let (order, point, _) = self.ended(order)?;
        Ok((order, point))
    }

    /// The equilibrium on a mesh, next to that of the mesh before.
    fn follow(&mut self, segments: &[usize]) -> Result<Vec<Output>, AnalysisError> {
        let anew = self.points.last().is_some_and(|before| beyond(&before.point).is_some());
        let known = self.finer.take_if(|(finer, _)| finer.order.segments == segments);
        let (model, (mut point, from_rest)) = match known.filter(|_| !anew) {
            Some((finer, point)) => (Cow::Owned(finer), (point, false)),
            None => self.solve(segments, anew).inspect_err(|error| {
                if matches!(error, AnalysisError::NoEquilibrium { .. }) {
                    self.refused = Some(error.clone());
                }
            })?,
        };
        if let (false, Some(MeshEquilibrium { point: before, .. })) = (from_rest, self.points.last()) {
            // the way from rest is that of the mesh before
            if point.path.passed.is_empty() {
                point.path.passed.clone_from(&before.path.passed);
            }
            point.path.iterations += before.path.iterations;
        }
        let left = match self.points.first() {
            None => softening::left_of_soft(&model, &point),
            Some(first) => first.left.and_then(|_| softening::left(&model, &point)),
        };
        let limit = |value: Option<f64>| {
            let value = value.unwrap_or(f64::NAN);
            Output { value, scale: softening::scale(value, self.compiled.options.errors()) }
        };
        let mut outputs = outputs(&model, &point);
        outputs.extend([limit(left), limit(beyond(&point))]);
        self.last = Some(model);
        self.points.push(MeshEquilibrium { segments: segments.to_vec(), point, left });
        Ok(outputs)
    }

    /// A model and its equilibrium, computed, from rest if it is to be found anew, and whether it is from rest.
    fn solve(
        &mut self,
        segments: &[usize],
        anew: bool,
    ) -> Result<(Cow<'a, CompiledModel>, (OperatingPoint, bool)), AnalysisError> {
        let model = meshed(self.compiled, segments)?;
        let linear = model.parts.system.model.linear;
        let point = match (&self.last, self.points.last(), self.known.take()) {
            (_, None, Some(known)) => (known, true),
            (Some(before), Some(MeshEquilibrium { point, .. }), _) if !anew => {
                let start = carried(&model.structure, &before.parts, &model.parts, &point.q, linear);
                operating_point_near(&model, self.voltages, start)?
            }
            _ => (operating_point(&model, self.voltages)?, true),
        };
        Ok((model, point))
    }

    /// Whether this mesh and twice its segments, where compared, are on one side of their limit.
    fn is_sure(&self, order: &Mesh) -> bool {
        let of = |segments: &[usize]| {
            self.points.iter().find(|compared| compared.segments == segments).map(|compared| compared.left)
        };
        let twice = doubling::twice(&self.compiled.options, order).and_then(|twice| of(&twice.segments));
        of(&order.segments).zip(twice).is_none_or(|(here, twice)| softening::agree(here, twice))
    }

    /// The resulting mesh with its equilibrium, and a mesh on which that has buckled. Where the side of the limit is
    /// unknown, there is no error estimate.
    fn ended(mut self, mut order: Mesh) -> Result<(Mesh, OperatingPoint, Option<Vec<usize>>), AnalysisError> {
        let mut found = self.points.iter().position(|compared| compared.segments == order.segments);
        if found.is_none() {
            self.follow(&order.segments)?;
            found = self.points.len().checked_sub(1);
        }
        if !self.is_sure(&order) {
            order.estimated_error = None;
        }
        let point = found.map(|k| self.points.swap_remove(k).point);
        let mut point = point.ok_or_else(no_mesh)?;
        let buckled = match hidden(&*meshed(self.compiled, &order.segments)?, self.voltages, &point) {
            Hidden::Nothing => None,
            Hidden::Near(beam, softening) => {
                point.near_buckling = Some((beam, softening));
                None
            }
            Hidden::Buckled(segments) => {
                order.estimated_error = None;
                Some(segments)
            }
        };
        Ok((order, point, buckled))
    }
}

/// Compared outputs.
fn outputs(model: &CompiledModel, point: &OperatingPoint) -> Vec<Output> {
    let system = &model.parts.system;
    let q = &point.q;
    let nodes = || model.parts.nodes.iter().flatten();
    let shifts: Vec<_> = nodes().map(|p| p.displacement(q, system.model.linear)).collect();
    let size = size(model);
    let largest = shifts.iter().map(|u| u.norm()).fold(ROUNDING * size / SMALL, f64::max);
    let turned = nodes().map(|p| p.rotation(q).abs()).fold(0.0, f64::max);
    let mut outputs = Vec::with_capacity(3 * shifts.len() + system.electrics.ports);
    for (point, u) in nodes().zip(shifts) {
        let scale = u.norm().max(SMALL * largest).max(f64::MIN_POSITIVE);
        let turn = point.rotation(q);
        let turns = turn.abs().max(SMALL * turned).max(SMALL * largest / size).max(f64::MIN_POSITIVE);
        outputs.extend([
            Output { value: u.x, scale },
            Output { value: u.y, scale },
            Output { value: turn, scale: turns },
        ]);
    }
    let electrics = &system.electrics;
    let charge = |p: usize| -> f64 {
        let of = |g: usize| electrics.gap_rows[(g, p)] * system.charge(g, q, &point.volts);
        (0..point.volts.len()).map(of).sum()
    };
    let charges: Vec<f64> = (0..electrics.ports).map(charge).collect();
    let most = charges.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let scaled = |c: f64| Output { value: c, scale: c.abs().max(SMALL * most).max(f64::MIN_POSITIVE) };
    outputs.extend(charges.into_iter().map(scaled));
    outputs
}

/// The longest beam, which stands for the size of the mechanism (m).
pub(super) fn size(model: &CompiledModel) -> f64 {
    model.structure.beams.iter().map(|b| b.length).fold(model.parts.system.length_scale, f64::max)
}

/// The equilibrium on the mesh for it, which comes with it, and the displacement of points along every beam.
///
/// # Errors
/// See [`super::static_fitted`].
pub fn static_fitted(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
) -> Result<(CompiledModel, StaticResult, BeamMotions), AnalysisError> {
    let (fitted, point, directions) = point_fitted(compiled, voltages)?;
    let (result, curves) = (result_of(&fitted, &point, directions), beam_motions(&fitted, &point.q));
    Ok((fitted, result, curves))
}

/// The same, with the state of every beam.
///
/// # Errors
/// See [`super::static_fitted`].
pub fn static_with_beams(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<StaticWithBeams, AnalysisError> {
    let (fitted, point, directions) = point_fitted(compiled, voltages)?;
    let (result, curves) = (result_of(&fitted, &point, directions), beam_motions(&fitted, &point.q));
    let beams = beam_states(&fitted, &point);
    Ok(StaticWithBeams { fitted, result, curves, beams })
}

/// An equilibrium with the state of every beam.
#[derive(Debug, Clone)]
pub struct StaticWithBeams {
    /// The model on the mesh for it.
    pub fitted: CompiledModel,
    /// The equilibrium.
    pub result: StaticResult,
    /// Displacement of points along every beam.
    pub curves: BeamMotions,
    /// State of every beam; none of beams with rigid directions.
    pub beams: Vec<Option<BeamState>>,
}

/// The equilibrium on the mesh for it, with its warnings; and the directions of the reduced model where that has it.
fn point_fitted(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
) -> Result<(CompiledModel, OperatingPoint, Option<usize>), AnalysisError> {
    let (order, point) = order(compiled, voltages, compiled.order.segments.clone())?;
    let mut fitted = on(compiled, order)?;
    let reported = static_warnings(&fitted, &point);
    fitted.warnings.items.extend(reported);
    if fitted.options.formulation != Formulation::Reduced {
        return Ok((fitted, point, None));
    }
    let tol = fitted.options.errors().requested();
    let warned = |message: String| Diagnostic::warning(reduced::WARNING, message, "");
    match reduced::equilibrium(&fitted, &point) {
        Ok(found) => {
            let reported = reduced::beyond(found.error, tol).map(|text| format!("{text}; {}", reduced::REMEDY));
            fitted.warnings.items.extend(reported.map(warned));
            fitted.order.estimated_error = fitted.order.estimated_error.map(|mesh| mesh + found.error);
            Ok((fitted, found.point, Some(found.directions)))
        }
        Err(why) => {
            fitted.warnings.items.push(warned(reduced::taken(&why)));
            Ok((fitted, point, None))
        }
    }
}

/// The result at an equilibrium, with the number of directions where it is that of a reduced model.
fn result_of(fitted: &CompiledModel, point: &OperatingPoint, directions: Option<usize>) -> StaticResult {
    let result = result_at(fitted, point);
    StaticResult { unknowns: directions.unwrap_or(result.unknowns), ..result }
}

/// Warnings about an equilibrium of a circuit, each with its size: an error that grows (1), or 1. Beside what
/// `static_warnings` warns of, the mesh along its gaps, which was chosen without any voltage.
pub fn operating_point_warnings(fitted: &CompiledModel, point: &OperatingPoint) -> Vec<(Diagnostic, f64)> {
    let share = stress_left_out(fitted, point);
    let worst = gap_shape::left_out(fitted, point);
    let segments = worst.and_then(|worst| Some((of_segments(fitted, &worst)?, worst.1)));
    let stress = of_stress(fitted, share).map(|warning| (warning, share.unwrap_or(1.0)));
    let others = transient_warnings(fitted, point).into_iter().map(|warning| (warning, 1.0));
    stress.into_iter().chain(segments).chain(others).collect()
}

/// Warnings about a state in motion that can be evaluated at once, as for an equilibrium.
pub fn transient_warnings(fitted: &CompiledModel, point: &OperatingPoint) -> Vec<Diagnostic> {
    let reported = of_fingers(fitted, point).into_iter().chain(of_heat(fitted, point));
    reported.chain(of_strength(fitted, point)).collect()
}

/// Warnings about an equilibrium beside its mesh: stress stiffening omitted by a linear model, and combs and
/// temperatures beyond their range.
pub(super) fn static_warnings(fitted: &CompiledModel, point: &OperatingPoint) -> Vec<Diagnostic> {
    let stress = of_stress(fitted, stress_left_out(fitted, point));
    stress.into_iter().chain(transient_warnings(fitted, point)).chain(near_buckling(point)).collect()
}

/// Fraction of the deflection that a linear model omits (1).
fn stress_left_out(fitted: &CompiledModel, point: &OperatingPoint) -> Option<f64> {
    if fitted.options.linear { left_out(fitted, point, &point.q) } else { None }
}
