//! The compliance of the root of a beam at an elastic anchor: a pad of the beam's layer, bonded to a base of like stiffness.
//!
//! Under normal force N, shear force V and moment M at the root, with the width w and the thickness t of the beam,
//! ```text
//! [u; g; p·w] = 1/(E·t)·[a_N·N; a_Q·V + a_c·M/w; a_c·V + a_M·M/w]      δ_N = a_N·w      δ_M = a_M·w/12
//! ```
//! δ_N and δ_M are the lengths by which the root lengthens the beam in stretch and in bending.
//!
//! | | law | from | within |
//! |---|---|---|---|
//! | δ_M, w ≥ t | 0.37·w/(1 + 0.1·w/t) | solids of a pad on a base, w/t 0.5 to 10 | 2.5 % |
//! | δ_M, t ≥ 2·w | 0.395·w − 0.36·ν²·t: the root is kept from anticlastic curvature | the same, t/w to 20 | 5 % |
//! | δ_M, between | linear in ln(t/w) | | |
//! | δ_N | (2·w/π)·ln(1 + 5.6·t/w) | the same, w/t 0.5 to 10 | 4.5 % |
//! | undercut u | δ_M tends to that of a half-plane, 0.416·w, as exp(−2.2·x/(1 + 0.35·x)), x = u/w; in δ_N the argument of ln grows by k·x, k from 1.3 to 2.35 | the same, u/w 0.1 to 5 | 8 % of δ |
//! | a_Q | 1.4·a_N | plane stress on springs | 10 % |
//! | a_c | (0.874 − 1.197·ν)·δ_M/(0.416·w) | the half-plane; a term of (w/l)² | |
//!
//! Source: independent computation with solid and plane-stress elements. The half-plane has a_M = 4.994 for every ν (O'Donnell, "The
//! additional deflection of a cantilever due to the elasticity of the support", J. Appl. Mech. 27 (1960), has 16.67/π from a linear
//! pressure).

use super::junction_table::ComplianceRow;
use crate::options::Anchors;
use bimorph_structure::{Beam, Structure};
use std::f64::consts::{FRAC_2_PI, LN_2};

/// δ_M of an elastic half-plane over the width (1).
const HALF_PLANE: f64 = 0.4162;

/// For each node that an elastic anchor holds, how far its pad is etched free at the edge (m).
pub(super) fn undercuts(structure: &Structure, anchors: Anchors) -> Vec<Option<f64>> {
    let mut found = vec![None; structure.nodes.len()];
    for support in structure.supports.iter().filter(|support| support.held == [true; 3]) {
        found[support.node.0] = match anchors {
            Anchors::Rigid => None,
            Anchors::Auto => support.undercut,
            Anchors::Elastic => support.undercut.or(Some(0.0)),
        };
    }
    found
}

/// Whether any anchor of a structure is elastic.
pub fn is_elastic(structure: &Structure, anchors: Anchors) -> bool {
    undercuts(structure, anchors).iter().any(Option::is_some)
}

/// The root of a beam on a pad that is etched free by `undercut` (m) at its edge.
pub(super) fn row(beam: &Beam, undercut: f64) -> ComplianceRow {
    let [normal, bending] = lengths(beam.width, beam.thickness, beam.material.poisson, undercut);
    let [normal, bending] = [normal / beam.width, bending / beam.width];
    let cross = (0.874 - 1.197 * beam.material.poisson) * bending / HALF_PLANE;
    [0.0, normal, 0.0, 0.0, 1.4 * normal, cross, 12.0 * bending]
}

/// δ_N and δ_M of a beam of that width and thickness (m).
pub fn lengths(width: f64, thickness: f64, poisson: f64, undercut: f64) -> [f64; 2] {
    let (slender, x) = (thickness / width, undercut / width);
    let flat = 0.37 / (1.0 + 0.1 / slender);
    let tall = 0.395 - 0.36 * poisson * poisson * slender;
    let share = (slender.ln() / LN_2).clamp(0.0, 1.0);
    let bonded = flat + share * (tall - flat);
    let bending = HALF_PLANE - (HALF_PLANE - bonded) * (-2.2 * x / (1.0 + 0.35 * x)).exp();
    let growth = 2.35 - 1.05 / (1.0 + 1.2 * x);
    let normal = FRAC_2_PI * (5.6 * slender + growth * x).ln_1p();
    [normal * width, bending * width]
}

/// The beam that rigid anchors make too stiff by the largest share, and that share of its bending stiffness (1): 3·δ_M/l for each anchored
/// end, as of a flexure whose ends do not turn. `l` is that of all beams in line with it.
pub fn stiffening(structure: &Structure) -> Option<(usize, f64)> {
    let mut at = vec![[None; 2]; structure.nodes.len()];
    let mut meeting = vec![0usize; structure.nodes.len()];
    for (k, beam) in structure.beams.iter().enumerate() {
        for node in [beam.a.0, beam.b.0] {
            if let Some(slot) = at[node].get_mut(meeting[node]) {
                *slot = Some(k);
            }
            meeting[node] += 1;
        }
    }
    let mut held = vec![false; structure.nodes.len()];
    for support in structure.supports.iter().filter(|support| support.held == [true; 3]) {
        held[support.node.0] = true;
    }
    let mut largest: Option<(usize, f64)> = None;
    for (first, beam) in structure.beams.iter().enumerate() {
        for (start, end) in [(beam.a.0, beam.b.0), (beam.b.0, beam.a.0)] {
            if !held[start] {
                continue;
            }
            let (mut length, mut last, mut node) = (beam.length, first, end);
            // at most once through every beam
            for _ in &structure.beams {
                let next = at[node].into_iter().flatten().find(|k| *k != last);
                let Some(next) = next.filter(|_| meeting[node] == 2 && !held[node]) else { break };
                let other = &structure.beams[next];
                if (other.angle - beam.angle).sin().abs() > 1e-6 || other.width != beam.width {
                    break;
                }
                length += other.length;
                (last, node) = (next, if other.a.0 == node { other.b.0 } else { other.a.0 });
            }
            let ends = if held[node] { 2.0 } else { 1.0 };
            let bending = lengths(beam.width, beam.thickness, beam.material.poisson, 0.0)[1];
            let share = ends * 3.0 * bending / length;
            if largest.is_none_or(|(_, most)| share > most) {
                largest = Some((first, share));
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// δ_N/w and δ_M/w at ν = 0.25 on a base of like stiffness: solids of 27-node bricks, which are 2 to 4 % low (independent computation).
    #[test]
    fn a_pad_on_a_base() {
        let solids =
            [(0.5, 1.57, 0.347), (1.0, 1.22, 0.340), (2.0, 0.860, 0.316), (5.0, 0.458, 0.249), (10.0, 0.282, 0.185)];
        for (over, normal, bending) in solids {
            let [found_n, found_m] = lengths(over, 1.0, 0.25, 0.0).map(|length| length / over);
            assert!((found_n / normal - 1.0).abs() < 0.05, "w/t {over}: {found_n}");
            assert!((found_m / bending - 1.0).abs() < 0.03, "w/t {over}: {found_m}");
        }
    }

    /// Ten times as tall as wide: 0.395, 0.171, −0.073 widths at ν 0, 0.25, 0.36 (the same computation).
    #[test]
    fn a_tall_section() {
        for (poisson, bending) in [(0.0, 0.395), (0.25, 0.171), (0.36, -0.073)] {
            let found = lengths(1.0, 10.0, poisson, 0.0)[1];
            assert!((found - bending).abs() < 0.01, "{found}");
        }
    }

    /// An edge that is etched free by one thickness: (δ_N, δ_M)/w 1.46, 0.395 at w = t, and 0.58, 0.311 at w = 5·t (the same computation);
    /// far from the bond the root is that of a half-plane.
    #[test]
    fn an_undercut_edge() {
        for (over, normal, bending) in [(1.0, 1.46, 0.395), (5.0, 0.58, 0.311)] {
            let [found_n, found_m] = lengths(over, 1.0, 0.25, 1.0).map(|length| length / over);
            assert!((found_n / normal - 1.0).abs() < 0.08, "w/t {over}: {found_n}");
            assert!((found_m / bending - 1.0).abs() < 0.03, "w/t {over}: {found_m}");
        }
        assert!((lengths(1.0, 1.0, 0.25, 50.0)[1] - HALF_PLANE).abs() < 1e-3);
    }
}
