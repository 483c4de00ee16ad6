//! Jobs: what runs while clients come and go.
//!
//! `asked` is what a client wanted, and by which name; a `job` has `rows`, which it keeps in a `folder` that outlives the server (`reading`
//! has them from there again), a `standing`, of which clients are told over the `wire`, and `holders`; the `registry` holds all jobs and hands
//! them out in `pages`, `running` lets them take turns, and `calls`, `older` and `streams` are what clients see of them.

mod asked;
mod calls;
mod folder;
mod holders;
mod job;
mod older;
mod pages;
#[cfg(test)]
mod power_cuts;
mod reading;
pub(super) mod registry;
mod rows;
mod running;
mod standing;
mod streams;
mod wire;

pub(super) use streams::{JobStream, RowStream, SweepStream, TableStream};
