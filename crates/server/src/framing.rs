//! Where messages end in a stream of gRPC, however it is cut into frames; only whole ones are passed on.
//!
//! The decoder behind allocates the length that a message announces. So a message waits here until all of it is there, and what waits
//! takes the memory of what has arrived: a client that announces much and sends little costs little.

use std::collections::VecDeque;
use tonic::codegen::Bytes;

/// Bytes before each message: a flag and the length.
const HEAD: usize = 5;
/// Sizes of the pieces in which an unfinished message waits (byte).
const PIECE: std::ops::RangeInclusive<usize> = (4 << 10)..=(256 << 10);

/// The messages of a stream as they come in.
#[derive(Debug, Default)]
pub(super) struct Framing {
    /// The first bytes of the message that is being received, its head first.
    pieces: Vec<Vec<u8>>,
    /// Bytes in all pieces.
    have: usize,
    /// Length that the message announces, without its head; none: not known yet.
    length: Option<usize>,
    whole: VecDeque<Bytes>,
}

impl Framing {
    /// More of the stream has come. `announce` receives the length of each message as soon as it is known.
    ///
    /// # Errors
    /// Those of `announce`, after which nothing more may come.
    pub(super) fn take<E>(
        &mut self,
        mut data: Bytes,
        mut announce: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<(), E> {
        // messages that are whole within these bytes pass as they are
        let mut passed = 0;
        while self.have == 0 && data.len() - passed >= HEAD {
            let length = length(&data[passed..]);
            if data.len() - passed - HEAD < length {
                break;
            }
            announce(length)?;
            passed += HEAD + length;
        }
        if passed > 0 {
            self.whole.push_back(data.split_to(passed));
        }
        let mut data = &*data;
        while !data.is_empty() {
            let left = self.length.map_or(HEAD, |length| HEAD + length) - self.have;
            let (now, rest) = data.split_at(left.min(data.len()));
            self.keep(now);
            data = rest;
            if self.have == HEAD && self.length.is_none() {
                let length = length(&self.pieces[0]);
                self.length = Some(length);
                announce(length)?;
            }
            if self.length.is_some_and(|length| self.have == HEAD + length) {
                self.whole.extend(self.pieces.drain(..).map(Bytes::from));
                (self.have, self.length) = (0, None);
            }
        }
        Ok(())
    }

    /// Copies: a frame may be a small part of a large buffer.
    fn keep(&mut self, mut data: &[u8]) {
        while !data.is_empty() {
            let room = self.pieces.last().map_or(0, |piece| piece.capacity() - piece.len());
            if room == 0 {
                // the head has a piece of its own, and no more is taken than as much again as there is
                let size = if self.have == 0 { HEAD } else { self.have.clamp(*PIECE.start(), *PIECE.end()) };
                self.pieces.push(Vec::with_capacity(size));
                continue;
            }
            let (now, rest) = data.split_at(room.min(data.len()));
            if let Some(piece) = self.pieces.last_mut() {
                piece.extend_from_slice(now);
            }
            self.have += now.len();
            data = rest;
        }
    }

    /// The next part of messages that are whole.
    pub(super) fn next(&mut self) -> Option<Bytes> {
        self.whole.pop_front()
    }

    /// Whether parts of whole messages are left.
    pub(super) fn is_empty(&self) -> bool {
        self.whole.is_empty()
    }

    /// Between two messages.
    pub(super) fn is_between(&self) -> bool {
        self.have == 0
    }
}

fn length(head: &[u8]) -> usize {
    head.get(1..HEAD).map_or(0, |bytes| bytes.iter().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
}

#[cfg(test)]
mod tests {
    //! However messages are cut into frames, they pass as they are and when they are whole.
    use super::*;

    #[test]
    fn whole_messages_pass() {
        let bytes = [0, 0, 0, 0, 3, 7, 8, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 9];
        let ends = [8, 13, 19];
        for size in 1..=bytes.len() {
            let (mut framing, mut lengths, mut passed) = (Framing::default(), Vec::new(), Vec::new());
            let mut at = 0;
            for chunk in bytes.chunks(size) {
                let announce = |length| {
                    lengths.push(length);
                    Ok::<_, ()>(())
                };
                framing.take(Bytes::copy_from_slice(chunk), announce).expect("announced");
                at += chunk.len();
                while let Some(part) = framing.next() {
                    passed.extend_from_slice(&part);
                }
                let whole = ends.iter().filter(|end| **end <= at).max().copied().unwrap_or(0);
                assert_eq!((passed.len(), framing.is_between()), (whole, whole == at), "{size} {at}");
            }
            assert_eq!((&*passed, &*lengths), (&bytes[..], &[3, 0, 1][..]), "{size}");
        }
    }

    #[test]
    fn an_announced_message_takes_what_has_arrived() {
        let mut framing = Framing::default();
        framing.take(Bytes::from_static(&[0, 4, 0, 0, 0]), |_| Ok::<_, ()>(())).expect("announced");
        let capacity = |framing: &Framing| framing.pieces.iter().map(Vec::capacity).sum::<usize>();
        assert!(capacity(&framing) <= 16);
        for _ in 0..1000 {
            framing.take(Bytes::from_static(&[1; 100]), |_| Ok::<_, ()>(())).expect("announced");
        }
        assert!((100_000..=250_000).contains(&capacity(&framing)), "{}", capacity(&framing));
        assert!(framing.is_empty() && !framing.is_between());
    }
}
