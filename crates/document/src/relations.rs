//! Checks between fields: what a table of single fields cannot say, and what every program behind a structure relies on.

use crate::error::{DocumentError, RELATION};
use crate::json::JsonNode;
use crate::place::ValuePath;
use bimorph_structure::{
    CircuitKind, DomainElement, FacingGas, Fringe, GapVoltage, InsulatingLayer, MAX_FILM_STATES, NodeId, Structure,
};
use std::collections::HashSet;

/// How far the length of a unit vector may be from 1.
const UNIT: f64 = 1e-9;

/// Checks a structure that was read from `root`.
pub(crate) fn check(structure: &Structure, root: &JsonNode<'_>) -> Result<(), DocumentError> {
    let relations = Relations { structure, root };
    relations.touched_nodes()?;
    relations.mechanical_parts()?;
    relations.gaps()?;
    relations.network()
}

struct Relations<'d> {
    structure: &'d Structure,
    root: &'d JsonNode<'d>,
}

type Checked = Result<(), DocumentError>;

impl Relations<'_> {
    /// Reports a field of an item unless `good` holds.
    fn require(&self, good: bool, (list, index, field): (&str, usize, &str), message: &str) -> Checked {
        if good {
            return Ok(());
        }
        let node = self.root.get(list).and_then(|l| l.item(index)).unwrap_or(self.root);
        let (at, item);
        let section = ValuePath::Field(&ValuePath::Root, list);
        item = ValuePath::Item(&section, index);
        at = if field.is_empty() { item } else { ValuePath::Field(&item, field) };
        Err(at.fault(RELATION, node.get(field).unwrap_or(node), message, ""))
    }

    /// Nodes say which kind of parts touch them.
    fn touched_nodes(&self) -> Checked {
        let s = self.structure;
        let mechanical = |list: &str, k: usize, nodes: &[NodeId]| {
            let loose = nodes.iter().find(|n| !s.nodes[n.0].mechanical);
            let name = loose.map_or("", |n| s.nodes[n.0].name.as_str());
            let message = format!("the node \"{name}\" of a mechanical part has \"mechanical\": false");
            self.require(loose.is_none(), (list, k, ""), &message)
        };
        let electrical = |list: &str, k: usize, nodes: &[NodeId]| {
            let loose = nodes.iter().find(|n| !s.nodes[n.0].electrical);
            let name = loose.map_or("", |n| s.nodes[n.0].name.as_str());
            let message = format!("the node \"{name}\" of an electrical part has \"electrical\": false");
            self.require(loose.is_none(), (list, k, ""), &message)
        };
        let voltage = |list: &str, k: usize, voltage: &GapVoltage| match voltage {
            GapVoltage::Fixed(_) => Ok(()),
            GapVoltage::Nodes(a, b) => electrical(list, k, &[*a, *b]),
        };
        for (k, beam) in s.beams.iter().enumerate() {
            mechanical("beams", k, &[beam.a, beam.b])?;
            if beam.heater.is_some() {
                electrical("beams", k, &[beam.a, beam.b])?;
            }
        }
        s.masses.iter().enumerate().try_for_each(|(k, m)| mechanical("masses", k, &[m.node]))?;
        s.links.iter().enumerate().try_for_each(|(k, l)| mechanical("links", k, &[l.a, l.b]))?;
        s.supports.iter().enumerate().try_for_each(|(k, h)| mechanical("supports", k, &[h.node]))?;
        s.springs.iter().enumerate().try_for_each(|(k, l)| mechanical("springs", k, &[l.a, l.b]))?;
        s.loads.iter().enumerate().try_for_each(|(k, l)| mechanical("loads", k, &[l.node]))?;
        s.stops.iter().enumerate().try_for_each(|(k, stop)| {
            mechanical("stops", k, &[stop.a])?;
            stop.b.map_or(Ok(()), |b| mechanical("stops", k, &[b]))
        })?;
        s.placed.iter().enumerate().try_for_each(|(k, p)| mechanical("placed", k, &p.nodes))?;
        for (k, comb) in s.combs.iter().enumerate() {
            mechanical("combs", k, &[comb.a, comb.b])?;
            voltage("combs", k, &comb.voltage)?;
        }
        for (k, gap) in s.plate_gaps.iter().enumerate() {
            mechanical("plate_gaps", k, &[gap.a, gap.b])?;
            voltage("plate_gaps", k, &gap.voltage)?;
        }
        for (k, gap) in s.beam_gaps.iter().enumerate() {
            mechanical("beam_gaps", k, &gap.nodes)?;
            voltage("beam_gaps", k, &gap.voltage)?;
        }
        s.resistors.iter().enumerate().try_for_each(|(k, r)| electrical("resistors", k, &[r.a, r.b]))?;
        s.wires.iter().enumerate().try_for_each(|(k, w)| electrical("wires", k, &w.nodes))?;
        let sources = s.voltage_sources.iter().enumerate();
        sources.into_iter().try_for_each(|(k, v)| electrical("voltage_sources", k, &[v.plus, v.minus]))?;
        s.electrical_grounds.iter().enumerate().try_for_each(|(k, n)| electrical("electrical_grounds", k, &[*n]))?;
        s.circuit.iter().enumerate().try_for_each(|(k, e)| electrical("circuit", k, &e.nodes))?;
        s.ports.iter().enumerate().try_for_each(|(k, p)| {
            electrical("ports", k, &[p.plus])?;
            p.minus.map_or(Ok(()), |minus| electrical("ports", k, &[minus]))
        })
    }

    fn axis(&self, list: &str, index: usize, axis: [f64; 2]) -> Checked {
        let unit = (axis[0].hypot(axis[1]) - 1.0).abs() <= UNIT;
        self.require(unit, (list, index, "axis"), "expected a vector of length 1")
    }

    fn mechanical_parts(&self) -> Checked {
        let s = self.structure;
        for (k, pad) in s.pads.iter().enumerate() {
            self.require(pad.support < s.supports.len(), ("pads", k, "support"), "the list of supports is shorter")?;
        }
        for (k, one) in s.yields.iter().enumerate() {
            let beam = s.beams.get(one.beam);
            let heated = beam.is_some_and(|beam| beam.heater.is_some());
            self.require(heated, ("yields", k, "beam"), "expected the index of a beam with a heater")?;
            let ambient = beam.map_or(0.0, |beam| beam.material.ambient_temperature);
            let above = one.softening > ambient;
            self.require(above, ("yields", k, "softening"), "expected more than the ambient temperature of the beam")?;
        }
        for (k, beam) in s.beams.iter().enumerate() {
            let heater = beam.heater.iter();
            let of_heater =
                heater.flat_map(|h| [&h.resistance_curve, &h.conductance_curve, &h.capacity_curve, &h.gas_curve]);
            for curve in of_heater.chain([&beam.material.expansion_curve]).flatten() {
                if let Some(fault) = curve.fault() {
                    self.require(false, ("beams", k, ""), &format!("a curve over temperature: {fault}"))?;
                }
                let covers = curve.covers(beam.material.ambient_temperature);
                self.require(
                    covers,
                    ("beams", k, ""),
                    "a table over temperature does not cover the ambient temperature",
                )?;
            }
        }
        for (k, mass) in s.masses.iter().enumerate() {
            let sides = mass.outline[..2].iter().all(|side| *side >= 0.0);
            self.require(sides, ("masses", k, "outline"), "sides are at least 0")?;
        }
        for (k, stop) in s.stops.iter().enumerate() {
            self.axis("stops", k, stop.axis)?;
            self.require(stop.ways != [None; 2], ("stops", k, "ways"), "expected a travel on at least one side")?;
        }
        for (k, placed) in s.placed.iter().enumerate() {
            let element = DomainElement::ALL.iter().find(|element| element.name == placed.element);
            let names: Vec<&str> = DomainElement::ALL.iter().map(|element| element.name).collect();
            let message = format!("expected one of {}", names.join(", "));
            self.require(element.is_some(), ("placed", k, "element"), &message)?;
            let fits = element.is_none_or(|element| element.nodes.contains(&placed.nodes.len()));
            self.require(fits, ("placed", k, "nodes"), "the element has another number of nodes")?;
            let fits = element.is_none_or(|element| element.parameters.len() == placed.values.len());
            self.require(fits, ("placed", k, "values"), "the element has another number of parameters")?;
        }
        Ok(())
    }

    /// Distances, insulation and gas of plates and beams that face each other.
    fn facing(
        &self,
        (list, k): (&str, usize),
        (gap, touch): (f64, Option<f64>),
        insulation: Option<InsulatingLayer>,
        gas: Option<&FacingGas>,
    ) -> Checked {
        let closer = touch.is_none_or(|touch| touch < gap);
        self.require(closer, (list, k, "touch"), "expected less than the gap")?;
        let thin = insulation.is_none_or(|layer| layer.thickness < gap && layer.permittivity >= 1.0);
        self.require(thin, (list, k, "insulation"), "expected a thickness below the gap and a permittivity from 1")?;
        let Some(gas) = gas else { return Ok(()) };
        let closed = gas.closed.is_none_or(|closed| closed < gap);
        self.require(closed, (list, k, "gas"), "expected \"closed\" to be less than the gap")?;
        let few = gas.states as f64 <= MAX_FILM_STATES;
        self.require(few, (list, k, "gas"), &format!("expected at most {MAX_FILM_STATES} \"states\""))?;
        let Some(holes) = gas.holes else { return Ok(()) };
        self.require(gas.states == 0, (list, k, "gas"), "expected 0 \"states\" beside holes")?;
        let apart = holes.pitch > 2.0 * holes.radius && holes.pitch <= gas.sides[0].min(gas.sides[1]);
        let message = "expected a \"pitch\" above twice the \"radius\", and at most the shorter side";
        self.require(apart, (list, k, "gas"), message)
    }

    fn gaps(&self) -> Checked {
        let s = self.structure;
        for (k, comb) in s.combs.iter().enumerate() {
            self.axis("combs", k, comb.axis)?;
            let [length, width] = comb.finger;
            let long = length > 0.0 && comb.overlap <= length;
            self.require(
                long,
                ("combs", k, "overlap"),
                "expected at most the length of the fingers, which is above 0",
            )?;
            let known = width > 0.0 || comb.law != Some(Fringe::Exact);
            self.require(known, ("combs", k, "law"), "the exact field needs the width of the fingers")?;
            let closer = comb.touch.is_none_or(|touch| touch < comb.gap);
            self.require(closer, ("combs", k, "touch"), "expected less than the gap")?;
        }
        for (k, gap) in s.plate_gaps.iter().enumerate() {
            self.axis("plate_gaps", k, gap.axis)?;
            let shaped = gap.sides[0] > 0.0;
            let both = shaped == (gap.sides[1] > 0.0);
            self.require(both, ("plate_gaps", k, "sides"), "expected two sides above 0, or two zeros")?;
            let exact = shaped && matches!(gap.law, None | Some(Fringe::Exact));
            let thick = !exact || gap.thickness > 0.0;
            self.require(thick, ("plate_gaps", k, "thickness"), "the exact field needs a thickness above 0")?;
            self.facing(("plate_gaps", k), (gap.gap, gap.touch), gap.insulation, gap.gas.as_ref())?;
        }
        for (k, gap) in s.beam_gaps.iter().enumerate() {
            self.require(gap.side.abs() == 1.0, ("beam_gaps", k, "side"), "expected 1 or -1")?;
            self.facing(("beam_gaps", k), (gap.gap, gap.touch), gap.insulation, gap.gas.as_ref())?;
        }
        Ok(())
    }

    fn network(&self) -> Checked {
        let s = self.structure;
        for (k, wire) in s.wires.iter().enumerate() {
            self.require(wire.nodes.len() >= 2, ("wires", k, "nodes"), "expected at least two nodes")?;
        }
        for (k, element) in s.circuit.iter().enumerate() {
            let count = if matches!(element.kind, CircuitKind::OpAmp | CircuitKind::Amplifier) { 4 } else { 2 };
            let message = format!("expected {count} nodes");
            self.require(element.nodes.len() == count, ("circuit", k, "nodes"), &message)?;
        }
        let mut names = HashSet::new();
        for (k, port) in s.ports.iter().enumerate() {
            self.require(
                names.insert(port.name.as_str()),
                ("ports", k, "name"),
                "there is a port of that name already",
            )?;
            self.require(port.minus != Some(port.plus), ("ports", k, "minus"), "both nodes of the port are the same")?;
        }
        Ok(())
    }
}
