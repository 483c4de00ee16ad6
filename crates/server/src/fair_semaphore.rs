//! Places for computations, taken in turns of clients.
//!
//! A client with many computations waits for its own, and others do not wait for it. Of those that wait, each client gets one place
//! before any gets its second, and so do the connections of one client. Where every client has a place of its own, a client of which
//! nothing is computed does not wait at all: the operating system shares the processors among the threads.

use super::accounts::Account;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::oneshot;

tokio::task_local! {
    /// Owner of the current task.
    pub(super) static CLIENT: TaskOwner;
}

/// Owner of a task.
#[derive(Debug, Clone, Default)]
pub(super) struct TaskOwner {
    /// The connection; 0 for the server's own.
    pub(super) number: u64,
    /// Its name; equal names are one client.
    pub(super) name: Arc<str>,
    /// The client's account on this server.
    pub(super) account: Option<Arc<Account>>,
}

impl TaskOwner {
    /// Whose turn it is when a computation of this task waits.
    pub(super) fn party(&self) -> Waiter {
        Waiter { client: Arc::clone(&self.name), number: self.number }
    }
}

/// Owner of the current task; the server itself where no client is known.
pub(super) fn client() -> TaskOwner {
    CLIENT.try_with(TaskOwner::clone).unwrap_or_default()
}

/// A waiting task: its client, and its connection or job.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Waiter {
    pub(super) client: Arc<str>,
    pub(super) number: u64,
}

/// So many places.
#[derive(Debug)]
pub(super) struct FairSemaphore {
    state: Mutex<SemaphoreState>,
    /// Whether a client that has no place gets one beside those that are shared.
    own: bool,
}

type PermitSender = oneshot::Sender<Permit>;
/// Waiting entries by owner; the next one comes first.
type FairQueue<K, T> = VecDeque<(K, T)>;

#[derive(Debug)]
struct SemaphoreState {
    /// Shared places that are free.
    free: usize,
    waiting: FairQueue<Arc<str>, FairQueue<u64, VecDeque<PermitSender>>>,
    /// Places that each client has, its own among them.
    taken: BTreeMap<Arc<str>, usize>,
}

/// A place; dropped, it goes to the next in turn.
#[derive(Debug)]
pub(super) struct Permit {
    turns: Option<Arc<FairSemaphore>>,
    party: Waiter,
    /// Whether it is one that is shared.
    shared: bool,
}

impl Permit {
    /// Whose it is.
    pub(super) fn party(&self) -> Waiter {
        self.party.clone()
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let Some(turns) = self.turns.take() else { return };
        let mut state = turns.state();
        state.free += usize::from(self.shared);
        state.leave(&self.party.client);
        turns.serve(&mut state);
    }
}

impl SemaphoreState {
    fn leave(&mut self, client: &Arc<str>) {
        if let Some(count) = self.taken.get_mut(client) {
            *count -= 1;
            if *count == 0 {
                self.taken.remove(client);
            }
        }
    }

    fn wait(&mut self, party: &Waiter, sender: PermitSender) {
        let own = of(&mut self.waiting, &party.client);
        of(own, &party.number).push_back(sender);
    }

    /// The next waiting task and its owner: of any client, or of the given one.
    fn next(&mut self, only: Option<&str>) -> Option<(Waiter, PermitSender)> {
        loop {
            let at = only.map_or(Some(0), |only| self.waiting.iter().position(|(client, _)| **client == *only))?;
            let (client, mut own) = self.waiting.remove(at)?;
            let found = own.pop_front().and_then(|(number, mut senders)| {
                let sender = senders.pop_front();
                if !senders.is_empty() {
                    own.push_back((number, senders));
                }
                sender.map(|sender| (Waiter { client: Arc::clone(&client), number }, sender))
            });
            if !own.is_empty() {
                self.waiting.push_back((client, own));
            }
            // those that went away are passed over
            if let Some((party, sender)) = found
                && !sender.is_closed()
            {
                return Some((party, sender));
            }
        }
    }
}

/// The entry of a key, inserted if missing.
fn of<'a, K: PartialEq + Clone, T: Default>(queue: &'a mut FairQueue<K, T>, key: &K) -> &'a mut T {
    let at = queue.iter().position(|(other, _)| other == key).unwrap_or_else(|| {
        queue.push_back((key.clone(), T::default()));
        queue.len() - 1
    });
    &mut queue[at].1
}

impl FairSemaphore {
    /// So many places, all shared.
    pub(super) fn new(places: usize) -> Arc<Self> {
        Self::with(places, false)
    }

    /// So many places, and one more for each client that has none.
    pub(super) fn and_own(places: usize) -> Arc<Self> {
        Self::with(places, true)
    }

    fn with(places: usize, own: bool) -> Arc<Self> {
        let state = SemaphoreState { free: places.max(1), waiting: VecDeque::new(), taken: BTreeMap::new() };
        Arc::new(Self { state: Mutex::new(state), own })
    }

    fn state(&self) -> MutexGuard<'_, SemaphoreState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a place for a client. Dropped, it waits no more.
    pub(super) async fn place(self: &Arc<Self>, party: Waiter) -> Permit {
        let (sender, waits) = oneshot::channel();
        {
            let mut state = self.state();
            state.wait(&party, sender);
            self.serve(&mut state);
        }
        // a sender goes away with its place alone
        waits.await.unwrap_or(Permit { turns: None, party, shared: false })
    }

    /// How many wait for a place.
    pub(super) fn waiting(&self) -> usize {
        let state = self.state();
        let all = state.waiting.iter().flat_map(|(_, own)| own).flat_map(|(_, senders)| senders);
        all.filter(|sender| !sender.is_closed()).count()
    }

    /// Gives out what is free.
    fn serve(self: &Arc<Self>, state: &mut SemaphoreState) {
        while state.free > 0 {
            let Some(next) = state.next(None) else { return };
            state.free -= usize::from(self.give(state, next, true));
        }
        if !self.own {
            return;
        }
        let without = |state: &SemaphoreState, client: &Arc<str>| !state.taken.contains_key(client);
        let poor: Vec<Arc<str>> =
            state.waiting.iter().filter(|(client, _)| without(state, client)).map(|(c, _)| Arc::clone(c)).collect();
        for client in poor {
            while without(state, &client) {
                let Some(next) = state.next(Some(&client)) else { break };
                self.give(state, next, false);
            }
        }
    }

    /// Gives a place; whether it was taken.
    fn give(
        self: &Arc<Self>,
        state: &mut SemaphoreState,
        (party, sender): (Waiter, PermitSender),
        shared: bool,
    ) -> bool {
        *state.taken.entry(Arc::clone(&party.client)).or_default() += 1;
        match sender.send(Permit { turns: Some(Arc::clone(self)), party, shared }) {
            Ok(()) => true,
            Err(mut place) => {
                // the client went away, and the state is locked here
                place.turns = None;
                state.leave(&place.party.client);
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    //! Clients take turns, those that went away are passed over, and no place is lost.
    use super::*;
    use std::future::Future;
    use std::pin::{Pin, pin};
    use std::task::{Context, Poll, Waker};

    fn party(client: &str, number: u64) -> Waiter {
        Waiter { client: client.into(), number }
    }

    type Waiting<'a> = Vec<Pin<Box<dyn Future<Output = Permit> + 'a>>>;

    /// The places that are given now.
    fn given(waiting: &mut Waiting<'_>) -> Vec<Permit> {
        let mut cx = Context::from_waker(Waker::noop());
        let mut given = Vec::new();
        waiting.retain_mut(|waits| match waits.as_mut().poll(&mut cx) {
            Poll::Ready(place) => {
                given.push(place);
                false
            }
            Poll::Pending => true,
        });
        given
    }

    /// One place; of clients a, b and c the connections 1 and 2 wait.
    #[test]
    fn clients_and_their_connections_take_turns() {
        let turns = FairSemaphore::new(1);
        let ask = |client: &str, number| -> Pin<Box<dyn Future<Output = Permit>>> {
            let (turns, party) = (Arc::clone(&turns), party(client, number));
            Box::pin(async move { turns.place(party).await })
        };
        let mut waiting: Waiting<'_> = vec![ask("a", 1)];
        let mut places = given(&mut waiting);
        assert_eq!(places.len(), 1, "one is free");
        let asked = [("a", 1), ("a", 1), ("a", 2), ("b", 1), ("c", 1), ("b", 1)];
        waiting.extend(asked.map(|(client, number)| ask(client, number)));
        assert!(given(&mut waiting).is_empty());
        // the only one of client c goes away
        drop(waiting.remove(4));
        assert_eq!(turns.waiting(), 5);
        let mut order = Vec::new();
        while !waiting.is_empty() {
            drop(places);
            places = given(&mut waiting);
            assert_eq!(places.len(), 1, "a place is passed on");
            order.extend(places.iter().map(|place| format!("{}{}", place.party().client, place.party().number)));
        }
        assert_eq!(order, ["a1", "b1", "a2", "b1", "a1"]);
        drop(places);
        assert!(pin!(turns.place(party("z", 9))).poll(&mut Context::from_waker(Waker::noop())).is_ready());
    }

    /// A client that has no place gets one of its own at once, and no second one before its turn.
    #[test]
    fn a_client_without_a_place_gets_its_own() {
        let turns = FairSemaphore::and_own(2);
        let ask = |client: &str| -> Pin<Box<dyn Future<Output = Permit>>> {
            let (turns, party) = (Arc::clone(&turns), party(client, 1));
            Box::pin(async move { turns.place(party).await })
        };
        let mut waiting: Waiting<'_> = (0..6).map(|_| ask("a")).collect();
        let mut shared = given(&mut waiting);
        assert_eq!(shared.len(), 2);
        waiting.extend([ask("b"), ask("b")]);
        let own = given(&mut waiting);
        assert_eq!(own.len(), 1);
        assert_eq!(&*own[0].party().client, "b");
        // its own place is used again by itself alone
        drop(own);
        let own = given(&mut waiting);
        assert_eq!((own.len(), &*own[0].party().client), (1, "b"));
        drop(own);
        assert!(given(&mut waiting).is_empty(), "it is not one for all");
        drop(shared.pop());
        assert_eq!(given(&mut waiting).len(), 1);
    }
}
