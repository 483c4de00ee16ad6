//! Layouts that clients send, as netlists.

use bimorph_layout::LayoutError;
use bimorph_layout::convert::ConvertError;
use bimorph_layout::flatten::FlattenError;
use bimorph_layout::input;
use bimorph_wire::convert::Violation;
use bimorph_wire::convert::model::bundle_to_wire;
use bimorph_wire::proto;

/// The netlist of a layout that was sent.
///
/// # Errors
/// An invalid layout or process, or a layout without a model.
pub(crate) fn convert(request: &proto::ConvertRequest) -> Result<proto::ConvertResponse, Violation> {
    let given = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    let (process, cell) = (given(&request.process), given(&request.cell));
    let source = input::from_bytes(&request.layout, &request.name, process.as_deref(), cell.as_deref());
    let source = source.map_err(|error| Violation::new(field_of(&error), error.to_string()))?;
    let Some(converted) = source.converted else { return Err(Violation::new("layout", "is a netlist")) };
    let report = converted.report;
    let unrecognised = report.unrecognised.into_iter().map(|piece| {
        let [[left_m, bottom_m], [right_m, top_m]] = piece.box_m;
        let (layer, area_m2, why) = (piece.layer, piece.area_m2, piece.why);
        proto::Unrecognised { layer, area_m2, left_m, bottom_m, right_m, top_m, why }
    });
    Ok(proto::ConvertResponse {
        bundle: Some(bundle_to_wire(&source.bundle)),
        process: converted.process,
        by: report.by,
        drawn_m2: report.areas.drawn_m2,
        extracted_m2: report.areas.extracted_m2,
        anchored_m2: report.areas.anchored_m2,
        unrecognised_m2: report.areas.unrecognised_m2,
        unrecognised: unrecognised.collect(),
        notes: report.notes,
    })
}

/// The field that a conversion's failure is about.
fn field_of(error: &ConvertError) -> &'static str {
    match error {
        ConvertError::Process(_) => "process",
        ConvertError::Layout(LayoutError::Format { .. }) => "name",
        ConvertError::Layout(LayoutError::Flatten(FlattenError::Top { .. })) => "cell",
        _ => "layout",
    }
}
