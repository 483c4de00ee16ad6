//! Report of a run in joint coordinates beside its signals.

use serde::Serialize;

/// Report of a run in joint coordinates beside its signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointReport {
    /// Generalized coordinates n of the tree.
    pub coordinates: usize,
    /// Independent loop constraints m.
    pub constraints: usize,
    /// n as the paper counts it: every joint a coordinate, one body afloat.
    pub coordinates_uncut: usize,
    /// m as the paper counts it: three for each loop.
    pub constraints_uncut: usize,
    /// Evaluations of the accelerations; each is one recursion.
    pub accelerations: u64,
    /// Evaluations near a singular configuration of the loops.
    pub singular_evaluations: u64,
    /// Largest gap of a loop after a step (m).
    pub largest_gap_m: f64,
    /// Highest natural frequency about the drawn place (Hz); null: nothing is elastic.
    pub highest_frequency_hz: Option<f64>,
}
