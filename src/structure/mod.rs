//! What was drawn: nodes, materials, beams, plates, anchors, gaps, combs and ports, in SI units.
//!
//! A [`Structure`] is planar (x, y, rotation about z), knows nothing of bodies or joints, and is never changed after it
//! was built. Node positions are those of the drawn geometry. Everything refers to nodes by [`NodeId`].
//!
//! A node may be mechanical (it has a position), electrical (it has a potential), or both: as in SUGAR, one netlist name
//! stands for the mechanical point and for the electrical net at that point.

mod circuit;
mod index;

pub use circuit::{CircuitElement, CircuitKind};
pub use index::NodeIndex;

use serde::{Deserialize, Serialize};

/// Index of a node in [`Structure::nodes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct NodeId(pub usize);

/// A named point of the drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Full name, with the names of the enclosing subnet instances ("bankA.b1.t", "x1(1)").
    pub name: String,
    /// Drawn position x, y [m].
    pub position: [f64; 2],
    /// True when a mechanical element touches the node.
    pub mechanical: bool,
    /// True when an electrical element or a port touches the node.
    pub electrical: bool,
}

/// Material constants of the layer an element is made of. Values an element overrides are already in place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Young's modulus [Pa].
    pub youngs_modulus: f64,
    /// Poisson's ratio [1].
    pub poisson: f64,
    /// Mass density [kg/m³].
    pub density: f64,
    /// Dynamic viscosity of the gas around the part [Pa·s]; 0 without damping.
    pub viscosity: f64,
    /// Thickness of the gas film under the part [m].
    pub fluid: f64,
    /// Coefficient of thermal expansion [1/K].
    pub thermal_expansion: f64,
    /// Temperature at which the drawn length is stress-free [K].
    pub ambient_temperature: f64,
    /// Residual stress of the layer [Pa], tensile positive.
    pub stress: f64,
}

/// A straight beam of constant rectangular section between two nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Beam {
    /// Full element name ("b1.hot"; "anon7" where the netlist gives none).
    pub name: String,
    /// Start node.
    pub a: NodeId,
    /// End node.
    pub b: NodeId,
    /// Length from the netlist [m]. Stiffness and mass come from it, not from the node positions.
    pub length: f64,
    /// Direction from `a` to `b` [rad], from the global x axis.
    pub angle: f64,
    /// In-plane width [m].
    pub width: f64,
    /// Out-of-plane thickness [m].
    pub thickness: f64,
    /// Material constants.
    pub material: Material,
    /// Prescribed mean temperature [K] (SUGAR's `T=`); none when at ambient or when heated by current.
    pub temperature: Option<f64>,
    /// Joule heating, when the beam carries current.
    pub heater: Option<Heater>,
}

/// A beam seen as a resistor that warms itself and conducts heat along its length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heater {
    /// Electrical resistance from end to end [Ω].
    pub resistance: f64,
    /// Thermal conductance from end to end k·A/l [W/K].
    pub conductance: f64,
    /// Time constant with which the mean temperature rise follows its steady value [s]; 0: at once.
    pub time_constant: f64,
}

/// A rigid body's mass at a node: a plate, or a lumped mass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mass {
    /// Full element name.
    pub name: String,
    /// Node at the centre of mass.
    pub node: NodeId,
    /// Mass [kg].
    pub mass: f64,
    /// Moment of inertia about the node [kg·m²].
    pub inertia: f64,
    /// Viscous drag on translation [N·s/m] and rotation [N·m·s] (Couette film under a plate).
    pub drag: [f64; 2],
    /// Outline for pictures: size along local x and y [m] and angle [rad]; `[0, 0, 0]` for a lumped mass.
    pub outline: [f64; 3],
}

/// A rigid, massless connection of two nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Full element name.
    pub name: String,
    /// First node.
    pub a: NodeId,
    /// Second node.
    pub b: NodeId,
}

/// Holds some directions of a node at their drawn place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Support {
    /// Full element name.
    pub name: String,
    /// Held node.
    pub node: NodeId,
    /// Held directions: local x, local y, rotation about z. An anchor holds all three.
    pub held: [bool; 3],
    /// Angle of the local x axis [rad].
    pub angle: f64,
}

/// The outline of an anchor's pad, for drawings: from its node along local x, and as much to either side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pad {
    /// Index of the anchor in [`Structure::supports`].
    pub support: usize,
    /// Length along local x and width across it [m].
    pub size: [f64; 2],
}

/// A linear spring or viscous damper with three directions in a frame that turns with the mean of its two ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpringDamper {
    /// Full element name.
    pub name: String,
    /// First node.
    pub a: NodeId,
    /// Second node.
    pub b: NodeId,
    /// Angle of the local x axis [rad].
    pub angle: f64,
    /// Stiffness along local x [N/m], local y [N/m], about z [N·m/rad].
    pub stiffness: [f64; 3],
    /// Damping along local x [N·s/m], local y [N·s/m], about z [N·m·s/rad].
    pub damping: [f64; 3],
}

/// A dead load at a node: it keeps its global direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Full element name.
    pub name: String,
    /// Loaded node.
    pub node: NodeId,
    /// Force x, y [N].
    pub force: [f64; 2],
    /// Moment about z [N·m].
    pub moment: f64,
}

/// Where the voltage across a gap comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum GapVoltage {
    /// A fixed voltage from the netlist [V].
    Fixed(f64),
    /// The potential difference between two electrical nodes.
    Nodes(NodeId, NodeId),
}

/// A comb drive: C = N·ε·h·o/g with overlap o = o₀ + u, u the approach of `a` towards `b` along `axis`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comb {
    /// Full element name.
    pub name: String,
    /// Moving side (rotor) node.
    pub a: NodeId,
    /// Other side (stator) node.
    pub b: NodeId,
    /// Unit vector along which `a` moves deeper into `b`.
    pub axis: [f64; 2],
    /// Number of finger gaps N [1] (SUGAR's N: C' = N·ε·h/g).
    pub gaps: f64,
    /// Gap between facing fingers g [m].
    pub gap: f64,
    /// Height of the fingers h [m].
    pub height: f64,
    /// Overlap as drawn o₀ [m].
    pub overlap: f64,
    /// Permittivity ε [F/m].
    pub permittivity: f64,
    /// Capacitance that does not depend on the motion [F].
    pub parasitic: f64,
    /// Length and width of its fingers [m], for drawings; a width of 0 where the netlist gives none.
    #[serde(default)]
    pub finger: [f64; 2],
    /// False for SUGAR's `comb2d`, whose force is constant whatever the overlap.
    pub finite: bool,
    /// Where its voltage comes from.
    pub voltage: GapVoltage,
}

/// Two facing lumped plates: C = ε·A/(g₀ − u), u the approach of `a` towards `b` along `axis`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlateGap {
    /// Full element name.
    pub name: String,
    /// Moving plate's node.
    pub a: NodeId,
    /// Other plate's node.
    pub b: NodeId,
    /// Unit vector from plate `a` towards plate `b`.
    pub axis: [f64; 2],
    /// Area A [m²].
    pub area: f64,
    /// Gap as drawn g₀ [m].
    pub gap: f64,
    /// Permittivity ε [F/m].
    pub permittivity: f64,
    /// Distance at which the plates touch [m]; none: that of nearly closed gaps of their size.
    #[serde(default)]
    pub touch: Option<f64>,
    /// Where its voltage comes from.
    pub voltage: GapVoltage,
}

/// Two facing beams `a`–`b` and `c`–`d` (SUGAR's gap2d family): pressure ½εV²/g(s)² and contact along their length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BeamGap {
    /// Full element name.
    pub name: String,
    /// Upper beam's ends, then the lower beam's: a, b, c, d.
    pub nodes: [NodeId; 4],
    /// Direction from `a` to `b` [rad].
    pub angle: f64,
    /// +1: the upper beam lies at local +y of the lower one; −1 where the element was mirrored.
    pub side: f64,
    /// Length [m].
    pub length: f64,
    /// Gap as drawn [m].
    pub gap: f64,
    /// Height of the electrodes [m].
    pub height: f64,
    /// Permittivity ε [F/m].
    pub permittivity: f64,
    /// Factor on capacitance and force for the fringe field, 1 + 1.12·gap/h in SUGAR [1].
    pub fringe: f64,
    /// Distance at which the beams touch [m]; none: that of nearly closed gaps of their size.
    #[serde(default)]
    pub touch: Option<f64>,
    /// Where its voltage comes from.
    pub voltage: GapVoltage,
}

/// A stop: how far one node may move along an axis towards another before they touch, and against it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Full element name.
    pub name: String,
    /// Moving node.
    pub a: NodeId,
    /// What it meets; none: the ground.
    pub b: Option<NodeId>,
    /// Unit vector of the motion.
    pub axis: [f64; 2],
    /// Way along the axis and against it until they touch [m]; none: no stop on that side.
    pub ways: [Option<f64>; 2],
    /// Stiffness of the stop [N/m]; none: rigid.
    pub stiffness: Option<f64>,
    /// Area on which a rigid stop bears [m²].
    pub area: f64,
}

/// A linear resistor between two electrical nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resistor {
    /// Full element name.
    pub name: String,
    /// First node.
    pub a: NodeId,
    /// Second node.
    pub b: NodeId,
    /// Resistance [Ω], positive.
    pub resistance: f64,
}

/// An ideal voltage source drawn in the netlist (SUGAR's `Vsrc`): potential of `plus` over `minus`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VoltageSource {
    /// Full element name.
    pub name: String,
    /// Positive node.
    pub plus: NodeId,
    /// Negative node.
    pub minus: NodeId,
    /// Voltage [V].
    pub voltage: f64,
}

/// How a heated beam loses its strength against pressure along it, so that it is shortened for good (backbending).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Yield {
    /// Index of the beam in [`Structure::beams`].
    pub beam: usize,
    /// Yield stress at ambient temperature [Pa].
    pub stress: f64,
    /// Temperature at which no strength is left [K].
    pub softening: f64,
}

/// An electrical port: a pair of nodes that a circuit drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Port {
    /// Port name: the full name of its netlist element.
    pub name: String,
    /// Positive node.
    pub plus: NodeId,
    /// Negative node; none: the structure's electrical ground.
    pub minus: Option<NodeId>,
}

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
    /// Resistors.
    pub resistors: Vec<Resistor>,
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
    /// Finds nodes by name; fills itself. Takes no part in comparisons.
    #[serde(skip)]
    pub index: NodeIndex,
}

impl Structure {
    /// The node of that full name. Cost: constant, after the first call.
    pub fn node(&self, name: &str) -> Option<NodeId> {
        self.index.find(&self.nodes, name)
    }

    /// Larger side of the box around the nodes as drawn [m].
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

    /// The port of that name, as an index into [`Structure::ports`].
    pub fn port(&self, name: &str) -> Option<usize> {
        self.ports.iter().position(|p| p.name == name)
    }
}
