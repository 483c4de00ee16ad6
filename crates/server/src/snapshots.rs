//! Snapshots of sessions: the device's bytes in an envelope that says what they are of.
//!
//! A name and a version of the envelope, a checksum, the version of the program (numbers may differ between versions, and a
//! continuation promises the same bits), the id of the model, and the states.

use bimorph_jobs::durable::record::checksum;
use tonic::Status;

const NAME: &[u8; 16] = b"bimorph snapshot";
const VERSION: u8 = 1;
const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// Name, version and checksum.
const HEAD: usize = 16 + 1 + 16;

/// Puts states into an envelope.
pub(super) fn seal(model: &str, states: &[u8]) -> Vec<u8> {
    let mut body = Vec::with_capacity(states.len() + 64);
    for word in [PROGRAM, model] {
        body.push(u8::try_from(word.len()).unwrap_or(u8::MAX));
        body.extend(&word.as_bytes()[..word.len().min(255)]);
    }
    body.extend(states);
    let mut out = NAME.to_vec();
    out.push(VERSION);
    out.extend(checksum(&body).to_le_bytes());
    out.extend(body);
    out
}

/// The states in an envelope, if they are of `model` and of this version of the program.
pub(super) fn open<'a>(model: &str, sealed: &'a [u8]) -> Result<&'a [u8], Status> {
    let damaged = || Status::invalid_argument("snapshot: expected the bytes that Snapshot gave, got others");
    let (head, body) = sealed.split_at_checked(HEAD).ok_or_else(damaged)?;
    if !head.starts_with(NAME) {
        return Err(damaged());
    }
    if head[16] != VERSION {
        let text = format!("snapshot: expected version {VERSION}, got {}; take it anew", head[16]);
        return Err(Status::failed_precondition(text));
    }
    if head[17..] != checksum(body).to_le_bytes() {
        return Err(damaged());
    }
    let (program, rest) = word(body).ok_or_else(damaged)?;
    let (of, states) = word(rest).ok_or_else(damaged)?;
    if program != PROGRAM.as_bytes() {
        let program = String::from_utf8_lossy(program);
        let text = format!("snapshot: it is of version {program}, this is {PROGRAM}: the numbers could differ");
        return Err(Status::failed_precondition(text));
    }
    if of != model.as_bytes() {
        let text = format!("snapshot: it is of the model {}, not of {model}", String::from_utf8_lossy(of));
        return Err(Status::failed_precondition(text));
    }
    Ok(states)
}

fn word(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first()?;
    rest.split_at_checked(usize::from(*length))
}

#[cfg(test)]
mod tests {
    //! An envelope opens for its model alone, and not when a byte of it is changed.
    use super::*;

    #[test]
    fn envelopes_open_for_their_model_alone() {
        let sealed = seal("abc", b"states");
        assert_eq!(open("abc", &sealed).expect("its own"), b"states");
        assert_eq!(open("abd", &sealed).expect_err("another model").code(), tonic::Code::FailedPrecondition);
        for at in 0..sealed.len() {
            let mut wrong = sealed.clone();
            wrong[at] ^= 1;
            assert!(open("abc", &wrong).is_err(), "{at}");
            assert!(open("abc", &sealed[..at]).is_err(), "{at}");
        }
    }
}
