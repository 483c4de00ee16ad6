//! Stress concentration at the ends of beams with fillets.
//!
//! A beam of the width d widens to D by shoulders of the height h = (D − d)/2 with fillets of the radius r. At the fillets it bears K times the nominal stress of its own
//! section, in tension and in bending:
//! ```text
//! K = C₁ + C₂·x + C₃·x² + C₄·x³,   x = 2h/D,   Cᵢ = a + b·√(h/r) + c·h/r,   0.1 ≤ h/r ≤ 20
//! ```
//! The law is for lengths of the wide part above 0.8·D·(d/r)^¼ in bending and 3·D·(d/r)^¼ in tension. Wider parts than three widths have the factor of three widths: the
//! chart has no more than a few percent between D/d = 3 and ∞. Steps below h = r/10 have none.
//!
//! Source: W. C. Young, R. G. Budynas, "Roark's Formulas for Stress and Strain", Table 17.1, cases 5a and 5b, after R. E. Peterson, "Stress Concentration Factors" (1974).

use bimorph_structure::{Beam, NodeId, Structure};
use std::collections::BTreeMap;

/// a, b, c of C₁ to C₄.
type Coefficients = [[f64; 3]; 4];

/// In tension, for h/r up to 2 and above.
const TENSION: [Coefficients; 2] = [
    [[1.007, 1.0, -0.031], [-0.114, -0.585, 0.314], [0.241, -0.992, -0.271], [-0.134, 0.577, -0.012]],
    [[1.042, 0.982, -0.036], [-0.074, -0.156, -0.010], [-3.418, 1.220, -0.005], [3.450, -2.046, 0.051]],
];
/// In bending.
const BENDING: [Coefficients; 2] = [
    [[1.007, 1.0, -0.031], [-0.270, -2.404, 0.749], [0.677, 1.133, -0.904], [-0.414, 0.271, 0.186]],
    [[1.042, 0.982, -0.036], [-3.599, 1.619, -0.431], [6.084, -5.607, 1.158], [-2.527, 3.006, -0.691]],
];
/// Range of h/r (1).
const RANGE: [f64; 2] = [0.1, 20.0];
/// Largest width of what widens that counts, in widths of the beam (1).
const WIDEST: f64 = 3.0;
/// Sine of the angle from which on a beam joins another one from the side, and not as its continuation (1).
const ASIDE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Factors on the nominal stress in tension and in bending at the shoulders of a bar that widens from `d` to `wide` with fillets of the radius `r` (m); none of steps that are
/// small against the radius.
pub fn concentration(d: f64, wide: f64, r: f64) -> Option<[f64; 2]> {
    let wide = wide.min(WIDEST * d);
    let h = 0.5 * (wide - d);
    let ratio = (h / r).min(RANGE[1]);
    if ratio < RANGE[0] {
        return None;
    }
    let x = 2.0 * h / wide;
    let law = |of: &[Coefficients; 2]| {
        let rows = &of[usize::from(ratio > 2.0)];
        rows.iter().rev().fold(0.0, |sum, [a, b, c]| sum * x + a + b * ratio.sqrt() + c * ratio)
    };
    Some([law(&TENSION), law(&BENDING)])
}

/// Those factors at both ends of every beam; none: its layer has no fillet, or nothing wider begins there.
pub(super) fn of_beams(structure: &Structure) -> Vec<[Option<[f64; 2]>; 2]> {
    let beams = &structure.beams;
    if beams.iter().all(|beam| beam.material.fillet.is_none()) {
        return vec![[None; 2]; beams.len()];
    }
    let mut met: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
    for (k, beam) in beams.iter().enumerate() {
        met.entry(beam.a).or_default().push(k);
        met.entry(beam.b).or_default().push(k);
    }
    let anchors = structure.supports.iter().filter(|support| support.held == [true; 3]).map(|support| support.node);
    let plates = structure.masses.iter().filter(|mass| mass.outline[0] > 0.0).map(|mass| mass.node);
    let rigid = structure.links.iter().flat_map(|link| [link.a, link.b]);
    let mut wide: Vec<NodeId> = anchors.chain(plates).chain(rigid).collect();
    wide.sort_unstable();
    let at = |k: usize, node: NodeId| {
        let beam = &beams[k];
        let radius = beam.material.fillet?;
        if wide.binary_search(&node).is_ok() {
            return concentration(beam.width, f64::INFINITY, radius);
        }
        let others =
            met.get(&node)?.iter().filter(|other| **other != k).map(|other| width_across(beam, &beams[*other]));
        concentration(beam.width, others.fold(0.0, f64::max), radius)
    };
    beams.iter().enumerate().map(|(k, beam)| [at(k, beam.a), at(k, beam.b)]).collect()
}

/// Width that a beam finds where it meets another (m): that of its continuation, or the side of one that it joins.
fn width_across(beam: &Beam, other: &Beam) -> f64 {
    if (other.angle - beam.angle).sin().abs() < ASIDE { other.width } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The law is continuous at h/r = 2 to 2e-3, where its two rows meet, and tends to 1 + √(h/r) for shallow steps. At D/d = 2, r/d = 0.1 the chart has 2.5 in tension, at D/d = 3,
    /// r/d = 0.1 it has 1.9 in bending (Peterson). Wider parts count as three widths, and small steps not at all.
    #[test]
    fn factors_of_the_chart() {
        for wide in [1.5, 2.0, 3.0] {
            let r = 0.25 * (wide - 1.0);
            let [below, above] = [1.0 + 1e-9, 1.0 - 1e-9].map(|x| concentration(1.0, wide, r * x).unwrap());
            for k in 0..2 {
                assert!((below[k] / above[k] - 1.0).abs() < 2e-3, "{wide}: {below:?} {above:?}");
            }
        }
        assert!((concentration(1.0, 2.0, 0.1).unwrap()[0] / 2.5 - 1.0).abs() < 0.03);
        assert!((concentration(1.0, 3.0, 0.1).unwrap()[1] / 1.9 - 1.0).abs() < 0.03);
        assert_eq!(concentration(2e-6, 1.0, 0.2e-6), concentration(2e-6, 6e-6, 0.2e-6));
        assert_eq!((concentration(1.0, 1.02, 0.2), concentration(1.0, 0.5, 0.2)), (None, None));
    }
}
