//! Budgets of computations, diagnostics with the text that they point into, settings of parameters, suggestions for misspelled names,
//! disjoint sets, and the division of a tolerance.
//!
//! **Architecture invariant.** This crate depends on no other crate of the workspace. It knows neither structures nor
//! models.

pub mod budget;
mod bundle;
mod diagnostic;
mod error_budget;
pub mod sets;
mod setting;
pub mod suggest;

pub use bundle::Bundle;
pub use diagnostic::{Diagnostic, Diagnostics, Severity};
pub use error_budget::ErrorBudget;
pub use setting::Setting;
