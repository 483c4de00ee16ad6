//! The meshes that the points of a sweep share.
//!
//! To search a mesh costs some ten times what the analysis costs, and variants of one drawing need much the same. So
//! meshes are searched at the middle point of the grid, for fractions of the tolerance that leave a margin for the
//! others. Each point uses the first of these meshes on which the estimate of its own error holds. Where none does, or
//! where the structure has other beams, it searches its own mesh like a single analysis. Which mesh a point gets
//! depends on the grid and on the point alone, not on other points, on shards or on threads.

use super::axis::at;
use super::spec::{SweepAnalysis, SweepSpec};
use bimorph_analysis::AnalysisError;
use bimorph_analysis::mesh::on_given_mesh::{Assessment, assess};
use bimorph_analysis::mesh::{self, MeshRequest};
use bimorph_base::Setting;
use bimorph_model::compile::{CompileOptions, CompiledModel, ParsedStructure, draw};
use bimorph_model::discretize::DiscretizeError;
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_netlist::NetlistSource;
use bimorph_structure::Beam;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// See the module.
pub(super) struct SharedMeshes<'a> {
    spec: &'a SweepSpec,
    source: &'a NetlistSource,
    options: Arc<CompileOptions>,
    /// The analysis at the middle of the grid, for which meshes are searched.
    analysis: Cow<'a, SweepAnalysis>,
    first: OnceLock<Option<CompiledModel>>,
    meshes: [OnceLock<Option<Vec<usize>>>; 3],
}

impl<'a> SharedMeshes<'a> {
    pub(super) fn new(spec: &'a SweepSpec, source: &'a NetlistSource, options: Arc<CompileOptions>) -> Self {
        let analysis = spec.analysis_at(&middle(spec));
        Self { spec, source, options, analysis, first: OnceLock::new(), meshes: Default::default() }
    }

    /// The result of a point on the first shared mesh that holds for it; none where it needs its own.
    pub(super) fn solve(
        &self,
        drawn: &ParsedStructure,
        request: &MeshRequest<'_>,
    ) -> Result<Option<Assessment>, AnalysisError> {
        let Some(first) = self.like(drawn) else { return Ok(None) };
        for (mesh, tolerance) in self.meshes.iter().zip(first.options.errors().shared_meshes()) {
            let Some(segments) = mesh.get_or_init(|| self.search(first, tolerance)) else { continue };
            let order = Mesh { segments: segments.clone(), estimated_error: None, modes_in_band: 0, passes: 0 };
            let refused = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
            match assess(&drawn.clone().on(order).map_err(refused)?, request) {
                Ok(assessed) if assessed.holds => return Ok(Some(assessed)),
                Ok(_) => {}
                // near a fold a mesh may have no equilibrium where a finer one has: the point finds its own, or says why not
                Err(_) => return Ok(None),
            }
        }
        Ok(None)
    }

    /// The variant that meshes are searched for and the first of these meshes, where they fit this one.
    pub(super) fn first_mesh(&self, drawn: &ParsedStructure) -> Option<(&CompiledModel, &Vec<usize>)> {
        let first = self.like(drawn)?;
        let segments =
            self.meshes[0].get_or_init(|| self.search(first, first.options.errors().shared_meshes()[0])).as_ref()?;
        Some((first, segments))
    }

    /// True where points share meshes at all.
    pub(super) fn shares(&self) -> bool {
        let own = self.options.segments.is_some() || self.options.band.is_some();
        !own && self.spec.has_variants()
    }

    /// The variant that meshes are searched for, where they fit this one.
    fn like(&self, drawn: &ParsedStructure) -> Option<&CompiledModel> {
        if !self.shares() || drawn.structure.beams.is_empty() {
            return None;
        }
        let first = self.first.get_or_init(|| self.middle()).as_ref()?;
        alike(&first.structure.beams, &drawn.structure.beams).then_some(first)
    }

    /// The mesh that holds this tolerance for one variant.
    fn search(&self, first: &CompiledModel, tolerance: f64) -> Option<Vec<usize>> {
        let sharper = first.with_tolerance(tolerance);
        let order = mesh::order(&sharper, &self.analysis.request()?).ok()?;
        order.estimated_error.is_some_and(|error| sharper.options.errors().holds(error)).then_some(order.segments)
    }

    /// The middle of the grid.
    fn middle(&self) -> Option<CompiledModel> {
        let options = at(&self.options, &middle(self.spec));
        draw(self.source, &options).ok()?.compile().ok()
    }
}

/// The middle of a grid, with the median of what is drawn.
pub(super) fn middle(spec: &SweepSpec) -> Vec<(String, Setting)> {
    let mut settings: Vec<_> = spec
        .parameters
        .iter()
        .filter_map(|axis| Some((axis.name.clone(), axis.values.get(axis.values.len() / 2)?)))
        .collect();
    settings.extend(spec.samples.iter().flat_map(|samples| samples.quantiles(0.5)));
    settings
}

/// True for beams of the same names between the same nodes.
pub(super) fn alike(a: &[Beam], b: &[Beam]) -> bool {
    let same = |(a, b): (&Beam, &Beam)| (a.a, a.b) == (b.a, b.b) && a.name == b.name;
    a.len() == b.len() && a.iter().zip(b).all(same)
}
