//! Drawings of masks: CIF and GDSII to polygons without hierarchy, and back.
//!
//! A [`FlatLayout`] is what a layout file holds, flattened: polygons for each layer on an integer grid, and labels. [`regions`] has the
//! set operations on such polygons. A [`Process`] says what the layers are: which ones move, how thick they are and of
//! what, and what holds them.
//!
//! **Architecture invariant.** Below are [`bimorph_structure`] and [`bimorph_netlist`],
//! the latter for the text that a layout becomes. Nothing here solves.

mod cells;
mod chords;
pub mod cif;
pub mod convert;
pub mod crossings;
mod draw;
pub mod drawing;
pub mod extract;
pub mod flatten;
pub mod gds;
#[cfg(test)]
mod hierarchies;
pub mod input;
pub mod labelled;
mod lines;
pub mod mask;
mod outline;
pub mod process;
pub mod read;
pub mod regions;
pub mod report;
mod simple;
mod write_cif;
pub mod write_gds;

pub use drawing::{FlatLayout, Label, Placement, Polygon};
pub use process::{Anchoring, Process, ProcessError, StructuralLayer};
pub use read::{LayoutError, LayoutFormat, from_bytes, from_file};
