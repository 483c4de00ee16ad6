//! Checks of a finished structure before any physics: loose nodes, loose parts, floating potentials, and one message
//! for each feature that the planar model omits.

use super::diagnostic_sink::DiagnosticSink;
use super::drawing::{Fact, StructureBuilder};
use super::value::short;
use bimorph_base::sets::Sets;
use bimorph_base::suggest::did_you_mean;
use bimorph_structure::BeamRows;
use bimorph_structure::{BeamGap, ElectrodeShape, Fringe, GapVoltage, NodeId, Structure};
use std::collections::HashSet;
use std::ops::RangeInclusive;

/// Most loose parts or floating nodes reported individually.
const MAX_REPORTED: usize = 3;

/// Most loose nodes reported.
const MAX_LOOSE: usize = 20;

/// Resistances that can be computed with (Ω), and conductances of heat (W/K): sums and quotients of them stay numbers.
const RESISTANCES: RangeInclusive<f64> = 1e-300..=1e300;

/// Reports what has become infinite or vanished: sizes may be in range one by one and not in their products.
pub(crate) fn finite(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    let s = &drawing.structure;
    let mut reported = HashSet::new();
    let mut check_finite = |name: &str, node: NodeId, good: bool| {
        if !good && reported.len() < MAX_REPORTED && reported.insert(name.to_owned()) {
            let message = format!("what `{name}` has in the model is not finite: its sizes are out of any range");
            let help = "check its numbers, their suffixes and exponents";
            sink.error("E060", drawing.first_named[node.0], message, help);
        }
    };
    let all = |values: &[f64]| values.iter().all(|x| x.is_finite());
    for (index, node) in s.nodes.iter().enumerate() {
        check_finite(&node.name, NodeId(index), all(&node.position));
    }
    for b in &s.beams {
        let sizes = [b.length, b.width, b.thickness];
        let products = [b.material.density * b.width * b.thickness * b.length, b.thickness * b.width.powi(3)];
        check_finite(
            &b.name,
            b.a,
            all(&sizes) && all(&products) && sizes.iter().chain([&products[1]]).all(|x| *x > 0.0),
        );
    }
    for m in &s.masses {
        check_finite(&m.name, m.node, all(&[m.mass, m.inertia, m.drag[0], m.drag[1]]));
    }
    for k in &s.springs {
        check_finite(&k.name, k.a, all(&k.stiffness) && all(&k.damping));
    }
    for p in &s.placed {
        check_finite(&p.name, p.nodes[0], all(&p.values));
    }
    for f in &s.loads {
        check_finite(&f.name, f.node, all(&f.force) && f.moment.is_finite());
    }
    for r in &s.resistors {
        check_finite(&r.name, r.a, RESISTANCES.contains(&r.resistance));
    }
    for c in &s.combs {
        check_finite(&c.name, c.a, all(&[c.gaps * c.permittivity * c.height / c.gap, c.overlap, c.parasitic]));
    }
    for g in &s.beam_gaps {
        check_finite(&g.name, g.nodes[0], all(&[g.permittivity * g.height * g.sugar_factor(), g.length, g.gap]));
    }
    for b in s.beams.iter().filter_map(|b| b.heater.as_ref().map(|h| (b, h))) {
        let conducts = RESISTANCES.contains(&b.1.resistance) && RESISTANCES.contains(&b.1.conductance);
        let gas = b.1.gas.map_or(0.0, |gas| gas.conductance(b.0.width, b.0.length));
        check_finite(
            &b.0.name,
            b.0.a,
            conducts
                && all(&[
                    b.1.time_constant.unwrap_or(0.0),
                    b.1.capacity,
                    gas,
                    b.1.coefficient,
                    b.1.thermal_coefficient,
                    b.1.capacity_coefficient,
                ]),
        );
    }
}

/// Checks a drawing whose nodes are placed.
pub(crate) fn check(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    facts(drawing, sink);
    let structure = &drawing.structure;
    let mut connected = vec![false; structure.nodes.len()];
    let mut parts = Sets::new(structure.nodes.len());
    for (a, b) in mechanical_connections(structure) {
        connected[a.0] = true;
        connected[b.0] = true;
        parts.join(a.0, b.0);
    }
    structure.placed.iter().flat_map(|placed| &placed.nodes).for_each(|node| connected[node.0] = true);
    loose_nodes(drawing, &connected, sink);
    unheld_parts(drawing, &connected, &mut parts, sink);
    floating_potentials(drawing, sink);
    gaps_between_anchors(drawing, sink);
    fringe_fields(drawing, sink);
}

/// Fringe fields beyond the range that their law was compared with the exact field in.
fn fringe_fields(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    let structure = &drawing.structure;
    let exact = |law: Option<Fringe>| matches!(law, None | Some(Fringe::Exact));
    let mut beyond = Vec::new();
    let anchored = structure.anchored();
    for gap in structure.beam_gaps.iter().filter(|gap| exact(gap.law)) {
        let fixed = gap.nodes[2..].iter().all(|node| anchored[node.0]);
        let (most, width) = match gap.shape(fixed) {
            ElectrodeShape::Plane => (5.0, gap.widths[0]),
            ElectrodeShape::Bar => (10.0, gap.mean_width()),
        };
        let [distance, width] = [gap.gap, width].map(|size| size / gap.height);
        if distance > most {
            beyond.push((
                &gap.name,
                gap.nodes[0],
                format!("the gap is {} times as wide as the parts are high", short(distance)),
            ));
        } else if !(0.01..=10.0).contains(&width) {
            beyond.push((&gap.name, gap.nodes[0], format!("the parts are {} times as wide as high", short(width))));
        }
    }
    for plate in structure.plate_gaps.iter().filter(|plate| exact(plate.law) && plate.sides[0] > 0.0) {
        let [distance, thickness] = [plate.gap, plate.thickness].map(|size| size / plate.sides[0].min(plate.sides[1]));
        if distance > 5.0 || thickness > 10.0 {
            beyond.push((&plate.name, plate.a, format!("the gap is {} times as wide as the plate", short(distance))));
        }
    }
    for comb in structure.combs.iter().filter(|comb| exact(comb.law) && comb.finite && comb.finger[1] > 0.0) {
        let [width, height] = [comb.finger[1], comb.height].map(|size| size / comb.gap);
        if !(0.25..=5.0).contains(&width) || height < 0.5 {
            let what = format!("fingers are {} gaps wide and {} gaps high", short(width), short(height));
            beyond.push((&comb.name, comb.a, what));
        }
    }
    if let Some((name, node, what)) = beyond.first() {
        let more = if beyond.len() > 1 { format!(" ({} such elements in all)", beyond.len()) } else { String::new() };
        let message = format!("the fringe field of `{name}` is beyond the range of its law: {what}{more}");
        let help = "docs/reference/elements.md has the ranges and errors; `fringe=none` leaves the field out";
        sink.warning("W026", drawing.first_named[node.0], message, help);
    }
}

/// A gap whose nodes are all anchored bends nothing, unless beams lie between them.
fn gaps_between_anchors(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    let structure = &drawing.structure;
    let anchored = structure.anchored();
    let all = |gap: &&BeamGap| gap.nodes.iter().all(|node| anchored[node.0]);
    let beams = BeamRows::new(structure);
    let held: Vec<_> = structure.beam_gaps.iter().filter(all).filter(|g| beams.along(g).next().is_none()).collect();
    if let Some(gap) = held.first() {
        let more = if held.len() > 1 { format!(" ({} such gaps in all)", held.len()) } else { String::new() };
        let message = format!(
            "`{}`: its nodes are all anchored, and no beams as long as the gap lie between them: it bends nothing{more}",
            gap.name
        );
        let help =
            "draw the beam between the gap's nodes, in a straight line, or give the gap the length `l` of that beam";
        sink.warning("W015", drawing.first_named[gap.nodes[0].0], message, help);
    }
}

fn facts(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    for noted in &drawing.facts {
        let number = short(noted.number);
        let elements = if noted.count == 1 { "1 element".to_owned() } else { format!("{} elements", noted.count) };
        let (code, message, help) = match noted.fact {
            Fact::OutOfPlane => (
                "W030",
                format!("the model is planar: out-of-plane bending and torsion are left out ({elements})"),
                "write `beam2d` (of arcs, `arc2d`) to say that this is meant",
            ),
            Fact::StrainGradient => (
                "W031",
                format!("`straingradient` bends out of the drawing plane and is ignored ({elements})"),
                "models are planar (x, y, rotation about z)",
            ),
            Fact::AmbientZero => (
                "W032",
                format!("`ambienttemperature` is 0: `T` = {number} is a temperature rise of {number} K ({elements})"),
                "set the layer's `ambienttemperature`, or give the rise as `T`",
            ),
            Fact::NoDensity => (
                "W033",
                format!("no `density`: taken as massless ({elements})"),
                "modes and transients need the layer's `density` [kg/m³]",
            ),
            Fact::OddModulus => (
                "W008",
                format!("`Youngsmodulus` = {number} Pa is that of no solid ({elements})"),
                "it is in pascals: polysilicon has 160e9",
            ),
            Fact::SmallConductivity => (
                "W034",
                format!("the layer's `thermcond` = {number} W/(m·K) is small for a conductivity ({elements})"),
                "silicon has 30 to 150 W/(m·K); SUGAR's process files hold 2.33 here, which is none",
            ),
            Fact::Degrees => (
                "W003",
                format!("angles are in radians; {number} looks like degrees ({elements})"),
                "for degrees write `deg(…)` around the number, or `uses degrees.net` in a file of such angles",
            ),
            Fact::OddDensity => (
                "W035",
                format!("`density` = {number} kg/m³ is that of no solid ({elements})"),
                "it is in kg/m³: polysilicon has 2330",
            ),
            Fact::OddStress => (
                "W036",
                format!("`stress` = {number} Pa is beyond the strength of any solid ({elements})"),
                "it is in pascals, tension positive: films have some 1e6 to 1e9",
            ),
            Fact::OddRise => (
                "W037",
                format!("a temperature of {number} K: nothing that structures are made of is solid there ({elements})"),
                "it is an absolute temperature in kelvin",
            ),
            Fact::Capacitor => (
                "W021",
                format!("capacitors are open here and left out ({elements})"),
                "`bimorph cosim` runs the netlist's circuit as it is",
            ),
            Fact::Switch => (
                "W021",
                format!("switches are open here and left out, as SUGAR's, which have no equation ({elements})"),
                "replace a closed one by `short`",
            ),
            Fact::BetweenAnchors => (
                "W038",
                format!("members out of the drawing plane between anchored nodes are left out ({elements})"),
                "they hold nothing that moves in the plane",
            ),
            Fact::Post => (
                "W038",
                format!(
                    "posts normal to the drawing plane are taken as rigid; across, this one has {number} N/m ({elements})"
                ),
                "what lies above each other moves together; compare with the stiffness of what it carries",
            ),
            Fact::Weight => (
                "W039",
                format!("the weight of `beam_link_grav` is left out; this one has {number} N ({elements})"),
                "write `beam3dlink` to say that this is meant; a port `frame.ay` moves everything",
            ),
            Fact::NoSection => (
                "W006",
                format!("a beam of width and height 0 holds nothing: it places its nodes ({elements})"),
                "write `pos` to say that this is meant",
            ),
            Fact::ReducedPermittivity => (
                "W025",
                format!(
                    "`permittivity` = {number} F/m is below that of vacuum: the gap keeps SUGAR's factor 1 + 1.12·gap/h ({elements})"
                ),
                "for a gap without fringe field write `fringe=none` and leave out `permittivity`",
            ),
            Fact::TrialGap => (
                "W039",
                format!(
                    "the field of this gap is that of `gap2de`; SUGAR's trial model has fixed sizes (100 µm by 20 µm) and conducts by R_insulator where it closes ({elements})"
                ),
                "write `gap2de` to say that this is meant",
            ),
            Fact::AnchorNodes => (
                "W039",
                format!("every node of an anchor is held; SUGAR holds the first alone ({elements})"),
                "give each its own `anchor`",
            ),
            Fact::Trapezoid => (
                "W039",
                format!(
                    "a trapezoid has its whole thickness here: area and second moment of SUGAR's macro are a third ({elements})"
                ),
                "for SUGAR's, write `beam3d` with the mean width and `h` a third",
            ),
            Fact::ArmsPlace => (
                "W039",
                format!(
                    "SUGAR places the second node as if there were no arms; this one is {number} m long ({elements})"
                ),
                "`rigidlinkbeamcloaked` is placed alike in both",
            ),
            Fact::ActiveCircuit => (
                "W022",
                format!("current sources, op-amps and controlled sources are left out here ({elements})"),
                "`bimorph cosim` runs the netlist's circuit as it is",
            ),
        };
        sink.warning(code, noted.span, message, help);
    }
}

/// Pairs of nodes that a member holds together.
fn mechanical_connections(structure: &Structure) -> impl Iterator<Item = (NodeId, NodeId)> {
    let beams = structure.beams.iter().map(|b| (b.a, b.b));
    let links = structure.links.iter().map(|l| (l.a, l.b));
    beams.chain(links).chain(structure.springs.iter().map(|s| (s.a, s.b)))
}

/// A mechanical node that no member touches and nothing holds completely.
fn loose_nodes(drawing: &StructureBuilder, connected: &[bool], sink: &mut DiagnosticSink) {
    let structure = &drawing.structure;
    let mut held = vec![[false; 3]; structure.nodes.len()];
    for support in &structure.supports {
        for (all, one) in held[support.node.0].iter_mut().zip(support.held) {
            *all |= one;
        }
    }
    let loose = |i: &usize| structure.nodes[*i].mechanical && !connected[*i] && held[*i] != [true; 3];
    for index in (0..structure.nodes.len()).filter(loose).take(MAX_LOOSE) {
        let name = &structure.nodes[index].name;
        let message = format!("node `{name}` is connected to nothing: no beam, link or spring holds it");
        let others = (0..structure.nodes.len()).filter(|&i| connected[i]).map(|i| structure.nodes[i].name.as_str());
        let help = did_you_mean(name, others, "give it a member, or remove what stands on it");
        sink.error("E070", drawing.first_named[index], message, help);
    }
}

/// A part that no support holds in any direction.
fn unheld_parts(drawing: &StructureBuilder, connected: &[bool], parts: &mut Sets, sink: &mut DiagnosticSink) {
    let structure = &drawing.structure;
    let mut held = vec![false; structure.nodes.len()];
    for support in &structure.supports {
        held[parts.first(support.node.0)] = true;
    }
    let mut reported = vec![false; structure.nodes.len()];
    let mut loose = Vec::new();
    for index in (0..structure.nodes.len()).filter(|&i| connected[i]) {
        let root = parts.first(index);
        if !held[root] && !std::mem::replace(&mut reported[root], true) {
            loose.push(index);
        }
    }
    for &index in loose.iter().take(MAX_REPORTED) {
        let name = &structure.nodes[index].name;
        let more =
            if loose.len() > MAX_REPORTED { format!(" ({} such parts in all)", loose.len()) } else { String::new() };
        let message = format!("nothing holds the part with node `{name}`: it has no anchor{more}");
        sink.warning(
            "W012",
            drawing.first_named[index],
            message,
            "without balanced loads it has no static equilibrium; add an `anchor`",
        );
    }
}

/// Potentials that no port, source or ground fixes.
fn floating_potentials(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    let structure = &drawing.structure;
    let mut nets = Sets::new(structure.nodes.len() + 1);
    let ground = structure.nodes.len();
    for resistor in &structure.resistors {
        nets.join(resistor.a.0, resistor.b.0);
    }
    for beam in structure.beams.iter().filter(|b| b.heater.is_some()) {
        nets.join(beam.a.0, beam.b.0);
    }
    for wire in &structure.wires {
        wire.nodes.iter().for_each(|node| {
            nets.join(wire.nodes[0].0, node.0);
        });
    }
    for source in &structure.voltage_sources {
        nets.join(source.plus.0, source.minus.0);
    }
    for node in &structure.electrical_grounds {
        nets.join(node.0, ground);
    }
    for port in &structure.ports {
        nets.join(port.plus.0, ground);
        if let Some(minus) = port.minus {
            nets.join(minus.0, ground);
        }
    }
    let mut reported = vec![false; structure.nodes.len() + 1];
    let mut floating = Vec::new();
    for index in (0..structure.nodes.len()).filter(|&i| structure.nodes[i].electrical) {
        let root = nets.first(index);
        if root != nets.first(ground) && !std::mem::replace(&mut reported[root], true) {
            floating.push(index);
        }
    }
    for &index in floating.iter().take(MAX_REPORTED) {
        let name = &structure.nodes[index].name;
        let more = if floating.len() > MAX_REPORTED {
            format!(" ({} such nets in all)", floating.len())
        } else {
            String::new()
        };
        // its potential is that of a circuit which the model leaves out
        let outside = structure.circuit.iter().filter(|element| element.kind.is_left_out());
        let held = outside.flat_map(|element| &element.nodes).any(|node| nets.together(node.0, index));
        let kept = if held {
            "it stays at 0 V"
        } else {
            "it keeps its charge of 0 between two other potentials, and else stays at 0 V"
        };
        let message =
            format!("the potential of node `{name}` floats: no port, source or ground fixes it, and {kept}{more}");
        let help = "connect it with `R`, or add `eground * [node] []`";
        sink.warning("W013", drawing.first_named[index], message, help);
    }
    let pairs = structure.combs.iter().map(|c| &c.voltage).chain(structure.plate_gaps.iter().map(|g| &g.voltage));
    for voltage in pairs.chain(structure.beam_gaps.iter().map(|g| &g.voltage)) {
        if let GapVoltage::Nodes(a, b) = voltage
            && a == b
        {
            let name = &structure.nodes[a.0].name;
            let message = format!("both electrodes of a gap are the node `{name}`: it never has a voltage");
            sink.warning("W014", drawing.first_named[a.0], message, "");
        }
    }
}
