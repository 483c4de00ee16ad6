//! Messages about a netlist, with the line they point at.

use super::bundle::Bundle;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use std::sync::Arc;

/// Of longer lines only the part around the mark is shown (bytes).
const LONGEST_LINE: usize = 1000;

/// How bad a diagnostic is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// No model results.
    Error,
    /// The result stands, but the author may have meant something else.
    Warning,
}

/// One message about a place in a netlist.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable code ("E012", "W003"); docs/reference/codes.md lists them.
    pub code: String,
    /// Error or warning.
    pub severity: Severity,
    /// File, as spelled; of a layout with layer and place in the drawing.
    pub file: String,
    /// Line, from 1; 0 when the message is about no place in the text (a setting from outside, a layout).
    pub line: usize,
    /// Column in characters, from 1; 0 when there is no place.
    pub column: usize,
    /// Width of the marked text in characters.
    pub width: usize,
    /// The fault and the expected input.
    pub message: String,
    /// A remedy; empty where there is none to suggest.
    pub help: String,
}

impl Diagnostic {
    /// A warning about no place in the text.
    pub fn warning(code: &str, message: String, help: &str) -> Self {
        Self {
            code: code.into(),
            severity: Severity::Warning,
            file: String::new(),
            line: 0,
            column: 0,
            width: 0,
            message,
            help: help.into(),
        }
    }
}

/// Every message of one load, with the texts they point into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// Messages in order of place.
    pub items: Vec<Diagnostic>,
    /// The text they point into.
    pub bundle: Arc<Bundle>,
}

impl Diagnostics {
    /// No message about `bundle`.
    pub fn none(bundle: &Bundle) -> Self {
        Self { items: Vec::new(), bundle: Arc::new(bundle.clone()) }
    }

    /// The messages as text with source line and caret.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        let mut out = String::new();
        for item in &self.items {
            crate::budget::check();
            out.push_str(&renderer.render(&self.groups(item)));
            out.push('\n');
        }
        out
    }

    /// True when at least one message is an error.
    pub fn has_errors(&self) -> bool {
        self.items.iter().any(|d| d.severity == Severity::Error)
    }

    fn groups<'a>(&'a self, item: &'a Diagnostic) -> Vec<Group<'a>> {
        let level = match item.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let title = level.primary_title(item.message.as_str()).id(item.code.as_str());
        let mut group = match self.line_of(item) {
            Some((text, range)) => title.element(
                Snippet::source(text)
                    .path(item.file.as_str())
                    .line_start(item.line)
                    .annotation(AnnotationKind::Primary.span(range)),
            ),
            // a place in a drawing has no line
            None if item.line == 0 && !self.bundle.places.is_empty() && item.file != self.bundle.root => {
                Group::with_title(title).element(Origin::path(item.file.as_str()))
            }
            None => Group::with_title(title),
        };
        if !item.help.is_empty() {
            group = group.element(Level::HELP.message(item.help.as_str()));
        }
        vec![group]
    }

    /// The marked line and the byte range marked in it.
    fn line_of(&self, item: &Diagnostic) -> Option<(&str, std::ops::Range<usize>)> {
        let text = self.bundle.files.get(&item.file)?;
        let line = text.split('\n').nth(item.line.checked_sub(1)?)?.trim_end_matches('\r');
        let offset = |column: usize| line.char_indices().nth(column).map_or(line.len(), |(i, _)| i);
        let first = item.column.saturating_sub(1);
        let marked = offset(first)..offset(first + item.width);
        if line.len() <= LONGEST_LINE {
            return Some((line, marked));
        }
        let from = offset(first.saturating_sub(LONGEST_LINE / 4));
        let to = offset(first + LONGEST_LINE / 2);
        Some((&line[from..to], marked.start - from..marked.end.min(to) - from))
    }
}

impl std::fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Diagnostics {}
