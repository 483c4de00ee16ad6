//! Frequency response without a circuit: the response of all requested signals to a small sinusoid at one input, about
//! the operating point.
//!
//! | file | what it holds |
//! |---|---|
//! | `named` | inputs and outputs by name |
//! | `exact` | the response of the whole model at a complex frequency |
//! | `modal` | the same as a sum over modes, with static correction |
//! | `options` | the request |
//! | `root`, `roots` | poles and zeros |
//! | [`grid`] | the frequencies |
//!
//! The mesh for it is chosen by `analysis::mesh`.

pub(crate) mod exact;
pub mod grid;
pub mod modal;
pub(crate) mod named;
mod options;
mod root;
mod roots;

use super::{AnalysisError, ProgressCallback, rotary_inertia_error};
use bimorph_model::compile::CompiledModel;
use exact::ExactResponse;
use modal::ModalSum;
use nalgebra::Complex;
use std::f64::consts::TAU;

pub use options::{HarmonicOptions, MAX_VALUES};
pub use root::Root;

/// Modes within the band beyond which poles, zeros and points about resonances are left out.
const MAX_MODES: usize = 100;
/// Modes are known to this multiple of the band, where they are not too many.
pub(crate) const BEYOND: f64 = 2.0;
/// Modes beyond those, so that the last is apart from what follows.
pub(crate) const GUARDS: usize = 2;
/// Signals whose zeros are looked for at most.
const MAX_ZEROS: usize = 8;
/// Frequencies at which a sum over modes is compared with the exact response.
const COMPARED: usize = 60;
/// Fraction of the sum of its parts below which a value is a zero of the curve.
const ZERO: f64 = 0.01;

/// Response of a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalResponse {
    /// Its name.
    pub name: String,
    /// Its unit over that of the drive.
    pub unit: String,
    /// Value at each frequency, [re, im]; NaN where it has no bound.
    pub values: Vec<[f64; 2]>,
    /// Value at rest; none where nothing holds the mechanism.
    pub at_rest: Option<f64>,
    /// Zeros within the band; none where they were not looked for.
    pub zeros: Option<Vec<Root>>,
}

/// A frequency response.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicResult {
    /// The input.
    pub drive: String,
    /// Its unit.
    pub drive_unit: String,
    /// Frequencies, ascending (Hz).
    pub frequencies_hz: Vec<f64>,
    /// The signals in the requested order.
    pub signals: Vec<SignalResponse>,
    /// Poles within the band; none where they were not looked for.
    pub poles: Option<Vec<Root>>,
    /// Points that were added about resonances and zeros.
    pub added: usize,
    /// Modes of the sum; none: exact.
    pub modes: Option<usize>,
    /// Largest relative deviation of the sum over modes from the exact response; none: it is exact.
    pub modal_error: Option<f64>,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Largest estimated relative error by the mesh, of a value or of the frequency at which it stands; none without an estimate.
    pub estimated_error: Option<f64>,
    /// Warnings about the result.
    pub warnings: Vec<String>,
}

/// The response on the mesh as it is.
///
/// # Errors
/// See [`AnalysisError`].
pub fn harmonic(
    compiled: &CompiledModel,
    options: &HarmonicOptions,
    watch: ProgressCallback<'_>,
) -> Result<HarmonicResult, AnalysisError> {
    options.check()?;
    let band = [options.from, options.to];
    let mut exact = ExactResponse::new(compiled, options)?;
    let mut warnings = warnings(&exact);
    let (inside, wanted) = (modal::below(&exact, TAU * options.to), modal::below(&exact, TAU * BEYOND * options.to));
    let count = options.modes.unwrap_or_else(|| (wanted + GUARDS).min(MAX_MODES));
    let many = inside > MAX_MODES;
    if many {
        warnings.push(format!(
            "{inside} modes lie below {:e} Hz, more than {MAX_MODES}: poles, zeros and points about resonances are left out",
            options.to
        ));
    }
    let sum = match many && !options.by_modes {
        true => None,
        false => {
            let found = modal::lowest(
                exact.system(),
                (&exact.point.q, &exact.drive),
                &exact.tangent,
                count.max(if many { 0 } else { inside + 1 }),
            )?;
            warnings.extend(rotary_inertia_error::rotary_inertia_note(
                compiled,
                &found.shapes[..inside.min(found.shapes.len())],
            ));
            let shown = if options.by_modes { found.lambda.len().min(count.max(1)) } else { found.lambda.len() };
            let mut kept = found;
            kept.lambda.truncate(shown);
            kept.shapes.truncate(shown);
            Some(ModalSum::new(&exact, &kept)?)
        }
    };
    let poles = sum.as_ref().filter(|_| !many).map(|sum| {
        let (poles, rough) = roots::poles(&mut exact, sum, band);
        if rough > 0 {
            warnings
                .push(format!("{rough} poles did not settle on the whole model: they are those of its lowest modes"));
        }
        poles
    });
    let known = poles.clone().unwrap_or_default();
    let rows = exact.rows.len();
    if rows > MAX_ZEROS && poles.is_some() {
        warnings.push(format!("zeros are those of the first {MAX_ZEROS} signals"));
    }
    let zeros: Vec<Option<Vec<Root>>> = (0..rows)
        .map(|row| {
            let sum = sum.as_ref().filter(|_| poles.is_some() && row < MAX_ZEROS)?;
            Some(roots::zeros(&mut exact, sum, row, band))
        })
        .collect();
    let even = grid::even(options.spacing, options.points, band);
    let shaped = roots::shaping(&known, &zeros);
    let (frequencies_hz, added) = if options.even { (even, 0) } else { grid::with_roots(even, &shaped, band) };
    bimorph_base::budget::lay_out_matrix(frequencies_hz.len(), 2 * exact.rows.len());
    let modal_error = match (&sum, options.by_modes) {
        (Some(sum), true) => Some(deviation(&mut exact, sum, &frequencies_hz, &known)),
        _ => None,
    };
    let (values, lost) = swept(&mut exact, sum.as_ref().filter(|_| options.by_modes), &frequencies_hz, &known, watch)?;
    if let Some(error) = modal_error.filter(|error| *error > compiled.options.errors().requested()) {
        warnings.push(format!(
            "the sum over modes is up to {error:.1e} off the exact response, more than the tolerance {:e}; leave --by-modes away",
            compiled.options.errors().requested()
        ));
    }
    if lost > 0 {
        warnings.push(format!(
            "nothing damps a resonance at {lost} of the frequencies: the response has no bound there, and no value is given"
        ));
    }
    let at_rest = if exact.floats { None } else { exact.at(Complex::from(0.0)) };
    let columns = exact.shown.iter().cloned().zip(values).zip(zeros).enumerate();
    let signals = columns.map(|(row, (((name, unit), values), zeros))| SignalResponse {
        name,
        unit,
        values,
        at_rest: at_rest.as_ref().map(|values| values[row].re),
        zeros,
    });
    Ok(HarmonicResult {
        drive: options.drive.clone(),
        drive_unit: exact.drive_unit.to_owned(),
        frequencies_hz,
        signals: signals.collect(),
        poles,
        added,
        modes: sum.as_ref().filter(|_| options.by_modes).map(|sum| sum.lambda.len()),
        modal_error,
        unknowns: compiled.parts.system.model.unknowns(),
        estimated_error: compiled.order.estimated_error,
        warnings,
    })
}

/// Warnings about the operating point.
fn warnings(exact: &ExactResponse<'_>) -> Vec<String> {
    let mut warnings = Vec::new();
    let model = &exact.system().model;
    let mut factor = exact.tangent.clone();
    model.project_matrix(&mut factor);
    let negative = factor.factor(&model.pattern).map_or(0, |inertia| inertia.negative);
    if negative > 0 && !exact.floats {
        warnings.push(format!(
            "the equilibrium is unstable in {negative} direction(s): what moves there grows, and never settles to this response"
        ));
    }
    if !exact.point.path.passed.is_empty() {
        warnings.push(
            "the part pulled in, snapped or buckled on the way to this operating point: the response is about where it went".into(),
        );
    }
    if exact.floats {
        warnings.push("nothing holds the mechanism in some direction: it has no response at rest".into());
    }
    warnings
}

/// One column of real and imaginary parts for each row.
type ComplexColumns = Vec<Vec<[f64; 2]>>;

/// Every row at every frequency, and at how many there is no bound.
fn swept(
    exact: &mut ExactResponse<'_>,
    sum: Option<&ModalSum>,
    frequencies: &[f64],
    poles: &[Root],
    watch: ProgressCallback<'_>,
) -> Result<(ComplexColumns, usize), AnalysisError> {
    let rows = exact.rows.len();
    let mut columns = vec![Vec::with_capacity(frequencies.len()); rows];
    let mut lost = 0;
    for (k, frequency) in frequencies.iter().enumerate() {
        if !watch(k as f64 / frequencies.len() as f64) {
            return Err(AnalysisError::Cancelled);
        }
        let s = Complex::new(0.0, TAU * frequency);
        let values = match sum {
            _ if grid::unbounded(*frequency, poles) => None,
            Some(sum) => sum.at(s),
            None => exact.beside(s),
        };
        lost += usize::from(values.is_none());
        for (row, column) in columns.iter_mut().enumerate() {
            column.push(values.as_ref().map_or([f64::NAN; 2], |values| [values[row].re, values[row].im]));
        }
    }
    Ok((columns, lost))
}

/// Largest deviation of a sum from the exact response, relative to each value, or to a hundredth of the largest of its signal where it is a zero.
fn deviation(exact: &mut ExactResponse<'_>, sum: &ModalSum, frequencies: &[f64], poles: &[Root]) -> f64 {
    let every = frequencies.len().div_ceil(COMPARED).max(1);
    let usable = frequencies.iter().step_by(every).chain(frequencies.last());
    let mut worst = 0.0f64;
    for frequency in usable.filter(|f| !grid::unbounded(**f, poles)) {
        let s = Complex::new(0.0, TAU * frequency);
        let (Some(values), Some(sums)) = (exact.at(s), sum.at(s)) else { continue };
        for (row, (a, b)) in values.iter().zip(&sums).enumerate() {
            let size = a.norm().max(ZERO * sum.reach(s, row)).max(modal::UNSEEN * sum.most(s, row));
            if size > 0.0 {
                worst = worst.max((a - b).norm() / size);
            }
        }
    }
    worst
}
