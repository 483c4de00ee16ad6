//! Pull-in and release voltages.
use super::AnalysisError;
use super::statics::source_vector;
use crate::compile::Compiled;
use crate::multibody::planar::Pose;
use crate::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use crate::solve::path::SourcePath;
use serde::Serialize;

/// Where a gap closes and where it opens again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PullInResult {
    /// The port or netlist source whose voltage was swept.
    pub port: String,
    /// Voltage of the fold on the way up [V].
    pub pull_in_v: f64,
    /// Voltage at which the closed gap lets go on the way down [V]; none when it never closed or stays stuck.
    pub release_v: Option<f64>,
}

/// Follows the equilibrium up to `max` volts on `port` (none: the first port, else the first source of the netlist), then
/// down again. The other ports stay at 0 V, the netlist's other sources at their voltage.
///
/// # Errors
/// See [`AnalysisError`]; `NoEquilibrium` when nothing pulls in below `max`.
pub fn pull_in(compiled: &Compiled, port: Option<&str>, max: f64) -> Result<PullInResult, AnalysisError> {
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    let source = match port {
        Some(name) => electrics.names.iter().position(|n| n == name),
        None => (!electrics.names.is_empty()).then_some(0),
    };
    let source = source.ok_or_else(|| AnalysisError::BadRequest {
        what: format!("port \"{}\"", port.unwrap_or("")),
        detail: match electrics.names.len() {
            0 => "the netlist has no port and no voltage source to sweep".into(),
            _ => format!("the netlist's ports and sources are {}", electrics.names.join(", ")),
        },
    })?;
    if !(max.is_finite() && max > 0.0) {
        return Err(AnalysisError::BadRequest {
            what: "largest voltage".into(),
            detail: format!("{max} is not a positive number of volts"),
        });
    }
    let name = electrics.names[source].clone();
    let mut off = source_vector(compiled, &[])?;
    off[source] = 0.0;
    let at = |volts: f64| {
        let mut u = off.clone();
        u[source] = volts;
        u
    };
    let mut q = vec![Pose::zeros(); system.bodies()];
    let mut solver = Equilibrium::new(system, EquilibriumOptions::default());
    let rest = vec![0.0; off.len()];
    solver.follow(system, &SourcePath::new(electrics, &rest, &off, [0.0, 1.0]), &mut q)?;

    solver.options.stop_at_fold = true;
    let full = at(max);
    let up = solver.follow(system, &SourcePath::new(electrics, &off, &full, [1.0, 1.0]), &mut q)?;
    let Some(fold) = up.fold else {
        return Err(AnalysisError::NoEquilibrium {
            detail: format!("{name} pulls nothing in up to {max} V; raise the largest voltage"),
        });
    };
    let pull_in_v = fold * max;

    // beyond the fold: fall to contact, then come back down
    solver.options.stop_at_fold = false;
    let (here, above) = (at(pull_in_v), at(1.01 * pull_in_v));
    let fallen = solver.follow(system, &SourcePath::new(electrics, &here, &above, [1.0, 1.0]), &mut q);
    let release_v = match fallen {
        Ok(_) if system.in_contact(&q) => {
            solver.options.stop_at_fold = true;
            let down = solver.follow(system, &SourcePath::new(electrics, &above, &off, [1.0, 1.0]), &mut q)?;
            down.fold.map(|share| (1.0 - share) * above[source])
        }
        _ => None,
    };
    Ok(PullInResult { port: name, pull_in_v, release_v })
}
