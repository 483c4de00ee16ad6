//! Output: tables, ngspice `.raw` files, CSV, and pictures.
//!
//! A [`table::Table`] holds named columns with units. [`csv`] and [`raw`] write it, [`plot`] draws it. Every file is
//! written through [`atomic`]: a reader sees the whole file or none.
//!
//! **Architecture invariant.** Only [`bimorph_structure`] lies below. Tables and pictures know no analysis: they get
//! numbers, names and units.

pub mod atomic;
pub mod csv;
pub mod format;
pub mod parquet;
pub mod plot;
pub mod raw;
pub mod table;
