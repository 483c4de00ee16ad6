//! The analyses that all front ends share: the command, the service and sweeps call these and nothing below.
//!
//! **Architecture invariant.** Below is [`bimorph_model`]. An analysis knows no device, server, file or terminal. Within
//! the crate [`readout`] stands below the analyses.

pub mod after_contact;
pub mod backbending;
pub mod batch_modes;
pub mod batch_statics;
pub mod batch_transient;
pub mod beam_states;
pub mod chart;
pub mod chosen_run;
pub mod contact_range;
pub mod continuation;
pub mod critical_names;
pub mod formulation;
pub mod frame;
mod gap_shape;
pub mod harmonic;
pub mod integrator;
pub mod joint_transient;
pub mod largest_motion;
mod linear_stress;
mod loose_parts;
pub mod mesh;
pub mod mode_quality;
pub mod modes;
pub mod overheating;
pub mod path_parameter;
pub mod pull_in;
pub mod readout;
pub mod reduced;
mod rotary_inertia_error;
mod sensitivity;
mod stability;
pub mod static_outputs;
pub mod statics;
pub mod step_error;
pub mod transient;
mod weak_parts;

use crate::readout::ReadoutError;
pub use crate::readout::signal;
use serde::Serialize;
use thiserror::Error;

/// Receives the progress of a long analysis, as a fraction 0…1; returns whether to continue.
pub type ProgressCallback<'a> = &'a mut dyn FnMut(f64) -> bool;

/// Why an analysis has no result.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// A port or signal name, or a number, that does not fit this model.
    #[error("{what}: {detail}")]
    BadRequest {
        /// Which option.
        what: String,
        /// The fault and the accepted values.
        detail: String,
    },
    /// No equilibrium was found.
    #[error("no static equilibrium: {detail}")]
    NoEquilibrium {
        /// Where it stopped and why.
        detail: String,
        /// Beams whose segments bent so far there that shorter ones are needed, by index; empty where that is not the reason.
        coarse: Vec<usize>,
        /// True where a beam bends to a radius below half its width, which shorter segments do not change.
        overbent: bool,
    },
    /// The structure can move without any stiffness against it.
    #[error("singular structure: {detail}")]
    Singular {
        /// Which body and direction.
        detail: String,
    },
    /// An integration gave up.
    #[error("transient stopped at t = {t:e} s (dt = {dt:e} s): {detail}")]
    StepFailed {
        /// Time reached (s).
        t: f64,
        /// Step that failed (s).
        dt: f64,
        /// Which body and direction, and why.
        detail: String,
    },
    /// Parts are pressed further into each other than the law of contact knows.
    #[error(
        "gap \"{gap}\" is pressed shut to {left:.3e} m, beyond the range of the law of contact, which ends at {least:.3e} m: \
         nothing bears such a pressure. Lower the voltage or the load, or give the gap the area, or the `touch`, that it has"
    )]
    ContactRange {
        /// Name of the gap.
        gap: String,
        /// Distance that is left (m); negative: through.
        left: f64,
        /// Least distance within the range (m).
        least: f64,
    },
    /// The fingers of a comb lie aside of their gaps under a voltage, where they do not overlap.
    #[error(
        "the fingers of the comb \"{comb}\" do not overlap, and lie {aside:.3e} m aside of the middle of their gaps under a voltage, which leave {room:.3e} m. Lower \
         the voltage or what moves the part across its fingers, make it stiffer across them, or draw wider gaps or a `stop2d` across"
    )]
    SidePullIn {
        /// Name of the comb.
        comb: String,
        /// Distance from the middle of the gaps (m).
        aside: f64,
        /// Distance at which the sides touch (m).
        room: f64,
    },
    /// An iteration did not settle.
    #[error("not converged: {detail}")]
    NotConverged {
        /// The violated limit and its size.
        detail: String,
    },
    /// [`ProgressCallback`] stopped it.
    #[error("cancelled")]
    Cancelled,
}

/// Displacement of a node from its drawn place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct NodeMotion {
    /// Along x (m).
    pub x: f64,
    /// Along y (m).
    pub y: f64,
    /// Rotation about z (rad).
    pub rz: f64,
}

/// Displacement of nodes, by name, in netlist order.
pub type NodeMotions = Vec<(String, NodeMotion)>;

/// Displacement of points along beams, equally spaced, ends included, beam by beam in the order of the structure.
pub type BeamMotions = Vec<Vec<NodeMotion>>;

/// Voltages on ports for a whole analysis: (port name, volts). Ports not named are at 0 V.
pub type PortVoltages = [(String, f64)];

impl From<ReadoutError> for AnalysisError {
    fn from(error: ReadoutError) -> Self {
        match error {
            ReadoutError::UnknownSignal { name, hint } => {
                Self::BadRequest { what: format!("signal \"{name}\""), detail: hint }
            }
            ReadoutError::BadExpression { text, detail } => {
                Self::BadRequest { what: format!("signal \"{text}\""), detail }
            }
            other => Self::BadRequest { what: "ports".into(), detail: other.to_string() },
        }
    }
}

impl From<bimorph_solve::SolveError> for AnalysisError {
    fn from(error: bimorph_solve::SolveError) -> Self {
        use bimorph_solve::SolveError;
        match error {
            SolveError::Singular { .. } => Self::Singular { detail: error.to_string() },
            SolveError::Lost { ref coarse, overbent, .. } => {
                Self::NoEquilibrium { detail: error.to_string(), coarse: coarse.clone(), overbent }
            }
            SolveError::StepTooSmall { t, dt, .. } | SolveError::StepFailed { t, dt, .. } => {
                Self::StepFailed { t, dt, detail: error.to_string() }
            }
            SolveError::Massless { .. } => Self::BadRequest { what: "method".into(), detail: error.to_string() },
        }
    }
}

impl From<bimorph_solve::baseline::TooLarge> for AnalysisError {
    fn from(error: bimorph_solve::baseline::TooLarge) -> Self {
        Self::BadRequest { what: "solver".into(), detail: error.to_string() }
    }
}
