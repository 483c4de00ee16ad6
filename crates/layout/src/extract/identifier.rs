//! Names of the netlist language.

use crate::lines::RESERVED;

/// A text as a name of the netlist language: other characters than letters and digits become `_`; none where nothing is left.
pub(super) fn identifier(text: &str) -> Option<String> {
    let mut name: String =
        text.trim().chars().take(64).map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !name.bytes().any(|b| b.is_ascii_alphanumeric()) {
        return None;
    }
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || RESERVED.contains(&name.as_str()) {
        name.insert_str(0, "n_");
    }
    Some(name)
}
