//! Inspection: any quantity of a state by name, whether it was opened as a signal or not, and quantities of the state
//! as a whole. Without derivatives, and without a trace.

use super::DeviceError;
use super::session::DeviceSession;
use super::states::Snapshot;
use bimorph_analysis::readout::expression::Expression;
use bimorph_analysis::readout::signal::{self, SignalView};
use bimorph_domains::{Domain, MaterialPoint};
use bimorph_model::compile::CompiledModel;

/// Quantities of a state as a whole, with what they are, by the names under which [`super::Device::read_quantity`] knows them beside signals.
pub const WHOLE: [(&str, &str); 3] = [
    ("moved", "largest displacement of a node or a point along a beam [m]"),
    ("closest", "smallest distance left between plates or facing beams [m]"),
    ("hottest", "highest mean temperature of a beam that is heated [K]"),
];

/// Every name that has a value in a state of this model.
pub(super) fn names(compiled: &CompiledModel) -> Vec<String> {
    let there = [true, closing(compiled).next().is_some(), !compiled.parts.heaters.is_empty()];
    let whole = WHOLE.iter().zip(there).filter(|(_, there)| *there).map(|((name, _), _)| (*name).to_owned());
    whole.chain(signal::names(compiled)).collect()
}

/// Gaps that close, of those there are: plates and facing beams.
fn closing(compiled: &CompiledModel) -> impl Iterator<Item = usize> {
    compiled.parts.system.members.iter().enumerate().filter(|(_, gap)| gap.is_electrostatic()).map(|(g, _)| g)
}

impl DeviceSession {
    /// Value of a quantity in a state, in its own unit.
    ///
    /// # Errors
    /// [`DeviceError::UnknownSignal`]
    pub(super) fn read_quantity(
        &self,
        compiled: &CompiledModel,
        state: &Snapshot,
        name: &str,
    ) -> Result<f64, DeviceError> {
        let system = Self::system(&self.ports.system, compiled);
        let rows = &system.electrics.gap_rows;
        let volts: Vec<f64> = (0..system.members.len())
            .map(|g| state.sources.iter().enumerate().map(|(s, v)| rows[(g, s)] * v).sum())
            .collect();
        let none = |hint: &str| DeviceError::UnknownSignal { name: name.into(), hint: hint.into() };
        match name {
            "moved" => {
                let points = compiled
                    .parts
                    .nodes
                    .iter()
                    .flatten()
                    .chain(compiled.parts.beams.iter().flat_map(|points| points.iter()));
                let far = |p: &MaterialPoint| p.displacement(&state.q, system.model.linear).norm();
                Ok(points.map(far).fold(0.0, f64::max))
            }
            "closest" => closing(compiled)
                .map(|g| system.distance(g, &state.q))
                .reduce(f64::min)
                .ok_or_else(|| none("the netlist has no plates or beams that face each other")),
            "hottest" => (system.electrics.heating.heaters.iter().zip(&state.rise))
                .map(|(heater, rise)| heater.ambient + rise)
                .reduce(f64::max)
                .ok_or_else(|| none("the netlist has no heated beam")),
            _ => {
                let signal = Expression::of_state(compiled, name).map_err(|e| none(&e.to_string()))?;
                Ok(signal.value(compiled, &SignalView { q: &state.q, v: &state.v, rise: &state.rise, volts: &volts }))
            }
        }
    }
}
