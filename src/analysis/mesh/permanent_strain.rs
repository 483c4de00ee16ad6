//! The mesh for what yields: permanent strains, compared with those of twice the segments.

use super::super::backbending::{BackbentMechanism, Strains, backbend};
use super::super::statics::StaticResult;
use super::super::{AnalysisError, BeamMotions, PortVoltages};
use super::equilibrium::{SMALL, static_fitted};
use super::remeshed::{chosen, meshed, remeshed, warn_of_mesh};
use crate::compile::CompiledModel;
use crate::options::CompileOptions;
use crate::refine::doubling::{self, Output};

/// Fraction of the tolerance for the strains: the rest is for what comes after them.
const STRAIN_TOLERANCE_FRACTION: f64 = 0.25;

/// Where a mechanism rests at `voltages` after its ports were raised to `raised` once: the model, the equilibrium, the displacement of
/// points along every beam, and permanent strains by name.
///
/// The mesh holds the tolerance for the strains and for the equilibrium; the estimate is the sum of both errors.
///
/// # Errors
/// See [`backbend`].
pub fn static_backbent(
    compiled: &CompiledModel,
    raised: &PortVoltages,
    voltages: &PortVoltages,
) -> Result<(CompiledModel, StaticResult, BeamMotions, Strains), AnalysisError> {
    let bent = backbent_fitted(compiled, raised)?;
    let of_strains = bent.compiled.order.estimated_error;
    let (mut fitted, mut result, curves) = static_fitted(&bent.compiled, voltages)?;
    let both = fitted.order.estimated_error.zip(of_strains).map(|(a, b)| a + b);
    (fitted.order.estimated_error, result.estimated_error) = (both, both);
    warn_of_mesh(&mut fitted);
    Ok((fitted, result, curves, bent.strains))
}

/// A mechanism that was heated too far, on the mesh for its permanent strains.
///
/// # Errors
/// See [`backbend`].
fn backbent_fitted(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<BackbentMechanism, AnalysisError> {
    let mut known = Vec::new();
    let mut analyse = |segments: &[usize]| {
        let bent = backbend(meshed(compiled, segments)?.as_ref(), voltages)?;
        let outputs = outputs(&bent);
        known.push((segments.to_vec(), bent));
        Ok::<_, AnalysisError>(outputs)
    };
    let options = CompileOptions { tol: STRAIN_TOLERANCE_FRACTION * compiled.options.tol, ..compiled.options.clone() };
    let segments = compiled.order.segments.clone();
    let order = match chosen(compiled) {
        true => doubling::estimate(&options, segments, &mut analyse)?,
        false => doubling::fit(&compiled.structure, &options, segments, &mut analyse)?,
    };
    match known.into_iter().find(|(segments, _)| *segments == order.segments) {
        Some((_, bent)) => Ok(BackbentMechanism { compiled: remeshed(&bent.compiled, order)?, ..bent }),
        None => backbend(&remeshed(compiled, order)?, voltages),
    }
}

/// Compared outputs: strains, relative to themselves, to a fraction of the largest one, or to the yield strain of the
/// arm.
fn outputs(found: &BackbentMechanism) -> Vec<Output> {
    let largest = found.strains.iter().fold(0.0, |m: f64, (_, strain)| m.max(strain.abs()));
    let one = |((_, strain), bearable): (&(String, f64), &f64)| Output {
        value: *strain,
        scale: strain.abs().max(SMALL * largest.max(*bearable)),
    };
    found.strains.iter().zip(&found.bearable).map(one).collect()
}
