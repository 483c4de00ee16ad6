//! Means along each beam: what a vector of rises has before the rises of the nodes.

use super::{HotNetwork, unit_imaginary};
use nalgebra::ComplexField;

impl HotNetwork {
    /// Values of a beam before the state in a vector of rises: its mean rise; with curves also its free strain and the relative change of its resistance.
    pub(crate) fn values_of_a_beam(&self) -> usize {
        if self.curved { 3 } else { 1 }
    }

    /// Mean rise of each beam (K); with curves then the mean free strain of each (1), and the mean change of its resistance over that at ambient temperature (1).
    pub(crate) fn means(&self, state: &[f64], out: &mut [f64]) {
        let beams = self.bars.len();
        for (k, bar) in self.bars.iter().enumerate() {
            let (ends, inner) = (self.ends_of(k, state), self.inner_of(k, state));
            out[k] = bar.mean(ends, inner);
            if self.curved {
                [out[beams + k], out[2 * beams + k]] = bar.mean_laws(ends, inner);
            }
        }
    }

    /// Changes of [`HotNetwork::means`] at a state.
    pub(crate) fn mean_changes<T: ComplexField<RealField = f64> + Copy>(
        &self,
        state: &[f64],
        change: &[T],
        out: &mut [T],
    ) {
        let beams = self.bars.len();
        for (k, bar) in self.bars.iter().enumerate() {
            let part = |of: fn(T) -> f64| {
                let inner: Vec<f64> = self.inner_of(k, change).iter().map(|x| of(*x)).collect();
                bar.mean(self.changes_of(k, change).map(of), &inner)
            };
            out[k] = T::from_real(part(T::real)) + unit_imaginary::<T>() * T::from_real(part(T::imaginary));
            if self.curved {
                let at = (self.ends_of(k, state), self.inner_of(k, state));
                let changes = (self.changes_of(k, change), self.inner_of(k, change));
                [out[beams + k], out[2 * beams + k]] = bar.mean_law_changes(at, changes);
            }
        }
    }

    /// Resistance of beam `k` at means (Ω).
    pub(crate) fn resistance(&self, k: usize, means: &[f64]) -> f64 {
        let bar = &self.bars[k];
        let change = if self.curved { means[2 * self.bars.len() + k] } else { bar.coefficient * means[k] };
        bar.resistance * (1.0 + change)
    }

    /// Free strain of beam `k` at means, or its change with changes of them (1).
    pub(crate) fn strain(&self, k: usize, means: &[f64]) -> f64 {
        if self.curved { means[self.bars.len() + k] } else { self.bars[k].expansion * means[k] }
    }
}
