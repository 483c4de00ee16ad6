//! Where the stress along each beam is measured: at both edges of every segment.
//!
//! A joint in the middle of a segment of length h bears N, V and M. Between its edges N and V are constant and M is linear, so that the
//! stress on the faces of a rectangular section of width w and thickness t is at most
//! ```text
//! σ = |N|/(w·t) + 6·(|M| + |V|·h/2)/(t·w²)
//! ```
//! This is exact for beams without loads between their ends. Where beams meet, the stress at a re-entrant corner is higher: with the radius of the fillets, both terms have factors
//! in the segments at the ends ([`super::fillet`]).

use super::fillet;
use bimorph_structure::{Beam, Structure};

/// The joints of a beam.
#[derive(Debug, Clone, PartialEq)]
pub struct StressedBeam {
    /// Place of each joint among those of the model, and the length of its segment (m).
    pub joints: Vec<(u32, f64)>,
    /// Area of the section (m²).
    pub area: f64,
    /// Section modulus (m³).
    pub modulus: f64,
    /// Factors on the stress of tension and of bending at the first and the last joint, where a fillet is there (1).
    pub fillets: [Option<[f64; 2]>; 2],
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
pub(super) fn beams(structure: &Structure, segments: &[Vec<SegmentSpan>], order: &[u32]) -> Vec<StressedBeam> {
    let one = |beam: &Beam, fillets: [Option<[f64; 2]>; 2], segments: &Vec<SegmentSpan>| StressedBeam {
        joints: segments.iter().map(|segment| (order[segment.joint], segment.length)).collect(),
        area: beam.width * beam.thickness,
        modulus: beam.thickness * beam.width * beam.width / 6.0,
        fillets,
        rigid: segments.iter().any(|segment| segment.rigid),
    };
    let all = structure.beams.iter().zip(fillet::of_beams(structure)).zip(segments);
    all.map(|((beam, fillets), segments)| one(beam, fillets, segments)).collect()
}
