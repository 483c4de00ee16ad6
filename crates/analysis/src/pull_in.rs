//! Pull-in and release voltages.
//!
//! The branch of equilibria is followed by arc length, from 0 V upwards, to where it loses its stability: a fold, or a
//! bifurcation of what is drawn symmetrical. A little beyond, the part falls to what holds it. If an open gap has
//! closed, this was pull-in; otherwise the branch continues from there. The closed branch is followed up to the largest
//! voltage: where it loses its stability the part snaps further, and another branch holds it down. Beyond the last one,
//! the closed branch is followed downwards in the same way. After each limit point the part falls again, and the search
//! continues while one of the closed gaps is still in contact (a beam that peels off piece by piece). The unit of
//! voltages is the voltage that moves this part, so that no step depends on the largest requested voltage.

mod held;
mod result;
mod sweep;

use super::AnalysisError;
use super::statics::source_vector;
use bimorph_domains::Domain;
use bimorph_model::compile::CompiledModel;
pub use result::PullInResult;
use sweep::{PostPullIn, VoltageSweep};

/// Follows the equilibrium up to `max` volts on `port` (none: the first port, else the first source of the netlist), then
/// down again. The other ports stay at 0 V, the netlist's other sources at their voltage.
///
/// # Errors
/// See [`AnalysisError`]; `NoEquilibrium` when nothing pulls in below `max`.
pub fn pull_in(compiled: &CompiledModel, port: Option<&str>, max: f64) -> Result<PullInResult, AnalysisError> {
    pull_in_with(compiled, port, max, true)
}

/// The same; further snaps of the closed part are sought where `snaps`.
pub(super) fn pull_in_with(
    compiled: &CompiledModel,
    port: Option<&str>,
    max: f64,
    snaps: bool,
) -> Result<PullInResult, AnalysisError> {
    let source = source(compiled, port)?;
    if !(max.is_finite() && max > 0.0) {
        return Err(AnalysisError::BadRequest {
            what: "largest voltage".into(),
            detail: format!("{max} is not a positive number of volts"),
        });
    }
    let system = &compiled.parts.system;
    let (rows, heating) = (&system.electrics.gap_rows, &system.electrics.heating);
    let pulls = |source: usize| (0..system.members.len()).any(|gap| rows[(gap, source)] != 0.0);
    // what is heated may be pushed to where another voltage closes a gap
    let pushes = system.members.iter().any(Domain::is_gap)
        && (0..heating.heaters.len()).any(|k| heating.current(k, source) != 0.0);
    if !pulls(source) && !pushes {
        let names = &system.electrics.names;
        let others: Vec<&str> = (0..names.len()).filter(|k| pulls(*k)).map(|k| names[k].as_str()).collect();
        let detail = match others.as_slice() {
            [] => "it drives no gap, and no other port of this netlist does, so that there is no pull-in".to_owned(),
            others => format!("it drives no gap; ports that do: {}", others.join(", ")),
        };
        return Err(AnalysisError::BadRequest { what: format!("port \"{}\"", names[source]), detail });
    }
    let mut off = source_vector(compiled, &[])?;
    off[source] = 0.0;
    let name = system.electrics.names[source].clone();
    let estimated_error = compiled.order.estimated_error;
    let mut sweep = VoltageSweep::new(compiled, off, source);
    sweep.opposite = opposite(compiled, &sweep, max);
    let q = sweep.at_rest()?;
    let result = |pull_in_v: f64, held: bool, sweep: &VoltageSweep<'_>| PullInResult {
        port: name,
        pull_in_v,
        release_v: None,
        held,
        snaps_v: Vec::new(),
        release_before_snaps_v: None,
        estimated_error,
        warnings: sweep.warnings(),
    };
    match sweep.close(q, max)? {
        PostPullIn::Falls { volts } => Ok(result(volts, false, &sweep)),
        PostPullIn::Rests { fold, volts, q } => {
            let found = sweep.held_down(q, volts, if snaps { max } else { volts })?;
            Ok(PullInResult {
                release_v: found.release_v,
                snaps_v: found.snaps_v,
                release_before_snaps_v: found.release_before_snaps_v,
                ..result(fold, true, &sweep)
            })
        }
    }
}

/// The voltage of the opposite polarity that pulls the part in, as a sentence, where an offset voltage of a gap makes both differ.
fn opposite(compiled: &CompiledModel, sweep: &VoltageSweep<'_>, max: f64) -> Option<String> {
    compiled.structure.gap_offsets().next()?;
    let mut sweep = sweep.reversed();
    let found = sweep.at_rest().and_then(|q| sweep.close(q, max));
    Some(match found {
        Ok(PostPullIn::Falls { volts: fold } | PostPullIn::Rests { fold, .. }) => {
            format!("offset voltages act: with a falling voltage it pulls in at {:.6} V", -fold)
        }
        Err(_) => format!("offset voltages act: no pull-in was found from 0 V down to {:.6} V", -max),
    })
}

/// Index of the source to sweep.
fn source(compiled: &CompiledModel, port: Option<&str>) -> Result<usize, AnalysisError> {
    let names = &compiled.parts.system.electrics.names;
    let found = match port {
        Some(name) => names.iter().position(|n| n == name),
        None => (!names.is_empty()).then_some(0),
    };
    found.ok_or_else(|| AnalysisError::BadRequest {
        what: port.map_or_else(|| "pull-in".to_owned(), |port| format!("port \"{port}\"")),
        detail: match names.len() {
            0 => "the netlist has no port and no voltage source to sweep".into(),
            _ => format!("the netlist's ports and sources are {}", names.join(", ")),
        },
    })
}
