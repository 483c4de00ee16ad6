//! Samples of some output times, which a run is compared by.

use super::super::transient::TransientOptions;

/// Output times that are compared, at most about twice as many: evenly spaced ones of a run that has more.
const ENOUGH: usize = 1000;
/// One of so many output times is compared.
pub(super) fn stride(options: &TransientOptions<'_>) -> usize {
    ((options.points - 1) / ENOUGH).max(1)
}

/// Samples of some output times.
pub(super) struct Picked {
    stride: usize,
    seen: usize,
    most: usize,
    /// Signal by signal.
    pub(super) columns: Vec<Vec<f64>>,
}

impl Picked {
    /// At most `most` of them.
    pub(super) fn new(options: &TransientOptions<'_>, most: usize) -> Self {
        Self { stride: stride(options), seen: 0, most, columns: vec![Vec::new(); options.signals.len()] }
    }

    pub(super) fn see(&mut self, values: &[f64]) {
        let wanted = self.seen.is_multiple_of(self.stride);
        if wanted && self.columns.first().is_some_and(|column| column.len() < self.most) {
            crate::budget::lay_out(size_of_val(values));
            self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
        }
        self.seen += 1;
    }

    /// Them as the signals of a result.
    pub(super) fn signals(self, of: &[(String, String, Vec<f64>)]) -> Vec<(String, String, Vec<f64>)> {
        of.iter().zip(self.columns).map(|((name, unit, _), column)| (name.clone(), unit.clone(), column)).collect()
    }
}
