//! The last steps of every front end of netlists.

use super::diagnostic_sink::DiagnosticSink;
use super::drawing::StructureBuilder;
use super::{check, elements, place};
use bimorph_base::{Bundle, Diagnostics, Setting};
use bimorph_structure::LoadedNetlist;
use std::sync::Arc;

/// Final steps of every front end: out-of-plane members, positions of nodes, checks for loose ends.
pub(super) fn finish(
    mut drawing: StructureBuilder,
    parameters: Vec<(String, Setting)>,
    mut sink: DiagnosticSink,
    bundle: &Arc<Bundle>,
) -> Result<LoadedNetlist, Diagnostics> {
    elements::upright::settle(&mut drawing, &mut sink);
    if !sink.failed() {
        place::place(&mut drawing, &mut sink);
    }
    if !sink.failed() {
        check::finite(&drawing, &mut sink);
    }
    if !sink.failed() {
        check::check(&drawing, &mut sink);
    }
    if sink.failed() {
        return Err(sink.finish(bundle));
    }
    let warnings = sink.finish(bundle);
    Ok(LoadedNetlist { structure: drawing.structure, parameters, warnings })
}
