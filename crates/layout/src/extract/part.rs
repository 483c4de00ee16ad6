//! A connected part of a layer, and the data of its shape.

use super::holes::Hole;
use super::joints::LimbGraph;
use super::medial::Medial;
use crate::drawing::Polygon;
use std::sync::Arc;

/// Result of the axis analysis of a shape.
pub(super) type AxisAnalysis = (Arc<Medial>, Arc<LimbGraph>);

/// A connected part.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Its outline.
    pub(super) polygon: Polygon,
    /// Its axis, limbs and joints.
    pub(super) found: AxisAnalysis,
    /// Etch holes in it, in coordinates of the drawing.
    pub(super) holes: Vec<Hole>,
}

impl Part {
    /// Lower left corner of its box.
    pub(super) fn origin(&self) -> [f64; 2] {
        self.polygon.extent().unwrap_or_default()[0].map(f64::from)
    }
}
