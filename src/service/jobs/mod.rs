//! Jobs: what runs while clients come and go.
//!
//! `job_origin` is what a client wanted, and by which name; a `job` has `rows`, which it keeps in a `folder` that outlives the server (`reading`
//! has them from there again), a `job_state`, of which clients are told over the `wire`, and `holders`; the `registry` holds all jobs and hands
//! them out in `pages`, `running` lets them take turns, and `calls`, `legacy_calls` and `streams` are what clients see of them.

mod calls;
mod folder;
mod holders;
mod job;
mod job_origin;
mod job_state;
mod legacy_calls;
mod pages;
#[cfg(test)]
mod power_cuts;
mod reading;
pub(super) mod registry;
mod rows;
mod running;
mod streams;
mod wire;

pub(super) use streams::{JobStream, RowStream, SweepStream, TableStream};
