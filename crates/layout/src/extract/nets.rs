//! Nets: which pads labels name, over the wiring that joins them.
//!
//! A label names the conductor that it stands on: a pad, a layer of metal, or one that holds still (wiring under the others). Metal and wiring
//! join the pads that they overlap, and a part in which nothing moves is one conductor. Between two nets or more, the beams of a part carry
//! current.

use super::areas::{self, AreaIndex};
use super::boxes::{self, Boxes, Extent};
use super::error::{ExtractError, MAX_POINTS};
use super::identifier::identifier;
use super::{Extraction, Net};
use crate::crossings::bounded;
use crate::drawing::{FlatLayout, Label, Polygon};
use crate::mask;
use crate::process::{self, Process};
use crate::regions;
use bimorph_base::sets::Sets;
use std::cell::OnceCell;
use std::collections::BTreeMap;

/// The moving parts of a layer.
pub(super) struct MovingLayer<'a> {
    pub(super) layer: &'a process::StructuralLayer,
    /// Outlines of the parts in which something moves, etch holes filled.
    pub(super) parts: Vec<Polygon>,
}

/// Names of electrical ground, in small letters.
const GROUNDS: [&str; 4] = ["gnd", "ground", "vss", "0"];

/// Object under a label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LabelTarget {
    /// The pad under it; none: wiring.
    pub(super) pad: Option<usize>,
    /// Index of the net; none: it has another name already.
    pub(super) net: Option<usize>,
}

/// Finds nets; answers for each label of the drawing what conductor it stands on, if any.
///
/// # Errors
/// Wiring of too many points, or whose polygons cut one another too often to be merged.
pub(super) fn find(
    result: &mut Extraction,
    drawing: &FlatLayout,
    process: &Process,
    moving: &[MovingLayer<'_>],
) -> Result<Vec<Option<LabelTarget>>, ExtractError> {
    let under = ConductorIndex::new(result, wiring(drawing, process)?, moving);
    let immobile_parts = immobile_parts(result);
    let mut sets = joined(result, &under, &immobile_parts);
    let count = result.pads.len();
    let mut net_of: BTreeMap<usize, usize> = BTreeMap::new();
    let mut named: BTreeMap<String, usize> = BTreeMap::new();
    let mut labels = Vec::with_capacity(drawing.labels.len());
    for label in &drawing.labels {
        bimorph_base::budget::check();
        let at = label.at.map(f64::from);
        let (pad, conductor) = match under.label(result, label).filter(|_| !mask::on_notes(&label.layer)) {
            Some(Conductor::Pad(pad)) => (Some(pad), pad),
            Some(Conductor::Wire(wire)) => (None, count + wire),
            None => {
                labels.push(None);
                continue;
            }
        };
        let reported = format!("label `{}` at {}", label.text, drawing.place(at));
        let Some(name) = identifier(&label.text) else {
            labels.push(Some(LabelTarget { pad, net: None }));
            continue;
        };
        let root = sets.first(conductor);
        let known = net_of.get(&root).copied();
        let net = match (known, named.get(&name)) {
            (Some(net), _) if result.nets[net].name == name => Some(net),
            (Some(net), _) => {
                let other = &result.nets[net].name;
                result.notes.push(format!("{reported} stands on the net `{other}`, which has a name already"));
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
        labels.push(Some(LabelTarget { pad, net }));
    }
    for k in 0..count {
        if let Some(net) = net_of.get(&sets.first(k)) {
            result.nets[*net].pads.push(k);
        }
    }
    result.live = live(result, &immobile_parts);
    Ok(labels)
}

/// Kinds of objects under a label.
enum Conductor {
    /// Index of a pad.
    Pad(usize),
    /// Index of a polygon of wiring.
    Wire(usize),
}

/// Pads, wiring and parts that move, found by place.
struct ConductorIndex<'a> {
    /// Outlines of pads, each with its pad.
    pads: Vec<(usize, Vec<[f64; 2]>)>,
    tree: Boxes,
    wiring: Wiring,
    /// Layers with their parts that move, sorted in when a label asks.
    moving: Vec<(&'a MovingLayer<'a>, OnceCell<AreaIndex>)>,
}

impl<'a> ConductorIndex<'a> {
    fn new(result: &Extraction, wiring: Wiring, moving: &'a [MovingLayer<'a>]) -> Self {
        let all = result.pads.iter().enumerate();
        let cells = all.flat_map(|(k, pad)| pad.outlines.iter().map(move |outline| (k, outline.clone())));
        let pads: Vec<_> = cells.filter(|(_, outline)| outline.iter().any(|p| *p != outline[0])).collect();
        let boxes: Vec<Extent> = pads.iter().map(|(_, outline)| boxes::around(outline.iter().copied())).collect();
        let moving = moving.iter().map(|moving| (moving, OnceCell::new())).collect();
        Self { tree: Boxes::of(&boxes), pads, wiring, moving }
    }

    /// The conductor that a label stands on. A label on a layer that moves belongs to what moves of it there, whatever lies beneath.
    fn label(&self, result: &Extraction, label: &Label) -> Option<Conductor> {
        let at = label.at.map(f64::from);
        let near = self.tree.overlapping(&[at, at]).into_iter().map(|k| &self.pads[k as usize]);
        let pads = near.filter(|(_, outline)| areas::distance(outline, at) <= 1.0).map(|(pad, _)| *pad);
        let pads: Vec<usize> = pads.collect();
        for (moving, parts) in self.moving.iter().filter(|(m, _)| process::names(&m.layer.drawn, &label.layer)) {
            let own = |pad: &&usize| result.layers[result.pads[**pad].layer].name == moving.layer.name;
            if let Some(pad) = pads.iter().find(own) {
                return Some(Conductor::Pad(*pad));
            }
            let parts = parts.get_or_init(|| {
                bimorph_base::budget::lay_out(points(&moving.parts) * areas::BYTES_PER_POINT);
                AreaIndex::of(&moving.parts)
            });
            if !parts.holding(at).is_empty() {
                return None;
            }
        }
        let wire = || self.wiring.areas.holding(at).first().map(|w| Conductor::Wire(*w as usize));
        pads.first().copied().map(Conductor::Pad).or_else(wire)
    }
}

/// Pads, then polygons of wiring: which of them are one conductor.
fn joined(result: &Extraction, under: &ConductorIndex<'_>, immobile_parts: &[bool]) -> Sets {
    let count = result.pads.len();
    let mut sets = Sets::new(count + under.wiring.areas.len());
    for (pad, outline) in &under.pads {
        bimorph_base::budget::check();
        let layer = &result.layers[result.pads[*pad].layer].name;
        for w in under.wiring.areas.overlapping(outline).into_iter().map(|w| w as usize) {
            if under.wiring.joins(w, layer) {
                sets.join(*pad, count + w);
            }
        }
    }
    let mut first: BTreeMap<usize, usize> = BTreeMap::new();
    let mut of_node: BTreeMap<usize, usize> = BTreeMap::new();
    for (k, pad) in result.pads.iter().enumerate() {
        // what does not move is one, and so are pads that share a node
        if immobile_parts[pad.part] {
            sets.join(*first.entry(pad.part).or_insert(k), k);
        }
        pad.nodes.iter().for_each(|n| {
            sets.join(*of_node.entry(*n).or_insert(k), k);
        });
    }
    sets
}

/// Conductors that are no part: merged polygons of layers that hold still, and of metal.
struct Wiring {
    areas: AreaIndex,
    /// The layers that polygons can join, none: all, from the polygon of that number on.
    layers: Vec<(usize, Option<Vec<String>>)>,
}

impl Wiring {
    /// Whether a polygon can join pads of a layer.
    fn joins(&self, polygon: usize, layer: &String) -> bool {
        let kind = self.layers.partition_point(|(first, _)| *first <= polygon);
        kind > 0 && self.layers[kind - 1].1.as_ref().is_none_or(|layers| layers.contains(layer))
    }
}

fn points(polygons: &[Polygon]) -> usize {
    polygons.iter().flat_map(|p| &p.contours).map(Vec::len).sum()
}

/// Finds the wiring of a drawing.
fn wiring(drawing: &FlatLayout, process: &Process) -> Result<Wiring, ExtractError> {
    let drawn = |names: &[String]| {
        let of = drawing.layers.iter().filter(|(name, _)| process::names(names, name));
        let all: Vec<Polygon> = of.flat_map(|(_, polygons)| polygons.iter().cloned()).collect();
        let layer = || names.join(", ");
        bounded(all.iter()).map_err(|tangled| ExtractError::Tangled { layer: layer(), tangled })?;
        let merged = regions::union(&all);
        let points = points(&merged);
        if points > MAX_POINTS {
            return Err(ExtractError::TooLarge { layer: layer(), points });
        }
        bimorph_base::budget::lay_out(points * areas::BYTES_PER_POINT);
        Ok(merged)
    };
    let (mut all, mut layers) = (Vec::new(), Vec::new());
    for fixed in &process.fixed {
        layers.push((all.len(), None));
        all.extend(drawn(&fixed.drawn)?);
    }
    let mut metals: BTreeMap<Vec<String>, Vec<String>> = BTreeMap::new();
    for layer in process.layers.iter().filter(|layer| !layer.metal.is_empty()) {
        metals.entry(layer.metal.clone()).or_default().push(layer.name.clone());
    }
    for (metal, joins) in metals {
        layers.push((all.len(), Some(joins)));
        all.extend(drawn(&metal)?);
    }
    Ok(Wiring { areas: AreaIndex::of(&all), layers })
}

/// For each part whether nothing in it moves.
fn immobile_parts(result: &Extraction) -> Vec<bool> {
    let parts = result.layers.iter().map(|layer| layer.parts).sum();
    let mut immobile_parts = vec![true; parts];
    let beams = result.beams.iter().flat_map(|b| b.nodes).chain(result.arcs.iter().flat_map(|a| a.nodes));
    beams.chain(result.bodies.iter().map(|b| b.node)).for_each(|n| immobile_parts[result.nodes[n].part] = false);
    immobile_parts
}

/// Parts that move and lie between nets.
fn live(result: &mut Extraction, immobile_parts: &[bool]) -> Vec<usize> {
    // ground is one, by whatever names
    let ground = result.nets.iter().position(|net| net.ground).unwrap_or(0);
    // by part: its layer, and the nets on it
    let mut nets: BTreeMap<usize, (usize, Vec<usize>)> = BTreeMap::new();
    for (k, net) in result.nets.iter().enumerate() {
        let k = if net.ground { ground } else { k };
        for pad in net.pads.iter().map(|pad| &result.pads[*pad]).filter(|pad| !immobile_parts[pad.part]) {
            let on = &mut nets.entry(pad.part).or_insert((pad.layer, Vec::new())).1;
            if on.last() != Some(&k) {
                on.push(k);
            }
        }
    }
    let mut without = Vec::new();
    let live = nets.into_iter().filter(|(_, (_, on))| on.len() > 1).filter_map(|(part, (layer, _))| {
        let known = super::live::resists(&result.layers[layer]);
        if !known && !without.contains(&layer) {
            without.push(layer);
        }
        known.then_some(part)
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
