//! How far the reduced model is from the exact small-signal answer, and how many modes that takes.
//!
//! The exact answer is that of [`bimorph_device::Device::linearize`], which a circuit gets in `.ac`. The comparison uses
//! a logarithmic frequency grid from far below the first mode, refined about every resonance. Each value is compared by
//! port and signal, relative to itself. Where terms cancel (at a zero of the curve), the scale is a hundredth of the
//! terms.
//!
//! The reduced model keeps the modes within the band that contribute there. As far as the tolerance requires, it then
//! adds dynamic directions of the static correction one by one, modes above the band, and finally the other modes in
//! the band.

use super::basis::Basis;
use super::linear::ReducedModel;
use super::linear_noise::LinearNoise;
use super::mechanism::{LinearizedMechanism, port_names};
use super::{ExportError, ExportRequest};
use bimorph_device::local::LocalDevice;
use bimorph_device::scale::PortScale;
use bimorph_device::{Device, Mode, OpenRequest, SmallSignal, Status, Token, Trial, TrialReply};
use bimorph_model::compile::CompiledModel;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Modes computed first, and at most.
const FIRST_MODES: usize = 8;
const MAX_MODES: usize = 128;
/// Frequencies in a decade.
const PER_DECADE: f64 = 30.0;
/// How far below the lowest corner the comparison begins.
const FAR_BELOW: f64 = 100.0;
/// Fraction of the parts of a value below which it counts as a zero of the curve.
const ZERO: f64 = 0.01;
/// Fraction of what modes could contribute below which ports and signals do not see each other.
const UNSEEN: f64 = 1e-7;
/// Fraction of the tolerance with which a mode must show at its own resonance to be kept.
const SHOWS: f64 = 0.1;
/// Fraction of what is there at its resonance from which a mode counts for the band.
const COUPLED: f64 = 0.01;
/// Damping over frequency up to which a mode counts as undamped, and the half width of the grid about its resonance.
const UNDAMPED: f64 = 1e-9;
const NARROW: f64 = 1e-4;
/// Directions of the static correction for each push, and how many are tried one after the other.
const DEEPEST: usize = 2;
const MANY: usize = 12;
/// The band where there is one mode alone, over its frequency.
const BEYOND_ONE: f64 = 10.0;

/// The exact device at the operating point.
struct ExactDevice {
    device: LocalDevice,
    token: Token,
    scales: Vec<PortScale>,
    signals: Vec<f64>,
    /// Ports of the device: those of the model, then those that only have a bias.
    opened: usize,
    /// It jumped on the way to the operating point.
    jumped: bool,
}

/// The model, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFit {
    /// The model.
    pub model: ReducedModel,
    /// Its thermal noise.
    pub noise: LinearNoise,
    /// Largest relative deviation of the spectral density of a port or signal from that of the full model (1).
    pub noise_error: f64,
    /// Largest relative deviation from the exact small-signal answer (1).
    pub error: f64,
    /// Where: row, port and frequency (Hz).
    pub worst: (String, String, f64),
    /// Band of the comparison (Hz).
    pub band: [f64; 2],
    /// Frequencies compared.
    pub compared: usize,
    /// Mechanical unknowns of the full model.
    pub unknowns: usize,
    /// The part pulled in, snapped or buckled on the way to the operating point.
    pub jumped: bool,
}

/// The reduced model of a request.
///
/// # Errors
/// See [`ExportError`].
pub fn fit(compiled: &Arc<CompiledModel>, request: &ExportRequest) -> Result<ModelFit, ExportError> {
    let mechanism = LinearizedMechanism::new(compiled, request)?;
    let (mut exact, at_rest) = ExactDevice::new(compiled, request)?;
    let mut count = request.count.unwrap_or(FIRST_MODES);
    loop {
        let found = mechanism.modes(count)?;
        let exhausted = found.lambda.len() < count || count >= MAX_MODES;
        let every: Vec<usize> = (0..found.lambda.len()).collect();
        let all = mechanism.reduced(&Basis::of(&found, &every));
        let shares = exact.shares(&all)?;
        let above_share = |least: f64| every.iter().copied().filter(|&j| shares[j] > least).collect::<Vec<usize>>();
        let (showing, coupled) = (above_share(SHOWS * request.within), above_share(COUPLED));
        let hertz = |j: usize| all.modes[j].omega / TAU;
        let to = match (request.to, coupled.as_slice()) {
            (Some(to), _) => to,
            (None, [_, second, ..]) => hertz(*second),
            (None, _) if !exhausted && request.count.is_none() => {
                count *= 2;
                continue;
            }
            (None, [one]) => BEYOND_ONE * hertz(*one),
            (None, []) => hertz(all.modes.len() - 1),
        };
        let grid = grid(&all, to);
        let answers = grid.iter().map(|omega| exact.response(*omega)).collect::<Result<Vec<_>, _>>()?;
        let jumped = exact.jumped;
        let assessed = |basis: &Basis| {
            let mut model = mechanism.reduced(basis);
            model.at_rest.copy_from(&at_rest);
            let (error, worst) = deviation(&model, &all, &grid, &answers);
            let band = [grid[0] / TAU, to];
            let unknowns = compiled.parts.system.model.unknowns();
            let (noise, noise_error, compared) = (LinearNoise::default(), 0.0, grid.len());
            ModelFit { model, noise, noise_error, error, worst, band, compared, unknowns, jumped }
        };

        let choices = match request.count {
            Some(_) => vec![every.clone()],
            None => choices(&every, &showing, |j| hertz(j) <= 1.01 * to),
        };
        let mut noisy = |(fitted, basis): (ModelFit, Basis)| -> Result<ModelFit, ExportError> {
            let noise = mechanism.noise(&basis);
            let exact = grid.iter().map(|omega| exact.noise(*omega)).collect::<Result<Vec<_>, _>>()?;
            let noise_error = noise_deviation(&fitted.model, &noise, &grid, &exact);
            Ok(ModelFit { noise, noise_error, ..fitted })
        };
        let mut best: Option<(ModelFit, Basis)> = None;
        for kept in &choices {
            let basis = Basis::of(&found, kept);
            for depth in 1..=DEEPEST {
                let corrected = mechanism.corrected(&basis, depth);
                let most = corrected.corrections();
                // one after the other, or all at once where there are many
                let swinging = if most <= MANY { (0..=most).collect() } else { vec![0, most] };
                for more in swinging.into_iter().filter(|more| depth == 1 || *more > 0) {
                    let basis = corrected.first(kept.len() + more);
                    let fitted = assessed(&basis);
                    if fitted.error <= request.within {
                        return noisy((fitted, basis));
                    }
                    if best.as_ref().is_none_or(|(best, _)| fitted.error < best.error) {
                        best = Some((fitted, basis));
                    }
                }
            }
        }
        match best {
            Some(best) if request.count.is_some() => return noisy(best),
            best if exhausted => {
                let (error, modes) = best.map_or((f64::INFINITY, 0), |(b, _)| (b.error, b.model.modes.len()));
                return Err(ExportError::NotReached { modes, error, to, within: request.within });
            }
            _ => count *= 2,
        }
    }
}

/// Modes to try, one choice after the other: those that show in the band, with none, 1, 2, 4 … and all of those above it. Then all in the
/// band, too: one that does not show at its own resonance, beside another, may matter where that is far.
fn choices(every: &[usize], showing: &[usize], in_band: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let within = |of: &[usize]| of.iter().copied().filter(|&j| in_band(j)).collect::<Vec<usize>>();
    let above: Vec<usize> = every.iter().copied().filter(|&j| !in_band(j)).collect();
    let mut families = vec![within(showing), within(every)];
    families.dedup();
    let with_above = |within: Vec<usize>| -> Vec<Vec<usize>> {
        std::iter::once(0)
            .chain((0..).map(|k| 1 << k).take_while(|more| *more < above.len()))
            .chain([above.len()])
            .map(|more| within.iter().chain(&above[..more]).copied().collect())
            .collect()
    };
    families.into_iter().flat_map(with_above).collect()
}

/// Angular frequencies of the comparison, ascending.
fn grid(model: &ReducedModel, to: f64) -> Vec<f64> {
    let end = TAU * to;
    let lags = model.lags.iter().map(|l| 1.0 / l.tau);
    let lowest = model.modes.iter().map(|m| m.omega).chain(lags).fold(end, f64::min);
    let start = lowest / FAR_BELOW;
    let steps = (PER_DECADE * (end / start).log10()).ceil().max(1.0);
    let mut grid: Vec<f64> = (0..=steps as usize).map(|k| start * (end / start).powf(k as f64 / steps)).collect();
    for (j, mode) in model.modes.iter().enumerate().filter(|(_, m)| m.omega <= end) {
        let half = (0.5 * model.damping[(j, j)] / mode.omega).clamp(NARROW, 0.3);
        let damped = model.damping[(j, j)] > UNDAMPED * mode.omega;
        let shifts: &[f64] = if damped { &[-2.0, -1.0, 0.0, 1.0, 2.0] } else { &[-2.0, -1.0, 1.0, 2.0] };
        grid.extend(shifts.iter().map(|s| mode.omega * (1.0 + s * half)).filter(|omega| *omega <= end));
    }
    // an undamped resonance has no height
    let bare = |j: usize| model.damping[(j, j)] <= UNDAMPED * model.modes[j].omega;
    let undamped: Vec<f64> = (0..model.modes.len()).filter(|j| bare(*j)).map(|j| model.modes[j].omega).collect();
    grid.retain(|omega| undamped.iter().all(|own| (omega / own - 1.0).abs() > 0.5 * NARROW));
    grid.sort_by(f64::total_cmp);
    grid
}

/// Largest relative deviation, and where: row, port, frequency (Hz). `all` is the model with every mode that is known.
fn deviation(
    model: &ReducedModel,
    all: &ReducedModel,
    grid: &[f64],
    answers: &[DMatrix<Complex<f64>>],
) -> (f64, (String, String, f64)) {
    let (r, p) = (model.rows(), model.ports.len());
    let seen = DMatrix::from_fn(r, p, |row, q| {
        grid.iter().zip(answers).any(|(omega, exact)| exact[(row, q)].norm() > UNSEEN * all.reach(*omega)[(row, q)])
    });
    let mut worst = (0.0, (String::new(), String::new(), 0.0));
    for (omega, exact) in grid.iter().zip(answers) {
        bimorph_base::budget::check();
        let Some(y) = model.response(*omega) else { return (f64::INFINITY, worst.1) };
        let (parts, reach) = (all.parts(*omega), all.reach(*omega));
        for row in 0..r {
            for q in 0..p {
                let size = exact[(row, q)].norm().max(ZERO * parts[(row, q)]).max(UNSEEN * reach[(row, q)]);
                let off = (y[(row, q)] - exact[(row, q)]).norm() / size;
                if seen[(row, q)] && size > 0.0 && (off > worst.0 || off.is_nan()) {
                    let place = (model.row_name(row).to_owned(), model.ports[q].name.clone(), omega / TAU);
                    worst = (if off.is_nan() { f64::INFINITY } else { off }, place);
                }
            }
        }
    }
    worst
}

/// Largest relative deviation of spectral densities.
fn noise_deviation(model: &ReducedModel, noise: &LinearNoise, grid: &[f64], exact: &[Vec<f64>]) -> f64 {
    let mut worst = 0.0f64;
    for (omega, exact) in grid.iter().zip(exact) {
        bimorph_base::budget::check();
        let Some(found) = noise.densities(model, *omega) else { return f64::INFINITY };
        let off = found.iter().zip(exact).filter(|(_, exact)| **exact > 0.0);
        worst = off.map(|(found, exact)| (found / exact - 1.0).abs()).fold(worst, f64::max);
    }
    worst
}

impl ExactDevice {
    fn new(compiled: &Arc<CompiledModel>, request: &ExportRequest) -> Result<(Self, DVector<f64>), ExportError> {
        let mut device = LocalDevice::new(Arc::clone(compiled));
        let named = port_names(compiled, request)?;
        let mut ports: Vec<String> = named.iter().map(|(name, _)| name.clone()).collect();
        // a port that is not one of the model may have a voltage
        let more = request.bias.iter().map(|(name, _)| name).filter(|name| !named.iter().any(|(n, _)| n == *name));
        let mut more: Vec<String> = more.cloned().collect();
        more.dedup();
        ports.append(&mut more);
        let signals = request.signals.iter().map(|(name, _)| name.clone()).collect();
        let opened = device.open(&OpenRequest { ports: ports.clone(), signals, noise: None })?;
        let scales: Vec<PortScale> =
            opened.ports.iter().zip(&named).map(|(port, (_, across))| PortScale::new(port.kind, *across)).collect();
        let volts = |name: &String| request.bias.iter().rev().find(|(n, _)| n == name).map_or(0.0, |(_, v)| *v);
        let voltages: Vec<f64> = ports.iter().map(volts).collect();
        let mut reply = TrialReply::default();
        let trial = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &voltages };
        device.trial(&trial, &mut reply)?;
        let token = match (reply.token, reply.status) {
            (Some(token), Status::Ok) => token,
            (_, status) => {
                let detail = if let Status::Fail(text) = status { text } else { "no answer".into() };
                return Err(bimorph_analysis::AnalysisError::NoEquilibrium {
                    detail,
                    coarse: Vec::new(),
                    overbent: false,
                }
                .into());
            }
        };
        let signals: Vec<f64> = request.signals.iter().map(|(_, scale)| *scale).collect();
        let answered = scales.iter().zip(&reply.currents).map(|(scale, x)| scale.answered * x);
        let shown = signals.iter().zip(&reply.outputs).map(|(scale, x)| scale * x);
        // −0 is written as 0
        let at_rest = DVector::from_iterator(scales.len() + signals.len(), answered.chain(shown).map(|x| x + 0.0));
        Ok((Self { device, token, scales, signals, opened: ports.len(), jumped: reply.jumped }, at_rest))
    }

    /// The exact Δy/Δu in the scales of the circuit.
    fn response(&mut self, omega: f64) -> Result<DMatrix<Complex<f64>>, ExportError> {
        bimorph_base::budget::check();
        let mut small = SmallSignal::default();
        self.device.linearize(self.token, omega, &mut small)?;
        let p = self.scales.len();
        bimorph_base::budget::lay_out_matrix(2 * (p + self.signals.len()), p);
        Ok(DMatrix::from_fn(p + self.signals.len(), p, |row, q| {
            let ([re, im], scale) = match row.checked_sub(p) {
                None => (small.admittance[row * self.opened + q], self.scales[row].answered),
                Some(k) => (small.outputs[k * self.opened + q], self.signals[k]),
            };
            Complex::new(re, im) * (scale * self.scales[q].given)
        }))
    }

    /// The exact spectral density of each row in the scales of the circuit.
    fn noise(&mut self, omega: f64) -> Result<Vec<f64>, ExportError> {
        bimorph_base::budget::check();
        let mut found = Vec::new();
        self.device.noise(self.token, omega, &mut found)?;
        let (p, answers) = (self.scales.len(), self.opened + self.signals.len());
        let of_port = (0..p).map(|k| (k, self.scales[k].answered));
        let of_signal = self.signals.iter().enumerate().map(|(k, scale)| (self.opened + k, *scale));
        Ok(of_port.chain(of_signal).map(|(k, scale)| found[k * answers + k][0] * scale * scale).collect())
    }

    /// How much of what is there at its resonance each mode is, at the port or signal that sees it best (1).
    fn shares(&mut self, model: &ReducedModel) -> Result<Vec<f64>, ExportError> {
        let share = |(j, mode): (usize, &super::linear::ReducedMode)| {
            // beside an undamped resonance, which has no answer itself
            let omega =
                if model.damping[(j, j)] > UNDAMPED * mode.omega { mode.omega } else { mode.omega * (1.0 + NARROW) };
            let (exact, reach) = (self.response(omega)?, model.reach(omega));
            let mut most = 0.0f64;
            for row in 0..model.rows() {
                for q in 0..model.ports.len() {
                    let size = exact[(row, q)].norm();
                    if size > UNSEEN * reach[(row, q)] {
                        most = most.max(model.share_of(omega, row, q, j) / size);
                    }
                }
            }
            Ok(most)
        };
        model.modes.iter().enumerate().map(share).collect()
    }
}
