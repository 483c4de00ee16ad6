//! The structure: nodes, materials, beams, plates, anchors, gaps, combs and ports, in SI units.
//!
//! A [`Structure`] is planar (x, y, rotation about z), knows nothing of bodies or joints, and is never changed after it
//! was built. Node positions are those of the drawn geometry. Everything refers to nodes by [`NodeId`].
//!
//! A node may be mechanical (it has a position), electrical (it has a potential), or both: as in SUGAR, one netlist name
//! stands for the mechanical point and for the electrical net at that point.
//!
//! [`FrontEnd`] is what a language gives: a structure for the values of its parameters. [`DomainElement`] lists the elements that only
//! one domain reads.
//!
//! **Architecture invariant.** Only [`bimorph_base`] lies below. A structure has no bodies, joints, meshes or text of a
//! netlist.

mod beam_rows;
mod circuit;
mod domain_element;
mod front_end;
mod gap;
mod index;
mod mechanical;
mod network;
mod node;
mod placed;
mod property_curve;
mod without_circuit;

pub use beam_rows::{ALIKE, BeamRows};
pub use circuit::{CircuitElement, CircuitKind};
pub use domain_element::DomainElement;
pub use front_end::{FrontEnd, LoadedNetlist, ReadFunction};
pub use gap::{
    Adhesion, BeamGap, Comb, ElectrodeShape, FacingGas, FilmSlit, Friction, Fringe, GapVoltage, IMPACT_SPEEDS, Impact,
    InsulatingLayer, MAX_FILM_STATES, MAX_STICK_STIFFNESS, MIN_RESTITUTION, OhmicContact, Perforation, PlateGap, Stop,
    TOUCH, touching_distance,
};
pub use index::NodeIndex;
pub use mechanical::{
    ANCHOR_MOTIONS, AnchorMotion, Beam, GasLoss, Heater, Link, Load, MOLTEN, Mass, Material, Pad, SolidHeat,
    SpringDamper, Support, Yield, is_anchor_motion,
};
pub use network::{Port, Resistor, VoltageSource, Wire};
pub use node::{Node, NodeId};
pub use placed::PlacedElement;
pub use property_curve::{CurveFault, PropertyCurve};

use serde::{Deserialize, Serialize};

/// A whole drawing. See the module for the conventions.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// All nodes, in order of appearance.
    pub nodes: Vec<Node>,
    /// Flexible beams.
    pub beams: Vec<Beam>,
    /// Plates and lumped masses.
    pub masses: Vec<Mass>,
    /// Rigid links.
    pub links: Vec<Link>,
    /// Anchors, guides and other supports.
    pub supports: Vec<Support>,
    /// Pads of anchors whose sizes are given.
    #[serde(default)]
    pub pads: Vec<Pad>,
    /// Lumped springs and dampers.
    pub springs: Vec<SpringDamper>,
    /// Dead loads.
    pub loads: Vec<Load>,
    /// Comb drives.
    pub combs: Vec<Comb>,
    /// Lumped parallel plates.
    pub plate_gaps: Vec<PlateGap>,
    /// Facing beams.
    pub beam_gaps: Vec<BeamGap>,
    /// Stops.
    #[serde(default)]
    pub stops: Vec<Stop>,
    /// Elements of domains that have their own.
    #[serde(default)]
    pub placed: Vec<PlacedElement>,
    /// Resistors.
    pub resistors: Vec<Resistor>,
    /// Conductors without resistance.
    #[serde(default)]
    pub wires: Vec<Wire>,
    /// Voltage sources of the netlist.
    pub voltage_sources: Vec<VoltageSource>,
    /// Nodes at electrical ground (SUGAR's `eground`).
    pub electrical_grounds: Vec<NodeId>,
    /// The circuit drawn around the mechanism; its resistors and voltage sources are also among those above.
    #[serde(default)]
    pub circuit: Vec<CircuitElement>,
    /// Heated beams that can yield.
    #[serde(default)]
    pub yields: Vec<Yield>,
    /// Ports, in netlist order.
    pub ports: Vec<Port>,
    /// Temperature of the surroundings of lumped parts (K): of the first layer that gives one, where no beam has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ambient_temperature: Option<f64>,
    /// Finds nodes by name; fills itself. Takes no part in comparisons.
    #[serde(skip)]
    pub index: NodeIndex,
}

impl Structure {
    /// Whether any anchor is displaced.
    pub fn moves_anchors(&self) -> bool {
        let moves = |m: &AnchorMotion, place| m.at(place) != [0.0; 2] || m.rotation != 0.0;
        let displaced = |s: &Support| s.motion.is_some_and(|m| moves(&m, self.nodes[s.node.0].position));
        self.supports.iter().any(displaced)
    }

    /// Nodes of anchors whose displacement and rotation are inputs.
    pub fn driven_anchors(&self) -> impl Iterator<Item = &str> {
        let driven = self.supports.iter().filter(|support| support.motion.is_some_and(|motion| motion.driven));
        driven.map(|support| self.nodes[support.node.0].name.as_str())
    }

    /// Names of those inputs.
    pub fn driven_inputs(&self) -> impl Iterator<Item = String> {
        self.driven_anchors().flat_map(|node| ANCHOR_MOTIONS.map(|quantity| format!("{node}.{quantity}")))
    }

    /// The node of that full name. Cost: constant, after the first call.
    pub fn node(&self, name: &str) -> Option<NodeId> {
        self.index.find(&self.nodes, name)
    }

    /// Larger side of the box around the nodes as drawn (m).
    pub fn extent(&self) -> f64 {
        let side = |i: usize| {
            let (low, high) = self
                .nodes
                .iter()
                .map(|n| n.position[i])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |r, x| (r.0.min(x), r.1.max(x)));
            (high - low).max(0.0)
        };
        side(0).max(side(1))
    }

    /// For each node, whether an anchor holds it in all directions.
    pub fn anchored(&self) -> Vec<bool> {
        let mut anchored = vec![false; self.nodes.len()];
        for support in self.supports.iter().filter(|support| support.held == [true; 3]) {
            anchored[support.node.0] = true;
        }
        anchored
    }

    /// The port of that name, as an index into [`Structure::ports`].
    pub fn port(&self, name: &str) -> Option<usize> {
        self.ports.iter().position(|p| p.name == name)
    }
}
