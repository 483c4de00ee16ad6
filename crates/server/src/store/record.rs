//! Stored state of a session, as bytes with a checksum.

use crate::snapshots::checksum;

/// Magic bytes of a file.
pub(crate) const HEAD: &[u8; 16] = b"bimorph states 2";
/// Head, checksum, sequence number, token, lease, length.
const BEFORE: usize = 16 + 16 + 4 * 8;

/// Stored state of a session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SessionRecord {
    pub(crate) sequence: u64,
    /// The last accepted state; 0: none yet.
    pub(crate) accepted: u64,
    /// For how long it is kept without use (ms); 0: as long as any.
    pub(crate) lease_ms: u64,
    /// States in their envelope.
    pub(crate) sealed: Vec<u8>,
}

impl SessionRecord {
    pub(crate) fn write(sequence: u64, accepted: u64, lease_ms: u64, sealed: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(BEFORE + sealed.len());
        out.extend(HEAD);
        out.extend([0; 16]);
        for word in [sequence, accepted, lease_ms, sealed.len() as u64] {
            out.extend(word.to_le_bytes());
        }
        out.extend(sealed);
        let sum = checksum(&out[32..]);
        out[16..32].copy_from_slice(&sum.to_le_bytes());
        out
    }

    /// None for a file that is not whole: the server ended while it was written.
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let (head, rest) = bytes.split_at_checked(32)?;
        let word = |k: usize| rest.get(8 * k..8 * k + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        let [sequence, accepted, lease_ms, length] = [word(0)?, word(1)?, word(2)?, word(3)?];
        let whole = rest.get(..usize::try_from(length).ok()?.checked_add(BEFORE - 32)?)?;
        let good = head.starts_with(HEAD) && head[16..] == checksum(whole).to_le_bytes();
        good.then(|| Self { sequence, accepted, lease_ms, sealed: whole[BEFORE - 32..].to_vec() })
    }
}
