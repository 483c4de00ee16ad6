//! Models for other simulators.

use super::{Violation, named, options, voltages};
use crate::proto;
use bimorph_export::ExportRequest;
use bimorph_export::file::{ExportedFile, FileContent, FileLanguage, FileRequest, LinearSummary, ReducedSummary};
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::AC_TO;
use proto::export_request::Language;
use proto::export_response::Content;

/// A file of a server.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportReply {
    /// The file.
    pub file: ExportedFile,
    /// Largest estimated relative error by the mesh (1); none without an estimate.
    pub estimated_error: Option<f64>,
}

fn size(n: u64) -> usize {
    usize::try_from(n).unwrap_or(usize::MAX)
}

fn short(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn scaled(name: &str, scale: Option<f64>) -> proto::Scaled {
    proto::Scaled { name: name.to_owned(), scale }
}

/// A request as it travels.
pub fn request_to_wire(model: &str, request: &FileRequest) -> proto::ExportRequest {
    let language = match request.language {
        FileLanguage::Spice => Language::Spice,
        FileLanguage::VerilogA => Language::VerilogA,
    };
    let asked = &request.model;
    proto::ExportRequest {
        model: model.to_owned(),
        language: language.into(),
        nonlinear: request.nonlinear,
        ports: asked.ports.iter().map(|(name, scale)| scaled(name, *scale)).collect(),
        signals: asked.signals.iter().map(|(name, scale)| scaled(name, Some(*scale))).collect(),
        voltages: named(&asked.bias),
        to_hz: asked.to.unwrap_or_default(),
        within: asked.within,
        count: asked.count.map_or(0, short),
        name: request.name.clone().unwrap_or_default(),
        ranges: asked.ranges.iter().map(|(name, range)| port_range(name, *range)).collect(),
    }
}

fn port_range(name: &str, [low, high]: [f64; 2]) -> proto::PortRange {
    proto::PortRange { name: name.to_owned(), low, high }
}

/// Checked ranges of ports.
fn ranges(wire: Vec<proto::PortRange>) -> Result<Vec<(String, [f64; 2])>, Violation> {
    let one = |(i, wire): (usize, proto::PortRange)| {
        let proto::PortRange { name, low, high } = wire;
        if low.is_finite() && high.is_finite() && low < high {
            Ok((name, [low, high]))
        } else {
            Err(Violation::new(
                format!("ranges[{i}]"),
                format!("expected finite numbers, low below high, got {low} and {high}"),
            ))
        }
    };
    wire.into_iter().enumerate().map(one).collect()
}

/// Names with their scales.
fn scales(field: &str, wire: Vec<proto::Scaled>) -> Result<Vec<(String, Option<f64>)>, Violation> {
    let one = |(i, wire): (usize, proto::Scaled)| match wire.scale {
        Some(scale) if !scale.is_finite() || scale == 0.0 => {
            let expected = format!("expected a finite number other than 0, got {scale}");
            Err(Violation::new(format!("{field}[{i}].scale"), expected))
        }
        scale => Ok((wire.name, scale)),
    };
    wire.into_iter().enumerate().map(one).collect()
}

/// A checked request.
///
/// # Errors
/// [`Violation`] for a number out of its range, a language that means nothing, and fields that a nonlinear model does not have.
pub fn request_from_wire(wire: proto::ExportRequest) -> Result<FileRequest, Violation> {
    let language = match Language::try_from(wire.language) {
        Ok(Language::Spice) => FileLanguage::Spice,
        Ok(Language::VerilogA) => FileLanguage::VerilogA,
        Err(_) => return Err(Violation::new("language", format!("expected 0 or 1, got {}", wire.language))),
    };
    let to = match wire.to_hz {
        0.0 => None,
        to => {
            options::analysis(&AC_TO, OptionValue::Number(to))?;
            Some(to)
        }
    };
    let default = if wire.nonlinear { ExportRequest::NONLINEAR_WITHIN } else { ExportRequest::WITHIN };
    let within = if wire.within == 0.0 { default } else { wire.within };
    let least = ExportRequest::MIN_WITHIN;
    if !(least..1.0).contains(&within) {
        return Err(Violation::new(
            "within",
            format!("expected a number of at least {least:e}, below 1, got {within}"),
        ));
    }
    let (count, most) = ((wire.count != 0).then_some(wire.count as usize), ExportRequest::MAX_COUNT);
    if let Some(count) = count.filter(|count| *count > most) {
        return Err(Violation::new("count", format!("expected 1 to {most}, got {count}")));
    }
    let bias = voltages("voltages", wire.voltages)?;
    if wire.nonlinear {
        let given = [("voltages", !bias.is_empty()), ("to_hz", to.is_some()), ("count", count.is_some())];
        if let Some((field, _)) = given.iter().find(|(_, given)| *given) {
            return Err(Violation::new(*field, "expected none with nonlinear: that model has no operating point"));
        }
    } else if !wire.ranges.is_empty() {
        return Err(Violation::new("ranges", "expected none without nonlinear: a linear model has an operating point"));
    }
    let signals = scales("signals", wire.signals)?;
    let model = ExportRequest {
        ports: scales("ports", wire.ports)?,
        signals: signals.into_iter().map(|(name, scale)| (name, scale.unwrap_or(1.0))).collect(),
        bias,
        count,
        to,
        within,
        ranges: ranges(wire.ranges)?,
    };
    let name = (!wire.name.is_empty()).then_some(wire.name);
    Ok(FileRequest { language, nonlinear: wire.nonlinear, name, model })
}

/// A file as it travels.
pub fn reply_to_wire(reply: ExportReply) -> proto::ExportResponse {
    let ExportReply { file, estimated_error } = reply;
    let content = match file.content {
        FileContent::Linear(linear) => Content::Linear(proto::LinearExport {
            numbers: linear.numbers.iter().map(|number| number.map_or(0, short)).collect(),
            frequencies_hz: linear.frequencies_hz,
            quality: linear.quality,
            lags: short(linear.lags),
            error: linear.error,
            from_hz: linear.band_hz[0],
            to_hz: linear.band_hz[1],
            unknowns: linear.unknowns as u64,
        }),
        FileContent::Nonlinear { directions, gaps } => {
            Content::Nonlinear(proto::NonlinearExport { directions: short(directions), gaps: short(gaps) })
        }
        FileContent::Reduced(reduced) => {
            // a positive and a negative pin of each port come first
            let named = reduced.ranges.iter().enumerate().map(|(k, range)| {
                let pin = file.pins.get(2 * k).map_or("", String::as_str);
                port_range(pin.strip_prefix("p_").unwrap_or(pin), *range)
            });
            Content::Reduced(proto::ReducedExport {
                coordinates: short(reduced.coordinates),
                degree: short(reduced.degree),
                strains: reduced.strains as u64,
                lags: short(reduced.lags),
                error: reduced.error,
                compared: short(reduced.compared),
                ranges: named.collect(),
            })
        }
    };
    proto::ExportResponse {
        text: file.text,
        name: file.name,
        pins: file.pins,
        content: Some(content),
        warnings: file.warnings,
        estimated_error,
    }
}

/// A file back.
///
/// # Errors
/// [`Violation`] where its model is missing.
pub fn reply_from_wire(wire: proto::ExportResponse) -> Result<ExportReply, Violation> {
    let content = match super::required("content", wire.content)? {
        Content::Linear(linear) => FileContent::Linear(LinearSummary {
            numbers: linear.numbers.iter().map(|&n| (n != 0).then_some(n as usize)).collect(),
            frequencies_hz: linear.frequencies_hz,
            quality: linear.quality,
            lags: linear.lags as usize,
            error: linear.error,
            band_hz: [linear.from_hz, linear.to_hz],
            unknowns: size(linear.unknowns),
        }),
        Content::Nonlinear(model) => {
            FileContent::Nonlinear { directions: model.directions as usize, gaps: model.gaps as usize }
        }
        Content::Reduced(model) => FileContent::Reduced(ReducedSummary {
            coordinates: model.coordinates as usize,
            degree: model.degree as usize,
            strains: size(model.strains),
            lags: model.lags as usize,
            error: model.error,
            compared: model.compared as usize,
            ranges: model.ranges.iter().map(|range| [range.low, range.high]).collect(),
        }),
    };
    let file = ExportedFile { text: wire.text, name: wire.name, pins: wire.pins, content, warnings: wire.warnings };
    Ok(ExportReply { file, estimated_error: wire.estimated_error })
}

#[cfg(test)]
mod tests {
    //! Requests come back as they were sent; a nonlinear one has no operating point.
    use super::*;

    #[test]
    fn exports_survive_the_wire() {
        let model = ExportRequest {
            ports: vec![("drive".into(), None), ("m.x".into(), Some(1e6))],
            signals: vec![("m.y".into(), 2.0)],
            bias: vec![("drive".into(), 3.0)],
            count: Some(4),
            to: Some(1e5),
            within: 1e-3,
            ranges: Vec::new(),
        };
        let request = FileRequest { language: FileLanguage::VerilogA, name: Some("a".into()), model, nonlinear: false };
        assert_eq!(request_from_wire(request_to_wire("0", &request)), Ok(request.clone()));
        let flexible = ExportRequest { ranges: vec![("drive".into(), [0.0, 20.0])], ..ExportRequest::default() };
        let flexible = FileRequest { nonlinear: true, model: flexible, ..request.clone() };
        assert_eq!(request_from_wire(request_to_wire("0", &flexible)), Ok(flexible.clone()));
        let linear = request_to_wire("0", &FileRequest { nonlinear: false, ..flexible });
        assert_eq!(request_from_wire(linear).map_err(|violation| violation.field), Err("ranges".into()));
        let whole = request_to_wire("0", &FileRequest { nonlinear: true, ..request });
        assert_eq!(request_from_wire(whole).map_err(|violation| violation.field), Err("voltages".into()));
        assert_eq!(request_from_wire(proto::ExportRequest::default()), Ok(FileRequest::default()));
    }
}
