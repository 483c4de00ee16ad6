//! At most one computation runs for each channel. A newer request stops the older one, and one that waits for it is refused at once.

use crate::refusal::Refusal;
use bimorph_base::budget::{self, Allowance, Budget};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes that one computation may allocate in total.
const MAX_BYTES: usize = 8 << 30;
/// Mechanical unknowns of one model.
const MAX_UNKNOWNS: usize = 2_000_000;
/// Channels of all pages.
const MAX_CHANNELS: usize = 64;

/// The newest request of each channel.
#[derive(Debug, Default)]
pub(crate) struct Channels {
    slots: Mutex<HashMap<String, ChannelSlot>>,
}

#[derive(Debug, Clone)]
struct ChannelSlot {
    newest: Budget,
    turn: Arc<tokio::sync::Mutex<()>>,
}

/// Stops the computation when the connection of its request is dropped.
struct StopOnDrop(Budget);

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

impl Channels {
    /// Runs `job` as the newest of its channel, on a thread of its own, under a budget.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        channel: &str,
        job: impl FnOnce(&Budget) -> Result<T, Refusal> + Send + 'static,
    ) -> Result<T, Refusal> {
        let allowance = Allowance { bytes: MAX_BYTES, unknowns: MAX_UNKNOWNS, ..Allowance::default() };
        let budget = Budget::new(allowance);
        let turn = self.enter(channel, &budget)?;
        let _stop = StopOnDrop(budget.clone());
        let held = turn.lock_owned().await;
        let work = tokio::task::spawn_blocking(move || {
            // the next of this channel begins when this one has ended
            let _held = held;
            match budget::within(&budget, || job(&budget)) {
                Ok(result) => result,
                Err(stopped) => Err(stopped.into()),
            }
        });
        work.await.unwrap_or_else(|_| Err(Refusal::of("the computation ended without a result; please report this")))
    }

    /// Stops the older request and takes its place.
    fn enter(&self, channel: &str, budget: &Budget) -> Result<Arc<tokio::sync::Mutex<()>>, Refusal> {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        if slots.len() >= MAX_CHANNELS && !slots.contains_key(channel) {
            slots.retain(|_, slot| Arc::strong_count(&slot.turn) > 1);
            if slots.len() >= MAX_CHANNELS {
                return Err(Refusal::of(format!("more than {MAX_CHANNELS} requests of different channels at once")));
            }
        }
        let slot = slots
            .entry(channel.to_owned())
            .and_modify(|slot| slot.newest.cancel())
            .or_insert_with(|| ChannelSlot { newest: budget.clone(), turn: Arc::default() });
        slot.newest = budget.clone();
        Ok(Arc::clone(&slot.turn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    /// A newer request stops a computation without end, and requests of other channels run meanwhile.
    #[test]
    fn the_newest_wins() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let channels = Arc::new(Channels::default());
            let endless = |_: &Budget| -> Result<u32, Refusal> {
                loop {
                    budget::check();
                }
            };
            let first = tokio::spawn({
                let channels = Arc::clone(&channels);
                async move { channels.run("a", endless).await }
            });
            tokio::time::sleep(Duration::from_millis(20)).await;
            assert_eq!(channels.run("b", |_| Ok(7)).await.unwrap(), 7);
            let start = Instant::now();
            assert_eq!(channels.run("a", |_| Ok(8)).await.unwrap(), 8);
            assert!(first.await.unwrap().unwrap_err().superseded);
            assert!(start.elapsed() < Duration::from_secs(5));
        });
    }

    /// A request whose connection is lost is stopped.
    #[test]
    fn a_lost_request_stops() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let channels = Channels::default();
            let (sender, ended) = std::sync::mpsc::channel();
            let endless = move |budget: &Budget| -> Result<(), Refusal> {
                let _ = sender.send(budget.clone());
                loop {
                    budget::check();
                }
            };
            let run = channels.run("a", endless);
            assert!(tokio::time::timeout(Duration::from_millis(20), run).await.is_err());
            let budget = ended.recv().unwrap();
            assert!(budget::within(&budget, || ()).is_err(), "it is cancelled");
        });
    }
}
