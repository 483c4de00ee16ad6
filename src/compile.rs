//! From netlist text to a ready model: netlist → structure → discretize.

use crate::discretize::{DiscretizeError, DiscretizeOptions, Discretized, discretize};
use crate::netlist::{Bundle, Diagnostics, Setting};
use crate::structure::Structure;
use thiserror::Error;

pub use crate::discretize::Junctions;

/// What a compilation may be told. `Default` is the only place where the numbers stand.
#[derive(Debug, Clone, PartialEq)]
pub struct CompileOptions {
    /// Netlist parameters set from outside.
    pub set: Vec<(String, Setting)>,
    /// Highest frequency the model must resolve [Hz]; none: a rule by slenderness. Higher: more segments.
    pub band: Option<f64>,
    /// Relative error aimed at [1], default 1e-3. Smaller: more segments, shorter steps.
    pub tol: f64,
    /// Small displacements about the drawn geometry, as SUGAR.
    pub linear: bool,
    /// Leave out gas damping.
    pub undamped: bool,
    /// How beams meet.
    pub junctions: Junctions,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self { set: Vec::new(), band: None, tol: 1e-3, linear: false, undamped: false, junctions: Junctions::default() }
    }
}

/// A ready model with everything it came from.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// What was drawn.
    pub structure: Structure,
    /// Netlist parameters with the values they took.
    pub parameters: Vec<(String, Setting)>,
    /// Warnings of the netlist.
    pub warnings: Diagnostics,
    /// The options it was compiled with.
    pub options: CompileOptions,
    /// Bodies, joints, gaps and electrics, and where the drawing's parts went.
    pub parts: Discretized,
}

/// Why no model came out.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CompileError {
    /// The netlist has errors.
    #[error("{0}")]
    Netlist(Diagnostics),
    /// The structure cannot be made into a model.
    #[error(transparent)]
    Structure(#[from] DiscretizeError),
}

/// Compiles a netlist.
///
/// # Errors
/// See [`CompileError`].
pub fn compile(bundle: &Bundle, options: &CompileOptions) -> Result<Compiled, CompileError> {
    let loaded = crate::netlist::load(bundle, &options.set).map_err(CompileError::Netlist)?;
    let choices = DiscretizeOptions {
        band: options.band,
        tol: options.tol,
        linear: options.linear,
        undamped: options.undamped,
        junctions: options.junctions,
    };
    let parts = discretize(&loaded.structure, &choices)?;
    Ok(Compiled {
        structure: loaded.structure,
        parameters: loaded.parameters,
        warnings: loaded.warnings,
        options: options.clone(),
        parts,
    })
}
