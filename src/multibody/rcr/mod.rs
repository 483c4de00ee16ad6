//! Recursive Coordinate Reduction in relative joint coordinates: the formulation of the paper.
//!
//! | file | what it holds |
//! |---|---|
//! | [`tree`] | the spanning tree and the loops: n coordinates, m constraints |
//! | [`rotary`] | the paper's model: joints that only turn |
//! | `coordinates` | joint coordinates of given poses |
//! | `kinematics` | outward: poses, rates, joint axes, velocity parts |
//! | `closures` | the rows of loop closures and their velocity parts |
//! | `schedule` | who meets whom: fronts, rows passing through, places in the arenas |
//! | `front` | elimination of one body's coordinates, with a loop's row or without |
//! | `general` | the turn of any body |
//! | [`reduction`] | the recursion |
//! | `storage` | what it works in, laid out once |
//! | `singular` | the recursion near singular configurations |
//! | `projection` | positions and rates that fulfil the loops |
//! | `springs` | forces of the joints' springs |
//! | `stages` | the recursion for a stage of an implicit method |
//! | [`scalar`] | what it runs over: one number, or lanes of variants |
//! | `fast` | what is there for speed alone: runs of pins, small fronts, equal subtrees, lanes |

// fixed-size blocks are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

mod closures;
mod coordinates;
mod fast;
mod front;
mod general;
mod kinematics;
mod projection;
pub mod reduction;
pub mod rotary;
pub mod scalar;
mod schedule;
mod singular;
mod springs;
mod stages;
mod storage;
pub mod tree;

pub use fast::Lanes;
pub use reduction::{Reduction, Task};
pub use rotary::Counts;
pub use scalar::Real;
pub use singular::Singularity;
pub use stages::AddedInertia;
pub use tree::{Closure, Link, Linkage, Parent};
