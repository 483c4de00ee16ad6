//! The parts of a drawn mechanism as shapes on a picture: beams and plates, supports, links, springs, ports.

use super::chart::WIDTH;
use super::shapes::{DisplacedShape, PlanePoint, beam_outline, comb_outlines, plate_outline, rectangle};
use super::svg::{Align, Paint, Picture};
use bimorph_structure::{NodeId, Structure};

/// Metres to pixels.
pub(super) struct PixelTransform {
    pub(super) low: PlanePoint,
    pub(super) scale: f64,
    pub(super) bottom: f64,
    pub(super) left: f64,
}

impl PixelTransform {
    pub(super) fn at(&self, p: PlanePoint) -> PlanePoint {
        [self.left + (p[0] - self.low[0]) * self.scale, self.bottom - (p[1] - self.low[1]) * self.scale]
    }

    pub(super) fn all(&self, points: &[PlanePoint]) -> Vec<PlanePoint> {
        points.iter().map(|p| self.at(*p)).collect()
    }
}

/// The area of a part.
pub(super) struct PartOutline<'a> {
    pub(super) name: &'a str,
    pub(super) shape: Vec<PlanePoint>,
}

/// Every part that moves or stands still with an area.
pub(super) fn outlines<'a>(structure: &'a Structure, motion: &DisplacedShape<'_>) -> Vec<PartOutline<'a>> {
    let mut list: Vec<PartOutline<'_>> = Vec::new();
    for (index, beam) in structure.beams.iter().enumerate() {
        list.push(PartOutline { name: &beam.name, shape: beam_outline(structure, index, motion) });
    }
    for mass in &structure.masses {
        list.extend(plate_outline(structure, mass, motion).map(|shape| PartOutline { name: &mass.name, shape }));
    }
    for comb in &structure.combs {
        let (moving, fixed) = comb_outlines(structure, comb, motion);
        let shapes = if motion.nodes.is_empty() { [moving, fixed].concat() } else { moving };
        list.extend(shapes.into_iter().map(|shape| PartOutline { name: &comb.name, shape }));
    }
    list
}

pub(super) fn bounds(points: impl Iterator<Item = PlanePoint>, structure: &Structure) -> (PlanePoint, PlanePoint) {
    let nodes = structure.nodes.iter().filter(|n| n.mechanical).map(|n| n.position);
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = points
        .chain(nodes)
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .fold(start, |(low, high), p| ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]));
    if low[0] <= high[0] { (low, high) } else { ([0.0; 2], [1e-6; 2]) }
}

/// Ground hatching at supports; a guide gets two rails along its free direction.
pub(super) fn draw_supports(picture: &mut Picture, structure: &Structure, view: &PixelTransform, size: f64) {
    for support in &structure.supports {
        let at = structure.nodes[support.node.0].position;
        let frame = |along: [f64; 2], across: [f64; 2]| view.all(&rectangle(at, support.angle, along, across));
        if support.held == [true; 3] {
            picture.polygon(
                &frame([-size, size], [-size, size]),
                Paint { fill: "#f1f1f1", stroke: "#777777", width: 0.8, opacity: 1.0 },
            );
            for k in -2..=2 {
                let shift = 0.8 * size * f64::from(k) / 2.0;
                let (from, to) = ((shift - size).max(-size), (shift + size).min(size));
                let line = view.all(&[[at[0] + from, at[1] + from - shift], [at[0] + to, at[1] + to - shift]]);
                picture.polyline(&line, Paint::line("#777777", 0.8));
            }
        } else {
            for side in [-0.6 * size, 0.6 * size] {
                picture.polyline(&frame([-1.6 * size, 1.6 * size], [side, side])[..2], Paint::line("#777777", 1.4));
            }
        }
    }
}

/// Parts without an area: rigid links, springs, facing plates, lumped masses.
pub(super) fn draw_lines(
    picture: &mut Picture,
    structure: &Structure,
    moved: &DisplacedShape<'_>,
    view: &PixelTransform,
    colour: &str,
) {
    let at = |node: NodeId| {
        let [x, y] = structure.nodes[node.0].position;
        let [u, v, _] = moved.nodes.get(node.0).copied().unwrap_or_default();
        view.at([x + u, y + v])
    };
    for link in &structure.links {
        picture.polyline(&[at(link.a), at(link.b)], Paint::line(colour, 2.0));
    }
    for spring in structure.springs.iter().filter(|s| s.stiffness.iter().any(|k| *k != 0.0)) {
        let (a, b) = (at(spring.a), at(spring.b));
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1.0);
        let across = [-(b[1] - a[1]) / length * 6.0, (b[0] - a[0]) / length * 6.0];
        let zigzag: Vec<PlanePoint> = (0..=12)
            .map(|k| {
                let s = f64::from(k) / 12.0;
                let side = if !(2..=10).contains(&k) {
                    0.0
                } else if k % 2 == 0 {
                    1.0
                } else {
                    -1.0
                };
                [a[0] + s * (b[0] - a[0]) + side * across[0], a[1] + s * (b[1] - a[1]) + side * across[1]]
            })
            .collect();
        picture.polyline(&zigzag, Paint::line(colour, 1.2));
    }
    for gap in &structure.plate_gaps {
        for node in [gap.a, gap.b] {
            let [x, y] = at(node);
            let (across, size) = ([gap.axis[1], gap.axis[0]], 40.0);
            let ends = [[x - across[0] * size, y - across[1] * size], [x + across[0] * size, y + across[1] * size]];
            picture.polyline(&ends, Paint::line(colour, 2.5));
        }
    }
    for stop in &structure.stops {
        for (way, sign) in stop.ways.iter().zip([1.0, -1.0]).filter(|(way, _)| way.is_some()) {
            let from = structure.nodes[stop.a.0].position;
            let reach = sign * way.unwrap_or(0.0);
            let [x, y] = view.at([from[0] + reach * stop.axis[0], from[1] + reach * stop.axis[1]]);
            let (across, size) = ([stop.axis[1], stop.axis[0]], 12.0);
            let ends = [[x - across[0] * size, y - across[1] * size], [x + across[0] * size, y + across[1] * size]];
            picture.polyline(&ends, Paint::line(colour, 3.5));
        }
    }
    for mass in structure.masses.iter().filter(|m| m.outline[0] <= 0.0) {
        let [x, y] = at(mass.node);
        picture.circle(x, y, 5.0, Paint::fill(colour));
    }
}

pub(super) fn draw_ports(picture: &mut Picture, structure: &Structure, view: &PixelTransform) {
    for port in &structure.ports {
        for (k, node) in places(structure, port.plus).into_iter().enumerate() {
            let [x, y] = view.at(structure.nodes[node.0].position);
            picture.circle(x, y, 4.5, Paint { fill: "#ffffff", stroke: "#D55E00", width: 2.0, opacity: 1.0 });
            if k > 0 {
                continue; // one word for all places of a port
            }
            let (align, shift) = if x > WIDTH - 140.0 { (Align::End, -9.0) } else { (Align::Start, 9.0) };
            picture.label(x + shift, y - 8.0, 13.0, align, "#D55E00", &port.name);
        }
    }
}

/// Where a port touches the mechanism: its own node, or the far ends of the resistors and wires that start at it.
fn places(structure: &Structure, node: NodeId) -> Vec<NodeId> {
    let drawn = |id: &NodeId| structure.nodes[id.0].mechanical;
    if drawn(&node) {
        return vec![node];
    }
    let other_end = |a: NodeId, b: NodeId| if a == node { Some(b) } else { (b == node).then_some(a) };
    let wired = structure.wires.iter().filter(|w| w.nodes.contains(&node)).flat_map(|w| w.nodes.iter().copied());
    structure.resistors.iter().filter_map(|r| other_end(r.a, r.b)).chain(wired).filter(drawn).collect()
}
