//! Relative joint coordinates on a spanning tree, loops closed by springs inside the recursion.
//!
//! The same graph, order and elements as in absolute coordinates, with other unknowns: the strains of the joints that a
//! spanning tree takes, each direction free, elastic or locked. Unused directions are locked and cost nothing. A joint
//! that closes a loop keeps its springs and adds no constraint, so that no configuration is singular. Mechanisms of
//! rigid loops go to [`constrained_loops`](super::constrained_loops), which reduces their constraints inside the
//! recursion.
//!
//! | file | what it holds |
//! |---|---|
//! | [`tree`] | parents of bodies, moving directions; closures |
//! | [`kinematics`] | kinematics of a body relative to its parent, and the maps of motion |
//! | [`poses`] | poses, rates and accelerations, root → leaf, eight bodies per vector |
//! | [`acceleration_change`] | the change of accelerations with coordinates and rates |
//! | [`derivatives`] | the change of where bodies are, over values with their derivatives |
//! | [`columns`] | blocks and vectors in registers |
//! | [`dynamics`] | forces over the coordinates, leaf → root; coordinates of a pose |
//! | [`loops`] | forces of the joints that close loops |
//! | [`geometric`] | the stiffness that a force brings |
//! | [`factor`] | factorization of a symmetric form over the coordinates, leaf → root |
//! | [`solve`] | solves with its factors |
//! | [`directions`] | many motions of the coordinates at once |

pub mod acceleration_change;
pub mod columns;
pub mod derivatives;
pub mod directions;
pub mod dynamics;
pub mod factor;
pub mod geometric;
pub mod kinematics;
pub mod loops;
pub mod poses;
pub mod solve;
pub mod tree;

pub use factor::JointMatrix;
pub use tree::{Tree, TreeJoint, UnsupportedModel};
