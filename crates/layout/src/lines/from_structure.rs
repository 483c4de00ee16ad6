//! A structure as lines: each part as the element that makes it, at its place.

mod circuit;
mod fields;

use super::{ElementLine, ElementLines, ExactNumber, ProcessLine};
use bimorph_base::sets::Sets;
use bimorph_structure::{Beam, BeamGap, Mass, NodeId, PropertyCurve, Structure};
use std::collections::{HashMap, HashSet};
use std::f64::consts::TAU;

/// Difference of a property from the value of its curve at ambient temperature that is rounding (1).
const SAME: f64 = 1e-12;

/// Parts that no line stands for.
pub(crate) type Left = Vec<String>;

/// Converts a structure to lines, and returns the parts that no line can express.
pub(crate) fn lines(structure: &Structure) -> (ElementLines, Left) {
    let mut of = OfStructure {
        structure,
        processes: Vec::new(),
        by_key: HashMap::new(),
        lines: Vec::new(),
        left: Vec::new(),
        resistors: structure.resistors.iter().map(|r| r.name.as_str()).zip(0..).collect(),
        used_resistors: HashSet::new(),
        bows: HashMap::new(),
    };
    of.bows();
    let inside = of.gaps_with_beams();
    for (k, beam) in structure.beams.iter().enumerate() {
        if !inside.contains(beam.name.as_str()) {
            of.beam(k, beam);
        }
    }
    of.plates();
    of.links_and_springs();
    of.supports();
    of.fields();
    of.loads();
    of.circuit();
    of.islands();
    // The first node of all lies at the origin: a line that begins with it comes first, unless that would change the order of beams.
    if let Some(first) = structure.nodes.iter().find(|n| n.mechanical)
        && let Some(k) = of.lines.iter().position(|line| places(&line.model) && line.nodes[0] == first.name)
    {
        let line = of.lines.remove(k);
        of.lines.insert(0, line);
    }
    (ElementLines { processes: of.processes, elements: of.lines }, of.left)
}

/// True for elements that touch nodes and are no beams.
fn places(model: &str) -> bool {
    matches!(
        model,
        "link2d" | "spring2d" | "damper2d" | "anchor" | "hinge" | "slider" | "guide2d" | "mass2d" | "plate2d"
    )
}

/// Nodes and direction of a gap whose lower beam lies to the right of the way along the upper one: of a mirrored one, the way back.
fn unmirrored(gap: &BeamGap) -> ([NodeId; 4], f64) {
    let [a, b, c, d] = gap.nodes;
    if gap.side < 0.0 { ([b, a, d, c], gap.angle + std::f64::consts::PI) } else { (gap.nodes, gap.angle) }
}

/// Replaces numbers of a beam by the curves over temperature that it has. The resistance stays: curves change it in proportion.
fn curves(beam: &Beam, line: &mut ElementLine) {
    let ambient = beam.material.ambient_temperature;
    let mut put = |name: &str, curve: &Option<PropertyCurve>| {
        let Some(curve) = curve else { return };
        let own = line.parameters.iter().position(|(other, _)| other == name).map(|k| line.parameters.remove(k).1);
        let factor = own.map_or(1.0, |value| value / curve.at(ambient)[0]);
        // the same number but for rounding: as it was given
        let curve = if (factor - 1.0).abs() < SAME { curve.clone() } else { curve.scaled(factor) };
        let numbers: Vec<String> =
            curve.table.iter().flatten().chain(&curve.polynomial).map(|x| ExactNumber(*x).to_string()).collect();
        let function = if curve.table.is_empty() { "polynomial" } else { "table" };
        line.words.push((name.to_owned(), format!("{function}({})", numbers.join(","))));
    };
    if let Some(heater) = &beam.heater {
        put("resistivity", &heater.resistance_curve);
        put("thermcond", &heater.conductance_curve);
        put("specificheat", &heater.capacity_curve);
        put("gasconductivity", &heater.gas_curve);
    }
    if beam.heater.is_some() || beam.temperature.is_some() {
        put("thermalexpansion", &beam.material.expansion_curve);
    }
}

struct OfStructure<'a> {
    structure: &'a Structure,
    processes: Vec<ProcessLine>,
    by_key: HashMap<Vec<u64>, usize>,
    lines: Vec<ElementLine>,
    left: Left,
    resistors: HashMap<&'a str, usize>,
    used_resistors: HashSet<usize>,
    /// Rest curvatures' end moments, by beam name (N·m).
    bows: HashMap<&'a str, f64>,
}

impl<'a> OfStructure<'a> {
    fn node(&self, id: NodeId) -> String {
        self.structure.nodes[id.0].name.clone()
    }

    fn position(&self, id: NodeId) -> [f64; 2] {
        self.structure.nodes[id.0].position
    }

    fn push(&mut self, name: &str, model: &str, process: &str, nodes: &[NodeId], parameters: &[(&str, f64)]) {
        let nodes = nodes.iter().map(|id| self.node(*id)).collect();
        let parameters = parameters.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
        let (name, model, process) = (name.to_owned(), model.to_owned(), process.to_owned());
        self.lines.push(ElementLine { name, model, process, nodes, parameters, words: Vec::new() });
    }

    /// Gives the last line words.
    fn say(&mut self, words: impl IntoIterator<Item = (&'static str, &'static str)>) {
        if let Some(line) = self.lines.last_mut() {
            line.words.extend(words.into_iter().map(|(name, word)| (name.to_owned(), word.to_owned())));
        }
    }

    /// The process with these entries, new or known.
    fn process(&mut self, entries: &[(&str, f64)]) -> String {
        let key: Vec<u64> = entries.iter().flat_map(|(n, v)| [n.len() as u64, v.to_bits()]).collect();
        let next = self.processes.len();
        let index = *self.by_key.entry(key).or_insert(next);
        if index == next {
            let entries = entries.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
            self.processes.push(ProcessLine { name: format!("p{}", next + 1), entries });
        }
        self.processes[index].name.clone()
    }

    fn process_of(&mut self, beam: &Beam) -> String {
        let m = &beam.material;
        let mut entries = vec![
            ("Youngsmodulus", m.youngs_modulus),
            ("Poisson", m.poisson),
            ("density", m.density),
            ("h", beam.thickness),
        ];
        if m.viscosity > 0.0 {
            entries.extend([("viscosity", m.viscosity), ("fluid", m.fluid)]);
        }
        let optional = [
            ("thermalexpansion", m.thermal_expansion),
            ("ambienttemperature", m.ambient_temperature),
            ("stress", m.stress),
            ("strength", m.strength.unwrap_or(0.0)),
            ("fillet", m.fillet.unwrap_or(0.0)),
            ("anchorquality", m.anchor_quality.unwrap_or(0.0)),
            ("shearmodulus", m.shear_modulus.unwrap_or(0.0)),
        ];
        let heated = beam.heater.is_some() || beam.temperature.is_some();
        entries.extend(optional.into_iter().filter(|(name, v)| *v != 0.0 || (heated && *name == "thermalexpansion")));
        self.process(&entries)
    }

    /// Rest curvatures are held as pairs of moments called `BEAM.bow`.
    fn bows(&mut self) {
        let structure = self.structure;
        let ends: HashMap<&str, NodeId> = structure.beams.iter().map(|b| (b.name.as_str(), b.b)).collect();
        for load in &structure.loads {
            let Some(beam) = load.name.strip_suffix(".bow") else { continue };
            if ends.get(beam) == Some(&load.node) {
                self.bows.insert(beam, load.moment);
            }
        }
    }

    fn beam(&mut self, index: usize, beam: &'a Beam) {
        let process = self.process_of(beam);
        let mut parameters = vec![("l", beam.length), ("w", beam.width), ("oz", beam.angle)];
        let mut model = "beam2d";
        if let Some(temperature) = beam.temperature {
            parameters.push(("T", temperature));
        }
        if let Some(moment) = self.bows.get(beam.name.as_str()) {
            let bending = beam.material.youngs_modulus * beam.thickness * beam.width.powi(3) / 12.0;
            parameters.push(("curvature", moment / bending));
        }
        let resistor = self.resistors.get(beam.name.as_str()).map(|k| (*k, &self.structure.resistors[*k]));
        if let Some(heater) = &beam.heater {
            model = "beam2det";
            let conductivity = heater.conductance * beam.length / (beam.width * beam.thickness);
            parameters.extend([("R", heater.resistance), ("thermcond", conductivity)]);
            let mass = beam.material.density * beam.length * beam.width * beam.thickness;
            parameters.extend((mass > 0.0 && heater.capacity > 0.0).then(|| ("specificheat", heater.capacity / mass)));
            parameters.extend(heater.time_constant.map(|tau| ("tau", tau)));
            let laws = [
                ("TCR", heater.coefficient),
                ("TCK", heater.thermal_coefficient),
                ("TCC", heater.capacity_coefficient),
                ("emissivity", heater.emissivity),
            ];
            parameters.extend(laws.into_iter().filter(|(_, x)| *x != 0.0));
            parameters.extend(heater.substrate.map(|temperature| ("substratetemperature", temperature)));
            if let Some(gas) = &heater.gas {
                parameters.extend([("gasconductivity", gas.conductivity), ("fluid", gas.distance)]);
                parameters.push(("shapefactor", gas.shape));
            }
            if let Some(strength) = self.structure.yields.iter().find(|y| y.beam == index) {
                parameters.extend([("yieldstress", strength.stress), ("softening", strength.softening)]);
            }
        } else if let Some((k, r)) = resistor.filter(|(_, r)| (r.a, r.b) == (beam.a, beam.b)) {
            model = "beam2de";
            parameters.push(("R", r.resistance));
            self.used_resistors.insert(k);
        }
        self.push(&beam.name, model, &process, &[beam.a, beam.b], &parameters);
        if let Some(line) = self.lines.last_mut() {
            curves(beam, line);
        }
    }

    /// Plates whose mass is that of a layer, else lumped masses with the drag beside them.
    fn plates(&mut self) {
        for mass in &self.structure.masses {
            if self.outlined(mass) {
                continue;
            }
            let mut parameters = vec![("m", mass.mass)];
            if mass.inertia != 0.0 {
                parameters.push(("J", mass.inertia));
            }
            let drag = ["b", "brz"].into_iter().zip(mass.drag);
            parameters.extend(drag.filter(|(_, value)| *value != 0.0));
            self.push(&mass.name, "mass2d", "*", &[mass.node], &parameters);
        }
    }

    /// A rigid body as it is drawn: a plate, or one of another outline with the same sides; false where neither is what it is.
    fn outlined(&mut self, mass: &Mass) -> bool {
        let [l, w, angle] = mass.outline;
        if !(l > 0.0 && w > 0.0 && mass.mass > 0.0) {
            return false;
        }
        let sides = [("l", l), ("w", w), ("oz", angle)];
        let own = mass.inertia / mass.mass;
        let turned = |own: f64| (mass.drag[1] - own * mass.drag[0]).abs() <= 1e-9 * own * mass.drag[0];
        let polar = (l * l + w * w) / 12.0;
        if (own - polar).abs() <= 1e-9 * polar && turned(polar) {
            let process = self.process_of_body(mass, l * w);
            self.push(&mass.name, "plate2d", &process, &[mass.node], &sides);
            return true;
        }
        if !(own > 0.0 && turned(own)) {
            return false;
        }
        // no body of a given area has a smaller moment than a disc: its own area, where a layer gives it
        let disc = TAU * own;
        let of_layer = |b: &Beam| mass.mass / (b.material.density * b.thickness);
        let areas = self.structure.beams.iter().filter(|b| b.material.density > 0.0).map(of_layer);
        let known = areas.filter(|area| *area <= disc * (1.0 + 1e-12)).max_by(f64::total_cmp);
        let area = known.unwrap_or_else(|| (l * w).min(disc * (1.0 - 1e-9)));
        let process = self.process_of_body(mass, area);
        let outline = [("A", area), ("Ip", own * area)].into_iter().chain(sides).collect::<Vec<_>>();
        self.push(&mass.name, "body2d", &process, &[mass.node], &outline);
        true
    }

    /// The layer of a body of this area: that of a beam, or one that makes it as heavy and as damped as it is.
    fn process_of_body(&mut self, mass: &Mass, area: f64) -> String {
        let film = mass.drag[0] / area;
        let thickness = self.structure.beams.first().map_or(2e-6, |b| b.thickness);
        let known = self.structure.beams.iter().find(|b| {
            let m = &b.material;
            let own = (m.density * b.thickness * area - mass.mass).abs() <= 1e-12 * mass.mass;
            own && (m.viscosity / m.fluid - film).abs() <= 1e-12 * film
        });
        match known {
            Some(beam) => self.process_of(beam),
            None => {
                let mut entries = vec![("density", mass.mass / (area * thickness)), ("h", thickness)];
                if film > 0.0 {
                    entries.extend([("viscosity", film * thickness), ("fluid", thickness)]);
                }
                self.process(&entries)
            }
        }
    }

    fn links_and_springs(&mut self) {
        let structure = self.structure;
        let apart = |a: NodeId, b: NodeId| {
            let (p, q) = (structure.nodes[a.0].position, structure.nodes[b.0].position);
            [q[0] - p[0], q[1] - p[1]]
        };
        for link in &structure.links {
            let [dx, dy] = apart(link.a, link.b);
            let parameters = [("l", dx.hypot(dy)), ("oz", dy.atan2(dx))];
            self.push(&link.name, "link2d", "*", &[link.a, link.b], &parameters);
        }
        for spring in &structure.springs {
            let (sin, cos) = spring.angle.sin_cos();
            let [dx, dy] = apart(spring.a, spring.b);
            let along = (dx * cos + dy * sin).max(0.0);
            let place = [("l", along), ("oz", spring.angle)];
            let given = |names: [&'static str; 3], values: [f64; 3]| {
                names.into_iter().zip(values).filter(|(_, v)| *v != 0.0).chain(place).collect::<Vec<_>>()
            };
            let nodes = [spring.a, spring.b];
            let damped = spring.damping != [0.0; 3];
            if spring.stiffness != [0.0; 3] || spring.polynomial.is_some() || !damped {
                let names = ["kx2", "kx3", "ky2", "ky3", "krz2", "krz3"];
                let terms = spring.polynomial.into_iter().flatten().flatten();
                let nonlinear = names.into_iter().zip(terms).filter(|(_, value)| *value != 0.0);
                let parameters: Vec<_> =
                    given(["kx", "ky", "krz"], spring.stiffness).into_iter().chain(nonlinear).collect();
                self.push(&spring.name, "spring2d", "*", &nodes, &parameters);
            }
            if damped {
                let both = spring.stiffness != [0.0; 3] || spring.polynomial.is_some();
                let name = if both { format!("{}_damper", spring.name) } else { spring.name.clone() };
                self.push(&name, "damper2d", "*", &nodes, &given(["bx", "by", "brz"], spring.damping));
            }
        }
    }

    fn supports(&mut self) {
        let pads: HashMap<usize, [f64; 2]> = self.structure.pads.iter().map(|p| (p.support, p.size)).collect();
        for (k, support) in self.structure.supports.iter().enumerate() {
            let model = match support.held {
                [true, true, true] => "anchor",
                [true, true, false] => "hinge",
                [false, false, true] => "slider",
                [false, true, true] => "guide2d",
                _ => {
                    let names = ["x", "y", "rotation"].into_iter().zip(support.held);
                    let held: Vec<&str> = names.filter(|(_, held)| *held).map(|(name, _)| name).collect();
                    self.left.push(format!("the support `{}`, which holds {} alone", support.name, held.join(" and ")));
                    continue;
                }
            };
            let size = pads.get(&k).map(|[l, w]| [("l", *l), ("w", *w)]);
            let undercut = support.undercut.map(|undercut| ("undercut", undercut));
            let warm = support.temperature.map(|temperature| ("anchortemperature", temperature));
            let names = ["packagestrainx", "packagestrainy", "anchorx", "anchory"];
            let motion = support.motion.map(|m| names.into_iter().zip(m.strain.into_iter().chain(m.displacement)));
            let turned = support.motion.map(|m| m.rotation).filter(|rotation| *rotation != 0.0);
            let driven = support.motion.filter(|m| m.driven).map(|_| ("moves", 1.0));
            let parameters: Vec<_> = (size.into_iter().flatten().chain(undercut).chain(warm))
                .chain(motion.into_iter().flatten())
                .chain(turned.map(|rotation| ("anchorrz", rotation)))
                .chain(driven)
                .chain([("oz", support.angle)])
                .collect();
            self.push(&support.name, model, "*", &[support.node], &parameters);
        }
    }

    fn loads(&mut self) {
        for load in &self.structure.loads {
            if load.name.strip_suffix(".bow").is_some_and(|beam| self.bows.contains_key(beam)) {
                continue;
            }
            let [fx, fy] = load.force;
            let mut parameters = vec![("F", fx.hypot(fy)), ("oz", fy.atan2(fx))];
            if load.moment != 0.0 {
                parameters.push(("M", load.moment));
            }
            self.push(&load.name, "f2d", "*", &[load.node], &parameters);
        }
    }

    /// Places parts that no element connects to the first one.
    fn islands(&mut self) {
        let structure = self.structure;
        let ids: HashMap<&str, usize> = structure.nodes.iter().map(|n| n.name.as_str()).zip(0..).collect();
        let mut sets = Sets::new(structure.nodes.len());
        let placing = |line: &&ElementLine| {
            line.process != "*"
                || matches!(
                    line.model.as_str(),
                    "link2d" | "spring2d" | "damper2d" | "plategap2d" | "gap2dforce" | "comb2d" | "comb2de"
                )
        };
        let mut placed = vec![false; structure.nodes.len()];
        for line in self.lines.iter().filter(placing) {
            let nodes: Vec<usize> = line.nodes.iter().map(|n| ids[n.as_str()]).collect();
            for k in &nodes {
                placed[*k] = true;
                sets.join(nodes[0], *k);
            }
        }
        for support in &structure.supports {
            placed[support.node.0] = true;
        }
        let firsts: Vec<usize> = (0..placed.len()).filter(|k| placed[*k] && sets.first(*k) == *k).collect();
        let Some((&origin, others)) = firsts.split_first() else { return };
        let start = structure.nodes[origin].position;
        for (n, &k) in others.iter().enumerate() {
            let [x, y] = structure.nodes[k].position;
            let parameters = [("x", x - start[0]), ("y", y - start[1])];
            self.push(&format!("place{}", n + 1), "pos", "*", &[NodeId(origin), NodeId(k)], &parameters);
        }
    }
}
