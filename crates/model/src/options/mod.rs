//! Options, defined once: names, units, defaults, ranges and help for the command, the protocol, decks, sweeps, Python
//! and docs/.
//!
//! | file | what it holds |
//! |---|---|
//! | [`model`] | the table of the options of a model |
//! | [`analysis`] | options of single analyses |
//! | [`table`] | description of an option, and the check of a value |
//! | `changed` | the division of the tolerance, and the same options with one of them changed |
//! | `port_ranges` | ranges of ports |
//! | [`choices`] | the names that some options take |

pub mod analysis;
mod changed;
pub mod choices;
pub mod model;
mod port_ranges;
pub mod table;

pub use bimorph_base::ErrorBudget;
pub use choices::{Anchors, Formulation, FringeFields, Junctions, Scheme};
pub use model::{CompileOptions, MODEL, ModelOption};
pub use port_ranges::PortRanges;
pub use table::{OptionDescription, OptionError, OptionValue, Range};
