//! Static equilibrium.
use super::{AnalysisError, PortVoltages};
use crate::compile::Compiled;
use serde::Serialize;

/// Displacement of a node from its drawn place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct NodeMotion {
    /// Along x [m].
    pub x: f64,
    /// Along y [m].
    pub y: f64,
    /// Rotation about z [rad].
    pub rz: f64,
}

/// A static equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StaticResult {
    /// Displacement of every mechanical node, by name, in netlist order.
    pub nodes: Vec<(String, NodeMotion)>,
    /// Mean temperature of every heated or prescribed beam [K], by name.
    pub temperatures_k: Vec<(String, f64)>,
    /// Current into each port [A], by name.
    pub currents_a: Vec<(String, f64)>,
    /// Charge on each port [C], by name.
    pub charges_c: Vec<(String, f64)>,
    /// True when the part pulled in on the way.
    pub pulled_in: bool,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Newton iterations over all load steps.
    pub iterations: usize,
}

/// Finds the equilibrium that is reached from rest by raising all loads and voltages together.
///
/// # Errors
/// See [`AnalysisError`].
pub fn static_equilibrium(compiled: &Compiled, voltages: &PortVoltages) -> Result<StaticResult, AnalysisError> {
    let _ = (compiled, voltages);
    Err(AnalysisError::NoEquilibrium { detail: "not built yet".into() })
}
