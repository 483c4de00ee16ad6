//! Why a drawing cannot become a model.

use thiserror::Error;

/// Most segments of all beams together: with bodies, joints and their factors each takes about a kilobyte.
pub const MAX_SEGMENTS: usize = 2_000_000;

/// Why a drawing cannot become a model.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DiscretizeError {
    /// A quantity that must be positive is not.
    #[error("{element}: {quantity} is {value:e}, expected a positive number")]
    NotPositive {
        /// Element name.
        element: String,
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// Sources or ports in a loop.
    #[error("{source_name} closes a loop of ideal voltage sources; remove it or put a resistor in the loop")]
    SourceLoop {
        /// Name of the port or source.
        source_name: String,
    },
    /// Conductances that cannot be computed with.
    #[error(
        "conductances are too large or too small to be computed with: {element} has the largest; check resistances"
    )]
    Conductances {
        /// The element with the smallest resistance.
        element: String,
    },
    /// A heater whose heat cannot leave.
    #[error("{beam} is heated but nothing conducts its heat to an anchor; use beam2det for the beams in between")]
    NoHeatSink {
        /// Name of a beam in that part.
        beam: String,
    },
    /// A gap on a divider of resistances that depend on temperature.
    #[error(
        "the voltage of gap {gap} depends on the temperature of beams with a TCR, such as {beam}; connect both of its sides to ports, \
         sources or ground without such a beam between, or leave `TCR` out"
    )]
    HotGap {
        /// Name of the gap.
        gap: String,
        /// Name of a beam with such a resistance.
        beam: String,
    },
    /// More segments than can be laid out.
    #[error("{segments} segments in all, at most {MAX_SEGMENTS}; take a lower band, a larger tol, or fewer segments")]
    TooFine {
        /// Segments of all beams together.
        segments: usize,
    },
    /// Everything is ground.
    #[error("nothing can move: every node is anchored")]
    NothingMoves,
    /// No elements.
    #[error(
        "nothing is drawn: only layers, subnets and parameters here; name this file in `uses` of a netlist that has elements"
    )]
    NothingDrawn,
}
