//! Stored netlist and options of a model, as bytes with a checksum.

use bimorph_jobs::durable::record::{opened, sealed};
use bimorph_wire::proto;
use prost::Message;

/// Magic bytes of a file.
const HEAD: &[u8; 16] = b"bimorph models 1";

/// The bytes of a file.
pub(super) fn write(source: &proto::CompileRequest) -> Vec<u8> {
    sealed(HEAD, source.encoded_len(), |out| out.extend(source.encode_to_vec()))
}

/// None for a file that is damaged, or of another version.
pub(super) fn read(bytes: &[u8]) -> Option<proto::CompileRequest> {
    proto::CompileRequest::decode(opened(HEAD, bytes)?).ok()
}

#[cfg(test)]
mod tests {
    //! Each changed bit and each cut of a file is noticed.
    use super::*;

    #[test]
    fn damaged_files_are_rejected() {
        let files = [("a.net".to_owned(), "anchor * [a] []".to_owned())].into();
        let bundle = proto::Bundle { root: "a.net".into(), files };
        let source = proto::CompileRequest { bundle: Some(bundle), options: None };
        let whole = write(&source);
        assert_eq!(read(&whole), Some(source));
        for bit in 0..8 * whole.len() {
            let mut wrong = whole.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(read(&wrong), None, "{bit}");
        }
        assert!((0..whole.len()).all(|cut| read(&whole[..cut]).is_none()));
    }
}
