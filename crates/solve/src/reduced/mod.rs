//! Reduced models in joint coordinates: s = Φ·z over the joints of a spanning tree.
//!
//! The kinematics of the tree stays exact, so rotations are exact, too, and joints that close loops keep their springs. A few
//! directions Φ therefore suffice where displacements of bodies would need many. Loads, gaps, contact and gas act on the
//! bodies as in the full model; only their generalized forces are m wide.
//!
//! | file | what it holds |
//! |---|---|
//! | [`space`] | the directions, forces over z and their tangent |
//! | [`energy`] | the product in the energy of the tangent at rest, orthonormal vectors in it |
//! | [`inputs`] | what acts on the mechanism, with its range, and the box of all inputs |
//! | [`taylor`] | Taylor terms of the statics at rest over the inputs |
//! | `branches` | equilibria of the full model in the box, also beyond pull-in |
//! | [`training`] | the directions of a mechanism for a box of inputs and a tolerance |
//! | [`statics`] | static equilibrium over z |
//! | [`enrichment`] | directions that a motion lacks, from the full model's corrections along it |
//! | [`check`] | the error of a reduced state, by the residual of the full model |
//! | [`polynomial`] | the model as polynomials of z, for export |
//!
//! References: A. Y. T. Leung and others reduce by derivatives of modes; here the derivatives are those of the statics in the
//! inputs, see S. R. Idelsohn, A. Cardona, "A reduction method for nonlinear structural dynamic analysis", Comput. Methods
//! Appl. Mech. Eng. 49 (1985). Moments at zero frequency: E. J. Grimme, "Krylov projection methods for model reduction" (1997).

mod branches;
pub mod check;
pub mod energy;
pub mod enrichment;
pub mod inputs;
pub mod polynomial;
pub mod space;
pub mod statics;
pub mod taylor;
pub mod training;

pub use inputs::{InputBox, TrainingInput};
pub use space::{ReducedForces, ReducedSpace};
pub use training::{Training, TrainingCase, TrainingOptions, train};

use bimorph_multibody::joint_coordinates::sprung_loops::UnsupportedModel;
use thiserror::Error;

/// Why a system has no reduced model.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReductionError {
    /// Joint coordinates cannot describe it.
    #[error(transparent)]
    Unsupported(#[from] UnsupportedModel),
    /// Its joints are coupled with each other.
    #[error("joints are coupled (--scheme c1), which joint coordinates do not have; take another scheme, or compliant")]
    Coupled,
    /// Its frame turns.
    #[error("the frame turns, and its Coriolis forces are not in a reduced model; take compliant")]
    Turning,
    /// A body moves without resistance, and no static displacement exists.
    #[error("body \"{body}\" moves freely, so loads have no static displacement to expand; take compliant")]
    Free {
        /// Its name.
        body: String,
    },
    /// Nothing acts on it.
    #[error("no load, voltage, heat or acceleration acts on it, so there is nothing to expand in; take compliant")]
    NoInput,
    /// More inputs than Taylor terms of the second order are computed for.
    #[error("{count} independent inputs act on it, more than the {most} of a reduced model; take compliant")]
    TooManyInputs {
        /// How many there are.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// A sample near rest has no equilibrium.
    #[error("at a few percent of the inputs there is no stable equilibrium: {detail}; take compliant")]
    NoSample {
        /// The error of the solver.
        detail: String,
    },
    /// The reduction would not pay.
    #[error("{directions} directions for {strains} strains are more than a fifth; the full model costs less")]
    TooMany {
        /// Directions that the tolerance takes.
        directions: usize,
        /// Strains of the full model.
        strains: usize,
    },
}
