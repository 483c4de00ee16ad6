//! Why a drawing has no model.

use crate::crossings::CrossingContours;
use thiserror::Error;

/// Most points of one layer after its polygons are merged.
pub const MAX_POINTS: usize = 4_000_000;

/// Why there is no model.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ExtractError {
    /// No layer of the process is drawn.
    #[error(
        "{source_name}: no layer that moves in process `{process}` is drawn: expected one of {expected}, found {found}; name another \
         process, or write a process file for these layers (docs/reference/layouts.md)"
    )]
    NothingMoves {
        /// Name of the drawing.
        source_name: String,
        /// Name of the process.
        process: String,
        /// Layers of the process.
        expected: String,
        /// Layers of the drawing.
        found: String,
    },
    /// Polygons that cut one another too often to be merged.
    #[error("layer {layer}: {tangled}")]
    Tangled {
        /// Name of the layer.
        layer: String,
        /// How often, and where.
        tangled: CrossingContours,
    },
    /// More points than are worked on.
    #[error("layer {layer}: {points} points after its polygons were merged, at most {MAX_POINTS} are extracted")]
    TooLarge {
        /// Name of the layer.
        layer: String,
        /// Its points.
        points: usize,
    },
}
