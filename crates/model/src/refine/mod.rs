//! How fine a model must be: the error of a mesh is estimated, and beams are refined or coarsened until a tolerance holds.
//!
//! | file | what it holds |
//! |---|---|
//! | [`mode_errors`] | the errors of modes, from the next term of the beams' own dynamic stiffness |
//! | `reference` | the modes by the beams' own mass |
//! | `span` | a beam over the points of what is cut of it |
//! | [`axial`] | the axial force that each beam carries |
//! | [`mesh_search`] | the mesh for every mode in a band |
//! | `mesh_target` | the target of a mesh, and the chosen mesh |
//! | `band_modes` | evaluation of one mesh: its modes in the band and their errors |
//! | `rigid_beams` | beams whose strain does not matter |
//! | [`lowest_modes`] | the mesh for the lowest modes, by their number |
//! | [`doubling`] | the mesh for whatever an analysis gives: compared with one of twice the segments |
//! | [`transfer`] | a state of one mesh on another |
//! | [`imperfection`] | a drawing that is not quite as drawn |
//! | `groups` | beams that are alike, and which of them to refine |

pub mod axial;
mod band_modes;
pub mod batch_mode_errors;
pub mod doubling;
mod groups;
pub mod imperfection;
pub mod lowest_modes;
pub mod mesh_search;
mod mesh_target;
pub mod mode_errors;
mod reference;
mod rigid_beams;
mod span;
pub mod transfer;
