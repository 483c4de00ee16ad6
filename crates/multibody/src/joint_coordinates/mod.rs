//! Motion in relative joint coordinates, in two formulations that differ in how loops are closed.
//!
//! Both stand on one spanning tree (`spanning_tree`).
//!
//! | module | loops |
//! |---|---|
//! | [`sprung_loops`] | a joint that closes a loop keeps its springs: no constraint, no singular configuration |
//! | [`constrained_loops`] | loops are rigid, and their constraints are reduced inside the recursion (docs/explanation/recursion.md) |

pub mod constrained_loops;
mod spanning_tree;
pub mod sprung_loops;

pub use spanning_tree::TreeParent;
