//! The service from outside: every call over a real socket, on port 0 or a temporary path.
#![cfg(feature = "server")]

mod announced_sizes;
mod attached;
mod attacks;
mod calls;
mod client_cancellation;
mod device_channel;
mod earlier_clients;
mod echo;
mod fairness;
mod faulty_server;
mod fuzz;
mod in_process;
mod inherited_jobs;
mod jobs;
mod leases;
mod limits;
mod listening;
mod network_faults;
mod paths;
mod quotas;
mod random_requests;
mod rejected_requests;
mod runs;
mod same_bits;
mod serve_process;
mod session_faults;
mod shutdown;
mod slow_readers;
mod snapshots;
mod soak;
mod stored_jobs;
mod stored_sessions;
mod sweep_faults;
mod test_server;
mod valid_requests;
