//! Sweeps: a grid of parameter values over one analysis.

pub mod sweep;
