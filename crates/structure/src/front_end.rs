//! Front ends: each language elaborates to a structure, parameters and messages. Nothing after this knows where a
//! drawing came from.

use crate::Structure;
use bimorph_base::{Bundle, Diagnostics, Setting};
use std::fmt::Debug;

/// Result of elaborating a netlist.
#[derive(Debug, Clone)]
pub struct LoadedNetlist {
    /// The drawing.
    pub structure: Structure,
    /// Parameters of the netlist with the values they took, in order of appearance.
    pub parameters: Vec<(String, Setting)>,
    /// Warnings.
    pub warnings: Diagnostics,
}

/// A drawing that has been read in its own language. The structure depends on the values of parameters too.
pub trait FrontEnd: Debug + Send + Sync {
    /// Draws it with parameters set from outside.
    ///
    /// # Errors
    /// Every error found in one run, those of reading too; warnings are among them.
    fn load(&self, set: &[(String, Setting)]) -> Result<LoadedNetlist, Diagnostics>;
}

/// Reads a bundle in one language.
pub type ReadFunction = fn(&Bundle) -> Box<dyn FrontEnd>;
