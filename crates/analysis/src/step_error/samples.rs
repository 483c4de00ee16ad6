//! Samples of a run that its estimate keeps.

use super::super::chart::error::half_range;
use super::super::transient::{TransientOptions, TransientResult};
use bimorph_model::compile::CompiledModel;
use bimorph_solve::equations::bodies::FLOOR;

/// Output times that are compared, at most about twice as many: evenly spaced ones of a run that has more.
const ENOUGH: usize = 1000;
/// Fraction of the length scale below which an amplitude is rounding (1).
const ROUNDING: f64 = 1e-12;

/// Samples that are not sent yet.
#[derive(Default)]
pub(crate) struct BufferedSamples {
    t: Vec<f64>,
    values: Vec<f64>,
}

impl BufferedSamples {
    pub(crate) fn keep(&mut self, t: f64, values: &[f64]) {
        bimorph_base::budget::lay_out(size_of_val(values) + size_of::<f64>());
        self.t.push(t);
        self.values.extend(values);
    }

    pub(crate) fn send(&self, sample: &mut dyn FnMut(f64, &[f64])) {
        let width = (self.values.len() / self.t.len().max(1)).max(1);
        self.t.iter().zip(self.values.chunks(width)).for_each(|(t, values)| sample(*t, values));
    }
}

/// The samples of each signal.
pub(super) fn columns(signals: &[(String, String, Vec<f64>)]) -> Vec<Vec<f64>> {
    signals.iter().map(|(_, _, column)| column.clone()).collect()
}

/// Distance of the output times that are compared (s).
pub(super) fn spacing(options: &TransientOptions<'_>) -> f64 {
    stride(options) as f64 * options.stop / (options.points - 1) as f64
}

/// True where the displacements of a run exceed the floor of a step's error, or are rounding.
pub(super) fn resolved(
    picked: &SelectedSamples,
    result: &TransientResult,
    options: &TransientOptions<'_>,
    model: &CompiledModel,
) -> bool {
    let length = model.parts.system.length_scale;
    let lengths = result.signals.iter().zip(&picked.columns).filter(|((_, unit, _), _)| unit == "m");
    let most = lengths.map(|(_, column)| half_range(column)).fold(0.0, f64::max);
    most < ROUNDING * length || most > options.errors().resolved(FLOOR, length)
}

/// One of so many output times is compared.
pub(super) fn stride(options: &TransientOptions<'_>) -> usize {
    ((options.points - 1) / ENOUGH).max(1)
}

/// Samples of some output times.
pub(super) struct SelectedSamples {
    stride: usize,
    count: usize,
    pub(super) columns: Vec<Vec<f64>>,
}

impl SelectedSamples {
    /// None yet.
    pub(super) fn new(options: &TransientOptions<'_>) -> Self {
        Self { stride: stride(options), count: 0, columns: vec![Vec::new(); options.signals.len()] }
    }

    pub(super) fn add(&mut self, values: &[f64]) {
        if self.count.is_multiple_of(self.stride) {
            bimorph_base::budget::lay_out(size_of_val(values));
            self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
        }
        self.count += 1;
    }

    /// Them as the signals of a result.
    pub(super) fn signals(self, of: &[(String, String, Vec<f64>)]) -> Vec<(String, String, Vec<f64>)> {
        of.iter().zip(self.columns).map(|((name, unit, _), column)| (name.clone(), unit.clone(), column)).collect()
    }
}
