//! Recursive Coordinate Reduction in relative joint coordinates: the formulation of the paper.
//!
//! | file | what it holds |
//! |---|---|
//! | [`linkage`] | the spanning tree and the loops: n coordinates, m constraints |
//! | [`rotary`] | the paper's model: joints that only turn |
//! | `coordinates` | joint coordinates of given poses |
//! | `motion` | outward: poses, rates, joint axes, velocity parts |
//! | `closure` | the rows of loop closures and their velocity parts |
//! | `schedule` | who meets whom: fronts, rows passing through, places in the arenas |
//! | `turn` | one body's turn, in few bytes |
//! | `slots` | places that serve one user after another |
//! | `front` | elimination of one body's coordinates, with a loop's row or without |
//! | [`reduce`] | the recursion |
//! | `storage` | what it works in, laid out once |
//! | `project` | positions and rates that fulfil the loops |
//! | `elastic` | forces of the joints' springs |
//! | `pins` | runs of pins without loops |
//! | `general` | the turn of any body |
//! | `kernels` | one coordinate and small fronts, in closed form |
//! | `lanes` | the recursion over lanes of variants, in vector instructions |
//! | `subtrees` | subtrees of one mechanism that are equal in structure |
//! | `layout` | how they are laid into packs of eight |
//! | `packs` | their recursion side by side, and what they exchange with the rest |
//! | `singular` | the recursion near singular configurations |
//! | `implicit` | the recursion for a stage of an implicit method |
//! | [`real`] | what it runs over: one number, or lanes of variants |

// fixed-size blocks are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

mod closure;
mod coordinates;
mod elastic;
mod front;
mod general;
mod implicit;
mod kernels;
mod lanes;
mod layout;
pub mod linkage;
mod motion;
mod packs;
mod pins;
mod project;
pub mod real;
pub mod reduce;
pub mod rotary;
mod schedule;
mod singular;
mod slots;
mod storage;
mod subtrees;
mod turn;

pub use implicit::AddedInertia;
pub use linkage::{Closure, Link, Linkage, Parent};
pub use real::{Lanes, Real};
pub use reduce::{Reduction, Task};
pub use rotary::Counts;
pub use singular::Singularity;
