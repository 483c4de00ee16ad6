//! Batched sweeps of statics or modes: points run in lanes where they differ from the middle of the grid in numbers
//! alone.
//!
//! Points are laid out on the first mesh that all share. Equilibria in lanes have the bits of a point alone. Modes in lanes begin with
//! those of the middle of the grid, and are those of a point alone to rounding. A point that has its result from lanes, and whose mesh
//! holds, is done; any other runs as a point alone. Which of the two it is depends on the grid and on the point, not on its neighbours, on
//! shards or on threads, but for points that spend a server's budget together.

use super::axis::at;
use super::point::{self, PointOutcome, PointResults, brief};
use super::point_budget::PointBudget;
use super::shared_meshes::SharedMeshes;
use super::spec::SweepSpec;
use bimorph_analysis::PortVoltages;
use bimorph_analysis::batch_modes::BatchModes;
use bimorph_analysis::batch_statics::BatchStatics;
use bimorph_analysis::mesh::MeshRequest;
use bimorph_analysis::mesh::on_given_mesh::{Assessment, Finer, assess_found_modes, assess_found_static, finer};
use bimorph_model::compile::{CompileOptions, CompiledModel, draw};
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_netlist::NetlistSource;
use std::sync::{Arc, OnceLock};

/// Points that are laid out at once, at most.
pub(super) const CHUNK: usize = 32;
/// Bodies of a point, at most: larger ones take their time anyway, and some of them at once the memory.
const MAX_BODIES: usize = 1000;

/// Data that all points share.
pub(super) struct BatchedSweep<'a> {
    spec: &'a SweepSpec,
    source: &'a NetlistSource,
    options: Arc<CompileOptions>,
    family: Arc<SharedMeshes<'a>>,
    lanes: OnceLock<Option<SweepLanes>>,
}

/// Lanes for variants like the middle of the grid.
enum SweepLanes {
    Modes(Box<BatchModes>),
    /// On the mesh of the points, and on that of twice the segments.
    Static(Box<[BatchStatics; 2]>),
}

impl SweepLanes {
    fn new(middle: &CompiledModel, request: &MeshRequest<'_>) -> Option<Self> {
        if middle.parts.system.bodies() > MAX_BODIES {
            return None;
        }
        match *request {
            MeshRequest::Modes { count, voltages } => {
                BatchModes::new(middle, count, voltages).map(|lanes| Self::Modes(Box::new(lanes)))
            }
            MeshRequest::Static { .. } => {
                let fine =
                    middle.with_order(bimorph_model::refine::doubling::twice(&middle.options, &middle.order)?).ok()?;
                Some(Self::Static(Box::new([BatchStatics::new(middle)?, BatchStatics::new(&fine)?])))
            }
            MeshRequest::PullIn { .. } => None,
        }
    }

    /// Assessments of the variants from lanes; their mesh may be too coarse.
    fn assess(&self, variants: &[&CompiledModel], request: &MeshRequest<'_>) -> Vec<Option<Assessment>> {
        match (self, *request) {
            (Self::Modes(lanes), MeshRequest::Modes { count, voltages }) => {
                let results = lanes.results(variants, voltages);
                let judge = |(compiled, result): (&&CompiledModel, Option<_>)| {
                    assess_found_modes(compiled, result?, count, voltages).ok()
                };
                variants.iter().zip(results).map(judge).collect()
            }
            (Self::Static(lanes), MeshRequest::Static { voltages }) => assess_static(lanes, variants, voltages),
            _ => variants.iter().map(|_| None).collect(),
        }
    }
}

/// Equilibria, compared with those of twice the segments.
fn assess_static(
    [coarse, fine]: &[BatchStatics; 2],
    variants: &[&CompiledModel],
    voltages: &PortVoltages,
) -> Vec<Option<Assessment>> {
    let begins: Vec<_> = variants.iter().map(|compiled| (*compiled, None)).collect();
    let points = coarse.points(&begins, voltages);
    let finer: Vec<Option<Finer>> =
        variants.iter().zip(&points).map(|(compiled, point)| finer(compiled, point.as_ref()?)).collect();
    let begins: Vec<_> = finer.iter().flatten().map(|finer| (&finer.model, Some(finer.start.clone()))).collect();
    let mut ends = fine.points(&begins, voltages).into_iter();
    drop(begins);
    let judge = |((compiled, point), finer): ((&&CompiledModel, Option<_>), Option<Finer>)| {
        let finer = finer?;
        let end = ends.next()??;
        assess_found_static(compiled, voltages, point?, (finer.model, end)).ok()
    };
    variants.iter().zip(points).zip(finer).map(judge).collect()
}

impl<'a> BatchedSweep<'a> {
    pub(super) fn new(
        spec: &'a SweepSpec,
        source: &'a NetlistSource,
        options: Arc<CompileOptions>,
        family: Arc<SharedMeshes<'a>>,
    ) -> Self {
        Self { spec, source, options, family, lanes: OnceLock::new() }
    }

    /// Runs some points; `finished` is called for each, and returns whether to continue. `None` if it returned false.
    pub(super) fn run(
        &self,
        numbers: &[usize],
        means: &PointBudget,
        finished: &(dyn Fn(&PointOutcome) -> bool + Sync),
    ) -> Option<Vec<PointOutcome>> {
        let mut found = self.batch_results(numbers, means);
        let mut outcomes = Vec::with_capacity(numbers.len());
        for (&number, found) in numbers.iter().zip(&mut found) {
            let outcome = match found.take() {
                Some(found) => {
                    let parameters = self.spec.settings(number).into_iter().map(|(_, value)| value).collect();
                    PointOutcome { number, parameters, values: Ok(found) }
                }
                None => point::run(self.spec, number, self.source, &self.options, &self.family, means),
            };
            if !finished(&outcome) {
                return None;
            }
            outcomes.push(outcome);
        }
        Some(outcomes)
    }

    /// Results of points from lanes; `None` for those that have to run alone, which also finds their errors.
    fn batch_results(&self, numbers: &[usize], means: &PointBudget) -> Vec<Option<PointResults>> {
        let none = || numbers.iter().map(|_| None).collect();
        if !self.family.shares() || matches!(self.lanes.get(), Some(None)) {
            return none();
        }
        let request = self.spec.analysis.request().filter(|request| !matches!(request, MeshRequest::PullIn { .. }));
        let Some(request) = request.filter(|_| self.spec.ports().next().is_none()) else { return none() };
        let prepare = |&number: &usize| means.guarded(|| self.prepare(number, &request)).ok().flatten();
        let prepared: Vec<Option<CompiledModel>> = numbers.iter().map(prepare).collect();
        let variants: Vec<&CompiledModel> = prepared.iter().flatten().collect();
        let Some(lanes) = self.lanes.get().and_then(Option::as_ref) else { return none() };
        let Ok(assessed) = means.guarded(|| Ok(lanes.assess(&variants, &request))) else { return none() };
        let mut assessed = assessed.into_iter();
        let found = |compiled: &Option<CompiledModel>| {
            let assessed = compiled.as_ref().and_then(|_| assessed.next().flatten())?;
            if assessed.holds { point::found(assessed, self.spec, &self.options).ok() } else { None }
        };
        prepared.iter().map(found).collect()
    }

    /// A point on the first mesh that points share, where it has a part in it.
    fn prepare(&self, number: usize, request: &MeshRequest<'_>) -> Result<Option<CompiledModel>, String> {
        let drawn =
            draw(self.source, &at(&self.options, &self.spec.settings(number))).map_err(|error| brief(&error))?;
        let Some((first, segments)) = self.family.first_mesh(&drawn) else { return Ok(None) };
        let order = Mesh { segments: segments.clone(), estimated_error: None, modes_in_band: 0, passes: 0 };
        let lanes = self.lanes.get_or_init(|| SweepLanes::new(&first.with_order(order.clone()).ok()?, request));
        if lanes.is_none() {
            return Ok(None);
        }
        let laid = drawn.on(order).map_err(|error| error.to_string())?;
        if let MeshRequest::Modes { count, .. } = *request {
            bimorph_base::budget::modes(count, || laid.unknowns());
        }
        Ok(Some(laid))
    }
}
