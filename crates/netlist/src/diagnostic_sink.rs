//! Collects messages while a bundle is read, so that one run reports every error.

use super::source::TextSpan;
use bimorph_base::{Bundle, Diagnostic, Diagnostics, Severity};
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Marks that an error was already put into the [`DiagnosticSink`], so that no further message is needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reported;

/// Most errors, and most lines printed by the netlist; further ones are omitted, since a loop could produce millions.
const MAX_MESSAGES: usize = 100;

/// Warnings of one code beyond this many are left out, so that none hides another.
const MAX_WARNINGS: usize = 20;

/// Code of the last line, which gives the number of omitted messages.
const LEFT_OUT: &str = "W016";
/// Code of what the netlist prints.
const PRINT: &str = "W002";

/// Messages that look for a near name.
const MAX_SUGGESTIONS: usize = 20;

/// Longer messages are cut (byte).
const LONGEST_MESSAGE: usize = 4000;

/// Longer instance names (deep recursion) are cut in messages.
const LONGEST_NAME: usize = 60;

/// The messages of one load.
#[derive(Debug, Clone)]
pub(crate) struct DiagnosticSink {
    /// Names of the files in reading order; [`TextSpan::file`] is an index here.
    pub(crate) files: Vec<String>,
    items: Vec<(TextSpan, Severity, &'static str, String, String)>,
    seen: FxHashSet<(TextSpan, &'static str)>,
    errors: usize,
    /// Errors kept, and by code how many warnings came and how many messages were left out.
    kept_errors: usize,
    warnings: BTreeMap<&'static str, usize>,
    left_out: BTreeMap<&'static str, usize>,
    /// Full names of the subnet instances being built, innermost last.
    pub(crate) instances: Vec<String>,
}

impl DiagnosticSink {
    pub(crate) fn new(root: &str) -> Self {
        Self {
            files: vec![root.to_owned()],
            items: Vec::new(),
            seen: FxHashSet::default(),
            errors: 0,
            kept_errors: 0,
            warnings: BTreeMap::new(),
            left_out: BTreeMap::new(),
            instances: Vec::new(),
        }
    }

    /// Reports an error. The same code at the same place is reported once.
    pub(crate) fn error(
        &mut self,
        code: &'static str,
        span: TextSpan,
        message: String,
        help: impl Into<String>,
    ) -> Reported {
        self.errors += 1;
        self.push(Severity::Error, code, span, message, help.into());
        Reported
    }

    /// Reports a warning. The same code at the same place is reported once.
    pub(crate) fn warning(&mut self, code: &'static str, span: TextSpan, message: String, help: impl Into<String>) {
        self.push(Severity::Warning, code, span, message, help.into());
    }

    /// Records output of the netlist itself (`call print`): never merged with other messages.
    pub(crate) fn output(&mut self, code: &'static str, span: TextSpan, message: String) {
        if self.room(Severity::Warning, code) {
            self.items.push((span, Severity::Warning, code, cut(message), String::new()));
        }
    }

    /// Whether messages still search for similar names, which visits every known name.
    pub(crate) fn suggests(&self) -> bool {
        self.items.len() - self.warnings.get(PRINT).map_or(0, |n| MAX_MESSAGES.min(*n)) < MAX_SUGGESTIONS
    }

    /// True once an error was reported.
    pub(crate) fn failed(&self) -> bool {
        self.errors > 0
    }

    fn push(&mut self, severity: Severity, code: &'static str, span: TextSpan, message: String, mut help: String) {
        let repeated = span != TextSpan::NOWHERE && !self.seen.insert((span, code));
        if repeated || !self.room(severity, code) {
            return;
        }
        if let Some(instance) = self.instances.last() {
            if !help.is_empty() {
                help.push_str("; ");
            }
            let name: String = instance.chars().take(LONGEST_NAME).collect();
            let dots = if name.len() < instance.len() { "…" } else { "" };
            help.push_str(&format!("seen in the subnet instance `{name}{dots}`"));
        }
        self.items.push((span, severity, code, cut(message), cut(help)));
    }

    /// Counts a message; false where it is one too many of its kind.
    fn room(&mut self, severity: Severity, code: &'static str) -> bool {
        let (count, most) = match severity {
            Severity::Error => (&mut self.kept_errors, 2 * MAX_MESSAGES),
            Severity::Warning if code == PRINT => (self.warnings.entry(code).or_default(), MAX_MESSAGES),
            Severity::Warning => (self.warnings.entry(code).or_default(), MAX_WARNINGS),
        };
        *count += 1;
        let room = *count <= most;
        if !room {
            *self.left_out.entry(code).or_default() += 1;
        }
        room
    }

    /// The last line, where messages were left out.
    fn left_out(&self) -> Option<Diagnostic> {
        let more: Vec<String> = self.left_out.iter().map(|(code, count)| format!("{count} more of {code}")).collect();
        let help = "the first of each kind are shown; mend those and look again";
        (!more.is_empty()).then(|| Diagnostic::warning(LEFT_OUT, format!("left out: {}", more.join(", ")), help))
    }

    /// All messages in order of place, and how many were left out.
    pub(crate) fn finish(mut self, bundle: &Arc<Bundle>) -> Diagnostics {
        self.items.sort_by_key(|(span, severity, ..)| {
            (span.file.wrapping_add(1), span.start, *severity == Severity::Warning)
        });
        let left_out = self.left_out();
        let files = &self.files;
        let mut items: Vec<Diagnostic> = self
            .items
            .into_iter()
            .map(|(span, severity, code, message, help)| {
                let (file, line, column, width) = in_drawing(bundle, place(files, bundle, span));
                Diagnostic { code: code.to_owned(), severity, file, line, column, width, message, help }
            })
            .collect();
        items.extend(left_out);
        Diagnostics { items, bundle: Arc::clone(bundle) }
    }
}

impl DiagnosticSink {
    /// File and line, from 1, of each span.
    pub(crate) fn lines(&self, bundle: &Bundle, spans: &[TextSpan]) -> Vec<(String, usize)> {
        // line starts of each file, found once
        let starts: Vec<Vec<usize>> = (self.files.iter())
            .map(|name| bundle.files.get(name).map_or("", String::as_str))
            .map(|text| text.match_indices('\n').map(|(at, _)| at + 1).collect())
            .collect();
        let one = |span: &TextSpan| match (self.files.get(usize::from(span.file)), starts.get(usize::from(span.file))) {
            (Some(name), Some(starts)) => (name.clone(), starts.partition_point(|at| *at <= span.start as usize) + 1),
            _ => (bundle.root.clone(), 0),
        };
        spans.iter().map(one).collect()
    }
}

/// A place in a netlist that was made of a layout is one in the drawing, without a line.
fn in_drawing(bundle: &Bundle, at: (String, usize, usize, usize)) -> (String, usize, usize, usize) {
    let (file, line, ..) = &at;
    if bundle.places.is_empty() || *file != bundle.root || *line == 0 {
        return at;
    }
    let place = bundle.places.get(line).map_or("the netlist of the drawing", String::as_str);
    (format!("{file}: {place}"), 0, 0, 0)
}

/// File, line, column and width of a span; the width stops at the end of the first line.
fn place(files: &[String], bundle: &Bundle, span: TextSpan) -> (String, usize, usize, usize) {
    let Some(name) = files.get(usize::from(span.file)) else {
        return (bundle.root.clone(), 0, 0, 0);
    };
    let text = bundle.files.get(name).map_or("", String::as_str);
    let start = floor(text, span.start as usize);
    let end = floor(text, span.end as usize).max(start);
    let before = &text[..start];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
    let marked = text[start..end].split('\n').next().unwrap_or("");
    (name.clone(), line, column, marked.trim_end().chars().count().max(1))
}

/// A message that is not longer than anyone reads.
fn cut(mut message: String) -> String {
    if message.len() > LONGEST_MESSAGE {
        message.truncate(floor(&message, LONGEST_MESSAGE));
        message.shrink_to_fit();
        message.push('…');
    }
    message
}

/// The nearest character boundary at or before `at`.
fn floor(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}
