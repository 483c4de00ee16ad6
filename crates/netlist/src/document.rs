//! Structures from JSON documents, with the checks that every drawing undergoes.

use super::diagnostic_sink::DiagnosticSink;
use super::drawing::StructureBuilder;
use super::source::TextSpan;
use super::value::short;
use super::{check, elements, place};
use bimorph_base::{Bundle, Diagnostics, Setting};
use bimorph_document::{DocumentError, StructureDocument};
use bimorph_structure::{FrontEnd, LoadedNetlist};
use std::sync::Arc;

/// A document that has been read.
#[derive(Debug)]
pub(crate) struct DocumentSource {
    bundle: Arc<Bundle>,
    /// The document with the byte range of each node.
    read: Result<(StructureDocument, Vec<[usize; 2]>), DocumentError>,
}

/// A byte range of the root.
fn span([start, end]: [usize; 2]) -> TextSpan {
    let byte = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
    TextSpan { file: 0, start: byte(start), end: byte(end) }
}

impl DocumentSource {
    pub(crate) fn new(bundle: &Bundle) -> Self {
        let read = StructureDocument::read_with_places(bundle.files.get(&bundle.root).map_or("", String::as_str));
        Self { bundle: Arc::new(bundle.clone()), read }
    }
}

impl FrontEnd for DocumentSource {
    fn load(&self, set: &[(String, Setting)]) -> Result<LoadedNetlist, Diagnostics> {
        let mut sink = DiagnosticSink::new(&self.bundle.root);
        let (document, places) = match &self.read {
            Ok(read) => read,
            Err(fault) => {
                let message = format!("{}: {}", fault.path, fault.message);
                sink.error(fault.code, span(fault.span), message, fault.help.clone());
                return Err(sink.finish(&self.bundle));
            }
        };
        for (name, _) in set {
            let message = format!("a document has no parameter `{name}` to set");
            let help = match document.source.as_str() {
                "" => "its numbers are those that the document holds".to_owned(),
                source => format!("set it where the document is made: `bimorph convert {source} --set {name}=…`"),
            };
            sink.error("E048", TextSpan::NOWHERE, message, help);
        }
        let structure = document.structure.clone();
        let first_named = places.iter().copied().map(span).collect();
        let mut drawing = StructureBuilder::default();
        (drawing.structure, drawing.first_named) = (structure, first_named);
        place_beams(&mut drawing);
        warn_of_long_beams(&drawing, &mut sink);
        elements::material::odd_layers(&mut drawing);
        if !sink.failed() {
            check::finite(&drawing, &mut sink);
        }
        if !sink.failed() {
            place::open_loops(&drawing, &mut sink);
            check::check(&drawing, &mut sink);
        }
        if sink.failed() {
            return Err(sink.finish(&self.bundle));
        }
        let warnings = sink.finish(&self.bundle);
        Ok(LoadedNetlist { structure: drawing.structure, parameters: document.parameters.clone(), warnings })
    }
}

/// Records how each beam places its nodes, at its first node.
fn place_beams(drawing: &mut StructureBuilder) {
    for k in 0..drawing.structure.beams.len() {
        let beam = &drawing.structure.beams[k];
        let (ends, (sin, cos)) = ([beam.a, beam.b], beam.angle.sin_cos());
        let way = [beam.length * cos, beam.length * sin];
        let at = drawing.first_named[beam.a.0];
        drawing.lay(at, &ends, &[[0.0; 2], way]);
    }
}

/// Warns of beams that are too long for a part of a microsystem: their lengths may be in micrometres.
fn warn_of_long_beams(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    for beam in &drawing.structure.beams {
        let longest = beam.length.max(beam.width).max(beam.thickness);
        if longest > elements::LONGEST {
            let message = format!("the beam `{}` is {} m long", beam.name, short(longest));
            let help = "lengths are in metres: 200 micrometres are 200e-6";
            sink.warning("W005", drawing.first_named[beam.a.0], message, help);
        }
    }
}
