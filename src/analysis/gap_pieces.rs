//! How far a gap along beams is off for want of pieces.
//!
//! A gap between facing beams acts on their ends: forces and moments there are work-equivalent to its load along them, and
//! the beams bend as under those alone. What the load p would bend a beam of length l between its held ends beside, p·l⁴/(384·EI) in its
//! middle, is left out; as a share of the distance between the two it is about the relative error of the field there, and three times that of
//! a pull-in voltage (found on a cantilever in 1, 2, 4 and 8 pieces). It falls with the fourth power of the number of pieces.

use crate::compile::Compiled;
use crate::multibody::planar::Pose;
use crate::structure::NodeId;
use std::collections::HashMap;

/// Error of a deflection for the share of its distance that a gap along beams leaves out: found on a cantilever of 1 to 8 pieces, where
/// a deflection near the fold is off by 1.8 times that share, and release by 2 times.
pub(super) const OF_DEFLECTION: f64 = 2.0;

/// Error of a pull-in voltage for that share: a third of it, found likewise.
pub(super) const OF_PULL_IN: f64 = 1.0 / 3.0;

/// What to say of a gap that may be off by so much, where that is more than the tolerance.
pub(super) fn told(compiled: &Compiled, worst: Option<(String, f64)>) -> Option<String> {
    let tol = compiled.options.tol;
    let (name, error) = worst.filter(|(_, error)| *error > tol)?;
    if error.is_infinite() {
        return Some(format!(
            "`{name}` acts on the ends of its beams, which would bend between them too: in more pieces it may pull in at this voltage"
        ));
    }
    Some(format!(
        "`{name}` acts on the ends of its beams, which would bend between them too: it may be off by {error:.1e}, more than the \
         tolerance {tol:e}"
    ))
}

/// The gap that leaves out most at `q` with these voltages across the gaps, and that share of its distance [1].
pub(super) fn left_out<'a>(compiled: &'a Compiled, q: &[Pose], volts: &[f64]) -> Option<(&'a str, f64)> {
    let (structure, system) = (&compiled.structure, &compiled.parts.system);
    if structure.beam_gaps.is_empty() {
        return None;
    }
    let between = |a: NodeId, b: NodeId| (a.min(b), a.max(b));
    let beams: HashMap<_, _> = structure.beams.iter().rev().map(|beam| (between(beam.a, beam.b), beam)).collect();
    let loads = (0..system.members.len()).filter_map(|g| system.line_load(g, q, volts[g]));
    let yields = |a: NodeId, b: NodeId| -> f64 {
        beams.get(&between(a, b)).map_or(0.0, |beam| {
            let stiffness = beam.material.youngs_modulus * beam.thickness * beam.width.powi(3) / 12.0;
            beam.length.powi(4) / (384.0 * stiffness)
        })
    };
    let share = |(drawn, (load, distance)): (&'a crate::structure::BeamGap, (f64, f64))| {
        let [a, b, c, d] = drawn.nodes;
        (drawn.name.as_str(), load * (yields(a, b) + yields(c, d)) / distance.max(f64::MIN_POSITIVE))
    };
    structure.beam_gaps.iter().zip(loads).map(share).max_by(|a, b| a.1.total_cmp(&b.1))
}
