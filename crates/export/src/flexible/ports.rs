//! The sources of a mechanism as a circuit sees them.

use super::super::linear::ReducedPort;
use bimorph_analysis::readout::ports::OpenedPorts;
use bimorph_domains::drive::Electrics;

/// Counterpart of a source in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SourceText {
    /// A port with the unit of its input per volt or ampere of the circuit; true: a flow.
    Port(usize, f64, bool),
    /// A constant (V).
    Constant(f64),
}

impl SourceText {
    /// Of every source; a port that the file does not have is held at 0 V.
    pub fn all(electrics: &Electrics, opened: &OpenedPorts, ports: &[ReducedPort], given: &[f64]) -> Vec<Self> {
        let mut all = vec![Self::Constant(0.0); electrics.sources()];
        for (k, volts) in electrics.fixed.iter().enumerate() {
            all[electrics.ports + k] = Self::Constant(*volts);
        }
        for (q, source) in opened.sources.iter().enumerate() {
            all[*source] = Self::Port(q, given[q], ports[q].kind.given_flow());
        }
        all
    }

    /// Its value in its own unit as an expression; none where it is 0.
    pub fn text(&self) -> Option<String> {
        match *self {
            Self::Port(q, given, flow) => {
                let branch = format!("{}(b{})", if flow { "I" } else { "V" }, q + 1);
                Some(if given == 1.0 { branch } else { format!("({given:e} * {branch})") })
            }
            Self::Constant(0.0) => None,
            Self::Constant(value) => Some(format!("({value:e})")),
        }
    }
}

/// A linear function of the sources as an expression; none where it is 0 for all.
pub fn sum_of(sources: &[SourceText], row: impl Fn(usize) -> f64) -> Option<String> {
    let most = (0..sources.len()).map(|s| row(s).abs()).fold(0.0, f64::max);
    let terms: Vec<String> = (sources.iter().enumerate())
        .filter(|(s, _)| row(*s).abs() > f64::EPSILON * most)
        .filter_map(|(s, source)| {
            let text = source.text()?;
            Some(if row(s) == 1.0 { text } else { format!("{:e} * {text}", row(s)) })
        })
        .collect();
    (!terms.is_empty()).then(|| terms.join(" + "))
}
