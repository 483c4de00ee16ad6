//! Names of the critical points of a path: pull-in, release, snap-through, snap-back, bifurcation.

use super::continuation::{ContinuationResult, CriticalPoint};
use bimorph_model::compile::CompiledModel;

/// Name of a bifurcation.
pub const BIFURCATION: &str = "bifurcation";

/// Limit points and bifurcations of a path along `along` with their names. `rises` is the sign of the change from start to end.
pub fn critical_points<'r>(
    compiled: &CompiledModel,
    along: &str,
    rises: f64,
    result: &'r ContinuationResult,
) -> Vec<(&'r CriticalPoint, &'static str)> {
    let electrics = &compiled.parts.system.electrics;
    let across_gap = |port: usize| (0..electrics.gap_rows.nrows()).any(|gap| electrics.gap_rows[(gap, port)] != 0.0);
    let attracts = compiled.structure.port(along).is_some_and(across_gap);
    let folds = result.folds.iter().map(|point| (point, limit_point(result, point, rises, attracts)));
    folds.chain(result.bifurcations.iter().map(|point| (point, BIFURCATION))).collect()
}

/// Name of a limit point: what a part does that is driven past it. `attracts` says that the parameter is a voltage across gaps.
fn limit_point(result: &ContinuationResult, point: &CriticalPoint, rises: f64, attracts: bool) -> &'static str {
    let k = point.point;
    let (before, after) = (k.checked_sub(1), (k + 1 < result.values.len()).then_some(k + 1));
    let stable = |k: Option<usize>| k.is_some_and(|k| result.negative[k] == 0);
    let is_maximum = before.is_some_and(|k| rises * (point.value - result.values[k]) > 0.0);
    match (is_maximum && stable(before), !is_maximum && stable(after), attracts) {
        (true, _, true) => "pull-in",
        (_, true, true) => "release",
        (true, _, false) => "snap-through",
        (_, true, false) => "snap-back",
        _ => "limit point",
    }
}
