//! Values given to netlist parameters from outside.

/// A value given to a netlist parameter from outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// A number, SI.
    Number(f64),
    /// A string.
    Text(String),
}
