//! Files that are no netlist of SUGAR 2 though they come beside them: SUGAR 3 netlists, which are Lua, and MATLAB files.
//!
//! Both are recognized by whole statements that the language does not have. A SUGAR 3 netlist says `use("…")`, holds a
//! Lua comment or braces at the end of a word; a MATLAB file defines a function or loads a netlist.

use super::source::TextSpan;

/// Language of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileKind {
    /// A SUGAR 3 netlist, recognized by the line.
    Lua(TextSpan),
    /// A MATLAB function or script, recognized by the line.
    Matlab(TextSpan),
    /// Anything else: a SUGAR 2 netlist, right or wrong.
    Netlist,
}

/// So many statements that end with a semicolon, and no list of nodes, make a MATLAB script.
const ENDED: usize = 3;
/// Lines that only a MATLAB file begins with.
const MATLAB: [&str; 9] =
    ["clear all", "clear;", "close all", "clc", "figure(", "figure;", "addpath(", "cho_load(", "hold on"];

/// Language of file number `file`, by the first line that decides it.
pub(crate) fn kind(text: &str, file: u16) -> FileKind {
    let mut start = 0;
    // statements that end with a semicolon, and the first of them; lines with a list of nodes
    let (mut ended, mut first, mut lists) = (0, None, 0);
    for line in text.split_inclusive('\n') {
        bimorph_base::budget::check();
        let at = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
        let span = TextSpan { file, start: at(start), end: at(start + line.trim_end().len()) };
        start += line.len();
        let body = line.trim_start_matches(['\u{feff}', ' ', '\t', '\r']);
        if body.starts_with('%') {
            continue;
        }
        if lua(body) {
            return FileKind::Lua(span);
        }
        if matlab(body) {
            return FileKind::Matlab(span);
        }
        let code = body.split('%').next().unwrap_or("").trim_end();
        if code.ends_with(';') && !code.contains('[') {
            ended += 1;
            first.get_or_insert(span);
        }
        lists += usize::from(code.contains('['));
    }
    match first {
        Some(span) if ended >= ENDED && lists == 0 => FileKind::Matlab(span),
        _ => FileKind::Netlist,
    }
}

/// True for a line of Lua: `use(…)`, `use"…"`, a `--` comment, a `local`, a call with a table, `[NAME =] NAME {`, a `subnet` with
/// parentheses.
fn lua(line: &str) -> bool {
    let words = line.strip_prefix("use").map(str::trim_start);
    let used = words.is_some_and(|rest| rest.starts_with(['(', '"', '\'', '[']));
    let called = |text: &str| after_name(text).is_some_and(|rest| rest.starts_with('{'));
    let assigned =
        after_name(line).and_then(|rest| rest.strip_prefix('=')).is_some_and(|rest| called(rest.trim_start()));
    let subnet = line.strip_prefix("subnet ").and_then(|rest| after_name(rest.trim_start()));
    used || line.starts_with("--")
        || called(line)
        || assigned
        || subnet.is_some_and(|rest| rest.starts_with('('))
        || line.strip_prefix("local ").is_some_and(defines)
}

/// Text after the leading name and blanks; `None` without a name.
fn after_name(text: &str) -> Option<&str> {
    let rest = text.trim_start_matches(|c: char| c.is_ascii_alphanumeric() || c == '_');
    (rest.len() < text.len()).then(|| rest.trim_start())
}

/// True for `NAME = …` and `function …`, what follows Lua's `local`.
fn defines(rest: &str) -> bool {
    let rest = rest.trim_start();
    rest.starts_with("function ") || after_name(rest).is_some_and(|rest| rest.starts_with('='))
}

/// True for a line of MATLAB: a function's head, or a command of a session.
fn matlab(line: &str) -> bool {
    let head = line.strip_prefix("function").is_some_and(|rest| rest.starts_with([' ', '\t', '[']));
    let loads = line.split_once('=').is_some_and(|(name, rest)| {
        rest.trim_start().starts_with("cho_load(")
            && name.trim().bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
    });
    head || loads || MATLAB.iter().any(|word| line.starts_with(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn language(text: &str) -> (char, u32) {
        match kind(text, 0) {
            FileKind::Lua(span) => ('l', span.start),
            FileKind::Matlab(span) => ('m', span.start),
            FileKind::Netlist => ('n', 0),
        }
    }

    /// The first line that only one language allows decides the language; comments of SUGAR 2 decide nothing.
    #[test]
    fn languages_are_detected() {
        assert_eq!(language("% net=cho_load('x.net');\nuses mumps.net\nanchor p1 [a] []\n"), ('n', 0));
        assert_eq!(language("% title\nuse(\"mumps.net\")\n"), ('l', 8));
        assert_eq!(language("use 'mumps.net'\n"), ('l', 0));
        assert_eq!(language("p1 = material {h=2u}\n"), ('l', 0));
        assert_eq!(language("subnet s (A, B)\n"), ('l', 0));
        assert_eq!(language("subnet s [a b] [l=1u]\nx = [\n"), ('n', 0));
        assert_eq!(language("-- title\n"), ('l', 0));
        assert_eq!(language("A = 1\nanchor {A; material=p1}\n"), ('l', 6));
        assert_eq!(language("function [q] = f(net)\n"), ('m', 0));
        assert_eq!(language("x=1;\nnet = cho_load('a.net', p);\n"), ('m', 5));
        assert_eq!(language("functions = 3\nfunction_of beam2d p1 [a b] [l=1u]\n"), ('n', 0));
        assert_eq!(language("local = 3\nlocal beam2d p1 [a b] [l=1u]\n"), ('n', 0));
        assert_eq!(language("x = 1\nlocal y = 3\n"), ('l', 6));
        assert_eq!(language("u = 1e-6; %m\nh = 2*u;\nw = 2*u;\n"), ('m', 0));
        assert_eq!(language("u = 1;\nh = 2;\nw = 2;\nanchor p1 [a] []\n"), ('n', 0));
        assert_eq!(language("clear all\n"), ('m', 0));
        assert_eq!(language("used = 1\nuser = 2\nuses a.net\n"), ('n', 0));
        assert_eq!(language(""), ('n', 0));
    }
}
