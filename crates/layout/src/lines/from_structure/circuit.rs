//! Lines of what is electrical alone: resistors, wires, sources, grounds and ports.

use super::OfStructure;
use bimorph_structure::{CircuitKind, NodeId};
use std::collections::{HashMap, HashSet};

impl OfStructure<'_> {
    pub(super) fn circuit(&mut self) {
        let structure = self.structure;
        let drawn: HashSet<&str> = structure.circuit.iter().map(|c| c.name.as_str()).collect();
        for (k, r) in structure.resistors.iter().enumerate() {
            if !self.used_resistors.contains(&k) && !drawn.contains(r.name.as_str()) {
                self.push(&r.name, "R", "*", &[r.a, r.b], &[("R", r.resistance)]);
            }
        }
        for wire in &structure.wires {
            self.push(&wire.name, "wire", "*", &wire.nodes, &[]);
        }
        for source in structure.voltage_sources.iter().filter(|s| !drawn.contains(s.name.as_str())) {
            self.push(&source.name, "Vsrc", "*", &[source.plus, source.minus], &[("V", source.voltage)]);
        }
        for element in &structure.circuit {
            let (model, parameter) = match element.kind {
                CircuitKind::Resistor => ("R", "R"),
                CircuitKind::Capacitor => ("C", "C"),
                CircuitKind::Inductor => ("L", "L"),
                CircuitKind::VoltageSource => ("Vsrc", "V"),
                CircuitKind::CurrentSource => ("Isrc", "I"),
                CircuitKind::OpAmp => ("opamp", ""),
                CircuitKind::Amplifier => ("vcvs", "A"),
            };
            let value = element.value.map(|v| (parameter, v));
            self.push(&element.name, model, "*", &element.nodes, value.as_slice());
        }
        // in the instance of their node, so that it keeps its name
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for ground in &structure.electrical_grounds {
            let instance = structure.nodes[ground.0].name.rsplit_once('.').map_or("", |(instance, _)| instance);
            let count = counts.entry(instance).or_default();
            *count += 1;
            let dot = if instance.is_empty() { "" } else { "." };
            self.push(&format!("{instance}{dot}ground{count}"), "eground", "*", &[*ground], &[]);
        }
        for port in &structure.ports {
            let nodes: Vec<NodeId> = [Some(port.plus), port.minus].into_iter().flatten().collect();
            self.push(&port.name, "port", "*", &nodes, &[]);
        }
    }
}
