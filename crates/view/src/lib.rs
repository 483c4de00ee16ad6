//! The live bench: one page on which a device moves while its parameters are turned.
//!
//! | module | content |
//! |---|---|
//! | `bench` | the device on the bench: its netlist, options, layout and decks |
//! | `question` | requests of the page |
//! | `answers` | one file for each kind of request |
//! | `answer` | a reply: a JSON head and 32-bit numbers behind it |
//! | `figure` | the drawn geometry as the page draws it |
//! | `channels` | at most one computation for each channel: a newer request stops the older one |
//! | `guard` | token, `Host` and `Origin` of a request |
//! | `server` | HTTP on loopback |
//! | `page` | the page and its scripts |
//! | `export` | pages with answers inside |
//!
//! The page is HTML, one style sheet and the scripts in `page/`, all inside the program. It fetches nothing from elsewhere.
//!
//! **Architecture invariant.** Below are the analyses, sweeps and ngspice runs. Every number on the page comes from the functions that the command calls. The
//! server listens on loopback alone, and a request without its token reaches no analysis.

mod answer;
mod answers;
mod bench;
mod channels;
mod export;
mod figure;
mod guard;
mod page;
mod question;
mod refusal;
mod server;

pub use bench::{Bench, BenchOptions, LayoutGround};
pub use page::SCRIPT_BYTES;
pub use server::{ViewServer, ViewServerError};
