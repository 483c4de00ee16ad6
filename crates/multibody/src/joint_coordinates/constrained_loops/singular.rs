//! The same reduction where loops come near singular configurations: hard rows, heavy rows, and a front that stays bounded.
//!
//! A straight arm between two pins closes its loop with a pivot of zero. Near it, the reduction hands the base an inertia
//! that grows with 1/ε², and squares what the other directions know away. Here nothing is squared that has grown:
//!
//! - A closure's row is **hard** until a coordinate has been taken out with it.
//! - Eliminating x_e by the hard row ε·x_e + n·a = γ is the articulated-body step as if the row were absent, plus one
//!   more row of weighted least squares on the rest: √D·(c/D − n/ε)·a = …, with D the inertia of the coordinate. It is
//!   kept as a row. While it is light (|n/ε| up to [`LIGHT`]) it is squared into the inertia as usual; a **heavy** one
//!   travels on.
//! - Where heavy rows meet a coordinate, a Householder reflection over them and the coordinate's own row √D takes it out.
//! - Where more rows meet at a body than its front has columns, a QR factorization with the longest rows first brings them
//!   down to that number, so a shuttle with any number of straight arms holds three. A row without length is redundant: it
//!   is counted, with what it contradicts the others by.
//!
//! JSON: "t" (s). "signals": samples by name in SI. "units": by name. "method". "counters": the work done. "events":
//! crossings of --event levels and contacts of gaps, each with its time "t" (s) and "direction" up or down.
//! "formulation". "estimated_error": error of the mesh, and "step_error": error of the steps, both of the amplitude.
//! "stopped_at" (s): with --until. "reliable_until" (s): end of the time in which the tolerance holds after contact
//! (null: to the end), and "after_contact": the statistics of each signal from there on. "joint_coordinates", for rcr:
//! n, m, evaluations near singular configurations, largest gap of a loop (m). Comp. 33, 1979). Compressing rows to the
//! rank of the shuttle is wrong when they are taken as equally hard; weighted by how hard they are it loses nothing.

mod orthogonal;
mod path;
mod row_pool;

pub(super) use row_pool::RowPool;

use super::data::ReductionTask;

/// Ratio up to which a row is squared into the inertia: its square times the rounding unit is lost.
const LIGHT: f64 = 30.0;
/// A hard row shorter than this fraction of a closure's own rows is zero: it is lost in rounding.
const ZERO: f64 = 1e-11;
/// The same in a projection. A gap that only a thousandfold motion could close is left until the mechanism has moved on:
/// at the crossing of two branches such a correction would choose one at random.
const IDLE: f64 = 1e-3;

/// Diagnostics of a reduction near a singular configuration.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Singularity {
    /// Constraint rows that no coordinate could take at their own loop, passed inward.
    pub passed: usize,
    /// Largest number of heavy rows that travelled together.
    pub heavy: usize,
    /// Constraints that others imply.
    pub redundant: usize,
    /// Largest contradiction between a redundant constraint and the others [m/s², or the unit of the task].
    pub contradiction: f64,
}

impl ReductionTask {
    /// Length below which a hard row is zero, see [`ZERO`] and [`IDLE`].
    fn zero(self) -> f64 {
        if self == Self::Accelerations { ZERO } else { IDLE }
    }
}
