//! Bimorph: behavioural device models of electro-mechanical microsystems, for circuits.
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

pub mod analysis;
pub mod budget;
pub mod compile;
pub mod content;
pub mod cosim;
pub mod device;
pub mod discretize;
pub mod domains;
pub mod equations;
pub mod export;
pub mod input;
pub mod jobs;
pub mod layout;
pub mod multibody;
pub mod netlist;
pub mod options;
pub mod readout;
pub mod refine;
pub mod results;
#[cfg(feature = "remote")]
pub mod service;
mod sets;
pub mod solve;
pub mod structure;
