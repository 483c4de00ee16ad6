//! One beam with properties that depend on its temperature: quadratic elements along it, reduced to its ends.
//!
//! Let s go from 0 to 1 along the beam. K is its conductance from end to end, G that to the surroundings, R₀ its resistance and C its
//! heat capacity. B·T⁴ is the power that it radiates at the absolute temperature T, T₀ that of the surroundings, and T_s the rise of the substrate. The rise T(s) and the current I satisfy
//! ```text
//! C·c(T)·∂T/∂t = K·∂(κ(T)·∂T/∂s)/∂s − G·∫γ(θ)dθ − B·((T₀ + T)⁴ − T₀⁴) + I²·R₀·r(T),      V = I·R₀·∫r(T)ds
//! r(T) = 1 + TCR·T,      κ(T) = 1/(1 + TCK·T),      c(T) = 1 + TCC·T,      γ = 1
//! ```
//! with the integral from T_s to T: Kirchhoff's transformation of the gas between two faces at these temperatures, whatever its shape,
//! in weak form on elements with a node in their middle, integrated by three Gauss points. Where a property has a curve, that stands for r, κ, c or γ, and
//! the mean strain ∫∫α(T)dT ds and the mean of r are integrated by the same points. Newton's matrix of the inner nodes has two
//! bands on either side. Its solution for the rises of the ends, the current and the residual leaves three equations: the heat that the
//! ends receive, and the voltage.

use super::super::heat_curves::{HeatCurves, RelativeCurve, linear_or, reciprocal_or};
use super::element::{DERIVATIVES, POINTS, SHAPES};
use nalgebra::ComplexField;
use std::sync::Arc;

/// A beam that carries current, whose resistance depends on its temperature.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HotBeam {
    /// Thermal conductance from end to end (W/K).
    pub(super) conductance: f64,
    /// Thermal conductance to the surroundings (W/K).
    pub(super) gas: f64,
    /// Resistance at ambient temperature (Ω).
    pub(super) resistance: f64,
    /// Relative change of the resistivity with the rise (1/K).
    pub(super) coefficient: f64,
    /// Relative change of the thermal resistivity with the rise (1/K).
    pub(super) thermal_coefficient: f64,
    /// Heat capacity at ambient temperature (J/K).
    pub(super) capacity: f64,
    /// Relative change of the heat capacity with the rise (1/K).
    pub(super) capacity_coefficient: f64,
    /// Radiated power over the fourth power of the temperature (W/K⁴).
    pub(super) radiation: f64,
    /// Temperature of the surroundings (K).
    pub(super) ambient: f64,
    /// Rise of the substrate to which the gas conducts (K).
    pub(super) substrate: f64,
    /// Thermal expansion, where it has no curve (1/K).
    pub(super) expansion: f64,
    /// Properties that have curves; none: no one has.
    pub(super) curves: Option<Arc<HeatCurves>>,
    /// Elements.
    pub(super) elements: usize,
    /// Where its inner nodes begin in the vector of rises.
    pub(super) first: usize,
}

/// Entries of a row of Newton's matrix of the inner nodes: two below the diagonal, itself, two above.
type Row<T> = [T; 5];

/// Newton's equations of a beam about a state, with the matrix of the inner nodes factored.
#[derive(Debug, Clone)]
pub(super) struct Reduced<T> {
    rows: Vec<Row<T>>,
    /// Solutions of the inner nodes for a unit rise of each end and a unit of current.
    inner: Vec<[T; 3]>,
    /// Entries between the inner nodes and the ends: the row of each end.
    ends: [Vec<T>; 2],
    /// Change of the heat flow at each node with the current (W/A).
    by_current: Vec<T>,
    /// I times the change of the resistance with the rise of each node (V/K).
    by_rise: Vec<T>,
    /// Slopes of the heat into both ends and of the current with the rises of the ends and the voltage: what the network assembles.
    pub(super) outer: [[T; 3]; 3],
    /// Differential resistance (Ω).
    resistance: T,
    /// Negative pivots of the inner nodes and the voltage, by their real parts.
    pub(super) negative: usize,
}

/// Residuals of a beam at a state, without the heat between beams.
#[derive(Debug, Clone, Default)]
pub(super) struct BeamResidual {
    /// Heat balance of each node (W).
    pub(super) heat: Vec<f64>,
    /// Resistance (Ω).
    pub(super) resistance: f64,
}

/// Rises of the ends and of the inner nodes of a beam, or their rates.
type Nodes<'a> = ([f64; 2], &'a [f64]);

/// A change of the state of a beam, from its ends, its voltage, and residuals that it removes.
pub(super) struct BeamChange<'a, T> {
    /// Changes of the rises of both ends (K).
    pub(super) ends: [T; 2],
    /// Change of the voltage (V).
    pub(super) volts: T,
    /// Solutions of the inner nodes for the residuals.
    pub(super) inner: &'a [T],
    /// Voltage that is missing (V).
    pub(super) missing: T,
}

fn real<T: ComplexField<RealField = f64> + Copy>(x: f64) -> T {
    T::from_real(x)
}

impl HotBeam {
    /// Resistivity over that at ambient temperature, and its slope (1, 1/K).
    pub(super) fn resistivity(&self, t: f64) -> [f64; 2] {
        linear_or(self.coefficient, self.curves.as_ref().and_then(|c| c.resistance.as_ref()), t)
    }

    /// Conductivity over that at ambient temperature, and its slope (1, 1/K).
    pub(super) fn conductivity(&self, t: f64) -> [f64; 2] {
        reciprocal_or(self.thermal_coefficient, self.curves.as_ref().and_then(|c| c.conductance.as_ref()), t)
    }

    /// Heat capacity over that at ambient temperature, and its slope (1, 1/K).
    pub(super) fn capacity_law(&self, t: f64) -> [f64; 2] {
        linear_or(self.capacity_coefficient, self.curves.as_ref().and_then(|c| c.capacity.as_ref()), t)
    }

    /// Conductivity of the gas over that at ambient temperature (1).
    pub(super) fn gas_law(&self, t: f64) -> f64 {
        self.gas_curve().map_or(1.0, |curve| curve.between(t, t)[1])
    }

    fn gas_curve(&self) -> Option<&RelativeCurve> {
        self.curves.as_ref().and_then(|c| c.gas.as_ref())
    }

    /// Whether its heat capacity depends on temperature.
    fn capacity_changes(&self) -> bool {
        self.capacity_coefficient != 0.0 || self.curves.as_ref().is_some_and(|c| c.capacity.is_some())
    }

    /// Free strain at a rise, and its slope (1, 1/K).
    fn strain(&self, t: f64) -> [f64; 2] {
        match self.curves.as_ref().and_then(|c| c.expansion.as_ref()) {
            Some((curve, ambient)) => [curve.integral(*ambient, ambient + t), curve.at(ambient + t)[0]],
            None => [self.expansion * t, self.expansion],
        }
    }

    /// Mean free strain, and the mean change of the resistance over that at ambient temperature (1).
    pub(super) fn mean_laws(&self, ends: [f64; 2], inner: &[f64]) -> [f64; 2] {
        let mut means = [0.0; 2];
        self.points(ends, inner, |_, weight, _, _, [t, _]| {
            let part = weight / self.elements as f64;
            means[0] += self.strain(t)[0] * part;
            means[1] += (self.resistivity(t)[0] - 1.0) * part;
        });
        means
    }

    /// Second derivative of the mean free strain along two changes of the rises.
    pub(super) fn strain_bend(&self, (ends, inner): Nodes<'_>, changes: [Nodes<'_>; 2]) -> f64 {
        let mut bend = 0.0;
        let Some((curve, ambient)) = self.curves.as_ref().and_then(|c| c.expansion.as_ref()) else { return bend };
        self.points(ends, inner, |first, weight, shape, _, [t, _]| {
            let [a, b] =
                changes.map(|(ends, inner)| (0..3).map(|i| shape[i] * self.at(first + i, ends, inner)).sum::<f64>());
            bend += curve.at(ambient + t)[1] * a * b * weight / self.elements as f64;
        });
        bend
    }

    /// The change of both with changes of the rises.
    pub(super) fn mean_law_changes<T: ComplexField<RealField = f64> + Copy>(
        &self,
        (ends, inner): Nodes<'_>,
        (end_changes, changes): ([T; 2], &[T]),
    ) -> [T; 2] {
        let mut means = [real(0.0); 2];
        let change = |j: usize| match j {
            0 => end_changes[0],
            j if j > changes.len() => end_changes[1],
            j => changes[j - 1],
        };
        self.points(ends, inner, |first, weight, shape, _, [t, _]| {
            let dt = (0..3).fold(real::<T>(0.0), |sum, i| sum + change(first + i) * real(shape[i]));
            let part = weight / self.elements as f64;
            means[0] += dt * real(self.strain(t)[1] * part);
            means[1] += dt * real(self.resistivity(t)[1] * part);
        });
        means
    }

    /// Power that leaves to the surroundings at a rise, as if all of the beam had it, and its slope (W, W/K).
    fn aside(&self, t: f64) -> [f64; 2] {
        let [conducted, slope] = match self.gas_curve() {
            Some(curve) => curve.between(self.substrate, t).map(|x| self.gas * x),
            None => [self.gas * (t - self.substrate), self.gas],
        };
        if self.radiation == 0.0 {
            return [conducted, slope];
        }
        let there = self.ambient + t;
        // (T₀ + t)⁴ − T₀⁴ without cancellation
        let power = t * (there + self.ambient) * (there * there + self.ambient * self.ambient);
        [conducted + self.radiation * power, slope + 4.0 * self.radiation * there.powi(3)]
    }

    /// Number of inner nodes.
    pub(super) fn inner(&self) -> usize {
        2 * self.elements - 1
    }

    /// The rise at node `j` of 0 to 2·elements.
    fn at(&self, j: usize, ends: [f64; 2], inner: &[f64]) -> f64 {
        match j {
            0 => ends[0],
            j if j > inner.len() => ends[1],
            j => inner[j - 1],
        }
    }

    /// Calls `see` for each Gauss point with its first node, its weight in s, its shape functions and derivatives, the rise and its slope.
    fn points(&self, ends: [f64; 2], inner: &[f64], mut see: impl FnMut(usize, f64, &[f64; 3], &[f64; 3], [f64; 2])) {
        for e in 0..self.elements {
            let nodes = [0, 1, 2].map(|i| self.at(2 * e + i, ends, inner));
            for (point, (shape, slope)) in POINTS.iter().zip(SHAPES.iter().zip(&DERIVATIVES)) {
                let dot = |f: &[f64; 3]| f[0] * nodes[0] + f[1] * nodes[1] + f[2] * nodes[2];
                see(2 * e, point.1, shape, slope, [dot(shape), dot(slope)]);
            }
        }
    }

    /// Resistance at these rises (Ω).
    pub(super) fn resistance(&self, ends: [f64; 2], inner: &[f64]) -> f64 {
        match self.curves {
            Some(_) => self.resistance * (1.0 + self.mean_laws(ends, inner)[1]),
            None => self.resistance * (1.0 + self.coefficient * self.mean(ends, inner)),
        }
    }

    /// Mean rise: Simpson's rule is exact for parabolas.
    pub(super) fn mean(&self, ends: [f64; 2], inner: &[f64]) -> f64 {
        let odd: f64 = inner.iter().step_by(2).sum();
        let even: f64 = inner.iter().skip(1).step_by(2).sum();
        (ends[0] + ends[1] + 4.0 * odd + 2.0 * even) / (6.0 * self.elements as f64)
    }

    /// Weight of the rise of node `j` in the mean (1).
    pub(super) fn weight(&self, j: usize) -> f64 {
        let count = self.elements as f64;
        match j {
            j if j % 2 == 1 => 4.0 / (6.0 * count),
            j if j == 0 || j == 2 * self.elements => 1.0 / (6.0 * count),
            _ => 2.0 / (6.0 * count),
        }
    }

    /// Highest and lowest rise: those of the parabolas, not of the nodes.
    pub(super) fn extremes(&self, ends: [f64; 2], inner: &[f64]) -> [f64; 2] {
        let mut found = [f64::NEG_INFINITY, f64::INFINITY];
        let mut see = |t: f64| found = [found[0].max(t), found[1].min(t)];
        for e in 0..self.elements {
            let [a, m, b] = [0, 1, 2].map(|i| self.at(2 * e + i, ends, inner));
            [a, m, b].into_iter().for_each(&mut see);
            // a + x·p + x²·q
            let (p, q) = (4.0 * m - 3.0 * a - b, 2.0 * (a - 2.0 * m + b));
            let x = -p / (2.0 * q);
            if x > 0.0 && x < 1.0 {
                see(a + 0.5 * x * p);
            }
        }
        found
    }

    /// Residuals at rises and a current; `rates` of all nodes where the capacity counts (K/s).
    pub(super) fn residual(
        &self,
        (ends, inner): Nodes<'_>,
        rates: Option<Nodes<'_>>,
        current: f64,
        out: &mut BeamResidual,
    ) {
        let count = self.elements as f64;
        out.heat.clear();
        out.heat.resize(inner.len() + 2, 0.0);
        let joule = current * current * self.resistance;
        self.points(ends, inner, |first, weight, shape, slope, [t, dt]| {
            let flow = self.conductance * self.conductivity(t)[0] * count * dt * weight;
            let source = (self.aside(t)[0] - joule * self.resistivity(t)[0]) * weight / count;
            for i in 0..3 {
                out.heat[first + i] += flow * slope[i] + source * shape[i];
            }
        });
        if let Some(rates) = rates {
            self.add_stored((ends, inner), rates, &mut out.heat);
        }
        out.resistance = self.resistance(ends, inner);
    }

    /// Heat that its capacity takes at each node at rises and rates (W, K/s).
    pub(super) fn stored(&self, at: Nodes<'_>, rates: Nodes<'_>, out: &mut Vec<f64>) {
        out.clear();
        out.resize(rates.1.len() + 2, 0.0);
        self.add_stored(at, rates, out);
    }

    fn add_stored(&self, at: Nodes<'_>, (ends, inner): Nodes<'_>, out: &mut [f64]) {
        self.points(ends, inner, |first, weight, shape, _, [rate, _]| {
            let capacity = self.capacity_at(first, at, shape);
            for i in 0..3 {
                out[first + i] += capacity * rate * shape[i] * weight / self.elements as f64;
            }
        });
    }

    /// Heat capacity at a point of the element that begins with node `first` (J/K).
    fn capacity_at(&self, first: usize, (ends, inner): Nodes<'_>, shape: &[f64; 3]) -> f64 {
        if !self.capacity_changes() {
            return self.capacity;
        }
        let rise: f64 = (0..3).map(|i| shape[i] * self.at(first + i, ends, inner)).sum();
        self.capacity * self.capacity_law(rise)[0]
    }

    /// Newton's equations at rises, their rates where they change, and a current; `sigma` is the slope of the rates with the rises (1/s). Reduced to the ends.
    pub(super) fn reduce<T: ComplexField<RealField = f64> + Copy>(
        &self,
        ((ends, inner), rates): (Nodes<'_>, Option<Nodes<'_>>),
        current: f64,
        sigma: T,
        out: &mut Reduced<T>,
    ) {
        let (n, zero) = (inner.len(), real::<T>(0.0));
        let count = self.elements as f64;
        out.rows.clear();
        out.rows.resize(n, [zero; 5]);
        for row in &mut out.ends {
            row.clear();
            row.resize(n + 2, zero);
        }
        out.by_current.clear();
        out.by_current.resize(n + 2, zero);
        out.by_rise.clear();
        if self.curves.is_some() {
            out.by_rise.resize(n + 2, zero);
        } else {
            out.by_rise
                .extend((0..n + 2).map(|j| real::<T>(current * self.resistance * self.coefficient * self.weight(j))));
        }
        out.inner.clear();
        out.inner.resize(n, [zero; 3]);
        let joule = current * current * self.resistance;
        let heat = 2.0 * current * self.resistance;
        self.points(ends, inner, |first, weight, shape, slope, [t, dt]| {
            let [kappa, falls] = self.conductivity(t);
            let stored = sigma * real(self.capacity_at(first, (ends, inner), shape) * weight / count);
            let warming = rates.filter(|_| self.capacity_changes()).map_or(0.0, |(ends, inner)| {
                let rate: f64 = (0..3).map(|i| shape[i] * self.at(first + i, ends, inner)).sum();
                self.capacity * self.capacity_law(t)[1] * rate
            });
            let [resistivity, grows] = self.resistivity(t);
            let sides = self.aside(t)[1] + warming - joule * grows;
            if self.curves.is_some() {
                for (by_rise, shape) in out.by_rise[first..].iter_mut().zip(shape) {
                    *by_rise += real::<T>(current * self.resistance * grows * shape * weight / count);
                }
            }
            for i in 0..3 {
                let node = first + i;
                out.by_current[node] -= real::<T>(heat * resistivity * shape[i] * weight / count);
                for j in 0..3 {
                    let held =
                        self.conductance * count * slope[i] * (kappa * slope[j] + falls * dt * shape[j]) * weight
                            + sides * shape[i] * shape[j] * weight / count;
                    let entry = real::<T>(held) + stored * real(shape[i] * shape[j]);
                    let other = first + j;
                    match node {
                        0 => out.ends[0][other] += entry,
                        node if node == n + 1 => out.ends[1][other] += entry,
                        node if other == 0 => out.inner[node - 1][0] -= entry,
                        node if other == n + 1 => out.inner[node - 1][1] -= entry,
                        node => out.rows[node - 1][2 + other - node] += entry,
                    }
                }
            }
        });
        for (row, by) in out.inner.iter_mut().zip(&out.by_current[1..=n]) {
            row[2] = -*by;
        }
        out.factor();
        for column in 0..3 {
            out.solve(|x| &mut x[column]);
        }
        out.condense(self.resistance(ends, inner));
    }
}

impl<T: ComplexField<RealField = f64> + Copy> Reduced<T> {
    /// Before [`HotBeam::reduce`].
    pub(super) fn empty() -> Self {
        let zero = real(0.0);
        Self {
            rows: Vec::new(),
            inner: Vec::new(),
            ends: [Vec::new(), Vec::new()],
            by_current: Vec::new(),
            by_rise: Vec::new(),
            outer: [[zero; 3]; 3],
            resistance: zero,
            negative: 0,
        }
    }

    /// Factors the matrix of the inner nodes, without exchanges of rows: negative pivots are instabilities.
    fn factor(&mut self) {
        self.negative = 0;
        for k in 0..self.rows.len() {
            let [_, _, pivot, right, far] = self.rows[k];
            self.negative += usize::from(pivot.real() < 0.0);
            if let Some(next) = self.rows.get_mut(k + 1) {
                let l = next[1] / pivot;
                next[1] = l;
                next[2] -= l * right;
                next[3] -= l * far;
            }
            if let Some(next) = self.rows.get_mut(k + 2) {
                let l = next[0] / pivot;
                next[0] = l;
                next[1] -= l * right;
                next[2] -= l * far;
            }
        }
    }

    fn solve(&mut self, of: impl Fn(&mut [T; 3]) -> &mut T) {
        let Self { rows, inner, .. } = self;
        let n = rows.len();
        for k in 0..n {
            let x = *of(&mut inner[k]);
            if k + 1 < n {
                *of(&mut inner[k + 1]) -= rows[k + 1][1] * x;
            }
            if k + 2 < n {
                *of(&mut inner[k + 2]) -= rows[k + 2][0] * x;
            }
        }
        for k in (0..n).rev() {
            let mut x = *of(&mut inner[k]);
            if k + 1 < n {
                x -= rows[k][3] * *of(&mut inner[k + 1]);
            }
            if k + 2 < n {
                x -= rows[k][4] * *of(&mut inner[k + 2]);
            }
            *of(&mut inner[k]) = x / rows[k][2];
        }
    }

    /// The inverse of the matrix of the inner nodes times a vector, in place.
    pub(super) fn solve_inner(&self, x: &mut [T]) {
        let (rows, n) = (&self.rows, self.rows.len());
        for k in 0..n {
            let value = x[k];
            if k + 1 < n {
                x[k + 1] -= rows[k + 1][1] * value;
            }
            if k + 2 < n {
                x[k + 2] -= rows[k + 2][0] * value;
            }
        }
        for k in (0..n).rev() {
            let mut value = x[k];
            if k + 1 < n {
                value -= rows[k][3] * x[k + 1];
            }
            if k + 2 < n {
                value -= rows[k][4] * x[k + 2];
            }
            x[k] = value / rows[k][2];
        }
    }

    /// I·∂R/∂T times changes of the inner nodes.
    fn voltage_of(&self, x: impl Iterator<Item = T>) -> T {
        self.by_rise[1..].iter().zip(x).fold(real(0.0), |sum, (p, x)| sum + *p * x)
    }

    /// Heat at an end by changes of the inner nodes.
    fn heat_of(&self, end: usize, x: impl Iterator<Item = T>) -> T {
        self.ends[end][1..].iter().zip(x).fold(real(0.0), |sum, (a, x)| sum + *a * x)
    }

    /// The three equations of the ends and the voltage.
    fn condense(&mut self, resistance: f64) {
        let n = self.rows.len();
        let column = |c: usize| self.inner.iter().map(move |x| x[c]);
        let last = [0, n + 1];
        self.resistance = real::<T>(resistance) + self.voltage_of(column(2));
        let mut outer = [[real(0.0); 3]; 3];
        // the current for a unit rise of each end, and for a volt
        for end in 0..2 {
            outer[2][end] = -(self.by_rise[last[end]] + self.voltage_of(column(end))) / self.resistance;
        }
        outer[2][2] = self.resistance.recip();
        for end in 0..2 {
            let by_current = self.by_current[last[end]] + self.heat_of(end, column(2));
            for other in 0..2 {
                outer[end][other] =
                    self.ends[end][last[other]] + self.heat_of(end, column(other)) + by_current * outer[2][other];
            }
            outer[end][2] = by_current * outer[2][2];
        }
        self.negative += usize::from(self.resistance.real() < 0.0);
        self.outer = outer;
    }

    /// The share of a residual in the three equations: heat of both ends, and the current (W, A). `inner` is the solution for the residual
    /// of the inner nodes, and `missing` the voltage that is missing.
    pub(super) fn residual_share(&self, inner: &[T], missing: T) -> [T; 3] {
        let n = self.rows.len();
        let last = [0, n + 1];
        let volts = self.voltage_of(inner.iter().copied());
        let current = (missing - volts) / self.resistance;
        let share = |end: usize| {
            let by_current = self.by_current[last[end]] + self.heat_of(end, self.inner.iter().map(|x| x[2]));
            self.heat_of(end, inner.iter().copied()) + by_current * current
        };
        [share(0), share(1), current]
    }

    /// The change of the current, and that of the inner nodes, which goes to `out`.
    pub(super) fn change(&self, of: &BeamChange<'_, T>, out: &mut [T]) -> T {
        let own = self.residual_share(of.inner, of.missing)[2];
        let outer = &self.outer[2];
        let current = own + outer[0] * of.ends[0] + outer[1] * of.ends[1] + outer[2] * of.volts;
        for ((out, given), unit) in out.iter_mut().zip(of.inner).zip(&self.inner) {
            *out = *given + unit[0] * of.ends[0] + unit[1] * of.ends[1] + unit[2] * current;
        }
        current
    }
}
