//! The mesh of a run up to its first contact, compared in the time up to that.
//!
//! A part that is close to a stop may touch it in a small fraction of the run, within few of its output times or none. Then meshes are compared over
//! [`WINDOW`] times the time of the contact in the coarse run, so that hundreds of samples lie before it. A finer mesh may touch later: where none of the runs
//! in this time does, the time is taken [`WINDOW`] times as long, from the mesh found so far. A mesh without an estimate ends the search.
//! A contact within [`EARLIEST`] of the run looks like a start in contact: the mesh stays as it is, without an estimate.

use super::super::AnalysisError;
use super::super::transient::TransientOptions;
use bimorph_model::refine::mesh_search::Mesh;

/// Time in which meshes are compared, of that of an early contact (1).
const WINDOW: f64 = 8.0;
/// Earliest contact up to which meshes are compared, of the run (1).
const EARLIEST: f64 = 1e-5;
/// Such times, at most.
const WINDOWS: usize = 10;

/// The end of a search for a mesh.
pub(super) enum SearchEnd {
    /// A mesh, and when parts first touch in the finest run (s).
    Found(Mesh, Option<f64>),
    /// Its limit, without a mesh.
    Limit,
    /// When parts touch in the first coarse run (s): before it has enough samples to compare.
    EarlyContact(f64),
}

/// Searches a mesh from another one.
type Search<'s> = &'s mut dyn FnMut(&TransientOptions<'_>, &Mesh) -> Result<SearchEnd, AnalysisError>;

/// The mesh for a run that ends at its first contact; none where the limits of the `search` end it.
pub(super) fn order(
    options: &TransientOptions<'_>,
    order: &Mesh,
    search: Search<'_>,
) -> Result<Option<Mesh>, AnalysisError> {
    let earliest = EARLIEST * options.stop;
    let (mut order, mut stop) = (order.clone(), options.stop);
    for _ in 0..WINDOWS {
        match search(&options.with_stop(stop), &order)? {
            SearchEnd::Limit => return Ok(None),
            SearchEnd::EarlyContact(contact) if contact < earliest => break,
            SearchEnd::EarlyContact(contact) => stop = (WINDOW * contact).min(stop),
            SearchEnd::Found(mesh, contact) => {
                if contact.is_some() || stop >= options.stop || mesh.estimated_error.is_none() {
                    return Ok(Some(mesh));
                }
                (order, stop) = (mesh, (WINDOW * stop).min(options.stop));
            }
        }
    }
    Ok(Some(Mesh { estimated_error: None, ..order }))
}
