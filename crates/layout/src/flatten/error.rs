//! Why a hierarchy has no flat drawing.

use super::bounds::{DEEPEST, FARTHEST};
use crate::crossings::CrossingContours;
use thiserror::Error;

/// Why a hierarchy is not flattened.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FlattenError {
    /// A call of a cell that is not there.
    #[error("{place}: `{cell}` calls `{called}`, which is not in the file")]
    Missing {
        /// Where the call stands.
        place: String,
        /// The calling cell.
        cell: String,
        /// The called one.
        called: String,
    },
    /// A cell that calls itself, through others or not.
    #[error("{place}: `{cell}` calls `{called}`, which calls `{cell}` again")]
    Recursive {
        /// Where the call stands.
        place: String,
        /// The calling cell.
        cell: String,
        /// The called one.
        called: String,
    },
    /// Calls nest too deep.
    #[error("calls nest {depth} deep below `{cell}`: at most {DEEPEST}")]
    Deep {
        /// The outermost cell of the chain.
        cell: String,
        /// How deep.
        depth: usize,
    },
    /// The result would be too large.
    #[error("`{cell}` would be {count} {what} without hierarchy: at most {most}; name a smaller cell with --cell")]
    Large {
        /// The cell.
        cell: String,
        /// Polygons, points, labels or placed cells.
        what: &'static str,
        /// How many.
        count: u64,
        /// The bound.
        most: u64,
    },
    /// A polygon that crosses itself too often.
    #[error("a polygon on layer {layer}: {tangled}")]
    Tangled {
        /// Its layer.
        layer: String,
        /// How often, and where.
        tangled: CrossingContours,
    },
    /// The chosen cell is not there, or none is chosen and there are several.
    #[error("{message}")]
    Top {
        /// The available choices.
        message: String,
    },
    /// A coordinate that is no number or further away than a wafer is wide.
    #[error("`{cell}` reaches to {reach:e} m from its origin: expected less than {FARTHEST} m")]
    Far {
        /// The cell.
        cell: String,
        /// How far (m).
        reach: f64,
    },
}
