//! What a formulation makes of a system: its unknowns, and how equations over them are solved.
//!
//! | file | what it holds |
//! |---|---|
//! | [`joints`] | relative joint coordinates: a tree, and the system of what is left to the bodies |

pub mod joints;

pub use joints::Joints;
