//! The mechanism without the circuit that is drawn around it.

use super::Structure;
use super::circuit::CircuitKind;
use super::gap::GapVoltage;
use super::network::Port;
use super::node::NodeId;
use std::collections::{BTreeSet, HashSet};

impl Structure {
    /// Nodes whose potential acts on the mechanism: of beams that carry current, of resistors along beams, of wires, and of gaps.
    fn electromechanical(&self) -> BTreeSet<NodeId> {
        let beams = self.beams.iter().filter(|b| b.heater.is_some()).flat_map(|b| [b.a, b.b]);
        let along = self.resistors.iter().flat_map(|r| [r.a, r.b]);
        let wires = self.wires.iter().flat_map(|w| w.nodes.iter().copied());
        let gaps = (self.combs.iter().map(|c| &c.voltage))
            .chain(self.plate_gaps.iter().map(|g| &g.voltage))
            .chain(self.beam_gaps.iter().map(|g| &g.voltage));
        let between =
            gaps.filter_map(|v| if let GapVoltage::Nodes(a, b) = v { Some([*a, *b]) } else { None }).flatten();
        beams.chain(along).chain(wires).chain(between).collect()
    }

    /// The mechanism alone: without the circuit, and in the place of its ports one for each node that the circuit or a port touches and
    /// whose potential acts on the mechanism, against ground, by the node's name and in the order of the nodes.
    pub fn without_circuit(mut self) -> Self {
        let drawn = self.circuit.iter().filter(|e| e.kind == CircuitKind::Resistor);
        let drawn: HashSet<(&str, &[NodeId])> = drawn.map(|e| (e.name.as_str(), e.nodes.as_slice())).collect();
        // the others are resistances of beams
        self.resistors.retain(|r| !drawn.contains(&(r.name.as_str(), [r.a, r.b].as_slice())));
        let own = self.electromechanical();
        let touched: BTreeSet<NodeId> = (self.circuit.iter().flat_map(|e| e.nodes.iter().copied()))
            .chain(self.ports.iter().flat_map(|p| [Some(p.plus), p.minus].into_iter().flatten()))
            .collect();
        let grounds: HashSet<NodeId> = self.electrical_grounds.iter().copied().collect();
        let ports = touched.intersection(&own).filter(|node| !grounds.contains(node));
        let ports =
            ports.map(|node| Port { name: self.nodes[node.0].name.clone(), plus: *node, minus: None }).collect();
        self.voltage_sources.clear();
        self.circuit.clear();
        self.ports = ports;
        self
    }
}
