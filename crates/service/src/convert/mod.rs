//! Between the wire and the library: the only place that knows both kinds of type.
//!
//! Library to wire never fails. Wire to library checks everything a client could get wrong and says it as a
//! [`Violation`] with the path of the field.

pub mod analysis;
pub mod device;
pub mod export;
pub mod harmonic;
pub mod model;
pub mod options;
pub mod path;
pub mod run;
mod samples;
pub mod sweep;

use super::proto;
use std::collections::HashSet;

/// A field of a request that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// Path of the field ("options.tol"), or place in a netlist ("bank.net:12:7").
    pub field: String,
    /// The fault and the expected value.
    pub description: String,
}

impl Violation {
    /// A violation of one field.
    pub fn new(field: impl Into<String>, description: impl Into<String>) -> Self {
        Self { field: field.into(), description: description.into() }
    }
}

/// A number that must be finite, and positive where `positive`.
pub(crate) fn number(field: &str, value: f64, positive: bool) -> Result<f64, Violation> {
    if value.is_finite() && (!positive || value > 0.0) {
        return Ok(value);
    }
    let expected = if positive { "a positive number" } else { "a finite number" };
    Err(Violation::new(field, format!("expected {expected}, got {value}")))
}

/// A message that must be there.
pub(crate) fn required<T>(field: &str, value: Option<T>) -> Result<T, Violation> {
    value.ok_or_else(|| Violation::new(field, "is missing"))
}

/// Named values, as voltages travel.
pub(crate) fn named(values: &[(String, f64)]) -> Vec<proto::Named> {
    values.iter().map(|(name, value)| proto::Named { name: name.clone(), value: *value }).collect()
}

/// Named values back, unchecked: they come from our own server.
pub(crate) fn pairs(values: Vec<proto::Named>) -> Vec<(String, f64)> {
    values.into_iter().map(|named| (named.name, named.value)).collect()
}

/// Port voltages of a request: finite, each port once.
pub(crate) fn voltages(field: &str, values: Vec<proto::Named>) -> Result<Vec<(String, f64)>, Violation> {
    let mut seen = HashSet::with_capacity(values.len());
    for (i, named) in values.iter().enumerate() {
        if !named.value.is_finite() {
            number(&format!("{field}[{i}]"), named.value, false)?;
        }
        if !seen.insert(named.name.as_str()) {
            return Err(Violation::new(format!("{field}[{i}]"), format!("port \"{}\" is given twice", named.name)));
        }
    }
    Ok(pairs(values))
}
