//! The electrical side of a mechanism, and what it makes of source voltages at one time.

use super::super::floating::FloatingConductors;
use super::super::hot::SourceLine;
use super::super::input::Input;
use super::super::lag::Lags;
use super::super::thermal::Heating;
use bimorph_multibody::forces::RestStrain;
use bimorph_multibody::planar::Pose;
use nalgebra::DMatrix;

/// Electrical and thermal state that acts on a mechanism at one instant, or its change.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drive {
    /// Voltage of each gap with floating conductors at 0 V (V); [`super::super::system::System::gap_voltages`] has them with these.
    pub volts: Vec<f64>,
    /// Free strain α·T̄ of each heated beam (1).
    pub expansion: Vec<f64>,
    /// Fraction of the dead loads and built-in strains that acts (1).
    pub load: f64,
    /// Value of each input in its own unit, in the order of [`Electrics::inputs`].
    pub inputs: Vec<f64>,
    /// Rate of change of the frame's rate (rad/s²).
    pub turning: f64,
    /// External force and moment on each body, of thermal agitation or of a voltage beside those of the sources; empty: none.
    pub push: Vec<Pose>,
}

impl Drive {
    /// The part that sets rest offsets.
    #[inline]
    pub fn rest(&self) -> RestStrain<'_> {
        RestStrain { expansion: &self.expansion, built_in: self.load }
    }

    /// Becomes the change from itself to another drive under the same dead loads.
    pub fn change_to(&mut self, to: &Self) {
        let parts =
            [(&mut self.volts, &to.volts), (&mut self.expansion, &to.expansion), (&mut self.inputs, &to.inputs)];
        for (from, to) in parts {
            from.iter_mut().zip(to).for_each(|(from, to)| *from = to - *from);
        }
        (self.load, self.turning) = (0.0, to.turning - self.turning);
        self.push.clear();
    }

    /// Leaves of a change what acts in proportion to the drive that it changes: voltages, and the rate of the frame.
    #[inline]
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
    /// Voltages of the netlist's own sources (V).
    pub fixed: Vec<f64>,
    /// Names of all sources, ports first.
    pub names: Vec<String>,
    /// ∂gap voltage/∂u, gaps × sources, with floating conductors at 0 V.
    pub gap_rows: DMatrix<f64>,
    /// Conductors of gaps that keep their charge.
    pub floating: FloatingConductors,
    /// ∂port current/∂u, ports × sources (S).
    pub conductance: DMatrix<f64>,
    /// Heated beams.
    pub heating: Heating,
    /// Inputs other than voltages.
    pub inputs: Vec<Input>,
}

impl Electrics {
    /// Length of the source vector.
    #[inline]
    pub fn sources(&self) -> usize {
        self.voltages() + self.inputs.len()
    }

    /// Voltages in the source vector: the place of the first input.
    #[inline]
    pub fn voltages(&self) -> usize {
        self.ports + self.fixed.len()
    }

    /// The same with these inputs.
    #[inline]
    pub fn with_inputs(&self, inputs: Vec<Input>) -> Self {
        let sources = self.voltages() + inputs.len();
        let (gaps, ports) = (self.gap_rows.nrows(), self.conductance.nrows());
        bimorph_base::budget::lay_out_matrix(gaps + ports + self.heating.heaters.len(), sources);
        Self {
            gap_rows: self.gap_rows.clone().resize(gaps, sources, 0.0),
            conductance: self.conductance.clone().resize(ports, sources, 0.0),
            heating: self.heating.with_heat(&inputs),
            inputs,
            ..self.clone()
        }
    }

    /// A drive of the right size, all zero, loads acting fully.
    #[inline]
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
    #[inline]
    pub fn fill_sources(&self, ports: &[f64], u: &mut [f64]) {
        u[..self.ports].copy_from_slice(ports);
        u[self.ports..self.voltages()].copy_from_slice(&self.fixed);
        u[self.voltages()..].fill(0.0);
    }

    /// The drive at source voltages `u` when every heater is at its steady rise, which goes to `rise` (K).
    #[inline]
    pub fn steady(&self, u: &[f64], rise: &mut [f64], drive: &mut Drive) {
        self.heating.rises(u, rise);
        self.apply(u, rise, drive);
    }

    /// Current into each port at source voltages `u` and rises (A).
    #[inline]
    pub fn port_currents(&self, u: &[f64], rise: &[f64]) -> Vec<f64> {
        match self.heating.hot() {
            None => (0..self.ports).map(|p| self.conductance.row(p).iter().zip(u).map(|(g, u)| g * u).sum()).collect(),
            Some(hot) => hot.source_currents(&hot.flows(rise, u, |_| 0.0), u),
        }
    }

    /// Conductance between two electrical sources at fixed rises (S).
    pub fn conductance_between(&self, rise: &[f64], a: usize, b: usize) -> f64 {
        match self.heating.hot() {
            None => self.conductance[(a, b)],
            Some(hot) => {
                let unit = self.unit(b);
                hot.source_currents(&hot.flows(rise, &unit, |_| 0.0), &unit)[a]
            }
        }
    }

    /// Σ rise·R·I_a·I_b over the heaters, I_a the current for a volt of source `a` at fixed rises (K·S).
    pub fn heated_noise(&self, rise: &[f64], a: usize, b: usize) -> f64 {
        let heating = &self.heating;
        let heaters = heating.heaters.iter().zip(rise).enumerate();
        let Some(hot) = heating.hot() else {
            return heaters.map(|(k, (h, t))| t * h.resistance * heating.current(k, a) * heating.current(k, b)).sum();
        };
        let [a, b] = [a, b].map(|source| hot.flows(rise, &self.unit(source), |_| 0.0).current);
        heaters.map(|(k, (_, t))| t * hot.resistance(k, rise) * a[k] * b[k]).sum()
    }

    fn unit(&self, source: usize) -> Vec<f64> {
        (0..self.sources()).map(|s| if s == source { 1.0 } else { 0.0 }).collect()
    }

    /// Change of [`Electrics::port_currents`] with source voltages, along `unit`, and with rises that change by `slopes` (K) (A).
    pub fn port_current_slopes(&self, (u, rise): (&[f64], &[f64]), unit: &[f64], slopes: &[f64]) -> Vec<f64> {
        match self.heating.hot() {
            None => self.port_currents(unit, slopes),
            Some(hot) => {
                let flows = hot.flows(rise, u, |_| 0.0);
                hot.source_currents(&hot.flow_change(rise, &flows, slopes, unit), unit)
            }
        }
    }

    /// The drive at source voltages `u` and temperature rises `rise` (K).
    #[inline]
    pub fn apply(&self, u: &[f64], rise: &[f64], drive: &mut Drive) {
        self.gap_volts(u, &mut drive.volts);
        self.expand(rise, &mut drive.expansion);
        drive.inputs.copy_from_slice(&u[self.voltages()..]);
        drive.turning = 0.0;
        drive.push.clear();
    }

    /// Free strains of all heaters at a vector of rises, or their changes with changes of them.
    #[inline]
    pub fn expand(&self, rise: &[f64], strains: &mut [f64]) {
        strains.iter_mut().enumerate().for_each(|(k, strain)| *strain = self.heating.strain(k, rise));
    }

    /// The change of the steady drive with the sources along `unit`, at source voltages `u` and steady rises.
    #[inline]
    pub fn steady_slope(&self, (u, rise): (&[f64], &[f64]), unit: &[f64], slope: &mut Drive) {
        self.gap_volts(unit, &mut slope.volts);
        let mut slopes = vec![0.0; self.heating.means()];
        self.heating.slopes(u, rise, unit, &mut slopes);
        self.expand(&slopes, &mut slope.expansion);
        slope.inputs.copy_from_slice(&unit[self.voltages()..]);
        (slope.load, slope.turning) = (0.0, 0.0);
    }

    /// Of each heater the coefficients of its steady rise in the time (s) since the sources began to go `from` one value `to` another
    /// (V) in `dt` (s): K, K/s, K/s².
    pub(super) fn heat_course(&self, (from, to): (&[f64], &[f64]), dt: f64) -> Vec<[f64; 3]> {
        let course = |k: usize| {
            let [a, b, c] = self.heating.between(k, from, to);
            [a, b / dt, c / (dt * dt)]
        };
        (0..self.heating.heaters.len()).map(course).collect()
    }

    /// Change of the second and third coefficient of [`Electrics::heat_course`] with the final voltage of source `port`; the first
    /// has none.
    pub(super) fn heat_course_change(&self, k: usize, (from, to): (&[f64], &[f64]), dt: f64, port: usize) -> [f64; 2] {
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

    /// The change of the rise of each heater with the final voltage of source `port` (K/V), `s` after the sources began to go `from` one
    /// value `to` another in `dt` (s), with rises `start` there (K).
    pub fn rise_sensitivities(
        &self,
        (way, start): ((&[f64], &[f64]), &[f64]),
        dt: f64,
        s: f64,
        port: usize,
        mut put: impl FnMut(usize, f64),
    ) {
        let count = self.heating.means();
        if let Some(hot) = self.heating.hot() {
            let course = hot.course_change(SourceLine { from: way.0, to: way.1, dt }, &start[count..], port);
            (0..count).for_each(|k| put(k, course.mean(k, s)[0]));
            return;
        }
        if !self.heating.is_warmed_by(port) {
            return (0..count).for_each(|k| put(k, 0.0));
        }
        let mut lags = Lags::new(s);
        for (k, heater) in self.heating.heaters.iter().enumerate() {
            let change = self.heat_course_change(k, way, dt, port);
            put(k, lags.change(heater.time_constant, change));
        }
    }

    #[inline]
    fn gap_volts(&self, u: &[f64], volts: &mut [f64]) {
        volts.iter_mut().enumerate().for_each(|(gap, v)| *v = self.volts_across(gap, u));
    }

    fn volts_across(&self, gap: usize, u: &[f64]) -> f64 {
        u.iter().enumerate().map(|(s, u)| self.gap_rows[(gap, s)] * u).sum()
    }

    /// Whether there is a voltage across a gap at source voltages `u`.
    pub fn is_energised(&self, gap: usize, u: &[f64]) -> bool {
        self.among(gap, |g| self.volts_across(g, u) != 0.0)
    }

    /// Whether a gap has a field at the voltages of a [`Drive`].
    #[inline]
    pub fn is_charged(&self, gap: usize, volts: &[f64]) -> bool {
        self.among(gap, |g| volts[g] != 0.0)
    }

    /// Whether a source is across a gap, or drives it through conductors that float.
    pub fn drives(&self, source: usize, gap: usize) -> bool {
        self.among(gap, |g| self.gap_rows[(g, source)] != 0.0)
    }

    /// Whether it holds of a gap, or of one that shares floating conductors with it.
    #[inline]
    fn among(&self, gap: usize, holds: impl Fn(usize) -> bool) -> bool {
        holds(gap) || self.floating.of_gap(gap).is_some_and(|group| group.gaps.iter().any(|of| holds(of.gap)))
    }
}
