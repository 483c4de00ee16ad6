//! Static equilibrium.
pub use super::NodeMotion;
use super::contact_range::within_contact_range;
use super::loose_parts;
use super::overheating::{check_heat, current_limits};
use super::weak_parts;
use super::{AnalysisError, BeamMotions, PortVoltages};
use crate::readout::signal::{Signal, SignalView};
use crate::readout::stress;
use bimorph_domains::Drive;
use bimorph_domains::anchor_force::AnchorView;
use bimorph_domains::driven_anchor::DrivenAnchor;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use bimorph_solve::equilibrium::{Equilibrium, EquilibriumOptions, LossKind, Path, StabilityLoss};
use bimorph_solve::path::{LoadPath, SourcePath};
use bimorph_structure::{Beam, MOLTEN, is_anchor_motion};
use serde::Serialize;

/// Force of a driven anchor on the mechanism.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct AnchorForce {
    /// Along x (N).
    pub fx: f64,
    /// Along y (N).
    pub fy: f64,
    /// Moment about its node (N·m).
    pub m: f64,
}

/// A static equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StaticResult {
    /// Displacement of every mechanical node, by name, in netlist order.
    pub nodes: Vec<(String, NodeMotion)>,
    /// Mean temperature of every heated or prescribed beam (K), by name.
    pub temperatures_k: Vec<(String, f64)>,
    /// Largest stress on the faces of every beam whose strength is known (Pa), by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stresses_pa: Vec<(String, f64)>,
    /// The same without the concentration at fillets, of layers with a fillet (Pa).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub nominal_stresses_pa: Vec<(String, f64)>,
    /// Force and moment with which each driven anchor moves the mechanism, by the name of its node.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub anchor_forces: Vec<(String, AnchorForce)>,
    /// Highest temperature along every heated beam (K), by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub peak_temperatures_k: Vec<(String, f64)>,
    /// Current into each port (A), by name.
    pub currents_a: Vec<(String, f64)>,
    /// Charge on each port (C), by name.
    pub charges_c: Vec<(String, f64)>,
    /// True when the part jumped before, past a fold or a bifurcation, and voltage closed a gap.
    pub pulled_in: bool,
    /// True when it jumped: it pulled in, snapped through or buckled.
    pub jumped: bool,
    /// Losses of stability from rest, in their order; `jumped` where there are any.
    pub passed: Vec<StabilityLoss>,
    /// Motions that nothing resists noticeably and no load excites; they are held where they are.
    pub free_motions: Vec<String>,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Largest estimated relative error by the mesh (1); none without an estimate.
    pub estimated_error: Option<f64>,
    /// Newton iterations over all load steps.
    pub iterations: usize,
    /// Warnings about the result, as sentences.
    pub warnings: Vec<String>,
}

impl StaticResult {
    /// How it came about, as sentences, where that is not by the shortest way.
    pub fn notes(&self) -> Vec<String> {
        notes(self.pulled_in, &self.passed, &self.free_motions)
    }
}

/// Losses of stability that a sentence names at most.
const MAX_NAMED: usize = 3;

fn notes(pulled_in: bool, passed: &[StabilityLoss], free_motions: &[String]) -> Vec<String> {
    let one = |StabilityLoss { kind, share, direction }: &StabilityLoss| {
        let kind = match kind {
            LossKind::LimitPoint => "limit point",
            LossKind::Bifurcation => "bifurcation",
        };
        let towards = if direction.is_empty() { String::new() } else { format!(" ({direction})") };
        format!("a {kind} at {share:.4} of the load{towards}")
    };
    let named: Vec<String> = passed.iter().take(MAX_NAMED).map(one).collect();
    let more = passed.len().saturating_sub(MAX_NAMED);
    let more = if more == 0 { String::new() } else { format!(" and {more} more") };
    let losses = format!("passed {}{more}", named.join(", "));
    let way = match (pulled_in, passed.is_empty()) {
        (true, _) => Some(format!("pulled in on the way to these voltages: {losses}")),
        (false, false) => {
            let branches = "`bimorph path` shows the branches";
            Some(format!("snapped through or buckled on the way to these loads: {losses}; {branches}"))
        }
        (false, true) => None,
    };
    let held = free_motions.iter().map(|motion| format!("held where it is drawn: {motion}"));
    way.into_iter().chain(held).collect()
}

/// [`StaticResult::notes`] of an equilibrium that something else starts from.
pub(crate) fn notes_at(compiled: &CompiledModel, point: &OperatingPoint) -> Vec<String> {
    let (pulled_in, _) = jump(compiled, point);
    notes(pulled_in, &point.path.passed, &point.free_motions)
}

/// Whether it pulled in, and whether it jumped at all.
fn jump(compiled: &CompiledModel, point: &OperatingPoint) -> (bool, bool) {
    let system = &compiled.parts.system;
    let jumped = !point.path.passed.is_empty();
    let touching = (0..system.members.len()).any(|g| system.touches(g, &point.q));
    (jumped && point.volts.iter().any(|v| *v != 0.0) && touching, jumped)
}

/// Finds the equilibrium that is reached from rest by raising all loads and voltages together.
///
/// # Errors
/// See [`AnalysisError`].
pub fn static_equilibrium(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<StaticResult, AnalysisError> {
    Ok(static_with_curves(compiled, voltages)?.0)
}

/// The same, with the displacement of points along every beam for pictures.
///
/// # Errors
/// See [`AnalysisError`].
pub fn static_with_curves(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
) -> Result<(StaticResult, BeamMotions), AnalysisError> {
    let point = operating_point(compiled, voltages)?;
    Ok((result_at(compiled, &point), beam_motions(compiled, &point.q)))
}

/// Result at an equilibrium.
pub(crate) fn result_at(compiled: &CompiledModel, point: &OperatingPoint) -> StaticResult {
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    let port = |p: usize| electrics.names[p].clone();
    let charge = |p: usize| {
        (0..point.volts.len())
            .map(|g| electrics.gap_rows[(g, p)] * system.charge(g, &point.q, &point.volts))
            .sum::<f64>()
    };
    let (pulled_in, jumped) = jump(compiled, point);
    let electrical = electrical(compiled, &point.sources, &point.rise);
    StaticResult {
        nodes: node_motions(compiled, &point.q),
        temperatures_k: electrical.temperatures_k,
        stresses_pa: stresses(compiled, point).map(|(beam, stress)| (beam.name.clone(), stress)).collect(),
        nominal_stresses_pa: nominal_stresses(compiled, point),
        anchor_forces: anchor_forces(compiled, point),
        peak_temperatures_k: electrical.peak_temperatures_k,
        currents_a: electrical.currents_a,
        charges_c: (0..electrics.ports).map(|p| (port(p), charge(p))).collect(),
        pulled_in,
        jumped,
        passed: point.path.passed.clone(),
        free_motions: point.free_motions.clone(),
        unknowns: system.model.unknowns(),
        estimated_error: compiled.order.estimated_error,
        iterations: point.path.iterations,
        warnings: Vec::new(),
    }
}

/// Largest stress of every beam whose strength is known (Pa).
fn stresses<'a>(compiled: &'a CompiledModel, point: &'a OperatingPoint) -> impl Iterator<Item = (&'a Beam, f64)> {
    let known = compiled.structure.beams.iter().enumerate();
    let known = known.filter(|(k, beam)| beam.material.strength.is_some() && !compiled.parts.stressed[*k].rigid);
    known.filter_map(|(k, beam)| Some((beam, stress::largest(compiled, k, &point.q, &point.rise)?.value())))
}

/// The same without the concentration at fillets, of beams that have some.
fn nominal_stresses(compiled: &CompiledModel, point: &OperatingPoint) -> Vec<(String, f64)> {
    let beams = compiled.structure.beams.iter().zip(&compiled.parts.stressed).enumerate();
    let known = beams.filter(|(_, (beam, stressed))| beam.material.strength.is_some() && !stressed.rigid);
    let filleted = known.filter(|(_, (_, stressed))| stressed.fillets.iter().any(Option::is_some));
    let found = filleted.filter_map(|(k, (beam, _))| {
        Some((beam.name.clone(), stress::nominal(compiled, k, &point.q, &point.rise)?.value()))
    });
    found.collect()
}

/// Forces of driven anchors.
fn anchor_forces(compiled: &CompiledModel, point: &OperatingPoint) -> Vec<(String, AnchorForce)> {
    let system = &compiled.parts.system;
    if system.anchors.is_empty() {
        return Vec::new();
    }
    let (drive, still) = (point.drive(compiled), vec![Pose::zeros(); point.q.len()]);
    let state = AnchorView { q: &point.q, v: &still, drive: &drive };
    let force = |(k, anchor): (usize, &DrivenAnchor)| {
        let found = system.anchor_force(k, &state);
        Some((anchor.node.clone()?, AnchorForce { fx: found.x, fy: found.y, m: found.z }))
    };
    system.anchors.iter().enumerate().filter_map(force).collect()
}

/// The beam whose stress exceeds its strength by the largest factor, as a sentence.
pub(crate) fn too_stressed(compiled: &CompiledModel, point: &OperatingPoint) -> Option<String> {
    let over = |(beam, stress): (&'_ Beam, f64)| stress / beam.material.strength.unwrap_or(f64::INFINITY);
    let worst = stresses(compiled, point).max_by(|a, b| over(*a).total_cmp(&over(*b)))?;
    let (beam, stress) = worst;
    let strength = beam.material.strength.filter(|strength| stress > *strength)?;
    Some(format!(
        "the stress in `{}` is {stress:.3e} Pa, above the strength of its layer, {strength:.3e} Pa",
        beam.name
    ))
}

/// Source voltages and temperature rises, without any mechanics.
pub(crate) struct ElectricalSolution {
    pub(crate) temperatures_k: Vec<(String, f64)>,
    pub(crate) peak_temperatures_k: Vec<(String, f64)>,
    pub(crate) currents_a: Vec<(String, f64)>,
}

/// Temperatures of heated or prescribed beams and currents into ports.
pub(crate) fn electrical(compiled: &CompiledModel, sources: &[f64], rise: &[f64]) -> ElectricalSolution {
    let structure = &compiled.structure;
    let electrics = &compiled.parts.system.electrics;
    let view = SignalView { q: &[], v: &[], rise, volts: &[] };
    let temperatures_k = (structure.beams.iter().enumerate())
        .filter(|(_, b)| b.heater.is_some() || b.temperature.is_some())
        .map(|(index, b)| {
            let heater = compiled.parts.heaters.iter().position(|&h| h == index);
            let rest = b.temperature.unwrap_or(b.material.ambient_temperature);
            (b.name.clone(), heater.map_or(rest, |k| Signal::Temperature(k).value(compiled, &view)))
        })
        .collect();
    let currents_a = electrics.names.iter().cloned().zip(electrics.port_currents(sources, rise)).collect();
    let heaters = &electrics.heating.heaters;
    let peaks = compiled.parts.heaters.iter().zip(heaters).zip(electrics.heating.peaks(sources));
    let peak_temperatures_k = peaks.map(|((beam, h), peak)| (structure.beams[*beam].name.clone(), h.ambient + peak));
    ElectricalSolution { temperatures_k, peak_temperatures_k: peak_temperatures_k.collect(), currents_a }
}

/// Cause of the softening of an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SofteningCause {
    /// Forces in the part: it buckles.
    Stress,
    /// Voltages: without them it has most of its stiffness.
    Voltage,
    /// Both.
    Both,
}

/// An equilibrium with what it was found at.
#[derive(Debug, Clone, Default)]
pub struct OperatingPoint {
    /// Displacements in elimination order ((m), (rad)).
    pub q: Vec<Pose>,
    /// Values of the sources.
    pub sources: Vec<f64>,
    /// Temperature rise of each heater (K).
    pub rise: Vec<f64>,
    /// Voltage of each gap (V).
    pub volts: Vec<f64>,
    /// How the equilibrium was reached.
    pub path: Path,
    /// Motions that nothing holds.
    pub free_motions: Vec<String>,
    /// The beam that bends most in the softest motion, and the cause, where the load is within 1 % of buckling or pull-in.
    pub near_buckling: Option<(String, SofteningCause)>,
}

impl OperatingPoint {
    /// Its drive.
    pub(crate) fn drive(&self, compiled: &CompiledModel) -> Drive {
        let electrics = &compiled.parts.system.electrics;
        let (mut rise, mut drive) = (self.rise.clone(), electrics.drive());
        electrics.steady(&self.sources, &mut rise, &mut drive);
        drive
    }

    /// At rest as drawn and without heat of currents, with the voltages on: where a run begins.
    pub(crate) fn rest(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<Self, AnalysisError> {
        let system = &compiled.parts.system;
        let electrics = &system.electrics;
        let sources = source_vector(compiled, voltages)?;
        let rise = electrics.heating.rest();
        let mut drive = electrics.drive();
        electrics.apply(&sources, &rise, &mut drive);
        let q = vec![Pose::zeros(); system.bodies()];
        Ok(Self { q, sources, rise, volts: drive.volts, ..Self::default() })
    }
}

/// The equilibrium reached from rest.
pub fn operating_point(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<OperatingPoint, AnalysisError> {
    let sources = source_vector(compiled, voltages)?;
    let rest = vec![0.0; sources.len()];
    let q = vec![Pose::zeros(); compiled.parts.system.bodies()];
    let options = EquilibriumOptions::with_side(compiled.options.other_branch);
    settle(compiled, q, sources, (&rest, [0.0, 1.0]), options)
}

/// The equilibrium next to `q`. If there is none, the equilibrium reached from rest, and then true.
pub(crate) fn operating_point_near(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
    q: Vec<Pose>,
) -> Result<(OperatingPoint, bool), AnalysisError> {
    // where friction holds parts at rest, an equilibrium depends on the way to it
    if compiled.parts.system.sticks() {
        return Ok((operating_point(compiled, voltages)?, true));
    }
    let sources = source_vector(compiled, voltages)?;
    // another branch than that of `q` is of no use
    let options = EquilibriumOptions { stop_at_fold: true, ..Default::default() };
    match settle(compiled, q, sources.clone(), (&sources, [1.0, 1.0]), options) {
        Ok(point) if point.path.reached == 1.0 => Ok((point, false)),
        _ => Ok((operating_point(compiled, voltages)?, true)),
    }
}

/// Follows the path of sources from `from` to `sources` and of the loads' share, beginning at `q`.
fn settle(
    compiled: &CompiledModel,
    mut q: Vec<Pose>,
    sources: Vec<f64>,
    (from, loads): (&[f64], [f64; 2]),
    options: EquilibriumOptions,
) -> Result<OperatingPoint, AnalysisError> {
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    let mut solver = Equilibrium::new(system, options);
    let path = SourcePath::new(electrics, from, &sources, loads);
    let mut end = electrics.drive();
    path.at(1.0, &mut end);
    let energised = |gap: usize| electrics.is_charged(gap, &end.volts);
    let (path, held_weakly) = match weak_parts::held(system) {
        Some((held, parts)) => {
            let found = solver.follow(&held, &path, &mut q)?;
            (found, weak_parts::sentences(system, &held, &parts, &q))
        }
        None => match solver.follow(system, &path, &mut q) {
            Ok(found) => (found, Vec::new()),
            // a gap pressed beyond its law is the reason where there is one
            Err(error) => {
                return Err(within_contact_range(compiled, &q, energised).err().unwrap_or_else(|| error.into()));
            }
        },
    };
    if let Some(loose) = loose_parts::unbalanced(system, &q, &end) {
        return Err(SolveError::singular(system, loose).into());
    }
    within_contact_range(compiled, &q, energised)?;
    let mut free_motions = loose_parts::free_motions(system, solver.held());
    free_motions.extend(held_weakly);
    Ok(settled(compiled, q, sources, path, free_motions))
}

/// The equilibrium `q` with what it was found at, sources steady.
pub(super) fn settled(
    compiled: &CompiledModel,
    q: Vec<Pose>,
    sources: Vec<f64>,
    path: Path,
    free_motions: Vec<String>,
) -> OperatingPoint {
    let electrics = &compiled.parts.system.electrics;
    let mut drive = electrics.drive();
    let mut rise = vec![0.0; electrics.heating.states()];
    electrics.steady(&sources, &mut rise, &mut drive);
    OperatingPoint { q, sources, rise, volts: drive.volts, path, free_motions, near_buckling: None }
}

/// Largest voltage of a port (V), as of those that are searched.
const MAX_VOLTS: f64 = 1e9;
/// Largest displacement of an anchor (m): beyond any structure.
const MAX_DISPLACEMENT: f64 = 1.0;
/// Largest rotation of an anchor (rad): a hundred turns and more.
const MAX_ROTATION: f64 = 1e3;

/// Warning about beams that the current heats beyond the strength of any solid.
pub(crate) fn too_hot(compiled: &CompiledModel, point: &OperatingPoint) -> Option<String> {
    let (heaters, beams) = (&compiled.parts.heaters, &compiled.structure.beams);
    let (beam, rise) = (heaters.iter().zip(&point.rise)).max_by(|a, b| a.1.total_cmp(b.1))?;
    let beam = &beams[*beam];
    (*rise > MOLTEN).then(|| {
        let there = beam.material.ambient_temperature + rise;
        let limits = current_limits(compiled, &point.sources);
        format!("`{}` comes to {there:.0} K: nothing that structures are made of is solid there{limits}", beam.name)
    })
}

/// The source vector for voltages by port name.
pub(crate) fn source_vector(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<Vec<f64>, AnalysisError> {
    let electrics = &compiled.parts.system.electrics;
    let mut ports = vec![None; electrics.ports];
    let mut anchors: Vec<(usize, f64)> = Vec::new();
    for (name, volts) in voltages {
        if let Some(source) = compiled.parts.system.anchor_source(name) {
            check_motion(compiled, (name, source), *volts)?;
            if let Some((_, before)) = anchors.iter().find(|(known, _)| *known == source) {
                let detail = format!("given twice, {before} and {volts}");
                return Err(AnalysisError::BadRequest { what: format!("motion \"{name}\""), detail });
            }
            anchors.push((source, *volts));
            continue;
        }
        let port = compiled.structure.port(name).ok_or_else(|| AnalysisError::BadRequest {
            what: format!("port \"{name}\""),
            detail: match electrics.ports {
                _ if is_anchor_motion(name) => format!(
                    "no driven anchor has that input; give the anchor `moves=1`{}",
                    driven(compiled).map(|known| format!("; there are {known}")).unwrap_or_default()
                ),
                0 => "the netlist has no ports; add one with `NAME port * [node] []`".into(),
                n => format!("the netlist's ports are {}", electrics.names[..n].join(", ")),
            },
        })?;
        let refused =
            |detail: String| AnalysisError::BadRequest { what: format!("voltage of port \"{name}\""), detail };
        if !volts.is_finite() {
            return Err(refused(format!("{volts} is not a finite number of volts")));
        }
        if volts.abs() > MAX_VOLTS {
            return Err(refused(format!("expected at most {MAX_VOLTS:e} V, got {volts:e}")));
        }
        if let Some(before) = ports[port].replace(*volts) {
            return Err(refused(format!("given twice, {before} V and {volts} V")));
        }
    }
    let ports: Vec<f64> = ports.into_iter().map(Option::unwrap_or_default).collect();
    let mut sources = vec![0.0; electrics.sources()];
    electrics.fill_sources(&ports, &mut sources);
    anchors.into_iter().for_each(|(source, value)| sources[source] = value);
    check_heat(compiled, electrics, &sources)?;
    Ok(sources)
}

/// The motions of driven anchors by name; none without such an anchor.
pub(crate) fn driven(compiled: &CompiledModel) -> Option<String> {
    let electrics = &compiled.parts.system.electrics;
    let names = electrics.names.get(electrics.voltages()..).filter(|names| !names.is_empty())?;
    Some(names.join(", "))
}

/// Checks a displacement (m) or a rotation (rad) of an anchor.
///
/// # Errors
/// [`AnalysisError::BadRequest`].
pub(crate) fn check_motion(
    compiled: &CompiledModel,
    (name, source): (&str, usize),
    value: f64,
) -> Result<(), AnalysisError> {
    let turns = compiled.parts.system.anchor_input(source).is_some_and(|(_, direction)| direction == 2);
    let (most, unit) = if turns { (MAX_ROTATION, "rad") } else { (MAX_DISPLACEMENT, "m") };
    if value.abs() <= most {
        return Ok(());
    }
    let detail = format!("expected at most {most:e} {unit}, got {value:e}");
    Err(AnalysisError::BadRequest { what: format!("motion \"{name}\""), detail })
}

/// Checks port voltages: each is that of a port, given once, finite and within the range.
///
/// # Errors
/// [`AnalysisError::BadRequest`] with the port.
pub fn check_voltages(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<(), AnalysisError> {
    source_vector(compiled, voltages).map(|_| ())
}

/// Displacement of every mechanical node, by name.
pub(crate) fn node_motions(compiled: &CompiledModel, q: &[Pose]) -> Vec<(String, NodeMotion)> {
    let linear = compiled.parts.system.model.linear;
    (compiled.structure.nodes.iter().zip(&compiled.parts.nodes))
        .filter_map(|(node, point)| {
            let point = (*point)?;
            let moved = point.displacement(q, linear);
            Some((node.name.clone(), NodeMotion { x: moved.x, y: moved.y, rz: point.rotation(q) }))
        })
        .collect()
}

/// Displacement of points along every beam, ends included.
pub(crate) fn beam_motions(compiled: &CompiledModel, q: &[Pose]) -> BeamMotions {
    let linear = compiled.parts.system.model.linear;
    let at = |point: &bimorph_domains::MaterialPoint| {
        let moved = point.displacement(q, linear);
        NodeMotion { x: moved.x, y: moved.y, rz: point.rotation(q) }
    };
    compiled.parts.beams.iter().map(|points| points.iter().map(at).collect()).collect()
}
