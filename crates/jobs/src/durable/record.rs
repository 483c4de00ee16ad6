//! A record as bytes: its kind, the checksum of its body, its body.

use crate::content::Fnv;

/// Bytes before the body.
pub const HEAD: usize = 16 + 16;

/// FNV-1a, 128 bits (Fowler, Noll, Vo): against accidents, not against forgery, which harms only the forger's own
/// session.
pub fn checksum(bytes: &[u8]) -> u128 {
    let mut sum = Fnv::default();
    sum.bytes(bytes);
    sum.value()
}

/// The record of a kind whose body, of about so many bytes, `fill` adds.
pub fn sealed(kind: &[u8; 16], about: usize, fill: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEAD + about);
    out.extend(kind);
    out.extend([0; 16]);
    fill(&mut out);
    let sum = checksum(&out[HEAD..]);
    out[16..HEAD].copy_from_slice(&sum.to_le_bytes());
    out
}

/// The body of a record; none for one that is cut off, damaged, or of another kind.
pub fn opened<'a>(kind: &[u8; 16], bytes: &'a [u8]) -> Option<&'a [u8]> {
    opened_first(kind, bytes, |rest| Some(rest.len()))
}

/// The same at the beginning of a file that may be longer, where `length` reads from the body how many bytes it has.
pub fn opened_first<'a>(
    kind: &[u8; 16],
    bytes: &'a [u8],
    length: impl FnOnce(&[u8]) -> Option<usize>,
) -> Option<&'a [u8]> {
    let (head, rest) = bytes.split_at_checked(HEAD)?;
    let body = rest.get(..length(rest)?)?;
    (head.starts_with(kind) && head[16..] == checksum(body).to_le_bytes()).then_some(body)
}

#[cfg(test)]
mod tests {
    //! A record opens for its kind alone, and not after any change of a bit, nor cut off.
    use super::*;

    #[test]
    fn any_change_of_a_record_is_seen() {
        let kind = b"bimorph records1";
        let whole = sealed(kind, 4, |out| out.extend(b"body"));
        assert_eq!(opened(kind, &whole), Some(&b"body"[..]));
        assert_eq!(opened(b"bimorph records2", &whole), None);
        for bit in 0..8 * whole.len() {
            let mut wrong = whole.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(opened(kind, &wrong), None, "{bit}");
        }
        assert!((0..whole.len()).all(|cut| opened(kind, &whole[..cut]).is_none()));
        // what is left of a longer record behind it counts only where the body does not say how long it is
        let longer = [&whole[..], b"left"].concat();
        assert_eq!(opened(kind, &longer), None);
        assert_eq!(opened_first(kind, &longer, |_| Some(4)), Some(&b"body"[..]));
    }
}
