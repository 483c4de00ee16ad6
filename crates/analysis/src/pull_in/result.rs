//! Result of a search for pull-in.

use serde::Serialize;

/// Where a gap closes and where it opens again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PullInResult {
    /// The port or netlist source whose voltage was swept.
    pub port: String,
    /// Voltage at which the open branch loses its stability with rising voltage, and a gap closes (V).
    pub pull_in_v: f64,
    /// Voltage at which the last of the closed gaps opens with falling voltage (V); `None` when it stays closed at 0 V,
    /// or when the part has no closed equilibrium after pull-in.
    pub release_v: Option<f64>,
    /// Voltages between pull-in and the largest one at which the closed part snaps further (V): `release_v` is that beyond the last.
    pub snaps_v: Vec<f64>,
    /// Voltage of release from the state to which pull-in itself leads (V), where the part can snap further.
    pub release_before_snaps_v: Option<f64>,
    /// False when nothing holds the part after pull-in: no gap closes on contact.
    pub held: bool,
    /// Largest estimated relative error by the mesh (1); none without an estimate.
    #[serde(skip)]
    pub estimated_error: Option<f64>,
    /// Warnings about the result, as sentences.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

impl PullInResult {
    /// Why there is no release, and what else the voltages do not say, as sentences.
    pub fn notes(&self) -> Vec<String> {
        let way = match (self.release_v, self.held) {
            (Some(_), _) => None,
            (None, true) => Some("no release: it stays closed".to_owned()),
            (None, false) => Some("no release: nothing holds the part beyond pull-in".to_owned()),
        };
        way.into_iter().chain(self.warnings.iter().cloned()).collect()
    }
}
