//! Currents that heat a beam beyond any stable temperature.

use super::AnalysisError;
use bimorph_domains::Ramp;
use bimorph_domains::drive::Electrics;
use bimorph_domains::thermal::TableEnd;
use bimorph_model::compile::CompiledModel;
use bimorph_structure::MOLTEN;

/// Checks that the values of the sources have a steady temperature.
///
/// # Errors
/// [`AnalysisError::NoEquilibrium`] with the beam.
pub fn check_heat(compiled: &CompiledModel, electrics: &Electrics, sources: &[f64]) -> Result<(), AnalysisError> {
    electrics.heating.check(sources).map_err(|error| {
        let name = &compiled.structure.beams[compiled.parts.heaters[error.heater]].name;
        let detail = match &error.end {
            Some(end) => format!("{}, which `{name}` leaves above {:.5} of these voltages", uncovered(end), error.share.sqrt()),
            None => format!(
                "thermal runaway of `{name}`: no stable temperature above {:.5} of these voltages, where it is {:.0} K above ambient; lower \
                 the voltages, or check `TCR`",
                error.share.sqrt(),
                error.rise
            ),
        };
        AnalysisError::NoEquilibrium { detail, coarse: Vec::new(), overbent: false }
    })
}

/// A table that ends, as the beginning of a sentence.
fn uncovered(end: &TableEnd) -> String {
    let [low, high] = end.range;
    format!("the table of `{}` goes from {low} to {high} K", end.property)
}

/// Checks that rises stay within bounds over a step or a run.
///
/// # Errors
/// [`AnalysisError::StepFailed`] with the time.
pub fn check_course(compiled: &CompiledModel, ramp: &Ramp<'_>) -> Result<(), AnalysisError> {
    let Some((t, end)) = ramp.overheated() else { return Ok(()) };
    let name = |k: usize| compiled.structure.beams[compiled.parts.heaters[k]].name.as_str();
    let detail = match end {
        Some((k, end)) => {
            format!("{}, and `{}` reaches {:.1} K; add points", uncovered(&end), name(k), end.temperature)
        }
        None => {
            let limits = current_limits(compiled, ramp.to);
            let name = ramp.hottest().map_or("a beam", name);
            format!("thermal runaway of `{name}`: its temperature grows without bound{limits}")
        }
    };
    Err(AnalysisError::StepFailed { t, dt: ramp.dt - t, detail })
}

/// Ports whose current has no steady state above a limit, as part of a sentence; empty where there are none.
pub fn current_limits(compiled: &CompiledModel, sources: &[f64]) -> String {
    let electrics = &compiled.parts.system.electrics;
    let sources = &sources[..electrics.sources()];
    let one = |port: usize| {
        let limit = electrics.heating.runaway_current(sources, port)?;
        Some(format!("; no current above {:.5e} A into `{}` has a steady temperature", limit, electrics.names[port]))
    };
    (0..electrics.ports).filter(|port| sources[*port] != 0.0).filter_map(one).collect()
}

/// The beam that source voltages heat beyond any solid, where resistances depend on temperature, as a sentence.
pub fn thermal_runaway(compiled: &CompiledModel, sources: &[f64], rise: &[f64]) -> Option<String> {
    let heating = &compiled.parts.system.electrics.heating;
    let heated = compiled.parts.heaters.iter().zip(rise).filter(|(_, rise)| **rise > MOLTEN);
    let (beam, rise) = heated.max_by(|a, b| a.1.total_cmp(b.1)).filter(|_| heating.is_hot())?;
    let name = &compiled.structure.beams[*beam].name;
    let limits = current_limits(compiled, sources);
    Some(format!("thermal runaway of `{name}`: its mean temperature would be {rise:.0} K above ambient{limits}"))
}
