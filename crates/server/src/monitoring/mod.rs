//! Monitoring endpoints of a server: `/metrics`, `/ready` and `/live` over plain HTTP/1.1.
//!
//! | file | what it holds |
//! |---|---|
//! | `http` | the listener and its requests |
//! | `report` | metrics in the text format of Prometheus, and readiness |

pub(super) mod http;
pub(super) mod report;
