//! Lines of combs, gaps, stops and what domains have of their own.

use super::{OfStructure, unmirrored};
use bimorph_structure::DomainElement;
use bimorph_structure::{
    Beam, ElectrodeShape, FacingGas, Fringe, GapVoltage, Impact, InsulatingLayer, NodeId, Perforation,
};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Impact losses, where the netlist gives them.
fn impact(impact: &Impact) -> impl Iterator<Item = (&'static str, f64)> {
    let given = [("restitution", impact.restitution), ("speed", impact.speed)];
    given.into_iter().filter_map(|(name, value)| Some((name, value?)))
}

/// Insulating layer of a gap, where there is one.
fn insulation(layer: Option<InsulatingLayer>) -> impl Iterator<Item = (&'static str, f64)> {
    layer.into_iter().flat_map(|layer| [("td", layer.thickness), ("er", layer.permittivity)])
}

/// Offset voltage of a gap, where it has one.
fn offset(volts: f64) -> Option<(&'static str, f64)> {
    (volts != 0.0).then_some(("voffset", volts))
}

/// Law of the fringe field and shape of the electrode, where the netlist gives them.
fn field_words(
    law: Option<Fringe>,
    electrode: Option<ElectrodeShape>,
) -> impl Iterator<Item = (&'static str, &'static str)> {
    let law = law.and_then(|law| Fringe::NAMES.iter().find(|(_, other)| *other == law));
    let shape = electrode.and_then(|shape| ElectrodeShape::NAMES.iter().find(|(_, other)| *other == shape));
    law.map(|(word, _)| ("fringe", *word)).into_iter().chain(shape.map(|(word, _)| ("electrode", *word)))
}

/// Gas in a gap, whatever its layer says.
fn gas(gas: Option<&FacingGas>) -> impl Iterator<Item = (&'static str, f64)> {
    let given = gas.map(|gas| {
        let always = [("viscosity", gas.viscosity), ("pressure", gas.pressure), ("meanfreepath", gas.free_path)];
        let slit = gas.slit.map(|slit| ("slit", slit.height));
        always.into_iter().chain(gas.closed.map(|closed| ("filmgap", closed))).chain(slit)
    });
    given.into_iter().flatten()
}

impl OfStructure<'_> {
    /// `gap2d` at a fixed voltage brings its two beams with it; gives their names.
    pub(super) fn gaps_with_beams(&mut self) -> HashSet<String> {
        let structure = self.structure;
        let beams: HashMap<&str, &Beam> = structure.beams.iter().map(|b| (b.name.as_str(), b)).collect();
        let mut inside = HashSet::new();
        for gap in &structure.beam_gaps {
            let GapVoltage::Fixed(voltage) = gap.voltage else { continue };
            let parts = ["upper", "lower"].map(|part| format!("{}.{part}", gap.name));
            let (Some(upper), Some(lower)) = (beams.get(parts[0].as_str()), beams.get(parts[1].as_str())) else {
                self.left.push(format!("the gap `{}` at a fixed voltage without its beams", gap.name));
                continue;
            };
            let process = self.process_of(upper);
            let mut parameters = vec![("l", gap.length), ("w1", upper.width), ("w2", lower.width), ("gap", gap.gap)];
            let (nodes, angle) = unmirrored(gap);
            parameters.extend([("oz", angle), ("V", voltage), ("permittivity", gap.permittivity)]);
            parameters.extend(insulation(gap.insulation).chain(offset(gap.offset)));
            parameters.extend(gap.touch.map(|t| ("touch", t)).into_iter().chain(impact(&gap.impact)));
            parameters.extend(gas(gap.gas.as_ref()));
            self.push(&gap.name, "gap2d", &process, &nodes, &parameters);
            self.say(field_words(gap.law, gap.electrode));
            inside.extend(parts);
        }
        inside
    }

    pub(super) fn fields(&mut self) {
        let structure = self.structure;
        let turned = |axis: [f64; 2]| ("oz", axis[1].atan2(axis[0]));
        let across: BTreeMap<(NodeId, NodeId), f64> =
            structure.beams.iter().flat_map(|b| [((b.a, b.b), b.width), ((b.b, b.a), b.width)]).collect();
        for comb in &structure.combs {
            let mut parameters = vec![("N", comb.gaps), ("gap", comb.gap), ("l", comb.overlap), ("L", comb.finger[0])];
            parameters.extend([("h", comb.height), turned(comb.axis), ("permittivity", comb.permittivity)]);
            parameters.extend(offset(comb.offset));
            if comb.finger[1] > 0.0 {
                parameters.push(("w", comb.finger[1]));
            }
            let model = match comb.voltage {
                GapVoltage::Fixed(v) => {
                    parameters.push(("V", v));
                    "comb2d"
                }
                GapVoltage::Nodes(..) => {
                    let optional =
                        [("Cp", comb.parasitic), ("misalign", comb.misalignment), ("substrate", comb.substrate)];
                    parameters.extend(optional.into_iter().filter(|(_, value)| *value != 0.0));
                    parameters.extend(comb.touch.map(|t| ("touch", t)).into_iter().chain(impact(&comb.impact)));
                    "comb2de"
                }
            };
            self.push(&comb.name, model, "*", &[comb.a, comb.b], &parameters);
            if comb.finite {
                self.say(field_words(comb.law, None));
            }
        }
        for gap in structure.beam_gaps.iter().filter(|g| matches!(g.voltage, GapVoltage::Nodes(..))) {
            let [a, b, c, d] = gap.nodes;
            let (p, q) = (self.position(a), self.position(c));
            // Both widths come back from the distance of the centre lines and the width of the beam that is there.
            let both = 2.0 * ((p[0] - q[0]).hypot(p[1] - q[1]) - gap.gap);
            let w1 = across.get(&(a, b)).copied();
            let w2 = across.get(&(c, d)).copied();
            let w1 = w1.or(w2.map(|w| both - w)).unwrap_or(both / 2.0);
            let w2 = w2.unwrap_or(both - w1);
            let mut parameters = vec![("l", gap.length), ("w1", w1), ("w2", w2), ("gap", gap.gap), ("h", gap.height)];
            let (nodes, angle) = unmirrored(gap);
            parameters.extend([("oz", angle), ("permittivity", gap.permittivity)]);
            parameters.extend(insulation(gap.insulation).chain(offset(gap.offset)));
            parameters.extend(gap.touch.map(|t| ("touch", t)).into_iter().chain(impact(&gap.impact)));
            parameters.extend(gas(gap.gas.as_ref()));
            self.push(&gap.name, "gap2dforce", "*", &nodes, &parameters);
            self.say(field_words(gap.law, gap.electrode));
        }
        for gap in &structure.plate_gaps {
            if matches!(gap.voltage, GapVoltage::Fixed(_)) {
                self.left.push(format!("the fixed voltage of `{}`", gap.name));
            }
            let mut parameters =
                vec![("A", gap.area), ("gap", gap.gap), turned(gap.axis), ("permittivity", gap.permittivity)];
            if gap.sides[0] > 0.0 {
                parameters.extend([("l", gap.sides[0]), ("w", gap.sides[1])]);
                parameters.extend((gap.thickness > 0.0).then_some(("h", gap.thickness)));
            }
            parameters.extend(insulation(gap.insulation).chain(offset(gap.offset)));
            parameters.extend(gap.touch.map(|t| ("touch", t)).into_iter().chain(impact(&gap.impact)));
            parameters.extend(gap.gas.map(|gas| ("filmstates", gas.states as f64)));
            let holes = gap.gas.and_then(|gas| gas.holes);
            let of_holes = |h: Perforation| [("hole", h.radius), ("pitch", h.pitch)];
            parameters.extend(holes.into_iter().flat_map(of_holes));
            parameters.extend(holes.filter(|_| gap.thickness == 0.0).map(|h| ("h", h.depth)));
            parameters.extend(gas(gap.gas.as_ref()));
            self.push(&gap.name, "plategap2d", "*", &[gap.a, gap.b], &parameters);
            self.say(field_words(gap.law, gap.electrode));
        }
        for stop in &structure.stops {
            let mut parameters = vec![("A", stop.area), turned(stop.axis)];
            let optional = [("gap", stop.ways[0]), ("back", stop.ways[1]), ("k", stop.stiffness)];
            parameters.extend(optional.into_iter().filter_map(|(n, v)| Some((n, v?))).chain(impact(&stop.impact)));
            let adhesion = stop.adhesion.map(|a| [("adhesion", a.force), ("adhesionrange", a.range)]);
            let friction = stop.friction.map(|f| [("friction", f.coefficient), ("slipspeed", f.slip_speed)]);
            parameters.extend([adhesion, friction].into_iter().flatten().flatten());
            let sticks = stop.friction.and_then(|f| f.stick_stiffness);
            parameters.extend(sticks.map(|k| ("stickstiffness", k)));
            let nodes: Vec<NodeId> = [Some(stop.a), stop.b].into_iter().flatten().collect();
            self.push(&stop.name, "stop2d", "*", &nodes, &parameters);
        }
        for placed in &structure.placed {
            let Some(element) = DomainElement::ALL.iter().find(|element| element.name == placed.element) else {
                continue;
            };
            let given = element.parameters.iter().copied().zip(placed.values.iter().copied());
            let parameters: Vec<_> = given.filter(|(_, value)| *value != 0.0).chain([("oz", placed.angle)]).collect();
            self.push(&placed.name, element.name, "*", &placed.nodes, &parameters);
        }
    }
}
