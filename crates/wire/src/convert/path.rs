//! Equilibrium paths.

use super::analysis::{nodes_from_wire, nodes_to_wire};
use super::{Violation, named, number, options, voltages};
use crate::proto;
use bimorph_analysis::continuation::{ContinuationResult, CriticalPoint};
use bimorph_analysis::path_parameter::PathOptions;
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::PATH_POINTS;
use bimorph_solve::continuation::Branch;
use proto::path_request::Branch as WireBranch;
use proto::path_response::End;

/// Ends of a path on the wire and in the library.
const ENDS: [(End, &str); 5] = [
    (End::Arrived, "arrived"),
    (End::TurnedBack, "turned back"),
    (End::Unstable, "unstable"),
    (End::Full, "as many points as allowed"),
    (End::Lost, "lost"),
];

/// A path of a server.
#[derive(Debug, Clone, PartialEq)]
pub struct PathReply {
    /// The path, without displacements along beams.
    pub result: ContinuationResult,
    /// Unit of the parameter; empty where its effects do not determine it.
    pub unit: String,
    /// Largest estimated relative error by the mesh (1); none without an estimate.
    pub estimated_error: Option<f64>,
}

/// A request as it travels.
pub fn request_to_wire(model: &str, options: &PathOptions) -> proto::PathRequest {
    let branch = match options.branch {
        Branch::Plus => WireBranch::Plus,
        Branch::Minus => WireBranch::Minus,
        Branch::Stay => WireBranch::Stay,
    };
    proto::PathRequest {
        model: model.to_owned(),
        along: options.along.clone(),
        from: options.from,
        to: options.to,
        signals: options.signals.clone(),
        branch: branch.into(),
        points: u32::try_from(options.points).unwrap_or(u32::MAX),
        voltages: named(&options.voltages),
    }
}

/// A checked request.
///
/// # Errors
/// [`Violation`] for a number, a branch or a voltage that means nothing.
pub fn request_from_wire(wire: proto::PathRequest) -> Result<PathOptions, Violation> {
    let branch = match WireBranch::try_from(wire.branch) {
        Ok(WireBranch::Plus) => Branch::Plus,
        Ok(WireBranch::Minus) => Branch::Minus,
        Ok(WireBranch::Stay) => Branch::Stay,
        Err(_) => return Err(Violation::new("branch", format!("expected 0, 1 or 2, got {}", wire.branch))),
    };
    let points = if wire.points == 0 { PATH_POINTS.count() } else { wire.points as usize };
    options::analysis(&PATH_POINTS, OptionValue::Count(points))?;
    let (from, to) = (number("from", wire.from, false)?, number("to", wire.to, false)?);
    if from == to {
        return Err(Violation::new("to", format!("expected another value than that of from, got {to} as well")));
    }
    let voltages = voltages("voltages", wire.voltages)?;
    Ok(PathOptions { along: wire.along, from, to, voltages, signals: wire.signals, branch, points })
}

fn critical_to_wire(points: &[CriticalPoint]) -> Vec<proto::CriticalPoint> {
    points.iter().map(|c| proto::CriticalPoint { value: c.value, point: c.point as u64 }).collect()
}

fn critical_from_wire(points: Vec<proto::CriticalPoint>) -> Vec<CriticalPoint> {
    let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
    points.into_iter().map(|c| CriticalPoint { value: c.value, point: size(c.point) }).collect()
}

/// A path as it travels.
pub fn result_to_wire(path: &PathReply) -> proto::PathResponse {
    let result = &path.result;
    let signal = |(name, unit, values): &(String, String, Vec<f64>)| proto::PathSignal {
        name: name.clone(),
        unit: unit.clone(),
        values: values.clone(),
    };
    let end = ENDS.iter().find(|(_, word)| *word == result.end).map_or(End::Lost, |(end, _)| *end);
    proto::PathResponse {
        unit: path.unit.clone(),
        values: result.values.clone(),
        signals: result.signals.iter().map(signal).collect(),
        negative: result.negative.iter().map(|&n| u32::try_from(n).unwrap_or(u32::MAX)).collect(),
        limit_points: critical_to_wire(&result.folds),
        bifurcations: critical_to_wire(&result.bifurcations),
        end: end.into(),
        last: nodes_to_wire(&result.last),
        unknowns: result.unknowns as u64,
        iterations: result.iterations as u64,
        estimated_error: path.estimated_error,
        warnings: result.warnings.clone(),
    }
}

/// A path back.
pub fn result_from_wire(wire: proto::PathResponse) -> PathReply {
    let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
    let end = wire.end();
    let result = ContinuationResult {
        values: wire.values,
        signals: wire.signals.into_iter().map(|s| (s.name, s.unit, s.values)).collect(),
        negative: wire.negative.into_iter().map(|n| n as usize).collect(),
        folds: critical_from_wire(wire.limit_points),
        bifurcations: critical_from_wire(wire.bifurcations),
        end: ENDS.iter().find(|(known, _)| *known == end).map_or("lost", |(_, word)| word),
        last: nodes_from_wire(wire.last),
        last_curves: Vec::new(),
        unknowns: size(wire.unknowns),
        iterations: size(wire.iterations),
        warnings: wire.warnings,
    };
    PathReply { result, unit: wire.unit, estimated_error: wire.estimated_error }
}

#[cfg(test)]
mod tests {
    //! Requests and results come back as they were sent, and each reason for an end has its own number.
    use super::*;

    #[test]
    fn paths_survive_the_wire() {
        for branch in [Branch::Plus, Branch::Minus, Branch::Stay] {
            let options = PathOptions { branch, signals: vec!["m.x".into()], ..PathOptions::default() };
            assert_eq!(request_from_wire(request_to_wire("0", &options)), Ok(options));
        }
        for (_, end) in ENDS {
            let result = ContinuationResult {
                values: vec![0.0, 1.0],
                signals: vec![("m.x".into(), "m".into(), vec![0.0, 1e-6])],
                negative: vec![0, 3],
                folds: vec![CriticalPoint { value: 1.0, point: 1 }],
                bifurcations: Vec::new(),
                end,
                last: Vec::new(),
                last_curves: Vec::new(),
                unknowns: 7,
                iterations: 9,
                warnings: vec!["a".into()],
            };
            let path = PathReply { result, unit: "V".into(), estimated_error: Some(1e-4) };
            assert_eq!(result_from_wire(result_to_wire(&path)), path);
        }
    }
}
