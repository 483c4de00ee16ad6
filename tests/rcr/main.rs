//! Contracts of the recursion in joint coordinates.

mod accelerations;
mod benchmarks;
mod dense;
mod kinks;
mod lanes;
mod mechanism;
mod subtrees;
