//! Names for contents: FNV-1a, 128 bits (Fowler, Noll, Vo), over lengths and bytes. The same on every machine and in every
//! process; for telling apart what is different, not against forgery.

use bimorph_base::{Bundle, Setting};
use bimorph_model::options::CompileOptions;

/// Bytes of a text between two checks of the budget.
const CHUNK: usize = 1 << 20;

/// A hash in the making.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fnv(u128);

impl Default for Fnv {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fnv {
    /// Adds bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }

    /// Adds a text with its length.
    pub fn text(&mut self, text: &str) {
        self.bytes(&(text.len() as u64).to_le_bytes());
        for chunk in text.as_bytes().chunks(CHUNK) {
            bimorph_base::budget::check();
            self.bytes(chunk);
        }
    }

    /// Adds everything that a model comes from.
    pub fn model(&mut self, bundle: &Bundle, options: &CompileOptions) {
        self.text(&bundle.root);
        for (name, text) in &bundle.files {
            self.text(name);
            self.text(text);
        }
        for (name, value) in &options.set {
            self.text(name);
            match value {
                Setting::Number(x) => self.bytes(&x.to_bits().to_le_bytes()),
                Setting::Text(text) => self.text(text),
            }
        }
        // Debug output of plain numbers and flags is exact (shortest text that reads back).
        self.text(&format!("{:?}", options.without_settings()));
    }

    /// The hash.
    pub fn value(&self) -> u128 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference: FNV-1a 128 of "a", d228cb696f1a8caf78912b704e4a8964 (Landon Noll's test vectors).
    #[test]
    fn the_hash_is_fnv1a_128() {
        let mut state = Fnv::default();
        state.bytes(b"a");
        assert_eq!(format!("{:032x}", state.value()), "d228cb696f1a8caf78912b704e4a8964");
    }
}
