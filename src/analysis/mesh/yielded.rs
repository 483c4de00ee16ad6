//! The mesh for what yields: permanent strains, compared with those of twice the segments.

use super::super::backbending::{Backbent, backbend};
use super::super::{AnalysisError, PortVoltages};
use super::equilibrium::SMALL;
use super::meshed::{chosen, meshed, on};
use crate::compile::Compiled;
use crate::options::CompileOptions;
use crate::refine::doubling::{self, Output};

/// Share of the tolerance for the strains: the rest is for what comes after them.
const SHARE: f64 = 0.25;

/// A mechanism that was heated too far, on the mesh for its permanent strains.
///
/// # Errors
/// See [`backbend`].
pub(crate) fn backbent_fitted(compiled: &Compiled, voltages: &PortVoltages) -> Result<Backbent, AnalysisError> {
    let mut analyse = |segments: &[usize]| {
        Ok::<_, AnalysisError>(outputs(&backbend(meshed(compiled, segments)?.as_ref(), voltages)?))
    };
    let options = CompileOptions { tol: SHARE * compiled.options.tol, ..compiled.options.clone() };
    let segments = compiled.order.segments.clone();
    let order = match chosen(compiled) {
        true => doubling::estimate(&options, segments, &mut analyse)?,
        false => doubling::fit(&compiled.structure, &options, segments, &mut analyse)?,
    };
    backbend(&on(compiled, order)?, voltages)
}

/// What is compared: strains, to themselves, or to a share of the largest one or of what the arm bears.
fn outputs(found: &Backbent) -> Vec<Output> {
    let largest = found.strains.iter().fold(0.0, |m: f64, (_, strain)| m.max(strain.abs()));
    let one = |((_, strain), bearable): (&(String, f64), &f64)| Output {
        value: *strain,
        scale: strain.abs().max(SMALL * largest.max(*bearable)),
    };
    found.strains.iter().zip(&found.bearable).map(one).collect()
}
