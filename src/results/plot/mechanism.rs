//! The mechanism as it was drawn, in grey, and deflected, in colour.

use super::axis::{nice_step, quantity};
use super::shapes::{Motion, Point, beam_outline, comb_outlines, plate_outline, rectangle};
use super::svg::{Align, Paint, Picture};
use crate::structure::{NodeId, Structure};

/// What to draw.
#[derive(Debug, Clone, Copy)]
pub struct Drawing<'a> {
    /// The drawn parts.
    pub structure: &'a Structure,
    /// Line above the drawing.
    pub title: &'a str,
    /// Displacement of each node by [`NodeId`]; empty: at rest only.
    pub motion: &'a [Motion],
    /// Mean temperature of beams [K], by name; colours the deflected beams.
    pub temperatures: &'a [(String, f64)],
    /// How large displacements are drawn.
    pub scale: Scale,
}

/// How large displacements are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Times a round factor that makes them visible; to scale where they are visible by themselves.
    Visible,
    /// Times this factor.
    Times(f64),
    /// Displacements have no size of their own (mode shapes): the largest becomes a fixed part of the picture.
    Shape,
}

const WIDTH: f64 = super::chart::WIDTH;
const MOST_HEIGHT: f64 = 640.0;
const MARGIN: f64 = 46.0;
const INK: &str = "#333333";
const REST: Paint<'static> = Paint { fill: "#d0d0d0", stroke: "#a8a8a8", width: 0.6, opacity: 1.0 };
const MOVED: &str = "#0072B2";

/// Metres to pixels.
struct View {
    low: Point,
    scale: f64,
    bottom: f64,
    left: f64,
}

impl View {
    fn at(&self, p: Point) -> Point {
        [self.left + (p[0] - self.low[0]) * self.scale, self.bottom - (p[1] - self.low[1]) * self.scale]
    }

    fn all(&self, points: &[Point]) -> Vec<Point> {
        points.iter().map(|p| self.at(*p)).collect()
    }
}

/// Draws a mechanism.
pub fn draw(drawing: &Drawing<'_>) -> Picture {
    let structure = drawing.structure;
    let (low, high) = bounds(outlines(structure, &[]).iter().flat_map(|o| o.shape.iter().copied()), structure);
    let extent = (high[0] - low[0]).max(high[1] - low[1]).max(f64::MIN_POSITIVE);
    let largest = drawing.motion.iter().map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max);
    let factor = match drawing.scale {
        Scale::Visible => round_factor(largest, extent),
        Scale::Times(factor) => factor,
        Scale::Shape if largest > 0.0 => 0.07 * extent / largest,
        Scale::Shape => 1.0,
    };
    let motion: Vec<Motion> = drawing.motion.iter().map(|m| m.map(|x| x * factor)).collect();
    let deflected = if motion.is_empty() { Vec::new() } else { outlines(structure, &motion) };

    let points = outlines(structure, &[]).into_iter().chain(outlines(structure, &motion)).flat_map(|o| o.shape);
    let (low, high) = bounds(points, structure);
    let symbol = 0.022 * extent;
    let (low, high) = ([low[0] - symbol, low[1] - symbol], [high[0] + symbol, high[1] + symbol]);
    let scale = ((WIDTH - 2.0 * MARGIN) / (high[0] - low[0])).min(MOST_HEIGHT / (high[1] - low[1]));
    let height = (high[1] - low[1]) * scale;
    let mut picture = Picture::new(WIDTH, height + 116.0);
    let left = (WIDTH - (high[0] - low[0]) * scale) / 2.0;
    let view = View { low, scale, bottom: 52.0 + height, left };
    picture.text(MARGIN, 24.0, 15.0, Align::Start, INK, drawing.title);

    draw_supports(&mut picture, structure, &view, symbol);
    for outline in outlines(structure, &[]) {
        picture.polygon(&view.all(&outline.shape), REST);
    }
    draw_lines(&mut picture, structure, &[], &view, "#b4b4b4");
    let hottest = drawing.temperatures.iter().map(|(_, t)| *t).fold(f64::NEG_INFINITY, f64::max);
    for outline in &deflected {
        let heat = drawing.temperatures.iter().find(|(name, _)| *name == outline.name);
        let colour = heat.map_or(MOVED.to_owned(), |(_, t)| warm(*t, hottest));
        let paint = Paint { fill: &colour, stroke: &colour, width: 0.8, opacity: 0.78 };
        picture.polygon(&view.all(&outline.shape), paint);
    }
    if !motion.is_empty() {
        draw_lines(&mut picture, structure, &motion, &view, MOVED);
    }
    draw_ports(&mut picture, structure, &view);
    let hot = drawing.temperatures.iter().find(|(_, t)| *t == hottest);
    legend(&mut picture, drawing, factor, hot, scale, height + 76.0);
    picture
}

struct Outline<'a> {
    name: &'a str,
    shape: Vec<Point>,
}

/// Every part that moves or stands still with an area.
fn outlines<'a>(structure: &'a Structure, motion: &[Motion]) -> Vec<Outline<'a>> {
    let mut list: Vec<Outline<'_>> = Vec::new();
    for beam in &structure.beams {
        list.push(Outline { name: &beam.name, shape: beam_outline(structure, beam, motion) });
    }
    for mass in &structure.masses {
        list.extend(plate_outline(structure, mass, motion).map(|shape| Outline { name: &mass.name, shape }));
    }
    for comb in &structure.combs {
        let (moving, fixed) = comb_outlines(structure, comb, motion);
        let shapes = if motion.is_empty() { [moving, fixed].concat() } else { moving };
        list.extend(shapes.into_iter().map(|shape| Outline { name: &comb.name, shape }));
    }
    list
}

fn bounds(points: impl Iterator<Item = Point>, structure: &Structure) -> (Point, Point) {
    let nodes = structure.nodes.iter().filter(|n| n.mechanical).map(|n| n.position);
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = points
        .chain(nodes)
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .fold(start, |(low, high), p| ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]));
    if low[0] <= high[0] { (low, high) } else { ([0.0; 2], [1e-6; 2]) }
}

/// 1 where the motion shows by itself, else the round factor that makes the largest one a tenth of the picture.
fn round_factor(largest: f64, extent: f64) -> f64 {
    if largest == 0.0 || !largest.is_finite() || largest > 0.03 * extent {
        return 1.0;
    }
    let factor = nice_step(0.04 * extent / largest);
    if factor.is_finite() { factor } else { 1.0 }
}

/// Ground hatching at supports; a guide gets two rails along its free direction.
fn draw_supports(picture: &mut Picture, structure: &Structure, view: &View, size: f64) {
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
fn draw_lines(picture: &mut Picture, structure: &Structure, motion: &[Motion], view: &View, colour: &str) {
    let at = |node: NodeId| {
        let [x, y] = structure.nodes[node.0].position;
        let [u, v, _] = motion.get(node.0).copied().unwrap_or_default();
        view.at([x + u, y + v])
    };
    for link in &structure.links {
        picture.polyline(&[at(link.a), at(link.b)], Paint::line(colour, 2.0));
    }
    for spring in structure.springs.iter().filter(|s| s.stiffness.iter().any(|k| *k != 0.0)) {
        let (a, b) = (at(spring.a), at(spring.b));
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1.0);
        let across = [-(b[1] - a[1]) / length * 6.0, (b[0] - a[0]) / length * 6.0];
        let zigzag: Vec<Point> = (0..=12)
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
    for mass in structure.masses.iter().filter(|m| m.outline[0] <= 0.0) {
        let [x, y] = at(mass.node);
        picture.circle(x, y, 5.0, Paint::fill(colour));
    }
}

fn draw_ports(picture: &mut Picture, structure: &Structure, view: &View) {
    for port in &structure.ports {
        for node in places(structure, port.plus) {
            let [x, y] = view.at(structure.nodes[node.0].position);
            picture.circle(x, y, 4.5, Paint { fill: "#ffffff", stroke: "#D55E00", width: 2.0, opacity: 1.0 });
            let (align, shift) = if x > WIDTH - 140.0 { (Align::End, -9.0) } else { (Align::Start, 9.0) };
            picture.label(x + shift, y - 8.0, 13.0, align, "#D55E00", &port.name);
        }
    }
}

/// Where a port touches the mechanism: its own node, or the far ends of the resistors (wires) that start at it.
fn places(structure: &Structure, node: NodeId) -> Vec<NodeId> {
    let drawn = |id: &NodeId| structure.nodes[id.0].mechanical;
    if drawn(&node) {
        return vec![node];
    }
    let other_end = |a: NodeId, b: NodeId| if a == node { Some(b) } else { (b == node).then_some(a) };
    structure.resistors.iter().filter_map(|r| other_end(r.a, r.b)).filter(drawn).collect()
}

fn legend(picture: &mut Picture, drawing: &Drawing<'_>, factor: f64, hot: Option<&(String, f64)>, scale: f64, y: f64) {
    let length = nice_step(110.0 / scale / 2.0);
    let x = MARGIN;
    picture.polyline(&[[x, y], [x + length * scale, y]], Paint::line(INK, 3.0));
    picture.text(x, y + 17.0, 12.0, Align::Start, INK, &round_length(length));
    let mut parts = vec!["grey: as drawn".to_owned()];
    if drawing.scale == Scale::Shape {
        parts.push("colour: shape of the mode".to_owned());
    } else if !drawing.motion.is_empty() {
        let times = if factor == 1.0 { "to scale".to_owned() } else { format!("displacements × {factor}") };
        parts.push(format!("colour: deflected, {times}"));
        let largest = drawing.motion.iter().map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max);
        parts.push(format!("largest {}", quantity(largest, "m")));
    }
    if let Some((name, t)) = hot {
        parts.push(format!("hottest: {name} {}", quantity(*t, "K")));
    }
    picture.text(WIDTH - MARGIN, y + 17.0, 12.0, Align::End, INK, &parts.join("  ·  "));
}

fn round_length(length: f64) -> String {
    let (factor, prefix) = super::axis::prefix(length);
    format!("{} {prefix}m", (length / factor * 1e3).round() / 1e3)
}

/// Blue at the coldest to red at the hottest.
fn warm(t: f64, hottest: f64) -> String {
    let s = if hottest > 0.0 { (t / hottest).clamp(0.0, 1.0) } else { 0.0 };
    let mix = |cold: f64, hot: f64| (cold + s * (hot - cold)).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(0.0, 213.0), mix(114.0, 60.0), mix(178.0, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Link, Node};

    /// Small motion is exaggerated by a round factor that the picture states; large motion is shown to scale.
    #[test]
    fn the_factor_is_printed() {
        let node = |x| Node { name: String::new(), position: [x, 0.0], mechanical: true, electrical: false };
        let mut structure = Structure { nodes: vec![node(0.0), node(100e-6)], ..Structure::default() };
        structure.links.push(Link { name: "l".into(), a: NodeId(0), b: NodeId(1) });
        let picture = |v: f64| {
            let motion = [[0.0; 3], [0.0, v, 0.0]];
            let drawing = Drawing {
                structure: &structure,
                title: "t",
                motion: &motion,
                temperatures: &[],
                scale: Scale::Visible,
            };
            draw(&drawing).to_svg()
        };
        assert!(picture(0.3e-6).contains("displacements × 20"));
        assert!(picture(10e-6).contains("to scale"));
        assert!(picture(0.0).contains("to scale"));
    }
}
