//! Places that clients take in turn.
//!
//! Who asks for many computations at once waits for its own, not others for it: of those that wait, each connection gets
//! one place before any gets its second.

use super::accounts::Account;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::oneshot;

tokio::task_local! {
    /// Whom the task at hand works for.
    pub(super) static CLIENT: Client;
}

/// Whom a task works for.
#[derive(Debug, Clone, Default)]
pub(super) struct Client {
    /// The connection; 0 for the server's own.
    pub(super) number: u64,
    /// What it is called; all of one name are one.
    pub(super) name: Arc<str>,
    /// What the client has of this server, where that is bounded.
    pub(super) account: Option<Arc<Account>>,
}

/// Whom this task works for; the server itself where nobody is known.
pub(super) fn client() -> Client {
    CLIENT.try_with(Client::clone).unwrap_or_default()
}

/// So many places.
#[derive(Debug)]
pub(super) struct Turns(Mutex<State>);

#[derive(Debug)]
struct State {
    free: usize,
    /// Those that wait, by client; the client whose turn is next in front.
    waiting: VecDeque<(u64, VecDeque<oneshot::Sender<Place>>)>,
}

/// A place; dropped, it goes to who is next.
#[derive(Debug)]
pub(super) struct Place {
    turns: Option<Arc<Turns>>,
    client: u64,
}

impl Place {
    /// Whose it is.
    pub(super) fn client(&self) -> u64 {
        self.client
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        if let Some(turns) = self.turns.take() {
            turns.pass_on();
        }
    }
}

impl Turns {
    pub(super) fn new(places: usize) -> Arc<Self> {
        Arc::new(Self(Mutex::new(State { free: places.max(1), waiting: VecDeque::new() })))
    }

    /// Waits for a place for a client. Dropped, it waits no more.
    pub(super) async fn place(self: &Arc<Self>, client: u64) -> Place {
        let waits = {
            let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if state.free > 0 {
                state.free -= 1;
                return Place { turns: Some(Arc::clone(self)), client };
            }
            let (sender, waits) = oneshot::channel();
            match state.waiting.iter_mut().find(|(other, _)| *other == client) {
                Some((_, own)) => own.push_back(sender),
                None => state.waiting.push_back((client, VecDeque::from([sender]))),
            }
            waits
        };
        // a sender goes away with its place alone
        waits.await.unwrap_or(Place { turns: None, client })
    }

    /// How many wait for a place.
    pub(super) fn waiting(&self) -> usize {
        let state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        state.waiting.iter().map(|(_, own)| own.iter().filter(|sender| !sender.is_closed()).count()).sum()
    }

    /// Gives a place to the next client that still waits.
    fn pass_on(self: Arc<Self>) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some((client, mut own)) = state.waiting.pop_front() {
            let Some(sender) = own.pop_front() else { continue };
            if !own.is_empty() {
                state.waiting.push_back((client, own));
            }
            match sender.send(Place { turns: Some(Arc::clone(&self)), client }) {
                Ok(()) => return,
                // who does not wait any more takes none
                Err(mut place) => place.turns = None,
            }
        }
        state.free += 1;
    }
}

#[cfg(test)]
mod tests {
    //! Clients take turns, those that went away are passed over, and no place is lost.
    use super::*;
    use std::future::Future;
    use std::pin::pin;
    use std::task::{Context, Poll, Waker};

    #[test]
    fn clients_take_turns() {
        let turns = Turns::new(1);
        let mut cx = Context::from_waker(Waker::noop());
        let Poll::Ready(mut place) = pin!(turns.place(1)).poll(&mut cx) else { panic!("one is free") };
        let mut waiting: Vec<_> = [1, 1, 1, 2, 3, 2].map(|client| Box::pin(turns.place(client))).into();
        for waits in &mut waiting {
            assert!(waits.as_mut().poll(&mut cx).is_pending());
        }
        // the only one of client 3 goes away
        drop(waiting.remove(4));
        let mut order = Vec::new();
        while !waiting.is_empty() {
            drop(place);
            let ready = waiting.iter_mut().enumerate().find_map(|(k, waits)| match waits.as_mut().poll(&mut cx) {
                Poll::Ready(place) => Some((k, place)),
                Poll::Pending => None,
            });
            let (k, next) = ready.expect("a place is passed on");
            order.push(next.client());
            place = next;
            drop(waiting.remove(k));
        }
        assert_eq!(order, [1, 2, 1, 2, 1]);
        drop(place);
        assert!(pin!(turns.place(9)).poll(&mut cx).is_ready(), "the place is there again");
    }
}
