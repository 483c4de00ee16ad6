//! The mesh of a run up to its first contact, compared in the time up to that.
//!
//! A part that is close to a stop may touch it in a small fraction of the run, within few of its output times or none. Then meshes are compared over
//! [`WINDOW`] times the time of the contact in the coarse run, so that hundreds of samples lie before it. A finer mesh may touch later: where none of the runs
//! in this time does, the time is taken [`WINDOW`] times as long, from the mesh found so far.

use super::super::AnalysisError;
use super::super::transient::TransientOptions;
use super::large_motion::{SearchEnd, SearchLimits, search};
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::mesh_search::Mesh;

/// Time in which meshes are compared, of that of an early contact (1).
const WINDOW: f64 = 8.0;
/// Such times, at most.
const WINDOWS: usize = 10;

/// The mesh for a run that ends at its first contact; none where the limits of the search end it.
pub(super) fn order(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    order: &Mesh,
    limits: SearchLimits<'_>,
) -> Result<Option<Mesh>, AnalysisError> {
    let SearchLimits { work, mut judge } = limits;
    let (mut order, mut stop) = (order.clone(), options.stop);
    for _ in 0..WINDOWS {
        let limits = SearchLimits { work, judge: judge.as_mut().map(|judge| &mut **judge as _) };
        match search(moving, &options.with_stop(stop), &order, limits)? {
            SearchEnd::Limit => return Ok(None),
            SearchEnd::EarlyContact(contact) => stop = (WINDOW * contact).min(stop),
            SearchEnd::Found(mesh, contact) if contact.is_some() || stop >= options.stop => return Ok(Some(mesh)),
            SearchEnd::Found(mesh, _) => (order, stop) = (mesh, (WINDOW * stop).min(options.stop)),
        }
    }
    Ok(Some(Mesh { estimated_error: None, ..order }))
}
