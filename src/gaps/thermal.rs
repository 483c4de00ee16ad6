//! Mean temperature rise of beams that carry current.
//!
//! Steady one-dimensional conduction along each beam with uniform Joule heat P = R·I², end temperatures T_a and T_b above
//! ambient, and end-to-end conductance K = k·A/l (Carslaw & Jaeger, "Conduction of Heat in Solids", §4.9):
//! ```text
//! mean rise                 T̄   = (T_a + T_b)/2 + P/(12·K)
//! heat into the node at a   Q_a = K·(T_b − T_a) + P/2
//! ```
//! For a beam clamped to ambient at both ends, T̄ = V²/(12·ρ_el·k), whatever its length. Beams that meet share the
//! temperature of their node; anchors are at ambient. Since currents are linear in the source voltages u, each mean rise is
//! a quadratic form T̄ = uᵀ·Q·u. Heat W that comes from elsewhere, spread evenly along a beam, acts as P does and adds Z·W with
//! the same thermal resistances Z. Resistance and conductivity do not depend on temperature here.
//!
//! With a time constant the rise follows its steady value: [`super::lag`].

use super::input::Input;
use super::laplacian::Laplacian;
use super::network::Potentials;
use crate::sets::Sets;
use nalgebra::DVector;
use thiserror::Error;

/// A conductor of heat and current between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heater {
    /// First node.
    pub a: usize,
    /// Second node.
    pub b: usize,
    /// Electrical resistance [Ω].
    pub resistance: f64,
    /// Thermal conductance from end to end [W/K].
    pub conductance: f64,
    /// Thermal expansion coefficient [1/K].
    pub expansion: f64,
    /// Temperature at which it is as drawn [K].
    pub ambient: f64,
    /// Time constant [s]; 0: at once.
    pub time_constant: f64,
}

/// Heaters with their quadratic forms.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Heating {
    /// The heaters.
    pub heaters: Vec<Heater>,
    sources: usize,
    /// Heater by heater, its symmetric form Q over the sources, row-major [K/V²].
    form: Vec<f64>,
    /// Heater by heater, its current for each volt of the sources that drive the network [S].
    currents: Vec<DVector<f64>>,
    /// Nodes that stay at ambient.
    sink: Vec<bool>,
    /// Heater by heater, its rise for each watt of the inputs that follow the sources [K/W].
    heat: Vec<f64>,
}

/// A heated beam whose heat cannot leave: nothing conducts from it to an anchor.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("heater {heater} is not connected to any anchor through heat conductors")]
pub struct NoHeatSink {
    /// Index of a heater in that part.
    pub heater: usize,
}

impl Heating {
    /// Finds the forms over `sources` source voltages, of which the first drive the network. `sink[node]` tells which nodes
    /// stay at ambient.
    ///
    /// # Errors
    /// [`NoHeatSink`].
    pub fn new(
        heaters: Vec<Heater>,
        potentials: &Potentials,
        sources: usize,
        sink: &[bool],
    ) -> Result<Self, NoHeatSink> {
        let driven = potentials.potential.ncols();
        let conduction = Conduction::new(&heaters, sink)?;
        crate::budget::lay_out_matrix(heaters.len(), sources.saturating_mul(sources).saturating_add(2 * driven));
        let currents: Vec<DVector<f64>> =
            heaters.iter().map(|h| potentials.difference(h.a, h.b) / h.resistance).collect();
        let mut form = vec![0.0; heaters.len() * sources * sources];
        let mut watts = vec![0.0; heaters.len()];
        for i in 0..driven {
            for j in 0..=i {
                crate::budget::check();
                for ((watts, h), current) in watts.iter_mut().zip(&heaters).zip(&currents) {
                    *watts = h.resistance * current[i] * current[j];
                }
                for (k, rise) in conduction.rises(&heaters, &watts).into_iter().enumerate() {
                    form[(k * sources + i) * sources + j] = rise;
                    form[(k * sources + j) * sources + i] = rise;
                }
            }
        }
        Ok(Self { heaters, sources, form, currents, sink: sink.to_vec(), heat: Vec::new() })
    }

    /// The same with inputs behind the sources, some of them heat.
    pub fn with_heat(&self, inputs: &[Input]) -> Self {
        let mut heat = vec![0.0; self.heaters.len() * inputs.len()];
        if inputs.iter().any(|input| matches!(input, Input::Heat { .. }))
            && let Ok(conduction) = Conduction::new(&self.heaters, &self.sink)
        {
            for (i, input) in inputs.iter().enumerate() {
                let Input::Heat { heater } = input else { continue };
                let mut watts = vec![0.0; self.heaters.len()];
                watts[*heater] = 1.0;
                for (k, rise) in conduction.rises(&self.heaters, &watts).into_iter().enumerate() {
                    heat[k * inputs.len() + i] = rise;
                }
            }
        }
        Self { heat, ..self.clone() }
    }

    /// Inputs behind the sources.
    fn inputs(&self) -> usize {
        self.heat.len().checked_div(self.heaters.len()).unwrap_or(0)
    }

    /// Rise of heater `k` for each unit of source `source` in so far as that is heat [K/W].
    pub fn per_watt(&self, k: usize, source: usize) -> f64 {
        source.checked_sub(self.sources).map_or(0.0, |i| self.heat[k * self.inputs() + i])
    }

    /// Steady rise of heater `k` by the heat among the sources `u` [K].
    fn heated(&self, k: usize, u: &[f64]) -> f64 {
        let count = self.inputs();
        if count == 0 {
            return 0.0;
        }
        self.heat[k * count..(k + 1) * count].iter().zip(&u[self.sources..]).map(|(z, w)| z * w).sum()
    }

    /// Current in heater `k` for each volt of source `source` [S].
    pub fn current(&self, k: usize, source: usize) -> f64 {
        self.currents[k].get(source).copied().unwrap_or(0.0)
    }

    /// Entry (i, j) of the form of heater `k` [K/V²].
    #[inline]
    pub fn entry(&self, k: usize, i: usize, j: usize) -> f64 {
        self.form[(k * self.sources + i) * self.sources + j]
    }

    /// Mixed value uᵀ·Q·w of heater `k` [K].
    #[inline]
    pub fn mixed(&self, k: usize, u: &[f64], w: &[f64]) -> f64 {
        let s = self.sources;
        let mut sum = 0.0;
        for (i, u) in u[..s].iter().enumerate() {
            let row = &self.form[(k * s + i) * s..(k * s + i + 1) * s];
            sum += u * row.iter().zip(w).map(|(q, w)| q * w).sum::<f64>();
        }
        sum
    }

    /// Steady mean rise of heater `k` on the straight line from `from` to `to`: its coefficients in the share x of the way,
    /// c₀ + c₁·x + c₂·x² [K].
    pub fn between(&self, k: usize, from: &[f64], to: &[f64]) -> [f64; 3] {
        let (a, b, c) = (self.mixed(k, from, from), self.mixed(k, from, to), self.mixed(k, to, to));
        let (before, after) = (self.heated(k, from), self.heated(k, to));
        [a + before, 2.0 * (b - a) + (after - before), a - 2.0 * b + c]
    }

    /// Change of the steady mean rise of heater `k` at source voltages `u` with the sources, along `unit` [K].
    pub fn slope(&self, k: usize, u: &[f64], unit: &[f64]) -> f64 {
        2.0 * self.mixed(k, u, unit) + self.heated(k, unit)
    }

    /// Steady mean rise of heater `k` at source voltages `u` [K].
    pub fn steady(&self, k: usize, u: &[f64]) -> f64 {
        self.mixed(k, u, u) + self.heated(k, u)
    }
}

/// Conduction of heat between nodes and to those at ambient.
struct Conduction {
    /// Row of each node; none for one at ambient.
    row: Vec<Option<usize>>,
    free: usize,
    laplacian: Laplacian,
}

impl Conduction {
    /// # Errors
    /// [`NoHeatSink`].
    fn new(heaters: &[Heater], sink: &[bool]) -> Result<Self, NoHeatSink> {
        let mut row = vec![None; sink.len()];
        let mut free = 0;
        for h in heaters {
            for node in [h.a, h.b] {
                if !sink[node] && row[node].is_none() {
                    row[node] = Some(free);
                    free += 1;
                }
            }
        }
        if let Some(heater) = without_sink(heaters, sink) {
            return Err(NoHeatSink { heater });
        }
        let conductors = heaters.iter().map(|h| (row[h.a], row[h.b], h.conductance));
        let laplacian = Laplacian::new(free, conductors).ok_or(NoHeatSink { heater: 0 })?;
        Ok(Self { row, free, laplacian })
    }

    /// Mean rise of each heater for the heat into each [K, W].
    fn rises(&self, heaters: &[Heater], watts: &[f64]) -> Vec<f64> {
        let mut rise = vec![0.0; self.free];
        for (h, watts) in heaters.iter().zip(watts) {
            for row in [self.row[h.a], self.row[h.b]].into_iter().flatten() {
                rise[row] += 0.5 * watts;
            }
        }
        self.laplacian.solve(&mut rise);
        let at = |node: usize| self.row[node].map_or(0.0, |row| rise[row]);
        let one = |(h, watts): (&Heater, &f64)| 0.5 * (at(h.a) + at(h.b)) + watts / (12.0 * h.conductance);
        heaters.iter().zip(watts).map(one).collect()
    }
}

/// A heater of a part that holds no sink.
fn without_sink(heaters: &[Heater], sink: &[bool]) -> Option<usize> {
    let mut parts = Sets::new(sink.len());
    for h in heaters {
        parts.join(h.a, h.b);
    }
    let mut cooled = vec![false; sink.len()];
    (0..sink.len()).filter(|node| sink[*node]).for_each(|node| cooled[parts.first(node)] = true);
    heaters.iter().position(|h| !cooled[parts.first(h.a)])
}

#[cfg(test)]
mod tests {
    use super::super::network::Circuit;
    use super::*;

    fn bar(pieces: usize, volts_across: f64) -> f64 {
        // 200 µm × 2 µm × 2 µm, ρ = 2e-5 Ω·m, k = 41 W/(m·K), cut into equal pieces
        let (rho, k, length, area) = (2e-5, 41.0, 200e-6, 4e-12);
        let l = length / pieces as f64;
        let heater = |i: usize| Heater {
            a: i,
            b: i + 1,
            resistance: rho * l / area,
            conductance: k * area / l,
            expansion: 0.0,
            ambient: 0.0,
            time_constant: 0.0,
        };
        let heaters: Vec<_> = (0..pieces).map(heater).collect();
        let circuit = Circuit {
            nodes: pieces + 1,
            resistors: heaters.iter().map(|h| (h.a, h.b, h.resistance)).collect(),
            sources: vec![(0, Some(pieces))],
            grounds: vec![pieces],
        };
        let mut sink = vec![false; pieces + 1];
        (sink[0], sink[pieces]) = (true, true);
        let heating = Heating::new(heaters, &circuit.solve().unwrap(), 1, &sink).unwrap();
        (0..pieces).map(|p| heating.steady(p, &[volts_across])).sum::<f64>() / pieces as f64
    }

    /// A uniform clamped heater rises by V²/(12ρk) = 914.63 K at 3 V on average (ρ 2e-5 Ω·m, k 41 W/(m·K)), to 1e-12
    /// relative, in one piece or in seven.
    #[test]
    fn clamped_bar() {
        let exact: f64 = 9.0 / (12.0 * 2e-5 * 41.0);
        assert!((exact - 914.63).abs() < 0.01);
        for pieces in [1, 2, 7] {
            assert!((bar(pieces, 3.0) / exact - 1.0).abs() < 1e-12, "{pieces}");
        }
    }

    /// A heater without a path for its heat is refused.
    #[test]
    fn no_sink() {
        let h =
            Heater { a: 0, b: 1, resistance: 1.0, conductance: 1.0, expansion: 0.0, ambient: 0.0, time_constant: 0.0 };
        let circuit = Circuit { nodes: 2, resistors: vec![(0, 1, 1.0)], sources: vec![(0, Some(1))], grounds: vec![1] };
        let refused = Heating::new(vec![h], &circuit.solve().unwrap(), 1, &[false, false]);
        assert_eq!(refused, Err(NoHeatSink { heater: 0 }));
    }
}
