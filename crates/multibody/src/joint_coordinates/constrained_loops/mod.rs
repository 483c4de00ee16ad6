//! Recursive Coordinate Reduction in relative joint coordinates: the formulation of the paper.
//!
//! Constant and variable data are separate, and each algorithm over them has a file:
//!
//! | file | what it holds |
//! |---|---|
//! | [`tree`] | the spanning tree and the loops: n coordinates, m constraints |
//! | [`rotary`] | the paper's model: joints that only turn |
//! | `coordinates` | joint coordinates of given poses |
//! | `schedule` | symbolic phase: front of each body, constraint rows passing it, arena offsets |
//! | `mechanism` | constant data: geometry and inertia over lanes, and the schedule |
//! | `poses` | poses and rates of bodies, and offsets from their parents |
//! | `data` | variable data: input of a reduction beside the mechanism, and its workspace |
//! | `kinematics` | outward: poses, rates, joint axes, velocity parts |
//! | `closures` | the rows of loop closures and their velocity parts |
//! | `front` | elimination of one body's coordinates, with a loop's row or without |
//! | `general` | the turn of any body |
//! | `pin` | the turn of a body on a pin that no loop passes |
//! | `recursion` | turn after turn, inward and outward |
//! | `reduction` | [`Reduction`]: loads in, accelerations out, with all that a run needs |
//! | `traversal` | its passes over the bodies: one after the other, or as its number says |
//! | `singular` | the recursion near singular configurations |
//! | `projection` | positions and rates that fulfil the loops |
//! | `stages` | the recursion for a stage of an implicit method |
//! | `springs` | forces of the joints' springs |
//! | `fast` | bit-identical optimizations: runs of pins, small fronts, equal subtrees, wide instructions |
//!
//! A file names those above it. Beside that, `schedule` and `traversal` ask `fast`, and `reduction` holds the room of `singular`.

// fixed-size blocks are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

mod closures;
mod coordinates;
mod data;
mod fast;
mod front;
mod general;
mod kinematics;
mod mechanism;
mod pin;
mod poses;
mod projection;
mod recursion;
mod reduction;
pub mod rotary;
mod schedule;
mod singular;
mod springs;
mod stages;
mod traversal;
pub mod tree;

pub use data::ReductionTask;
pub use reduction::{Reduction, Traversed};
pub use rotary::CoordinateCounts;
pub use singular::Singularity;
pub use stages::AddedInertia;
pub use tree::{Closure, Linkage, LinkageBody};
