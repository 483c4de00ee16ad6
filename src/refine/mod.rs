//! How fine a model must be: the error of a mesh is estimated, and beams are refined or coarsened until a tolerance holds.
//!
//! | file | what it holds |
//! |---|---|
//! | [`order_error`] | the errors of modes, from the next term of the beams' own dynamic stiffness |
//! | [`axial`] | the axial force that each beam carries |
//! | [`model_order`] | the mesh for every mode in a band |
//! | [`counted`] | the mesh for the lowest modes, by their number |
//! | [`doubling`] | the mesh for whatever an analysis gives: compared with one of twice the segments |
//! | [`carry`] | a state of one mesh on another |
//! | [`imperfection`] | a drawing that is not quite as drawn |
//! | `groups` | beams that are alike, and which of them to refine |

pub mod axial;
pub mod carry;
pub mod counted;
pub mod doubling;
mod groups;
pub mod imperfection;
pub mod model_order;
pub mod order_error;
