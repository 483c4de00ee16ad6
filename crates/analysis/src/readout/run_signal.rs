//! Quantities of a run at held voltages, by name: signals of its states, charges on ports and currents into them, and sums of these.
//!
//! With the voltages V of the gaps held, the charge on a port is Q = Σ rows·C(q)·V over the gaps, and the current into it is that through
//! resistances, which is constant, and dQ/dt = Σ rows·(∂C/∂q·q̇)·V.

use super::ReadoutError;
use super::expression::{Expression, Quantity};
use super::signal::{Signal, SignalView};
use super::stress;
use bimorph_domains::Domain;
use bimorph_model::compile::CompiledModel;
use std::sync::Arc;

/// A quantity of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum RunSignal {
    /// A quantity of a state.
    State(Signal),
    /// Way left until the fingers of a comb, by its gap, touch at their sides (m).
    SideWay(usize),
    /// Largest stress on the faces of a beam without the concentration at its fillets (Pa).
    NominalStress(usize),
    /// Charge on a port (C).
    PortCharge(usize),
    /// Current into a port (A), of which `conduction` is that through resistances.
    PortCurrent {
        /// Index of the port.
        port: usize,
        /// Current through resistances (A).
        conduction: f64,
    },
    /// Current into a port through resistances that depend on temperature (A), and the rate of its charge.
    HotCurrent {
        /// Index of the port.
        port: usize,
        /// Voltages of the sources (V).
        sources: Arc<[f64]>,
    },
}

impl RunSignal {
    /// Finds a quantity by name: a signal, see [`Signal::find`], `BEAM.nominal`, `COMB.side`, or `PORT.q` or `PORT.i` with these voltages of the sources (V).
    ///
    /// # Errors
    /// [`ReadoutError::UnknownSignal`] with what would be understood.
    fn find(compiled: &CompiledModel, name: &str, sources: &[f64]) -> Result<Self, ReadoutError> {
        let electrics = &compiled.parts.system.electrics;
        let port = |quantity: &str| name.strip_suffix(quantity).and_then(|port| compiled.structure.port(port));
        match Signal::find(compiled, name) {
            Ok(signal) => Ok(Self::State(signal)),
            Err(unknown) => {
                if let Some(comb) = name.strip_suffix(".side").and_then(|comb| fingers(compiled, comb)) {
                    return Ok(Self::SideWay(comb));
                }
                if let Some(beam) = name.strip_suffix(".nominal").and_then(|beam| filleted(compiled, beam)) {
                    return Ok(Self::NominalStress(beam));
                }
                if let Some(port) = port(".q") {
                    return Ok(Self::PortCharge(port));
                }
                if let Some(port) = port(".i") {
                    if electrics.heating.is_hot() {
                        return Ok(Self::HotCurrent { port, sources: sources.into() });
                    }
                    let conduction =
                        sources.iter().enumerate().map(|(s, u)| electrics.conductance[(port, s)] * u).sum();
                    return Ok(Self::PortCurrent { port, conduction });
                }
                Err(match unknown {
                    ReadoutError::UnknownSignal { name, hint } if electrics.ports > 0 => {
                        let ports = electrics.names[..electrics.ports].join(", ");
                        ReadoutError::UnknownSignal {
                            name,
                            hint: format!("{hint}; or PORT.i, PORT.q, with the ports {ports}"),
                        }
                    }
                    other => other,
                })
            }
        }
    }

    /// Its value in a state at held voltages.
    fn value(&self, compiled: &CompiledModel, state: &SignalView<'_>) -> f64 {
        let system = &compiled.parts.system;
        match self {
            Self::State(signal) => signal.value(compiled, state),
            Self::SideWay(comb) => system.side_way(*comb, state.q),
            Self::NominalStress(beam) => {
                stress::nominal(compiled, *beam, state.q, state.rise).map_or(0.0, |found| found.value())
            }
            Self::PortCharge(port) => of_gaps(compiled, *port, |g| system.charge(g, state.q, state.volts)),
            Self::PortCurrent { port, conduction } => {
                conduction
                    + of_gaps(compiled, *port, |g| system.charge_slope(g, (state.q, state.volts), (state.v, None)))
            }
            Self::HotCurrent { port, sources } => {
                system.electrics.port_currents(sources, state.rise)[*port]
                    + of_gaps(compiled, *port, |g| system.charge_slope(g, (state.q, state.volts), (state.v, None)))
            }
        }
    }

    /// Its change with a change of the state, from one at rest.
    fn slope(&self, compiled: &CompiledModel, state: &SignalView<'_>, change: &SignalView<'_>) -> f64 {
        let system = &compiled.parts.system;
        match self {
            Self::State(signal) => signal.slope(compiled, state, change),
            Self::SideWay(comb) => system.side_slope(*comb, state.q, change.q),
            Self::NominalStress(beam) => stress::nominal(compiled, *beam, state.q, state.rise)
                .map_or(0.0, |found| found.slope(compiled, state.q, change.q, change.rise)),
            Self::PortCharge(port) => of_gaps(compiled, *port, |g| {
                system.charge_slope(g, (state.q, state.volts), (change.q, Some(change.volts)))
            }),
            Self::HotCurrent { port, sources } => {
                let unit = vec![0.0; sources.len()];
                system.electrics.port_current_slopes((sources, state.rise), &unit, change.rise)[*port]
                    + of_gaps(compiled, *port, |g| system.charge_slope(g, (state.q, state.volts), (change.v, None)))
            }
            Self::PortCurrent { port, .. } => {
                of_gaps(compiled, *port, |g| system.charge_slope(g, (state.q, state.volts), (change.v, None)))
            }
        }
    }
}

/// The gap of a comb whose fingers can touch at their sides.
fn fingers(compiled: &CompiledModel, name: &str) -> Option<usize> {
    let gap = compiled.parts.gap_names.iter().position(|gap| gap == name)?;
    compiled.parts.system.members[gap].side_room().map(|_| gap)
}

/// A beam whose layer has a fillet and whose stress is known.
fn filleted(compiled: &CompiledModel, name: &str) -> Option<usize> {
    let beam = compiled.structure.beams.iter().position(|beam| beam.name == name)?;
    let known = compiled.structure.beams[beam].material.fillet.is_some() && !compiled.parts.stressed[beam].rigid;
    known.then_some(beam)
}

impl Quantity for RunSignal {
    fn unit(&self) -> &'static str {
        match self {
            Self::State(signal) => signal.unit(),
            Self::SideWay(_) => "m",
            Self::NominalStress(_) => "Pa",
            Self::PortCharge(_) => "C",
            Self::PortCurrent { .. } | Self::HotCurrent { .. } => "A",
        }
    }
}

impl Expression<RunSignal> {
    /// Finds a quantity by name or a sum of them. The sources have these voltages (V); a caller that needs no values gives none.
    ///
    /// # Errors
    /// [`ReadoutError::UnknownSignal`] with what would be understood, [`ReadoutError::BadExpression`].
    pub fn of_run(compiled: &CompiledModel, text: &str, sources: &[f64]) -> Result<Self, ReadoutError> {
        Self::find(text, |name| RunSignal::find(compiled, name, sources))
    }

    /// Its value in a state at held voltages.
    pub fn value(&self, compiled: &CompiledModel, state: &SignalView<'_>) -> f64 {
        self.sum(|signal| signal.value(compiled, state))
    }

    /// Its change with a change of the state, from one at rest.
    pub fn slope(&self, compiled: &CompiledModel, state: &SignalView<'_>, change: &SignalView<'_>) -> f64 {
        self.sum(|signal| signal.slope(compiled, state, change))
    }
}

/// Sum over the gaps that a port reaches, each with the fraction that it has of the port.
fn of_gaps(compiled: &CompiledModel, port: usize, of: impl Fn(usize) -> f64) -> f64 {
    let rows = &compiled.parts.system.electrics.gap_rows;
    (0..rows.nrows()).filter(|&g| rows[(g, port)] != 0.0).map(|g| rows[(g, port)] * of(g)).sum()
}
