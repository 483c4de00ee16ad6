//! Out of the simulator: a model written down for circuit simulators that know nothing of this program.
//!
//! | file | what it holds |
//! |---|---|
//! | [`linear`] | the reduced linear model: modes, static correction, lags of heaters, ports; its response |
//! | [`linear_noise`] | its thermal noise |
//! | [`reduce`], [`basis`] | how it is made of a mechanism at an operating point, and in which directions it moves |
//! | `mechanism` | that mechanism, and what its inputs do there |
//! | [`compare`] | how far it is from the exact small-signal answer, and how many modes that takes |
//! | [`spice`] | it as a subcircuit |
//! | [`verilog_a`] | it as a Verilog-A module |
//! | [`osdi_deck`] | a deck of ngspice around such a module, compiled as OSDI |
//! | [`lumped`] | the whole nonlinear model of rigid parts that only slide |
//! | [`flexible`] | the nonlinear model of flexible parts, trained for ranges of the ports |
//! | `laws`, `comb_laws` | gap functions as text, and that of combs whose fingers lie aside |
//! | [`lumped_spice`], [`lumped_verilog_a`] | the model of rigid parts as a subcircuit and as a module |
//! | [`flexible_verilog_a`] | that of flexible parts as a module |
//! | [`names`], `parts` | pins, and parts of a subcircuit |
//! | [`file`](mod@file), [`model_options`](mod@model_options) | a file with its header, and a summary of the model in it |
//!
//! Voltages across ports and currents into them have the scales of the ngspice plug-in ([`bimorph_device::scale`]), so
//! that a subcircuit replaces an instance pin by pin.
//!
//! **Architecture invariant.** Below are [`bimorph_device`] and [`bimorph_results`]. Nothing here writes files: exports are text.

pub mod basis;
mod comb_laws;
pub mod compare;
#[cfg(test)]
mod expression_values;
pub mod file;
pub mod flexible;
pub mod flexible_verilog_a;
mod laws;
pub mod linear;
pub mod linear_noise;
pub mod lumped;
pub mod lumped_spice;
pub mod lumped_verilog_a;
mod mechanism;
pub mod model_options;
pub mod names;
mod noise_sources;
pub mod osdi_deck;
mod parts;
pub mod reduce;
pub mod spice;
pub mod verilog_a;

pub use linear::ReducedModel;

use bimorph_analysis::AnalysisError;
use bimorph_analysis::readout::ReadoutError;
use bimorph_device::DeviceError;
use thiserror::Error;

/// Request for an export.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportRequest {
    /// Ports with volts per unit of what lies across them, where that is not the default; none: every electrical one.
    pub ports: Vec<(String, Option<f64>)>,
    /// Signals shown as voltages, with volts per unit.
    pub signals: Vec<(String, f64)>,
    /// Voltages of the operating point by port name (V); others are at 0 V.
    pub bias: Vec<(String, f64)>,
    /// Modes to keep; none: as many as `within` takes.
    pub count: Option<usize>,
    /// Highest frequency that the model is for (Hz); none: that of the second mode that ports and signals see.
    pub to: Option<f64>,
    /// Largest relative deviation from the exact small-signal answer, of a nonlinear model from the equilibria in its ranges (1).
    pub within: f64,
    /// Range of what is given to each port by name, in its unit (V, N, W, …), for which a nonlinear model of flexible parts is made; others
    /// are at 0.
    pub ranges: Vec<(String, [f64; 2])>,
}

impl ExportRequest {
    /// Largest relative deviation by default (1).
    pub const WITHIN: f64 = 1e-4;
    /// The same of a nonlinear model of flexible parts (1).
    pub const NONLINEAR_WITHIN: f64 = 1e-3;
    /// Smallest one that can be requested (1); the largest is below 1.
    pub const MIN_WITHIN: f64 = 1e-9;
    /// Most modes that can be requested.
    pub const MAX_COUNT: usize = 1000;
}

impl Default for ExportRequest {
    /// Every electrical port, all at 0 V.
    fn default() -> Self {
        let (ports, signals, bias) = (Vec::new(), Vec::new(), Vec::new());
        Self { ports, signals, bias, count: None, to: None, within: Self::WITHIN, ranges: Vec::new() }
    }
}

impl From<ReadoutError> for ExportError {
    fn from(error: ReadoutError) -> Self {
        match error {
            ReadoutError::UnknownSignal { .. } | ReadoutError::BadExpression { .. } => Self::Analysis(error.into()),
            ReadoutError::UnknownPort { .. } | ReadoutError::BadPort { .. } | ReadoutError::BadRange { .. } => {
                Self::Device(error.into())
            }
        }
    }
}

/// Why nothing can be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The operating point or its modes cannot be had.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A port or signal cannot be had.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// There is nothing to connect.
    #[error(
        "the netlist has no ports, and none is given: add one with `NAME port * [node] []`, or name NODE.x with --ports"
    )]
    NoPorts,
    /// A port that a linear model with constant coefficients cannot have.
    #[error(
        "port \"{port}\": the rate of a frame couples motions by its own value and its rate of change, which the written \
         model does not have; leave it out, or use the plug-in"
    )]
    Turning {
        /// Its name.
        port: String,
    },
    /// A port that moves an anchor, or an anchor that turns.
    #[error(
        "the anchor at \"{node}\" is driven or turned (moves, anchorrz), which the written model does not have; leave it out, or use the plug-in"
    )]
    DrivenAnchor {
        /// Its node.
        node: String,
    },
    /// A resistance that the written models do not have.
    #[error(
        "beam \"{beam}\" has properties that depend on temperature (curves, TCR, TCK, TCC, emissivity) or a substrate or anchors at another one than ambient, which the written models do not have; leave them out, or use the plug-in"
    )]
    HotResistance {
        /// Its name.
        beam: String,
    },
    /// The equilibrium is unstable.
    #[error(
        "the equilibrium at these voltages is unstable in {negative} direction(s): a linear model about it would grow \
         without bound; choose another --port voltage"
    )]
    Unstable {
        /// Directions in which it is.
        negative: usize,
    },
    /// No number of modes is enough.
    #[error(
        "{modes} modes come within {error:.1e} of the exact small-signal answer up to {to:.4e} Hz, not within {within:.1e}; \
         lower --to, raise --within, or name --count"
    )]
    NotReached {
        /// Modes tried.
        modes: usize,
        /// Largest deviation (1).
        error: f64,
        /// Up to (Hz).
        to: f64,
        /// The requested tolerance (1).
        within: f64,
    },
    /// The nonlinear form is one of rigid parts that slide.
    #[error(
        "--nonlinear without --range writes rigid parts that only slide, on linear springs, but {why}; give --verilog-a or --osdi and the \
         --range of a port for a reduced model, leave --nonlinear out for the linear one about an operating point, or use the plug-in"
    )]
    NotLumped {
        /// The reason.
        why: String,
    },
    /// No polynomials for what acts.
    #[error(
        "--nonlinear writes no reduced model of this mechanism: {why}; leave --nonlinear out for the linear model about an operating \
         point, or use the plug-in"
    )]
    NotFlexible {
        /// The reason, with a way out where there is one.
        why: String,
    },
    /// A range of what is no port of the file.
    #[error("--range: \"{name}\" is no port of the file, which has {ports}; name one of them, or add it with --ports")]
    BadRange {
        /// The given name.
        name: String,
        /// The ports.
        ports: String,
    },
    /// Two names would be the same in the file.
    #[error("\"{first}\" and \"{second}\" would both be called {name} in the file; leave one out")]
    SameName {
        /// First of them.
        first: String,
        /// Second of them.
        second: String,
        /// Their common name.
        name: String,
    },
    /// A name that files cannot have.
    #[error("--name: expected a letter, then letters, digits and _, and no word of Verilog-A, got \"{got}\"")]
    BadName {
        /// The given value.
        got: String,
    },
}
