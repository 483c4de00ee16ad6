//! Drawings of masks: CIF and GDSII to polygons without hierarchy, and back.
//!
//! A [`Drawing`] is what a layout file holds, flattened: polygons for each layer on an integer grid, and labels. [`regions`] has the
//! set operations on such polygons. A [`Process`] says what the layers are: which ones move, how thick they are and of
//! what, and what holds them.

pub mod drawing;
pub mod process;
pub mod regions;

pub use drawing::{Drawing, Label, Placement, Polygon};
pub use process::{Anchoring, Layer, Process, ProcessError};
