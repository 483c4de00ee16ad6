//! The mesh for a static equilibrium: displacements and charges are compared with those of twice the segments.
//!
//! The error of a displacement is relative to the displacement of its node, or to a thirtieth of the largest of the mechanism where a node
//! hardly moves; that of a rotation likewise, and no smaller than what turns the size of the mechanism by a thirtieth of the largest
//! displacement. The finer mesh starts from the state of the coarser one, so that both are on one branch.

use super::super::statics::{OperatingPoint, operating_point, operating_point_near};
use super::super::{AnalysisError, PortVoltages};
use super::{chosen, meshed};
use crate::compile::Compiled;
use crate::refine::carry::carried;
use crate::refine::doubling::{self, Output};
use crate::refine::model_order::ModelOrder;
use std::borrow::Cow;

/// Share of the largest displacement below which errors are relative to that.
const SMALL: f64 = 1.0 / 30.0;

/// The mesh for the equilibrium at these voltages, from `segments` upwards.
pub(super) fn order(
    compiled: &Compiled,
    voltages: &PortVoltages,
    segments: Vec<usize>,
) -> Result<ModelOrder, AnalysisError> {
    if chosen(compiled) {
        return estimated(compiled, voltages, segments);
    }
    let mut known = None;
    let mut analyse = |segments: &[usize]| follow(compiled, voltages, segments, &mut known);
    doubling::fit(&compiled.structure, &compiled.options, segments, &mut analyse)
}

/// A mesh as it is, with the estimate of its error.
pub(super) fn estimated(
    compiled: &Compiled,
    voltages: &PortVoltages,
    segments: Vec<usize>,
) -> Result<ModelOrder, AnalysisError> {
    let mut known = None;
    doubling::estimate(&compiled.options, segments, &mut |segments| follow(compiled, voltages, segments, &mut known))
}

/// A mesh with its equilibrium.
type Known<'a> = Option<(Cow<'a, Compiled>, OperatingPoint)>;

/// The equilibrium on a mesh, next to that of the mesh before.
fn follow<'a>(
    compiled: &'a Compiled,
    voltages: &PortVoltages,
    segments: &[usize],
    known: &mut Known<'a>,
) -> Result<Vec<Output>, AnalysisError> {
    let model = meshed(compiled, segments)?;
    let linear = model.parts.system.model.linear;
    let point = match known {
        None => operating_point(&model, voltages)?,
        Some((before, point)) => {
            let start = carried(&model.structure, &before.parts, &model.parts, &point.q, linear);
            operating_point_near(&model, voltages, start)?
        }
    };
    let outputs = outputs(&model, &point);
    *known = Some((model, point));
    Ok(outputs)
}

/// What is compared.
fn outputs(model: &Compiled, point: &OperatingPoint) -> Vec<Output> {
    let system = &model.parts.system;
    let q = &point.q;
    let nodes = || model.parts.nodes.iter().flatten();
    let shifts = || nodes().map(|p| p.displacement(q, system.model.linear));
    let largest = shifts().map(|u| u.norm()).fold(0.0, f64::max);
    let turned = nodes().map(|p| p.rotation(q).abs()).fold(0.0, f64::max);
    let size = size(model);
    let mut outputs = Vec::new();
    for (point, u) in nodes().zip(shifts()) {
        let scale = u.norm().max(SMALL * largest).max(f64::MIN_POSITIVE);
        let turn = point.rotation(q);
        let turns = turn.abs().max(SMALL * turned).max(SMALL * largest / size).max(f64::MIN_POSITIVE);
        outputs.extend([
            Output { value: u.x, scale },
            Output { value: u.y, scale },
            Output { value: turn, scale: turns },
        ]);
    }
    let electrics = &system.electrics;
    let charge = |p: usize| -> f64 {
        let of = |g: usize| electrics.gap_rows[(g, p)] * system.capacitance(g, q) * point.volts[g];
        (0..point.volts.len()).map(of).sum()
    };
    let charges: Vec<f64> = (0..electrics.ports).map(charge).collect();
    let most = charges.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let scaled = |c: f64| Output { value: c, scale: c.abs().max(SMALL * most).max(f64::MIN_POSITIVE) };
    outputs.extend(charges.into_iter().map(scaled));
    outputs
}

/// The longest beam, which stands for the size of the mechanism [m].
fn size(model: &Compiled) -> f64 {
    model.structure.beams.iter().map(|b| b.length).fold(model.parts.system.length_scale, f64::max)
}
