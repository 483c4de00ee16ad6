//! The electrical network that drives the mechanism: resistors, wires, sources, and ports.

use super::Structure;
use super::node::NodeId;
use bimorph_base::sets::Sets;
use serde::{Deserialize, Serialize};

/// A linear resistor between two electrical nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resistor {
    /// Full element name.
    pub name: String,
    /// First node.
    pub a: NodeId,
    /// Second node.
    pub b: NodeId,
    /// Resistance (Ω), positive.
    pub resistance: f64,
}

/// Nodes on one conductor without resistance: they have one potential and one temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wire {
    /// Full element name.
    pub name: String,
    /// Its nodes, at least two.
    pub nodes: Vec<NodeId>,
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
    /// Voltage (V).
    pub voltage: f64,
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

impl Structure {
    /// For each node the one that stands for its conductor, the first of those that wires join.
    pub fn nets(&self) -> Vec<NodeId> {
        let mut nets = Sets::new(self.nodes.len());
        for wire in &self.wires {
            wire.nodes.iter().for_each(|node| {
                nets.join(wire.nodes[0].0, node.0);
            });
        }
        (0..self.nodes.len()).map(|n| NodeId(nets.first(n))).collect()
    }
}
