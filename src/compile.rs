//! From netlist text to a ready model: netlist → structure → discretize.

use crate::discretize::{DiscretizeError, DiscretizeOptions, Discretized, Scheme, discretize_with, order};
use crate::netlist::{Bundle, Diagnostics, Setting};
use crate::refine::model_order::{self, ModelOrder};
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
    /// How beams are cut.
    pub scheme: Scheme,
    /// Segments of every beam, whatever band and tolerance say; none: by them.
    pub segments: Option<usize>,
    /// Shear flexibility of beams (Timoshenko). Off by default, as in SUGAR.
    pub shear: bool,
    /// Rotary inertia of the sections of beams. Off by default, as in SUGAR.
    pub rotary_inertia: bool,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            set: Vec::new(),
            band: None,
            tol: 1e-3,
            linear: false,
            undamped: false,
            junctions: Junctions::default(),
            scheme: Scheme::E4,
            segments: None,
            shear: false,
            rotary_inertia: false,
        }
    }
}

impl CompileOptions {
    /// What the discretization needs of them.
    pub fn discretize(&self) -> DiscretizeOptions {
        DiscretizeOptions {
            band: self.band,
            tol: self.tol,
            linear: self.linear,
            undamped: self.undamped,
            junctions: self.junctions,
            scheme: self.scheme,
            segments: self.segments,
            shear: self.shear,
            rotary_inertia: self.rotary_inertia,
        }
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
    /// Segments of each beam, and the error estimated for them where a band was given.
    pub order: ModelOrder,
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
    let choices = options.discretize();
    let order = match (options.band, options.segments) {
        (Some(band), None) => model_order::choose(&loaded.structure, &choices, band)?,
        _ => {
            let segments = order::a_priori(&loaded.structure, &choices)?;
            ModelOrder { segments, estimated_error: None, modes_in_band: 0, passes: 0 }
        }
    };
    let parts = discretize_with(&loaded.structure, &choices, &order.segments)?;
    Ok(Compiled {
        structure: loaded.structure,
        parameters: loaded.parameters,
        warnings: loaded.warnings,
        options: options.clone(),
        parts,
        order,
    })
}
