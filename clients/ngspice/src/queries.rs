//! Queries of an instance: numbers of the instance and its ports, its monitors, and any signal of its netlist.

use crate::instance::Instance;
use bimorph::device::{PortKind, quantities::WHOLE};

/// Numbers of an instance, by name.
const NUMBERS: [&str; 4] = ["unknowns", "points", "trials", "refused"];
/// Quantities of an electrical port: voltage (V), current into it (A), charge (C), and change of the charge with the voltage over
/// the last step (F).
const OF_A_PORT: [&str; 4] = ["v", "i", "q", "dq"];

impl Instance {
    /// Quantities in `show`.
    pub(crate) fn shown(&self) -> Vec<String> {
        let numbers = NUMBERS.iter().map(|name| (*name).to_owned());
        let whole = self.quantities().into_iter().filter(|name| WHOLE.iter().any(|(whole, _)| whole == name));
        let electrical = self.description().ports.iter().filter(|p| p.kind == PortKind::Electrical);
        let ports = electrical.flat_map(|p| OF_A_PORT.map(|quantity| format!("{}.{quantity}", p.name)));
        let monitors = self.monitors.iter().map(|m| m.signal.clone());
        numbers.chain(whole).chain(ports).chain(monitors).collect()
    }

    /// Further quantities for queries: every signal. Of a model on a server monitors alone can be seen.
    pub(crate) fn quantities(&self) -> Vec<String> {
        self.device.names()
    }

    /// Value of a quantity in the last state, in its own unit; `None` for an unknown one, or without a state.
    pub(crate) fn query(&mut self, name: &str) -> Option<f64> {
        match name {
            "unknowns" => return Some(self.description().unknowns as f64),
            "points" => return Some(self.counts.points as f64),
            "trials" => return Some(self.counts.trials as f64),
            "refused" => return Some(self.counts.refused as f64),
            _ => {}
        }
        let token = self.answer().token?;
        if let Ok(value) = self.device.read_quantity(token, name) {
            return Some(value);
        }
        if let Some(n) = self.monitors.iter().position(|m| m.signal == name) {
            return Some(self.answer().monitors.get(n)? / self.monitors[n].scale);
        }
        let (port, quantity) = name.rsplit_once('.')?;
        let ports = &self.description().ports;
        let n = ports.iter().position(|p| p.name == port && p.kind == PortKind::Electrical)?;
        match quantity {
            "v" => self.given.get(n).copied(),
            "i" => self.answer().currents.get(n).copied(),
            "q" => self.answer().charges.get(n).copied(),
            "dq" => self.reply.dq_dv.get(n * (ports.len() + 1)).copied(),
            _ => None,
        }
    }
}
