//! Head of a document.

/// Value of the field `format`.
pub const FORMAT: &str = "bimorph-structure";

/// Version that is written. Every version from 1 to this one is read.
pub const VERSION: u32 = 1;

/// The only unit system.
pub(crate) const UNITS: &str = "SI";

/// True where a text is a JSON object: no netlist begins with a brace before a quote.
pub fn is_document(text: &str) -> bool {
    let rest = text.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    rest.strip_prefix('{').is_some_and(|rest| rest.trim_start().starts_with(['"', '}']))
}
