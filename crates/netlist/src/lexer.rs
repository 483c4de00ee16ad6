//! Text → tokens. The lexical rules are SUGAR 2's: free form, `%` comments, numbers with one glued suffix letter.

use super::diagnostic_sink::DiagnosticSink;
use super::source::TextSpan;
use super::token::{Lexeme, TokenKind};
use bimorph_base::budget;

/// Tokens between two checks of the budget.
const CHUNK: usize = 1024;
/// Memory of a token with its share of the syntax tree, approximately (byte).
const TOKEN_BYTES: usize = 96;

/// Turns the text of file number `file` into tokens. Errors go to the sink; a token stands in for what was wrong.
pub(crate) fn tokens(file: u16, text: &str, sink: &mut DiagnosticSink) -> Vec<Lexeme> {
    let mut lexer =
        Lexer { file, text, bytes: text.as_bytes(), at: 0, fresh_line: true, out: Vec::new(), sink: Some(sink) };
    lexer.run();
    lexer.out
}

/// The names of the files that a text includes, in order.
pub(crate) fn uses_of(text: &str) -> Vec<String> {
    let mut lexer =
        Lexer { file: 0, text, bytes: text.as_bytes(), at: 0, fresh_line: true, out: Vec::new(), sink: None };
    lexer.run();
    let uses = lexer.out.iter().filter(|t| t.kind == TokenKind::Uses);
    uses.map(|t| used_name(&text[t.span.start as usize..t.span.end as usize]).to_owned())
        .filter(|n| !n.is_empty())
        .collect()
}

/// The file named by the text of a [`TokenKind::Uses`] token; empty when the line names none.
pub(crate) fn used_name(text: &str) -> &str {
    let name = text.strip_prefix("uses").unwrap_or("").trim();
    let quoted = |quote: char| name.strip_prefix(quote)?.strip_suffix(quote);
    quoted('"').or_else(|| quoted('\'')).unwrap_or(name)
}

/// Power of ten of a suffix letter.
pub(super) fn suffix(letter: u8) -> Option<i32> {
    Some(match letter {
        b'a' => -18,
        b'f' => -15,
        b'p' => -12,
        b'n' => -9,
        b'u' => -6,
        b'm' => -3,
        b'c' => -2,
        b'd' => -1,
        b'h' => 2,
        b'k' => 3,
        b'M' => 6,
        b'G' => 9,
        b'T' => 12,
        b'P' => 15,
        b'E' => 18,
        _ => return None,
    })
}

/// The double nearest to `digits` times a power of ten, rounded once: `30u` is 30e-6, not 30 × 1e-6.
pub(super) fn scaled(digits: &str, power: i32) -> f64 {
    let (mantissa, exponent) = digits.split_once('e').unwrap_or((digits, "0"));
    // an exponent beyond any number is as good as the largest
    let beyond = if exponent.starts_with('-') { i32::MIN } else { i32::MAX };
    let exponent = exponent.parse::<i32>().unwrap_or(beyond).saturating_add(power);
    format!("{mantissa}e{exponent}").parse().unwrap_or(f64::NAN)
}

struct Lexer<'a> {
    file: u16,
    text: &'a str,
    bytes: &'a [u8],
    at: usize,
    fresh_line: bool,
    out: Vec<Lexeme>,
    sink: Option<&'a mut DiagnosticSink>,
}

impl Lexer<'_> {
    fn peek(&self, ahead: usize) -> u8 {
        self.bytes.get(self.at + ahead).copied().unwrap_or(0)
    }

    fn push(&mut self, kind: TokenKind, start: usize) {
        let span = self.span(start);
        if self.out.len().is_multiple_of(CHUNK) {
            budget::check();
            budget::lay_out(CHUNK * TOKEN_BYTES);
        }
        self.out.push(Lexeme { kind, span, starts_line: std::mem::take(&mut self.fresh_line) });
    }

    fn span(&self, start: usize) -> TextSpan {
        let clamp = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
        TextSpan { file: self.file, start: clamp(start), end: clamp(self.at) }
    }

    fn error(&mut self, code: &'static str, start: usize, message: String, help: String) {
        let span = self.span(start);
        if let Some(sink) = &mut self.sink {
            sink.error(code, span, message, help);
        }
    }

    fn skip(&mut self, wanted: impl Fn(u8) -> bool) {
        while self.at < self.bytes.len() && wanted(self.bytes[self.at]) {
            self.at += 1;
        }
    }

    fn run(&mut self) {
        if self.text.starts_with('\u{feff}') {
            self.at = '\u{feff}'.len_utf8();
        }
        while self.at < self.bytes.len() {
            let start = self.at;
            let byte = self.bytes[start];
            match byte {
                b'\n' => {
                    self.at += 1;
                    self.fresh_line = true;
                }
                b' ' | b'\t' | b'\r' => self.at += 1,
                b'%' => self.skip(|b| b != b'\n'),
                b'a'..=b'z' | b'A'..=b'Z' => self.word(start),
                b'0'..=b'9' => self.number(start),
                b'.' if self.peek(1).is_ascii_digit() => self.bare_point(start),
                b'"' | b'\'' => self.string(start, byte),
                _ => self.symbol(start, byte),
            }
        }
        self.fresh_line = true;
        self.push(TokenKind::End, self.bytes.len());
    }

    fn word(&mut self, start: usize) {
        self.skip(|b| b.is_ascii_alphanumeric() || b == b'_');
        let kind = match &self.text[start..self.at] {
            "subnet" => TokenKind::Subnet,
            "param" => TokenKind::Param,
            "process" => TokenKind::Process,
            "for" => TokenKind::For,
            "if" => TokenKind::If,
            "else" => TokenKind::Else,
            "call" => TokenKind::Call,
            "uses" => {
                self.skip(|b| b.is_ascii_whitespace());
                match self.peek(0) {
                    // a name in quotes may hold blanks
                    quote @ (b'"' | b'\'') => {
                        self.at += 1;
                        self.skip(|b| b != quote && b != b'\n');
                        self.at += usize::from(self.peek(0) == quote);
                    }
                    _ => self.skip(|b| !b.is_ascii_whitespace()),
                }
                TokenKind::Uses
            }
            _ => TokenKind::Identifier,
        };
        self.push(kind, start);
    }

    fn number(&mut self, start: usize) {
        self.skip(|b| b.is_ascii_digit());
        if self.peek(0) == b'.' {
            self.at += 1;
            let digits = self.at;
            self.skip(|b| b.is_ascii_digit());
            if self.at == digits {
                let digits = &self.text[start..digits - 1];
                let help = format!("write `{digits}.0` or `{digits}`");
                self.error("E002", start, "digits must follow the decimal point".into(), help);
            }
        }
        let sign = usize::from(matches!(self.peek(1), b'+' | b'-'));
        if self.peek(0) == b'e' && self.peek(1 + sign).is_ascii_digit() {
            self.at += 1 + sign;
            self.skip(|b| b.is_ascii_digit());
        }
        let digits = &self.text[start..self.at];
        let letters = self.at;
        let power = suffix(self.peek(0));
        let value = scaled(digits, power.unwrap_or(0));
        self.at += usize::from(power.is_some());
        if self.peek(0).is_ascii_alphanumeric() || self.peek(0) == b'_' {
            self.skip(|b| b.is_ascii_alphanumeric() || b == b'_');
            self.bad_suffix(start, letters, power.is_some());
        } else if self.bytes.get(letters) == Some(&b'm') && digits.contains('e') {
            let (span, digits) = (self.span(start), digits.to_owned());
            if let Some(sink) = &mut self.sink {
                let help = format!("lengths are in metres already: write `{digits}`");
                sink.warning("W001", span, "the suffix `m` is milli, and multiplies this number by 0.001".into(), help);
            }
        }
        self.push(TokenKind::Number(value), start);
    }

    /// A number that runs on into letters: no unit, no second suffix.
    fn bad_suffix(&mut self, start: usize, letters: usize, one_is_good: bool) {
        let digits = &self.text[start..letters];
        let tail = &self.text[letters..self.at];
        let first = &tail[..1];
        let lower = first.to_ascii_lowercase();
        let help = if one_is_good && first == "E" && tail[1..].bytes().all(|b| b.is_ascii_digit()) {
            format!("an exponent is written with a small e: `{digits}e{}`; `E` is the suffix exa", &tail[1..])
        } else if one_is_good && matches!(&tail[1..], "m" | "s" | "N" | "V" | "Pa" | "Hz" | "F" | "A" | "Ohm" | "rad") {
            format!("units are not written, everything is SI: write `{digits}{first}`")
        } else if one_is_good {
            format!("one suffix letter at most: write `{digits}{first}`, then a blank if another word follows")
        } else if first == "_" {
            format!("digits are not grouped: write `{digits}{}`", &tail[1..])
        } else if suffix(lower.as_bytes()[0]).is_some() && tail.len() == 1 {
            format!("suffixes are a f p n u m c d h k M G T P E, case matters: write `{digits}{lower}`")
        } else {
            format!("suffixes are a f p n u m c d h k M G T P E; a number without one is `{digits}`")
        };
        let message = format!("`{}` is not a number", &self.text[start..self.at]);
        self.error("E001", start, message, help);
    }

    fn bare_point(&mut self, start: usize) {
        self.at += 1;
        self.skip(|b| b.is_ascii_alphanumeric() || b == b'_');
        let spelled = self.text[start..self.at].to_owned();
        let message = format!("a number must begin with a digit, found `{spelled}`");
        self.error("E001", start, message, format!("write `0{spelled}`"));
        self.push(TokenKind::Number(0.5), start);
    }

    fn string(&mut self, start: usize, quote: u8) {
        self.at += 1;
        self.skip(|b| b != quote && b != b'\n');
        if self.peek(0) == quote {
            self.at += 1;
        } else {
            let quote = char::from(quote);
            let help = format!("close it with `{quote}` on the same line");
            self.error("E003", start, "this string is never closed".into(), help);
        }
        self.push(TokenKind::Text, start);
    }

    fn symbol(&mut self, start: usize, byte: u8) {
        let equals = self.peek(1) == b'=';
        let (kind, width) = match byte {
            b'+' => (TokenKind::Plus, 1),
            b'-' => (TokenKind::Minus, 1),
            b'*' => (TokenKind::Star, 1),
            b'/' => (TokenKind::Slash, 1),
            b'^' => (TokenKind::Caret, 1),
            b'(' => (TokenKind::Open, 1),
            b')' => (TokenKind::Close, 1),
            b'[' => (TokenKind::OpenList, 1),
            b']' => (TokenKind::CloseList, 1),
            b'=' if equals => (TokenKind::Equal, 2),
            b'=' => (TokenKind::Equals, 1),
            b'!' | b'~' if equals => (TokenKind::NotEqual, 2),
            b'!' | b'~' => (TokenKind::Not, 1),
            b'<' if equals => (TokenKind::LessEqual, 2),
            b'<' => (TokenKind::Less, 1),
            b'>' if equals => (TokenKind::GreaterEqual, 2),
            b'>' => (TokenKind::Greater, 1),
            b'&' => (TokenKind::And, 1),
            b'|' => (TokenKind::Or, 1),
            b':' => (TokenKind::Colon, 1),
            b',' => (TokenKind::Comma, 1),
            b'?' => (TokenKind::Question, 1),
            _ => return self.stray(start),
        };
        self.at += width;
        self.push(kind, start);
    }

    /// A character the language does not have.
    fn stray(&mut self, start: usize) {
        let character = self.text[start..].chars().next().unwrap_or('?');
        self.at += character.len_utf8();
        let help = match character {
            '{' | '}' => "lists are written in `[ ]`; a SUGAR 3 (Lua) netlist must be turned into SUGAR 2 first",
            ';' => "statements are separated by blanks or line ends",
            '#' => "a comment begins with `%`",
            'µ' | 'μ' => "micro is written `u`",
            _ => "",
        };
        self.error("E004", start, format!("`{character}` has no meaning here"), help.into());
    }
}
