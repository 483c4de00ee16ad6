//! An extraction as a netlist in SUGAR's language.
//!
//! Widths and lengths that several beams share are parameters, so that the model can be swept. The same drawing gives the same bytes.

use super::{Beam, Extraction, LayerResult, holes};
use crate::sets::Sets;
use std::collections::HashMap;
use std::fmt::Write as _;

/// So many beams must share a width, or a length, for it to become a parameter.
const SHARED: [usize; 2] = [2, 3];
/// Relative change of the width below which a beam has one width [1]: what rounding to the grid does.
const UNIFORM: f64 = 5e-3;

/// The netlist of an extraction.
pub fn netlist(extraction: &Extraction) -> String {
    let mut out = String::new();
    head(extraction, &mut out);
    let members = members(extraction);
    let names: Vec<&str> = extraction.nodes.iter().map(|n| n.name.as_str()).collect();
    let arc_widths = extraction.arcs.iter().map(|a| a.width);
    let widths = members.iter().flat_map(|m| if m.taper { m.beam.width.to_vec() } else { vec![m.beam.width[0]] });
    let widths = Shared::new("w", SHARED[0], widths.chain(arc_widths).map(micro));
    let lengths = Shared::new("l", SHARED[1], members.iter().map(|m| micro(m.length)));
    for (shared, what) in [(&widths, "width"), (&lengths, "length")] {
        for (name, value, count) in &shared.parameters {
            let _ = writeln!(out, "param {name} = {value}  % {what} of {count} beams");
        }
    }
    places(extraction, &mut out);
    let layers = layers(extraction);
    for node in &extraction.anchors {
        let layer = layers[*node];
        let _ = writeln!(out, "anchor {layer} [{}] []", names[*node]);
    }
    for body in &extraction.bodies {
        let layer = &extraction.layers[body.layer].name;
        let (area, polar) = (number(body.area), number(body.polar));
        let _ = writeln!(out, "body2d {layer} [{}] [A={area} Ip={polar}]", names[body.node]);
    }
    for [a, b] in &extraction.links {
        let d = difference(extraction, *a, *b);
        let (l, oz) = (micro(d[0].hypot(d[1])), angle(d));
        let _ = writeln!(out, "link2d * [{} {}] [l={l}{oz}]", names[*a], names[*b]);
    }
    for Member { beam, along, length, taper } in &members {
        let layer = &extraction.layers[beam.layer];
        let [a, b] = beam.nodes.map(|n| names[n]);
        let (l, oz, holes) = (lengths.word(micro(*length)), angle(*along), perforated(layer, beam.porosity));
        let [w0, w1] = beam.width.map(|w| widths.word(micro(w)));
        let name = &layer.name;
        let _ = if *taper {
            writeln!(out, "taper2d {name} [{a} {b}] [l={l} w1={w0} w2={w1}{oz}{holes}]")
        } else {
            writeln!(out, "beam2d {name} [{a} {b}] [l={l} w={w0}{oz}{holes}]")
        };
    }
    for arc in &extraction.arcs {
        let layer = &extraction.layers[arc.layer];
        // an arc of the language turns to its left
        let [a, b] = if arc.angle > 0.0 { arc.nodes } else { [arc.nodes[1], arc.nodes[0]] };
        let (d, alpha) = (difference(extraction, a, b), arc.angle.abs());
        let radius = micro(0.5 * d[0].hypot(d[1]) / (0.5 * alpha).sin());
        let start = d[1].atan2(d[0]) - 0.5 * alpha;
        let (w, oz, holes) =
            (widths.word(micro(arc.width)), angle([start.cos(), start.sin()]), perforated(layer, arc.porosity));
        let (name, degrees) = (&layer.name, (alpha.to_degrees() * 1e9).round() / 1e9);
        let _ = writeln!(
            out,
            "circbeam {name} [{} {}] [radius={radius} alpha=deg({degrees}) w={w}{oz}{holes}]",
            names[a], names[b]
        );
    }
    for comb in &extraction.combs {
        let layer = &extraction.layers[comb.layer].name;
        let d = difference(extraction, comb.nodes[0], comb.nodes[1]);
        // the other side lies at 2·L − l
        let long = 0.5 * (d[0].hypot(d[1]) + comb.overlap);
        let [a, b] = comb.nodes.map(|n| names[n]);
        let sizes = [comb.gap, comb.overlap, long].map(micro);
        let _ = writeln!(
            out,
            "comb2de {layer} [{a} {b}] [N={} gap={} l={} L={}{}]  % {} and {} fingers",
            comb.gaps,
            sizes[0],
            sizes[1],
            sizes[2],
            angle(d),
            comb.fingers[0],
            comb.fingers[1]
        );
    }
    for plates in &extraction.plates {
        let [a, b] = plates.nodes.map(|n| names[n]);
        let d = difference(extraction, plates.nodes[0], plates.nodes[1]);
        let (area, gap) = (number(plates.area), micro(plates.gap));
        let layer = &extraction.layers[plates.layer].name;
        let _ = writeln!(out, "plategap2d {layer} [{a} {b}] [A={area} gap={gap}{}]", angle(d));
    }
    for facing in &extraction.facing {
        let [a, b, c, d] = facing.nodes.map(|n| names[n]);
        let along = difference(extraction, facing.nodes[0], facing.nodes[1]);
        let [l, w1, w2, gap] = [along[0].hypot(along[1]), facing.width[0], facing.width[1], facing.gap].map(micro);
        let layer = &extraction.layers[facing.layer].name;
        let oz = angle(along);
        let _ = writeln!(out, "gap2dforce {layer} [{a} {b} {c} {d}] [l={l} w1={w1} w2={w2} gap={gap}{oz}]");
    }
    conductors(extraction, &mut out);
    out
}

fn head(extraction: &Extraction, out: &mut String) {
    let clean = |text: &str| text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let _ = writeln!(
        out,
        "% {}, cell {}, process {}",
        clean(&extraction.source),
        clean(&extraction.top),
        extraction.process
    );
    for lost in &extraction.unrecognised {
        let [x, y] = lost.at.map(|x| x * 1e6);
        let _ = writeln!(
            out,
            "% not in the model: {:.6} um2 of {} at ({x:.3}, {y:.3}) um: {}",
            lost.area * 1e12,
            clean(&lost.layer),
            clean(&lost.why)
        );
    }
    for layer in &extraction.layers {
        let entries: Vec<String> =
            layer.material.iter().map(|(name, value)| format!("{name}={}", number(*value))).collect();
        let _ = writeln!(out, "process {} = [ {} h={} ]", layer.name, entries.join(" "), micro(layer.thickness));
    }
}

/// Parts that move are at ground; of those that hold still each is a port.
fn conductors(extraction: &Extraction, out: &mut String) {
    let mut moves = std::collections::BTreeMap::new();
    for node in extraction
        .beams
        .iter()
        .flat_map(|b| b.nodes)
        .chain(extraction.arcs.iter().flat_map(|a| a.nodes))
        .chain(extraction.bodies.iter().map(|b| b.node))
    {
        moves.insert(extraction.nodes[node].part, true);
    }
    // nodes with a potential, by part
    let mut charged: std::collections::BTreeMap<usize, Vec<usize>> = std::collections::BTreeMap::new();
    let plates = extraction.plates.iter().flat_map(|p| p.nodes);
    let facing = extraction.facing.iter().flat_map(|f| [f.nodes[0], f.nodes[2]]);
    for n in extraction.combs.iter().flat_map(|c| c.nodes).chain(plates).chain(facing) {
        charged.entry(extraction.nodes[n].part).or_default().push(n);
    }
    for (part, mut nodes) in charged {
        nodes.sort_unstable();
        nodes.dedup();
        let name = |n: usize| &extraction.nodes[n].name;
        if moves.contains_key(&part) {
            nodes.iter().for_each(|n| {
                let _ = writeln!(out, "eground * [{}] []", name(*n));
            });
            continue;
        }
        let first = nodes[0];
        nodes[1..].iter().for_each(|n| {
            let _ = writeln!(out, "R * [{} {}] [R=1]", name(first), name(*n));
        });
        let _ = writeln!(out, "{}_v port * [{}] []", name(first), name(first));
    }
}

/// A beam with the words for its width.
struct Member {
    beam: Beam,
    along: [f64; 2],
    length: f64,
    taper: bool,
}

fn members(extraction: &Extraction) -> Vec<Member> {
    let members = extraction.beams.iter().map(|beam| {
        let mut beam = forwards(extraction, beam);
        let along = difference(extraction, beam.nodes[0], beam.nodes[1]);
        let [w0, w1] = beam.width;
        let taper = (w1 - w0).abs() > UNIFORM * w0.max(w1);
        if !taper {
            beam.width = [0.5 * (w0 + w1); 2];
        }
        Member { length: along[0].hypot(along[1]), along, taper, beam }
    });
    members.collect()
}

/// The beam from left to right, or upwards.
fn forwards(extraction: &Extraction, beam: &Beam) -> Beam {
    let d = difference(extraction, beam.nodes[0], beam.nodes[1]);
    let tiny = 1e-9 * d[0].hypot(d[1]);
    let mut beam = beam.clone();
    if d[0] < -tiny || (d[0] <= tiny && d[1] < 0.0) {
        beam.nodes.reverse();
        beam.width.reverse();
    }
    beam
}

fn difference(extraction: &Extraction, a: usize, b: usize) -> [f64; 2] {
    let [p, q] = [a, b].map(|n| extraction.nodes[n].at);
    [q[0] - p[0], q[1] - p[1]]
}

/// Places parts that do not hang together with the first.
fn places(extraction: &Extraction, out: &mut String) {
    let mut sets = Sets::new(extraction.nodes.len());
    for [a, b] in extraction
        .beams
        .iter()
        .map(|b| b.nodes)
        .chain(extraction.arcs.iter().map(|a| a.nodes))
        .chain(extraction.links.iter().copied())
    {
        sets.join(a, b);
    }
    for n in 1..extraction.nodes.len() {
        if sets.first(n) == n {
            let d = difference(extraction, 0, n);
            let (from, to) = (&extraction.nodes[0].name, &extraction.nodes[n].name);
            let _ = writeln!(out, "pos * [{from} {to}] [x={} y={}]", micro(d[0]), micro(d[1]));
        }
    }
}

/// The layer of each node.
fn layers(extraction: &Extraction) -> Vec<&str> {
    let mut layers = vec!["*"; extraction.nodes.len()];
    let arcs = extraction.arcs.iter().map(|a| (a.nodes, a.layer));
    for (nodes, layer) in extraction.beams.iter().map(|b| (b.nodes, b.layer)).chain(arcs) {
        nodes.iter().for_each(|n| layers[*n] = &extraction.layers[layer].name);
    }
    layers
}

/// Values that several beams have, with a parameter for each.
struct Shared {
    words: HashMap<String, String>,
    parameters: Vec<(String, String, usize)>,
}

impl Shared {
    fn new(prefix: &str, least: usize, values: impl Iterator<Item = String>) -> Self {
        let mut counts: Vec<(String, usize)> = Vec::new();
        let mut at: HashMap<String, usize> = HashMap::new();
        for value in values {
            let k = *at.entry(value.clone()).or_insert_with(|| {
                counts.push((value, 0));
                counts.len() - 1
            });
            counts[k].1 += 1;
        }
        let shared = counts.into_iter().filter(|(_, count)| *count >= least);
        let parameters: Vec<_> =
            shared.enumerate().map(|(k, (value, count))| (format!("{prefix}{}", k + 1), value, count)).collect();
        Self { words: parameters.iter().map(|(name, value, _)| (value.clone(), name.clone())).collect(), parameters }
    }

    fn word(&self, value: String) -> String {
        self.words.get(&value).cloned().unwrap_or(value)
    }
}

/// A length in micrometres with the suffix of the language, to 0.1 pm.
fn micro(metres: f64) -> String {
    let rounded = (metres * 1e13).round() / 1e7;
    if rounded == 0.0 { "0".to_owned() } else { format!("{rounded}u") }
}

/// What etch holes leave of a beam's stiffness, mass and film.
fn perforated(layer: &LayerResult, porosity: f64) -> String {
    if porosity <= 0.0 {
        return String::new();
    }
    let share = |name: &str, factor: f64| {
        let value = layer.material.iter().find(|(known, _)| known == name).map(|(_, value)| value * factor);
        value.map(|value| format!(" {name}={}", number(value))).unwrap_or_default()
    };
    share("Youngsmodulus", holes::stiffness(porosity))
        + &share("density", 1.0 - porosity)
        + &share("viscosity", 1.0 - porosity)
}

/// A number of the language.
fn number(value: f64) -> String {
    let plain = format!("{value}");
    if plain.len() <= 8 { plain } else { format!("{value:e}") }
}

/// ` oz=…` of a direction; nothing along x.
fn angle([x, y]: [f64; 2]) -> String {
    let degrees = (y.atan2(x).to_degrees() * 1e9).round() / 1e9;
    match degrees {
        0.0 => String::new(),
        90.0 => " oz=pi/2".to_owned(),
        -90.0 => " oz=-pi/2".to_owned(),
        180.0 | -180.0 => " oz=pi".to_owned(),
        _ => format!(" oz=deg({degrees})"),
    }
}
