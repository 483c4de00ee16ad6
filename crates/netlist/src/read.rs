//! Reading: a bundle is given to the front end of its language.

use super::document::DocumentSource;
use super::foreign;
use super::sugar2::Sugar2;
use bimorph_base::{Bundle, Diagnostics, Setting};
use bimorph_document::{StructureDocument, is_document};
use bimorph_structure::{FrontEnd, LoadedNetlist};

/// Parses and elaborates a bundle with parameters set from outside.
///
/// # Errors
/// Every error found in one run; warnings are among them.
pub fn load(bundle: &Bundle, set: &[(String, Setting)]) -> Result<LoadedNetlist, Diagnostics> {
    NetlistSource::new(bundle).load(set)
}

/// A drawing that has been read, in whichever language it is.
#[derive(Debug)]
pub struct NetlistSource {
    front: Box<dyn FrontEnd>,
}

impl NetlistSource {
    /// Reads a bundle. Errors are returned by [`NetlistSource::load`].
    pub fn new(bundle: &Bundle) -> Self {
        Self { front: read(bundle) }
    }

    /// A source that another front end has read.
    pub fn from_front(front: Box<dyn FrontEnd>) -> Self {
        Self { front }
    }
}

impl FrontEnd for NetlistSource {
    fn load(&self, set: &[(String, Setting)]) -> Result<LoadedNetlist, Diagnostics> {
        self.front.load(set)
    }
}

/// File and line, from 1, in which each beam of a SUGAR 2 netlist is drawn, in the order of the structure. Empty for other languages, and where the
/// netlist has errors.
pub fn beam_places(bundle: &Bundle, set: &[(String, Setting)]) -> Vec<(String, usize)> {
    let other = is_document(root_text(bundle)) || is_program(bundle);
    if other { Vec::new() } else { Sugar2::new(bundle).beam_places(set) }
}

/// Reads a bundle by the language of its root: a JSON document where it is an object, SUGAR 3 where its first line that decides is Lua, else SUGAR 2.
fn read(bundle: &Bundle) -> Box<dyn FrontEnd> {
    if is_document(root_text(bundle)) {
        return Box::new(DocumentSource::new(bundle));
    }
    #[cfg(feature = "lua")]
    if is_program(bundle) {
        return Box::new(super::sugar3::Sugar3::new(bundle));
    }
    Box::new(Sugar2::new(bundle))
}

/// True when the root is a SUGAR 3 netlist: a program, in Lua.
pub fn is_program(bundle: &Bundle) -> bool {
    matches!(foreign::kind(root_text(bundle), 0), foreign::FileKind::Lua(_))
}

/// The structure of a bundle as a document, and the warnings about it. A document keeps its own source and parameters.
///
/// # Errors
/// Those of [`load`].
pub fn document(bundle: &Bundle, set: &[(String, Setting)]) -> Result<(StructureDocument, Diagnostics), Diagnostics> {
    let LoadedNetlist { structure, parameters, warnings } = load(bundle, set)?;
    let text = root_text(bundle);
    let kept = if is_document(text) { StructureDocument::read(text).ok() } else { None };
    let source = kept.map_or_else(|| bundle.root.clone(), |document| document.source);
    Ok((StructureDocument { source, parameters, structure }, warnings))
}

fn root_text(bundle: &Bundle) -> &str {
    bundle.files.get(&bundle.root).map_or("", String::as_str)
}
