//! From source voltages to what a mechanism feels: the voltage of each gap and the free strain of each heated beam, and with
//! them the inputs that are no voltages.

use super::inputs::Input;
use super::lag::Lags;
use super::thermal::Heating;
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

    /// Of each heater the coefficients of its steady rise in the time [s] since the sources began to go `from` one value `to` another
    /// [V] in `dt` [s]: K, K/s, K/s².
    fn heat_course(&self, (from, to): (&[f64], &[f64]), dt: f64) -> Vec<[f64; 3]> {
        let course = |k: usize| {
            let [a, b, c] = self.heating.between(k, from, to);
            [a, b / dt, c / (dt * dt)]
        };
        (0..self.heating.heaters.len()).map(course).collect()
    }

    /// Change of the second and third coefficient of [`Electrics::heat_course`] with the final voltage of source `port`; the first
    /// has none.
    fn heat_course_change(&self, k: usize, (from, to): (&[f64], &[f64]), dt: f64, port: usize) -> [f64; 2] {
        let (b, c) = (self.row(k, port, from), self.row(k, port, to));
        let heat = self.heating.per_watt(k, port);
        [(2.0 * b + heat) / dt, 2.0 * (c - b) / (dt * dt)]
    }

    /// (Q·u)_port of heater `k`.
    fn row(&self, k: usize, port: usize, u: &[f64]) -> f64 {
        let voltages = self.voltages();
        if port >= voltages {
            return 0.0;
        }
        (0..voltages).map(|j| self.heating.entry(k, port, j) * u[j]).sum()
    }

    /// The change of the rise of each heater with the final voltage of source `port` [K/V], `s` after the sources began to go `from` one
    /// value `to` another in `dt` [s].
    pub fn rise_sensitivities(
        &self,
        way: (&[f64], &[f64]),
        dt: f64,
        s: f64,
        port: usize,
        mut put: impl FnMut(usize, f64),
    ) {
        let mut lags = Lags::new(s);
        for (k, heater) in self.heating.heaters.iter().enumerate() {
            let [p1, p2] = self.heat_course_change(k, way, dt, port);
            let tau = heater.time_constant;
            put(k, if tau > 0.0 { lags.of(tau).rise(0.0, [0.0, p1, p2]) } else { s * (p1 + s * p2) });
        }
    }

    #[inline]
    fn gap_volts(&self, u: &[f64], volts: &mut [f64]) {
        for (g, v) in volts.iter_mut().enumerate() {
            *v = (0..u.len()).map(|s| self.gap_rows[(g, s)] * u[s]).sum();
        }
    }
}

/// Source voltages that go linearly from one value to another during a step, with the rises that follow them. What does not depend on
/// the time is looked up once.
#[derive(Debug, Clone)]
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
    /// Of each heater the coefficients of its steady rise in the time since the start: [`Electrics::heat_course`].
    heat: Vec<[f64; 3]>,
}

impl<'a> Ramp<'a> {
    /// Sources that go `from` one value `to` another [V] in `dt` [s], with heaters at `rise` [K] before.
    pub fn new(electrics: &'a Electrics, from: &'a [f64], to: &'a [f64], rise: &'a [f64], dt: f64) -> Self {
        Self { electrics, from, to, rise, dt, push: &[], heat: electrics.heat_course((from, to), dt) }
    }

    /// The same with a force and a moment on each body.
    pub fn pushed(self, push: &'a [Pose]) -> Self {
        Self { push, ..self }
    }

    /// Rise of heater `k` at time `s` after the start [K].
    pub fn rise_at(&self, k: usize, s: f64) -> f64 {
        self.rise_after(k, &mut Lags::new(s))
    }

    /// The same with the exponentials that other heaters have needed at this time.
    #[inline]
    fn rise_after(&self, k: usize, lags: &mut Lags) -> f64 {
        let (tau, p) = (self.electrics.heating.heaters[k].time_constant, self.heat[k]);
        if tau <= 0.0 {
            return p[0] + lags.t * (p[1] + lags.t * p[2]);
        }
        lags.of(tau).rise(self.rise[k], p)
    }

    /// The free strain of each heater at the time of `lags` after the start.
    pub fn expansions(&self, lags: &mut Lags, mut put: impl FnMut(usize, f64)) {
        for (k, heater) in self.electrics.heating.heaters.iter().enumerate() {
            put(k, heater.expansion * self.rise_after(k, lags));
        }
    }

    /// Their rates of change in time [1/s].
    pub fn expansion_rates(&self, lags: &mut Lags, mut put: impl FnMut(usize, f64)) {
        let s = lags.t;
        for (k, heater) in self.electrics.heating.heaters.iter().enumerate() {
            let p = self.heat[k];
            let slope = if heater.time_constant > 0.0 {
                (p[0] + s * (p[1] + s * p[2]) - self.rise_after(k, lags)) / heater.time_constant
            } else {
                p[1] + 2.0 * s * p[2]
            };
            put(k, heater.expansion * slope);
        }
    }

    /// The drive at time `s` after the start.
    pub fn at(&self, s: f64, drive: &mut Drive) {
        self.set(&mut Lags::new(s), drive);
    }

    /// The drive at time `s`, and its rate of change in time [1/s].
    pub fn at_and_rate(&self, s: f64, drive: &mut Drive, rate: &mut Drive) {
        let mut lags = Lags::new(s);
        self.set(&mut lags, drive);
        self.set_rate(&mut lags, rate);
    }

    fn set(&self, lags: &mut Lags, drive: &mut Drive) {
        let s = lags.t;
        let x = s / self.dt;
        for (g, v) in drive.volts.iter_mut().enumerate() {
            *v = self.gap(g, |i| self.from[i] + x * (self.to[i] - self.from[i]));
        }
        self.expansions(lags, |k, strain| drive.expansion[k] = strain);
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

    fn set_rate(&self, lags: &mut Lags, rate: &mut Drive) {
        for (g, v) in rate.volts.iter_mut().enumerate() {
            *v = self.gap(g, |i| (self.to[i] - self.from[i]) / self.dt);
        }
        self.expansion_rates(lags, |k, strain| rate.expansion[k] = strain);
        let first = self.electrics.voltages();
        for (k, value) in rate.inputs.iter_mut().enumerate() {
            *value = (self.to[first + k] - self.from[first + k]) / self.dt;
        }
        (rate.load, rate.turning) = (0.0, 0.0);
        rate.push.clear();
    }

    /// The change of the drive at time `s` with the final voltage of source `port`.
    pub fn sensitivity(&self, s: f64, port: usize, out: &mut Drive) {
        let x = s / self.dt;
        for (g, v) in out.volts.iter_mut().enumerate() {
            *v = self.electrics.gap_rows[(g, port)] * x;
        }
        let heaters = &self.electrics.heating.heaters;
        let put = |k: usize, rise: f64| out.expansion[k] = heaters[k].expansion * rise;
        self.electrics.rise_sensitivities((self.from, self.to), self.dt, s, port, put);
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

    /// The change of [`Ramp::rate`] at time `s` with the final voltage of source `port`.
    pub fn rate_sensitivity(&self, s: f64, port: usize, out: &mut Drive) {
        for (g, v) in out.volts.iter_mut().enumerate() {
            *v = self.electrics.gap_rows[(g, port)] / self.dt;
        }
        let mut lags = Lags::new(s);
        for (k, heater) in self.electrics.heating.heaters.iter().enumerate() {
            let [p1, p2] = self.electrics.heat_course_change(k, (self.from, self.to), self.dt, port);
            let slope = if heater.time_constant > 0.0 {
                let rise = lags.of(heater.time_constant).rise(0.0, [0.0, p1, p2]);
                (s * (p1 + s * p2) - rise) / heater.time_constant
            } else {
                p1 + 2.0 * s * p2
            };
            out.expansion[k] = heater.expansion * slope;
        }
        self.set_input(port, 1.0 / self.dt, out);
        (out.load, out.turning) = (0.0, 0.0);
        out.push.clear();
    }

    fn gap(&self, g: usize, u: impl Fn(usize) -> f64) -> f64 {
        (0..self.from.len()).map(|i| self.electrics.gap_rows[(g, i)] * u(i)).sum()
    }
}
