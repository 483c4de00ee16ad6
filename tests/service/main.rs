//! The service from outside: every call over a real socket, on port 0 or a temporary path.
#![cfg(feature = "server")]

mod announced;
mod attached;
mod attacks;
mod calls;
mod cut;
mod cut_sweeps;
mod cuts;
mod echo;
mod endings;
mod fuzz;
mod inside;
mod jobs;
mod jobs_kept;
mod jobs_left;
mod kept;
mod leases;
mod leaving;
mod limits;
mod lines;
mod listening;
mod lying;
mod neighbours;
mod older;
mod quotas;
mod random;
mod refusals;
mod running;
mod runs;
mod same_bits;
mod slow_readers;
mod snapshots;
mod soak;
mod sound;
mod victim;
