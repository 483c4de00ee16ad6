//! Points along each beam where the bodies of its segments measure deflection; gaps along beams are divided there.

use super::junction::JunctionEnds;
use super::rigid::RigidGroups;
use bimorph_domains::{MaterialPoint, Station};
use bimorph_structure::Structure;
use nalgebra::Vector2;

/// The stations of every beam from its start to its end: the drawn ends, where junctions end, and the points between its
/// segments. Empty where the drawing has no gap along beams.
pub(super) fn of_beams(
    structure: &Structure,
    beams: &[Vec<MaterialPoint>],
    ends: &JunctionEnds,
    rigid: &RigidGroups,
) -> Vec<Vec<Station>> {
    if structure.beam_gaps.is_empty() {
        return Vec::new();
    }
    let drawn = structure.beams.iter().zip(beams).zip(&ends.beams);
    drawn
        .map(|((beam, points), ends)| {
            let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
            let [before, after] = [ends[0].offset, ends[1].offset];
            let edges = [rigid.point(beam.a.0).beyond(along * before), rigid.point(beam.b.0).beyond(along * -after)];
            between(points, beam.length, [(before, edges[0]), (after, edges[1])])
        })
        .collect()
}

/// The stations of a beam of a length (m), of which each end has so much (m) up to the edge of its junction.
fn between(
    points: &[MaterialPoint],
    length: f64,
    [(before, first), (after, end)]: [(f64, MaterialPoint); 2],
) -> Vec<Station> {
    let last = points.len() - 1;
    let mut stations = Vec::with_capacity(points.len() + 2);
    stations.push(Station { at: 0.0, point: points[0] });
    if before > 0.0 {
        stations.push(Station { at: before, point: first });
    }
    let h = (length - before - after) / last as f64;
    stations.extend((1..last).map(|k| Station { at: before + k as f64 * h, point: points[k] }));
    if after > 0.0 {
        stations.push(Station { at: length - after, point: end });
    }
    stations.push(Station { at: length, point: points[last] });
    stations
}
