//! The mesh for an equilibrium path: its folds, bifurcations and end are compared with those of twice the segments.
//!
//! A branch and its mirror image count as one: where the finer mesh follows the other one, it is traced once more in
//! the opposite direction.

use super::super::continuation::{ContinuationRequest, ContinuationResult, CriticalPoint, PathInput, trace};
use super::super::linear_stress::left_out;
use super::super::reduced::not_reduced;
use super::super::statics::operating_point;
use super::super::{AnalysisError, PortVoltages, ProgressCallback};
use super::equilibrium::{ROUNDING, SMALL, size};
use super::refined::refining;
use super::remeshed::{chosen, meshed, on};
use super::warnings::of_stress;
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::doubling::{self, Output};
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_solve::continuation::Branch;

/// Folds that are compared, and bifurcations: the first.
const MAX_EVENTS: usize = 8;
/// Ends of a path that are compared.
const ENDS: [&str; 2] = ["arrived", "turned back"];
/// Results that differ by more than this fraction are of another branch.
const OTHER_BRANCH: f64 = 0.3;

/// The path on the mesh for it, which comes with it.
///
/// # Errors
/// See [`trace`].
pub fn path_fitted(
    compiled: &CompiledModel,
    request: &ContinuationRequest<'_>,
    watch: ProgressCallback<'_>,
) -> Result<(CompiledModel, ContinuationResult), AnalysisError> {
    not_reduced(compiled, "path")?;
    refining(compiled, |compiled| path_from(compiled, request, &mut *watch))
}

/// The path on the mesh of the model or on the one that it needs beyond that.
fn path_from(
    compiled: &CompiledModel,
    request: &ContinuationRequest<'_>,
    watch: ProgressCallback<'_>,
) -> Result<(CompiledModel, ContinuationResult), AnalysisError> {
    let mut search = PathSearch { compiled, request, watch, known: Vec::new(), stopped: false };
    let segments = compiled.order.segments.clone();
    let mut analyse = |segments: &[usize]| search.follow(segments);
    let order = match chosen(compiled) {
        true => doubling::estimate(&compiled.options, segments, &mut analyse)?,
        false => doubling::fit(&compiled.structure, &compiled.options, segments, &mut analyse)?,
    };
    if search.stopped {
        return Err(AnalysisError::Cancelled);
    }
    if !search.known.iter().any(|(known, _)| *known == order.segments) {
        search.follow(&order.segments)?;
    }
    let of_mesh = search.known.into_iter().find(|(known, _)| *known == order.segments);
    let lost = || AnalysisError::NotConverged { detail: "no mesh has a path".into() };
    let (_, result) = of_mesh.ok_or_else(lost)?;
    // a path that ends by its limit of points, or elsewhere on twice the segments, is not compared at its end
    let compared = ENDS.contains(&result.end);
    let order = Mesh { estimated_error: order.estimated_error.filter(|e| compared && e.is_finite()), ..order };
    let mut fitted = on(compiled, order)?;
    let share = if fitted.options.linear { left_out_at_end(&fitted, request) } else { None };
    let reported = of_stress(&fitted, share);
    fitted.warnings.items.extend(reported);
    Ok((fitted, result))
}

/// Fraction of the largest critical value below which one is taken for zero, and of the whole way (1).
const CROSSING: [f64; 2] = [1e-3, 1e-6];

/// Paths on one mesh after the other.
struct PathSearch<'a, 'w> {
    compiled: &'a CompiledModel,
    request: &'a ContinuationRequest<'a>,
    watch: ProgressCallback<'w>,
    known: Vec<(Vec<usize>, ContinuationResult)>,
    stopped: bool,
}

impl PathSearch<'_, '_> {
    fn follow(&mut self, segments: &[usize]) -> Result<Vec<Output>, AnalysisError> {
        let mut result = self.on(segments, self.request.branch)?;
        let mut outputs = self.outputs(&result);
        let first = self.known.first().map(|(_, first)| self.outputs(first));
        if let Some(first) = first
            && !result.bifurcations.is_empty()
            && apart(&first, &outputs) > OTHER_BRANCH
        {
            let other = match self.request.branch {
                Branch::Plus => Branch::Minus,
                Branch::Minus => Branch::Plus,
                Branch::Stay => Branch::Stay,
            };
            let mirrored = self.on(segments, other)?;
            let its = self.outputs(&mirrored);
            if apart(&first, &its) <= OTHER_BRANCH {
                (result, outputs) = (mirrored, its);
            }
        }
        self.known.push((segments.to_vec(), result));
        Ok(outputs)
    }

    fn on(&mut self, segments: &[usize], branch: Branch) -> Result<ContinuationResult, AnalysisError> {
        let model = meshed(self.compiled, segments)?;
        let last = match self.request.input {
            PathInput::Parameter(last) => Some(meshed(last, segments)?),
            _ => None,
        };
        let input = last.as_deref().map_or_else(|| self.request.input.clone(), PathInput::Parameter);
        let request = ContinuationRequest { input, branch, ..self.request.clone() };
        let found = trace(&model, &request, self.watch);
        self.stopped |= matches!(found, Err(AnalysisError::Cancelled));
        found
    }

    /// Compared outputs.
    fn outputs(&self, found: &ContinuationResult) -> Vec<Output> {
        let way = self.request.from.abs().max(self.request.to.abs());
        let output =
            |value: f64, largest: f64| Output { value, scale: value.abs().max(SMALL * largest).max(f64::MIN_POSITIVE) };
        let none = Output { value: f64::NAN, scale: 1.0 };
        // no less than what rounding leaves of the mechanism: a path may end at rest
        let size = size(self.compiled);
        let moved = found.last.iter().map(|(_, m)| m.x.hypot(m.y)).fold(ROUNDING * size, f64::max);
        // what turns the size of the mechanism by what it moves
        let turned = found.last.iter().map(|(_, m)| m.rz.abs()).fold(moved / size, f64::max);
        let of_unit = |unit: &str| {
            let of = found.signals.iter().filter(|s| s.1 == unit).flat_map(|s| &s.2);
            let least = match unit {
                "m" => moved,
                "rad" => turned,
                _ => 0.0,
            };
            of.fold(least, |m: f64, v| m.max(v.abs()))
        };
        let largest: Vec<f64> = found.signals.iter().map(|s| of_unit(&s.1)).collect();
        let mut outputs = Vec::new();
        let mut at = |point: Option<(f64, usize)>, least: f64| {
            let scaled = |value: f64| Output { value, scale: value.abs().max(least).max(f64::MIN_POSITIVE) };
            outputs.push(point.map_or(none, |(value, _)| scaled(value)));
            outputs.extend(found.signals.iter().zip(&largest).map(|(s, most)| match point {
                Some((_, k)) => output(s.2[k], *most),
                None => none,
            }));
        };
        // a path to 1 mN must resolve a bifurcation at 1 µN, too
        let critical = || found.folds.iter().chain(&found.bifurcations);
        let least = CROSSING[0] * critical().map(|c| c.value.abs()).fold(CROSSING[1] / CROSSING[0] * way, f64::max);
        for list in [&found.folds, &found.bifurcations] {
            (0..MAX_EVENTS).for_each(|k| at(list.get(k).map(|c: &CriticalPoint| (c.value, c.point)), least));
        }
        // elsewhere it ends nowhere in particular
        let ends = ENDS.contains(&found.end);
        at(found.values.last().map(|value| (*value, found.values.len() - 1)).filter(|_| ends), SMALL * way);
        outputs.extend(found.last.iter().flat_map(|(_, m)| {
            let of_node = m.x.hypot(m.y).max(SMALL * moved).max(f64::MIN_POSITIVE);
            let shift = |value| Output { value, scale: of_node };
            if ends { [shift(m.x), shift(m.y), output(m.rz, turned)] } else { [none; 3] }
        }));
        outputs
    }
}

/// The largest difference of two paths, as a fraction.
fn apart(first: &[Output], other: &[Output]) -> f64 {
    let one = |(a, b): (&Output, &Output)| {
        if a.value.is_nan() || b.value.is_nan() { 0.0 } else { (a.value - b.value).abs() / a.scale.max(b.scale) }
    };
    first.iter().zip(other).map(one).fold(0.0, f64::max)
}

/// Effect of stress at the end of the path of a linear model.
fn left_out_at_end(fitted: &CompiledModel, request: &ContinuationRequest<'_>) -> Option<f64> {
    let mut volts: Vec<(String, f64)> = request.voltages.clone();
    let share = |model: &CompiledModel, volts: &PortVoltages| {
        let point = operating_point(model, volts).ok()?;
        left_out(model, &point, &point.q)
    };
    match request.input {
        PathInput::Port(name) => {
            volts.retain(|(port, _)| port != name);
            volts.push((name.to_owned(), request.to));
            share(fitted, &volts)
        }
        PathInput::Parameter(last) => share(meshed(last, &fitted.order.segments).ok()?.as_ref(), &volts),
        PathInput::Loads => {
            let most = if request.to.abs() > request.from.abs() { request.to } else { request.from };
            let mut at_end = fitted.clone();
            for load in &mut at_end.parts.system.loads {
                load.force *= most;
                load.moment *= most;
            }
            share(&at_end, &volts)
        }
    }
}
