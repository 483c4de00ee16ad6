//! Reduced models that points of a sweep share: those whose netlist parameters are the same, and whose port voltages differ.
//!
//! Such points are one system. It is trained once, for the voltages that the ports have in the whole grid, samples included. A row then has the
//! bytes of its run alone with these as `ranges`. Which points share a training depends on the grid alone.

use super::axis::{Varied, varied};
use super::spec::SweepSpec;
use bimorph_analysis::reduced::shared::TrainedMotion;
use bimorph_base::Setting;
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation};
use bimorph_model::options::PortRanges;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Variants that are kept: points of a batch have few, one after the other.
const KEPT: usize = 16;

/// A system on its mesh with its training.
#[derive(Debug)]
pub(super) struct ReducedVariant {
    pub(super) compiled: Arc<CompiledModel>,
    pub(super) trained: Arc<TrainedMotion>,
}

/// Values of netlist parameters by name.
type Parameters = Vec<(String, Setting)>;

/// A variant once it is needed; none where its drawing has another mesh.
type VariantSlot = Arc<OnceLock<Result<Option<ReducedVariant>, String>>>;

/// The variants of a sweep.
#[derive(Debug, Default)]
pub(super) struct ReducedVariants {
    kept: Mutex<VecDeque<(Parameters, VariantSlot)>>,
}

impl ReducedVariants {
    /// The place of the variant with the netlist parameters of a point.
    pub(super) fn slot(&self, settings: &[(String, Setting)]) -> VariantSlot {
        let of_netlist = |(name, _): &&(String, Setting)| !matches!(varied(name), Varied::Voltage(_));
        let parameters: Parameters = settings.iter().filter(of_netlist).cloned().collect();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, slot)) = kept.iter().find(|(known, _)| *known == parameters) {
            return Arc::clone(slot);
        }
        if kept.len() == KEPT {
            kept.pop_front();
        }
        let slot = VariantSlot::default();
        kept.push_back((parameters, Arc::clone(&slot)));
        slot
    }
}

/// Whether points share trainings.
pub(super) fn shares(spec: &SweepSpec, options: &CompileOptions) -> bool {
    options.formulation == Formulation::Reduced && spec.ports().next().is_some()
}

/// The voltages of a point with the largest of those that a sweep varies.
pub(super) fn largest(spec: &SweepSpec, voltages: &[(String, f64)]) -> Vec<(String, f64)> {
    let ranges = spec.port_ranges();
    let of = |(name, volts): &(String, f64)| {
        let range = ranges.iter().find(|(port, [low, high])| port == name && low <= high);
        let volts = range.map_or(*volts, |(_, [low, high])| if low.abs() > high.abs() { *low } else { *high });
        (name.clone(), volts)
    };
    voltages.iter().map(of).collect()
}

/// The options with the ranges of the ports in a sweep, where points share trainings and none are given.
pub(super) fn with_ranges(spec: &SweepSpec, options: Arc<CompileOptions>) -> Arc<CompileOptions> {
    if !shares(spec, &options) || options.ranges.is_some() {
        return options;
    }
    let text: Vec<String> = spec
        .port_ranges()
        .into_iter()
        .filter(|(_, [low, high])| low < high)
        .map(|(port, [low, high])| format!("{port}:{low:e}:{high:e}"))
        .collect();
    match PortRanges::parse(&text.join(",")) {
        Ok(ranges) => Arc::new(options.with_ranges(ranges)),
        // values that are no numbers are errors of their points
        Err(_) => options,
    }
}
