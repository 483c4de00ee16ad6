//! From source voltages to what a mechanism feels: the voltage of each gap and the free strain of each heated beam, and with
//! them the inputs that are no voltages.

use super::inputs::Input;
use super::thermal::{Heating, Lag, lagged};
use crate::multibody::forces::RestStrain;
use crate::multibody::planar::Pose;
use nalgebra::DMatrix;

/// What a mechanism feels at one instant, or the change of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drive {
    /// Voltage of each gap [V].
    pub volts: Vec<f64>,
    /// Free strain α·T̄ of each heated beam [1].
    pub expansion: Vec<f64>,
    /// Share of the dead loads and built-in strains that acts [1].
    pub load: f64,
    /// Value of each input in its own unit, in the order of [`Electrics::inputs`].
    pub inputs: Vec<f64>,
    /// Rate of change of the frame's rate [rad/s²].
    pub turning: f64,
    /// Force and moment on each body, as thermal agitation gives them; empty: none.
    pub push: Vec<Pose>,
}

impl Drive {
    /// The part that sets rest offsets.
    pub fn rest(&self) -> RestStrain<'_> {
        RestStrain { expansion: &self.expansion, built_in: self.load }
    }

    /// Leaves of a change what acts in proportion to the drive that it changes: voltages, and the rate of the frame.
    pub fn keep_quadratic(&mut self, electrics: &Electrics) {
        self.expansion.fill(0.0);
        self.push.clear();
        (self.load, self.turning) = (0.0, 0.0);
        for (value, input) in self.inputs.iter_mut().zip(&electrics.inputs) {
            if *input != Input::Rate {
                *value = 0.0;
            }
        }
    }
}

/// The electrical side of a system. The source vector u holds the ports first, then the netlist's own sources, then the inputs
/// that are no voltages.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Electrics {
    /// Number of ports.
    pub ports: usize,
    /// Voltages of the netlist's own sources [V].
    pub fixed: Vec<f64>,
    /// Names of all sources, ports first.
    pub names: Vec<String>,
    /// ∂gap voltage/∂u, gaps × sources.
    pub gap_rows: DMatrix<f64>,
    /// ∂port current/∂u, ports × sources [S].
    pub conductance: DMatrix<f64>,
    /// Heated beams.
    pub heating: Heating,
    /// What is given beside voltages.
    pub inputs: Vec<Input>,
}

impl Electrics {
    /// Length of the source vector.
    pub fn sources(&self) -> usize {
        self.voltages() + self.inputs.len()
    }

    /// Voltages in the source vector: the place of the first input.
    pub fn voltages(&self) -> usize {
        self.ports + self.fixed.len()
    }

    /// The same with these inputs.
    pub fn with_inputs(&self, inputs: Vec<Input>) -> Self {
        let sources = self.voltages() + inputs.len();
        let (gaps, ports) = (self.gap_rows.nrows(), self.conductance.nrows());
        crate::budget::lay_out_matrix(gaps + ports + self.heating.heaters.len(), sources);
        Self {
            gap_rows: self.gap_rows.clone().resize(gaps, sources, 0.0),
            conductance: self.conductance.clone().resize(ports, sources, 0.0),
            heating: self.heating.with_heat(&inputs),
            inputs,
            ..self.clone()
        }
    }

    /// A drive of the right size, all zero, loads acting fully.
    pub fn drive(&self) -> Drive {
        Drive {
            volts: vec![0.0; self.gap_rows.nrows()],
            expansion: vec![0.0; self.heating.heaters.len()],
            load: 1.0,
            inputs: vec![0.0; self.inputs.len()],
            turning: 0.0,
            push: Vec::new(),
        }
    }

    /// Fills in the source vector for given port voltages.
    pub fn fill_sources(&self, ports: &[f64], u: &mut [f64]) {
        u[..self.ports].copy_from_slice(ports);
        u[self.ports..self.voltages()].copy_from_slice(&self.fixed);
        u[self.voltages()..].fill(0.0);
    }

    /// The drive at source voltages `u` when every heater is at its steady rise, which goes to `rise` [K].
    pub fn steady(&self, u: &[f64], rise: &mut [f64], drive: &mut Drive) {
        for (k, rise) in rise.iter_mut().enumerate() {
            *rise = self.heating.steady(k, u);
        }
        self.apply(u, rise, drive);
    }

    /// The drive at source voltages `u` and temperature rises `rise` [K].
    pub fn apply(&self, u: &[f64], rise: &[f64], drive: &mut Drive) {
        self.gap_volts(u, &mut drive.volts);
        for (k, heater) in self.heating.heaters.iter().enumerate() {
            drive.expansion[k] = heater.expansion * rise[k];
        }
        drive.inputs.copy_from_slice(&u[self.voltages()..]);
        drive.turning = 0.0;
        drive.push.clear();
    }

    /// The change of the steady drive with source `s`, at source voltages `u`.
    pub fn steady_slope(&self, u: &[f64], unit: &[f64], slope: &mut Drive) {
        self.gap_volts(unit, &mut slope.volts);
        for (k, heater) in self.heating.heaters.iter().enumerate() {
            slope.expansion[k] = heater.expansion * self.heating.slope(k, u, unit);
        }
        slope.inputs.copy_from_slice(&unit[self.voltages()..]);
        (slope.load, slope.turning) = (0.0, 0.0);
    }

    #[inline]
    fn gap_volts(&self, u: &[f64], volts: &mut [f64]) {
        for (g, v) in volts.iter_mut().enumerate() {
            *v = (0..u.len()).map(|s| self.gap_rows[(g, s)] * u[s]).sum();
        }
    }
}

/// Source voltages that go linearly from one value to another during a step, with the rises that follow them.
#[derive(Debug, Clone, Copy)]
pub struct Ramp<'a> {
    /// The electrical side.
    pub electrics: &'a Electrics,
    /// Source voltages at the start [V].
    pub from: &'a [f64],
    /// Source voltages at the end [V].
    pub to: &'a [f64],
    /// Rise of each heater at the start [K].
    pub rise: &'a [f64],
    /// Length of the step [s].
    pub dt: f64,
    /// Force and moment on each body throughout the step; empty: none.
    pub push: &'a [Pose],
}

impl Ramp<'_> {
    /// Coefficients of the steady rise of heater `k` in the time since the start.
    fn parabola(&self, k: usize) -> [f64; 3] {
        let [a, b, c] = self.electrics.heating.between(k, self.from, self.to);
        [a, b / self.dt, c / (self.dt * self.dt)]
    }

    /// Rise of heater `k` at time `s` after the start [K].
    pub fn rise_at(&self, k: usize, s: f64) -> f64 {
        self.rise_after(k, s, self.parabola(k), &mut None)
    }

    /// The same with what is known of it: the parabola, and the exponentials of the heater before.
    #[inline]
    fn rise_after(&self, k: usize, s: f64, p: [f64; 3], lag: &mut Option<Lag>) -> f64 {
        let tau = self.electrics.heating.heaters[k].time_constant;
        if tau <= 0.0 {
            return p[0] + s * (p[1] + s * p[2]);
        }
        match lag {
            Some(lag) if lag.is_of(tau) => lag.rise(self.rise[k], p),
            other => other.insert(Lag::new(tau, s)).rise(self.rise[k], p),
        }
    }

    /// The drive at time `s` after the start.
    pub fn at(&self, s: f64, drive: &mut Drive) {
        let x = s / self.dt;
        for (g, v) in drive.volts.iter_mut().enumerate() {
            *v = self.gap(g, |i| self.from[i] + x * (self.to[i] - self.from[i]));
        }
        let mut lag = None;
        for k in 0..drive.expansion.len() {
            let rise = self.rise_after(k, s, self.parabola(k), &mut lag);
            drive.expansion[k] = self.electrics.heating.heaters[k].expansion * rise;
        }
        drive.push.clear();
        drive.push.extend_from_slice(self.push);
        let first = self.electrics.voltages();
        drive.turning = 0.0;
        for (k, value) in drive.inputs.iter_mut().enumerate() {
            let change = self.to[first + k] - self.from[first + k];
            *value = self.from[first + k] + x * change;
            if self.electrics.inputs[k] == Input::Rate {
                drive.turning += change / self.dt;
            }
        }
    }

    /// The drive's rate of change in time at `s` [1/s].
    pub fn rate(&self, s: f64, rate: &mut Drive) {
        for (g, v) in rate.volts.iter_mut().enumerate() {
            *v = self.gap(g, |i| (self.to[i] - self.from[i]) / self.dt);
        }
        let mut lag = None;
        for k in 0..rate.expansion.len() {
            rate.expansion[k] = self.expansion_rate(k, s, self.parabola(k), &mut lag);
        }
        let first = self.electrics.voltages();
        for (k, value) in rate.inputs.iter_mut().enumerate() {
            *value = (self.to[first + k] - self.from[first + k]) / self.dt;
        }
        (rate.load, rate.turning) = (0.0, 0.0);
        rate.push.clear();
    }

    /// Rate of the free strain of heater `k` at time `s` [1/s].
    #[inline]
    fn expansion_rate(&self, k: usize, s: f64, p: [f64; 3], lag: &mut Option<Lag>) -> f64 {
        let heater = &self.electrics.heating.heaters[k];
        let slope = if heater.time_constant > 0.0 {
            (p[0] + s * (p[1] + s * p[2]) - self.rise_after(k, s, p, lag)) / heater.time_constant
        } else {
            p[1] + 2.0 * s * p[2]
        };
        heater.expansion * slope
    }

    /// The change of the drive at time `s` with the final voltage of source `port`.
    pub fn sensitivity(&self, s: f64, port: usize, out: &mut Drive) {
        let x = s / self.dt;
        for (g, v) in out.volts.iter_mut().enumerate() {
            *v = self.electrics.gap_rows[(g, port)] * x;
        }
        for k in 0..out.expansion.len() {
            let heater = &self.electrics.heating.heaters[k];
            out.expansion[k] = heater.expansion * self.rise_sensitivity(k, s, port);
        }
        out.load = 0.0;
        out.push.clear();
        out.turning = if self.set_input(port, x, out) == Some(Input::Rate) { 1.0 / self.dt } else { 0.0 };
    }

    /// Sets the input that source `port` is, if it is one, and all others to 0.
    fn set_input(&self, port: usize, value: f64, out: &mut Drive) -> Option<Input> {
        out.inputs.fill(0.0);
        let k = port.checked_sub(self.electrics.voltages())?;
        out.inputs[k] = value;
        Some(self.electrics.inputs[k])
    }

    /// The change of the rise of heater `k` at time `s` with the final voltage of source `port` [K/V].
    pub fn rise_sensitivity(&self, k: usize, s: f64, port: usize) -> f64 {
        let tau = self.electrics.heating.heaters[k].time_constant;
        let [p1, p2] = self.parabola_change(k, port);
        if tau > 0.0 { lagged(0.0, tau, s, [0.0, p1, p2]) } else { s * (p1 + s * p2) }
    }

    /// The change of [`Ramp::rate`] at time `s` with the final voltage of source `port`.
    pub fn rate_sensitivity(&self, s: f64, port: usize, out: &mut Drive) {
        for (g, v) in out.volts.iter_mut().enumerate() {
            *v = self.electrics.gap_rows[(g, port)] / self.dt;
        }
        for k in 0..out.expansion.len() {
            let heater = &self.electrics.heating.heaters[k];
            let [p1, p2] = self.parabola_change(k, port);
            let slope = if heater.time_constant > 0.0 {
                (s * (p1 + s * p2) - self.rise_sensitivity(k, s, port)) / heater.time_constant
            } else {
                p1 + 2.0 * s * p2
            };
            out.expansion[k] = heater.expansion * slope;
        }
        self.set_input(port, 1.0 / self.dt, out);
        (out.load, out.turning) = (0.0, 0.0);
        out.push.clear();
    }

    /// Change of the parabola's second and third coefficient with the final voltage of source `port`; the first has none.
    fn parabola_change(&self, k: usize, port: usize) -> [f64; 2] {
        let (b, c) = (self.row(k, port, self.from), self.row(k, port, self.to));
        let heat = self.electrics.heating.per_watt(k, port);
        [(2.0 * b + heat) / self.dt, 2.0 * (c - b) / (self.dt * self.dt)]
    }

    /// (Q·u)_port of heater `k`.
    fn row(&self, k: usize, port: usize, u: &[f64]) -> f64 {
        let voltages = self.electrics.voltages();
        if port >= voltages {
            return 0.0;
        }
        (0..voltages).map(|j| self.electrics.heating.entry(k, port, j) * u[j]).sum()
    }

    fn gap(&self, g: usize, u: impl Fn(usize) -> f64) -> f64 {
        (0..self.from.len()).map(|i| self.electrics.gap_rows[(g, i)] * u(i)).sum()
    }
}

/// A ramp with what does not depend on the time looked up once: the same bits, for runs of many steps.
#[derive(Debug, Clone)]
pub struct Course<'a> {
    /// The ramp.
    pub ramp: Ramp<'a>,
    parabolas: Vec<[f64; 3]>,
}

impl<'a> Course<'a> {
    /// Of a ramp.
    pub fn new(ramp: Ramp<'a>) -> Self {
        let parabolas = (0..ramp.electrics.heating.heaters.len()).map(|k| ramp.parabola(k)).collect();
        Self { ramp, parabolas }
    }

    /// The free strains at time `s` after the start, heater by heater.
    pub fn expansions(&self, s: f64, mut put: impl FnMut(usize, f64)) {
        let mut lag = None;
        for (k, p) in self.parabolas.iter().enumerate() {
            let rise = self.ramp.rise_after(k, s, *p, &mut lag);
            put(k, self.ramp.electrics.heating.heaters[k].expansion * rise);
        }
    }

    /// Their rates of change in time [1/s].
    pub fn expansion_rates(&self, s: f64, mut put: impl FnMut(usize, f64)) {
        let mut lag = None;
        for (k, p) in self.parabolas.iter().enumerate() {
            put(k, self.ramp.expansion_rate(k, s, *p, &mut lag));
        }
    }
}
