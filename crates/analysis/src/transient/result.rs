//! Result of a transient: sampled signals, crossings of levels, and the work.

use crate::reduced::Directions;
use bimorph_solve::time::event::Direction;
use bimorph_solve::time::method::SolverCounters;
use serde::Serialize;

/// A signal that crossed a level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrossingEvent {
    /// Name of the signal; of a gap that closes or opens, its `GAP.gap`.
    pub signal: String,
    /// The level, in the signal's unit.
    pub level: f64,
    /// When (s).
    pub t: f64,
    /// Which way.
    pub direction: Direction,
    /// True where the contact force of a gap begins (down) or ends (up) to act.
    pub contact: bool,
}

/// The largest stress on the faces of a beam, in proportion to the strengths of the layers where they have one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StressMaximum {
    /// The beam.
    pub beam: String,
    /// Stress (Pa).
    pub stress_pa: f64,
    /// When (s).
    pub t: f64,
    /// Strength of its layer (Pa).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength_pa: Option<f64>,
}

/// Statistics of a signal over the part of a run whose single values do not hold, by windows of equal length.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statistics {
    /// Name of the signal.
    pub signal: String,
    /// From when (s).
    pub from: f64,
    /// To when (s).
    pub to: f64,
    /// Mean over that time, in the signal's unit.
    pub mean: f64,
    /// Half of its 95 % confidence interval.
    pub mean_error: f64,
    /// Root mean square about the mean.
    pub rms: f64,
    /// Lowest sample.
    pub low: f64,
    /// Highest sample.
    pub high: f64,
}

/// Sampled signals.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TransientResult {
    /// Times (s).
    pub t: Vec<f64>,
    /// Samples of each signal, in the requested order: (name, unit, values).
    pub signals: Vec<(String, String, Vec<f64>)>,
    /// Work done.
    pub counters: SolverCounters,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Largest estimated relative error by the mesh (1); none without an estimate.
    pub estimated_error: Option<f64>,
    /// Estimated root mean square error of the worst signal by the steps in time, of its amplitude (1); none without an estimate, see
    /// [`step_error`](crate::step_error).
    pub step_error: Option<f64>,
    /// Change of the amplitude by the energy that the steps took from the motion (1); none without an estimate.
    #[serde(skip)]
    pub damped: Option<f64>,
    /// When [`super::TransientOptions::until`] ended the run (s).
    pub stopped_at: Option<f64>,
    /// Time up to which the tolerance holds (s); none: to the end. See [`super::super::after_contact`].
    pub reliable_until: Option<f64>,
    /// Statistics of each signal after that.
    pub after_contact: Vec<Statistics>,
    /// Requested crossings and contacts of gaps, in order of time.
    pub events: Vec<CrossingEvent>,
    /// The largest stress of the run, where a layer has a strength or a shock acts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_stress: Option<StressMaximum>,
    /// The formulation that `auto` took, with the reason; none where another was requested, see
    /// [`with_step_error`](crate::step_error::with_step_error).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formulation_taken: Option<String>,
    /// Warnings about the result.
    pub warnings: Vec<String>,
    /// Directions for the next run in a reduced model.
    #[serde(skip)]
    pub directions: Option<Directions>,
}
