//! A reply: a JSON head, and 32-bit numbers behind it.
//!
//! ```text
//! u32 little-endian: bytes of the head · head, filled up with blanks to a multiple of 4 · f32 little-endian …
//! ```
//! The entry `arrays` of the head gives the first index and the length of each array by name.

use serde::Serialize;
use serde_json::{Map, Value, json};

/// A reply in the making.
#[derive(Debug, Default)]
pub(crate) struct Answer {
    head: Map<String, Value>,
    arrays: Map<String, Value>,
    numbers: Vec<f32>,
}

impl Answer {
    /// Adds an entry of the head.
    pub(crate) fn put(&mut self, name: &str, value: impl Serialize) {
        self.head.insert(name.to_owned(), serde_json::to_value(value).unwrap_or(Value::Null));
    }

    /// Adds an array.
    pub(crate) fn array(&mut self, name: &str, values: impl IntoIterator<Item = f64>) {
        let first = self.numbers.len();
        self.numbers.extend(values.into_iter().map(|x| x as f32));
        self.arrays.insert(name.to_owned(), json!([first, self.numbers.len() - first]));
    }

    /// The bytes on the wire.
    pub(crate) fn bytes(mut self) -> Vec<u8> {
        self.head.insert("arrays".to_owned(), Value::Object(self.arrays));
        let mut head = serde_json::to_vec(&self.head).unwrap_or_default();
        head.resize(head.len().next_multiple_of(4), b' ');
        let mut bytes = Vec::with_capacity(4 + head.len() + 4 * self.numbers.len());
        bytes.extend_from_slice(&(head.len() as u32).to_le_bytes());
        bytes.append(&mut head);
        bytes.extend(self.numbers.iter().flat_map(|x| x.to_le_bytes()));
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The head and the arrays read back as the module states.
    #[test]
    fn a_reply_reads_back() {
        let mut answer = Answer::default();
        answer.put("name", "a");
        answer.array("x", [1.0, 2.5]);
        answer.array("y", [-3.0]);
        let bytes = answer.bytes();
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        assert_eq!(length % 4, 0);
        let head: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        assert_eq!(head, json!({"name": "a", "arrays": {"x": [0, 2], "y": [2, 1]}}));
        let numbers: Vec<f32> =
            bytes[4 + length..].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(numbers, [1.0, 2.5, -3.0]);
    }
}
