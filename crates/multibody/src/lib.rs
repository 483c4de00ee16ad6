//! Rigid bodies, flexible joints, and the O(n+m) recursion over them.
//!
//! A [`Model`] never changes while it is stepped: bodies lie in elimination order, every block of the tangent has its
//! place, and one `Arc<Model>` serves any number of sessions. A [`State`] is what a snapshot holds; everything else can be
//! computed again from the two.
//!
//! | file | what it holds |
//! |---|---|
//! | [`scalar`] | numbers: one, lanes of variants, with derivatives, double-double |
//! | [`order`] | the leaf → root elimination order of the body graph |
//! | [`layout`] | order and pattern of a graph, looked up where it was laid out just before |
//! | [`pattern`] | where each block of the factor lies, fill of the loops included, and the update schedule |
//! | [`factor`] | symmetric block factorization and solve, generic over scalar and block size |
//! | [`planar`] | everything that knows a plane from space: poses, points on bodies, joint strains and their derivatives |
//! | [`sine`] | sine and cosine of small angles, inlined |
//! | [`body`] | a rigid body: name, mass, drag, held directions |
//! | [`section`] | joints as they are stored: properties shared by the joints of one beam, and offsets of their couplings |
//! | [`model`] | bodies, joints, dampers: the immutable model and the mutable state |
//! | [`joint_coordinates`] | the same graph in relative joint coordinates: loops closed by springs or by constraints |
//! | [`batch`] | bodies and joints of eight variants at a time, one variant a lane |
//! | [`agitation`] | the random forces that come with drag and dampers |
//! | [`linear_system`] | K, M and C of a linear frame on one pattern |
//! | [`forces`] | elastic forces, energy and tangent of a model at a configuration |
//! | [`unstressed`] | the stiffness in the present geometry without stress |
//! | [`precise`] | the product of that tangent with a displacement in extended precision |
//!
//! **Architecture invariant.** Only [`bimorph_base`] lies below. Bodies and joints have no voltages, charges or
//! temperatures, and no names of netlist elements.

pub mod agitation;
pub mod batch;
pub mod body;
pub mod factor;
pub mod forces;
pub mod joint;
pub mod joint_coordinates;
pub mod layout;
pub mod linear_system;
pub mod model;
pub mod order;
pub mod pattern;
pub mod planar;
pub mod precise;
pub mod scalar;
pub mod section;
pub mod sine;
pub mod unstressed;

pub use body::{Body, BodyName, Drag};
pub use factor::{BlockMatrix, BodyMatrix, Scalar};
pub use joint::{BodyId, Coupling, Damper, Joint};
pub use model::{Model, ModelOrder, State};
pub use pattern::Pattern;
