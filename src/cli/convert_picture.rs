//! A mechanism over the polygons that it came from.

use bimorph::layout::convert::Converted;
use bimorph::layout::drawing::FlatLayout;
use bimorph::results::plot::Picture;
use bimorph::results::plot::mechanism::{self, Ground};
use bimorph::structure::Structure;
use std::path::Path;

/// Most polygons of a picture.
pub(super) const MAX_POLYGONS: usize = 20_000;

/// Draws polygons pale, the mechanism on them in colour, and what is in no part of it red.
pub(super) fn draw(file: &Path, drawing: &FlatLayout, structure: &Structure, converted: &Converted) -> Picture {
    let title = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    // A netlist puts its first node at the origin.
    let shift = shift(converted, structure);
    let place = |p: &[i32; 2]| [0, 1].map(|i| f64::from(p[i]) * drawing.unit_m - shift[i]);
    let polygons = drawing.layers.values().flatten().take(MAX_POLYGONS);
    let drawn = polygons.flat_map(|p| &p.contours).map(|c| c.iter().map(place).collect()).collect();
    let foreign = converted.report.unrecognised.iter().flat_map(|u| &u.contours);
    let foreign = foreign.map(|c| c.iter().map(|p| [p[0] - shift[0], p[1] - shift[1]]).collect()).collect();
    mechanism::over(&title, structure, &Ground { drawn, foreign })
}

/// Where the netlist's origin lies in the drawing [m].
pub(super) fn shift(converted: &Converted, structure: &Structure) -> [f64; 2] {
    let known = converted.landmark.as_ref().and_then(|(name, place)| {
        let at = structure.nodes[structure.node(name)?.0].position;
        Some([place[0] - at[0], place[1] - at[1]])
    });
    known.unwrap_or([0.0; 2])
}
