//! Batched sweeps of transients: some dozens of points at a time.
//!
//! To find the mesh of a transient costs more than to run it. So meshes are searched at the corners of the grid and in
//! its middle (`probes`). All points use the finest of them beam by beam, and report the largest of their estimates. A
//! point whose drawing has other beams finds its own.
//!
//! The step tolerance and the step error are determined in the middle of the grid, at the cost of about two runs. Every
//! point reports a step error beyond the tolerance.

use super::axis::{SweepParameter, at};
use super::point::{PointOutcome, PointResults, PointValue, brief};
use super::point_budget::PointBudget;
use super::point_error::Failed;
use super::reductions::{self, ReducedVariant, ReducedVariants};
use super::samples::SampleGenerator;
use super::shared_meshes::{alike, middle};
use super::spec::{SweepAnalysis, SweepSpec};
use bimorph_analysis::batch_transient::{self, RunEnd};
use bimorph_analysis::chosen_run::{gives_way, tentative};
use bimorph_analysis::formulation;
use bimorph_analysis::mesh;
use bimorph_analysis::readout::expression::Expression;
use bimorph_analysis::reduced;
use bimorph_analysis::reduced::batch::SharedRun;
use bimorph_analysis::reduced::confirmed::train_confirmed;
use bimorph_analysis::reduced::shared::TrainedMotion;
use bimorph_analysis::step_error;
use bimorph_analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph_analysis::{AnalysisError, ProgressCallback};
use bimorph_base::Setting;
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation, ParsedStructure, draw};
use bimorph_model::discretize::DiscretizeError;
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_netlist::NetlistSource;
use bimorph_structure::Beam;
use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

/// Points that are laid out at once.
pub(super) const CHUNK: usize = 64;
/// Most corners that are all run; where there are more, the ends of each axis with the others in the middle.
const MAX_CORNERS: usize = 8;

/// Where steps are judged that all points share.
const IN_THE_MIDDLE: &str = "in the middle of the grid";
/// Output times of the run by which the steps are judged.
const ERROR_SAMPLES: usize = 201;

/// The mesh of a sweep.
struct SweepMesh {
    beams: Vec<Beam>,
    order: Mesh,
    /// Whether `auto` took joint coordinates for it, which cut beams otherwise: for the first probe, and then for every point on this mesh.
    in_joints: bool,
    /// The steps in the middle of the grid.
    steps: Steps,
}

/// Step tolerance of a run, and its estimated error.
#[derive(Debug, Clone, Copy)]
struct Steps {
    /// Their tolerance (1).
    tol: f64,
    /// As a fraction of the amplitude; none: not compared.
    error: Option<f64>,
    /// Where that was found.
    place: &'static str,
}

impl SweepMesh {
    /// A point on this mesh, in the formulation that it is for; none where the point has other beams, or joint coordinates do not suit it.
    ///
    /// # Errors
    /// See [`DiscretizeError`].
    fn model(
        &self,
        drawn: &ParsedStructure,
        options: &TransientOptions<'_>,
    ) -> Result<Option<CompiledModel>, DiscretizeError> {
        if !alike(&self.beams, &drawn.structure.beams) {
            return Ok(None);
        }
        let compiled = drawn.clone().on(self.order.clone())?;
        if !self.in_joints {
            return Ok(Some(compiled));
        }
        if !formulation::may_take_joints(&compiled, options) {
            return Ok(None);
        }
        let joints = drawn.clone().in_formulation(Formulation::Rcr).on(self.order.clone())?;
        Ok(matches!(joints.joints, Some(Ok(_))).then_some(joints))
    }
}

/// A point on its mesh.
struct MeshedPoint {
    compiled: Arc<CompiledModel>,
    /// The training that it shares with other points.
    trained: Option<Arc<TrainedMotion>>,
    steps: Steps,
    /// Warnings about effects that its run omits.
    reported: Vec<String>,
}

/// Data that all points share.
pub(super) struct TransientSweep<'a> {
    spec: &'a SweepSpec,
    source: &'a NetlistSource,
    options: Arc<CompileOptions>,
    mesh: OnceLock<Option<SweepMesh>>,
    variants: ReducedVariants,
}

impl<'a> TransientSweep<'a> {
    pub(super) fn new(spec: &'a SweepSpec, source: &'a NetlistSource, options: Arc<CompileOptions>) -> Self {
        let options = reductions::with_ranges(spec, options);
        Self { spec, source, options, mesh: OnceLock::new(), variants: ReducedVariants::default() }
    }

    /// Runs some points. `finished` is called for each with whether it has a result, and returns whether to continue.
    /// `None` if it returned false.
    pub(super) fn run(
        &self,
        numbers: &[usize],
        means: &PointBudget,
        finished: &(dyn Fn(Option<&PointOutcome>) -> bool + Sync),
    ) -> Option<Vec<PointOutcome>> {
        let go_on = || finished(None);
        let prepare = |&number: &usize| means.guarded(|| self.prepare(&self.spec.settings(number), &go_on));
        let prepared: Vec<Result<MeshedPoint, Failed>> = numbers.iter().map(prepare).collect();
        // lanes have one tolerance for all
        let tol = prepared.iter().flatten().next().map_or(self.options.errors().requested(), |point| point.steps.tol);
        let like = |p: &'_ Result<MeshedPoint, Failed>| p.as_ref().is_ok_and(|point| point.steps.tol == tol);
        let variants: Vec<(usize, &CompiledModel)> = (prepared.iter().enumerate().filter(|(_, p)| like(p)))
            .filter_map(|(k, p)| Some((k, &*p.as_ref().ok()?.compiled)))
            .collect();
        let compiled: Vec<&CompiledModel> = variants.iter().map(|(_, compiled)| *compiled).collect();
        // lanes have one voltage for all
        let same = self.spec.ports().next().is_none();
        let batch_results = same.then(|| {
            let options = self.transient(&[]).with_tolerance(tol);
            means.guarded(|| {
                batch_transient::ends(&compiled, &options, &mut || finished(None)).map_err(|error| error.to_string())
            })
        });
        let mut ends: Vec<Option<RunEnd>> = vec![None; numbers.len()];
        if let Some(Ok((found, _))) = batch_results {
            for ((k, _), end) in variants.iter().zip(found) {
                ends[*k] = end;
            }
        }
        self.run_reduced(numbers, &prepared, means, &mut ends, &go_on);
        let mut outcomes = Vec::with_capacity(numbers.len());
        for ((&number, prepared), end) in numbers.iter().zip(&prepared).zip(ends) {
            let settings = self.spec.settings(number);
            let options = self.transient(&settings);
            let values = match (prepared, end) {
                (Err(error), _) => Err(error.clone()),
                (Ok(point), Some(end)) => self.found(point, &options, end).map_err(Failed::from),
                (Ok(point), None) => means.guarded(|| self.alone(point, &settings, &go_on)),
            };
            let parameters = settings.into_iter().map(|(_, value)| value).collect();
            let outcome = PointOutcome { number, parameters, values };
            if !finished(Some(&outcome)) {
                return None;
            }
            outcomes.push(outcome);
        }
        Some(outcomes)
    }

    /// Runs of points that share trainings, in lanes where these can have them.
    fn run_reduced(
        &self,
        numbers: &[usize],
        prepared: &[Result<MeshedPoint, Failed>],
        means: &PointBudget,
        ends: &mut [Option<RunEnd>],
        go_on: &dyn Fn() -> bool,
    ) {
        let shared: Vec<(usize, SharedRun<'_>)> = (numbers.iter().zip(prepared).enumerate())
            .filter_map(|(k, (&number, point))| {
                let point = point.as_ref().ok().filter(|point| point.trained.is_some())?;
                let options = own_options(point, &self.transient(&self.spec.settings(number)));
                Some((k, (&*point.compiled, options)))
            })
            .collect();
        let (places, runs): (Vec<usize>, Vec<SharedRun<'_>>) = shared.into_iter().unzip();
        let Ok((results, _)) = means.guarded(|| Ok(reduced::batch::transients(&runs, &mut || go_on()))) else { return };
        for (place, result) in places.into_iter().zip(results) {
            ends[place] = result.map(ended);
        }
    }

    /// The run of a point.
    fn transient(&self, settings: &[(String, Setting)]) -> TransientOptions<'static> {
        let SweepAnalysis::Transient { stop, outputs, voltages } = &*self.spec.analysis_at(settings) else {
            return TransientOptions::default();
        };
        TransientOptions {
            stop: *stop,
            signals: outputs.clone(),
            points: 2,
            tol: self.options.errors().requested(),
            voltages: voltages.clone(),
            ..TransientOptions::default()
        }
    }

    /// A point on its mesh.
    fn prepare(&self, settings: &[(String, Setting)], go_on: &dyn Fn() -> bool) -> Result<MeshedPoint, String> {
        let options = self.transient(settings);
        let shared =
            if self.spec.has_variants() { self.mesh.get_or_init(|| self.search(go_on)).as_ref() } else { None };
        if let Some(shared) = shared.filter(|_| reductions::shares(self.spec, &self.options)) {
            let slot = self.variants.slot(settings);
            let variant = slot.get_or_init(|| self.reduced_variant(settings, shared, go_on)).as_ref();
            if let Some(ReducedVariant { compiled, trained }) = variant.map_err(Clone::clone)? {
                let trained = Some(Arc::clone(trained));
                return Ok(MeshedPoint { trained, ..prepared(Arc::clone(compiled), &options, shared.steps) });
            }
        }
        let drawn = draw(self.source, &at(&self.options, settings)).map_err(|error| brief(&error))?;
        let on_shared = shared.map(|shared| Ok::<_, DiscretizeError>((shared.model(&drawn, &options)?, shared.steps)));
        match on_shared.transpose().map_err(|error| error.to_string())? {
            Some((Some(compiled), steps)) => Ok(prepared(Arc::new(compiled), &options, steps)),
            _ => on_own_mesh(&drawn.compile().map_err(|error| brief(&error))?, &options, go_on),
        }
    }

    /// The system of a point on the mesh that points share, trained for all voltages of its ports; none where its drawing has other beams.
    fn reduced_variant(
        &self,
        settings: &[(String, Setting)],
        shared: &SweepMesh,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<ReducedVariant>, String> {
        let drawn = draw(self.source, &at(&self.options, settings)).map_err(|error| brief(&error))?;
        let options = self.transient(settings);
        let Some(compiled) = shared.model(&drawn, &options).map_err(|error| error.to_string())? else {
            return Ok(None);
        };
        let largest = options.with_voltages(reductions::largest(self.spec, &options.voltages));
        let trained = train_confirmed(&compiled, &largest, &mut |_| go_on()).map_err(|error| error.to_string())?;
        Ok(Some(ReducedVariant { compiled: Arc::new(compiled), trained }))
    }

    /// A run of its own: of the bodies where one in joint coordinates fails that `auto` took, and in joint coordinates where steps of the bodies
    /// fail.
    fn alone(
        &self,
        point: &MeshedPoint,
        settings: &[(String, Setting)],
        go_on: &dyn Fn() -> bool,
    ) -> Result<PointResults, String> {
        let options = self.transient(settings);
        let mut run = |watch: ProgressCallback<'_>| end(point, &options, watch);
        let done = tentative(&point.compiled, &options, &mut |_| true, &mut run);
        if let Ok(Some(end)) = done {
            return self.found(point, &options, end);
        }
        let drawn = draw(self.source, &at(&self.options, settings)).map_err(|error| brief(&error))?;
        let drawn = drawn.compile().map_err(|error| brief(&error))?;
        if let Err(error) = done {
            let in_joints = if gives_way(&error) { in_joints(&drawn, &options, go_on) } else { None };
            let (point, end) = in_joints.ok_or_else(|| error.to_string())?;
            return self.found(&point, &options, end);
        }
        let point = on_own_mesh(&drawn.for_given_steps(), &options, go_on)?;
        let end = end(&point, &options, &mut |_| true).map_err(|error| error.to_string())?;
        self.found(&point, &options, end)
    }

    /// The mesh that is fine enough at every probe: that of the bodies where the run in the middle fails in joint coordinates.
    fn search(&self, go_on: &dyn Fn() -> bool) -> Option<SweepMesh> {
        let chosen = self.search_in(true, go_on)?;
        if chosen.in_joints && chosen.steps.error.is_none() { self.search_in(false, go_on) } else { Some(chosen) }
    }

    /// As above, in joint coordinates where they are allowed and `auto` takes them.
    fn search_in(&self, joints: bool, go_on: &dyn Fn() -> bool) -> Option<SweepMesh> {
        let mut shared: Option<SweepMesh> = None;
        for settings in probes(self.spec) {
            let drawn = draw(self.source, &at(&self.options, &settings));
            let Some(compiled) = drawn.ok().and_then(|drawn| drawn.compile().ok()) else { continue };
            let options = self.transient(&settings);
            let order = match joints {
                true => mesh::suited_order_in_time(&compiled, &options),
                false => mesh::order_in_time(&compiled, &options).map(|order| (order, false)),
            };
            let Ok((order, in_joints)) = order else { continue };
            match &mut shared {
                None => {
                    let steps = Steps { tol: self.options.errors().requested(), error: None, place: IN_THE_MIDDLE };
                    let beams = compiled.structure.beams.clone();
                    shared = Some(SweepMesh { beams, order, in_joints, steps });
                }
                Some(shared) if shared.in_joints == in_joints && alike(&shared.beams, &compiled.structure.beams) => {
                    for (most, n) in shared.order.segments.iter_mut().zip(order.segments) {
                        *most = (*most).max(n);
                    }
                    let both = shared.order.estimated_error.zip(order.estimated_error);
                    shared.order.estimated_error = both.map(|(a, b)| a.max(b));
                }
                Some(_) => {}
            }
        }
        let mut shared = shared?;
        let settings = middle(self.spec);
        let drawn = draw(self.source, &at(&self.options, &settings)).ok();
        let options = self.transient(&settings);
        let middle = drawn.and_then(|drawn| shared.model(&drawn, &options).ok().flatten());
        if let Some(compiled) = middle {
            shared.steps = steps(&compiled, &options, IN_THE_MIDDLE, go_on);
        }
        Some(shared)
    }

    fn found(&self, point: &MeshedPoint, options: &TransientOptions<'_>, end: RunEnd) -> Result<PointResults, String> {
        let MeshedPoint { compiled, steps: Steps { error, place, .. }, reported, .. } = point;
        let mut values = Vec::with_capacity(end.values.len());
        for (name, value) in options.signals.iter().zip(end.values) {
            if !value.is_finite() {
                return Err(format!("{name} is not finite"));
            }
            let unit = Expression::of_run(compiled, name, &[]).map_err(|error| error.to_string())?.unit();
            values.push(PointValue { name: name.clone(), unit: unit.into(), value: Some(value) });
        }
        let estimated_error = compiled.order.estimated_error;
        let beyond = mesh::beyond(self.options.errors(), estimated_error);
        let beyond = beyond.map(|message| format!("{}: {message}", mesh::WARNING));
        let steps = match error {
            Some(error) => step_error::beyond(options, *error, place),
            None => Some(step_error::unknown(options)),
        };
        let reported = reported.iter().cloned();
        let warnings: Vec<String> = beyond.into_iter().chain(reported).chain(steps).chain(end.warnings).collect();
        let estimated_error = estimated_error.filter(|error| error.is_finite());
        Ok(PointResults { values, estimated_error, warning: warnings.join("; ") })
    }
}

/// A point on its mesh, with what its run leaves out.
fn prepared(compiled: Arc<CompiledModel>, options: &TransientOptions<'_>, steps: Steps) -> MeshedPoint {
    let reported = mesh::run_warnings(&compiled, None, &options.voltages);
    let reported = reported.iter().map(|d| format!("{}: {}", d.code, d.message)).collect();
    MeshedPoint { steps, reported, compiled, trained: None }
}

/// The steps of a run of this variant.
fn steps(compiled: &CompiledModel, run: &TransientOptions<'_>, place: &'static str, go_on: &dyn Fn() -> bool) -> Steps {
    let options = run.with_points(ERROR_SAMPLES);
    let mut estimate = |watch: ProgressCallback<'_>| Ok(step_error::step_error(&options, compiled, watch));
    let found = tentative(compiled, run, &mut |_| go_on(), &mut estimate).ok().flatten();
    let (error, tol) = found.unwrap_or((None, run.errors().requested()));
    Steps { tol, error, place }
}

/// A point on the mesh of its own run; in joint coordinates where `auto` may take them and the bodies have no mesh.
fn on_own_mesh(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
    go_on: &dyn Fn() -> bool,
) -> Result<MeshedPoint, String> {
    let fitted = mesh::fitted_in_time(drawn, options).or_else(|error| {
        let in_joints = if gives_way(&error) { mesh::fitted_in_joints(drawn, options).ok().flatten() } else { None };
        in_joints.ok_or(error)
    });
    let (compiled, _) = fitted.map_err(|error| error.to_string())?;
    let steps = steps(&compiled, options, "by the end of the run", go_on);
    Ok(prepared(Arc::new(compiled), options, steps))
}

/// A point in joint coordinates and the end of its run; none where it fails there, too, or `auto` was not requested.
fn in_joints(
    drawn: &CompiledModel,
    options: &TransientOptions<'_>,
    go_on: &dyn Fn() -> bool,
) -> Option<(MeshedPoint, RunEnd)> {
    let (compiled, _) = mesh::fitted_in_joints(drawn, options).ok().flatten()?;
    let steps = steps(&compiled, options, "by the end of the run", go_on);
    let point = prepared(Arc::new(compiled), options, steps);
    let mut run = |watch: ProgressCallback<'_>| end(&point, options, watch);
    let end = tentative(&point.compiled, options, &mut |_| go_on(), &mut run).ok().flatten()?;
    Some((point, end))
}

/// The end of a run of its own.
fn end(
    point: &MeshedPoint,
    options: &TransientOptions<'_>,
    watch: ProgressCallback<'_>,
) -> Result<RunEnd, AnalysisError> {
    let result = transient(&point.compiled, &own_options(point, options), &mut |_, _| (), watch)?;
    Ok(ended(result))
}

/// The options of a point with the tolerance of its steps and its training.
fn own_options<'a>(point: &MeshedPoint, options: &TransientOptions<'a>) -> TransientOptions<'a> {
    let options = options.with_tolerance(point.steps.tol);
    match &point.trained {
        Some(trained) => options.with_reduction(Arc::clone(trained)),
        None => options,
    }
}

/// The end of a run.
fn ended(result: TransientResult) -> RunEnd {
    let last = |(_, _, values): &(String, String, Vec<f64>)| values.last().copied().unwrap_or(f64::NAN);
    let values = result.signals.iter().map(last).collect();
    RunEnd { values, steps: result.counters.steps, warnings: result.warnings }
}

/// Fraction of the samples beyond a probe on either side.
const RARE: f64 = 1e-3;

/// The middle of the grid and its corners. A numeric axis contributes its least and largest value, another its first
/// and last. Linked axes contribute the points where one of them is at an end, and random parameters their 0.1 %
/// quantiles.
fn probes(spec: &SweepSpec) -> Vec<Vec<(String, Setting)>> {
    let ends: Vec<Vec<Vec<(String, Setting)>>> = spec.groups().map(ends).chain(drawn(spec)).collect();
    let middle = middle(spec);
    let with = |probe: &[(String, Setting)], end: &[(String, Setting)]| {
        let other = |(name, value): &(String, Setting)| {
            let end = end.iter().find(|(at, _)| at == name).map(|(_, value)| value);
            (name.clone(), end.unwrap_or(value).clone())
        };
        probe.iter().map(other).collect::<Vec<_>>()
    };
    let mut probes = vec![middle.clone()];
    if ends.iter().map(Vec::len).fold(1, usize::saturating_mul) <= MAX_CORNERS {
        let mut corners = vec![middle];
        for ends in &ends {
            corners = ends.iter().flat_map(|end| corners.iter().map(|corner| with(corner, end))).collect();
        }
        probes.extend(corners);
    } else {
        probes.extend(ends.iter().flatten().map(|end| with(&middle, end)));
    }
    probes.dedup();
    probes
}

/// The points of an axis where one of what goes together is at an end.
fn ends(group: &[SweepParameter]) -> Vec<Vec<(String, Setting)>> {
    let of_axis = |axis: &SweepParameter| axis.values.ends().map(|(least, largest)| [least, largest]);
    let axes = group.iter().filter(|axis| axis.option().is_none());
    let mut places: BTreeSet<usize> = axes.filter_map(of_axis).flatten().collect();
    if places.is_empty() {
        places.insert(group[0].values.len() / 2);
    }
    let at =
        |place: usize| group.iter().filter_map(|axis| Some((axis.name.clone(), axis.values.get(place)?))).collect();
    places.into_iter().map(at).collect()
}

/// The ends of what is drawn.
fn drawn(spec: &SweepSpec) -> impl Iterator<Item = Vec<Vec<(String, Setting)>>> {
    let both = |samples: &SampleGenerator| samples.quantiles(RARE).into_iter().zip(samples.quantiles(1.0 - RARE));
    spec.samples.iter().flat_map(both).map(|(low, high)| vec![vec![low], vec![high]])
}
