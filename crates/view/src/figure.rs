//! The drawn geometry as the page draws it: points with beams, links and bodies on them, and parts at rest.
//!
//! Points are the nodes of the structure, then the inner points of every beam. Each has a drawn place x, y (m) and a displacement x, y (m) and rotation (rad).
//! A beam names its first node, its first inner point, the number of inner points, and its last node.

use crate::answer::Answer;
use bimorph_analysis::{BeamMotions, NodeMotion};
use bimorph_results::plot::shapes::{DisplacedShape, comb_outlines, plate_outline, rectangle};
use bimorph_structure::{NodeId, Structure};
use serde::Serialize;
use serde_json::{Value, json};

/// Half the side of the symbol of an anchor over the size of the mechanism (1).
const ANCHOR: f64 = 0.012;

/// A gap with two sides as the page draws it.
#[derive(Debug, Serialize)]
struct DrawnGap<'a> {
    name: &'a str,
    /// Nodes of the moving side.
    upper: Vec<usize>,
    /// Nodes of the other side.
    lower: Vec<usize>,
    /// Unit vector from the moving side to the other.
    axis: [f64; 2],
    /// Distance as drawn (m).
    gap: f64,
    /// Thickness of each side across the axis (m).
    widths: [f64; 2],
    /// Length along the sides of lumped plates (m); 0: the sides are between nodes.
    plate: f64,
    /// The other side does not move: it is drawn at the scale of displacements.
    fixed: bool,
}

/// Adds the geometry to an answer. `inner` is the number of inner points of each beam, `lines` the file and line of each beam.
pub(crate) fn put(answer: &mut Answer, structure: &Structure, curves: &BeamMotions, lines: &[(String, usize)]) {
    let inner = |beam: usize| curves.get(beam).map_or(0, |curve| curve.len().saturating_sub(2));
    let mut points: Vec<[f64; 2]> = structure.nodes.iter().map(|node| node.position).collect();
    let mut beams = Vec::with_capacity(structure.beams.len());
    for (index, beam) in structure.beams.iter().enumerate() {
        let [a, b] = [beam.a.0, beam.b.0].map(|node| structure.nodes[node].position);
        beams.push([beam.a.0, points.len(), inner(index), beam.b.0]);
        for k in 1..=inner(index) {
            let s = k as f64 / (inner(index) + 1) as f64;
            points.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
        }
    }
    let mut files: Vec<&str> = Vec::new();
    let mut places = Vec::with_capacity(lines.len());
    for (file, line) in lines {
        let known = files.iter().position(|known| known == file);
        let place = known.unwrap_or_else(|| {
            files.push(file);
            files.len() - 1
        });
        places.push([place, *line]);
    }
    let bounds = bounds(structure);
    let extent = (bounds[2] - bounds[0]).max(bounds[3] - bounds[1]);
    let (bodies, fixed) = rigid(structure, ANCHOR * extent);
    answer.array("points", points.into_iter().flatten());
    answer.array("widths", structure.beams.iter().map(|beam| beam.width));
    let names = |id: NodeId| id.0;
    let mechanical = |node: &bimorph_structure::Node| usize::from(node.mechanical);
    answer.put(
        "figure",
        json!({
            "nodes": structure.nodes.iter().map(|node| node.name.as_str()).collect::<Vec<_>>(),
            "mechanical": structure.nodes.iter().map(mechanical).collect::<Vec<_>>(),
            "beams": beams,
            "names": structure.beams.iter().map(|beam| beam.name.as_str()).collect::<Vec<_>>(),
            "files": files,
            "places": places,
            "links": structure.links.iter().map(|l| [names(l.a), names(l.b)]).collect::<Vec<_>>(),
            "springs": structure.springs.iter().filter(|s| s.stiffness.iter().any(|k| *k != 0.0))
                .map(|s| [names(s.a), names(s.b)]).collect::<Vec<_>>(),
            "bodies": bodies,
            "fixed": fixed,
            "gaps": gaps(structure),
            "stops": stops(structure),
            "ports": structure.ports.iter().map(|port| json!([port.name, names(port.plus)])).collect::<Vec<_>>(),
            "loads": structure.loads.iter().map(|load| json!([names(load.node), load.force, load.moment])).collect::<Vec<_>>(),
            "bounds": bounds,
        }),
    );
}

/// Displacements of all points: x, y (m) and rotation (rad) of each.
pub(crate) fn motion<'a>(
    structure: &'a Structure,
    nodes: &'a [(String, NodeMotion)],
    curves: &'a BeamMotions,
) -> impl Iterator<Item = f64> + 'a {
    let mut of_node = vec![[0.0; 3]; structure.nodes.len()];
    for (name, moved) in nodes {
        if let Some(id) = structure.node(name) {
            of_node[id.0] = [moved.x, moved.y, moved.rz];
        }
    }
    let inner = curves.iter().flat_map(|curve| curve.iter().skip(1).take(curve.len().saturating_sub(2)));
    of_node.into_iter().chain(inner.map(|m| [m.x, m.y, m.rz])).flatten()
}

/// Areas that move with a node, relative to it, and areas that stand still.
fn rigid(structure: &Structure, symbol: f64) -> (Vec<Value>, Vec<Value>) {
    let (mut bodies, mut fixed) = (Vec::new(), Vec::new());
    let rest = DisplacedShape::default();
    let borne = borne(structure);
    let anchors = structure.supports.iter().enumerate().filter(|(_, s)| s.held == [true; 3] && borne[s.node.0]);
    for (index, support) in anchors {
        let at = structure.nodes[support.node.0].position;
        let pad = structure.pads.iter().find(|pad| pad.support == index && pad.size.iter().all(|side| *side > 0.0));
        let shape = match pad {
            Some(pad) => {
                let [along, across] = pad.size;
                rectangle(at, support.angle, [0.0, along], [-across / 2.0, across / 2.0])
            }
            None => rectangle(at, support.angle, [-symbol, symbol], [-symbol, symbol]),
        };
        fixed.push(json!({ "name": support.name, "kind": "anchor", "shape": shape }));
    }
    for support in structure.supports.iter().filter(|s| s.held != [true; 3]) {
        let at = structure.nodes[support.node.0].position;
        for side in [-0.6 * symbol, 0.6 * symbol] {
            let rail = rectangle(at, support.angle, [-1.6 * symbol, 1.6 * symbol], [side, side]);
            fixed.push(json!({ "name": support.name, "kind": "guide", "shape": &rail[..2] }));
        }
    }
    let mut moving = |node: usize, name: &str, shape: Vec<[f64; 2]>| {
        let [x, y] = structure.nodes[node].position;
        let relative: Vec<[f64; 2]> = shape.iter().map(|p| [p[0] - x, p[1] - y]).collect();
        bodies.push(json!({ "at": node, "name": name, "shape": relative }));
    };
    for mass in &structure.masses {
        match plate_outline(structure, mass, &rest) {
            Some(shape) => moving(mass.node.0, &mass.name, shape),
            None => moving(mass.node.0, &mass.name, Vec::new()),
        }
    }
    for comb in &structure.combs {
        let (rotor, stator) = comb_outlines(structure, comb, &rest);
        rotor.into_iter().for_each(|shape| moving(comb.a.0, &comb.name, shape));
        fixed.extend(stator.into_iter().map(|shape| json!({ "name": comb.name, "kind": "stator", "shape": shape })));
    }
    (bodies, fixed)
}

/// For each node, whether a part with a place of its own is at it. An anchor elsewhere holds an electrode, which is drawn with its gap.
fn borne(structure: &Structure) -> Vec<bool> {
    let mut borne = vec![false; structure.nodes.len()];
    let pairs = structure.beams.iter().map(|b| [b.a, b.b]).chain(structure.links.iter().map(|l| [l.a, l.b]));
    let pairs =
        pairs.chain(structure.springs.iter().map(|s| [s.a, s.b])).chain(structure.combs.iter().map(|c| [c.a, c.b]));
    let ends = pairs.flatten().chain(structure.masses.iter().map(|mass| mass.node));
    ends.for_each(|node| borne[node.0] = true);
    borne
}

fn gaps(structure: &Structure) -> Vec<DrawnGap<'_>> {
    let anchored = structure.anchored();
    let plates = structure.plate_gaps.iter().map(|gap| DrawnGap {
        name: &gap.name,
        upper: vec![gap.a.0],
        lower: vec![gap.b.0],
        axis: gap.axis,
        gap: gap.gap,
        widths: [gap.thickness; 2],
        plate: if gap.sides[0] > 0.0 { gap.sides[0] } else { gap.area.sqrt() },
        fixed: anchored[gap.b.0],
    });
    let beams = structure.beam_gaps.iter().map(|gap| {
        let normal = gap.angle + gap.side * std::f64::consts::FRAC_PI_2;
        let [a, b, c, d] = gap.nodes;
        DrawnGap {
            name: &gap.name,
            upper: vec![a.0, b.0],
            lower: vec![c.0, d.0],
            axis: [-normal.cos(), -normal.sin()],
            gap: gap.gap,
            widths: gap.widths,
            plate: 0.0,
            fixed: anchored[c.0] && anchored[d.0],
        }
    });
    plates.chain(beams).collect()
}

fn stops(structure: &Structure) -> Vec<Value> {
    let one = |stop: &bimorph_structure::Stop| json!({ "name": stop.name, "a": stop.a.0, "b": stop.b.map(|b| b.0), "axis": stop.axis, "ways": stop.ways });
    structure.stops.iter().map(one).collect()
}

/// The box around all that is drawn at rest: lower left and upper right corner (m).
fn bounds(structure: &Structure) -> [f64; 4] {
    let mut found = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut with = |p: [f64; 2]| {
        if p.iter().all(|x| x.is_finite()) {
            found = [found[0].min(p[0]), found[1].min(p[1]), found[2].max(p[0]), found[3].max(p[1])];
        }
    };
    structure.nodes.iter().filter(|node| node.mechanical).for_each(|node| with(node.position));
    let rest = DisplacedShape::default();
    structure.masses.iter().filter_map(|mass| plate_outline(structure, mass, &rest)).flatten().for_each(&mut with);
    for comb in &structure.combs {
        let (rotor, stator) = comb_outlines(structure, comb, &rest);
        rotor.into_iter().chain(stator).flatten().for_each(&mut with);
    }
    if found[0] <= found[2] { found } else { [0.0, 0.0, 1e-6, 1e-6] }
}
