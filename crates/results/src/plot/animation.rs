//! A page on which the mechanism moves: its modes swing, or a motion in time plays under a slider. It needs nothing else.
//!
//! Displacements travel as whole numbers of a ten-thousandth of the largest one, so that a page stays small.

use super::parts::bounds;
use super::shapes::{DisplacedShape, NodeDisplacement, PlanePoint, comb_outlines, plate_outline, rectangle};
use super::svg::escape;
use bimorph_structure::Structure;
use std::fmt::Write;

const SCRIPT: &str = include_str!("animation.js");
/// Whole numbers that stand for the largest displacement.
const COUNTS: f64 = 1e4;
/// Fraction of the mechanism's size that the largest displacement becomes.
const DISPLACED_FRACTION: f64 = 0.07;

/// One state of the mechanism: an instant, or a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct AnimationFrame {
    /// Its time or frequency, for the reader.
    pub label: String,
    /// Displacement of each node by [`bimorph_structure::NodeId`].
    pub nodes: Vec<NodeDisplacement>,
    /// Displacement of points along each beam, equally spaced, ends included; empty: of its ends alone.
    pub curves: Vec<Vec<NodeDisplacement>>,
}

/// How frames follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Play {
    /// Each swings by itself; the slider chooses one.
    Modes,
    /// They are a motion in time; the slider is the time.
    Time,
}

/// The page.
pub fn page(structure: &Structure, title: &str, play: Play, frames: &[AnimationFrame]) -> String {
    let data = data(structure, play, frames);
    let (title, slider) = (escape(title), if play == Play::Time { "time" } else { "mode" });
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>\n\
         body{{margin:1.5em auto;max-width:62em;font:15px DejaVu Sans,Verdana,sans-serif;color:#333}}\n\
         canvas{{width:100%;display:block}}\nh1{{font-size:1.1em;font-weight:normal}}\n\
         .row{{display:flex;gap:1em;align-items:center;margin:.6em 0;flex-wrap:wrap}}\n#slider{{flex:1}}\n\
         #label{{min-width:9em;font-variant-numeric:tabular-nums}}button{{width:5em}}\n</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n<canvas></canvas>\n\
         <div class=\"row\"><button id=\"play\">Pause</button>\
         <input id=\"slider\" type=\"range\" min=\"0\" aria-label=\"{slider}\"><span id=\"label\"></span></div>\n\
         <div class=\"row\"><label>smaller <input id=\"factor\" type=\"range\" min=\"-50\" max=\"50\" value=\"0\"> larger\
         </label><span id=\"times\"></span><span>grey: as drawn</span></div>\n\
         <script>\nconst D = {data};\n{SCRIPT}</script>\n</body>\n</html>\n"
    )
}

/// The structure and its motion as JSON. Lengths are in micrometres.
fn data(structure: &Structure, play: Play, frames: &[AnimationFrame]) -> String {
    let mut points: Vec<PlanePoint> = structure.nodes.iter().map(|n| n.position).collect();
    let inner = |beam: usize| frames.first().and_then(|f| f.curves.get(beam)).map_or(0, |c| c.len().saturating_sub(2));
    let mut beams = Vec::new();
    for (index, beam) in structure.beams.iter().enumerate() {
        let [a, b] = [beam.a.0, beam.b.0].map(|n| structure.nodes[n].position);
        let mut along = vec![beam.a.0];
        for k in 1..=inner(index) {
            let s = k as f64 / (inner(index) + 1) as f64;
            along.push(points.len());
            points.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
        }
        along.push(beam.b.0);
        beams.push(format!("{{\"w\":{},\"p\":{along:?}}}", micro(beam.width)));
    }
    let largest = |d: usize| {
        let all = frames.iter().flat_map(|f| f.nodes.iter().chain(f.curves.iter().flatten()));
        all.map(|m| if d == 2 { m[2].abs() } else { m[0].abs().max(m[1].abs()) }).fold(0.0, f64::max)
    };
    let unit = [largest(0), largest(0), largest(2)].map(|x| if x > 0.0 { x / COUNTS } else { 1.0 });
    let count = |m: &NodeDisplacement| format!("{:.0},{:.0},{:.0}", m[0] / unit[0], m[1] / unit[1], m[2] / unit[2]);
    let rows: Vec<String> = frames
        .iter()
        .map(|frame| {
            let mut row: Vec<String> = frame.nodes.iter().map(count).collect();
            for (index, curve) in frame.curves.iter().enumerate() {
                row.extend(curve.iter().skip(1).take(inner(index)).map(count));
            }
            format!("[{}]", row.join(",").replace("-0,", "0,"))
        })
        .collect();
    let rest = DisplacedShape::default();
    let areas = super::parts::outlines(structure, &rest);
    let (low, high) = bounds(areas.iter().flat_map(|o| o.shape.iter().copied()), structure);
    let extent = (high[0] - low[0]).max(high[1] - low[1]).max(f64::MIN_POSITIVE);
    let room = 1.3 * DISPLACED_FRACTION * extent;
    let frame = [low[0] - room, low[1] - room, high[0] + room, high[1] + room].map(micro).join(",");
    let factor = if largest(0) > 0.0 { DISPLACED_FRACTION * extent / largest(0) } else { 1.0 };
    let (bodies, fixed) = rigid(structure, 0.02 * extent);
    let labels: Vec<String> = frames.iter().map(|f| format!("\"{}\"", f.label.replace(['"', '\\'], ""))).collect();
    let links: Vec<String> = structure.links.iter().map(|l| format!("[{},{}]", l.a.0, l.b.0)).collect();
    let points: Vec<String> = points.iter().map(|p| pair(*p)).collect();
    format!(
        "{{\"time\":{},\"factor\":{factor:.4e},\"unit\":[{:.6e},{:.6e},{:.6e}],\"bounds\":[{frame}],\n\"points\":[{}],\n\
         \"beams\":[{}],\n\"links\":[{}],\n\"bodies\":[{bodies}],\n\"fixed\":[{fixed}],\n\"labels\":[{}],\n\"frames\":[{}]}}",
        play == Play::Time,
        unit[0] * 1e6,
        unit[1] * 1e6,
        unit[2],
        points.join(","),
        beams.join(","),
        links.join(","),
        labels.join(","),
        rows.join(",\n")
    )
}

/// Areas that move with a node, relative to it, and areas that stand still.
fn rigid(structure: &Structure, symbol: f64) -> (String, String) {
    let (mut bodies, mut fixed) = (Vec::new(), Vec::new());
    let moving = |node: usize, shape: Vec<PlanePoint>| {
        let [x, y] = structure.nodes[node].position;
        let relative: Vec<String> = shape.iter().map(|p| pair([p[0] - x, p[1] - y])).collect();
        format!("{{\"at\":{node},\"shape\":[{}]}}", relative.join(","))
    };
    let standing = |shape: Vec<PlanePoint>, pad: bool| {
        let corners: Vec<String> = shape.iter().map(|p| pair(*p)).collect();
        format!("{{\"pad\":{pad},\"shape\":[{}]}}", corners.join(","))
    };
    for support in structure.supports.iter().filter(|s| s.held == [true; 3]) {
        let at = structure.nodes[support.node.0].position;
        fixed.push(standing(rectangle(at, support.angle, [-symbol, symbol], [-symbol, symbol]), true));
    }
    for mass in &structure.masses {
        bodies
            .extend(plate_outline(structure, mass, &DisplacedShape::default()).map(|shape| moving(mass.node.0, shape)));
    }
    for comb in &structure.combs {
        let (rotor, stator) = comb_outlines(structure, comb, &DisplacedShape::default());
        bodies.extend(rotor.into_iter().map(|shape| moving(comb.a.0, shape)));
        fixed.extend(stator.into_iter().map(|shape| standing(shape, false)));
    }
    (bodies.join(","), fixed.join(","))
}

fn pair(p: PlanePoint) -> String {
    format!("[{},{}]", micro(p[0]), micro(p[1]))
}

/// Micrometres with three decimals at most.
fn micro(x: f64) -> String {
    let mut text = String::new();
    let _ = write!(text, "{:.3}", x * 1e6);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_structure::{Link, Node, NodeId};

    /// The page names nothing outside itself, its data is JSON, and names from a netlist cannot leave their place.
    #[test]
    fn a_page_needs_nothing_else() {
        let node = |x| Node { name: String::new(), position: [x, 0.0], mechanical: true, electrical: false };
        let mut structure = Structure { nodes: vec![node(0.0), node(100e-6)], ..Structure::default() };
        structure.links.push(Link { name: "l".into(), a: NodeId(0), b: NodeId(1) });
        let frame = |v: f64| AnimationFrame {
            label: "1 \"µs\"".into(),
            nodes: vec![[0.0; 3], [0.0, v, -1e-3]],
            curves: vec![],
        };
        let frames = [frame(0.0), frame(1e-6)];
        let page = page(&structure, "</title>", Play::Time, &frames);
        assert!(!page.contains("http") && !page.contains("src=") && page.contains("&lt;/title&gt;"));
        let parsed: serde_json::Value = serde_json::from_str(&data(&structure, Play::Time, &frames)).unwrap();
        assert_eq!(parsed["points"][1][0], 100);
        assert_eq!(parsed["frames"][1][4], COUNTS as i64);
        assert_eq!(parsed["frames"][0][3], 0);
    }
}
