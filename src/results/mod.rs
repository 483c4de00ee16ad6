//! Output: tables, ngspice `.raw` files, CSV, and pictures.
//!
//! A [`table::DeviceTable`] holds named columns with units. [`csv`] and [`raw`] write it, [`plot`] draws it. Every file is
//! written through [`atomic`]: a reader sees the whole file or none.

pub mod atomic;
pub mod csv;
pub mod format;
pub mod parquet;
pub mod plot;
pub mod raw;
pub mod table;
