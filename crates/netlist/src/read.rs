//! Reading: a bundle is given to the front end of its language.

use super::foreign;
use super::sugar2::Sugar2;
use bimorph_base::{Bundle, Diagnostics, Setting};
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
    if is_program(bundle) { Vec::new() } else { Sugar2::new(bundle).beam_places(set) }
}

/// Reads a bundle by the language of its root: SUGAR 3 where its first line that decides is Lua, else SUGAR 2.
fn read(bundle: &Bundle) -> Box<dyn FrontEnd> {
    #[cfg(feature = "lua")]
    if is_program(bundle) {
        return Box::new(super::sugar3::Sugar3::new(bundle));
    }
    Box::new(Sugar2::new(bundle))
}

/// True when the root is a SUGAR 3 netlist: a program, in Lua.
pub fn is_program(bundle: &Bundle) -> bool {
    let root = bundle.files.get(&bundle.root).map_or("", String::as_str);
    matches!(foreign::kind(root, 0), foreign::FileKind::Lua(_))
}
