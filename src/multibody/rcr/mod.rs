//! Recursive Coordinate Reduction in relative joint coordinates: the formulation of the paper.
//!
//! What does not move and what does are apart, and each algorithm over them has a file:
//!
//! | file | what it holds |
//! |---|---|
//! | [`tree`] | the spanning tree and the loops: n coordinates, m constraints |
//! | [`rotary`] | the paper's model: joints that only turn |
//! | `coordinates` | joint coordinates of given poses |
//! | `mechanism` | what the recursion reads of a linkage: geometry and inertia over lanes, and the schedule; immutable |
//! | `schedule` | who meets whom: fronts, rows passing through, places in the arenas |
//! | `data` | what changes: loads, poses, rows and fronts on the way, accelerations |
//! | `pair`, `placed` | vectors of the plane; where a body is and how it hangs |
//! | `kinematics` | outward: poses, rates, joint axes, velocity parts |
//! | `closures` | the rows of loop closures and their velocity parts |
//! | [`reduction`] | the recursion inward and outward |
//! | `front` | elimination of one body's coordinates, with a loop's row or without |
//! | `general` | the turn of any body |
//! | `pin` | the turn of a body on a pin that no loop passes |
//! | `singular` | the recursion near singular configurations |
//! | `projection` | positions and rates that fulfil the loops |
//! | `springs` | forces of the joints' springs |
//! | `stages` | the recursion for a stage of an implicit method |
//! | [`scalar`] | what it runs over: one number, or lanes of variants |
//! | `traversal` | how the bodies are gone through |
//! | `fast` | what is there for speed alone, with the same bits: runs of pins, small fronts, equal subtrees, lanes |

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
mod pair;
mod pin;
mod placed;
mod projection;
mod recursion;
mod reduction;
pub mod rotary;
pub mod scalar;
mod schedule;
mod singular;
mod springs;
mod stages;
mod traversal;
pub mod tree;

pub use data::Task;
pub use fast::Lanes;
pub(crate) use fast::has_lanes;
pub use reduction::Reduction;
pub use rotary::Counts;
pub use scalar::Real;
pub use singular::Singularity;
pub use stages::AddedInertia;
pub use tree::{Closure, Link, Linkage, Parent};
