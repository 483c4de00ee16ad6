//! Unguessable ids: the id of a session or a sweep authorizes its use, and only its client receives it. Clients name
//! their requests so as well.

use std::fs::File;
use std::io::Read;
use std::sync::Mutex;
use std::sync::PoisonError;
use tonic::Status;

/// Where the system gives random bytes.
const SOURCE: &str = "/dev/urandom";

/// Makes ids of 128 random bits from the system, as 32 hexadecimal digits.
#[derive(Debug, Default)]
pub struct Ids(Mutex<Option<File>>);

impl Ids {
    /// A new id.
    pub fn make(&self) -> Result<String, Status> {
        let mut source = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut bytes = [0; 16];
        let file = match &mut *source {
            Some(file) => file,
            empty => empty.insert(File::open(SOURCE).map_err(|error| no_bytes(&error))?),
        };
        file.read_exact(&mut bytes).map_err(|error| no_bytes(&error))?;
        Ok(format!("{:032x}", u128::from_le_bytes(bytes)))
    }
}

fn no_bytes(error: &std::io::Error) -> Status {
    Status::unavailable(format!("the system gives no random bytes for an id ({SOURCE}: {error})"))
}

#[cfg(test)]
mod tests {
    //! Ids are 32 digits, and differ in about half of their bits.
    use super::*;

    #[test]
    fn ids_differ_in_half_of_their_bits() {
        let ids = Ids::default();
        let made: Vec<u128> = (0..200)
            .map(|_| {
                let id = ids.make().expect("random bytes");
                assert_eq!(id.len(), 32, "{id}");
                u128::from_str_radix(&id, 16).expect("hexadecimal")
            })
            .collect();
        let bits: u32 = made.windows(2).map(|pair| (pair[0] ^ pair[1]).count_ones()).sum();
        // 199 pairs of 128 bits: 12 736 on average with a standard deviation of 80
        assert!((12_300..13_200).contains(&bits), "{bits}");
    }
}
