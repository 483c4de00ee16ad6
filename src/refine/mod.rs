//! How fine a model must be: the error of a mesh is estimated, and beams are refined or coarsened until a tolerance holds.
//!
//! | file | what it holds |
//! |---|---|
//! | [`order_error`] | the errors of modes, from the next term of the beams' own dynamic stiffness |
//! | `reference` | the modes by the beams' own mass |
//! | `span` | a beam over the points of what is cut of it |
//! | [`axial`] | the axial force that each beam carries |
//! | [`model_order`] | the mesh for every mode in a band |
//! | `aim` | what a mesh is for, and what was chosen |
//! | `look` | one mesh looked at: its modes in the band and their errors |
//! | `rigid_beams` | beams whose strain does not matter |
//! | [`counted`] | the mesh for the lowest modes, by their number |
//! | [`doubling`] | the mesh for whatever an analysis gives: compared with one of twice the segments |
//! | [`carry`] | a state of one mesh on another |
//! | [`imperfection`] | a drawing that is not quite as drawn |
//! | `groups` | beams that are alike, and which of them to refine |

mod aim;
pub mod axial;
pub mod carry;
pub mod counted;
pub mod doubling;
mod groups;
pub mod imperfection;
mod look;
pub mod model_order;
pub mod order_error;
mod reference;
mod rigid_beams;
pub(crate) mod side_by_side;
mod span;
