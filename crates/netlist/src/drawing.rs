//! The structure under construction, with what is needed to place its nodes.

use super::source::TextSpan;
use bimorph_base::budget;
use bimorph_structure::{Beam, Node, NodeId, Structure};
use rustc_hash::FxHashSet;

/// Of a node without its name, about (byte).
const NODE_BYTES: usize = 200;
/// Of an element without its name, about (byte).
pub(crate) const ELEMENT_BYTES: usize = 400;
/// Nodes and beams that room is made for at first.
const ROOM: usize = 32;
/// How often a model and its description hold a name.
pub(crate) const NAME_COPIES: usize = 4;

/// How one element fixes the positions of its nodes relative to each other.
#[derive(Debug, Clone)]
pub(crate) struct ElementPlacement {
    /// The element's place in the text, for messages.
    pub(crate) span: TextSpan,
    /// Its first node in [`StructureBuilder::placed`], and how many there are.
    first: usize,
    count: usize,
}

/// A node, and its position relative to the first of the element (m), global axes.
pub(crate) type NodeOffset = (NodeId, [f64; 2]);

/// A beam that takes its length and direction from the positions of its nodes.
#[derive(Debug, Clone)]
pub(crate) struct Unmeasured {
    pub(crate) span: TextSpan,
    /// Index into [`Structure::beams`].
    pub(crate) beam: usize,
}

/// Facts that are worth one message for the whole netlist: the first place and how many there were.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fact {
    /// beam3d: out-of-plane bending and torsion are left out.
    OutOfPlane,
    /// A layer's strain gradient is not zero.
    StrainGradient,
    /// A temperature is given while the ambient temperature is 0 or missing.
    AmbientZero,
    /// Beams or plates without a density.
    NoDensity,
    /// A Young's modulus that is no solid's, as in GPa by mistake.
    OddModulus,
    /// A layer's thermal conductivity is too small to be one.
    SmallConductivity,
    /// An angle of whole degrees beyond a full turn in radians.
    Degrees,
    /// A density that is no solid's, as in g/cm³ by mistake.
    OddDensity,
    /// A residual stress beyond what any solid bears.
    OddStress,
    /// A temperature at which no structural solid is one.
    OddRise,
    /// Capacitors, which are open in statics and are left out.
    Capacitor,
    /// Current sources and amplifiers, which take no part in the model.
    ActiveCircuit,
    /// Switches, which are open.
    Switch,
    /// Members out of the plane that join anchored nodes.
    BetweenAnchors,
    /// Members normal to the plane that are taken as rigid; the number is the stiffness across one of them (N/m).
    Post,
    /// Weights that are left out; the number is one of them (N).
    Weight,
    /// Beams without a section.
    NoSection,
    /// Gaps whose permittivity is below that of vacuum.
    ReducedPermittivity,
    /// Gaps of models that SUGAR's tree holds as trials.
    TrialGap,
    /// Nodes after the first of an anchor.
    AnchorNodes,
    /// Trapezoidal sections.
    Trapezoid,
    /// rigidlinkbeam with arms; the number is the longest arm (m).
    ArmsPlace,
}

/// A fact with where it was first met, how often, and its number there (a temperature, a conductivity).
#[derive(Debug, Clone, Copy)]
pub(crate) struct NotedFact {
    pub(crate) fact: Fact,
    pub(crate) span: TextSpan,
    pub(crate) count: usize,
    pub(crate) number: f64,
}

/// A member that leaves the drawing plane.
#[derive(Debug, Clone)]
pub(crate) struct Upright {
    pub(crate) span: TextSpan,
    pub(crate) name: String,
    pub(crate) nodes: [NodeId; 2],
    /// Normal to the plane and stouter than long.
    pub(crate) post: bool,
    /// Transverse stiffness of the same beam as a cantilever (N/m).
    pub(crate) stiffness: f64,
    /// Its axis lies in the plane, its section is askew.
    pub(crate) tilted: bool,
}

/// Structure, placements and facts gathered while elements are built.
#[derive(Debug, Default)]
pub(crate) struct StructureBuilder {
    pub(crate) structure: Structure,
    pub(crate) placements: Vec<ElementPlacement>,
    /// The nodes of all of them.
    placed: Vec<NodeOffset>,
    pub(crate) unmeasured: Vec<Unmeasured>,
    /// Members that leave the plane, until the anchors are known.
    pub(crate) upright: Vec<Upright>,
    /// In order of appearance.
    pub(crate) facts: Vec<NotedFact>,
    /// Nodes at electrical ground, and names of ports, so far.
    pub(crate) grounded: FxHashSet<NodeId>,
    pub(crate) port_names: FxHashSet<String>,
    /// Where each node was first named.
    pub(crate) first_named: Vec<TextSpan>,
    /// Where each beam was drawn.
    pub(crate) beam_spans: Vec<TextSpan>,
    /// Whether the layer of a beam has an ambient temperature.
    pub(crate) warm_beams: bool,
}

impl StructureBuilder {
    /// Nothing drawn yet, with room for a small part.
    pub(crate) fn new() -> Self {
        let mut drawing = Self::default();
        drawing.structure.nodes.reserve(ROOM);
        drawing.structure.beams.reserve(ROOM);
        drawing.beam_spans.reserve(ROOM);
        drawing.placements.reserve(2 * ROOM);
        drawing.placed.reserve(4 * ROOM);
        drawing.first_named.reserve(ROOM);
        drawing
    }

    /// A new node.
    pub(crate) fn add_node(&mut self, name: String, span: TextSpan) -> NodeId {
        budget::lay_out(NODE_BYTES + NAME_COPIES * name.len());
        self.structure.nodes.push(Node { name, position: [0.0; 2], mechanical: false, electrical: false });
        self.first_named.push(span);
        NodeId(self.structure.nodes.len() - 1)
    }

    /// Marks nodes as mechanical and records how they lie.
    pub(crate) fn place(&mut self, span: TextSpan, nodes: &[NodeId], offsets: &[[f64; 2]]) {
        self.mechanical(nodes);
        self.lay(span, nodes, offsets);
    }

    /// Records how nodes lie; they may be mere points of the drawing.
    pub(crate) fn lay(&mut self, span: TextSpan, nodes: &[NodeId], offsets: &[[f64; 2]]) {
        self.placements.push(ElementPlacement { span, first: self.placed.len(), count: nodes.len() });
        self.placed.extend(nodes.iter().copied().zip(offsets.iter().copied()));
    }

    /// The nodes that an element places.
    pub(crate) fn placed_by(&self, placement: &ElementPlacement) -> &[NodeOffset] {
        &self.placed[placement.first..placement.first + placement.count]
    }

    pub(crate) fn mechanical(&mut self, nodes: &[NodeId]) {
        for node in nodes {
            self.structure.nodes[node.0].mechanical = true;
        }
    }

    pub(crate) fn electrical(&mut self, nodes: &[NodeId]) {
        for node in nodes {
            self.structure.nodes[node.0].electrical = true;
        }
    }

    /// Adds a beam and its placement; without a length it is measured once the nodes are placed.
    pub(crate) fn add_beam(&mut self, span: TextSpan, beam: Beam, measured: bool) {
        let (a, b) = (beam.a, beam.b);
        if measured {
            let (s, c) = beam.angle.sin_cos();
            self.place(span, &[a, b], &[[0.0; 2], [beam.length * c, beam.length * s]]);
        } else {
            self.mechanical(&[a, b]);
            self.unmeasured.push(Unmeasured { span, beam: self.structure.beams.len() });
        }
        self.structure.beams.push(beam);
        self.beam_spans.push(span);
    }

    /// How many facts have been noted.
    pub(crate) fn noted(&self) -> usize {
        self.facts.iter().map(|noted| noted.count).sum()
    }

    pub(crate) fn note(&mut self, fact: Fact, span: TextSpan) {
        self.note_number(fact, span, 0.0);
    }

    pub(crate) fn note_number(&mut self, fact: Fact, span: TextSpan, number: f64) {
        match self.facts.iter_mut().find(|noted| noted.fact == fact) {
            Some(noted) => noted.count += 1,
            None => self.facts.push(NotedFact { fact, span, count: 1, number }),
        }
    }
}
