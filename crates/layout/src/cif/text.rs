//! Characters of CIF: separators, numbers, names, comments.
//!
//! Between the parts of a command everything separates that is no digit, no capital, none of `- ( ) ;`: also `,` and small letters.

use super::error::{CifError, CifFault};

/// Largest magnitude of a number: a metre is 1e8 centimicrons, and scales may be fine.
const LARGEST: i64 = 1_000_000_000_000;
/// Comments nest at most this deep.
const DEEPEST_COMMENT: usize = 1000;

pub(super) struct CifReader<'a> {
    text: &'a [u8],
    file: &'a str,
    at: usize,
    /// Position of the last query, and its line.
    placed: (usize, usize),
}

impl<'a> CifReader<'a> {
    pub(super) fn new(text: &'a [u8], file: &'a str) -> Self {
        Self { text, file, at: 0, placed: (0, 1) }
    }

    pub(super) fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    pub(super) fn advance(&mut self) {
        self.at = (self.at + 1).min(self.text.len());
    }

    /// The next token, for messages.
    pub(super) fn found(&self) -> String {
        match self.peek() {
            None => "the end of the file".to_owned(),
            Some(byte) if byte.is_ascii_graphic() => format!("`{}`", byte as char),
            Some(byte) => format!("the byte 0x{byte:02x}"),
        }
    }

    /// "line 3".
    pub(super) fn place(&mut self) -> String {
        // On from the last place, so that all places of a file cost one pass.
        let (from, line) = self.placed;
        let line = line + self.text[from..self.at].iter().filter(|b| **b == b'\n').count();
        self.placed = (self.at, line);
        format!("line {line}")
    }

    fn line_and_column(&self) -> (usize, usize) {
        let before = &self.text[..self.at];
        let line = 1 + before.iter().filter(|b| **b == b'\n').count();
        let start = before.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        (line, 1 + String::from_utf8_lossy(&before[start..]).chars().count())
    }

    pub(super) fn error(&self, fault: CifFault) -> CifError {
        let (line, column) = self.line_and_column();
        CifError { file: self.file.to_owned(), line, column, fault }
    }

    /// Passes over what separates, comments included.
    pub(super) fn blanks(&mut self) -> Result<(), CifError> {
        while let Some(byte) = self.peek() {
            match byte {
                b'(' => self.comment()?,
                b'0'..=b'9' | b'A'..=b'Z' | b'-' | b')' | b';' => break,
                // Control characters occur in no text file: report them instead of reading them as blanks.
                0..=8 | 14..=31 | 127.. => {
                    let found = self.found();
                    return Err(self.error(CifFault::Expected { expected: "text of a CIF file", found }));
                }
                _ => self.at += 1,
            }
        }
        Ok(())
    }

    fn comment(&mut self) -> Result<(), CifError> {
        let start = self.at;
        let mut depth = 0;
        while let Some(byte) = self.peek() {
            self.at += 1;
            match byte {
                b'(' => depth += 1,
                b')' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                return Ok(());
            }
            if depth > DEEPEST_COMMENT {
                break;
            }
        }
        self.at = start;
        Err(self.error(CifFault::End("inside this comment: `)` is missing")))
    }

    pub(super) fn number_follows(&mut self) -> Result<bool, CifError> {
        self.blanks()?;
        Ok(matches!(self.peek(), Some(b'0'..=b'9' | b'-')))
    }

    pub(super) fn integer(&mut self) -> Result<i64, CifError> {
        if !self.number_follows()? {
            let found = self.found();
            return Err(self.error(CifFault::Expected { expected: "a whole number", found }));
        }
        let start = self.at;
        let negative = self.peek() == Some(b'-');
        if negative {
            self.at += 1;
        }
        let digits = self.at;
        let mut value: i64 = 0;
        while let Some(digit @ b'0'..=b'9') = self.peek() {
            value = value.saturating_mul(10).saturating_add(i64::from(digit - b'0'));
            self.at += 1;
        }
        if digits == self.at {
            let found = self.found();
            return Err(self.error(CifFault::Expected { expected: "a digit after `-`", found }));
        }
        if value > LARGEST {
            let shown = &self.text[start..self.at.min(start + 30)];
            let digits = String::from_utf8_lossy(shown).into_owned();
            self.at = start;
            return Err(self.error(CifFault::Number { digits, most: LARGEST }));
        }
        if self.peek() == Some(b'.') && self.text.get(self.at + 1).is_some_and(u8::is_ascii_digit) {
            let found = "a decimal point".to_owned();
            return Err(self.error(CifFault::Expected { expected: "whole numbers (CIF has no others)", found }));
        }
        Ok(if negative { -value } else { value })
    }

    /// A name of capitals, digits and `_`; small letters are taken too, since programs write them.
    pub(super) fn name(&mut self, what: &'static str) -> Result<String, CifError> {
        while self.peek().is_some_and(|b| b == b' ' || b == b'\t' || b == b'\n' || b == b'\r') {
            self.at += 1;
        }
        let start = self.at;
        while self.peek().is_some_and(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'/' | b'.' | b'$' | b'-')) {
            self.at += 1;
        }
        if start == self.at {
            let found = self.found();
            return Err(self.error(CifFault::Expected { expected: what, found }));
        }
        Ok(String::from_utf8_lossy(&self.text[start..self.at]).into_owned())
    }

    /// The semicolon that ends a command.
    pub(super) fn end(&mut self) -> Result<(), CifError> {
        self.blanks()?;
        if self.peek() == Some(b';') {
            self.at += 1;
            return Ok(());
        }
        let found = self.found();
        Err(self.error(CifFault::Expected { expected: "`;`", found }))
    }

    /// The text of a user extension, without its semicolon; a `;` between quotes belongs to it.
    pub(super) fn statement(&mut self) -> Result<String, CifError> {
        let start = self.at;
        let mut quoted = false;
        while let Some(byte) = self.peek() {
            match byte {
                b'"' => quoted = !quoted,
                b'\n' | b'\r' if quoted => quoted = false,
                b';' if !quoted => {
                    let text = String::from_utf8_lossy(&self.text[start..self.at]).into_owned();
                    self.at += 1;
                    return Ok(text);
                }
                _ => {}
            }
            self.at += 1;
        }
        self.at = start;
        Err(self.error(CifFault::End("inside this command: `;` is missing")))
    }
}

/// Words of a user extension: separated by blanks, or between quotes.
pub(super) fn words(statement: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = statement.trim();
    while !rest.is_empty() {
        let (word, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
        };
        words.push(word.to_owned());
        rest = after.trim_start();
    }
    words
}
