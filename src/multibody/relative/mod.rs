//! Relative joint coordinates on a spanning tree, loops closed by springs inside the recursion.
//!
//! The same graph, order and elements as in absolute coordinates, with other unknowns: the strains of the joints that a
//! spanning tree takes, each direction free, elastic or locked. What a scene does not need is locked and costs nothing; what
//! closes a loop keeps its springs and brings no constraint, so that no configuration is singular. Mechanisms of rigid loops
//! go to [`rcr`](super::rcr), which reduces their constraints inside the recursion.
//!
//! | file | what it holds |
//! |---|---|
//! | [`tree`] | which body hangs on which, directions that move; closures |
//! | [`number`] | `f64`, or a value with its derivative |
//! | [`kinematics`] | poses, rates and accelerations, root → leaf, and the maps of motion |
//! | `products` | products with those maps |
//! | [`dynamics`] | forces over the coordinates, leaf → root; coordinates of a pose |
//! | [`geometric`] | the stiffness that a force brings |
//! | [`factor`] | factorization of a symmetric form over the coordinates, leaf → root |

pub mod dynamics;
pub mod factor;
pub mod geometric;
pub mod kinematics;
pub mod number;
mod products;
pub mod tree;

pub use factor::JointMatrix;
pub use tree::{Link, Parent, Tree, Unfit};
