//! Voltages, strains and inputs over the time of one step or run, from a start to an end.

use super::super::heat_curves::TableEnd;
use super::super::hot::{HotCourse, SourceLine};
use super::super::input::Input;
use super::super::lag::Lags;
use super::electrics::{Drive, Electrics};
use super::shock::Shock;
use super::waveform::InputWaveform;
use bimorph_multibody::planar::Pose;
use std::sync::OnceLock;

/// Corners of waveforms that steps end at.
const MAX_CORNERS: usize = 1_000_000;

/// Source voltages that go linearly from one value to another during a step, with the rises that follow them.
/// Time-independent quantities are computed once.
#[derive(Debug, Clone)]
pub struct Ramp<'a> {
    /// The electrical side.
    pub electrics: &'a Electrics,
    /// Source voltages at the start (V).
    pub from: &'a [f64],
    /// Source voltages at the end (V).
    pub to: &'a [f64],
    /// Rise of each heater at the start (K).
    pub rise: &'a [f64],
    /// Length of the step (s).
    pub dt: f64,
    /// Force and moment on each body throughout the step; empty: none.
    pub push: &'a [Pose],
    /// By how much these grow in a second; empty: they stay.
    pub push_rate: &'a [Pose],
    /// Acceleration of the frame beside that of the sources; its inputs must be among those of the electrical side.
    pub shock: Option<Shock>,
    /// Inputs of the electrical side that follow waveforms beside their sources.
    pub motions: &'a [(usize, InputWaveform)],
    /// Of each heater the coefficients of its steady rise in the time since the start: [`Electrics::heat_course`].
    heat: Vec<[f64; 3]>,
    /// The course of the rises where resistances depend on temperature.
    course: Option<HotCourse>,
    /// Source by source, its change with the final voltage, once it is needed.
    changes: Vec<OnceLock<HotCourse>>,
    /// Source by source, the change of the second and third coefficient of `heat` with the final voltage, once it is needed; empty: none.
    heat_changes: Vec<OnceLock<Vec<[f64; 2]>>>,
}

impl<'a> Ramp<'a> {
    /// Sources that go `from` one value `to` another (V) in `dt` (s), with heaters at `rise` (K) before.
    #[inline]
    pub fn new(electrics: &'a Electrics, from: &'a [f64], to: &'a [f64], rise: &'a [f64], dt: f64) -> Self {
        let heating = &electrics.heating;
        let line = SourceLine { from, to, dt };
        let course = heating.hot().map(|hot| hot.course(line, &rise[heating.means()..]));
        let changes = if course.is_some() { vec![OnceLock::new(); from.len()] } else { Vec::new() };
        let heat = electrics.heat_course((from, to), dt);
        Self {
            electrics,
            from,
            to,
            rise,
            dt,
            push: &[],
            push_rate: &[],
            shock: None,
            motions: &[],
            heat,
            course,
            changes,
            heat_changes: vec![OnceLock::new(); from.len()],
        }
    }

    /// The time at which rises leave all bounds (s), with the heater and the table that ends there, if it is one; none: they do not.
    #[inline]
    pub fn overheated(&self) -> Option<(f64, Option<(usize, TableEnd)>)> {
        let course = self.course.as_ref()?;
        Some((course.failed?, course.end_of_table))
    }

    /// The heater with the highest mean rise at the end of the course.
    pub fn hottest(&self) -> Option<usize> {
        let (hot, course) = (self.electrics.heating.hot()?, self.course.as_ref()?);
        let mut means = vec![0.0; self.electrics.heating.means()];
        hot.means(&course.end, &mut means);
        (0..self.electrics.heating.heaters.len()).max_by(|a, b| means[*a].total_cmp(&means[*b]))
    }

    /// Rises at the end (K), as the next step takes them.
    #[inline]
    pub fn end_rises(&self, out: &mut [f64]) {
        let (means, state) = out.split_at_mut(self.electrics.heating.means());
        means.iter_mut().enumerate().for_each(|(k, rise)| *rise = self.rise_at(k, self.dt));
        if let Some(course) = &self.course {
            state.copy_from_slice(&course.end);
        }
    }

    /// Change of the mean rise of heater `k` with the final voltage of a source at time `s`, and its rate; none where it is in closed form.
    fn hot_change(&self, k: usize, s: f64, source: usize) -> Option<[f64; 2]> {
        let heating = &self.electrics.heating;
        let (hot, change) = (heating.hot()?, self.changes.get(source)?);
        let line = SourceLine { from: self.from, to: self.to, dt: self.dt };
        let start = &self.rise[heating.means()..];
        Some(change.get_or_init(|| hot.course_change(line, start, source)).mean(k, s))
    }

    /// Change of the second and third coefficient of the steady rise of each heater with the final voltage of a source; empty: it heats nothing.
    fn heat_change(&self, source: usize) -> &[[f64; 2]] {
        self.heat_changes[source].get_or_init(|| {
            let heating = &self.electrics.heating;
            let count = if heating.is_warmed_by(source) { heating.heaters.len() } else { 0 };
            (0..count).map(|k| self.electrics.heat_course_change(k, (self.from, self.to), self.dt, source)).collect()
        })
    }

    /// Which value of the course is the free strain of heater `k`; none where that is its mean rise times a constant.
    fn strain_series(&self, k: usize) -> Option<usize> {
        let heating = &self.electrics.heating;
        (heating.means() > heating.heaters.len()).then(|| heating.heaters.len() + k)
    }

    /// The same with a force and a moment on each body.
    #[inline]
    pub fn pushed(self, push: &'a [Pose]) -> Self {
        Self { push, ..self }
    }

    /// The same with a force and a moment on each body at the start, and by how much these grow in a second.
    #[inline]
    pub fn pushed_along(self, push: &'a [Pose], push_rate: &'a [Pose]) -> Self {
        Self { push, push_rate, ..self }
    }

    /// The same with a shock.
    #[inline]
    pub fn shocked(self, shock: Option<Shock>) -> Self {
        Self { shock, ..self }
    }

    /// The same with waveforms of inputs, by their places among those of the electrical side.
    #[inline]
    pub fn moved(self, motions: &'a [(usize, InputWaveform)]) -> Self {
        Self { motions, ..self }
    }

    /// Times before the end at which the rate of an input jumps (s), ascending, the first million of them.
    pub fn corners(&self) -> Vec<f64> {
        let after = |t: f64| self.motions.iter().map(|(_, wave)| wave.corner_after(t)).fold(f64::INFINITY, f64::min);
        let inside = |t: f64| Some(after(t)).filter(|corner| *corner < self.dt);
        std::iter::successors(inside(0.0), |t| inside(*t)).take(MAX_CORNERS).collect()
    }

    /// Sum of the shock and the waveforms of input `k` at time `s`, and its rate.
    fn course_at(&self, k: usize, s: f64) -> [f64; 2] {
        match (&self.shock, self.electrics.inputs[k]) {
            (Some(shock), Input::Acceleration { axis }) => shock.at(axis, s),
            (_, Input::Motion { .. }) => {
                let own = self.motions.iter().filter(|(input, _)| *input == k).map(|(_, wave)| wave.at(s));
                own.fold([0.0; 2], |[x, v], [a, b]| [x + a, v + b])
            }
            _ => [0.0; 2],
        }
    }

    /// Rise of heater `k` that the sources at the start lead to (K).
    #[inline]
    pub fn steady_at_start(&self, k: usize) -> f64 {
        self.heat[k][0]
    }

    /// Rise of heater `k` at time `s` after the start (K).
    #[inline]
    pub fn rise_at(&self, k: usize, s: f64) -> f64 {
        self.rise_after(k, &mut Lags::new(s))
    }

    /// The same with the exponentials that other heaters have needed at this time.
    #[inline]
    fn rise_after(&self, k: usize, lags: &mut Lags) -> f64 {
        if let Some(course) = &self.course {
            return course.mean(k, lags.t)[0];
        }
        let (tau, p) = (self.electrics.heating.heaters[k].time_constant, self.heat[k]);
        if tau <= 0.0 {
            return p[0] + lags.t * (p[1] + lags.t * p[2]);
        }
        lags.of(tau).rise(self.rise[k], p)
    }

    /// The free strain of each heater at the time of `lags` after the start.
    #[inline]
    pub fn expansions(&self, lags: &mut Lags, mut put: impl FnMut(usize, f64)) {
        let heaters = &self.electrics.heating.heaters;
        for (k, heater) in heaters.iter().enumerate() {
            let strain = match self.strain_series(k) {
                Some(series) => self.rise_after(series, lags),
                None => heater.expansion * self.rise_after(k, lags),
            };
            put(k, strain);
        }
    }

    /// Their rates of change in time (1/s).
    #[inline]
    pub fn expansion_rates(&self, lags: &mut Lags, mut put: impl FnMut(usize, f64)) {
        let s = lags.t;
        for (k, heater) in self.electrics.heating.heaters.iter().enumerate() {
            let p = self.heat[k];
            if let (Some(course), Some(series)) = (&self.course, self.strain_series(k)) {
                put(k, course.mean(series, s)[1]);
                continue;
            }
            let slope = if let Some(course) = &self.course {
                course.mean(k, s)[1]
            } else if heater.time_constant > 0.0 {
                (p[0] + s * (p[1] + s * p[2]) - self.rise_after(k, lags)) / heater.time_constant
            } else {
                p[1] + 2.0 * s * p[2]
            };
            put(k, heater.expansion * slope);
        }
    }

    /// The drive at time `s` after the start.
    #[inline]
    pub fn at(&self, s: f64, drive: &mut Drive) {
        self.set(&mut Lags::new(s), drive);
    }

    /// The drive at time `s`, and its rate of change in time (1/s).
    #[inline]
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
        drive.push.iter_mut().zip(self.push_rate).for_each(|(push, rate)| *push += rate * s);
        let first = self.electrics.voltages();
        drive.turning = 0.0;
        for (k, value) in drive.inputs.iter_mut().enumerate() {
            let change = self.to[first + k] - self.from[first + k];
            *value = self.from[first + k] + x * change + self.course_at(k, s)[0];
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
            *value = (self.to[first + k] - self.from[first + k]) / self.dt + self.course_at(k, lags.t)[1];
        }
        (rate.load, rate.turning) = (0.0, 0.0);
        rate.push.clear();
        rate.push.extend_from_slice(self.push_rate);
    }

    /// The change of the drive with the final voltage of source `port`, at the time of `lags` after the start.
    #[inline]
    pub fn sensitivity(&self, lags: &mut Lags, port: usize, out: &mut Drive) {
        let s = lags.t;
        let x = s / self.dt;
        for (g, v) in out.volts.iter_mut().enumerate() {
            *v = self.electrics.gap_rows[(g, port)] * x;
        }
        let heaters = &self.electrics.heating.heaters;
        if self.course.is_some() {
            for (k, heater) in heaters.iter().enumerate() {
                let change = |k: usize| self.hot_change(k, s, port).map_or(0.0, |[rise, _]| rise);
                let curved = self.strain_series(k);
                out.expansion[k] = curved.map_or_else(|| heater.expansion * change(k), change);
            }
        } else {
            let changes = self.heat_change(port);
            if changes.is_empty() {
                out.expansion.fill(0.0);
            }
            for ((strain, heater), change) in out.expansion.iter_mut().zip(heaters).zip(changes) {
                *strain = heater.expansion * lags.change(heater.time_constant, *change);
            }
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

    /// The change of the rate of the drive with the final voltage of source `port`, at the time of `lags` after the start.
    pub fn rate_sensitivity(&self, lags: &mut Lags, port: usize, out: &mut Drive) {
        let s = lags.t;
        for (g, v) in out.volts.iter_mut().enumerate() {
            *v = self.electrics.gap_rows[(g, port)] / self.dt;
        }
        let changes = if self.course.is_some() { &[][..] } else { self.heat_change(port) };
        for (k, heater) in self.electrics.heating.heaters.iter().enumerate() {
            let [p1, p2] = changes.get(k).copied().unwrap_or_default();
            if let Some([_, rate]) = self.strain_series(k).and_then(|series| self.hot_change(series, s, port)) {
                out.expansion[k] = rate;
                continue;
            }
            let slope = if let Some([_, rate]) = self.hot_change(k, s, port) {
                rate
            } else if heater.time_constant > 0.0 {
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
