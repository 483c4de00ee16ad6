//! From a structure to a compiled model: options, discretisation, and choice of the mesh.
//!
//! **Architecture invariant.** Below are [`bimorph_solve`] and [`bimorph_domains`]. A model comes from a
//! [`FrontEnd`](bimorph_structure::FrontEnd) and knows no text. A [`compile::CompiledModel`] never changes. Within the crate the order is [`options`], [`discretize`], [`refine`],
//! [`compile`](mod@compile).

pub mod compile;
pub mod discretize;
pub mod options;
pub mod refine;
