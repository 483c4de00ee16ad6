//! From a drawn gap to its sides and stretches: each side is cut where the beams along it are, and between two cuts of either side
//! both shapes are cubics.
//!
//! Under end forces alone, a segment of a beam bends as the cubic between the bodies at its ends. Loads that are
//! work-equivalent to a pressure along that cubic therefore place the bodies exactly as the linear beam under the
//! pressure. The remaining term is the shape within a segment, p·s²·(h − s)²/(24·EI), whose fraction of the deflection
//! falls with the fourth power of h.

use super::facing::FacingStretch;
use super::facing_side::{EndWeights, Flank};
use super::from_structure::{Station, StructureView};
use super::quadrature::{hermite, hermite_slope};
use bimorph_structure::{ALIKE, BeamGap, BeamRows, NodeId};
use nalgebra::Matrix4;

/// The stations of a side of a gap, from one node to another: those of the beams along it, or its two ends where no beam
/// lies there or none bends.
pub(super) fn side(beams: &BeamRows<'_>, drawing: &StructureView<'_, '_>, gap: &BeamGap, nodes: [NodeId; 2]) -> Flank {
    let [start, end] = nodes.map(|node| (drawing.point)(node));
    let ends = || vec![Station { at: 0.0, point: start }, Station { at: gap.length, point: end }];
    let cut = !drawing.chord && !drawing.stations.is_empty();
    let straight = || Flank::new(ends(), Vec::new());
    let Some(row) = (if cut { beams.row(gap, nodes) } else { None }) else { return straight() };
    let mut yields = Vec::new();
    let mut stations = vec![Station { at: 0.0, point: start }];
    let mut begin = 0.0;
    for (index, against) in row {
        let (beam, own) = (&drawing.structure.beams[index], &drawing.stations[index]);
        let (length, before) = (beam.length, stations.len() - 1);
        let stiffness = beam.material.youngs_modulus * beam.thickness * beam.width.powi(3) / 12.0;
        let place = |station: &Station, at: f64| Station { at: begin + at, point: station.point };
        if against {
            stations.extend(own.iter().rev().skip(1).map(|station| place(station, length - station.at)));
        } else {
            stations.extend(own.iter().skip(1).map(|station| place(station, station.at)));
        }
        begin += length;
        yields.extend(stations[before..].windows(2).map(|ends| {
            let stiff = ends[0].point.body == ends[1].point.body;
            if stiff { 0.0 } else { (ends[1].at - ends[0].at).powi(4) / (24.0 * stiffness) }
        }));
    }
    let last = stations.len() - 1;
    stations[last] = Station { at: gap.length, point: end };
    let rigid = stations.iter().all(|station| station.point.body == start.body);
    if rigid { straight() } else { Flank::new(stations, yields) }
}

/// A part of the gap over which both sides are single cubics.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CubicStretch {
    pub(super) facing: FacingStretch,
    /// The segments of both sides.
    pub(super) segments: [usize; 2],
    /// From the ends of the segments to those of the stretch.
    pub(super) weights: [EndWeights; 2],
}

/// A part of a gap over which both sides are single cubics.
pub(super) struct Interval {
    /// Its length (m).
    pub(super) length: f64,
    /// The segment of each side that it lies on.
    pub(super) segments: [usize; 2],
    /// How its ends follow from those of the segments.
    pub(super) weights: [EndWeights; 2],
}

/// The stretches of a gap between two sides, from its start to its end.
pub(super) fn stretches(sides: &[Flank; 2]) -> Vec<Interval> {
    let length = sides[0].stations[sides[0].stations.len() - 1].at;
    let close = ALIKE * 1e-3 * length;
    let mut cuts: Vec<f64> = sides.iter().flat_map(|side| &side.stations).map(|station| station.at).collect();
    cuts.sort_unstable_by(f64::total_cmp);
    cuts.dedup_by(|next, kept| *next - *kept <= close);
    let mut segments = [0; 2];
    let mut found = Vec::with_capacity(cuts.len() - 1);
    for ends in cuts.windows(2) {
        let weights = [0, 1].map(|i| {
            let stations = &sides[i].stations;
            while segments[i] + 2 < stations.len() && stations[segments[i] + 1].at <= ends[0] + close {
                segments[i] += 1;
            }
            on([stations[segments[i]].at, stations[segments[i] + 1].at], [ends[0], ends[1]], close)
        });
        found.push(Interval { length: ends[1] - ends[0], segments, weights });
    }
    found
}

/// How the ends of a stretch follow from those of its segment.
fn on(segment: [f64; 2], stretch: [f64; 2], close: f64) -> EndWeights {
    if (0..2).all(|i| (segment[i] - stretch[i]).abs() <= close) {
        return None;
    }
    let h = segment[1] - segment[0];
    let rows = stretch.map(|at| {
        let s = (at - segment[0]) / h;
        (hermite(s), hermite_slope(s))
    });
    Some(Box::new(Matrix4::from_fn(|i, j| {
        let (shape, slope) = rows[i / 2];
        let of_slope = if j % 2 == 0 { 1.0 } else { h };
        of_slope * if i % 2 == 0 { shape[j] } else { slope[j] / h }
    })))
}
