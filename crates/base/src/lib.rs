//! Budgets of computations, diagnostics with the text that they point into, settings of parameters, suggestions for misspelled names, and
//! disjoint sets.
//!
//! **Architecture invariant.** This crate depends on no other crate of the workspace. It knows neither structures nor
//! models.

pub mod budget;
mod bundle;
mod diagnostic;
pub mod sets;
mod setting;
pub mod suggest;

pub use bundle::Bundle;
pub use diagnostic::{Diagnostic, Diagnostics, Severity};
pub use setting::Setting;
