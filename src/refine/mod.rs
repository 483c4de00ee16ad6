//! How fine a model must be: the error of a mesh is estimated, and beams are refined or coarsened until a tolerance holds.

pub mod axial;
pub mod imperfection;
pub mod model_order;
pub mod order_error;
