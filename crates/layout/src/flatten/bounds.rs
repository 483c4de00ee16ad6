//! Bounds of a flat drawing.

/// Most polygons of a flat drawing.
pub const MAX_POLYGONS: u64 = 2_000_000;
/// Most points of a flat drawing.
pub const MAX_POINTS: u64 = 20_000_000;
/// Most labels of a flat drawing.
pub const MAX_LABELS: u64 = 500_000;
/// Most placed cells of a drawing whose places are kept; with more, none are.
pub(super) const MAX_PLACEMENTS: u64 = 200_000;
/// Calls may nest this deep.
pub const DEEPEST: usize = 100;
/// Most placed cells at all: a bound on the work, since empty cells can be called too.
pub(super) const MAX_CALLS: u64 = 20_000_000;
/// Half of the largest wafer and some (m).
pub(super) const FARTHEST: f64 = 0.5;
