//! The node that moves most on a path: its x and y are the signals of a request that names none.

use super::continuation::{ContinuationRequest, ContinuationResult, trace};
use super::mesh::path_fitted;
use super::{AnalysisError, ProgressCallback};
use bimorph_model::compile::CompiledModel;

/// Nodes among which it is searched.
const MAX_NODES: usize = 1000;

/// The path on its mesh, as [`path_fitted`] has it. Without signals in the request, the signals are x and y of the node that moves most.
///
/// # Errors
/// See [`trace`].
pub fn path_with_signals(
    compiled: &CompiledModel,
    request: &ContinuationRequest<'_>,
    watch: ProgressCallback<'_>,
) -> Result<(CompiledModel, ContinuationResult), AnalysisError> {
    if !request.signals.is_empty() {
        return path_fitted(compiled, request, watch);
    }
    let found = trace(compiled, &ContinuationRequest { signals: every(compiled), ..request.clone() }, &mut *watch)?;
    let signals = busiest(&found.signals);
    path_fitted(compiled, &ContinuationRequest { signals, ..request.clone() }, watch)
}

/// x and y of every node; of very many, of some evenly among them.
fn every(compiled: &CompiledModel) -> Vec<String> {
    let nodes = || compiled.structure.nodes.iter().filter(|node| node.mechanical);
    // sampled nodes represent their neighbours
    let nodes = nodes().step_by(nodes().count().div_ceil(MAX_NODES).max(1));
    nodes.flat_map(|node| [format!("{}.x", node.name), format!("{}.y", node.name)]).collect()
}

/// x and y of the node with the largest displacement on the path, by the signals of [`every`] one.
fn busiest(signals: &[(String, String, Vec<f64>)]) -> Vec<String> {
    let far = |pair: &[(String, String, Vec<f64>)]| {
        let at = pair[0].2.iter().zip(&pair[1].2);
        at.map(|(x, y)| x.hypot(*y)).fold(0.0, f64::max)
    };
    let pair = signals.chunks_exact(2).max_by(|a, b| far(a).total_cmp(&far(b)));
    pair.map(|pair| pair.iter().map(|(name, _, _)| name.clone()).collect()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Motion along the path counts even if it returns at the end, where nothing distinguishes the nodes.
    #[test]
    fn the_way_counts() {
        let signal = |name: &str, values: &[f64]| (name.to_owned(), "m".to_owned(), values.to_vec());
        let signals = [
            signal("m.x", &[2e-6, 1e-6, 0.0]),
            signal("m.y", &[0.0, 0.0, 0.0]),
            signal("e.x", &[0.0, 0.0, 0.0]),
            signal("e.y", &[0.0, 0.0, 0.0]),
        ];
        assert_eq!(busiest(&signals), ["m.x", "m.y"]);
        assert!(busiest(&[]).is_empty());
    }
}
