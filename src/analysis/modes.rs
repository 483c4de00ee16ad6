//! Natural frequencies and shapes about the operating point.
use super::{AnalysisError, PortVoltages};
use super::statics::NodeMotion;
use crate::compile::Compiled;
use serde::Serialize;

/// Undamped modes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModesResult {
    /// Frequencies, ascending [Hz].
    pub frequencies_hz: Vec<f64>,
    /// For each mode, the displacement of every mechanical node (largest translation 1), in netlist order.
    pub shapes: Vec<Vec<(String, NodeMotion)>>,
    /// For each mode, ‖Kx − λMx‖ / ‖Kx‖ [1].
    pub residuals: Vec<f64>,
    /// Mechanical unknowns.
    pub unknowns: usize,
}

/// The `count` lowest modes about the static equilibrium at these voltages.
///
/// # Errors
/// See [`AnalysisError`].
pub fn modes(compiled: &Compiled, count: usize, voltages: &PortVoltages) -> Result<ModesResult, AnalysisError> {
    let _ = (compiled, count, voltages);
    Err(AnalysisError::NoEquilibrium { detail: "not built yet".into() })
}
