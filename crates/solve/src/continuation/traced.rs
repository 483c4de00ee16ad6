//! A traced path: its points, what happened at them, and why it ends.

use bimorph_multibody::planar::Pose;

/// A point of the path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// The family's number.
    pub s: f64,
    /// Displacements.
    pub q: Vec<Pose>,
    /// Negative eigenvalues of the tangent: 0 where stable under fixed loads and voltages.
    pub negative: usize,
}

/// Event at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathEvent {
    /// s turns back.
    Fold,
    /// Another path crosses.
    Bifurcation,
}

/// Why a path ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PathEnd {
    /// It reached the last requested s.
    #[default]
    Arrived,
    /// s fell below the lowest requested one.
    TurnedBack,
    /// It lost its stability, and was to end there.
    Unstable,
    /// It has as many points as requested.
    Full,
    /// The next point was not found even with the smallest step.
    Lost,
    /// The progress callback of [`Continuation::trace`](super::Continuation::trace) stopped it.
    Stopped,
}

/// A traced path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TracedPath {
    /// Its points; folds and bifurcations are among them.
    pub points: Vec<PathPoint>,
    /// Events, with the indices of their points.
    pub events: Vec<(PathEvent, usize)>,
    /// Points of events that were not located to rounding: the path was lost between its points there.
    pub rough: Vec<usize>,
    /// Points of bifurcations where no branch was found, so that the path goes straight on.
    pub stayed: Vec<usize>,
    /// Why it ends.
    pub end: PathEnd,
    /// Newton iterations, each with one factorization.
    pub iterations: usize,
}
