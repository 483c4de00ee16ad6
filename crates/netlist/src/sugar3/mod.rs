//! SUGAR 3 netlists: Lua programs that draw by calls, `beam3d {A, B; material=p1, l=100u, w=2u}`.
//!
//! [`translate`] makes SUGAR 3's dialect of Lua 4 into Lua 5.4; [`evaluate`] runs it in a sandbox whose functions build the same
//! elements as a SUGAR 2 netlist does, with the same messages. docs/reference/sugar.md describes the language. Without the feature `lua`
//! such a netlist is refused (E005).

#[cfg(feature = "lua")]
mod arguments;
#[cfg(feature = "lua")]
mod build;
#[cfg(feature = "lua")]
mod builtins;
#[cfg(feature = "lua")]
mod evaluate;
#[cfg(feature = "lua")]
mod files;
#[cfg(feature = "lua")]
mod instance;
#[cfg(feature = "lua")]
mod language;
#[cfg(feature = "lua")]
mod sandbox;
#[cfg(feature = "lua")]
mod state;
#[cfg(any(feature = "lua", test))]
mod translate;
mod words;

#[cfg(feature = "lua")]
pub(crate) use evaluate::Sugar3;
pub(crate) use words::uses_of;
