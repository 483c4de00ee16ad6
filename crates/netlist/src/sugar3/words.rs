//! The words of a SUGAR 3 netlist: Lua 4 with metric suffixes on numbers.

/// Kind of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WordKind {
    Name,
    Number,
    Text,
    Symbol,
}

/// A word and its bytes in the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) kind: WordKind,
    pub(crate) start: usize,
    pub(crate) end: usize,
    /// True for the first word of a line.
    pub(crate) starts_line: bool,
}

/// All words of a text; comments and blanks are left out. Never fails: invalid text is left to Lua.
pub(crate) fn words(text: &str) -> Vec<Word> {
    let bytes = text.as_bytes();
    let peek = |at: usize| bytes.get(at).copied().unwrap_or(0);
    let run = |mut at: usize, wanted: &dyn Fn(u8) -> bool| {
        while at < bytes.len() && wanted(bytes[at]) {
            at += 1;
        }
        at
    };
    let mut out = Vec::new();
    let (mut at, mut starts_line) = (0, true);
    while at < bytes.len() {
        let start = at;
        let byte = bytes[at];
        if byte == b'\n' {
            starts_line = true;
        }
        if byte.is_ascii_whitespace() {
            at += 1;
            continue;
        }
        let kind = match byte {
            b'-' if peek(at + 1) == b'-' => {
                at = long(text, at + 2).unwrap_or_else(|| run(at, &|b| b != b'\n'));
                continue;
            }
            b'[' if matches!(peek(at + 1), b'[' | b'=') && long(text, at).is_some() => {
                at = long(text, at).unwrap_or(at + 1);
                WordKind::Text
            }
            b'"' | b'\'' => {
                at += 1;
                while at < bytes.len() && bytes[at] != byte && bytes[at] != b'\n' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at = (at + 1).min(bytes.len());
                WordKind::Text
            }
            b'0'..=b'9' => {
                at = number(bytes, at);
                WordKind::Number
            }
            b'.' if peek(at + 1).is_ascii_digit() && !(at > 0 && bytes[at - 1] == b'.') => {
                at = number(bytes, at);
                WordKind::Number
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                at = run(at, &|b| b.is_ascii_alphanumeric() || b == b'_');
                WordKind::Name
            }
            _ => {
                at += 1;
                while at < bytes.len() && !text.is_char_boundary(at) {
                    at += 1;
                }
                WordKind::Symbol
            }
        };
        out.push(Word { kind, start, end: at, starts_line: std::mem::take(&mut starts_line) });
    }
    out
}

/// Where the number that begins at `at` ends, its suffix letter included.
fn number(bytes: &[u8], mut at: usize) -> usize {
    let peek = |at: usize| bytes.get(at).copied().unwrap_or(0);
    if peek(at) == b'0' && matches!(peek(at + 1), b'x' | b'X') {
        at += 2;
        while peek(at).is_ascii_hexdigit() {
            at += 1;
        }
        return at;
    }
    while peek(at).is_ascii_digit() {
        at += 1;
    }
    if peek(at) == b'.' && peek(at + 1) != b'.' {
        at += 1;
        while peek(at).is_ascii_digit() {
            at += 1;
        }
    }
    let sign = usize::from(matches!(peek(at + 1), b'+' | b'-'));
    if matches!(peek(at), b'e' | b'E') && peek(at + 1 + sign).is_ascii_digit() {
        at += 1 + sign;
        while peek(at).is_ascii_digit() {
            at += 1;
        }
    }
    at + usize::from(peek(at).is_ascii_alphabetic())
}

/// Where the long bracket `[[…]]` or `[=[…]=]` at `at` ends, if there is one.
fn long(text: &str, at: usize) -> Option<usize> {
    let rest = text.get(at..)?.strip_prefix('[')?;
    let level = rest.len() - rest.trim_start_matches('=').len();
    let body = rest[level..].strip_prefix('[')?;
    let close = format!("]{}]", "=".repeat(level));
    let start = text.len() - body.len();
    body.find(&close).map(|found| start + found + close.len())
}

/// The files that a SUGAR 3 netlist uses, in order: `use("a.net")`, `use "a.net"`.
pub(crate) fn uses_of(text: &str) -> Vec<String> {
    let words = words(text);
    let spelled = |word: &Word| &text[word.start..word.end];
    let mut found = Vec::new();
    for (k, word) in words.iter().enumerate() {
        if word.kind != WordKind::Name || spelled(word) != "use" {
            continue;
        }
        let next = words[k + 1..].iter().find(|next| spelled(next) != "(");
        if let Some(name) = next.filter(|next| next.kind == WordKind::Text) {
            found.push(spelled(name).trim_matches(['"', '\'']).to_owned());
        }
    }
    found
}
