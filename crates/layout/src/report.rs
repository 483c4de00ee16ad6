//! Report of a conversion: counts, areas, and unrecognised areas with their positions.

use super::drawing::Polygon;
use serde::Serialize;
use std::collections::BTreeMap;

/// Pieces smaller than this fraction of a grid square are ignored: they are remnants of two roundings of the same edge.
const SLIVER: f64 = 3.0;
/// Pieces reported individually; the others are summed.
const MAX_REPORTED: usize = 200;

/// Result messages of a conversion.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ConversionReport {
    /// How the drawing was read: `labels` or `geometry`.
    pub by: String,
    /// How many there are of each element of the netlist.
    pub counts: BTreeMap<String, usize>,
    /// Areas.
    #[serde(flatten)]
    pub areas: LayerAreas,
    /// Areas without a model.
    pub unrecognised: Vec<Unrecognised>,
    /// Features that were approximated or omitted, as messages.
    pub notes: Vec<String>,
}

/// Areas of the layers that move (m²).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct LayerAreas {
    /// As drawn, merged.
    pub drawn_m2: f64,
    /// In the mechanism.
    pub extracted_m2: f64,
    /// Held by anchors.
    pub anchored_m2: f64,
    /// Not understood.
    pub unrecognised_m2: f64,
}

/// A piece of a drawing that is in no part of the mechanism.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unrecognised {
    /// Its layer.
    pub layer: String,
    /// Its area (m²).
    pub area_m2: f64,
    /// Its lower left corner and its upper right one (m).
    pub box_m: [[f64; 2]; 2],
    /// Why it is in none.
    pub why: String,
    /// Its contours (m).
    #[serde(skip)]
    pub contours: Vec<Vec<[f64; 2]>>,
}

impl Unrecognised {
    /// Pieces of a region; those that rounding to the grid explains are left out.
    pub(crate) fn of(layer: &str, polygons: &[Polygon], unit_m: f64, why: &str) -> Vec<Self> {
        let mut all = Vec::new();
        let mut rest = (0, 0.0);
        for polygon in polygons {
            let Some([low, high]) = polygon.extent() else { continue };
            let area = polygon.twice_area() as f64 / 2.0;
            let perimeter: f64 = polygon.contours.iter().map(|c| length(c)).sum();
            if area <= SLIVER * perimeter / 2.0 {
                continue;
            }
            let area_m2 = area * unit_m * unit_m;
            if all.len() >= MAX_REPORTED {
                rest = (rest.0 + 1, rest.1 + area_m2);
                continue;
            }
            let metres = |p: [i32; 2]| p.map(|x| f64::from(x) * unit_m);
            let contours = polygon.contours.iter().map(|c| c.iter().map(|p| metres(*p)).collect()).collect();
            let (layer, why) = (layer.to_owned(), why.to_owned());
            all.push(Self { layer, area_m2, box_m: [metres(low), metres(high)], why, contours });
        }
        if rest.0 > 0 {
            let why = format!("{why} ({} more pieces together)", rest.0);
            all.push(Self {
                layer: layer.to_owned(),
                area_m2: rest.1,
                box_m: [[0.0; 2]; 2],
                why,
                contours: Vec::new(),
            });
        }
        all
    }

    /// Its area in square micrometres, for messages.
    pub fn area_um2(&self) -> f64 {
        (self.area_m2 * 1e18).round() / 1e6
    }
}

fn length(contour: &[[i32; 2]]) -> f64 {
    let next = contour.iter().cycle().skip(1);
    let side =
        |(p, q): (&[i32; 2], &[i32; 2])| (f64::from(q[0]) - f64::from(p[0])).hypot(f64::from(q[1]) - f64::from(p[1]));
    contour.iter().zip(next).map(side).sum()
}

/// The place of a piece in micrometres: "(1, 2) to (3, 4) µm".
pub fn region(u: &Unrecognised) -> String {
    let um = |x: f64| (x * 1e10).round() / 1e4;
    let [[x0, y0], [x1, y1]] = u.box_m;
    format!("({}, {}) to ({}, {}) µm", um(x0), um(y0), um(x1), um(y1))
}
