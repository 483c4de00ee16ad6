//! Conductors of the netlist: which nodes are one net, what ports drive, and what is at ground.
//!
//! Without labels, parts that move are at ground, and each that holds still is a port. A label on a pad, on metal or on wiring names its net,
//! which is a port of that name, or ground where it is called so ([`super::nets`]). Between two nets the beams of a part carry current,
//! and what is rigid is a wire.

use super::Extraction;
use super::rows::Item;
use bimorph_base::sets::Sets;
use std::collections::{BTreeMap, BTreeSet};

/// Most nodes of one wire.
const WIRED: usize = 16;

/// Wires, grounds and ports.
pub(super) fn conductors(found: &Extraction) -> Vec<Item> {
    let mut items = Vec::new();
    let mut grounds: BTreeSet<usize> = BTreeSet::new();
    let moves = moving(found);
    let charged = charged(found);
    // nodes on each net that act
    let mut on: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); found.nets.len()];
    let net_of = nets_of(found);
    for (part, nodes) in &charged {
        if found.live.binary_search(part).is_ok() {
            continue;
        }
        match net_of.get(part) {
            Some(net) => on[*net].extend(nodes),
            None if moves.contains(part) => grounds.extend(nodes),
            None => {
                items.extend(wires(nodes));
                let first = nodes[0];
                items.push(Item::Port(format!("{}_v", found.nodes[first].name), first));
            }
        }
    }
    let mut rigid = rigid(found);
    items.extend(live_wires(found, &mut rigid));
    for (net, on) in found.nets.iter().zip(&mut on) {
        let live = net.pads.iter().filter(|pad| found.live.binary_search(&found.pads[**pad].part).is_ok());
        on.extend(live.filter_map(|pad| found.pads[*pad].nodes.first()));
        // the node that the label names stands for the net
        let named = net.pads.iter().flat_map(|pad| &found.pads[*pad].nodes).find(|n| found.nodes[**n].name == net.name);
        let Some(first) = on.first().copied() else { continue };
        if let Some(named) = named {
            on.insert(*named);
        }
        let first = named.copied().unwrap_or(first);
        // one of those that wires join already
        let mut known = BTreeSet::new();
        let mut all: Vec<usize> = std::iter::once(first).chain(on.iter().copied()).collect();
        all.retain(|n| known.insert(rigid.first(*n)));
        if net.ground {
            grounds.extend(all);
        } else {
            items.extend(wires(&all));
            items.push(Item::Port(net.name.clone(), first));
        }
    }
    items.extend(grounds.into_iter().map(Item::Ground));
    // ports last
    items.sort_by_key(|item| matches!(item, Item::Port(..)));
    items
}

/// Parts in which something moves.
fn moving(found: &Extraction) -> BTreeSet<usize> {
    let beams = found.beams.iter().flat_map(|b| b.nodes).chain(found.arcs.iter().flat_map(|a| a.nodes));
    beams.chain(found.bodies.iter().map(|b| b.node)).map(|n| found.nodes[n].part).collect()
}

/// Nodes with a potential, by part, in order.
fn charged(found: &Extraction) -> BTreeMap<usize, Vec<usize>> {
    let plates = found.plates.iter().flat_map(|p| p.nodes);
    let facing = found.facing.iter().flat_map(|f| [f.nodes[0], f.nodes[2]]);
    let mut charged: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for n in found.combs.iter().flat_map(|c| c.nodes).chain(plates).chain(facing) {
        charged.entry(found.nodes[n].part).or_default().insert(n);
    }
    charged.into_iter().map(|(part, nodes)| (part, nodes.into_iter().collect())).collect()
}

/// The first net that touches each part.
fn nets_of(found: &Extraction) -> BTreeMap<usize, usize> {
    let mut of = BTreeMap::new();
    for (k, net) in found.nets.iter().enumerate() {
        net.pads.iter().for_each(|pad| {
            of.entry(found.pads[*pad].part).or_insert(k);
        });
    }
    of
}

/// Nodes joined without resistance; in wires of as many as the language allows.
fn wires(nodes: &[usize]) -> Vec<Item> {
    let mut wires = Vec::new();
    let mut rest = nodes;
    while rest.len() > 1 {
        wires.push(Item::Wire(rest[..rest.len().min(WIRED)].to_vec()));
        // the last of one is the first of the next
        rest = &rest[rest.len().min(WIRED) - 1..];
    }
    wires
}

/// Sets of nodes joined rigidly in conducting parts: links, roots, and pads with several nodes.
fn rigid(found: &Extraction) -> Sets {
    let mut sets = Sets::new(found.nodes.len());
    let pads = found.pads.iter().map(|pad| pad.nodes.as_slice());
    let pairs = found.links.iter().chain(found.roots.iter().map(|root| &root.nodes));
    for nodes in pairs.map(<[usize; 2]>::as_slice).chain(pads) {
        if nodes.first().is_some_and(|n| found.carries(*n)) {
            nodes.iter().for_each(|n| {
                sets.join(nodes[0], *n);
            });
        }
    }
    sets
}

/// Wires for what is rigid.
fn live_wires(found: &Extraction, rigid: &mut Sets) -> Vec<Item> {
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for n in (0..found.nodes.len()).filter(|n| found.carries(*n)) {
        groups.entry(rigid.first(n)).or_default().push(n);
    }
    groups.values().flat_map(|nodes| wires(nodes)).collect()
}
