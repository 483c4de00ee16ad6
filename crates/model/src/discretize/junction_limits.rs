//! Where a drawing goes beyond what the table of junctions was made from, so that its figures say nothing.

use super::junction::JunctionEnds;
use super::overlap::{Strip, turn};
use bimorph_structure::Structure;

/// Ratio of widths up to which the table goes (1).
const RATIO: f64 = 8.0;
/// Lean of a stem up to which the table goes, and sharpest turn of a corner (rad).
const LEAN: f64 = std::f64::consts::FRAC_PI_4;
const MAX_TABLE_TURN: f64 = 2.0 * std::f64::consts::FRAC_PI_3;
/// Beams that turn by less than this count as one, as the chords of an arc do (rad).
const STRAIGHT: f64 = std::f64::consts::FRAC_PI_6;
/// Rounding of ratios and angles (1).
const ROUNDING: f64 = 1e-6;

/// Beams whose junctions are beyond the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beyond {
    /// How many there are.
    pub count: usize,
    /// The first one, as an index into the structure's beams.
    pub first: usize,
    /// The property outside the calibrated table.
    pub why: &'static str,
}

/// The beams of a drawing whose junctions are beyond the table, if there are any.
pub fn beyond(structure: &Structure, ends: &JunctionEnds) -> Option<Beyond> {
    let mut why: Vec<Option<&'static str>> = vec![None; structure.beams.len()];
    let mut goes_on = vec![false; structure.beams.len()];
    for (_, meeting) in ends.meetings.iter() {
        for (k, (strip, beam)) in meeting.iter().enumerate() {
            let others = || meeting.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, (other, _))| other);
            goes_on[*beam] |= others().any(|other| turn(strip.angle, other.angle) < STRAIGHT);
            why[*beam] = why[*beam].or(at_node(strip, others));
        }
    }
    for &beam in ends.cut.iter().filter(|&&beam| !goes_on[beam]) {
        why[beam] = Some("its junctions take more than nine tenths of its length");
    }
    for ((beam, why), goes_on) in structure.beams.iter().zip(&mut why).zip(goes_on) {
        if !goes_on && beam.length < beam.width * (1.0 - ROUNDING) {
            *why = why.or(Some("it is shorter than wide"));
        }
    }
    let first = why.iter().position(Option::is_some)?;
    Some(Beyond { count: why.iter().flatten().count(), first, why: why[first].unwrap_or_default() })
}

/// The property outside the table where a strip meets others.
fn at_node<'a, I: Iterator<Item = &'a Strip>>(strip: &Strip, others: impl Fn() -> I) -> Option<&'static str> {
    let widest = others().map(|other| other.width).fold(0.0, f64::max);
    if widest > RATIO * (1.0 + ROUNDING) * strip.width {
        return Some("it meets one of more than eight times its width");
    }
    let sharpest = others().map(|other| turn(strip.angle, other.angle)).fold(0.0, f64::max);
    let limit = if others().count() > 1 { std::f64::consts::PI - LEAN } else { MAX_TABLE_TURN };
    (sharpest > limit + ROUNDING).then_some("it meets another at a sharper angle than the table has")
}
