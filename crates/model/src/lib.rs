//! From a structure to a compiled model: options, discretisation, and choice of the mesh.
//!
//! **Architecture invariant.** Below are [`bimorph_solve`], [`bimorph_domains`] and [`bimorph_netlist`]. A
//! [`compile::CompiledModel`] never changes. Within the crate the order is [`options`], [`discretize`], [`refine`],
//! [`compile`](mod@compile).

pub mod compile;
pub mod discretize;
pub mod options;
pub mod refine;
