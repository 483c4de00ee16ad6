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
//! the same thermal resistances Z. Resistance and conductivity do not depend on temperature here. A beam may lose heat through gas to its
//! surroundings at ambient: `fin.rs`.
//!
//! With a time constant the rise follows its steady value: [`super::lag`]. Where a beam has a heat capacity instead, that comes from
//! `conduction.rs`.

use super::conduction::Conduction;
pub use super::conduction::{HeatConductor, NoHeatSink};
pub use super::heat_curves::{HeatCurves, RelativeCurve, TableEnd};
use super::hot::HotNetwork;
pub use super::hot::NoSteadyHeat;
use super::input::Input;
use super::network::{ElectricalNetwork, Potentials};
use nalgebra::{ComplexField, DVector};
use std::sync::Arc;

/// Voltage from which a runaway current is sought (V).
const FIRST_VOLTAGE: f64 = 1e-3;
/// Doublings of that voltage, at most.
const MAX_DOUBLINGS: usize = 40;
/// Change of the limit with a doubling that counts as none, and its distance from the current there (1).
const SAME_LIMIT: f64 = 1e-6;
const NEAR_LIMIT: f64 = 1e-2;

/// Heaters with their quadratic forms.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Heating {
    /// The heaters.
    pub heaters: Vec<HeatConductor>,
    sources: usize,
    /// Heater by heater, its symmetric form Q over the sources, row-major (K/V²).
    form: Vec<f64>,
    /// Heater by heater, its current for each volt of the sources that drive the network (S).
    currents: Vec<DVector<f64>>,
    /// Whether a source heats anything, one for each with the inputs behind.
    warms: Vec<bool>,
    /// Nodes that stay at ambient.
    sink: Vec<bool>,
    /// Heater by heater, its rise for each watt of the inputs that follow the sources (K/W).
    heat: Vec<f64>,
    /// Input by input behind the sources, the heater that it heats.
    heated_by: Vec<Option<usize>>,
    /// The network with resistances that depend on temperature; none where no one does.
    hot: Option<Arc<HotNetwork>>,
}

impl Heating {
    /// Finds the forms over `sources` source voltages, of which the first drive the network. `sink[node]` is true for
    /// nodes at ambient temperature.
    ///
    /// # Errors
    /// [`NoHeatSink`].
    pub fn new(
        mut heaters: Vec<HeatConductor>,
        potentials: &Potentials,
        sources: usize,
        sink: &[bool],
    ) -> Result<Self, NoHeatSink> {
        let driven = potentials.potential.ncols();
        let conduction = Conduction::new(&heaters, sink)?;
        bimorph_base::budget::lay_out_matrix(heaters.len(), sources.saturating_mul(sources).saturating_add(2 * driven));
        let currents: Vec<DVector<f64>> =
            heaters.iter().map(|h| potentials.difference(h.a, h.b) / h.resistance).collect();
        let mut form = vec![0.0; heaters.len() * sources * sources];
        let mut watts = vec![0.0; heaters.len()];
        for i in 0..driven {
            for j in 0..=i {
                bimorph_base::budget::check();
                for ((watts, h), current) in watts.iter_mut().zip(&heaters).zip(&currents) {
                    *watts = h.resistance * current[i] * current[j];
                }
                for (k, rise) in conduction.rises(&heaters, &watts).into_iter().enumerate() {
                    form[(k * sources + i) * sources + j] = rise;
                    form[(k * sources + j) * sources + i] = rise;
                }
            }
        }
        if heaters.iter().any(|h| h.delayed) {
            // that of one volt of each source in turn, all together
            for (k, watts) in watts.iter_mut().enumerate() {
                *watts = heaters[k].resistance * currents[k].norm_squared();
            }
            let delays = conduction.delays(&heaters, &watts);
            heaters.iter_mut().zip(delays).filter(|(h, _)| h.delayed).for_each(|(h, tau)| h.time_constant = tau);
        }
        let warms = |i: usize| {
            form.chunks_exact(sources * sources).any(|q| q[i * sources..][..sources].iter().any(|q| *q != 0.0))
        };
        let warms = (0..sources).map(warms).collect();
        Ok(Self { heaters, sources, form, currents, warms, sink: sink.to_vec(), ..Self::default() })
    }

    /// The same with properties that depend on temperature, where heaters of the circuit have such. `held[node]` is the rise of a node at a given
    /// temperature; 0: ambient (K).
    pub fn with_hot(self, circuit: &ElectricalNetwork, held: &[f64]) -> Self {
        let hot = HotNetwork::new(&self.heaters, circuit, (&self.sink, held)).map(Arc::new);
        Self { hot, ..self }
    }

    /// Steady rises without any voltage or input (K), of [`Heating::states`]: where a run begins.
    pub fn rest(&self) -> Vec<f64> {
        let mut rise = vec![0.0; self.states()];
        if self.hot.as_ref().is_some_and(|hot| hot.is_held_off_ambient()) {
            self.rises(&vec![0.0; self.sources + self.inputs()], &mut rise);
        }
        rise
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
        let heated_by = inputs.iter().map(|input| match input {
            Input::Heat { heater } => Some(*heater),
            _ => None,
        });
        let heated_by: Vec<Option<usize>> = heated_by.collect();
        let warms = self.warms[..self.sources].iter().copied().chain(heated_by.iter().map(Option::is_some)).collect();
        let heated = heated_by.iter().enumerate().filter_map(|(i, k)| Some((self.sources + i, (*k)?)));
        let hot = self.hot.as_ref().map(|hot| Arc::new(hot.heated(heated.collect())));
        Self { heat, heated_by, hot, warms, ..self.clone() }
    }

    /// Inputs behind the sources.
    fn inputs(&self) -> usize {
        self.heat.len().checked_div(self.heaters.len()).unwrap_or(0)
    }

    /// Whether a source heats anything at properties that do not depend on temperature.
    #[inline]
    pub fn is_warmed_by(&self, source: usize) -> bool {
        self.warms.get(source).is_some_and(|warms| *warms)
    }

    /// Rise of heater `k` for each unit of source `source` in so far as that is heat (K/W).
    #[inline]
    pub fn per_watt(&self, k: usize, source: usize) -> f64 {
        source.checked_sub(self.sources).map_or(0.0, |i| self.heat[k * self.inputs() + i])
    }

    /// Steady rise of heater `k` by the heat among the sources `u` (K).
    fn heated(&self, k: usize, u: &[f64]) -> f64 {
        let count = self.inputs();
        if count == 0 {
            return 0.0;
        }
        self.heat[k * count..(k + 1) * count].iter().zip(&u[self.sources..]).map(|(z, w)| z * w).sum()
    }

    /// Current in heater `k` for each volt of source `source` (S).
    #[inline]
    pub fn current(&self, k: usize, source: usize) -> f64 {
        self.currents[k].get(source).copied().unwrap_or(0.0)
    }

    /// Entry (i, j) of the form of heater `k` (K/V²).
    #[inline]
    pub fn entry(&self, k: usize, i: usize, j: usize) -> f64 {
        self.form[(k * self.sources + i) * self.sources + j]
    }

    /// Mixed value uᵀ·Q·w of heater `k` (K).
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

    /// Steady mean rise of heater `k` on the straight line from `from` to `to`: its coefficients in the fraction x of the way,
    /// c₀ + c₁·x + c₂·x² (K).
    #[inline]
    pub fn between(&self, k: usize, from: &[f64], to: &[f64]) -> [f64; 3] {
        if from == to {
            return [self.mixed(k, from, from) + self.heated(k, from), 0.0, 0.0];
        }
        let (a, b, c) = (self.mixed(k, from, from), self.mixed(k, from, to), self.mixed(k, to, to));
        let (before, after) = (self.heated(k, from), self.heated(k, to));
        [a + before, 2.0 * (b - a) + (after - before), a - 2.0 * b + c]
    }

    /// Change of the steady mean rise of heater `k` at source voltages `u` with the sources, along `unit` (K).
    #[inline]
    pub fn slope(&self, k: usize, u: &[f64], unit: &[f64]) -> f64 {
        2.0 * self.mixed(k, u, unit) + self.heated(k, unit)
    }

    /// The network with resistances that depend on temperature, if any does.
    #[inline]
    pub(crate) fn hot(&self) -> Option<&HotNetwork> {
        self.hot.as_deref()
    }

    /// Whether a resistance depends on temperature.
    #[inline]
    pub fn is_hot(&self) -> bool {
        self.hot.is_some()
    }

    /// Length of the vector of rises: the means of each heater, then the rises of the nodes along them where properties depend on temperature.
    #[inline]
    pub fn states(&self) -> usize {
        self.means() + self.hot.as_ref().map_or(0, |hot| hot.states())
    }

    /// Its length without those nodes: the mean rise of each heater (K); where properties have curves, then the mean free strain of each (1), and then the
    /// mean change of the resistance of each over that at ambient temperature (1).
    #[inline]
    pub fn means(&self) -> usize {
        self.heaters.len() * self.hot.as_ref().map_or(1, |hot| hot.values_of_a_beam())
    }

    /// Free strain of heater `k` at a vector of rises, or its change with a change of them (1).
    #[inline]
    pub fn strain(&self, k: usize, rise: &[f64]) -> f64 {
        match &self.hot {
            Some(hot) => hot.strain(k, rise),
            None => self.heaters[k].expansion * rise[k],
        }
    }

    /// Resistance of heater `k` at a vector of rises (Ω).
    pub fn resistance(&self, k: usize, rise: &[f64]) -> f64 {
        self.hot.as_ref().map_or(self.heaters[k].resistance, |hot| hot.resistance(k, rise))
    }

    /// Checks that source voltages `u` have a steady state.
    ///
    /// # Errors
    /// [`NoSteadyHeat`].
    pub fn check(&self, u: &[f64]) -> Result<(), NoSteadyHeat> {
        let Some(hot) = &self.hot else { return Ok(()) };
        hot.steady(u, &mut vec![0.0; hot.states()]).map(drop)
    }

    /// Current into an electrical source to which its current tends at high voltages, the other sources at `u`: no steady state exists at a
    /// larger one (A). `None` where there is none.
    pub fn runaway_current(&self, u: &[f64], source: usize) -> Option<f64> {
        let hot = self.hot.as_ref()?;
        let mut u = u.to_vec();
        u[source] = FIRST_VOLTAGE;
        let (mut state, mut means) = (vec![0.0; hot.states()], vec![0.0; self.means()]);
        // for high voltages it is the limit less a part in proportion to 1/V
        let (mut last, mut limit) = (0.0, f64::NAN);
        for _ in 0..MAX_DOUBLINGS {
            hot.steady(&u, &mut state).ok()?;
            hot.means(&state, &mut means);
            let current = hot.source_currents(&hot.flows(&means, &u, |_| 0.0), &u)[source];
            let next = 2.0 * current - last;
            if (next - limit).abs() <= SAME_LIMIT * next.abs() && (next - current).abs() < NEAR_LIMIT * next.abs() {
                return Some(next);
            }
            (last, limit) = (current, next);
            u[source] *= 2.0;
        }
        None
    }

    /// Steady rises at source voltages `u` (K), of [`Heating::states`]; not numbers where there are none.
    #[inline]
    pub fn rises(&self, u: &[f64], rise: &mut [f64]) {
        let Some(hot) = &self.hot else {
            rise.iter_mut().enumerate().for_each(|(k, rise)| *rise = self.steady(k, u));
            return;
        };
        let (means, state) = rise.split_at_mut(self.means());
        match hot.steady(u, state) {
            Ok(_) => hot.means(state, means),
            Err(_) => rise.fill(f64::NAN),
        }
    }

    /// Changes of the steady rises `rise` at source voltages `u` with the sources, along `unit` (K).
    #[inline]
    pub fn slopes(&self, u: &[f64], rise: &[f64], unit: &[f64], out: &mut [f64]) {
        if self.hot.is_none() {
            out.iter_mut().enumerate().for_each(|(k, slope)| *slope = self.slope(k, u, unit));
            return;
        }
        let response = self.response((u, rise), unit, 0.0f64);
        out.iter_mut().zip(&response).for_each(|(out, x)| *out = *x);
    }

    /// Changes of the rises about a state for a unit of the sources along `unit` that goes as e^(st), resistances depending on
    /// temperature (K).
    pub fn response<T: ComplexField<RealField = f64> + Copy>(
        &self,
        (u, rise): (&[f64], &[f64]),
        unit: &[f64],
        s: T,
    ) -> Vec<T> {
        let count = self.means();
        let mut found = vec![T::from_real(0.0); self.states()];
        if let Some(hot) = &self.hot {
            let (means, state) = found.split_at_mut(count);
            hot.respond_about((u, &rise[count..]), unit, s, means, state);
        }
        found
    }

    /// Slowest time constant of a state whose resistances depend on temperature, at held source voltages (s); none without such.
    pub fn slowest(&self, u: &[f64], rise: &[f64]) -> Option<f64> {
        Some(self.hot.as_ref()?.slowest(u, &rise[self.means()..]))
    }

    /// Highest steady rise along each heater at source voltages `u` (K).
    pub fn peaks(&self, u: &[f64]) -> Vec<f64> {
        if let Some(hot) = &self.hot {
            let mut state = vec![0.0; hot.states()];
            return match hot.steady(u, &mut state) {
                Ok(_) => (0..self.heaters.len()).map(|k| hot.peak(k, &state)).collect(),
                Err(_) => Vec::new(),
            };
        }
        let Ok(conduction) = Conduction::new(&self.heaters, &self.sink) else { return Vec::new() };
        let mut watts: Vec<f64> = (self.heaters.iter().zip(&self.currents))
            .map(|(h, current)| h.resistance * current.iter().zip(u).map(|(i, u)| i * u).sum::<f64>().powi(2))
            .collect();
        if let Some(given) = u.get(self.sources..) {
            for (input, watt) in self.heated_by.iter().zip(given) {
                input.iter().for_each(|heater| watts[*heater] += watt);
            }
        }
        conduction.peaks(&self.heaters, &watts)
    }

    /// Steady mean rise of heater `k` at source voltages `u` (K).
    #[inline]
    pub fn steady(&self, k: usize, u: &[f64]) -> f64 {
        self.mixed(k, u, u) + self.heated(k, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(pieces: usize) -> Heating {
        bar_in_gas(pieces, 0.0)
    }

    /// The same that loses heat through gas: `gas` of all of its length (W/K).
    fn bar_in_gas(pieces: usize, gas: f64) -> Heating {
        // 200 µm × 2 µm × 2 µm, ρ = 2e-5 Ω·m, k = 41 W/(m·K), cut into equal pieces
        let (rho, k, length, area) = (2e-5, 41.0, 200e-6, 4e-12);
        let l = length / pieces as f64;
        let heater = |i: usize| HeatConductor {
            a: i,
            b: i + 1,
            resistance: rho * l / area,
            conductance: k * area / l,
            expansion: 0.0,
            ambient: 0.0,
            time_constant: 0.0,
            delayed: true,
            capacity: 1600e3 * l * area,
            gas: gas / pieces as f64,
            ..HeatConductor::default()
        };
        let heaters: Vec<_> = (0..pieces).map(heater).collect();
        let circuit = ElectricalNetwork {
            nodes: pieces + 1,
            resistors: heaters.iter().map(|h| (h.a, h.b, h.resistance)).collect(),
            sources: vec![(0, Some(pieces))],
            grounds: vec![pieces],
        };
        let mut sink = vec![false; pieces + 1];
        (sink[0], sink[pieces]) = (true, true);
        Heating::new(heaters, &circuit.solve().unwrap(), 1, &sink).unwrap()
    }

    /// However a bar is cut, its mean rise lags by ρ·c·l²/(10·k) (heat capacity 1.6 MJ/(m³·K)): the delays of its pieces, weighed with
    /// their rises. A half of it lags as the whole does, not as a bar of half the length.
    #[test]
    fn a_bar_of_pieces_is_as_slow_as_the_bar() {
        let exact = 1600e3 * 200e-6f64.powi(2) / (10.0 * 41.0);
        for pieces in [1, 2, 3, 7] {
            let bar = bar(pieces);
            let rise: Vec<f64> = (0..pieces).map(|p| bar.steady(p, &[1.0])).collect();
            let late = bar.heaters.iter().zip(&rise).map(|(h, rise)| h.time_constant * rise).sum::<f64>();
            assert!((late / rise.iter().sum::<f64>() / exact - 1.0).abs() < 1e-12, "{pieces}");
        }
        assert!((bar(2).heaters[0].time_constant / exact - 1.0).abs() < 1e-12);
    }

    /// A uniform clamped heater rises by V²/(12ρk) = 914.63 K at 3 V on average (ρ 2e-5 Ω·m, k 41 W/(m·K)), to 1e-12
    /// relative, in one piece or in seven.
    #[test]
    fn clamped_bar() {
        let exact: f64 = 9.0 / (12.0 * 2e-5 * 41.0);
        assert!((exact - 914.63).abs() < 0.01);
        for pieces in [1, 2, 7] {
            let bar = bar(pieces);
            let mean = (0..pieces).map(|p| bar.steady(p, &[3.0])).sum::<f64>() / pieces as f64;
            assert!((mean / exact - 1.0).abs() < 1e-12, "{pieces}");
        }
    }

    /// A bar of 1 kΩ with a loss through gas, in one piece or in seven, at 1 V. The mean rise is P/G·(1 − tanh(μ/2)/(μ/2)), the highest
    /// P/G·(1 − 1/cosh(μ/2)). The delay is C times minus the logarithmic slope of the mean with G (central difference). These are closed
    /// forms of a fin between cold ends.
    #[test]
    fn a_bar_in_gas() {
        let (conductance, gas, capacity) = (41.0 * 4e-12 / 200e-6, 2.08e-5, 1600e3 * 200e-6 * 4e-12);
        let half = |gas: f64| 0.5 * (gas / conductance).sqrt();
        let mean = |gas: f64| 1e-3 / gas * (1.0 - half(gas).tanh() / half(gas));
        let (low, high) = (mean(gas * (1.0 - 1e-5)), mean(gas * (1.0 + 1e-5)));
        let delay = -capacity * (high - low) / (2e-5 * gas) / mean(gas);
        for pieces in [1, 3, 7] {
            let bar = bar_in_gas(pieces, gas);
            let rise: Vec<f64> = (0..pieces).map(|p| bar.steady(p, &[1.0])).collect();
            let found = rise.iter().sum::<f64>() / pieces as f64;
            assert!((found / mean(gas) - 1.0).abs() < 1e-12, "{pieces}: {found}");
            let late = bar.heaters.iter().zip(&rise).map(|(h, rise)| h.time_constant * rise).sum::<f64>();
            let late = late / rise.iter().sum::<f64>();
            assert!((late / delay - 1.0).abs() < 1e-8, "{pieces}: {late} {delay}");
            let peak = bar.peaks(&[1.0]).into_iter().fold(0.0, f64::max);
            assert!((peak / (1e-3 / gas * (1.0 - half(gas).cosh().recip())) - 1.0).abs() < 1e-12, "{pieces}: {peak}");
        }
    }

    /// Heat that comes from elsewhere, without any circuit, lags as that of a current does; and a piece whose own time constant is given still
    /// takes its heat.
    #[test]
    fn delays_need_no_current() {
        let driven = bar(4);
        let heaters: Vec<HeatConductor> =
            driven.heaters.iter().map(|h| HeatConductor { time_constant: 0.0, ..h.clone() }).collect();
        let sink = [true, false, false, false, true];
        let none = ElectricalNetwork { nodes: 5, resistors: Vec::new(), sources: Vec::new(), grounds: Vec::new() };
        let alone = Heating::new(heaters.clone(), &none.solve().unwrap(), 0, &sink).unwrap();
        let given: Vec<HeatConductor> = heaters
            .iter()
            .enumerate()
            .map(|(k, h)| HeatConductor { delayed: k != 0, time_constant: 1e-6, ..h.clone() })
            .collect();
        let beside = Heating::new(given, &none.solve().unwrap(), 0, &sink).unwrap();
        for k in 1..4 {
            let want = driven.heaters[k].time_constant;
            for heating in [&alone, &beside] {
                assert!((heating.heaters[k].time_constant / want - 1.0).abs() < 1e-12, "{k}");
            }
        }
        assert_eq!(beside.heaters[0].time_constant, 1e-6);
    }

    /// Heat W that comes from elsewhere raises the mean of a clamped bar by W/(12·K), and reaches other pieces as theirs reaches its own
    /// (reciprocity, 1e-12). Of three pieces of conductance K the last raises itself and the middle one by W/(4·K), the first by W/(12·K). An
    /// input that is no heat raises nothing.
    #[test]
    fn heat_from_elsewhere() {
        let one = bar(1).with_heat(&[Input::Rate, Input::Heat { heater: 0 }]);
        let per_watt = 1.0 / (12.0 * one.heaters[0].conductance);
        assert_eq!((one.per_watt(0, 0), one.per_watt(0, 1)), (0.0, 0.0));
        assert!((one.per_watt(0, 2) / per_watt - 1.0).abs() < 1e-12);
        let expected = bar(1).steady(0, &[3.0]) + 2e-3 * per_watt;
        assert!((one.steady(0, &[3.0, 7.0, 2e-3]) / expected - 1.0).abs() < 1e-12);
        let three = bar(3).with_heat(&[Input::Heat { heater: 2 }, Input::Heat { heater: 0 }]);
        assert!((three.per_watt(0, 1) / three.per_watt(2, 2) - 1.0).abs() < 1e-12);
        // half of it flows to the node that the last two pieces share, whose rise is W/(3·K)
        let piece = 1.0 / three.heaters[0].conductance;
        for (k, parts) in [(2, 4.0), (1, 4.0), (0, 12.0)] {
            assert!((three.per_watt(k, 1) / (piece / parts) - 1.0).abs() < 1e-12, "{k}");
        }
    }

    /// Three pieces of a bar between two sources. The rise is the sum of the entries of its form times voltages. The way between two
    /// states is the quadratic through them, and the slope is its derivative: a central difference is exact for a quadratic (1e-9).
    #[test]
    fn quadratic_in_the_sources() {
        let circuit = ElectricalNetwork {
            nodes: 4,
            resistors: bar(3).heaters.iter().map(|h| (h.a, h.b, h.resistance)).collect(),
            sources: vec![(0, None), (2, None)],
            grounds: vec![3],
        };
        let sink = [true, false, false, true];
        let heating = Heating::new(bar(3).heaters, &circuit.solve().unwrap(), 2, &sink).unwrap();
        let heating = heating.with_heat(&[Input::Heat { heater: 1 }]);
        let (from, to) = ([1.0, -0.5, 1e-3], [2.5, 0.7, 3e-3]);
        let along = |x: f64| -> Vec<f64> { (0..3).map(|i| from[i] + x * (to[i] - from[i])).collect() };
        let unit: Vec<f64> = (0..3).map(|i| to[i] - from[i]).collect();
        for k in 0..3 {
            let by_entries: f64 = (0..2)
                .flat_map(|i| (0..2).map(move |j| (i, j)))
                .map(|(i, j)| heating.entry(k, i, j) * to[i] * to[j])
                .sum();
            let rise = heating.steady(k, &to);
            assert!(((by_entries + heating.per_watt(k, 2) * to[2]) / rise - 1.0).abs() < 1e-12);
            let [c0, c1, c2] = heating.between(k, &from, &to);
            for x in [0.0, 0.3, 1.0] {
                assert!(((c0 + x * (c1 + x * c2)) / heating.steady(k, &along(x)) - 1.0).abs() < 1e-12, "{k} {x}");
            }
            let numeric = (heating.steady(k, &along(0.6)) - heating.steady(k, &along(0.4))) / 0.2;
            assert!((heating.slope(k, &along(0.5), &unit) / numeric - 1.0).abs() < 1e-9, "{k}");
        }
        // the current of the first source reaches the second through two pieces in series
        assert!((heating.current(0, 0) * 2.0 * heating.heaters[0].resistance - 1.0).abs() < 1e-12);
        assert_eq!(heating.current(2, 0), 0.0);
    }

    /// A heater without a path for its heat is refused.
    #[test]
    fn no_sink() {
        let h = HeatConductor {
            a: 0,
            b: 1,
            resistance: 1.0,
            conductance: 1.0,
            expansion: 0.0,
            ambient: 0.0,
            time_constant: 0.0,
            delayed: false,
            capacity: 0.0,
            gas: 0.0,
            ..HeatConductor::default()
        };
        let circuit =
            ElectricalNetwork { nodes: 2, resistors: vec![(0, 1, 1.0)], sources: vec![(0, Some(1))], grounds: vec![1] };
        let refused = Heating::new(vec![h], &circuit.solve().unwrap(), 1, &[false, false]);
        assert_eq!(refused, Err(NoHeatSink { heater: 0 }));
    }
}
