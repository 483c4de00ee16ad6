//! Frequency responses.

use super::{Violation, named, voltages};
use crate::proto;
use bimorph_analysis::harmonic::grid::Spacing;
use bimorph_analysis::harmonic::{HarmonicOptions, HarmonicResult, Root, SignalResponse};
use bimorph_model::options::analysis::AC_POINTS;
use proto::frequency_response_request::Spacing as Wire;

/// A request as it travels.
pub fn request_to_wire(model: &str, options: &HarmonicOptions) -> proto::FrequencyResponseRequest {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let spacing = match options.spacing {
        Spacing::Logarithmic => Wire::Logarithmic,
        Spacing::PerDecade => Wire::PerDecade,
        Spacing::Linear => Wire::Linear,
    };
    proto::FrequencyResponseRequest {
        model: model.to_owned(),
        drive: options.drive.clone(),
        signals: options.signals.clone(),
        from_hz: options.from,
        to_hz: options.to,
        points: count(options.points),
        spacing: spacing.into(),
        even: options.even,
        by_modes: options.by_modes,
        modes: options.modes.map_or(0, count),
        voltages: named(&options.voltages),
    }
}

/// A request back; its numbers are checked by [`HarmonicOptions::check`].
///
/// # Errors
/// [`Violation`] for a voltage or a spacing that means nothing.
pub fn request_from_wire(wire: proto::FrequencyResponseRequest) -> Result<HarmonicOptions, Violation> {
    let spacing = match Wire::try_from(wire.spacing) {
        Ok(Wire::Logarithmic) => Spacing::Logarithmic,
        Ok(Wire::PerDecade) => Spacing::PerDecade,
        Ok(Wire::Linear) => Spacing::Linear,
        Err(_) => return Err(Violation::new("spacing", format!("expected 0, 1 or 2, got {}", wire.spacing))),
    };
    Ok(HarmonicOptions {
        drive: wire.drive,
        signals: wire.signals,
        from: wire.from_hz,
        to: wire.to_hz,
        points: if wire.points == 0 { AC_POINTS.count() } else { wire.points as usize },
        spacing,
        even: wire.even,
        by_modes: wire.by_modes,
        modes: (wire.modes != 0).then_some(wire.modes as usize),
        voltages: voltages("voltages", wire.voltages)?,
    })
}

fn roots(roots: &[Root]) -> Vec<proto::Root> {
    roots.iter().map(|root| proto::Root { re: root.re, im: root.im }).collect()
}

fn roots_back(roots: Vec<proto::Root>) -> Vec<Root> {
    roots.into_iter().map(|root| Root { re: root.re, im: root.im }).collect()
}

/// A response as it travels.
pub fn result_to_wire(result: &HarmonicResult) -> proto::FrequencyResponseReply {
    let signal = |s: &SignalResponse| proto::SignalResponse {
        name: s.name.clone(),
        unit: s.unit.clone(),
        re: s.values.iter().map(|v| v[0]).collect(),
        im: s.values.iter().map(|v| v[1]).collect(),
        at_rest: s.at_rest,
        zeros: s.zeros.as_deref().map(roots).unwrap_or_default(),
        zeros_known: s.zeros.is_some(),
    };
    proto::FrequencyResponseReply {
        drive_unit: result.drive_unit.clone(),
        frequencies_hz: result.frequencies_hz.clone(),
        signals: result.signals.iter().map(signal).collect(),
        poles: result.poles.as_deref().map(roots).unwrap_or_default(),
        poles_known: result.poles.is_some(),
        points_added: result.added as u64,
        modes: result.modes.unwrap_or(0) as u64,
        modal_error: result.modal_error,
        unknowns: result.unknowns as u64,
        estimated_error: result.estimated_error,
        warnings: result.warnings.clone(),
    }
}

/// A response back.
pub fn result_from_wire(drive: &str, wire: proto::FrequencyResponseReply) -> HarmonicResult {
    let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
    let signal = |s: proto::SignalResponse| SignalResponse {
        name: s.name,
        unit: s.unit,
        values: s.re.into_iter().zip(s.im).map(|(re, im)| [re, im]).collect(),
        at_rest: s.at_rest,
        zeros: s.zeros_known.then(|| roots_back(s.zeros)),
    };
    HarmonicResult {
        drive: drive.to_owned(),
        drive_unit: wire.drive_unit,
        frequencies_hz: wire.frequencies_hz,
        signals: wire.signals.into_iter().map(signal).collect(),
        poles: wire.poles_known.then(|| roots_back(wire.poles)),
        added: size(wire.points_added),
        modes: (wire.modes != 0).then(|| size(wire.modes)),
        modal_error: wire.modal_error,
        unknowns: size(wire.unknowns),
        estimated_error: wire.estimated_error,
        warnings: wire.warnings,
    }
}
