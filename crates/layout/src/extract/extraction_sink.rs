//! Models of parts into the result: nodes with numbers of the whole drawing, SI units, and notes on what holds a layer.

use super::anchors::AnchorRule;
use super::combs;
use super::model::PartModel;
use super::moments::Moments;
use super::part::Part;
use super::{ExtractedBeam, ExtractedBody, ExtractedComb, ExtractedNode, ExtractedPad, ExtractedRoot, Extraction};
use crate::drawing::FlatLayout;
use crate::process;
use std::collections::HashSet;

/// Most bodies per part reported as held by their width alone.
const MAX_MIDDLES: usize = 3;

/// Puts models into the result, in SI units.
pub(super) struct ExtractionSink<'a> {
    pub(super) result: &'a mut Extraction,
    pub(super) layer: usize,
    /// Number of the layer's first part.
    pub(super) first: usize,
    pub(super) unit: f64,
    /// Young's modulus times thickness (N/m); none: the material has no modulus.
    pub(super) rigidity: Option<f64>,
}

impl ExtractionSink<'_> {
    /// Takes the model of a part in; answers the nodes of its taps.
    pub(super) fn add(&mut self, model: &PartModel, part: usize) -> std::vec::IntoIter<usize> {
        let (unit, layer) = (self.unit, self.layer);
        let mut used = vec![false; model.nodes.len()];
        let ends = model.beams.iter().flat_map(|b| [b.a, b.b]).chain(model.links.iter().flatten().copied());
        let ends = ends.chain(model.roots.iter().flat_map(|root| root.nodes));
        ends.chain(model.bodies.iter().map(|b| b.node)).chain(model.taps.iter().copied()).for_each(|n| used[n] = true);
        // a part that is nothing but held is an electrode: it keeps one node
        if !used.iter().any(|u| *u) {
            model.anchors.first().iter().for_each(|n| used[**n] = true);
        }
        let mut number = vec![usize::MAX; model.nodes.len()];
        for (n, at) in model.nodes.iter().enumerate().filter(|(n, _)| used[*n]) {
            number[n] = self.node(at.map(|x| x * unit), model.reach[n] * unit, self.first + part);
        }
        let result = &mut *self.result;
        result.beams.extend(model.beams.iter().map(|b| ExtractedBeam {
            layer,
            nodes: [number[b.a], number[b.b]],
            width: b.width.map(|w| w * unit),
            porosity: b.porosity,
        }));
        result.bodies.extend(model.bodies.iter().map(|b| body(layer, number[b.node], &b.moments, unit)));
        result.links.extend(model.links.iter().map(|l| l.map(|n| number[n])));
        for root in &model.roots {
            let (nodes, [shift, turn]) = (root.nodes.map(|n| number[n]), root.compliance);
            match self.rigidity {
                Some(e) => {
                    let (shift, turn) = (e / shift, e * unit * unit / turn);
                    result.roots.push(ExtractedRoot { nodes, along: root.along, shift, turn });
                }
                None => result.links.push(nodes),
            }
        }
        result.pads.extend(model.pads.iter().map(|pad| ExtractedPad {
            nodes: pad.nodes.iter().map(|n| number[*n]).filter(|n| *n != usize::MAX).collect(),
            layer,
            part: self.first + part,
            outlines: pad.outlines.clone(),
        }));
        result.anchors.extend(model.anchors.iter().filter(|n| used[**n]).map(|n| number[*n]));
        model.taps.iter().map(|n| number[*n]).collect::<Vec<_>>().into_iter()
    }

    fn node(&mut self, at: [f64; 2], reach: f64, part: usize) -> usize {
        self.result.nodes.push(ExtractedNode { name: String::new(), at, reach, labelled: false, part });
        self.result.nodes.len() - 1
    }

    /// Notes the rule that decides which parts are held where no anchor is drawn, and parts without any support.
    pub(super) fn notes(
        &mut self,
        drawing: &FlatLayout,
        layer: &process::StructuralLayer,
        rule: &AnchorRule,
        parts: &[Part],
        models: &[PartModel],
        loose: &[bool],
    ) {
        let place = |k: usize| {
            let [low, high] = parts[k].polygon.extent().unwrap_or_default();
            drawing.place([0, 1].map(|i| 0.5 * (f64::from(low[i]) + f64::from(high[i]))))
        };
        let list = |some: Vec<usize>| {
            let shown: Vec<String> = some.iter().take(3).map(|k| place(*k)).collect();
            let more = if some.len() > 3 { format!(" and {} more", some.len() - 3) } else { String::new() };
            format!("{} at {}{more}", some.len(), shown.join(", "))
        };
        let name = &layer.name;
        if matches!(rule, AnchorRule::Pads) {
            let whole: Vec<usize> = (0..parts.len())
                .filter(|k| !loose[*k] && models[*k].beams.is_empty() && models[*k].bodies.is_empty())
                .collect();
            let pads: usize = models.iter().filter(|m| !m.beams.is_empty()).map(|m| m.anchors.len()).sum();
            let mut reported =
                format!("layer {name}: no anchors are drawn; by rule, {pads} ends of limbs in pads are held");
            if !whole.is_empty() {
                reported += &format!(", and parts without limbs or pads of their own: {}", list(whole));
            }
            self.result.notes.push(reported);
        }
        self.result.notes.extend(parts.iter().flat_map(|part| middles(drawing, name, rule, part)));
        if !models.iter().any(PartModel::is_held) {
            self.result.notes.push(format!("layer {name}: nothing holds it"));
            return;
        }
        let free: Vec<usize> =
            (0..parts.len()).filter(|k| !models[*k].is_held() && !models[*k].taps.is_empty()).collect();
        if !free.is_empty() {
            let reported =
                format!("layer {name}: nothing holds the parts with combs, which stay in the model: {}", list(free));
            self.result.notes.push(reported);
        }
    }

    /// A comb between two nodes, with its fingers as bodies on the sides that move.
    pub(super) fn comb(&mut self, comb: &combs::FingerArray, nodes: [usize; 2], anchored: &HashSet<usize>) {
        let held = nodes.map(|n| anchored.contains(&n));
        for (i, node) in nodes.into_iter().enumerate() {
            if !held[i] && comb.masses[i].area > 0.0 {
                let center =
                    self.node(comb.masses[i].centroid().map(|x| x * self.unit), 0.0, self.first + comb.parts[i]);
                self.result.links.push([node, center]);
                self.result.bodies.push(body(self.layer, center, &comb.masses[i], self.unit));
            }
        }
        // the side that moves comes first
        let order = if held[0] && !held[1] { [1, 0] } else { [0, 1] };
        self.result.combs.push(ExtractedComb {
            layer: self.layer,
            nodes: order.map(|i| nodes[i]),
            gaps: comb.gaps,
            fingers: order.map(|i| comb.fingers[i]),
            gap: comb.gap * self.unit,
            overlap: comb.overlap * self.unit,
            width: comb.width * self.unit,
        });
    }
}

/// Notes bodies that are held by their width alone although all their limbs lead to other held places. Where such a
/// body is the mechanism itself, no undercut can distinguish it.
fn middles(drawing: &FlatLayout, layer: &str, rule: &AnchorRule, part: &Part) -> Vec<String> {
    let (AnchorRule::Wide(reach), (axis, found)) = (rule, &part.found) else { return Vec::new() };
    let held: Vec<bool> =
        found.joints.iter().map(|joint| rule.holds_body(axis, part.origin(), &found.limbs, joint)).collect();
    let mut notes = Vec::new();
    for (j, joint) in found.joints.iter().enumerate().filter(|(j, joint)| held[*j] && joint.ports.len() > 1) {
        let beyond = |k: usize| found.at[k].into_iter().find(|other| *other != j);
        if joint.ports.iter().all(|port| beyond(port.limb).is_some_and(|other| held[other])) {
            let [x, y] = joint.cell.centroid();
            let at = drawing.place([x + part.origin()[0], y + part.origin()[1]]);
            notes.push(format!(
                "layer {layer}: the body at {at} is held, being wider than twice the undercut of {:.3} µm, though its {} limbs all lead to \
                 other places that are held; if it moves, name the mask that holds the layer in the process (`anchors`, `released`), or \
                 leave `undercut` out: then pads at the ends of single limbs are held",
                reach * drawing.unit_m * 1e6,
                joint.ports.len(),
            ));
        }
    }
    // one middle body is reported, not each pad of a chain
    notes.truncate(MAX_MIDDLES);
    notes
}

fn body(layer: usize, node: usize, moments: &Moments, unit: f64) -> ExtractedBody {
    ExtractedBody { layer, node, area: moments.area * unit * unit, polar: moments.polar() * unit.powi(4) }
}
