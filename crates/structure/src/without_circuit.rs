//! The mechanism without the circuit that is drawn around it.

use super::Structure;
use super::circuit::CircuitKind;
use super::gap::GapVoltage;
use super::network::Port;
use super::node::NodeId;
use std::collections::{BTreeSet, HashSet};

impl Structure {
    /// Nodes whose potential acts on the mechanism: of beams that carry current, of resistors along beams, and of gaps.
    fn electromechanical(&self) -> impl Iterator<Item = NodeId> {
        let beams = self.beams.iter().filter(|b| b.heater.is_some()).flat_map(|b| [b.a, b.b]);
        let along = self.resistors.iter().flat_map(|r| [r.a, r.b]);
        let gaps = (self.combs.iter().map(|c| &c.voltage))
            .chain(self.plate_gaps.iter().map(|g| &g.voltage))
            .chain(self.beam_gaps.iter().map(|g| &g.voltage));
        let between =
            gaps.filter_map(|v| if let GapVoltage::Nodes(a, b) = v { Some([*a, *b]) } else { None }).flatten();
        beams.chain(along).chain(between)
    }

    /// The mechanism alone: without the circuit, and in the place of its ports one for each conductor (a node, or nodes that wires join) that
    /// the circuit or a port touches and whose potential acts on the mechanism, against ground. It is called after its first node that
    /// is touched and acts, else that is touched, and ports come in the order of these nodes.
    pub fn without_circuit(mut self) -> Self {
        let drawn = self.circuit.iter().filter(|e| e.kind == CircuitKind::Resistor);
        let drawn: HashSet<(&str, &[NodeId])> = drawn.map(|e| (e.name.as_str(), e.nodes.as_slice())).collect();
        // the others are resistances of beams
        self.resistors.retain(|r| !drawn.contains(&(r.name.as_str(), [r.a, r.b].as_slice())));
        let nets = self.nets();
        let net = |node: NodeId| nets[node.0];
        let acting: BTreeSet<NodeId> = self.electromechanical().collect();
        let acting_nets: HashSet<NodeId> = acting.iter().map(|n| net(*n)).collect();
        let touched: BTreeSet<NodeId> = (self.circuit.iter().flat_map(|e| e.nodes.iter().copied()))
            .chain(self.ports.iter().flat_map(|p| [Some(p.plus), p.minus].into_iter().flatten()))
            .collect();
        let mut taken: HashSet<NodeId> = self.electrical_grounds.iter().map(|n| net(*n)).collect();
        let (own, others): (Vec<NodeId>, Vec<NodeId>) = touched.into_iter().partition(|n| acting.contains(n));
        let ports = own.into_iter().chain(others).filter(|n| acting_nets.contains(&net(*n)) && taken.insert(net(*n)));
        let ports: BTreeSet<NodeId> = ports.collect();
        let ports = ports.into_iter();
        let ports = ports.map(|node| Port { name: self.nodes[node.0].name.clone(), plus: node, minus: None }).collect();
        self.voltage_sources.clear();
        self.circuit.clear();
        self.ports = ports;
        self
    }
}
