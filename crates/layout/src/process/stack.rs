//! A layer stack.

use serde::Deserialize;
use std::collections::BTreeMap;

/// A layer thicker than this was not written in metres (m).
pub(super) const THICKEST: f64 = 1e-2;
/// Holes up to this size are etch holes unless the process says otherwise (m): those of PolyMUMPs and SOI are 3 to 10 µm.
pub(super) const LARGEST_HOLE: f64 = 12e-6;

/// A layer stack.
#[derive(Debug, Clone, PartialEq)]
pub struct Process {
    /// Its name.
    pub name: String,
    /// One line about it.
    pub about: String,
    /// Layers that move, in file order.
    pub layers: Vec<StructuralLayer>,
    /// Layers that hold still: wiring and electrodes under the others.
    pub fixed: Vec<FixedLayer>,
    /// Metal on top of layers; none: the process has none.
    pub metal: Option<MetalLayer>,
    /// Drawn layers that do not change a model.
    pub ignored: Vec<String>,
}

/// A layer that moves.
#[derive(Debug, Clone, PartialEq)]
pub struct StructuralLayer {
    /// Name of the netlist's `process` that is made of it.
    pub name: String,
    /// Drawn layers it consists of, by any of their names.
    pub drawn: Vec<String>,
    /// Thickness (m).
    pub thickness: f64,
    /// Constants of its material under the names that netlists have (`Youngsmodulus`, `density` …), SI.
    pub material: BTreeMap<String, f64>,
    /// Thickness of the gas film under it (m); none: no damping.
    pub fluid: Option<f64>,
    /// How the layer is anchored.
    pub anchoring: Anchoring,
    /// Drawn layers where it is taken away (etch holes drawn as such).
    pub holes: Vec<String>,
    /// Drawn layers of metal on it.
    pub metal: Vec<String>,
    /// Largest hole that is an etch hole and is filled for the model, with its share kept as porosity (m).
    pub largest_hole: f64,
}

/// Anchoring of a layer. Where one of the `drawn` layers is in the drawing, it alone counts; else what is not
/// `released`; else what an `undercut` leaves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Anchoring {
    /// Drawn layers under which it is fixed to the wafer.
    pub drawn: Vec<String>,
    /// Drawn layers over which it is free (a trench from behind); the rest of it is held.
    pub released: Vec<String>,
    /// Reach of the etchant under an edge (m): areas wider than twice this are held.
    pub undercut: Option<f64>,
}

/// A layer that holds still.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedLayer {
    /// Its name.
    pub name: String,
    /// Drawn layers it consists of.
    pub drawn: Vec<String>,
    /// Sheet resistance (Ω/square).
    #[serde(default)]
    pub sheetresistance: Option<f64>,
}

/// Metal on top.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MetalLayer {
    /// Thickness (m).
    pub thickness: f64,
    /// Sheet resistance (Ω/square).
    pub sheetresistance: f64,
}

pub(super) fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}
