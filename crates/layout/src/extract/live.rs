//! Parts that carry current: their beams as resistors that warm themselves.
//!
//! All beams of such a part conduct, those without current too, so that heat can flow. Where the material says how heat
//! is conducted and what it does, they are `beam2det`, else `beam2de`. Etch holes that take the fraction p of a beam leave
//! (1 − p)/(1 + p) of what it conducts (Maxwell's mixture in the plane).

use super::{ExtractedBeam, ExtractedNode, Extraction, LayerResult};

/// Relative change of the width up to which a beam counts as uniform (1): the effect of rounding to the grid.
const UNIFORM: f64 = 5e-3;

/// Pieces of a taper that carries current.
const PIECES: usize = 8;

/// Name of the netlist element of a conducting beam; `None` where its material does not conduct.
pub(super) fn model(layer: &LayerResult) -> Option<&'static str> {
    let knows = |name: &str| layer.material.iter().any(|(known, value)| known == name && *value != 0.0);
    if !resists(layer) {
        return None;
    }
    Some(if knows("thermcond") && knows("thermalexpansion") { "beam2det" } else { "beam2de" })
}

/// Whether its resistance is known.
pub(super) fn resists(layer: &LayerResult) -> bool {
    layer
        .material
        .iter()
        .any(|(name, value)| matches!(name.as_str(), "sheetresistance" | "resistivity") && *value > 0.0)
}

/// Factors by which etch holes change a beam's conduction, by entry of the material.
pub(super) fn perforated(porosity: f64) -> [(&'static str, f64); 3] {
    let left = (1.0 - porosity) / (1.0 + porosity);
    [("thermcond", left), ("sheetresistance", 1.0 / left), ("resistivity", 1.0 / left)]
}

impl Extraction {
    /// Whether a node is on a part with current.
    pub(super) fn carries(&self, node: usize) -> bool {
        self.live.binary_search(&self.nodes[node].part).is_ok()
    }
}

/// Divides tapers that carry current into pieces of equal width: the language has no taper that does.
pub(super) fn divide_tapers(result: &mut Extraction) {
    let tapers: Vec<usize> = (0..result.beams.len())
        .filter(|k| result.carries(result.beams[*k].nodes[0]) && tapers(result.beams[*k].width))
        .collect();
    for k in tapers {
        let ExtractedBeam { layer, nodes: [a, b], width, porosity } = result.beams[k].clone();
        let [p, q] = [a, b].map(|n| result.nodes[n].at);
        let (part, reach) = (result.nodes[a].part, width[0].max(width[1]));
        let mut last = a;
        for piece in 0..PIECES {
            let t = (piece + 1) as f64 / PIECES as f64;
            let node = if piece + 1 == PIECES {
                b
            } else {
                let at = [0, 1].map(|i| p[i] + t * (q[i] - p[i]));
                result.nodes.push(ExtractedNode { name: String::new(), at, reach, labelled: false, part });
                result.nodes.len() - 1
            };
            let middle = width[0] + (t - 0.5 / PIECES as f64) * (width[1] - width[0]);
            let beam = ExtractedBeam { layer, nodes: [last, node], width: [middle; 2], porosity };
            if piece == 0 {
                result.beams[k] = beam;
            } else {
                result.beams.push(beam);
            }
            last = node;
        }
    }
}

/// Whether a beam has two widths.
pub(super) fn tapers(width: [f64; 2]) -> bool {
    (width[1] - width[0]).abs() > UNIFORM * width[0].max(width[1])
}
