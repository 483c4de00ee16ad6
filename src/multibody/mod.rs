//! Rigid bodies, flexible joints, and the O(n+m) recursion over them.
//!
//! A [`Model`] never changes while it is stepped: bodies lie in elimination order, every block of the tangent has its
//! place, and one `Arc<Model>` serves any number of sessions. A [`State`] is what a snapshot holds; everything else can be
//! computed again from the two.
//!
//! | file | what it holds |
//! |---|---|
//! | [`order`] | the leaf → root elimination order of the body graph |
//! | [`pattern`] | where each block of the factor lies, fill of the loops included, and the update schedule |
//! | [`factor`] | symmetric block factorization and solve, generic over scalar and block size |
//! | [`planar`] | everything that knows a plane from space: poses, points on bodies, joint strains and their derivatives |
//! | [`model`] | bodies, joints, dampers: the immutable model and the mutable state |
//! | [`forces`] | elastic forces, energy and tangent of a model at a configuration |

pub mod factor;
pub mod forces;
pub mod model;
pub mod order;
pub mod pattern;
pub mod planar;

pub use factor::{BlockMatrix, Scalar};
pub use model::{Body, BodyId, Damper, Joint, Model, State};
pub use pattern::Pattern;
