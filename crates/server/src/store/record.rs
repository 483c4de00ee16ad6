//! Stored state of a session, as bytes with a checksum.

use bimorph_jobs::durable::record;

/// Magic bytes of a file.
pub(crate) const HEAD: &[u8; 16] = b"bimorph states 2";
/// Sequence number, token, lease, length.
const BEFORE: usize = 4 * 8;

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
        record::sealed(HEAD, BEFORE + sealed.len(), |out| {
            for word in [sequence, accepted, lease_ms, sealed.len() as u64] {
                out.extend(word.to_le_bytes());
            }
            out.extend(sealed);
        })
    }

    /// None for a file that is not whole: the server ended while it was written.
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let word = |body: &[u8], k: usize| Some(u64::from_le_bytes(body.get(8 * k..8 * k + 8)?.try_into().ok()?));
        let length = |body: &[u8]| usize::try_from(word(body, 3)?).ok()?.checked_add(BEFORE);
        let body = record::opened_first(HEAD, bytes, length)?;
        let [sequence, accepted, lease_ms] = [word(body, 0)?, word(body, 1)?, word(body, 2)?];
        Some(Self { sequence, accepted, lease_ms, sealed: body.get(BEFORE..)?.to_vec() })
    }
}
