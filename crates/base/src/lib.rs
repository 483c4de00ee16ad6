//! Budgets of computations, and disjoint sets.
//!
//! **Architecture invariant.** This crate depends on no other crate of the workspace. It knows neither structures nor
//! models.

pub mod budget;
pub mod sets;
