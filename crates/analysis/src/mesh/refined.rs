//! Finer meshes for what has no equilibrium on a coarse one.
//!
//! A leg in one segment may bear nothing that one in two does. A beam that tension T bends at its end does so within √(EI/T), and one far longer
//! segment turns over there and stretches as no beam does. First all segments are doubled; then those beams alone are divided further whose segments
//! bend too far where the search ended. A load that bends beams to less than their own width on several meshes is beyond all of them.

use super::super::AnalysisError;
use super::doubled_mesh::MAX_NEAR_LIMIT;
use super::remeshed::{chosen, meshed};
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::doubling::doubled;
use std::borrow::Cow;

/// How often all segments are doubled.
const DOUBLINGS: usize = 5;
/// How often the segments of single beams are divided into four after that.
const QUARTERINGS: usize = 3;

/// Meshes on which a beam may be bent to a radius below half its width before the load counts as beyond beams. The curvature there is that of the moment,
/// whatever the mesh; a single long segment may turn over.
const MAX_OVERBENT: usize = 3;

/// Meshes that were tried for an equilibrium.
#[derive(Debug, Default)]
pub(super) struct Refinement {
    tried: usize,
    overbent: usize,
}

impl Refinement {
    /// The mesh to try after `segments`, where there was no equilibrium; none where a finer mesh is no remedy.
    pub(super) fn next(
        &mut self,
        compiled: &CompiledModel,
        segments: &[usize],
        error: &AnalysisError,
    ) -> Option<Vec<usize>> {
        let AnalysisError::NoEquilibrium { coarse, overbent, .. } = error else { return None };
        self.overbent += usize::from(*overbent);
        if self.overbent >= MAX_OVERBENT {
            return None;
        }
        let options = &compiled.options;
        let next = if self.tried < DOUBLINGS {
            doubled(options, segments, |_| true)
        } else if self.tried < DOUBLINGS + QUARTERINGS {
            let bent = |beam: usize| coarse.contains(&beam);
            doubled(options, &doubled(options, segments, bent), bent)
        } else {
            return None;
        };
        self.tried += 1;
        (next != segments && next.iter().sum::<usize>() <= MAX_NEAR_LIMIT).then_some(next)
    }
}

/// Runs an analysis on the mesh as it is, or on the first finer one where an equilibrium on its way needs no shorter segments.
pub(super) fn refining<T>(
    compiled: &CompiledModel,
    mut run: impl FnMut(&CompiledModel) -> Result<T, AnalysisError>,
) -> Result<T, AnalysisError> {
    let mut refinement = Refinement::default();
    let mut model = Cow::Borrowed(compiled);
    loop {
        let error = match run(&model) {
            Err(error) if !chosen(compiled) => error,
            result => return result,
        };
        let bent = matches!(&error, AnalysisError::NoEquilibrium { coarse, .. } if !coarse.is_empty());
        let next = if bent { refinement.next(compiled, &model.order.segments, &error) } else { None };
        let Some(next) = next else { return Err(error) };
        model = Cow::Owned(meshed(compiled, &next)?.into_owned());
    }
}
