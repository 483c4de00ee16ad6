//! Quantities that can be read from a state by name.

use super::expression::{Expression, Quantity};
use super::{ReadoutError, stress};
use bimorph_base::suggest::nearest;
use bimorph_domains::Domain;
use bimorph_domains::anchor_force::AnchorView;
use bimorph_domains::contact_resistance::conductance;
use bimorph_domains::{Drive, MaterialPoint};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::{self, DOF, Pose};
use bimorph_multibody::{BodyId, Model};
use bimorph_structure::OhmicContact;

/// A quantity of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signal {
    /// Displacement of a node: direction 0 x, 1 y, 2 rotation.
    Displacement(MaterialPoint, usize),
    /// Rate of a node's displacement.
    Rate(MaterialPoint, usize),
    /// Mean temperature of heater k (K).
    Temperature(usize),
    /// A temperature that the netlist prescribes (K).
    Prescribed(f64),
    /// Largest stress on the faces of a beam, along all of it, with the concentration at its fillets (Pa).
    Stress(usize),
    /// Force with which the sides of gap g bear on each other (N).
    Bearing(usize),
    /// Conductance of the ohmic contact of gap g (S).
    Conductance(usize, OhmicContact),
    /// Charge of gap g (C).
    Charge(usize),
    /// Distance left in gap g (m).
    Distance(usize),
    /// Capacitance of gap g (F).
    Capacitance(usize),
    /// Force with which the voltage closes gap g (N).
    Pull(usize),
    /// Force with which a driven anchor moves the mechanism along x (0) or y (1) (N), or its moment (2) (N·m).
    AnchorForce(usize, usize),
}

/// State, or change of a state, that signals are read from.
#[derive(Debug, Clone, Copy)]
pub struct SignalView<'a> {
    /// Displacements.
    pub q: &'a [Pose],
    /// Rates.
    pub v: &'a [Pose],
    /// Rise of each heater (K).
    pub rise: &'a [f64],
    /// Voltage of each gap (V).
    pub volts: &'a [f64],
}

impl Signal {
    /// Finds a signal by name: `NODE.x|y|rz|vx|vy|vrz`, the same of `BEAM[k]`, the k-th point along a beam from 0, `BEAM.T`, `BEAM.stress`,
    /// `GAP.q`, `GAP.gap`, `GAP.C`, `GAP.F`, `GAP.N`, `STOP.G`, and `NODE.fx|fy|m` of a driven anchor.
    ///
    /// # Errors
    /// [`ReadoutError::UnknownSignal`] with what would be understood.
    pub fn find(compiled: &CompiledModel, name: &str) -> Result<Self, ReadoutError> {
        Self::lookup(compiled, name)
            .ok_or_else(|| ReadoutError::UnknownSignal { name: name.to_owned(), hint: hint(compiled, name) })
    }

    fn lookup(compiled: &CompiledModel, name: &str) -> Option<Self> {
        let (part, quantity) = name.rsplit_once('.')?;
        if let Some((direction, rate)) = direction(quantity) {
            let point = match compiled.structure.node(part) {
                Some(node) => compiled.parts.nodes[node.0]?,
                None => along_beam(compiled, part)?,
            };
            return Some(if rate { Self::Rate(point, direction) } else { Self::Displacement(point, direction) });
        }
        if let Some(direction) = ANCHOR_FORCES.iter().position(|force| *force == quantity) {
            return Some(Self::AnchorForce(compiled.parts.system.anchor_at(part)?, direction));
        }
        let gap = || compiled.parts.gap_names.iter().position(|n| n == part);
        match quantity {
            "q" => gap().map(Self::Charge),
            "gap" => gap().map(Self::Distance),
            "C" => gap().map(Self::Capacitance),
            "F" => gap().map(Self::Pull),
            "N" => gap().map(Self::Bearing),
            "G" => {
                let stop = compiled.structure.stops.iter().find(|stop| stop.name == part)?;
                Some(Self::Conductance(gap()?, stop.ohmic?))
            }
            "stress" => {
                let beam = compiled.structure.beams.iter().position(|b| b.name == part)?;
                let known = !compiled.parts.stressed[beam].rigid;
                known.then_some(Self::Stress(beam))
            }
            "T" => {
                let beam = compiled.structure.beams.iter().position(|b| b.name == part)?;
                match compiled.parts.heaters.iter().position(|&b| b == beam) {
                    Some(heater) => Some(Self::Temperature(heater)),
                    None => {
                        let b = &compiled.structure.beams[beam];
                        Some(Self::Prescribed(b.temperature.unwrap_or(b.material.ambient_temperature)))
                    }
                }
            }
            _ => None,
        }
    }

    /// Its value in a state.
    pub fn value(&self, compiled: &CompiledModel, state: &SignalView<'_>) -> f64 {
        let system = &compiled.parts.system;
        let linear = system.model.linear;
        match *self {
            Self::Displacement(p, 2) => p.rotation(state.q),
            Self::Displacement(p, d) => p.displacement(state.q, linear)[d],
            Self::Rate(p, 2) => Model::pose(state.v, p.body).z,
            Self::Rate(p, d) => point_rate(p, state.q, state.v, linear)[d],
            Self::Temperature(k) => system.electrics.heating.heaters[k].ambient + state.rise[k],
            Self::Prescribed(t) => t,
            Self::Stress(beam) => {
                stress::largest(compiled, beam, state.q, state.rise).map_or(0.0, |found| found.value())
            }
            Self::Bearing(g) => system.bearing(g, state.q),
            Self::Conductance(g, metals) => conductance(&metals, system.bearing(g, state.q)).0,
            Self::Charge(g) => system.charge(g, state.q, state.volts),
            Self::Distance(g) => system.distance(g, state.q),
            Self::Capacitance(g) => system.capacitance(g, state.q),
            Self::Pull(g) => system.pull(g, state.q, system.gap_voltages(state.q, state.volts)[g]),
            Self::AnchorForce(anchor, direction) => {
                let drive = drive_of(compiled, state, 1.0);
                system.anchor_force(anchor, &AnchorView { q: state.q, v: state.v, drive: &drive })[direction]
            }
        }
    }

    /// Its change with a change of the state.
    pub fn slope(&self, compiled: &CompiledModel, state: &SignalView<'_>, change: &SignalView<'_>) -> f64 {
        let system = &compiled.parts.system;
        let linear = system.model.linear;
        match *self {
            Self::Displacement(p, 2) => p.rotation(change.q),
            Self::Displacement(p, d) => point_rate(p, state.q, change.q, linear)[d],
            Self::Rate(p, 2) => Model::pose(change.v, p.body).z,
            Self::Rate(p, d) => {
                let (q, v, turned) =
                    (Model::pose(state.q, p.body), Model::pose(state.v, p.body), Model::pose(change.q, p.body));
                let (_, bend) = planar::point_turn(&q, p.arm, linear);
                point_rate(p, state.q, change.v, linear)[d] + bend[d] * turned.z * v.z
            }
            Self::Temperature(k) => change.rise[k],
            Self::Prescribed(_) => 0.0,
            Self::Stress(beam) => stress::largest(compiled, beam, state.q, state.rise)
                .map_or(0.0, |found| found.slope(compiled, state.q, change.q, change.rise)),
            Self::Bearing(g) => system.bearing_slope(g, state.q, change.q),
            Self::Conductance(g, metals) => {
                conductance(&metals, system.bearing(g, state.q)).1 * system.bearing_slope(g, state.q, change.q)
            }
            Self::Charge(g) => system.charge_slope(g, (state.q, state.volts), (change.q, Some(change.volts))),
            Self::Distance(g) => system.distance_slope(g, state.q, change.q),
            Self::Capacitance(g) => system.capacitance_slope(g, state.q, change.q),
            Self::Pull(g) => {
                let volts = system.gap_voltages(state.q, state.volts);
                let moved = system.gap_voltage_slopes((state.q, state.volts), (change.q, change.volts));
                system.pull_slope(g, state.q, volts[g], change.q, moved[g])
            }
            Self::AnchorForce(anchor, direction) => {
                let (drive, moved) = (drive_of(compiled, state, 1.0), drive_of(compiled, change, 0.0));
                let at = AnchorView { q: state.q, v: state.v, drive: &drive };
                let by = AnchorView { q: change.q, v: change.v, drive: &moved };
                system.anchor_force_change(anchor, &at, &by)[direction]
            }
        }
    }
}

impl Quantity for Signal {
    fn unit(&self) -> &'static str {
        match self {
            Self::Displacement(_, 2) => "rad",
            Self::Displacement(..) | Self::Distance(_) => "m",
            Self::Rate(_, 2) => "rad/s",
            Self::Rate(..) => "m/s",
            Self::Temperature(_) | Self::Prescribed(_) => "K",
            Self::Charge(_) => "C",
            Self::Capacitance(_) => "F",
            Self::AnchorForce(_, 2) => "N·m",
            Self::Pull(_) | Self::Bearing(_) | Self::AnchorForce(..) => "N",
            Self::Conductance(..) => "S",
            Self::Stress(_) => "Pa",
        }
    }
}

impl Expression<Signal> {
    /// Finds a signal by name, see [`Signal::find`], or a sum of them.
    ///
    /// # Errors
    /// [`ReadoutError::UnknownSignal`] with what would be understood, [`ReadoutError::BadExpression`].
    pub fn of_state(compiled: &CompiledModel, text: &str) -> Result<Self, ReadoutError> {
        Self::find(text, |name| Signal::find(compiled, name))
    }

    /// Its value in a state.
    pub fn value(&self, compiled: &CompiledModel, state: &SignalView<'_>) -> f64 {
        self.sum(|signal| signal.value(compiled, state))
    }

    /// Its change with a change of the state.
    pub fn slope(&self, compiled: &CompiledModel, state: &SignalView<'_>, change: &SignalView<'_>) -> f64 {
        self.sum(|signal| signal.slope(compiled, state, change))
    }
}

/// Every signal of a model by name, in the order of the drawing: of nodes that can move, beams and gaps.
pub fn names(compiled: &CompiledModel) -> Vec<String> {
    let moves = |i: usize| compiled.parts.nodes[i].is_some_and(|p| matches!(p.body, BodyId::Free(_)));
    let nodes = compiled.structure.nodes.iter().enumerate().filter(|(i, _)| moves(*i));
    let motions = nodes.flat_map(|(_, n)| DIRECTIONS.map(|quantity| format!("{}.{quantity}", n.name)));
    let beams = compiled.structure.beams.iter().zip(&compiled.parts.stressed);
    let of_beams = beams.flat_map(|(b, stressed)| {
        let known = !stressed.rigid;
        [Some("T"), known.then_some("stress")].into_iter().flatten().map(|quantity| format!("{}.{quantity}", b.name))
    });
    let gaps = compiled.parts.gap_names.iter();
    let of_gaps = gaps.enumerate().flat_map(|(g, gap)| {
        let system = &compiled.parts.system;
        let fingers = system.members[g].side_room().is_some();
        let bears = fingers || system.touching(g).is_some();
        let conducts = compiled.structure.stops.iter().any(|stop| stop.name == *gap && stop.ohmic.is_some());
        let own = [bears.then_some("N"), conducts.then_some("G")];
        let quantities = ["gap", "q", "C", "F"].map(Some).into_iter().chain(own);
        quantities.flatten().map(|quantity| format!("{gap}.{quantity}")).collect::<Vec<_>>()
    });
    let driven = compiled.structure.driven_anchors().filter(|node| compiled.parts.system.anchor_at(node).is_some());
    let of_anchors = driven.flat_map(|node| ANCHOR_FORCES.map(|force| format!("{node}.{force}")));
    motions.chain(of_beams).chain(of_gaps).chain(of_anchors).collect()
}

/// Components of the force of a driven anchor.
pub(crate) const ANCHOR_FORCES: [&str; DOF] = ["fx", "fy", "m"];

/// Voltages of gaps and free strains of a state, with a fraction of built-in strains (1), or their change.
fn drive_of(compiled: &CompiledModel, state: &SignalView<'_>, load: f64) -> Drive {
    let electrics = &compiled.parts.system.electrics;
    let mut drive = electrics.drive();
    drive.volts.copy_from_slice(state.volts);
    electrics.expand(state.rise, &mut drive.expansion);
    drive.load = load;
    drive
}

/// Components of the motion of a node: displacements, then rates.
const DIRECTIONS: [&str; 2 * DOF] = ["x", "y", "rz", "vx", "vy", "vrz"];

/// Direction and kind (true: rate) of the motion that `x`, `y`, `rz`, `vx`, `vy` and `vrz` stand for.
fn direction(quantity: &str) -> Option<(usize, bool)> {
    DIRECTIONS.iter().position(|n| *n == quantity).map(|k| (k % DOF, k >= DOF))
}

/// Node, direction and kind (true: rate) of a signal of a node.
pub(crate) fn node_signal(compiled: &CompiledModel, name: &str) -> Option<(usize, usize, bool)> {
    let (part, quantity) = name.rsplit_once('.')?;
    let (direction, rate) = direction(quantity)?;
    Some((compiled.structure.node(part)?.0, direction, rate))
}

/// Rate of a material point when its body moves at `v` (or its first-order change when the body's pose changes by `v`).
fn point_rate(p: MaterialPoint, q: &[Pose], v: &[Pose], linear: bool) -> nalgebra::Vector2<f64> {
    let (q, v) = (Model::pose(q, p.body), Model::pose(v, p.body));
    let (turn, _) = planar::point_turn(&q, p.arm, linear);
    nalgebra::Vector2::new(v.x, v.y) + turn * v.z
}

/// The point `BEAM[k]`.
fn along_beam(compiled: &CompiledModel, name: &str) -> Option<MaterialPoint> {
    let (beam, number) = name.strip_suffix(']')?.rsplit_once('[')?;
    let beam = compiled.structure.beams.iter().position(|b| b.name == beam)?;
    compiled.parts.beams[beam].get(number.parse::<usize>().ok()?).copied()
}

/// Suggestions for a wrong name.
fn hint(compiled: &CompiledModel, name: &str) -> String {
    let part = name.rsplit_once('.').map_or(name, |(part, _)| part);
    let nodes: Vec<&str> = compiled.structure.nodes.iter().filter(|n| n.mechanical).map(|n| n.name.as_str()).collect();
    if nodes.contains(&part) {
        let forces = if compiled.parts.system.anchor_at(part).is_some() { ", .fx, .fy, .m" } else { "" };
        return format!("\"{part}\" is a node: use {part}.x, .y, .rz{forces}, .vx, .vy or .vrz");
    }
    let beams = compiled.structure.beams.iter().map(|b| b.name.as_str());
    let known: Vec<&str> =
        nodes.into_iter().chain(beams).chain(compiled.parts.gap_names.iter().map(String::as_str)).collect();
    let expected = "expected NODE.x|y|rz|vx|vy|vrz, BEAM.T|stress, GAP.q|gap|C|F|N|G";
    if let Some((near, (_, quantity))) = nearest(part, known.iter().copied()).zip(name.rsplit_once('.')) {
        return format!("no node, beam or gap of that name; did you mean {near}.{quantity}? ({expected})");
    }
    let close: Vec<&str> = known.iter().copied().filter(|k| k.contains(part) || part.contains(*k)).take(5).collect();
    let shown = if close.is_empty() { known.into_iter().take(8).collect::<Vec<_>>() } else { close };
    format!("no node, beam or gap of that name ({expected}; there is {})", shown.join(", "))
}
