//! Requests that a device has to repeat to a server that restarted without its states.
//!
//! A trial is a pure function of its request, and its token a hash of that: the trials that led to a state, asked again in their order, lead to the
//! same state under the same token. So a client needs no more than the requests between the model at rest and the states that it may still
//! start from.

use crate::proto;
use std::collections::HashMap;

/// Most stored requests: a hundred megabytes. Beyond that nothing is asked again.
const MAX_REQUESTS: usize = 1 << 20;

/// The requests that led to the states of a device.
#[derive(Debug, Default)]
pub(super) struct Replay {
    /// The request of each state.
    made: HashMap<u64, proto::TrialRequest>,
    /// States made since the last that was accepted.
    since: Vec<u64>,
    /// There were too many.
    lost: bool,
}

impl Replay {
    /// Begins anew.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// A state that a request made.
    pub(super) fn made(&mut self, token: u64, request: &proto::TrialRequest) {
        if self.made.len() >= MAX_REQUESTS {
            self.clear();
            self.lost = true;
        }
        if !self.lost && self.made.insert(token, request.clone()).is_none() {
            self.since.push(token);
        }
    }

    /// A state was accepted: of those made since the one before, only the states that it was tried from are of use.
    pub(super) fn accept(&mut self, token: u64) {
        let mut of_use = Vec::new();
        let mut at = token;
        while self.since.contains(&at) {
            of_use.push(at);
            at = self.made.get(&at).map_or(0, |request| request.parent);
        }
        for other in self.since.drain(..).filter(|other| !of_use.contains(other)) {
            self.made.remove(&other);
        }
    }

    /// The requests that lead from the model at rest to a state, in their order; none where they are not known.
    pub(super) fn way(&self, token: u64) -> Option<Vec<proto::TrialRequest>> {
        let (mut way, mut at) = (Vec::new(), token);
        while at != 0 {
            let request = self.made.get(&at)?;
            at = request.parent;
            way.push(request.clone());
        }
        way.reverse();
        Some(way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(parent: u64, dt: f64) -> proto::TrialRequest {
        proto::TrialRequest { parent, dt, ..proto::TrialRequest::default() }
    }

    /// The path to a state consists of the operating point, which is never accepted explicitly, and accepted states;
    /// other trials are dropped.
    #[test]
    fn the_way_leads_over_parents() {
        let mut replay = Replay::default();
        for (token, parent) in [(1, 0), (2, 1), (3, 1)] {
            replay.made(token, &request(parent, token as f64));
        }
        replay.accept(3);
        replay.made(4, &request(3, 4.0));
        let way =
            |replay: &Replay, token| replay.way(token).map(|way| way.iter().map(|r| r.dt as u64).collect::<Vec<_>>());
        assert_eq!(way(&replay, 4), Some(vec![1, 3, 4]));
        assert_eq!((way(&replay, 2), way(&replay, 0)), (None, Some(Vec::new())));
        replay.clear();
        assert_eq!(way(&replay, 3), None);
    }
}
