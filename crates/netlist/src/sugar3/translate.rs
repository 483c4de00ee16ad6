//! SUGAR 3's Lua 4 as Lua 5.4, line by line: translated text stays on its line, so that messages point into the
//! netlist.
//!
//! * a metric suffix becomes an exponent: `2u` is `2e-6`;
//! * `subnet s(A, B, w) … end` becomes `s = subnetize("s", "A,B,w", function(A, B, w, args) … end)`;
//! * `for k, v in t do` goes over a table.

use super::super::lexer::{scaled, suffix};
use super::words::{Word, WordKind, words};

/// A construct without a counterpart: its byte range, its name, and a remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Untranslatable {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) message: String,
    pub(crate) help: &'static str,
}

/// Keyword that closes an open block.
#[derive(Debug, Clone, Copy, PartialEq)]
enum OpenBlock {
    Plain,
    Subnet,
}

/// The text of a SUGAR 3 netlist in Lua 5.4.
///
/// # Errors
/// The first construct that has no counterpart.
pub(crate) fn translate(text: &str) -> Result<String, Untranslatable> {
    let words = words(text);
    let spelled = |k: usize| words.get(k).map_or("", |w: &Word| &text[w.start..w.end]);
    let mut out = String::with_capacity(text.len() + text.len() / 8);
    let mut copied = 0;
    let mut blocks = Vec::new();
    // `for … in` headers whose `do` is awaited
    let mut headers = 0_usize;
    let mut k = 0;
    while k < words.len() {
        let word = words[k];
        let mut put = |upto: usize, from: usize, with: &str| {
            out.push_str(&text[copied..upto]);
            out.push_str(with);
            copied = from;
        };
        match (word.kind, spelled(k)) {
            (WordKind::Number, number) => {
                if let Some(plain) = without_suffix(number) {
                    put(word.start, word.end, &plain);
                }
            }
            (WordKind::Name, "subnet")
                if words.get(k + 1).is_some_and(|w| w.kind == WordKind::Name) && spelled(k + 2) == "(" =>
            {
                let close = (k + 3..words.len()).find(|&n| spelled(n) == ")").unwrap_or(k + 2);
                let formals: Vec<&str> =
                    (k + 3..close).filter(|&n| words[n].kind == WordKind::Name).map(spelled).collect();
                let name = spelled(k + 1);
                let head = format!("{name} = subnetize(\"{name}\", \"{}\", function", formals.join(","));
                put(word.start, words[k + 1].end, &head);
                let more = if formals.is_empty() { "args" } else { ", args" };
                put(words[close].start, words[close].start, more);
                blocks.push(OpenBlock::Subnet);
                k = close;
            }
            (WordKind::Name, "in") => {
                headers += 1;
                put(word.end, word.end, " each(");
            }
            (WordKind::Name, "do") => {
                if headers > 0 {
                    headers -= 1;
                    put(word.start, word.start, ") ");
                }
                blocks.push(OpenBlock::Plain);
            }
            (WordKind::Name, "function" | "if") => blocks.push(OpenBlock::Plain),
            (WordKind::Name, "end") if blocks.pop() == Some(OpenBlock::Subnet) => put(word.end, word.end, ")"),
            (WordKind::Symbol, "%") if upvalue(&words, k) => {
                let message = format!("`%{}` is an upvalue of Lua 4", spelled(k + 1));
                let help = "write `local old = NAME` above the function, and `old` in it";
                return Err(Untranslatable { start: word.start, end: words[k + 1].end, message, help });
            }
            _ => {}
        }
        k += 1;
    }
    out.push_str(&text[copied..]);
    Ok(out)
}

/// True for the `%` of an upvalue: it stands before a name, and not after an operand.
fn upvalue(words: &[Word], k: usize) -> bool {
    let (percent, next) = (words[k], words.get(k + 1));
    let named = next.is_some_and(|next| next.kind == WordKind::Name && next.start == percent.end);
    let operand = k > 0 && !percent.starts_line && words[k - 1].kind != WordKind::Symbol;
    named && !operand
}

/// A number with a suffix letter as one without.
fn without_suffix(number: &str) -> Option<String> {
    let letter = number.bytes().last().filter(u8::is_ascii_alphabetic)?;
    if number.starts_with("0x") || number.starts_with("0X") {
        return None;
    }
    let power = suffix(letter)?;
    Some(format!("{:e}", scaled(&number[..number.len() - 1].to_ascii_lowercase(), power)))
}

#[cfg(test)]
mod tests {
    use super::super::words::uses_of;
    use super::*;

    fn lua(text: &str) -> String {
        translate(text).unwrap_or_else(|found| panic!("{found:?}"))
    }

    /// Suffixes become exponents, in code alone.
    #[test]
    fn suffixes() {
        assert_eq!(lua("x = 2u + 1.5e-3u*3 .. 'a 2u' -- 4u\n"), "x = 2e-6 + 1.5e-9*3 .. 'a 2u' -- 4u\n");
        assert_eq!(lua("x = 1e-6 + 0x1f + 5E + 1..2"), "x = 1e-6 + 0x1f + 5e18 + 1..2");
        assert_eq!(lua("x = a2u [[ 3u ]]"), "x = a2u [[ 3u ]]");
    }

    /// Subnets become functions and close where their own `end` stands.
    #[test]
    fn subnets() {
        let text = "subnet s (A, B,\n w)\n if w then for k = 1, 3 do x() end end\nend\nsubnet t() end\n";
        let want = "s = subnetize(\"s\", \"A,B,w\", function (A, B,\n w, args)\n if w then for k = 1, 3 do x() end end\nend)\n\
                    t = subnetize(\"t\", \"\", function(args) end)\n";
        assert_eq!(lua(text), want);
    }

    /// Loops over tables, and what has no counterpart.
    #[test]
    fn loops_and_upvalues() {
        assert_eq!(lua("for k, v in t do f(k) end"), "for k, v in each( t ) do f(k) end");
        assert_eq!(lua("x = a % b"), "x = a % b");
        assert_eq!(translate("function f() %g() end").unwrap_err().message, "`%g` is an upvalue of Lua 4");
    }

    /// Files that are used.
    #[test]
    fn uses() {
        assert_eq!(
            uses_of("use(\"a.net\") use 'b.net'\n-- use(\"c.net\")\nuser = use_of \"d\" use(x)"),
            ["a.net", "b.net"]
        );
    }
}
