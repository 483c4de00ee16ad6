//! Outlines of a mechanism's parts, as drawn by `bimorph layout`.
//!
//! A beam is a rectangle between its nodes, extended at junctions so that the outer edges meet in a corner. A plate is
//! a rectangle, and an anchor a pad of its layer with the anchor mask inside. A comb has one finger more than gaps and
//! a spine on either side. A field between facing beams is drawn as the electrode that no beam represents. Lumped
//! parts, links, loads and circuits have no outline.

use super::lines::{ElementLine, ElementLines};
use super::process::Process;
use bimorph_structure::DomainElement;
use std::collections::HashMap;

/// Pads whose sizes are not given (m).
const PAD: f64 = 10e-6;
/// The mask of anchors lies inside its pad by this fraction of the pad's smaller side (1).
const INSET: f64 = 0.1;
/// A corner is closed up to this many half widths behind its node.
const LONGEST_CORNER: f64 = 2.0;
/// Spines of combs, in widths of a finger (1).
const SPINE: f64 = 2.0;
/// Most fingers that are drawn of one comb.
const MAX_FINGERS: f64 = 10_000.0;

/// Function of an outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Role {
    /// Part of a layer that moves, by index in the process.
    Layer(usize),
    /// The anchored layer, by index.
    Anchor(usize),
}

/// Outlines of a mechanism.
#[derive(Debug, Default)]
pub(crate) struct Figure {
    /// Contours (m), counter-clockwise.
    pub(crate) shapes: Vec<(Role, Vec<[f64; 2]>)>,
    /// The layer of each node that a drawn part touches.
    pub(crate) layer_of: HashMap<String, usize>,
    /// Parts that were omitted or drawn differently from the mechanism.
    pub(crate) notes: Vec<String>,
}

/// A beam's end: where it is and where the beam goes from there.
struct BeamEnd {
    half: f64,
    /// Away from the node, along the beam.
    direction: [f64; 2],
}

/// True for models that are drawn as beams.
pub(crate) fn is_beam(model: &str) -> bool {
    matches!(model, "beam2d" | "beam2de" | "beam2det")
}

/// Draws lines whose nodes lie at these places (m).
pub(crate) fn draw(lines: &ElementLines, at: &HashMap<String, [f64; 2]>, process: &Process) -> Figure {
    let mut drawing =
        Draw { lines, at, process, figure: Figure::default(), layers: HashMap::new(), ends: HashMap::new() };
    drawing.choose_layers();
    drawing.beams_and_plates();
    drawing.anchors();
    drawing.fields();
    drawing.report();
    drawing.figure
}

struct Draw<'a> {
    lines: &'a ElementLines,
    at: &'a HashMap<String, [f64; 2]>,
    process: &'a Process,
    figure: Figure,
    /// Layer of each process of the lines.
    layers: HashMap<&'a str, usize>,
    ends: HashMap<&'a str, Vec<BeamEnd>>,
}

fn unit(a: [f64; 2], b: [f64; 2]) -> ([f64; 2], f64) {
    let d = [b[0] - a[0], b[1] - a[1]];
    let l = d[0].hypot(d[1]);
    if l > 0.0 { ([d[0] / l, d[1] / l], l) } else { ([1.0, 0.0], 0.0) }
}

/// A rectangle from `p` along `d` by `l`, half as wide to either side.
fn bar(p: [f64; 2], d: [f64; 2], l: f64, half: f64) -> Vec<[f64; 2]> {
    let q = [p[0] + l * d[0], p[1] + l * d[1]];
    let n = [-d[1] * half, d[0] * half];
    vec![[p[0] - n[0], p[1] - n[1]], [q[0] - n[0], q[1] - n[1]], [q[0] + n[0], q[1] + n[1]], [p[0] + n[0], p[1] + n[1]]]
}

fn ahead(p: [f64; 2], d: [f64; 2], s: f64) -> [f64; 2] {
    [p[0] + s * d[0], p[1] + s * d[1]]
}

fn turned(angle: f64) -> [f64; 2] {
    // Multiples of a quarter turn, as netlists write them, are exact.
    let quarter = angle / std::f64::consts::FRAC_PI_2;
    if (quarter - quarter.round()).abs() < 1e-12 {
        return [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]][quarter.round().rem_euclid(4.0) as usize % 4];
    }
    [angle.cos(), angle.sin()]
}

impl<'a> Draw<'a> {
    fn place(&self, node: &str) -> [f64; 2] {
        self.at.get(node).copied().unwrap_or([0.0; 2])
    }

    /// The layer of the process for each process of the lines: the one of its thickness, else the first.
    fn choose_layers(&mut self) {
        for p in &self.lines.processes {
            let h = p.entries.iter().find(|(n, _)| n == "h").map_or(0.0, |(_, v)| *v);
            let fits = |t: f64| (t - h).abs() <= 1e-6 * h;
            let found = self.process.layers.iter().position(|l| fits(l.thickness));
            if found.is_none() {
                let known: Vec<String> = self
                    .process
                    .layers
                    .iter()
                    .map(|l| format!("{} {} µm", l.name, rounded(l.thickness * 1e6)))
                    .collect();
                let first = &self.process.layers[0].name;
                self.figure.notes.push(format!(
                    "no layer of `{}` is {} µm thick ({}): what is was drawn on {first}",
                    self.process.name,
                    rounded(h * 1e6),
                    known.join(", ")
                ));
            }
            self.layers.insert(&p.name, found.unwrap_or(0));
        }
    }

    fn layer(&mut self, line: &'a ElementLine) -> usize {
        let own = self.layers.get(line.process.as_str()).copied();
        let layer =
            own.or_else(|| line.nodes.iter().find_map(|n| self.figure.layer_of.get(n.as_str()).copied())).unwrap_or(0);
        for node in &line.nodes {
            self.figure.layer_of.entry(node.clone()).or_insert(layer);
        }
        layer
    }

    fn beams_and_plates(&mut self) {
        let lines = self.lines;
        for line in lines.elements.iter().filter(|l| is_beam(&l.model) && l.nodes.len() == 2) {
            let (a, b) = (self.place(&line.nodes[0]), self.place(&line.nodes[1]));
            let (d, _) = unit(a, b);
            let half = line.get("w").unwrap_or(0.0) / 2.0;
            self.ends.entry(&line.nodes[0]).or_default().push(BeamEnd { half, direction: d });
            self.ends.entry(&line.nodes[1]).or_default().push(BeamEnd { half, direction: [-d[0], -d[1]] });
        }
        for line in &lines.elements {
            if is_beam(&line.model) && line.nodes.len() == 2 {
                let layer = self.layer(line);
                let (a, b) = (self.place(&line.nodes[0]), self.place(&line.nodes[1]));
                let (d, l) = unit(a, b);
                let half = line.get("w").unwrap_or(0.0) / 2.0;
                let before = self.corner(&line.nodes[0], d, half);
                let behind = self.corner(&line.nodes[1], [-d[0], -d[1]], half);
                let shape = bar(ahead(a, d, -before), d, l + before + behind, half);
                self.figure.shapes.push((Role::Layer(layer), shape));
            } else if line.model == "gap2d" && line.nodes.len() == 4 {
                let layer = self.layer(line);
                for (k, w) in [(0, "w1"), (2, "w2")] {
                    let (a, b) = (self.place(&line.nodes[k]), self.place(&line.nodes[k + 1]));
                    let (d, l) = unit(a, b);
                    let shape = bar(a, d, l, line.get(w).unwrap_or(0.0) / 2.0);
                    self.figure.shapes.push((Role::Layer(layer), shape));
                }
            } else if line.model == "plate2d" {
                let layer = self.layer(line);
                let (l, w) = (line.get("l").unwrap_or(0.0), line.get("w").unwrap_or(0.0));
                let d = turned(line.get("oz").unwrap_or(0.0));
                let shape = bar(ahead(self.place(&line.nodes[0]), d, -l / 2.0), d, l, w / 2.0);
                self.figure.shapes.push((Role::Layer(layer), shape));
            }
        }
    }

    /// Extension of a beam that leaves its node along `d` behind it, for its edges to meet those of the others.
    fn corner(&self, node: &str, d: [f64; 2], half: f64) -> f64 {
        let others = self.ends.get(node).into_iter().flatten();
        let needed = others.map(|other| {
            // The turn from this beam, coming in, to the other one, going out.
            let (cos, sin) = (
                -(d[0] * other.direction[0] + d[1] * other.direction[1]),
                (d[0] * other.direction[1] - d[1] * other.direction[0]).abs(),
            );
            if sin < 1e-9 { 0.0 } else { ((other.half - half * cos) / sin).min(LONGEST_CORNER * other.half) }
        });
        needed.fold(0.0, f64::max)
    }

    fn anchors(&mut self) {
        let lines = self.lines;
        for line in lines.elements.iter().filter(|l| l.model == "anchor") {
            let layer = self.layer(line);
            let (l, w) = (line.get("l").unwrap_or(PAD), line.get("w").unwrap_or(PAD));
            let d = turned(line.get("oz").unwrap_or(0.0));
            let p = self.place(&line.nodes[0]);
            let inset = INSET * l.min(w);
            self.figure.shapes.push((Role::Layer(layer), bar(p, d, l, w / 2.0)));
            self.figure
                .shapes
                .push((Role::Anchor(layer), bar(ahead(p, d, inset), d, l - 2.0 * inset, w / 2.0 - inset)));
        }
    }

    fn fields(&mut self) {
        let lines = self.lines;
        let beams: std::collections::HashSet<[&str; 2]> = lines
            .elements
            .iter()
            .filter(|l| is_beam(&l.model) && l.nodes.len() == 2)
            .flat_map(|l| [[l.nodes[0].as_str(), &l.nodes[1]], [&l.nodes[1], &l.nodes[0]]])
            .collect();
        for line in &lines.elements {
            if line.model == "gap2dforce" && line.nodes.len() == 4 {
                let layer = self.layer(line);
                for (k, w) in [(0, "w1"), (2, "w2")] {
                    let ends = [line.nodes[k].as_str(), line.nodes[k + 1].as_str()];
                    if beams.contains(&ends) {
                        continue;
                    }
                    let (a, b) = (self.place(ends[0]), self.place(ends[1]));
                    let (d, l) = unit(a, b);
                    self.figure.shapes.push((Role::Layer(layer), bar(a, d, l, line.get(w).unwrap_or(0.0) / 2.0)));
                }
            } else if matches!(line.model.as_str(), "comb2d" | "comb2de") && line.nodes.len() == 2 {
                let layer = self.layer(line);
                self.comb(line, layer);
            }
        }
    }

    /// Parallel fingers, alternating between the two sides.
    fn comb(&mut self, line: &ElementLine, layer: usize) {
        let get = |name: &str| line.get(name).unwrap_or(0.0);
        let (gap, length, gaps) = (get("gap"), get("L"), get("N"));
        let width = line.get("w").unwrap_or(gap);
        let fingers = (gaps.round().clamp(1.0, MAX_FINGERS) as usize) + 1;
        if gaps.fract() != 0.0 || gaps > MAX_FINGERS {
            self.figure.notes.push(format!("the comb `{}` has {gaps} gaps: {} were drawn", line.name, fingers - 1));
        }
        let d = turned(get("oz"));
        let (a, b) = (self.place(&line.nodes[0]), self.place(&line.nodes[1]));
        let pitch = width + gap;
        let spine = SPINE * width;
        let side = [-d[1], d[0]];
        let first = -pitch * (fingers - 1) as f64 / 2.0;
        let across = |p: [f64; 2], s: f64| ahead(p, side, s);
        for k in 0..fingers {
            let s = first + pitch * k as f64;
            let (root, towards) = if k % 2 == 0 { (a, d) } else { (b, [-d[0], -d[1]]) };
            self.figure.shapes.push((Role::Layer(layer), bar(across(root, s), towards, length, width / 2.0)));
        }
        let half = (pitch * (fingers - 1) as f64 + width) / 2.0;
        for (root, towards) in [(a, d), (b, [-d[0], -d[1]])] {
            self.figure.shapes.push((Role::Layer(layer), bar(ahead(root, towards, -spine), towards, spine, half)));
        }
    }

    fn report(&mut self) {
        let mut missing: HashMap<&str, usize> = HashMap::new();
        for line in &self.lines.elements {
            let lumped =
                matches!(line.model.as_str(), "link2d" | "spring2d" | "damper2d" | "mass2d" | "plategap2d" | "stop2d");
            if lumped || DomainElement::ALL.iter().any(|element| element.name == line.model) {
                *missing.entry(line.model.as_str()).or_insert(0) += 1;
            }
        }
        let mut all: Vec<_> = missing.into_iter().collect();
        all.sort_unstable();
        for (model, count) in all {
            self.figure.notes.push(format!("{count} {model} {} no outline", if count == 1 { "has" } else { "have" }));
        }
    }
}

fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}
