//! Paths of drives that an equilibrium follows.

use bimorph_domains::Drive;
use bimorph_domains::drive::Electrics;

/// A path of drives: fills in the drive, or its rate of change, at s in 0…1.
pub trait LoadPath {
    /// The drive at `s`.
    fn at(&self, s: f64, drive: &mut Drive);
    /// d(drive)/ds at `s`.
    fn slope(&self, s: f64, slope: &mut Drive);
    /// True where it begins under load, so that `s` is no measure of the load.
    fn begins_loaded(&self) -> bool {
        false
    }
    /// True where the drive is the same all along it: shorter steps lead to the same trial.
    fn is_still(&self) -> bool {
        false
    }
    /// The next value of s beyond `s` at which a step has to end: 1, or where an electrode's voltage vanishes before
    /// that. A contact held closed opens there, and at the opposite voltage the same contact is an equilibrium again.
    fn station(&self, s: f64) -> f64 {
        let _ = s;
        1.0
    }
}

/// The smallest fraction of a way from rest at which sources are taken (1): nothing at all would have no slope.
const LEAST: f64 = 1e-30;

/// Remaining distance to a station that counts as zero (1).
const SMALLEST: f64 = 1e-12;

/// Source voltages and dead loads that go from one value to another, heaters at their steady temperature.
///
/// Loads go linearly. Voltages from rest follow the square root of the fraction. Heat and attraction, which follow
/// their square, then grow in proportion to the loads, and a tangent predicts the path from the start. Voltages from
/// another state follow it linearly. So they do across gaps while loads come: attraction, the square of them, then lags
/// behind a load that opens a gap, and does not close what such a load holds open.
#[derive(Debug, Clone)]
pub struct SourcePath<'a> {
    electrics: &'a Electrics,
    from: &'a [f64],
    to: &'a [f64],
    load: [f64; 2],
    from_rest: bool,
    /// Of each gap, its voltage at both ends (V).
    volts: Vec<[f64; 2]>,
    /// Of each heater, the coefficients of its rise in the share, and its rise at the end (K).
    rise: Vec<([f64; 3], f64)>,
}

impl<'a> SourcePath<'a> {
    /// From source voltages `from` to `to` (V), and the fraction `load` of dead loads and built-in strains at both ends.
    pub fn new(electrics: &'a Electrics, from: &'a [f64], to: &'a [f64], load: [f64; 2]) -> Self {
        let gap = |g: usize, u: &[f64]| u.iter().enumerate().map(|(i, v)| electrics.gap_rows[(g, i)] * v).sum::<f64>();
        let attracts = (0..electrics.gap_rows.nrows()).any(|g| gap(g, to) != 0.0);
        let from_rest = from.iter().all(|v| *v == 0.0) && !(attracts && load[0] != load[1]);
        let heating = &electrics.heating;
        // where resistances depend on temperature there are no such coefficients
        let rise = |k: usize| match heating.is_hot() {
            true => ([0.0; 3], 0.0),
            false => {
                let end = heating.steady(k, to);
                (if from_rest { [0.0, end, 0.0] } else { heating.between(k, from, to) }, end)
            }
        };
        let volts = (0..electrics.gap_rows.nrows()).map(|g| [gap(g, from), gap(g, to)]).collect();
        let rise = (0..heating.heaters.len()).map(rise).collect();
        Self { electrics, from, to, load, from_rest, volts, rise }
    }

    /// Source voltages at `s` with the steady rises there, and the change of the voltages with `s`.
    fn hot(&self, s: f64) -> [Vec<f64>; 3] {
        let e = self.electrics;
        let ([share, rate], voltages) = (self.share(s), e.voltages());
        let one = |(i, (from, to)): (usize, (&f64, &f64))| match i < voltages {
            true => (from + share * (to - from), rate * (to - from)),
            false => (from + s * (to - from), to - from),
        };
        let (u, change): (Vec<f64>, Vec<f64>) = self.from.iter().zip(self.to).enumerate().map(one).unzip();
        let mut rise = vec![0.0; e.heating.states()];
        e.heating.rises(&u, &mut rise);
        [u, rise, change]
    }

    /// The share of the voltages at `s`, and its slope.
    fn share(&self, s: f64) -> [f64; 2] {
        if self.from_rest {
            let root = s.max(LEAST).sqrt();
            [root, 0.5 / root]
        } else {
            [s, 1.0]
        }
    }
}

impl LoadPath for SourcePath<'_> {
    fn begins_loaded(&self) -> bool {
        self.load[0] != 0.0 || self.from.iter().any(|v| *v != 0.0)
    }

    fn is_still(&self) -> bool {
        self.load[0] == self.load[1] && self.from == self.to
    }

    fn at(&self, s: f64, drive: &mut Drive) {
        let e = self.electrics;
        let [share, _] = self.share(s);
        for (v, [from, to]) in drive.volts.iter_mut().zip(&self.volts) {
            *v = if s >= 1.0 { *to } else { from + share * (to - from) };
        }
        for ((expansion, heater), ([a, b, c], end)) in
            drive.expansion.iter_mut().zip(&e.heating.heaters).zip(&self.rise)
        {
            *expansion = heater.expansion * if s >= 1.0 { *end } else { a + s * (b + s * c) };
        }
        if e.heating.is_hot() {
            let [_, rise, _] = self.hot(s);
            e.expand(&rise, &mut drive.expansion);
        }
        drive.load = self.load[0] + s * (self.load[1] - self.load[0]);
        for (k, value) in drive.inputs.iter_mut().enumerate() {
            let (from, to) = (self.from[e.voltages() + k], self.to[e.voltages() + k]);
            *value = if s >= 1.0 { to } else { from + s * (to - from) };
        }
        drive.turning = 0.0;
    }

    fn station(&self, s: f64) -> f64 {
        if self.from_rest {
            return 1.0;
        }
        let crossing = |[from, to]: &[f64; 2]| if from * to < 0.0 { from / (from - to) } else { 1.0 };
        self.volts.iter().map(crossing).filter(|at| at - s > SMALLEST).fold(1.0, f64::min)
    }

    fn slope(&self, s: f64, slope: &mut Drive) {
        let e = self.electrics;
        let [_, rate] = self.share(s);
        for (v, [from, to]) in slope.volts.iter_mut().zip(&self.volts) {
            *v = rate * (to - from);
        }
        for ((expansion, heater), ([_, b, c], _)) in slope.expansion.iter_mut().zip(&e.heating.heaters).zip(&self.rise)
        {
            *expansion = heater.expansion * (b + 2.0 * s * c);
        }
        if e.heating.is_hot() {
            let [u, rise, change] = self.hot(s);
            let mut slopes = vec![0.0; e.heating.means()];
            e.heating.slopes(&u, &rise, &change, &mut slopes);
            e.expand(&slopes, &mut slope.expansion);
        }
        slope.load = self.load[1] - self.load[0];
        for (k, value) in slope.inputs.iter_mut().enumerate() {
            *value = self.to[e.voltages() + k] - self.from[e.voltages() + k];
        }
        slope.turning = 0.0;
    }
}
