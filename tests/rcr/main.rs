//! Contracts of the recursion in joint coordinates.

mod accelerations;
mod benchmarks;
mod dense_reference;
mod kinks;
mod lanes;
mod mechanism;
mod subtrees;
