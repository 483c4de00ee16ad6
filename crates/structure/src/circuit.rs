//! The circuit that is drawn in a netlist around the mechanism: SUGAR's circuit elements.

use super::node::NodeId;
use serde::{Deserialize, Serialize};

/// Kind of a circuit element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CircuitKind {
    /// Resistance (Ω) between two nodes.
    Resistor,
    /// Capacitance (F) between two nodes.
    Capacitor,
    /// Inductance (H) between two nodes.
    Inductor,
    /// Voltage (V) of the first node over the second.
    VoltageSource,
    /// Current (A) that flows from the first node through the source to the second.
    CurrentSource,
    /// Four nodes: keeps the first two at one potential by what it drives between the third and the fourth. No value.
    OpAmp,
    /// Four nodes: the voltage of the third over the fourth is the value (1) times that of the first over the second.
    Amplifier,
}

impl CircuitKind {
    /// True for elements that act in a circuit simulator alone: the model leaves them out.
    pub fn is_left_out(self) -> bool {
        matches!(self, Self::Capacitor | Self::CurrentSource | Self::OpAmp | Self::Amplifier)
    }
}

/// A circuit element as drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CircuitElement {
    /// Full element name.
    pub name: String,
    /// Its kind.
    pub kind: CircuitKind,
    /// Its nodes.
    pub nodes: Vec<NodeId>,
    /// Its value, in the unit of its kind; none where the netlist gives none.
    pub value: Option<f64>,
    /// Amplitude (V) and phase (rad) in small-signal analyses, of voltage sources that give them.
    #[serde(default)]
    pub small_signal: Option<[f64; 2]>,
}
