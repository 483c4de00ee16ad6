//! Ranges of sliders: those of parameters without a range in the netlist, and of ports.

use bimorph_analysis::AnalysisError;
use bimorph_analysis::mesh::{pull_in_fitted, static_fitted};
use bimorph_analysis::statics::static_equilibrium;
use bimorph_model::compile::CompiledModel;
use bimorph_model::options::analysis::PULL_IN_MAX;

/// Fraction of the size of the mechanism that the largest displacement reaches at the end of a range.
const LARGE: f64 = 0.02;
/// Rise of the hottest beam at the end of the range of a port that heats (K).
const HOT: f64 = 500.0;
/// Voltage at which the effect of a port is measured (V).
const PROBE: f64 = 1.0;
/// Range of a port whose effect is unknown (V).
const UNKNOWN_VOLTS: f64 = 10.0;
/// Factor of the range on the pull-in voltage.
const BEYOND_PULL_IN: f64 = 1.3;

/// Values that a slider can take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SliderRange {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// ± 50 % of a value.
pub(crate) fn about_value(x: f64) -> SliderRange {
    let (a, b) = (0.5 * x, 1.5 * x);
    SliderRange { low: a.min(b), high: a.max(b) }
}

/// Whole numbers about a whole number: a switch from 0 to 1, or ± 50 %.
pub(crate) fn about_whole(x: f64) -> SliderRange {
    let SliderRange { low, high } = about_value(x);
    if x.abs() <= 1.0 {
        SliderRange { low: x.min(0.0), high: x.max(0.0) }
    } else {
        SliderRange { low: low.floor(), high: high.ceil() }
    }
}

/// A range about 0 in which the largest displacement reaches a visible fraction of the size. `changed` gives the model at another value.
pub(crate) fn about_zero(
    drawn: &CompiledModel,
    changed: &dyn Fn(f64) -> Option<CompiledModel>,
    voltages: &[(String, f64)],
) -> SliderRange {
    let size = drawn.structure.extent();
    let largest = |model: &CompiledModel| {
        let result = static_equilibrium(model, voltages).ok()?;
        Some(result.nodes.iter().map(|(_, m)| m.x.hypot(m.y)).fold(0.0, f64::max))
    };
    let rest = largest(drawn).unwrap_or_default();
    for power in [-15, -12, -9, -6, -3, 0] {
        let trial = 10.0_f64.powi(power);
        let moved = changed(trial).and_then(|model| largest(&model)).map_or(0.0, |far| (far - rest).abs());
        if moved > 1e-7 * size {
            let high = rounded_up(trial * LARGE * size / moved);
            return SliderRange { low: -high, high };
        }
    }
    SliderRange { low: -1.0, high: 1.0 }
}

/// Range of a port, and its pull-in.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PortRange {
    /// Voltages (V).
    pub(crate) interval: SliderRange,
    /// Pull-in voltage (V), where it is within the range.
    pub(crate) pull_in_v: Option<f64>,
    /// Why a port that drives gaps pulls nothing in.
    pub(crate) no_pull_in: Option<String>,
}

/// The range of a port. A port that heats ends at a rise that a solid bears, one that pulls in somewhat beyond that.
pub(crate) fn port_range(drawn: &CompiledModel, port: &str) -> PortRange {
    let size = drawn.structure.extent();
    let up_to = |volts: f64| SliderRange { low: 0.0, high: rounded_up(volts) };
    let at = |volts: f64| static_fitted(drawn, &[(port.to_owned(), volts)]).ok().map(|(_, result, _)| result);
    let found = at(0.0).zip(at(PROBE));
    let hottest = |list: &[(String, f64)]| list.iter().map(|(_, t)| *t).fold(0.0, f64::max);
    let rise = found
        .as_ref()
        .map_or(0.0, |(rest, probed)| hottest(&probed.peak_temperatures_k) - hottest(&rest.peak_temperatures_k));
    // heat and electrostatic force grow with the square of the voltage
    if rise > 0.0 {
        return PortRange { interval: up_to(PROBE * (HOT / rise).sqrt()), pull_in_v: None, no_pull_in: None };
    }
    match pull_in_fitted(drawn, Some(port), PULL_IN_MAX.number()) {
        Ok((_, found)) => {
            let interval = up_to(BEYOND_PULL_IN * found.pull_in_v);
            PortRange { interval, pull_in_v: Some(found.pull_in_v), no_pull_in: None }
        }
        Err(error) => {
            let moved = found.map_or(0.0, |(rest, probed)| {
                let pairs = probed.nodes.iter().zip(&rest.nodes);
                pairs.map(|((_, a), (_, b))| (a.x - b.x).hypot(a.y - b.y)).fold(0.0, f64::max)
            });
            let volts = PROBE * (LARGE * size / moved).sqrt();
            let volts = if volts.is_finite() { volts.min(PULL_IN_MAX.number()) } else { UNKNOWN_VOLTS };
            let reason = match error {
                AnalysisError::NoEquilibrium { detail, .. } => Some(detail),
                _ => None,
            };
            PortRange { interval: up_to(volts), pull_in_v: None, no_pull_in: reason }
        }
    }
}

/// 1, 2, 3 or 5 times a power of ten, not below `x`.
fn rounded_up(x: f64) -> f64 {
    if !(x.is_finite() && x > 0.0) {
        return 1.0;
    }
    let power = 10.0_f64.powf(x.log10().floor());
    let steps = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.iter().map(|step| step * power).find(|high| *high >= x * (1.0 - 1e-12)).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends of ranges are round and not below the value.
    #[test]
    fn ends_are_round() {
        assert!((rounded_up(23.2) - 25.0).abs() < 1e-12);
        assert!((rounded_up(1e-6) - 1e-6).abs() < 1e-18);
        assert!((rounded_up(0.91) - 1.0).abs() < 1e-12);
        assert!((rounded_up(f64::NAN) - 1.0).abs() < 1e-12);
        assert_eq!(about_value(-2.0), SliderRange { low: -3.0, high: -1.0 });
        assert_eq!(about_whole(1.0), SliderRange { low: 0.0, high: 1.0 });
        assert_eq!(about_whole(5.0), SliderRange { low: 2.0, high: 8.0 });
    }
}
