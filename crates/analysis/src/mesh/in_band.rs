//! The mesh for a frequency response: it is compared with that of twice the segments at frequencies over the band, and so are the
//! frequencies of the modes within it.
//!
//! An error e affects either a value or the frequency at which it occurs. Next to a sharp resonance a small error of
//! its frequency changes the value there strongly, and next to a zero of the curve the value itself vanishes. The error
//! of a value H is therefore relative to
//! ```text
//! |H| + |dH/d ln f|
//! ```
//! which is e for a curve that is e too high, and e too for one that is shifted by the fraction e. Frequencies next to a
//! resonance of the first mesh are omitted. The frequency of the mode and its contribution to the signal determine the
//! values there. The contribution is compared as well, relative to itself where its peak exceeds the contributions of
//! the other modes. A mode next to a zero has a peak and a zero of its own only where the two are distinct. Modes
//! within a hundredth of one another are taken together, as they may be mixed in any way.
//!
//! The compared responses are sums over the modes to twice the band with static correction: the truncation error is the
//! same on both meshes. With too many modes in the band they are exact, and no modes are compared.

use super::super::harmonic::exact::ExactResponse;
use super::super::harmonic::modal::{self, ModalSum};
use super::super::harmonic::{BEYOND, GUARDS, HarmonicOptions, HarmonicResult, harmonic};
use super::super::reduced::not_reduced;
use super::super::{AnalysisError, ProgressCallback};
use super::equilibrium::static_warnings;
use super::refined::refining;
use super::remeshed::{chosen, meshed, on};
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::DiscretizeError;
use bimorph_model::refine::doubling::{self, Output};
use bimorph_model::refine::mesh_search::{self, Mesh, MeshTarget};
use nalgebra::Complex;
use std::cell::OnceCell;
use std::f64::consts::TAU;
use std::ops::Range;

/// Frequencies that are compared.
const COMPARED: usize = 24;
/// Relative step over which the slope is taken.
const STEP: f64 = 1e-4;
/// Frequencies this near to a resonance are left out, as a fraction.
const NEAR: f64 = 0.02;
/// Signals that are compared at most, and modes.
const MAX_SIGNALS: usize = 32;
const MAX_MODES: usize = 64;
/// Modes are alike whose frequencies differ by a smaller fraction.
const ALIKE: f64 = 0.01;
/// Modes below this fraction of the highest λ are rigid motions.
const RIGID: f64 = 1e-9;
/// Fraction of a mode that rows may see of another by rounding, where both have much the same frequency: 5e-10 were seen.
const SHAPES: f64 = 2e-9;
/// Sizes below this fraction of the largest of a signal over the band are errors of that.
const SMALL: f64 = 1e-9;

/// The response on the mesh that holds the tolerance, which comes with it.
///
/// # Errors
/// See [`AnalysisError`].
pub fn harmonic_fitted(
    compiled: &CompiledModel,
    options: &HarmonicOptions,
    watch: ProgressCallback<'_>,
) -> Result<(CompiledModel, HarmonicResult), AnalysisError> {
    not_reduced(compiled, "ac")?;
    options.check()?;
    let fitted = fitted(compiled, options)?;
    let mut result = harmonic(&fitted, options, watch)?;
    result.estimated_error = fitted.order.estimated_error;
    Ok((fitted, result))
}

/// The model on the mesh for a response.
pub(super) fn fitted(compiled: &CompiledModel, options: &HarmonicOptions) -> Result<CompiledModel, AnalysisError> {
    refining(compiled, |compiled| fitted_from(compiled, options))
}

fn fitted_from(compiled: &CompiledModel, options: &HarmonicOptions) -> Result<CompiledModel, AnalysisError> {
    let fewer = options.with_signals(&options.signals[..options.signals.len().min(MAX_SIGNALS)]);
    // every name is looked up once, whatever is compared
    let exact = ExactResponse::new(compiled, options)?;
    drop(exact);
    let order = order(compiled, &fewer)?;
    let mut fitted = on(compiled, order)?;
    let point = ExactResponse::new(&fitted, options)?.into_point();
    let reported = static_warnings(&fitted, &point);
    fitted.warnings.items.extend(reported);
    Ok(fitted)
}

fn order(compiled: &CompiledModel, options: &HarmonicOptions) -> Result<Mesh, AnalysisError> {
    if compiled.structure.beams.is_empty() {
        return Ok(Mesh { estimated_error: Some(0.0), ..compiled.order.clone() });
    }
    let given = chosen(compiled);
    let start = if given || compiled.options.band.is_some() {
        compiled.order.segments.clone()
    } else {
        for_band(compiled, options)?
    };
    let mut sample: Option<ComparisonGrid> = None;
    let mut analyse = |segments: &[usize]| {
        let model = meshed(compiled, segments)?;
        let sample = match &sample {
            Some(known) => known,
            None => sample.insert(ComparisonGrid::new(&model, options)?),
        };
        sample.outputs(&model, options)
    };
    match given {
        true => doubling::estimate(&compiled.options, start, &mut analyse),
        false => doubling::fit(&compiled.structure, &compiled.options, start, &mut analyse),
    }
}

/// The mesh for the modes up to the end of the band, about the drawing.
fn for_band(compiled: &CompiledModel, options: &HarmonicOptions) -> Result<Vec<usize>, AnalysisError> {
    let detail = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
    let tolerances = vec![compiled.options.errors().modes(); MAX_MODES];
    let aim = MeshTarget { band: options.to, tolerances, rigid: false };
    let order = mesh_search::choose_for(&compiled.structure, &compiled.options, &aim).map_err(detail)?;
    Ok(order.segments.iter().zip(&compiled.order.segments).map(|(a, b)| *a.max(b)).collect())
}

/// Where meshes are compared.
struct ComparisonGrid {
    frequencies: Vec<f64>,
    /// Modes within the band; 0: too many.
    inside: usize,
    /// Modes of a sum.
    modes: usize,
    /// Groups of modes within the band whose frequencies are alike, by the first mesh.
    groups: OnceCell<Vec<Range<usize>>>,
}

impl ComparisonGrid {
    fn new(model: &CompiledModel, options: &HarmonicOptions) -> Result<Self, AnalysisError> {
        let mut exact = ExactResponse::new(model, options)?;
        let count = |times: f64| modal::below(&exact, TAU * options.to * times);
        let (inside, modes) = (count(1.0), count(BEYOND) + GUARDS);
        let inside = if inside <= MAX_MODES { inside } else { 0 };
        let modes = if inside == 0 && count(1.0) > 0 { 0 } else { modes.min(inside + MAX_MODES) };
        let last = (COMPARED - 1) as f64;
        let at = |k: usize| options.from * (options.to / options.from).powf(k as f64 / last);
        let mut frequencies: Vec<f64> = (0..COMPARED).map(at).collect();
        let near =
            |f: f64| modal::below(&exact, TAU * f * (1.0 + NEAR)) != modal::below(&exact, TAU * f * (1.0 - NEAR));
        let apart: Vec<f64> = frequencies.iter().copied().filter(|f| !near(*f)).collect();
        if !apart.is_empty() {
            frequencies = apart;
        }
        frequencies.retain(|f| exact.at(Complex::new(0.0, TAU * f)).is_some());
        Ok(Self { frequencies, inside, modes, groups: OnceCell::new() })
    }

    fn outputs(&self, model: &CompiledModel, options: &HarmonicOptions) -> Result<Vec<Output>, AnalysisError> {
        let mut exact = ExactResponse::new(model, options)?;
        let mut outputs = vec![Output { value: f64::NAN, scale: 1.0 }; self.inside];
        let mut sum = None;
        if self.modes > 0 {
            let found = modal::lowest(exact.system(), exact.about(), &exact.tangent, self.modes)?;
            let frequency = |l: &f64| l.max(0.0).sqrt() / TAU;
            // rigid motions have no frequency of their own
            let scale = |f: f64| f.max(1e-3 * options.to);
            for (output, lambda) in outputs.iter_mut().zip(&found.lambda) {
                *output = Output { value: frequency(lambda), scale: scale(frequency(lambda)) };
            }
            sum = Some(ModalSum::new(&exact, &found)?);
            let inside = &found.lambda[..self.inside.min(found.lambda.len())];
            let highest = found.lambda.last().copied().unwrap_or(0.0);
            self.groups.get_or_init(|| groups(inside, highest));
        }
        // rounding at the tolerance requires no mesh
        let rounding = modal::UNSEEN.max(model.options.errors().size_of(SHAPES));
        if let Some(sum) = &sum {
            (0..exact.rows.len()).for_each(|row| outputs.extend(self.shares(sum, row, rounding)));
        }
        let mut values: Vec<Vec<(Complex<f64>, f64)>> = Vec::new();
        for frequency in &self.frequencies {
            let s = Complex::new(0.0, TAU * frequency);
            let mut at = |s| match &sum {
                Some(sum) => sum.at(s),
                None => exact.at(s),
            };
            let pair = at(s).zip(at(s * (1.0 + STEP)));
            values.push(match pair {
                Some((here, there)) => {
                    let unseen = |row: usize| sum.as_ref().map_or(0.0, |sum| rounding * sum.most(s, row));
                    let one = |(row, (a, b)): (usize, (&Complex<f64>, &Complex<f64>))| {
                        (*a, (a.norm() + (b - a).norm() / STEP).max(unseen(row)))
                    };
                    here.iter().zip(&there).enumerate().map(one).collect()
                }
                None => vec![(Complex::new(f64::NAN, f64::NAN), 1.0); exact.rows.len()],
            });
        }
        for row in 0..exact.rows.len() {
            let most = values.iter().map(|v| v[row].1).filter(|s| s.is_finite()).fold(0.0, f64::max);
            for value in &values {
                let (value, size) = value[row];
                let scale = size.max(SMALL * most).max(f64::MIN_POSITIVE);
                outputs.extend([Output { value: value.re, scale }, Output { value: value.im, scale }]);
            }
        }
        Ok(outputs)
    }

    /// Contributions of the modes within the band to a row, with equal modes combined.
    fn shares(&self, sum: &ModalSum, row: usize, rounding: f64) -> Vec<Output> {
        let groups = self.groups.get().map_or(&[][..], Vec::as_slice);
        let shares: Vec<Complex<f64>> =
            groups.iter().map(|group| group.clone().map(|j| sum.share(row, j)).sum()).collect();
        let output = |(k, share): (usize, &Complex<f64>)| {
            // what the others bring there, above which its peak stands or not
            let level = sum.beside(row, &groups[k]);
            let seen = level * sum.loss(groups[k].start).max(rounding);
            let scale = share.norm().max(seen).max(rounding * sum.most_of(row, groups[k].start)).max(f64::MIN_POSITIVE);
            [Output { value: share.re, scale }, Output { value: share.im, scale }]
        };
        shares.iter().enumerate().flat_map(output).collect()
    }
}

/// Groups of modes that are alike; rigid motions, as they are beside the highest that is known, are in none.
fn groups(lambda: &[f64], highest: f64) -> Vec<Range<usize>> {
    let first = lambda.iter().position(|l| *l > RIGID * highest).unwrap_or(lambda.len());
    let alike = |a: &f64, b: &f64| *b <= (1.0 + ALIKE).powi(2) * a;
    let mut start = first;
    let group = |modes: &[f64]| {
        start += modes.len();
        start - modes.len()..start
    };
    lambda[first..].chunk_by(alike).map(group).collect()
}
