//! Calls that are repeated where the network fails.

use super::analyses::{Client, ClientError};
use std::time::Duration;

/// Attempts in a row without a word, after which a server is given up.
const ATTEMPTS: u32 = 6;
/// Pause before the second attempt; each further one is twice as long.
const PAUSE: Duration = Duration::from_millis(100);

impl Client {
    /// Asks again, on a new connection, where the network fails. `ask` returns whether it received progress. For
    /// idempotent calls alone.
    pub(super) fn persist<T>(
        &mut self,
        mut ask: impl FnMut(&Self, &mut bool) -> Result<T, ClientError>,
    ) -> Result<T, ClientError> {
        let mut attempts = 0;
        loop {
            let mut heard = false;
            let lost = match ask(self, &mut heard) {
                Err(error) if ["Unavailable", "DeadlineExceeded"].contains(&&*error.code) => error,
                answer => return answer,
            };
            attempts = if heard { 1 } else { attempts + 1 };
            let mut lost = Some(lost);
            while let Some(error) = lost {
                if attempts >= ATTEMPTS {
                    return Err(error);
                }
                std::thread::sleep(PAUSE * (1 << (attempts - 1)));
                lost = self.reconnect().err();
                attempts += u32::from(lost.is_some());
            }
        }
    }
}
