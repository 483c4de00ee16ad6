//! Answers to the requests of the page, one file for each kind.

pub(crate) mod circuit;
pub(crate) mod describe;
pub(crate) mod effects;
pub(crate) mod equilibrium;
pub(crate) mod modes;
pub(crate) mod motion;
pub(crate) mod path;
pub(crate) mod ranges;
pub(crate) mod response;
pub(crate) mod samples;
pub(crate) mod save;

use bimorph_base::Diagnostic;

/// Named values as rows [name, value].
pub(crate) fn rows(named: &[(String, f64)]) -> Vec<(&str, f64)> {
    named.iter().map(|(name, value)| (name.as_str(), *value)).collect()
}

/// Warnings of a model as sentences.
pub(crate) fn sentences(items: &[Diagnostic]) -> Vec<String> {
    items.iter().map(|d| d.message.clone()).collect()
}
