//! Values of parameters as text: expressions of the netlist language.

use super::ast::Statement;
use super::diagnostic_sink::DiagnosticSink;
use super::parser;
use super::read::load;
use super::source::TextSpan;
use bimorph_base::{Bundle, Diagnostics, Setting};
use std::sync::Arc;

/// Reads a value as the netlist language writes it: `2.1u`, `-3`, `pi/4`, `deg(30)`, `'text'`. A bare word that is
/// no constant (`poly`) is a string.
///
/// # Errors
/// The text is no expression of constants.
pub fn parse_setting(text: &str) -> Result<Setting, Diagnostics> {
    let text = text.trim();
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(word) && text != "pi" {
        return Ok(Setting::Text(text.to_owned()));
    }
    // On one line, so that messages show all of it.
    let line = text.replace(['\n', '\r'], " ");
    let percent = line.split(['\'', '"']).step_by(2).any(|part| part.contains('%'));
    let bundle = Bundle::from_text("setting", &format!("param value = {line}"));
    let mut sink = DiagnosticSink::new(&bundle.root);
    if percent {
        // it would begin a comment, and a fraction in percent become one in full
        sink.error("E049", TextSpan::NOWHERE, format!("`{line}` has a `%`"), "write 0.01 for 1 %");
    }
    let program = parser::parse(&bundle, &mut sink);
    if !sink.failed() && !matches!(program.statements.as_slice(), [Statement::Param { .. }]) {
        sink.error("E049", TextSpan::NOWHERE, format!("`{line}` is more than one value"), "give one value");
    }
    if sink.failed() {
        return Err(sink.finish(&Arc::new(bundle)));
    }
    let loaded = load(&bundle, &[])?;
    let value = loaded.parameters.into_iter().next().map(|(_, value)| value);
    value.ok_or_else(|| Diagnostics::none(&bundle))
}
