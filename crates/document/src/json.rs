//! JSON with the place of every value (RFC 8259). Objects keep the order of their fields, and a repeated field is a fault.

use crate::error::{DocumentError, NOT_JSON};
use bimorph_base::budget;
use std::borrow::Cow;

/// Deepest nesting that is read; a document needs 6.
const DEEPEST: usize = 32;

/// A value with its byte range.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JsonNode<'t> {
    pub(crate) span: [usize; 2],
    pub(crate) kind: JsonKind<'t>,
}

/// Values of JSON.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum JsonKind<'t> {
    Null,
    Bool(bool),
    Number(f64),
    Text(Cow<'t, str>),
    List(Vec<JsonNode<'t>>),
    Object(Vec<(Cow<'t, str>, JsonNode<'t>)>),
}

impl<'t> JsonNode<'t> {
    /// The value of a field.
    pub(crate) fn get(&self, name: &str) -> Option<&JsonNode<'t>> {
        let JsonKind::Object(fields) = &self.kind else { return None };
        fields.iter().find(|(other, _)| other == name).map(|(_, value)| value)
    }

    /// An item of a list.
    pub(crate) fn item(&self, index: usize) -> Option<&JsonNode<'t>> {
        let JsonKind::List(items) = &self.kind else { return None };
        items.get(index)
    }

    /// How messages call it.
    pub(crate) fn called(&self) -> String {
        match &self.kind {
            JsonKind::Null => "null".to_owned(),
            JsonKind::Bool(value) => value.to_string(),
            JsonKind::Number(value) => format!("the number {value:?}"),
            JsonKind::Text(text) => format!("the text \"{}\"", text.chars().take(40).collect::<String>()),
            JsonKind::List(items) => format!("a list of {}", items.len()),
            JsonKind::Object(_) => "an object".to_owned(),
        }
    }
}

/// Parses one value and nothing after it.
pub(crate) fn parse(text: &str) -> Result<JsonNode<'_>, DocumentError> {
    let mut parser = JsonParser { text, at: 0 };
    if text.starts_with('\u{feff}') {
        parser.at = '\u{feff}'.len_utf8();
    }
    let value = parser.value(0)?;
    parser.blank();
    if parser.at < text.len() {
        return Err(parser.fault("expected the end of the file after the document"));
    }
    Ok(value)
}

struct JsonParser<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> JsonParser<'t> {
    fn fault(&self, message: impl Into<String>) -> DocumentError {
        let end = self.text[self.at..].chars().next().map_or(self.at, |c| self.at + c.len_utf8());
        let message = format!("not JSON: {}", message.into());
        DocumentError { path: "$".to_owned(), span: [self.at, end], code: NOT_JSON, message, help: String::new() }
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn blank(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\r' | b'\n')) {
            self.at += 1;
        }
    }

    /// Takes a byte if it is next.
    fn takes(&mut self, byte: u8) -> bool {
        let found = self.peek() == Some(byte);
        self.at += usize::from(found);
        found
    }

    fn value(&mut self, depth: usize) -> Result<JsonNode<'t>, DocumentError> {
        budget::check();
        budget::lay_out(size_of::<JsonNode<'_>>());
        self.blank();
        if depth > DEEPEST {
            return Err(self.fault(format!("values nest deeper than {DEEPEST}")));
        }
        let start = self.at;
        let kind = match self.peek() {
            Some(b'{') => self.object(depth)?,
            Some(b'[') => self.list(depth)?,
            Some(b'"') => JsonKind::Text(self.string()?),
            Some(b'-' | b'0'..=b'9') => self.number()?,
            _ => self.word()?,
        };
        Ok(JsonNode { span: [start, self.at], kind })
    }

    fn word(&mut self) -> Result<JsonKind<'t>, DocumentError> {
        let words = [("null", JsonKind::Null), ("true", JsonKind::Bool(true)), ("false", JsonKind::Bool(false))];
        for (word, kind) in words {
            if self.text[self.at..].starts_with(word) {
                self.at += word.len();
                return Ok(kind);
            }
        }
        Err(self.fault("expected a value: an object, a list, a number, a text in double quotes, true, false or null"))
    }

    fn object(&mut self, depth: usize) -> Result<JsonKind<'t>, DocumentError> {
        self.at += 1;
        let mut fields: Vec<(Cow<'t, str>, JsonNode<'t>)> = Vec::new();
        self.blank();
        if self.takes(b'}') {
            return Ok(JsonKind::Object(fields));
        }
        loop {
            self.blank();
            if self.peek() != Some(b'"') {
                return Err(self.fault("expected the name of a field in double quotes"));
            }
            let start = self.at;
            let name = self.string()?;
            if fields.iter().any(|(other, _)| *other == name) {
                self.at = start;
                return Err(self.fault(format!("the field \"{name}\" stands twice in one object")));
            }
            self.blank();
            if !self.takes(b':') {
                return Err(self.fault(format!("expected `:` after the field \"{name}\"")));
            }
            let value = self.value(depth + 1)?;
            fields.push((name, value));
            self.blank();
            if self.takes(b'}') {
                return Ok(JsonKind::Object(fields));
            }
            if !self.takes(b',') {
                return Err(self.fault("expected `,` or `}` after a field"));
            }
        }
    }

    fn list(&mut self, depth: usize) -> Result<JsonKind<'t>, DocumentError> {
        self.at += 1;
        let mut items = Vec::new();
        self.blank();
        if self.takes(b']') {
            return Ok(JsonKind::List(items));
        }
        loop {
            items.push(self.value(depth + 1)?);
            self.blank();
            if self.takes(b']') {
                return Ok(JsonKind::List(items));
            }
            if !self.takes(b',') {
                return Err(self.fault("expected `,` or `]` after an item of a list"));
            }
        }
    }

    fn digits(&mut self) -> Result<(), DocumentError> {
        if !self.peek().is_some_and(|byte| byte.is_ascii_digit()) {
            return Err(self.fault("expected a digit"));
        }
        while self.peek().is_some_and(|byte| byte.is_ascii_digit()) {
            self.at += 1;
        }
        Ok(())
    }

    fn number(&mut self) -> Result<JsonKind<'t>, DocumentError> {
        let start = self.at;
        self.takes(b'-');
        if !self.takes(b'0') {
            self.digits()?;
        } else if self.peek().is_some_and(|byte| byte.is_ascii_digit()) {
            return Err(self.fault("a number has no leading zeros"));
        }
        if self.takes(b'.') {
            self.digits()?;
        }
        if matches!(self.peek(), Some(b'e' | b'E')) {
            self.at += 1;
            if matches!(self.peek(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            self.digits()?;
        }
        match self.text[start..self.at].parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(JsonKind::Number(number)),
            _ => {
                self.at = start;
                Err(self.fault("the number is beyond the range of a double"))
            }
        }
    }

    fn string(&mut self) -> Result<Cow<'t, str>, DocumentError> {
        self.at += 1;
        let start = self.at;
        while let Some(byte) = self.peek() {
            match byte {
                b'"' => {
                    let text = &self.text[start..self.at];
                    self.at += 1;
                    return Ok(Cow::Borrowed(text));
                }
                b'\\' => return self.escaped(start).map(Cow::Owned),
                0..0x20 => return Err(self.fault("a control character stands in a text: write it as \\u")),
                _ => self.at += 1,
            }
        }
        Err(self.fault("a text is not closed: expected `\"`"))
    }

    /// A text from `start` with escapes, the first of which is next.
    fn escaped(&mut self, start: usize) -> Result<String, DocumentError> {
        let mut text = self.text[start..self.at].to_owned();
        while let Some(character) = self.text[self.at..].chars().next() {
            match character {
                '"' => {
                    self.at += 1;
                    return Ok(text);
                }
                '\\' => text.push(self.escape()?),
                '\0'..'\x20' => return Err(self.fault("a control character stands in a text: write it as \\u")),
                _ => {
                    text.push(character);
                    self.at += character.len_utf8();
                }
            }
        }
        Err(self.fault("a text is not closed: expected `\"`"))
    }

    fn escape(&mut self) -> Result<char, DocumentError> {
        let letter = self.text.as_bytes().get(self.at + 1).copied();
        let plain = match letter {
            Some(b'"') => '"',
            Some(b'\\') => '\\',
            Some(b'/') => '/',
            Some(b'b') => '\x08',
            Some(b'f') => '\x0c',
            Some(b'n') => '\n',
            Some(b'r') => '\r',
            Some(b't') => '\t',
            Some(b'u') => return self.unicode(),
            _ => return Err(self.fault("unknown escape in a text")),
        };
        self.at += 2;
        Ok(plain)
    }

    /// `\uXXXX`, or two of them for a character beyond the basic plane.
    fn unicode(&mut self) -> Result<char, DocumentError> {
        let code = |at: usize| {
            let digits = self.text.get(at + 2..at + 6).filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()))?;
            self.text[at..].starts_with("\\u").then(|| u32::from_str_radix(digits, 16).ok())?
        };
        let first = code(self.at);
        let (found, length) = match first {
            Some(high @ 0xd800..0xdc00) => {
                let low = code(self.at + 6).filter(|low| (0xdc00..0xe000).contains(low));
                (low.map(|low| 0x1_0000 + ((high - 0xd800) << 10) + (low - 0xdc00)), 12)
            }
            other => (other, 6),
        };
        let Some(character) = found.and_then(char::from_u32) else {
            return Err(self.fault("expected four hexadecimal digits of a character after \\u"));
        };
        self.at += length;
        Ok(character)
    }
}

#[cfg(test)]
mod tests {
    //! Texts are read as RFC 8259 has them; serde_json serves as the independent reader.
    use super::*;
    use proptest::prelude::*;

    fn same(node: &JsonNode<'_>, other: &serde_json::Value) -> bool {
        use serde_json::Value;
        match (&node.kind, other) {
            (JsonKind::Null, Value::Null) => true,
            (JsonKind::Bool(a), Value::Bool(b)) => a == b,
            (JsonKind::Number(a), Value::Number(b)) => b.as_f64().is_some_and(|b| a.to_bits() == b.to_bits()),
            (JsonKind::Text(a), Value::String(b)) => a == b,
            (JsonKind::List(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
            (JsonKind::Object(a), Value::Object(b)) => {
                a.len() == b.len() && a.iter().all(|(name, a)| b.get(&**name).is_some_and(|b| same(a, b)))
            }
            _ => false,
        }
    }

    #[test]
    fn values_are_those_of_another_reader() {
        let texts = [
            "{}",
            " [1, -2.5e-6, 0, 1E3, true, false, null] ",
            r#"{"a": {"b": ["\"\\\/\b\f\n\r\t\u00e9\ud83d\ude00", ""]}, "ü": 1.7976931348623157e308}"#,
            "5e-324",
        ];
        for text in texts {
            let other = serde_json::from_str(text).expect("JSON");
            assert!(same(&parse(text).expect("JSON"), &other), "{text}");
        }
        for wrong in [
            "",
            "{",
            "[1,]",
            "{\"a\":1,}",
            "01",
            "1.",
            ".5",
            "+1",
            "1e",
            "1e999",
            "nan",
            "'a'",
            "\"\\x\"",
            "\"\\ud800\"",
            "\"a",
            "{\"a\" 1}",
            "{a: 1}",
            "[1 2]",
            "1 2",
            "\"\u{1}\"",
            "tru",
            "{\"a\":1,\"a\":2}",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
        let deep = "[".repeat(100_000);
        assert!(parse(&deep).is_err());
    }

    proptest! {
        /// Any text is read or refused, and the other reader agrees on each that it reads.
        #[test]
        fn any_text_is_read_or_refused(text in "[\\[\\]{}:, \"0-9eE.+\\-a-c\\\\untrfls]{0,40}") {
            if let (Ok(node), Ok(other)) = (parse(&text), serde_json::from_str::<serde_json::Value>(&text)) {
                prop_assert!(same(&node, &other));
            }
        }
    }
}
