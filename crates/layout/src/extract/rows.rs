//! Elements of an extraction as rows of a netlist in any frame: cells placed twice have equal rows in their own frames.

use super::{ExtractedBeam, Extraction, LayerResult, holes, live};

/// Two values are one up to this fraction of them, and to this many metres or radians: rounding of arithmetic, not of a grid.
const VALUE_TOLERANCE: [f64; 2] = [1e-9, 1e-15];

/// Where something is seen from: p ↦ origin + R(angle)·(mirrored ? (x, −y) : (x, y)) leads out of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LocalFrame {
    pub(super) origin: [f64; 2],
    pub(super) angle: f64,
    pub(super) mirrored: bool,
}

impl LocalFrame {
    /// That of the drawing.
    pub(super) const DRAWING: Self = Self { origin: [0.0; 2], angle: 0.0, mirrored: false };

    /// A direction as it is seen from here; exact at quarter turns.
    pub(super) fn direction(&self, d: [f64; 2]) -> [f64; 2] {
        let quarters = self.angle / std::f64::consts::FRAC_PI_2;
        let (s, c) = if (quarters - quarters.round()).abs() < 1e-12 {
            [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters.round().rem_euclid(4.0) as usize % 4]
        } else {
            self.angle.sin_cos()
        };
        let [x, y] = [c * d[0] + s * d[1], c * d[1] - s * d[0]];
        if self.mirrored { [x, -y] } else { [x, y] }
    }

    /// A place as it is seen from here.
    pub(super) fn place(&self, p: [f64; 2]) -> [f64; 2] {
        self.direction([p[0] - self.origin[0], p[1] - self.origin[1]])
    }

    /// This frame as it is seen from another one.
    pub(super) fn within(&self, outer: &Self) -> Self {
        let turned = self.angle - outer.angle;
        Self {
            origin: outer.place(self.origin),
            angle: if outer.mirrored { -turned } else { turned },
            mirrored: self.mirrored != outer.mirrored,
        }
    }
}

/// An element, by its index in the extraction, or by its nodes.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Item {
    Anchor(usize),
    Body(usize),
    Link(usize),
    Root(usize),
    Beam(usize),
    Arc(usize),
    Comb(usize),
    Plates(usize),
    Facing(usize),
    Wire(Vec<usize>),
    Ground(usize),
    Port(String, usize),
}

/// A value of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum RowValue {
    /// Length of a beam (m): a parameter where several share it.
    Long(f64),
    /// Width of a beam (m): a parameter where several share it.
    Wide(f64),
    /// Any other length (m).
    Metres(f64),
    /// Direction (rad); nothing is written along x.
    Turn(f64),
    /// An angle (rad).
    Angle(f64),
    Plain(f64),
    /// A whole number.
    Count(usize),
    /// A word.
    Word(&'static str),
}

impl RowValue {
    fn number(&self) -> f64 {
        match self {
            Self::Long(x) | Self::Wide(x) | Self::Metres(x) | Self::Turn(x) | Self::Angle(x) | Self::Plain(x) => *x,
            Self::Count(n) => *n as f64,
            Self::Word(_) => 0.0,
        }
    }

    /// One but for rounding.
    fn same(&self, other: &Self) -> bool {
        if let (Self::Word(a), Self::Word(b)) = (self, other) {
            return a == b;
        }
        let (a, b) = (self.number(), other.number());
        let turns = matches!(self, Self::Turn(_));
        let off = if turns { (a - b).sin().abs().max(1.0 - (a - b).cos()) } else { (a - b).abs() };
        off <= VALUE_TOLERANCE[0] * if turns { 1.0 } else { a.abs().max(b.abs()) }
            + VALUE_TOLERANCE[1] * f64::from(u8::from(!matches!(self, Self::Plain(_))))
    }
}

/// A line of a netlist.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NetlistRow {
    /// Name of the element; empty: none.
    pub(super) name: String,
    pub(super) model: &'static str,
    pub(super) layer: String,
    pub(super) nodes: Vec<usize>,
    pub(super) values: Vec<(&'static str, RowValue)>,
    pub(super) comment: String,
}

impl NetlistRow {
    /// The same element on other nodes, but for rounding.
    pub(super) fn same(&self, other: &Self) -> bool {
        (&self.name, self.model, &self.layer, &self.comment) == (&other.name, other.model, &other.layer, &other.comment)
            && self.values.len() == other.values.len()
            && self.values.iter().zip(&other.values).all(|((n, a), (m, b))| n == m && a.same(b))
    }
}

impl Extraction {
    /// Nodes of an element.
    pub(super) fn nodes_of(&self, item: &Item) -> Vec<usize> {
        match item {
            Item::Anchor(n) | Item::Ground(n) | Item::Port(_, n) => vec![*n],
            Item::Body(k) => vec![self.bodies[*k].node],
            Item::Link(k) => self.links[*k].to_vec(),
            Item::Root(k) => self.roots[*k].nodes.to_vec(),
            Item::Beam(k) => self.beams[*k].nodes.to_vec(),
            Item::Arc(k) => self.arcs[*k].nodes.to_vec(),
            Item::Comb(k) => self.combs[*k].nodes.to_vec(),
            Item::Plates(k) => self.plates[*k].nodes.to_vec(),
            Item::Facing(k) => self.facing[*k].nodes.to_vec(),
            Item::Wire(nodes) => nodes.clone(),
        }
    }
}

/// An extraction with the layer of each node.
pub(super) struct RowBuilder<'a> {
    found: &'a Extraction,
    layer_of: Vec<Option<usize>>,
}

impl<'a> RowBuilder<'a> {
    pub(super) fn new(found: &'a Extraction) -> Self {
        let mut layer_of = vec![None; found.nodes.len()];
        let pads = found.pads.iter().flat_map(|pad| pad.nodes.iter().map(|n| (*n, pad.layer)));
        let beams = found.beams.iter().flat_map(|b| b.nodes.map(|n| (n, b.layer)));
        let arcs = found.arcs.iter().flat_map(|a| a.nodes.map(|n| (n, a.layer)));
        pads.chain(beams).chain(arcs).for_each(|(n, layer)| layer_of[n] = Some(layer));
        Self { found, layer_of }
    }

    fn between(&self, frame: &LocalFrame, a: usize, b: usize) -> [f64; 2] {
        let [p, q] = [a, b].map(|n| self.found.nodes[n].at);
        frame.direction([q[0] - p[0], q[1] - p[1]])
    }

    /// An element as it is seen from a frame.
    pub(super) fn row(&self, item: &Item, frame: &LocalFrame) -> NetlistRow {
        let none = String::new;
        let row = |model, layer: &str, nodes: Vec<usize>, values| NetlistRow {
            name: none(),
            model,
            layer: layer.to_owned(),
            nodes,
            values,
            comment: none(),
        };
        let name = |layer: usize| self.found.layers[layer].name.as_str();
        match item {
            Item::Anchor(n) => row("anchor", self.layer_at(*n), vec![*n], Vec::new()),
            Item::Wire(nodes) => row("wire", "*", nodes.clone(), Vec::new()),
            Item::Ground(n) => row("eground", "*", vec![*n], Vec::new()),
            Item::Port(port, n) => NetlistRow { name: port.clone(), ..row("port", "*", vec![*n], Vec::new()) },
            Item::Body(k) => {
                let body = &self.found.bodies[*k];
                let values = vec![("A", RowValue::Plain(body.area)), ("Ip", RowValue::Plain(body.polar))];
                row("body2d", name(body.layer), vec![body.node], values)
            }
            Item::Link(k) => {
                let [a, b] = self.found.links[*k];
                let d = self.between(frame, a, b);
                row("link2d", "*", vec![a, b], vec![("l", RowValue::Metres(d[0].hypot(d[1]))), ("oz", turn(d))])
            }
            Item::Root(k) => {
                let root = &self.found.roots[*k];
                let shift = RowValue::Plain(root.shift);
                let along = turn(frame.direction(root.along));
                let values =
                    vec![("kx", shift.clone()), ("ky", shift), ("krz", RowValue::Plain(root.turn)), ("oz", along)];
                row("spring2d", "*", root.nodes.to_vec(), values)
            }
            Item::Beam(k) => self.beam_row(&self.found.beams[*k], frame),
            Item::Arc(k) => {
                let arc = &self.found.arcs[*k];
                // an arc of the language turns to its left
                let left = (arc.angle > 0.0) != frame.mirrored;
                let [a, b] = if left { arc.nodes } else { [arc.nodes[1], arc.nodes[0]] };
                let (d, alpha) = (self.between(frame, a, b), arc.angle.abs());
                let radius = 0.5 * d[0].hypot(d[1]) / (0.5 * alpha).sin();
                let start = d[1].atan2(d[0]) - 0.5 * alpha;
                let values = vec![
                    ("radius", RowValue::Metres(radius)),
                    ("alpha", RowValue::Angle(alpha)),
                    ("w", RowValue::Wide(arc.width)),
                    ("oz", RowValue::Turn(start.sin().atan2(start.cos()))),
                ];
                let mut row = row("arc2d", name(arc.layer), vec![a, b], values);
                row.values.extend(perforated(&self.found.layers[arc.layer], arc.porosity, false));
                row
            }
            Item::Comb(k) => {
                let comb = &self.found.combs[*k];
                let d = self.between(frame, comb.nodes[0], comb.nodes[1]);
                let values = vec![
                    ("N", RowValue::Count(comb.gaps)),
                    ("gap", RowValue::Metres(comb.gap)),
                    ("w", RowValue::Metres(comb.width)),
                    ("l", RowValue::Metres(comb.overlap)),
                    // the other side lies at 2·L − l
                    ("L", RowValue::Metres(0.5 * (d[0].hypot(d[1]) + comb.overlap))),
                    ("oz", turn(d)),
                ];
                let comment = format!("{} and {} fingers", comb.fingers[0], comb.fingers[1]);
                NetlistRow { comment, ..row("comb2de", name(comb.layer), comb.nodes.to_vec(), values) }
            }
            Item::Plates(k) => {
                let plates = &self.found.plates[*k];
                let [a, b] = plates.nodes;
                let nodes = if backwards(self.between(frame, a, b)) { [b, a] } else { [a, b] };
                let d = self.between(frame, nodes[0], nodes[1]);
                let values = vec![
                    ("l", RowValue::Metres(plates.sides[0])),
                    ("w", RowValue::Metres(plates.sides[1])),
                    ("h", RowValue::Metres(plates.depth)),
                    ("gap", RowValue::Metres(plates.gap)),
                    ("electrode", RowValue::Word("bar")),
                    ("oz", turn(d)),
                ];
                row("plategap2d", name(plates.layer), nodes.to_vec(), values)
            }
            Item::Facing(k) => {
                let facing = &self.found.facing[*k];
                let [a, b, c, d] = facing.nodes;
                // the lower one lies to the right of the way along the upper
                let nodes = if frame.mirrored { [b, a, d, c] } else { facing.nodes };
                let along = self.between(frame, nodes[0], nodes[1]);
                let values = vec![
                    ("l", RowValue::Metres(along[0].hypot(along[1]))),
                    ("w1", RowValue::Metres(facing.width[0])),
                    ("w2", RowValue::Metres(facing.width[1])),
                    ("gap", RowValue::Metres(facing.gap)),
                    ("oz", turn(along)),
                ];
                row("gap2dforce", name(facing.layer), nodes.to_vec(), values)
            }
        }
    }

    /// A beam from left to right, or upwards.
    fn beam_row(&self, beam: &ExtractedBeam, frame: &LocalFrame) -> NetlistRow {
        let ([mut a, mut b], mut width) = (beam.nodes, beam.width);
        let mut d = self.between(frame, a, b);
        let long = d[0].hypot(d[1]);
        if backwards(d) {
            (a, b) = (b, a);
            width.reverse();
            d = d.map(|x| -x);
        }
        let layer = &self.found.layers[beam.layer];
        let live = if self.found.carries(a) { live::model(layer) } else { None };
        let mut values = vec![("l", RowValue::Long(long))];
        let taper = live.is_none() && live::tapers(width);
        if taper {
            values.extend([("w1", RowValue::Wide(width[0])), ("w2", RowValue::Wide(width[1]))]);
        } else {
            values.push(("w", RowValue::Wide(0.5 * (width[0] + width[1]))));
        }
        values.push(("oz", turn(d)));
        values.extend(perforated(layer, beam.porosity, live.is_some()));
        let model = live.unwrap_or(if taper { "taper2d" } else { "beam2d" });
        NetlistRow {
            name: String::new(),
            model,
            layer: layer.name.clone(),
            nodes: vec![a, b],
            values,
            comment: String::new(),
        }
    }

    /// The layer of a node.
    fn layer_at(&self, node: usize) -> &str {
        self.layer_of[node].map_or("*", |k| self.found.layers[k].name.as_str())
    }
}

/// From right to left, or downwards.
fn backwards(d: [f64; 2]) -> bool {
    let tiny = 1e-9 * d[0].hypot(d[1]);
    d[0] < -tiny || (d[0] <= tiny && d[1] < 0.0)
}

fn turn(d: [f64; 2]) -> RowValue {
    RowValue::Turn(d[1].atan2(d[0]))
}

/// Factors of etch holes on a beam's stiffness, mass and film, and on its conduction.
fn perforated(layer: &LayerResult, porosity: f64, conducts: bool) -> Vec<(&'static str, RowValue)> {
    if porosity <= 0.0 {
        return Vec::new();
    }
    let solid =
        [("Youngsmodulus", holes::stiffness(porosity)), ("density", 1.0 - porosity), ("viscosity", 1.0 - porosity)];
    let conduction = live::perforated(porosity).into_iter().filter(|_| conducts);
    let known = |name: &str| layer.material.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
    let changed = solid.into_iter().chain(conduction);
    changed.filter_map(|(name, factor)| Some((name, RowValue::Plain(known(name)? * factor)))).collect()
}
