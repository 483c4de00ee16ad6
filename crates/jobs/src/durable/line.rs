//! Lines of JSON with a checksum: a damaged line is rejected.

use super::record::checksum;

/// The text before the checksum of a line, and its length including the text after it.
const SUM: &[u8] = b",\"sum\":\"";
const SUMMED: usize = SUM.len() + 32 + 3;

/// An object of JSON with the sum of its bytes, as a line.
pub fn sealed(mut object: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&object);
    object.pop();
    object.extend([SUM, format!("{sum:032x}\"}}\n").as_bytes()].concat());
    object
}

/// The object of such a line; none for one that is damaged.
pub fn opened(line: &[u8]) -> Option<Vec<u8>> {
    let (object, end) = line.split_at_checked(line.len().checked_sub(SUMMED)?)?;
    let written = std::str::from_utf8(end.strip_prefix(SUM)?.strip_suffix(b"\"}\n")?).ok()?;
    let object = [object, b"}"].concat();
    (u128::from_str_radix(written, 16).ok()? == checksum(&object)).then_some(object)
}

#[cfg(test)]
mod tests {
    //! A sealed line opens, and is rejected after any change of a byte.
    use super::*;

    #[test]
    fn any_change_is_seen() {
        let line = sealed(b"{\"point\":3}".to_vec());
        assert_eq!(opened(&line).as_deref(), Some(&b"{\"point\":3}"[..]));
        for k in 0..line.len() {
            let mut damaged = line.clone();
            damaged[k] ^= 1;
            assert_eq!(opened(&damaged), None, "{k}");
            assert_eq!(opened(&line[..k]), None, "{k}");
        }
    }
}
