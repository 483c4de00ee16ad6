//! Results of analyses.

use super::{Violation, named, number, pairs};
use crate::proto;
use bimorph_analysis::mode_quality::ModeLoss;
use bimorph_analysis::modes::ModesResult;
use bimorph_analysis::pull_in::PullInResult;
use bimorph_analysis::statics::{AnchorForce, NodeMotion, StaticResult};
use bimorph_analysis::transient::{CrossingEvent, Statistics, TransientResult, Until};
use bimorph_solve::equilibrium::{LossKind, StabilityLoss};
use bimorph_solve::event::Direction;
use bimorph_solve::method::SolverCounters;

fn size(n: u64) -> usize {
    usize::try_from(n).unwrap_or(usize::MAX)
}

/// Displacements of nodes as they travel.
pub fn nodes_to_wire(nodes: &[(String, NodeMotion)]) -> Vec<proto::NodeMotion> {
    let node = |(name, m): &(String, NodeMotion)| proto::NodeMotion { name: name.clone(), x: m.x, y: m.y, rz: m.rz };
    nodes.iter().map(node).collect()
}

/// Displacements of nodes back.
pub fn nodes_from_wire(nodes: Vec<proto::NodeMotion>) -> Vec<(String, NodeMotion)> {
    nodes.into_iter().map(|n| (n.name, NodeMotion { x: n.x, y: n.y, rz: n.rz })).collect()
}

/// A static equilibrium as it travels, with the permanent strains of beams by name (1).
pub fn static_to_wire(result: &StaticResult, strains: &[(String, f64)]) -> proto::StaticResponse {
    proto::StaticResponse {
        nodes: nodes_to_wire(&result.nodes),
        temperatures_k: named(&result.temperatures_k),
        stresses_pa: named(&result.stresses_pa),
        currents_a: named(&result.currents_a),
        charges_c: named(&result.charges_c),
        pulled_in: result.pulled_in,
        jumped: result.jumped,
        passed: result.passed.iter().map(passed_to_wire).collect(),
        free_motions: result.free_motions.clone(),
        unknowns: result.unknowns as u64,
        iterations: result.iterations as u64,
        estimated_error: result.estimated_error,
        warnings: result.warnings.clone(),
        permanent_strains: named(strains),
        peak_temperatures_k: named(&result.peak_temperatures_k),
        nominal_stresses_pa: named(&result.nominal_stresses_pa),
        anchor_forces: result.anchor_forces.iter().map(anchor_force_to_wire).collect(),
    }
}

fn anchor_force_to_wire((name, force): &(String, AnchorForce)) -> proto::AnchorForce {
    proto::AnchorForce { name: name.clone(), fx: force.fx, fy: force.fy, m: force.m }
}

fn anchor_force_from_wire(wire: proto::AnchorForce) -> (String, AnchorForce) {
    (wire.name, AnchorForce { fx: wire.fx, fy: wire.fy, m: wire.m })
}

fn passed_to_wire(passed: &StabilityLoss) -> proto::PassedLoss {
    let kind = match passed.kind {
        LossKind::LimitPoint => proto::passed_loss::Kind::LimitPoint,
        LossKind::Bifurcation => proto::passed_loss::Kind::Bifurcation,
    };
    proto::PassedLoss { kind: kind.into(), share: passed.share, direction: passed.direction.clone() }
}

fn passed_from_wire(wire: proto::PassedLoss) -> StabilityLoss {
    let kind = match wire.kind() {
        proto::passed_loss::Kind::LimitPoint => LossKind::LimitPoint,
        proto::passed_loss::Kind::Bifurcation => LossKind::Bifurcation,
    };
    StabilityLoss { kind, share: wire.share, direction: wire.direction }
}

/// A static equilibrium back, without permanent strains.
pub fn static_from_wire(wire: proto::StaticResponse) -> StaticResult {
    StaticResult {
        nodes: nodes_from_wire(wire.nodes),
        temperatures_k: pairs(wire.temperatures_k),
        stresses_pa: pairs(wire.stresses_pa),
        nominal_stresses_pa: pairs(wire.nominal_stresses_pa),
        anchor_forces: wire.anchor_forces.into_iter().map(anchor_force_from_wire).collect(),
        peak_temperatures_k: pairs(wire.peak_temperatures_k),
        currents_a: pairs(wire.currents_a),
        charges_c: pairs(wire.charges_c),
        pulled_in: wire.pulled_in,
        jumped: wire.jumped,
        passed: wire.passed.into_iter().map(passed_from_wire).collect(),
        free_motions: wire.free_motions,
        unknowns: size(wire.unknowns),
        iterations: size(wire.iterations),
        estimated_error: wire.estimated_error,
        warnings: wire.warnings,
    }
}

/// Modes as they travel: node names once, shapes as columns.
pub fn modes_to_wire(result: &ModesResult) -> proto::ModesResponse {
    let nodes = result.shapes.first().map_or_else(Vec::new, |shape| shape.iter().map(|(n, _)| n.clone()).collect());
    let shape = |shape: &Vec<(String, NodeMotion)>| proto::Shape {
        x: shape.iter().map(|(_, m)| m.x).collect(),
        y: shape.iter().map(|(_, m)| m.y).collect(),
        rz: shape.iter().map(|(_, m)| m.rz).collect(),
    };
    proto::ModesResponse {
        frequencies_hz: result.frequencies_hz.clone(),
        residuals: result.residuals.clone(),
        nodes,
        shapes: result.shapes.iter().map(shape).collect(),
        unknowns: result.unknowns as u64,
        errors: result.errors.iter().map(|e| e.unwrap_or(f64::NAN)).collect(),
        deflection_m: result.deflection_m,
        warnings: result.warnings.clone(),
        estimated_error: result.estimated_error,
        losses: Vec::new(),
    }
}

/// The loss of a mode as it travels.
pub fn mode_loss_to_wire(loss: &ModeLoss) -> proto::ModeLoss {
    let ModeLoss { frequency_hz, drag, gas, thermoelastic, electrical, anchors } = *loss;
    proto::ModeLoss { frequency_hz, drag, gas, thermoelastic, electrical, anchors }
}

/// Modes back, without their losses.
pub fn modes_from_wire(wire: proto::ModesResponse) -> ModesResult {
    let proto::ModesResponse {
        frequencies_hz,
        residuals,
        nodes,
        shapes,
        unknowns,
        errors,
        deflection_m,
        warnings,
        estimated_error,
        losses: _,
    } = wire;
    let shape = |s: proto::Shape| {
        let motions = s.x.iter().zip(&s.y).zip(&s.rz).map(|((&x, &y), &rz)| NodeMotion { x, y, rz });
        nodes.iter().cloned().zip(motions).collect()
    };
    let shapes = shapes.into_iter().map(shape).collect();
    // a server that sends no estimates, or none for a mode
    let mut errors: Vec<_> = errors.into_iter().map(|e| e.is_finite().then_some(e)).collect();
    errors.resize(frequencies_hz.len(), None);
    let unknowns = size(unknowns);
    ModesResult {
        frequencies_hz,
        shapes,
        residuals,
        errors,
        estimated_error,
        unknowns,
        deflection_m,
        per_deflection: Vec::new(),
        warnings,
    }
}

/// Pull-in as it travels.
pub fn pull_in_to_wire(result: &PullInResult) -> proto::PullInResponse {
    proto::PullInResponse {
        port: result.port.clone(),
        pull_in_v: result.pull_in_v,
        release_v: result.release_v,
        unheld: !result.held,
        estimated_error: result.estimated_error,
        warnings: result.warnings.clone(),
        snaps_v: result.snaps_v.clone(),
        release_before_snaps_v: result.release_before_snaps_v,
    }
}

/// Pull-in back.
pub fn pull_in_from_wire(wire: proto::PullInResponse) -> PullInResult {
    PullInResult {
        port: wire.port,
        pull_in_v: wire.pull_in_v,
        release_v: wire.release_v,
        held: !wire.unheld,
        snaps_v: wire.snaps_v,
        release_before_snaps_v: wire.release_before_snaps_v,
        estimated_error: wire.estimated_error,
        warnings: wire.warnings,
    }
}

/// The end of a transient as it travels.
pub fn summary_to_wire(result: &TransientResult) -> proto::TransientSummary {
    let SolverCounters { steps, rejected, factorizations, solves, forces, iterations } = result.counters;
    let events = result.events.iter().map(|e| proto::Crossing {
        signal: e.signal.clone(),
        level: e.level,
        t: e.t,
        up: e.direction == Direction::Up,
        contact: e.contact,
    });
    let units = result.signals.iter().map(|(_, unit, _)| unit.clone()).collect();
    proto::TransientSummary {
        units,
        steps,
        rejected,
        factorizations,
        solves,
        unknowns: result.unknowns as u64,
        forces,
        iterations,
        events: events.collect(),
        estimated_error: result.estimated_error,
        warnings: result.warnings.clone(),
        step_error: result.step_error,
        stopped_at: result.stopped_at,
        reliable_until: result.reliable_until,
        after_contact: result.after_contact.iter().map(statistics_to_wire).collect(),
        formulation_taken: result.formulation_taken.clone(),
    }
}

fn statistics_to_wire(of: &Statistics) -> proto::Statistics {
    let Statistics { signal, from, to, mean, mean_error, rms, low, high } = of.clone();
    proto::Statistics { signal, from_s: from, to_s: to, mean, mean_error, rms, low, high }
}

fn statistics_from_wire(of: proto::Statistics) -> Statistics {
    let proto::Statistics { signal, from_s, to_s, mean, mean_error, rms, low, high } = of;
    Statistics { signal, from: from_s, to: to_s, mean, mean_error, rms, low, high }
}

/// The event that ends a run.
///
/// # Errors
/// [`Violation`] where none is named.
pub fn until(wire: proto::Until) -> Result<Until, Violation> {
    use proto::until::Event::{Contact, Crossing, Release};
    match wire.event {
        Some(Contact(true)) => Ok(Until::Contact),
        Some(Release(true)) => Ok(Until::Release),
        Some(Crossing(crossing)) => {
            Ok(Until::Level(crossing.name, number("until.crossing.value", crossing.value, false)?))
        }
        _ => Err(Violation::new("until", "expected `contact` or `release` true, or `crossing`".to_owned())),
    }
}

/// The same as it travels.
pub fn until_to_wire(until: &Until) -> proto::Until {
    use proto::until::Event::{Contact, Crossing, Release};
    let event = match until {
        Until::Contact => Contact(true),
        Until::Release => Release(true),
        Until::Level(name, value) => Crossing(proto::Named { name: name.clone(), value: *value }),
    };
    proto::Until { event: Some(event) }
}

/// A transient put together from its samples and its end.
pub fn transient_from_wire(
    names: &[String],
    t: Vec<f64>,
    columns: Vec<Vec<f64>>,
    summary: proto::TransientSummary,
) -> TransientResult {
    let proto::TransientSummary {
        units,
        steps,
        rejected,
        factorizations,
        solves,
        unknowns,
        forces,
        iterations,
        events,
        estimated_error,
        warnings,
        step_error,
        stopped_at,
        reliable_until,
        after_contact,
        formulation_taken,
    } = summary;
    let event = |e: proto::Crossing| CrossingEvent {
        signal: e.signal,
        level: e.level,
        t: e.t,
        direction: if e.up { Direction::Up } else { Direction::Down },
        contact: e.contact,
    };
    let signals = names.iter().cloned().zip(units).zip(columns).map(|((name, unit), values)| (name, unit, values));
    TransientResult {
        t,
        signals: signals.collect(),
        counters: SolverCounters { steps, rejected, factorizations, solves, forces, iterations },
        unknowns: size(unknowns),
        estimated_error,
        step_error,
        damped: None,
        stopped_at,
        reliable_until,
        after_contact: after_contact.into_iter().map(statistics_from_wire).collect(),
        events: events.into_iter().map(event).collect(),
        largest_stress: None,
        formulation_taken,
        warnings,
        directions: None,
    }
}
