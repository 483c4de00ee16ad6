//! Storage for temporary values: a released slot serves the next user.
//!
//! Contributions to a body accumulate between the first elimination that contributes and its own. Along a chain one
//! place serves all bodies one after the other and stays in the nearest cache; a place for each body would cross from
//! main memory and back.

/// Places for `of.len()` users, each of which holds one for a time.
#[derive(Debug)]
pub(super) struct Slots {
    /// Place of each user; `u32::MAX`: none yet, or not any more.
    of: Vec<u32>,
    free: Vec<u32>,
    count: u32,
}

impl Slots {
    pub(super) fn new(users: usize) -> Self {
        Self { of: vec![u32::MAX; users], free: Vec::new(), count: 0 }
    }

    /// The slot of `user`, allocated on first use.
    pub(super) fn hold(&mut self, user: usize) -> u32 {
        if self.of[user] == u32::MAX {
            self.of[user] = self.free.pop().unwrap_or_else(|| {
                self.count += 1;
                self.count - 1
            });
        }
        self.of[user]
    }

    /// Takes the place of `user` back.
    pub(super) fn release(&mut self, user: usize) {
        self.free.push(std::mem::replace(&mut self.of[user], u32::MAX));
    }

    /// Places that were in use at one time.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }
}
