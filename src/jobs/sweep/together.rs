//! The points of a sweep of statics or modes: side by side where they differ from its middle in numbers alone.
//!
//! Points are laid out on the first mesh that all share. Equilibria in lanes have the bits of a point alone. Modes in lanes begin with
//! those of the middle of the grid, and are those of a point alone to rounding. A point that has its result from lanes, and whose mesh
//! holds, is done; any other runs as a point alone. Which of the two it is depends on the grid and on the point, not on its neighbours, on
//! shards or on threads, but for points that spend a server's budget together.

use super::axis::at;
use super::family::Family;
use super::means::Means;
use super::point::{self, Found, Outcome, brief};
use super::spec::SweepSpec;
use crate::analysis::PortVoltages;
use crate::analysis::mesh::Request;
use crate::analysis::mesh::given::{Finer, Judged, finer, judged_modes, judged_static};
use crate::analysis::modes_side_by_side::ModesSideBySide;
use crate::analysis::statics_side_by_side::StaticsSideBySide;
use crate::compile::{CompileOptions, Compiled, draw};
use crate::netlist::Source;
use crate::refine::model_order::ModelOrder;
use std::sync::{Arc, OnceLock};

/// Points that are laid out at once, at most.
pub(super) const CHUNK: usize = 32;
/// Bodies of a point, at most: larger ones take their time anyway, and some of them at once the memory.
const MOST: usize = 1000;

/// What all points have in common.
pub(super) struct Together<'a> {
    spec: &'a SweepSpec,
    source: &'a Source,
    options: Arc<CompileOptions>,
    family: Arc<Family<'a>>,
    lanes: OnceLock<Option<Lanes>>,
}

/// Lanes for variants like the middle of the grid.
enum Lanes {
    Modes(Box<ModesSideBySide>),
    /// On the mesh of the points, and on that of twice the segments.
    Static(Box<[StaticsSideBySide; 2]>),
}

impl Lanes {
    fn new(middle: &Compiled, request: &Request<'_>) -> Option<Self> {
        if middle.parts.system.bodies() > MOST {
            return None;
        }
        match *request {
            Request::Modes { count, voltages } => {
                ModesSideBySide::new(middle, count, voltages).map(|lanes| Self::Modes(Box::new(lanes)))
            }
            Request::Static { .. } => {
                let fine = middle.with_order(crate::refine::doubling::twice(&middle.options, &middle.order)?).ok()?;
                Some(Self::Static(Box::new([StaticsSideBySide::new(middle)?, StaticsSideBySide::new(&fine)?])))
            }
            Request::PullIn { .. } => None,
        }
    }

    /// What the variants have from lanes, whose mesh may not hold.
    fn judged(&self, variants: &[&Compiled], request: &Request<'_>) -> Vec<Option<Judged>> {
        match (self, *request) {
            (Self::Modes(lanes), Request::Modes { count, voltages }) => {
                let results = lanes.results(variants, voltages);
                let judge =
                    |(compiled, result): (&&Compiled, Option<_>)| judged_modes(compiled, result?, count, voltages).ok();
                variants.iter().zip(results).map(judge).collect()
            }
            (Self::Static(lanes), Request::Static { voltages }) => still(lanes, variants, voltages),
            _ => variants.iter().map(|_| None).collect(),
        }
    }
}

/// Equilibria, compared with those of twice the segments.
fn still(
    [coarse, fine]: &[StaticsSideBySide; 2],
    variants: &[&Compiled],
    voltages: &PortVoltages,
) -> Vec<Option<Judged>> {
    let begins: Vec<_> = variants.iter().map(|compiled| (*compiled, None)).collect();
    let points = coarse.points(&begins, voltages);
    let finer: Vec<Option<Finer>> =
        variants.iter().zip(&points).map(|(compiled, point)| finer(compiled, point.as_ref()?)).collect();
    let begins: Vec<_> = finer.iter().flatten().map(|finer| (&finer.model, Some(finer.start.clone()))).collect();
    let mut ends = fine.points(&begins, voltages).into_iter();
    drop(begins);
    let judge = |((compiled, point), finer): ((&&Compiled, Option<_>), Option<Finer>)| {
        let finer = finer?;
        let end = ends.next()??;
        judged_static(compiled, voltages, point?, (finer.model, end)).ok()
    };
    variants.iter().zip(points).zip(finer).map(judge).collect()
}

impl<'a> Together<'a> {
    pub(super) fn new(
        spec: &'a SweepSpec,
        source: &'a Source,
        options: Arc<CompileOptions>,
        family: Arc<Family<'a>>,
    ) -> Self {
        Self { spec, source, options, family, lanes: OnceLock::new() }
    }

    /// Runs some points; `finished` is told of each, and says whether to go on. None where it said no.
    pub(super) fn run(
        &self,
        numbers: &[usize],
        means: &Means,
        finished: &(dyn Fn(&Outcome) -> bool + Sync),
    ) -> Option<Vec<Outcome>> {
        let mut found = self.side_by_side(numbers, means);
        let mut outcomes = Vec::with_capacity(numbers.len());
        for (&number, found) in numbers.iter().zip(&mut found) {
            let outcome = match found.take() {
                Some(found) => {
                    let parameters = self.spec.settings(number).into_iter().map(|(_, value)| value).collect();
                    Outcome { number, parameters, values: Ok(found) }
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

    /// What points have from lanes; none for those that have to run alone, which also say what is wrong with them.
    fn side_by_side(&self, numbers: &[usize], means: &Means) -> Vec<Option<Found>> {
        let none = || numbers.iter().map(|_| None).collect();
        if !self.family.shares() || matches!(self.lanes.get(), Some(None)) {
            return none();
        }
        let request = self.spec.analysis.request().filter(|request| !matches!(request, Request::PullIn { .. }));
        let Some(request) = request.filter(|_| self.spec.ports().next().is_none()) else { return none() };
        let prepare = |&number: &usize| means.guarded(|| self.prepare(number, &request)).ok().flatten();
        let prepared: Vec<Option<Compiled>> = numbers.iter().map(prepare).collect();
        let variants: Vec<&Compiled> = prepared.iter().flatten().collect();
        let Some(lanes) = self.lanes.get().and_then(Option::as_ref) else { return none() };
        let Ok(judged) = means.guarded(|| Ok(lanes.judged(&variants, &request))) else { return none() };
        let mut judged = judged.into_iter();
        let found = |compiled: &Option<Compiled>| {
            let judged = compiled.as_ref().and_then(|_| judged.next().flatten())?;
            if judged.holds { point::found(judged, self.spec, &self.options).ok() } else { None }
        };
        prepared.iter().map(found).collect()
    }

    /// A point on the first mesh that points share, where it has a part in it.
    fn prepare(&self, number: usize, request: &Request<'_>) -> Result<Option<Compiled>, String> {
        let drawn =
            draw(self.source, &at(&self.options, &self.spec.settings(number))).map_err(|error| brief(&error))?;
        let Some((first, segments)) = self.family.first_mesh(&drawn) else { return Ok(None) };
        let order = ModelOrder { segments: segments.clone(), estimated_error: None, modes_in_band: 0, passes: 0 };
        let lanes = self.lanes.get_or_init(|| Lanes::new(&first.with_order(order.clone()).ok()?, request));
        if lanes.is_none() {
            return Ok(None);
        }
        let laid = drawn.on(order).map_err(|error| error.to_string())?;
        if let Request::Modes { count, .. } = *request {
            crate::budget::modes(count, || laid.unknowns());
        }
        Ok(Some(laid))
    }
}
