//! Beams with properties that depend on their temperature: potentials and temperatures in one network.
//!
//! Each beam is a row of quadratic elements (`beam`). At given source voltages the rises of all nodes, the currents in the beams and the
//! potentials are the unknowns of one Newton iteration; beams are reduced to their ends, and the rest is a sparse system of the nodes.
//! ```text
//! heat into each node from its beams = 0      current out of each node = 0      V = I·R(T) along each beam
//! ```
//! A solution is accepted where the determinant has the sign that it has in the cold state, and no rise is below ambient: beyond a
//! thermal runaway the equations have solutions that no part reaches.
//!
//! In time the rises follow the heat balance with capacities (`course`); potentials follow at once.

mod beam;
mod course;
mod element;
mod elimination;
mod flows;
mod means;
#[cfg(test)]
mod tests;

pub(crate) use course::{HotCourse, SourceLine};

use super::conduction::HeatConductor;
use super::heat_curves::TableEnd;
use super::network::{ElectricalNetwork, KnownPotentials};
use beam::{BeamChange, BeamResidual, HotBeam, Reduced};
use bimorph_base::budget;
use bimorph_base::sets::Sets;
use bimorph_multibody::layout::EliminationLayout;
use elimination::NodeMatrix;
use nalgebra::ComplexField;
use std::sync::Arc;
use thiserror::Error;

/// Elements of a beam, at least: the mean and the highest rise are right to 2e-4 up to 0.9 of a runaway current.
const MIN_ELEMENTS: usize = 12;
/// Elements for each unit of √(G/K): 1e-5 of the rise.
const PER_DECAY: f64 = 2.3;
/// Rise up to which these elements resolve the layers of radiation (K).
const GLOWING: f64 = 1000.0;
/// Elements of a beam, at most.
const MAX_ELEMENTS: usize = 256;
/// Newton iterations from one point of a path to the next.
const MAX_ITERATIONS: usize = 30;
/// Change of the rises at which an iteration ends, as a fraction of the highest (1), and absolute (K).
const CONVERGED: [f64; 2] = [1e-12, 1e-13];
/// Smallest step on the way from cold, as a fraction of the heat (1).
const SMALLEST_STEP: f64 = 1e-5;
/// Decays of the heat within an element that its parabola resolves, where the resistance falls with temperature (1).
const RESOLVED: f64 = 1.0;
/// Distance from the end of a table at which the last state ends there, as a fraction of its range (1).
const NEAR_END: f64 = 1e-3;
/// Rise below ambient that rounding makes of none, as a fraction of the highest (1).
const BELOW_AMBIENT: f64 = 1e-6;

/// No stable steady state beyond a fraction of the heat: a thermal runaway, or a table of a property that ends.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("heater {heater} has no stable temperature beyond {share} of the heat")]
pub struct NoSteadyHeat {
    /// The hottest beam there.
    pub heater: usize,
    /// Fraction of the squares of the source voltages that has one (1).
    pub share: f64,
    /// Its highest rise there (K).
    pub rise: f64,
    /// The table that ends there; none: a thermal runaway.
    pub end: Option<TableEnd>,
}

/// Beams, resistors and sources.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HotNetwork {
    bars: Vec<HotBeam>,
    /// Nodes at both ends of each beam.
    ends: Vec<[usize; 2]>,
    /// Unknown of the rise of each node; none: ambient.
    rise: Vec<Option<usize>>,
    /// Rise of each node at a given temperature; 0 of all others (K).
    held: Vec<f64>,
    /// Lowest rise that heating from rest leads to: 0, or that of a colder anchor or substrate (K).
    lowest: f64,
    /// Number of those unknowns; the potentials follow.
    nodes: usize,
    /// Rises in a state: those of nodes, then the inner ones of each beam.
    states: usize,
    known: KnownPotentials,
    resistors: Vec<(usize, usize, f64)>,
    sources: usize,
    /// Heat among the inputs: its place in the source vector, and the beam.
    heated: Vec<(usize, usize)>,
    /// Whether any property has a curve over temperature.
    curved: bool,
    all: Arc<Unknowns>,
    electrical: Arc<Unknowns>,
}

/// The unknowns of a system, in the order of their elimination.
#[derive(Debug)]
struct Unknowns(Arc<EliminationLayout>);

impl PartialEq for Unknowns {
    fn eq(&self, other: &Self) -> bool {
        self.0.place == other.0.place && self.0.pattern == other.0.pattern
    }
}

/// Currents and potentials of a state.
#[derive(Debug, Clone, Default)]
pub(crate) struct Flows<T> {
    /// Current in each beam (A).
    pub(crate) current: Vec<T>,
    /// Unknown potentials (V).
    potential: Vec<T>,
}

/// Newton's equations about a state.
#[derive(Debug, Clone, Default)]
pub(crate) struct HotEquations<T> {
    bars: Vec<Reduced<T>>,
    matrix: NodeMatrix<T>,
    /// Solutions of the inner nodes for a right-hand side.
    inner: Vec<T>,
    rhs: Vec<T>,
    negative: usize,
}

/// A right-hand side: heat into each node (W), voltage along each beam (V), current into each unknown potential (A).
#[derive(Debug, Clone, Default)]
pub(crate) struct Forcing<T> {
    heat: Vec<T>,
    volts: Vec<T>,
    current: Vec<T>,
}

fn real<T: ComplexField<RealField = f64> + Copy>(x: f64) -> T {
    T::from_real(x)
}

/// The imaginary unit; 0 of real numbers, which have no such part.
fn unit_imaginary<T: ComplexField<RealField = f64> + Copy>() -> T {
    T::from_real(-1.0).try_sqrt().unwrap_or(T::from_real(0.0))
}

impl HotNetwork {
    /// Of heaters, which are the last resistors of the circuit. `None` where nothing depends on temperature.
    pub(crate) fn new(
        heaters: &[HeatConductor],
        circuit: &ElectricalNetwork,
        (sink, held): (&[bool], &[f64]),
    ) -> Option<Self> {
        if !heaters.iter().any(HeatConductor::depends_on_temperature) && held.iter().all(|rise| *rise == 0.0) {
            return None;
        }
        let mut given = vec![0.0; circuit.nodes];
        given.iter_mut().zip(held).zip(sink).filter(|(_, sink)| **sink).for_each(|((to, rise), _)| *to = *rise);
        let lowest = given.iter().copied().chain(heaters.iter().map(|h| h.substrate)).fold(0.0, f64::min);
        let mut rise = vec![None; circuit.nodes];
        let mut nodes = 0;
        for node in heaters.iter().flat_map(|h| [h.a, h.b]) {
            if !sink[node] && rise[node].is_none() {
                rise[node] = Some(nodes);
                nodes += 1;
            }
        }
        let mut states = nodes;
        let bar = |h: &HeatConductor| {
            let gas = h.gas * h.curves.as_ref().map_or(1.0, |curves| curves.largest_gas(GLOWING));
            let sides = gas + 4.0 * h.radiation * (h.ambient + GLOWING).powi(3);
            let fine = (PER_DECAY * (sides / h.conductance).sqrt()).ceil() as usize;
            let bar = HotBeam {
                conductance: h.conductance,
                gas: h.gas,
                resistance: h.resistance,
                coefficient: h.coefficient,
                thermal_coefficient: h.thermal_coefficient,
                capacity: h.stored(),
                capacity_coefficient: h.capacity_coefficient,
                radiation: h.radiation,
                ambient: h.ambient,
                substrate: h.substrate,
                expansion: h.expansion,
                curves: h.curves.clone(),
                elements: fine.clamp(MIN_ELEMENTS, MAX_ELEMENTS),
                first: states,
            };
            states += bar.inner();
            bar
        };
        let bars: Vec<HotBeam> = heaters.iter().map(bar).collect();
        let mut part = Sets::new(circuit.nodes + 1);
        for &node in &circuit.grounds {
            part.join(node, circuit.nodes);
        }
        for &(plus, minus) in &circuit.sources {
            part.join(plus, minus.unwrap_or(circuit.nodes));
        }
        for &(a, b, _) in &circuit.resistors {
            part.join(a, b);
        }
        let known = KnownPotentials::new((circuit.nodes, &circuit.grounds), &circuit.sources, &mut part, circuit.nodes);
        let resistors = circuit.resistors[..circuit.resistors.len() - heaters.len()].to_vec();
        budget::lay_out_matrix(states, 16);
        let edge = |a: Option<usize>, b: Option<usize>| a.zip(b).filter(|(a, b)| a != b);
        let wires = circuit.resistors.iter().filter_map(|r| edge(known.row[r.0], known.row[r.1]));
        let electrical = EliminationLayout::of_elimination(known.free, wires.clone().collect(), Vec::new());
        let mut edges: Vec<(usize, usize)> = wires.map(|(a, b)| (nodes + a, nodes + b)).collect();
        for h in heaters {
            let potential = |node: usize| known.row[node].map(|row| nodes + row);
            let all = [rise[h.a], rise[h.b], potential(h.a), potential(h.b)];
            for (k, a) in all.iter().enumerate() {
                edges.extend(all[..k].iter().filter_map(|b| edge(*a, *b)));
            }
        }
        let all = EliminationLayout::of_elimination(nodes + known.free, edges, Vec::new());
        Some(Self {
            ends: heaters.iter().map(|h| [h.a, h.b]).collect(),
            bars,
            rise,
            held: given,
            lowest,
            nodes,
            states,
            known,
            resistors,
            sources: circuit.sources.len(),
            heated: Vec::new(),
            curved: heaters.iter().any(|h| h.curves.is_some()),
            all: Arc::new(Unknowns(all)),
            electrical: Arc::new(Unknowns(electrical)),
        })
    }

    /// The same with heat among the inputs: places in the source vector and beams.
    pub(crate) fn heated(&self, heated: Vec<(usize, usize)>) -> Self {
        Self { heated, ..self.clone() }
    }

    /// Number of rises in a state.
    pub(crate) fn states(&self) -> usize {
        self.states
    }

    /// Whether any beam follows its heat at once.
    fn is_instant(&self) -> bool {
        self.bars.iter().any(|bar| bar.capacity == 0.0)
    }

    /// Whether a steady state without any source is not at ambient everywhere.
    pub(crate) fn is_held_off_ambient(&self) -> bool {
        self.held.iter().any(|rise| *rise != 0.0) || self.bars.iter().any(|bar| bar.substrate != 0.0)
    }

    /// Changes of the rises at both ends of beam `k`.
    fn changes_of<T: ComplexField<RealField = f64> + Copy>(&self, k: usize, change: &[T]) -> [T; 2] {
        self.ends[k].map(|node| self.rise[node].map_or(real(0.0), |row| change[row]))
    }

    /// Rises at both ends of beam `k` (K).
    fn ends_of(&self, k: usize, state: &[f64]) -> [f64; 2] {
        self.ends[k].map(|node| self.rise[node].map_or(self.held[node], |row| state[row]))
    }

    fn inner_of<'a, T>(&self, k: usize, state: &'a [T]) -> &'a [T] {
        let bar = &self.bars[k];
        &state[bar.first..bar.first + bar.inner()]
    }

    /// Highest rise along beam `k` (K).
    pub(crate) fn peak(&self, k: usize, state: &[f64]) -> f64 {
        self.bars[k].extremes(self.ends_of(k, state), self.inner_of(k, state))[0]
    }

    /// The voltage that sources alone put between two nodes.
    fn offset(&self, [a, b]: [usize; 2], u: &[f64]) -> f64 {
        let of = |node| self.known.offset(node).map(|(s, sign)| sign * u[s]).sum::<f64>();
        of(a) - of(b)
    }

    fn unknown<T: ComplexField<RealField = f64> + Copy>(&self, [a, b]: [usize; 2], potential: &[T]) -> T {
        let of = |node: usize| self.known.row[node].map_or(real(0.0), |row| potential[row]);
        of(a) - of(b)
    }

    /// Newton's equations about rises, their `rates` where they change, and currents; `sigma` is the slope of the rates with the rises (1/s).
    pub(crate) fn linearize<T: ComplexField<RealField = f64> + Copy>(
        &self,
        (state, rates): (&[f64], Option<&[f64]>),
        currents: &[f64],
        sigma: T,
        to: &mut HotEquations<T>,
    ) {
        let layout = &*self.all.0;
        to.bars.resize_with(self.bars.len(), Reduced::empty);
        to.matrix.clear(layout);
        to.negative = 0;
        for (k, bar) in self.bars.iter().enumerate() {
            budget::check();
            let rates = rates.map(|rates| (self.changes_of(k, rates), self.inner_of(k, rates)));
            let at = ((self.ends_of(k, state), self.inner_of(k, state)), rates);
            bar.reduce(at, currents[k], sigma, &mut to.bars[k]);
            let reduced = &to.bars[k];
            to.negative += reduced.negative;
            let [a, b] = self.ends[k];
            let potential = |node: usize| self.known.row[node].map(|row| self.nodes + row);
            let outer =
                [(self.rise[a], 0, 1.0), (self.rise[b], 1, 1.0), (potential(a), 2, 1.0), (potential(b), 2, -1.0)];
            for (row, i, by) in outer {
                for (column, j, sign) in outer {
                    if let (Some(row), Some(column)) = (row, column) {
                        to.matrix.add(layout, (row, column), reduced.outer[i][j] * real(by * sign));
                    }
                }
            }
        }
        for &(a, b, r) in &self.resistors {
            for (near, far) in [(a, b), (b, a)] {
                let Some(row) = self.known.row[near] else { continue };
                to.matrix.add(layout, (self.nodes + row, self.nodes + row), real(1.0 / r));
                if let Some(column) = self.known.row[far] {
                    to.matrix.add(layout, (self.nodes + row, self.nodes + column), real(-1.0 / r));
                }
            }
        }
        to.negative += to.matrix.factor(layout);
    }

    /// A forcing of the right size, zero.
    pub(crate) fn forcing<T: ComplexField<RealField = f64> + Copy>(&self) -> Forcing<T> {
        let none = |count: usize| vec![real(0.0); count];
        Forcing { heat: none(self.states), volts: none(self.bars.len()), current: none(self.known.free) }
    }

    /// The forcing of a change `du` of the source vector.
    pub(crate) fn forcing_of<T: ComplexField<RealField = f64> + Copy>(&self, du: &[f64]) -> Forcing<T> {
        let mut forcing = self.forcing();
        for (volts, ends) in forcing.volts.iter_mut().zip(&self.ends) {
            *volts = real(self.offset(*ends, du));
        }
        for &(a, b, r) in &self.resistors {
            let given = self.offset([a, b], du) / r;
            for (node, sign) in [(a, 1.0), (b, -1.0)] {
                if let Some(row) = self.known.row[node] {
                    forcing.current[row] -= real::<T>(sign * given);
                }
            }
        }
        for &(source, k) in &self.heated {
            self.spread(k, du[source], &mut forcing.heat);
        }
        forcing
    }

    /// Adds heat evenly along a beam (W).
    fn spread<T: ComplexField<RealField = f64> + Copy>(&self, k: usize, watts: f64, heat: &mut [T]) {
        let bar = &self.bars[k];
        for (node, j) in self.ends[k].iter().zip([0, bar.inner() + 1]) {
            if let Some(row) = self.rise[*node] {
                heat[row] += real::<T>(watts * bar.weight(j));
            }
        }
        for j in 1..=bar.inner() {
            heat[bar.first + j - 1] += real::<T>(watts * bar.weight(j));
        }
    }

    /// The change of rises and flows for a forcing.
    pub(crate) fn respond<T: ComplexField<RealField = f64> + Copy>(
        &self,
        equations: &mut HotEquations<T>,
        forcing: &Forcing<T>,
        state: &mut [T],
        flows: &mut Flows<T>,
    ) {
        let HotEquations { bars, matrix, inner, rhs, .. } = equations;
        inner.clear();
        inner.extend_from_slice(&forcing.heat);
        rhs.clear();
        rhs.extend_from_slice(&forcing.heat[..self.nodes]);
        rhs.extend_from_slice(&forcing.current);
        for (k, (bar, reduced)) in self.bars.iter().zip(&*bars).enumerate() {
            let own = &mut inner[bar.first..bar.first + bar.inner()];
            reduced.solve_inner(own);
            let [heat_a, heat_b, current] = reduced.residual_share(own, forcing.volts[k]);
            let [a, b] = self.ends[k];
            for (row, less) in [
                (self.rise[a], heat_a),
                (self.rise[b], heat_b),
                (self.known.row[a].map(|row| self.nodes + row), current),
                (self.known.row[b].map(|row| self.nodes + row), -current),
            ] {
                if let Some(row) = row {
                    rhs[row] -= less;
                }
            }
        }
        matrix.solve(&self.all.0, rhs);
        state[..self.nodes].copy_from_slice(&rhs[..self.nodes]);
        flows.potential.clear();
        flows.potential.extend_from_slice(&rhs[self.nodes..]);
        flows.current.clear();
        for (k, (bar, reduced)) in self.bars.iter().zip(&*bars).enumerate() {
            let range = bar.first..bar.first + bar.inner();
            let change = BeamChange {
                ends: self.changes_of(k, state),
                volts: self.unknown(self.ends[k], &flows.potential),
                inner: &inner[range.clone()],
                missing: forcing.volts[k],
            };
            let current = reduced.change(&change, &mut state[range]);
            flows.current.push(current);
        }
    }

    /// Changes of mean rises and of a state for a unit of the sources along `unit` that goes as e^(st).
    pub(crate) fn respond_about<T: ComplexField<RealField = f64> + Copy>(
        &self,
        (u, state): (&[f64], &[f64]),
        unit: &[f64],
        s: T,
        means: &mut [T],
        change: &mut [T],
    ) {
        let flows = self.conduct(state, u);
        let mut equations = HotEquations {
            bars: Vec::new(),
            matrix: NodeMatrix::empty(),
            inner: Vec::new(),
            rhs: Vec::new(),
            negative: 0,
        };
        self.linearize((state, None), &flows.current, s, &mut equations);
        let mut moved = Flows { current: Vec::new(), potential: Vec::new() };
        self.respond(&mut equations, &self.forcing_of(unit), change, &mut moved);
        self.mean_changes(state, change, means);
    }

    /// Minus the residuals of a state, as a forcing; `rates` of the rises where capacities count (K/s).
    fn residual(&self, (state, flows): (&[f64], &Flows<f64>), rates: Option<&[f64]>, u: &[f64], to: &mut Forcing<f64>) {
        let mut own = BeamResidual::default();
        to.heat.fill(0.0);
        to.current.fill(0.0);
        for &(source, k) in &self.heated {
            self.spread(k, u[source], &mut to.heat);
        }
        for (k, bar) in self.bars.iter().enumerate() {
            let at = (self.ends_of(k, state), self.inner_of(k, state));
            let rates = rates.map(|rates| (self.changes_of(k, rates), self.inner_of(k, rates)));
            let current = flows.current[k];
            bar.residual(at, rates, current, &mut own);
            self.take(k, &own.heat, &mut to.heat);
            let volts = self.offset(self.ends[k], u) + self.unknown(self.ends[k], &flows.potential);
            to.volts[k] = volts - current * own.resistance;
            for (node, sign) in self.ends[k].iter().zip([1.0, -1.0]) {
                if let Some(row) = self.known.row[*node] {
                    to.current[row] -= sign * current;
                }
            }
        }
        for &(a, b, r) in &self.resistors {
            let current = (self.offset([a, b], u) + self.unknown([a, b], &flows.potential)) / r;
            for (node, sign) in [(a, 1.0), (b, -1.0)] {
                if let Some(row) = self.known.row[node] {
                    to.current[row] -= sign * current;
                }
            }
        }
    }

    /// Subtracts the heat at each node of a beam.
    fn take(&self, k: usize, heat: &[f64], from: &mut [f64]) {
        let bar = &self.bars[k];
        for (node, heat) in self.ends[k].iter().zip([heat[0], heat[heat.len() - 1]]) {
            if let Some(row) = self.rise[*node] {
                from[row] -= heat;
            }
        }
        for (to, heat) in from[bar.first..].iter_mut().zip(&heat[1..heat.len() - 1]) {
            *to -= heat;
        }
    }

    /// Newton's iteration from a state; with `rates` (σ, T*) the rates are σ·(T − T*). False where it does not converge.
    fn iterate(
        &self,
        (state, flows): (&mut [f64], &mut Flows<f64>),
        rates: Option<(f64, &[f64])>,
        u: &[f64],
        equations: &mut HotEquations<f64>,
    ) -> bool {
        let mut forcing = self.forcing();
        let (mut change, mut flow, mut rate) = (vec![0.0; self.states], Flows::default(), vec![0.0; self.states]);
        for _ in 0..MAX_ITERATIONS {
            budget::check();
            let sigma = rates.map_or(0.0, |(sigma, _)| sigma);
            if let Some((sigma, start)) = rates {
                rate.iter_mut().zip(&*state).zip(start).for_each(|((rate, t), start)| *rate = sigma * (t - start));
            }
            self.residual((state, flows), rates.map(|_| &*rate), u, &mut forcing);
            self.linearize((state, rates.map(|_| &*rate)), &flows.current, sigma, equations);
            self.respond(equations, &forcing, &mut change, &mut flow);
            let (mut most, mut highest) = (0.0f64, 0.0f64);
            for (t, change) in state.iter_mut().zip(&change) {
                *t += change;
                (most, highest) = (most.max(change.abs()), highest.max(t.abs()));
            }
            flows.current.iter_mut().zip(&flow.current).for_each(|(i, change)| *i += change);
            flows.potential.iter_mut().zip(&flow.potential).for_each(|(v, change)| *v += change);
            if !highest.is_finite() || !most.is_finite() {
                return false;
            }
            if most <= CONVERGED[0] * highest + CONVERGED[1] {
                return true;
            }
        }
        false
    }

    /// Whether a steady state is one that heating from cold leads to.
    fn is_reached(&self, state: &[f64], flows: &Flows<f64>, equations: &HotEquations<f64>) -> bool {
        // where its resistance vanishes, all heat of a beam is in layers at its ends that no mesh resolves
        let resolved = self.bars.iter().enumerate().zip(&flows.current).all(|((k, bar), current)| {
            let falls = || {
                let extremes = bar.extremes(self.ends_of(k, state), self.inner_of(k, state));
                extremes.map(|t| bar.resistivity(t)[1]).into_iter().fold(0.0, f64::min)
            };
            let coefficient = if bar.curves.is_some() { falls() } else { bar.coefficient };
            let decays = -coefficient * bar.resistance * current * current / bar.conductance;
            decays.max(0.0).sqrt() <= RESOLVED * bar.elements as f64
        });
        let highest = state.iter().fold(0.0f64, |most, t| most.max(t.abs()));
        resolved
            && equations.negative.is_multiple_of(2)
            && state.iter().all(|t| *t >= self.lowest - BELOW_AMBIENT * highest)
            && self.without_resistance(state).is_none()
            && self.end_of_table(state, 0.0).is_none()
    }

    /// A beam that a table does not cover at a state, and the table.
    pub(crate) fn end_of_table(&self, state: &[f64], near: f64) -> Option<(usize, TableEnd)> {
        self.bars.iter().enumerate().find_map(|(k, bar)| {
            let rises = bar.extremes(self.ends_of(k, state), self.inner_of(k, state));
            Some((k, bar.curves.as_ref()?.end_of_table(rises, near)?))
        })
    }

    /// A beam whose resistivity, thermal conductivity, heat capacity or gas has no positive law somewhere, with the rise there (K).
    fn without_resistance(&self, state: &[f64]) -> Option<(usize, f64)> {
        self.bars.iter().enumerate().find_map(|(k, bar)| {
            let extremes = bar.extremes(self.ends_of(k, state), self.inner_of(k, state));
            let laws = |t: f64| [bar.resistivity(t)[0], bar.conductivity(t)[0], bar.capacity_law(t)[0], bar.gas_law(t)];
            let positive = |t: f64| laws(t).iter().all(|law| *law > 0.0 && law.is_finite());
            let lost = |t: &f64| !positive(*t);
            let found = extremes.into_iter().find(lost)?;
            Some((k, found))
        })
    }

    /// The steady state at source voltages `u`, heated from cold.
    ///
    /// # Errors
    /// [`NoSteadyHeat`].
    pub(crate) fn steady(&self, u: &[f64], state: &mut [f64]) -> Result<Flows<f64>, NoSteadyHeat> {
        let mut equations = HotEquations::default();
        let (mut reached, mut step) = (0.0, 1.0);
        let mut here = vec![0.0; self.states];
        loop {
            let share: f64 = f64::min(reached + step, 1.0);
            let mut scaled: Vec<f64> = u.iter().map(|u| u * share.sqrt()).collect();
            for &(source, _) in &self.heated {
                scaled[source] = u[source] * share;
            }
            state.copy_from_slice(&here);
            let mut flows = self.conduct(state, &scaled);
            let converged = self.iterate((state, &mut flows), None, &scaled, &mut equations);
            if converged && self.is_reached(state, &flows, &equations) {
                if share == 1.0 {
                    return Ok(flows);
                }
                here.copy_from_slice(state);
                (reached, step) = (share, 2.0 * step);
            } else {
                step *= 0.5;
                if step < SMALLEST_STEP {
                    return Err(self.failure(&here, reached));
                }
            }
        }
    }

    /// Why there is no steady state beyond the last one.
    fn failure(&self, state: &[f64], share: f64) -> NoSteadyHeat {
        if let Some((heater, end)) = self.end_of_table(state, NEAR_END) {
            return NoSteadyHeat { heater, share, rise: self.peak(heater, state), end: Some(end) };
        }
        let peaks = (0..self.bars.len()).map(|k| self.peak(k, state));
        let (heater, rise) = peaks.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
        NoSteadyHeat { heater, share, rise, end: None }
    }
}
