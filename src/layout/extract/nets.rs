//! Nets: which pads labels name, over the wiring that joins them.
//!
//! A label names the conductor that it stands on: a pad, a layer of metal, or one that holds still (wiring under the others). Metal and wiring
//! join the pads that they overlap, and a part in which nothing moves is one conductor. Between two nets or more, the beams of a part carry
//! current.

use super::anchors::overlap;
use super::boxes::{self, Boxes, Extent};
use super::names::identifier;
use super::{ExtractError, Extraction, Net};
use crate::layout::crossings::bounded;
use crate::layout::drawing::{Drawing, Polygon};
use crate::layout::mask;
use crate::layout::process::{self, Process};
use crate::layout::regions;
use crate::sets::Sets;
use std::collections::BTreeMap;

/// Names of electrical ground, in small letters.
const GROUNDS: [&str; 4] = ["gnd", "ground", "vss", "0"];

/// What a label stands on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OnNet {
    /// The pad under it; none: wiring.
    pub(super) pad: Option<usize>,
    /// Index of the net; none: it has another name already.
    pub(super) net: Option<usize>,
}

/// Finds nets; answers for each label of the drawing what conductor it stands on, if any.
///
/// # Errors
/// Wiring whose polygons cut one another too often to be merged.
pub(super) fn find(
    result: &mut Extraction,
    drawing: &Drawing,
    process: &Process,
) -> Result<Vec<Option<OnNet>>, ExtractError> {
    let pads: Vec<(usize, Vec<[f64; 2]>)> = outlines(result);
    let boxes: Vec<Extent> = pads.iter().map(|(_, outline)| boxes::around(outline.iter().copied())).collect();
    let tree = Boxes::of(&boxes);
    let wiring = wiring(drawing, process)?;
    let count = result.pads.len();
    let mut sets = Sets::new(count + wiring.len());
    for (w, (layers, contours)) in wiring.iter().enumerate() {
        crate::budget::check();
        for k in tree.overlapping(&boxes::around(contours.iter().flatten().copied())) {
            let (pad, outline) = &pads[k as usize];
            let joined =
                layers.as_ref().is_none_or(|layers| layers.contains(&result.layers[result.pads[*pad].layer].name));
            if joined && overlap(contours, outline) {
                sets.join(*pad, count + w);
            }
        }
    }
    let still = still(result);
    let mut first: BTreeMap<usize, usize> = BTreeMap::new();
    for k in 0..count {
        // pads that share a node are one, and so is what does not move
        let part = result.pads[k].part;
        if still[part] {
            sets.join(*first.entry(part).or_insert(k), k);
        }
    }
    let mut of_node: BTreeMap<usize, usize> = BTreeMap::new();
    for (k, pad) in result.pads.iter().enumerate() {
        pad.nodes.iter().for_each(|n| {
            sets.join(*of_node.entry(*n).or_insert(k), k);
        });
    }
    let on_wiring =
        Boxes::of(&wiring.iter().map(|(_, c)| boxes::around(c.iter().flatten().copied())).collect::<Vec<_>>());
    let mut net_of: BTreeMap<usize, usize> = BTreeMap::new();
    let mut named: BTreeMap<String, usize> = BTreeMap::new();
    let mut labels = Vec::with_capacity(drawing.labels.len());
    for label in &drawing.labels {
        let at = label.at.map(f64::from);
        let under = tree.overlapping(&[at, at]).into_iter().map(|k| &pads[k as usize]);
        let pad = under.filter(|(_, outline)| super::model::distance(outline, at) <= 1.0).map(|(pad, _)| *pad).next();
        let wire = || {
            let near = on_wiring.overlapping(&[at, at]).into_iter().map(|w| w as usize);
            near.filter(|w| super::anchors::inside(&wiring[*w].1, at)).map(|w| count + w).next()
        };
        let Some(conductor) = pad.or_else(wire).filter(|_| !mask::on_notes(&label.layer)) else {
            labels.push(None);
            continue;
        };
        let told = format!("label `{}` at {}", label.text, drawing.place(at));
        let Some(name) = identifier(&label.text) else {
            labels.push(Some(OnNet { pad, net: None }));
            continue;
        };
        let root = sets.first(conductor);
        let known = net_of.get(&root).copied();
        let net = match (known, named.get(&name)) {
            (Some(net), _) if result.nets[net].name == name => Some(net),
            (Some(net), _) => {
                let other = &result.nets[net].name;
                result.notes.push(format!("{told} stands on the net `{other}`, which has a name already"));
                None
            }
            // one name in several places is one net
            (None, Some(&net)) => {
                net_of.insert(root, net);
                Some(net)
            }
            (None, None) => {
                let ground = GROUNDS.contains(&label.text.trim().to_ascii_lowercase().as_str());
                result.nets.push(Net { name: name.clone(), ground, pads: Vec::new() });
                net_of.insert(root, result.nets.len() - 1);
                named.insert(name, result.nets.len() - 1);
                Some(result.nets.len() - 1)
            }
        };
        labels.push(Some(OnNet { pad, net }));
    }
    for k in 0..count {
        if let Some(net) = net_of.get(&sets.first(k)) {
            result.nets[*net].pads.push(k);
        }
    }
    result.live = live(result, &still);
    Ok(labels)
}

/// Outlines of all pads, each with its pad.
fn outlines(result: &Extraction) -> Vec<(usize, Vec<[f64; 2]>)> {
    let all = result.pads.iter().enumerate();
    let cells = all.flat_map(|(k, pad)| pad.outlines.iter().map(move |outline| (k, outline.clone())));
    cells.filter(|(_, outline)| outline.iter().any(|p| *p != outline[0])).collect()
}

/// A conductor that is no part: the layers that it can join (none: all), and its contours.
type Wiring = (Option<Vec<String>>, Vec<Vec<[f64; 2]>>);

/// Merged polygons of layers that hold still, and of metal.
fn wiring(drawing: &Drawing, process: &Process) -> Result<Vec<Wiring>, ExtractError> {
    let float = |p: &Polygon| -> Vec<Vec<[f64; 2]>> {
        p.contours.iter().map(|c| c.iter().map(|[x, y]| [f64::from(*x), f64::from(*y)]).collect()).collect()
    };
    let drawn = |names: &[String]| {
        let of = drawing.layers.iter().filter(|(name, _)| process::names(names, name));
        let all: Vec<Polygon> = of.flat_map(|(_, polygons)| polygons.iter().cloned()).collect();
        let tangled = |tangled| ExtractError::Tangled { layer: names.join(", "), tangled };
        bounded(all.iter()).map_err(tangled)?;
        Ok(regions::union(&all))
    };
    let mut all: Vec<Wiring> = Vec::new();
    for fixed in &process.fixed {
        all.extend(drawn(&fixed.drawn)?.iter().map(|p| (None, float(p))));
    }
    let mut metals: BTreeMap<Vec<String>, Vec<String>> = BTreeMap::new();
    for layer in process.layers.iter().filter(|layer| !layer.metal.is_empty()) {
        metals.entry(layer.metal.clone()).or_default().push(layer.name.clone());
    }
    for (metal, layers) in metals {
        all.extend(drawn(&metal)?.iter().map(|p| (Some(layers.clone()), float(p))));
    }
    Ok(all)
}

/// For each part whether nothing in it moves.
fn still(result: &Extraction) -> Vec<bool> {
    let parts = result.layers.iter().map(|layer| layer.parts).sum();
    let mut still = vec![true; parts];
    let beams = result.beams.iter().flat_map(|b| b.nodes).chain(result.arcs.iter().flat_map(|a| a.nodes));
    beams.chain(result.bodies.iter().map(|b| b.node)).for_each(|n| still[result.nodes[n].part] = false);
    still
}

/// Parts that move and lie between nets.
fn live(result: &mut Extraction, still: &[bool]) -> Vec<usize> {
    let mut nets: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (net, pads) in result.nets.iter().enumerate().map(|(k, net)| (k, &net.pads)) {
        for part in pads.iter().map(|k| result.pads[*k].part).filter(|part| !still[*part]) {
            let on = nets.entry(part).or_default();
            if on.last() != Some(&net) {
                on.push(net);
            }
        }
    }
    let between: Vec<usize> = nets.into_iter().filter(|(_, on)| on.len() > 1).map(|(part, _)| part).collect();
    let mut without = Vec::new();
    let live = between.into_iter().filter(|part| {
        let layer = result.pads.iter().find(|pad| pad.part == *part).map_or(0, |pad| pad.layer);
        let known = super::live::resists(&result.layers[layer]);
        if !known && !without.contains(&layer) {
            without.push(layer);
        }
        known
    });
    let live = live.collect();
    for layer in without {
        result.notes.push(format!(
            "layer {}: labels name several nets of one part, but its material has neither `sheetresistance` nor `resistivity`: \
             no current flows",
            result.layers[layer].name
        ));
    }
    live
}
