//! Bimorph: behavioural device models of electro-mechanical microsystems, for circuits.
//!
//! This crate is the facade of the workspace: it passes on the public interface of the crates below `crates/`, and holds the command.
//!
//! # Layout
//! Data flows one way. A [`netlist`] describes what was drawn ([`layout`] reads masks); it becomes a [`structure`]
//! (materials, beams, plates, anchors, gaps, combs, ports, all in SI). [`options`] is the one table of the options of a
//! model. `discretize` turns beams into rigid bodies and flexible joints; `multibody` holds those bodies and the O(n+m)
//! recursion over them; `domains` are the forces and rest offsets that heat and voltage cause. `solve` advances or
//! balances a model, [`refine`] chooses the mesh, and [`readout`] finds signals and ports by name. [`analysis`] holds
//! the analyses that all front ends share, and [`device`] is the electrical view for a circuit simulator. [`results`]
//! writes tables and pictures, [`export`] a model for other simulators. [`compile`](mod@compile) walks that path once,
//! from netlist text to a ready model.
//!
//! [`budget`] bounds what a computation may use, and stops it.
//!
//! Everything inside is SI: metres, kilograms, seconds, volts, kelvin, radians. Units are parsed once, in the netlist.

pub use bimorph_analysis::{self as analysis, readout};
pub use bimorph_base::budget;
pub use bimorph_cosim as cosim;
pub use bimorph_device as device;
pub use bimorph_document as document;
pub use bimorph_domains as domains;
pub use bimorph_export as export;
pub use bimorph_jobs::{self as jobs, content};
pub use bimorph_layout::{self as layout, input};
pub use bimorph_model::{discretize, options, refine};
pub use bimorph_multibody as multibody;
pub use bimorph_results as results;
pub use bimorph_solve::{self as solve, equations};
pub use bimorph_structure as structure;

pub mod netlist {
    //! Netlists, and what they share with every front end: bundles, settings and diagnostics.

    pub use bimorph_base::{Bundle, Diagnostic, Diagnostics, Setting, Severity};
    pub use bimorph_netlist::*;
    pub use bimorph_structure::{FrontEnd, LoadedNetlist};
}

pub mod compile {
    //! From netlist text to a ready model: netlist → structure → mesh.

    pub use bimorph_model::compile::*;

    /// Compiles a netlist.
    ///
    /// # Errors
    /// See [`CompileError`].
    pub fn compile(bundle: &super::netlist::Bundle, options: &CompileOptions) -> Result<CompiledModel, CompileError> {
        draw(&super::netlist::NetlistSource::new(bundle), options)?.compile()
    }
}

#[cfg(feature = "server")]
pub use bimorph_view as view;

#[cfg(feature = "remote")]
pub mod service {
    //! The protocol with its clients and, with the feature `server`, the server.

    #[cfg(feature = "server")]
    pub use bimorph_server::*;
    pub use bimorph_wire::*;
}
