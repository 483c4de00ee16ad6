//! Where messages end in a stream of gRPC, however it is cut into frames.

/// Where a stream of gRPC messages stands: each has five bytes before it, a flag and the length.
#[derive(Debug, Default)]
pub(super) struct Framing {
    head: [u8; 5],
    have: usize,
    left: usize,
}

impl Framing {
    /// More of the stream has come.
    pub(super) fn take(&mut self, mut data: &[u8]) {
        while !data.is_empty() {
            if self.left > 0 {
                let n = self.left.min(data.len());
                self.left -= n;
                data = &data[n..];
                continue;
            }
            let n = (5 - self.have).min(data.len());
            self.head[self.have..self.have + n].copy_from_slice(&data[..n]);
            self.have += n;
            data = &data[n..];
            if self.have == 5 {
                let [_, a, b, c, d] = self.head;
                self.left = u32::from_be_bytes([a, b, c, d]) as usize;
                self.have = 0;
            }
        }
    }

    /// Between two messages.
    pub(super) fn whole(&self) -> bool {
        self.left == 0 && self.have == 0
    }
}

#[cfg(test)]
mod tests {
    //! However messages are cut into frames, their ends are found.
    use super::*;

    #[test]
    fn ends_of_messages_are_found() {
        let bytes = [0, 0, 0, 0, 3, 7, 7, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 9];
        let ends = [8, 13, 19];
        for size in 1..=bytes.len() {
            let mut framing = Framing::default();
            let mut at = 0;
            for chunk in bytes.chunks(size) {
                framing.take(chunk);
                at += chunk.len();
                assert_eq!(framing.whole(), ends.contains(&at), "{size} {at}");
            }
        }
    }
}
