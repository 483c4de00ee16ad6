//! Rises over time while the source voltages go linearly from one value to another.
//!
//! The heat balance is integrated by a diagonally implicit Runge-Kutta method with error control; potentials follow at once, and so
//! do beams without a heat capacity. Between the ends of its steps the mean rises are cubics through values and rates.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential HotEquations II" (1996), §IV.6: SDIRK of order 4, L-stable, table 6.5.

use super::super::heat_curves::TableEnd;
use super::{Flows, Forcing, HotEquations, HotNetwork};

/// Diagonal of the tableau.
const GAMMA: f64 = 0.25;
/// Stages.
const STAGES: usize = 5;
/// Coefficients below the diagonal; the last row are the weights.
const A: [[f64; 4]; STAGES] = [
    [0.0; 4],
    [0.5, 0.0, 0.0, 0.0],
    [17.0 / 50.0, -1.0 / 25.0, 0.0, 0.0],
    [371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, 0.0],
    [25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0],
];
/// Times of the stages.
const TIMES: [f64; STAGES] = [0.25, 0.75, 0.55, 0.5, 1.0];
/// Weights less those of the embedded method of order 3.
const ERROR: [f64; STAGES] =
    [25.0 / 24.0 - 59.0 / 48.0, -49.0 / 48.0 + 17.0 / 96.0, 125.0 / 16.0 - 225.0 / 32.0, 0.0, 0.25];
/// Error of a step as a fraction of the highest rise (1), and absolute (K).
const TOLERANCE: [f64; 2] = [1e-5, 1e-9];
/// Shortest step as a fraction of the time (1).
const SHORTEST: f64 = 1e-10;
/// Time over which beams without a heat capacity follow a jump at the start, as a fraction of the time (1).
const JUMP: f64 = 1e-13;
/// Iterations for the slowest time constant, at most.
const MAX_ITERATIONS: usize = 500;
/// Change of a time constant in an iteration that counts as none (1).
const SAME_TIME: f64 = 1e-10;
/// Rise at which a course ends (K).
const UNBOUNDED: f64 = 1e6;

/// Rises over the time of a step or a run.
#[derive(Debug, Clone, Default)]
pub(crate) struct HotCourse {
    /// Ends of its steps (s).
    times: Vec<f64>,
    /// Step by step, value by value of [`HotNetwork::means`]: coefficients in the fraction of the step (K).
    means: Vec<[f64; 4]>,
    values: usize,
    /// State at its end, or where it failed (K).
    pub(crate) end: Vec<f64>,
    /// Time at which the rises leave all bounds (s).
    pub(crate) failed: Option<f64>,
    /// The beam and the table that does not cover its temperature then; none: they grow without bound.
    pub(crate) end_of_table: Option<(usize, TableEnd)>,
}

/// Source voltages that go linearly from one value to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SourceLine<'a> {
    /// At the start (V).
    pub(crate) from: &'a [f64],
    /// At the end (V).
    pub(crate) to: &'a [f64],
    /// Time between them (s).
    pub(crate) dt: f64,
}

impl HotCourse {
    /// The step at a time, with the fraction of it.
    fn place(&self, t: f64) -> Option<(usize, f64, f64)> {
        let last = self.times.len().checked_sub(1)?;
        let step = self.times.partition_point(|end| *end < t).min(last);
        let start = step.checked_sub(1).map_or(0.0, |k| self.times[k]);
        let h = self.times[step] - start;
        Some((step, ((t - start) / h).clamp(0.0, 1.0), h))
    }

    /// Value `k` of [`HotNetwork::means`] at time `t`, and its rate (K, K/s).
    pub(crate) fn mean(&self, k: usize, t: f64) -> [f64; 2] {
        let Some((step, x, h)) = self.place(t).filter(|_| k < self.values) else { return [0.0; 2] };
        let [a, b, c, d] = self.means[step * self.values + k];
        [a + x * (b + x * (c + x * d)), (b + x * (2.0 * c + 3.0 * x * d)) / h]
    }

    fn push(&mut self, t: f64, h: f64, before: &[[f64; 2]], after: &[[f64; 2]], begins: bool) {
        self.times.push(t);
        for ([a, da], [b, db]) in before.iter().zip(after) {
            // without a rate at the start: a parabola
            let (p, q) = (h * da, h * db);
            let rest = b - a;
            self.means.push(if begins {
                [*a, 2.0 * rest - q, q - rest, 0.0]
            } else {
                [*a, p, 3.0 * rest - 2.0 * p - q, p + q - 2.0 * rest]
            });
        }
    }
}

/// A state with its change with one source.
struct HotStage {
    state: Vec<f64>,
    change: Vec<f64>,
}

impl HotNetwork {
    /// The course of the rises from a state.
    pub(crate) fn course(&self, line: SourceLine<'_>, start: &[f64]) -> HotCourse {
        self.integrate(line, start, None).0
    }

    /// The same with the course of its change with the final value of source `source`, by the same steps.
    pub(crate) fn course_change(&self, line: SourceLine<'_>, start: &[f64], source: usize) -> HotCourse {
        self.integrate(line, start, Some(source)).1
    }

    fn integrate(&self, line: SourceLine<'_>, start: &[f64], source: Option<usize>) -> (HotCourse, HotCourse) {
        let values = self.values_of_a_beam() * self.bars.len();
        let mut found = [0, 1].map(|_| HotCourse { values, ..HotCourse::default() });
        let mut now = HotStage { state: start.to_vec(), change: vec![0.0; self.states] };
        let mut stepper = Stepper::new(self, line, source);
        if self.is_instant() {
            stepper.jump(&mut now);
        }
        let (mut t, mut h) = (0.0, line.dt);
        let mut before = [0, 1].map(|_| vec![[0.0; 2]; values]);
        let mut begins = true;
        while t < line.dt {
            let last = t + h >= line.dt * (1.0 - 1e-12);
            let length = if last { line.dt - t } else { h };
            let error = stepper.step(t, length, &now);
            if error > 1.0 || error.is_nan() {
                h = length * if error.is_finite() { (0.8 / error.powf(0.25)).clamp(0.1, 0.8) } else { 0.1 };
                if h < SHORTEST * line.dt {
                    found[0].failed = Some(t);
                    break;
                }
                continue;
            }
            let after = [
                self.both(&stepper.state, &stepper.rate),
                self.both_changes((&stepper.state, &stepper.rate), &stepper.change, &stepper.change_rate),
            ];
            if begins {
                let still = vec![0.0; self.states];
                before = [
                    self.both(&now.state, &now.state),
                    self.both_changes((&now.state, &still), &now.change, &now.change),
                ];
            }
            t = if last { line.dt } else { t + length };
            for ((course, before), after) in found.iter_mut().zip(&before).zip(&after) {
                course.push(t, length, before, after, begins);
            }
            before = after;
            begins = false;
            now.state.copy_from_slice(&stepper.state);
            now.change.copy_from_slice(&stepper.change);
            h = length * (0.9 / error.max(1e-8).powf(0.25)).clamp(0.2, 5.0);
            found[0].end_of_table = self.end_of_table(&now.state, 0.0);
            if found[0].end_of_table.is_some() || now.state.iter().any(|t| t.abs() > UNBOUNDED) {
                found[0].failed = Some(t);
                break;
            }
        }
        found[0].end = now.state;
        found[1].end = now.change;
        found.into()
    }

    /// Slowest time constant about a state at held source voltages (s), by inverse iteration; 0 without heat capacities.
    pub(crate) fn slowest(&self, u: &[f64], state: &[f64]) -> f64 {
        let flows = self.conduct(state, u);
        let mut equations = HotEquations::default();
        self.linearize((state, None), &flows.current, 0.0, &mut equations);
        let (mut x, mut moved, mut last) = (vec![1.0; self.states], Flows::default(), 0.0);
        for _ in 0..MAX_ITERATIONS {
            let mut forcing = self.forcing();
            let stored: Vec<f64> = x.iter().map(|x| -x).collect();
            self.take_stored(state, &stored, &mut forcing.heat);
            self.respond(&mut equations, &forcing, &mut x, &mut moved);
            let longest = x.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            if longest <= 0.0 || longest.is_nan() {
                return 0.0;
            }
            x.iter_mut().for_each(|x| *x /= longest);
            if (longest - last).abs() <= SAME_TIME * longest {
                return longest;
            }
            last = longest;
        }
        last
    }

    /// Means and their rates at a state.
    fn both(&self, state: &[f64], rates: &[f64]) -> Vec<[f64; 2]> {
        let count = self.values_of_a_beam() * self.bars.len();
        let (mut means, mut changes) = (vec![0.0; count], vec![0.0; count]);
        self.means(state, &mut means);
        self.mean_changes(state, rates, &mut changes);
        means.into_iter().zip(changes).map(|(mean, rate)| [mean, rate]).collect()
    }

    /// Changes of the means and of their rates at a state with its rates.
    fn both_changes(&self, (state, rates): (&[f64], &[f64]), changes: &[f64], change_rates: &[f64]) -> Vec<[f64; 2]> {
        let count = self.values_of_a_beam() * self.bars.len();
        let [mut means, mut slopes] = [changes, change_rates].map(|of| {
            let mut out = vec![0.0; count];
            self.mean_changes(state, of, &mut out);
            out
        });
        if count > self.bars.len() {
            // the slope of the strain moves with the state; nothing takes the rate of the resistance
            for (k, bar) in self.bars.iter().enumerate() {
                let at = (self.ends_of(k, state), self.inner_of(k, state));
                let both = [rates, changes].map(|of| (self.changes_of(k, of), self.inner_of(k, of)));
                slopes[self.bars.len() + k] += bar.strain_bend(at, both);
            }
        }
        means.drain(..).zip(slopes).map(|(mean, rate)| [mean, rate]).collect()
    }

    /// Subtracts the heat that capacities take at a state and these rates (K/s).
    fn take_stored(&self, state: &[f64], rates: &[f64], from: &mut [f64]) {
        let mut own = super::BeamResidual::default();
        for (k, bar) in self.bars.iter().enumerate() {
            let at = (self.ends_of(k, state), self.inner_of(k, state));
            bar.stored(at, (self.changes_of(k, rates), self.inner_of(k, rates)), &mut own.heat);
            self.take(k, &own.heat, from);
        }
    }
}

/// One step of the method.
struct Stepper<'a> {
    network: &'a HotNetwork,
    line: SourceLine<'a>,
    source: Option<usize>,
    u: Vec<f64>,
    equations: HotEquations<f64>,
    rates: Vec<Vec<f64>>,
    change_rates: Vec<Vec<f64>>,
    start: Vec<f64>,
    /// At the end of the step.
    state: Vec<f64>,
    rate: Vec<f64>,
    change: Vec<f64>,
    change_rate: Vec<f64>,
    direct: Forcing<f64>,
}

impl<'a> Stepper<'a> {
    fn new(network: &'a HotNetwork, line: SourceLine<'a>, source: Option<usize>) -> Self {
        let none = || vec![0.0; network.states];
        let mut unit = vec![0.0; line.from.len()];
        if let Some(source) = source {
            unit[source] = 1.0;
        }
        Self {
            network,
            line,
            source,
            u: line.from.to_vec(),
            equations: HotEquations::default(),
            rates: (0..STAGES).map(|_| none()).collect(),
            change_rates: (0..STAGES).map(|_| none()).collect(),
            start: none(),
            state: none(),
            rate: none(),
            change: none(),
            change_rate: none(),
            direct: network.forcing_of(&unit),
        }
    }

    fn sources_at(&mut self, t: f64) -> f64 {
        let x = t / self.line.dt;
        for ((u, from), to) in self.u.iter_mut().zip(self.line.from).zip(self.line.to) {
            *u = from + x * (to - from);
        }
        x
    }

    /// Takes beams without a heat capacity to the rise that the sources at the start lead to.
    fn jump(&mut self, now: &mut HotStage) {
        self.sources_at(0.0);
        self.start.copy_from_slice(&now.state);
        let mut flows = self.network.conduct(&now.state, &self.u);
        let sigma = 1.0 / (JUMP * self.line.dt);
        let start = self.start.clone();
        if !self.network.iterate((&mut now.state, &mut flows), Some((sigma, &start)), &self.u, &mut self.equations) {
            now.state.copy_from_slice(&start);
        }
    }

    /// A step from a state; the estimated error over the tolerance.
    fn step(&mut self, t: f64, h: f64, from: &HotStage) -> f64 {
        let sigma = 1.0 / (GAMMA * h);
        self.state.copy_from_slice(&from.state);
        for stage in 0..STAGES {
            let x = self.sources_at(t + TIMES[stage] * h);
            combine(&from.state, &self.rates, &A[stage][..stage.min(4)], h, &mut self.start);
            let mut flows = self.network.conduct(&self.state, &self.u);
            let start = std::mem::take(&mut self.start);
            let found = self.network.iterate(
                (&mut self.state, &mut flows),
                Some((sigma, &start)),
                &self.u,
                &mut self.equations,
            );
            for ((rate, t), start) in self.rates[stage].iter_mut().zip(&self.state).zip(&start) {
                *rate = sigma * (t - start);
            }
            self.start = start;
            if !found {
                return f64::INFINITY;
            }
            if self.source.is_some() {
                self.differentiate((stage, h, x), &flows, from);
            }
        }
        self.rate.copy_from_slice(&self.rates[STAGES - 1]);
        self.change_rate.copy_from_slice(&self.change_rates[STAGES - 1]);
        let highest = self.state.iter().fold(0.0f64, |most, t| most.max(t.abs()));
        let allowed = TOLERANCE[0] * highest + TOLERANCE[1];
        (0..self.network.states)
            .map(|i| h * (0..STAGES).map(|s| ERROR[s] * self.rates[s][i]).sum::<f64>().abs())
            .fold(0.0, f64::max)
            / allowed
    }

    /// The change of a stage with the source: its equations differentiated, which the last iteration has factored.
    fn differentiate(&mut self, (stage, h, x): (usize, f64, f64), flows: &Flows<f64>, from: &HotStage) {
        let sigma = 1.0 / (GAMMA * h);
        let network = self.network;
        network.linearize((&self.state, Some(&self.rates[stage])), &flows.current, sigma, &mut self.equations);
        combine(&from.change, &self.change_rates, &A[stage][..stage.min(4)], h, &mut self.start);
        let mut forcing = self.direct.clone();
        for value in forcing.heat.iter_mut().chain(&mut forcing.volts).chain(&mut forcing.current) {
            *value *= x;
        }
        // minus the heat that −σ·T* stores
        let stored: Vec<f64> = self.start.iter().map(|start| -sigma * start).collect();
        network.take_stored(&self.state, &stored, &mut forcing.heat);
        let mut change = Flows::default();
        network.respond(&mut self.equations, &forcing, &mut self.change, &mut change);
        for ((rate, t), start) in self.change_rates[stage].iter_mut().zip(&self.change).zip(&self.start) {
            *rate = sigma * (t - start);
        }
    }
}

/// `out = start + h·Σ a·rate`.
fn combine(start: &[f64], rates: &[Vec<f64>], a: &[f64], h: f64, out: &mut [f64]) {
    out.copy_from_slice(start);
    for (a, rates) in a.iter().zip(rates) {
        out.iter_mut().zip(rates).for_each(|(out, rate)| *out += h * a * rate);
    }
}
