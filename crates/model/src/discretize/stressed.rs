//! Where the stress along each beam is measured: at both edges of every segment.
//!
//! A joint in the middle of a segment of length h bears N, V and M. Between its edges N and V are constant and M is linear, so that the
//! stress on the faces of a rectangular section of width w and thickness t is at most
//! ```text
//! σ = |N|/(w·t) + 6·(|M| + |V|·h/2)/(t·w²)
//! ```
//! This is exact for beams without loads between their ends. Where beams meet, the stress at a re-entrant corner is higher.

use bimorph_structure::Beam;

/// The joints of a beam.
#[derive(Debug, Clone, PartialEq)]
pub struct StressedBeam {
    /// Place of each joint among those of the model, and the length of its segment (m).
    pub joints: Vec<(u32, f64)>,
    /// Area of the section (m²).
    pub area: f64,
    /// Section modulus (m³).
    pub modulus: f64,
    /// True where a joint has rigid directions, whose forces do not follow from strains.
    pub rigid: bool,
}

/// A segment of a beam in the making.
#[derive(Debug, Clone, Copy)]
pub struct SegmentSpan {
    /// Its joint, in the order in which they are made.
    pub joint: usize,
    /// Its length (m).
    pub length: f64,
    /// Whether its joint has rigid directions.
    pub rigid: bool,
}

/// Those of all beams, `order` the place of each joint among those of the model.
pub(super) fn beams(drawn: &[Beam], segments: &[Vec<SegmentSpan>], order: &[u32]) -> Vec<StressedBeam> {
    let one = |(beam, segments): (&Beam, &Vec<SegmentSpan>)| StressedBeam {
        joints: segments.iter().map(|segment| (order[segment.joint], segment.length)).collect(),
        area: beam.width * beam.thickness,
        modulus: beam.thickness * beam.width * beam.width / 6.0,
        rigid: segments.iter().any(|segment| segment.rigid),
    };
    drawn.iter().zip(segments).map(one).collect()
}
