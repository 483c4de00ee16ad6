//! The states behind tokens: immutable, few, found by a hash of the request that made them.

use super::macro_step::{DisplayOffset, MacroStepPosition, PeakMotion};
use super::step_history::StepHistory;
use super::{Mode, Token, Trial};
use bimorph_multibody::planar::Pose;
use bimorph_solve::time::method::Motion;
use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

/// States held at most; the least recently used goes first. A circuit needs its last accepted state and its trials.
const MAX_STATES: usize = 64;
/// Bytes of states held beyond [`KEPT`] of them.
const MAX_BYTES: usize = 32 << 20;
/// States kept when the circuit says which one it accepted.
const KEPT: usize = 8;

/// Everything the next step depends on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Snapshot {
    /// Displacements.
    pub q: Vec<Pose>,
    /// Rates.
    pub v: Vec<Pose>,
    /// Rise of each heater (K).
    pub rise: Vec<f64>,
    /// Source voltages (V).
    pub sources: Vec<f64>,
    /// Where parts that friction holds at rest stick along their stops (m); none after a motion.
    pub anchors: Vec<f64>,
    /// First internal step of what follows (s).
    pub next_step: f64,
    /// Time since the equilibrium that the motion began from (s).
    pub elapsed: f64,
    /// Values that the circuit has received.
    pub shown: StepHistory,
    /// State of a formulation between steps, beside the bodies' motion.
    pub carried: Vec<Motion>,
    /// Position in a macro step; none: the state lies in none.
    pub macro_step: Option<Box<MacroStepPosition>>,
    /// Offset of the displayed motion `q`, `v` from the integrated one, after a macro step.
    pub offset: Option<Box<DisplayOffset>>,
    /// Points until macro steps are made again.
    pub pause: u32,
    /// Largest motion since the equilibrium.
    pub peak: PeakMotion,
    /// Displacements of that equilibrium; empty for zero displacements.
    pub origin: Arc<[Pose]>,
}

/// Held states, in order of last use.
#[derive(Debug, Default)]
pub struct States {
    held: HashMap<Token, (Option<Token>, Arc<Snapshot>)>,
    used: VecDeque<Token>,
    bytes: usize,
}

impl States {
    /// The state of a token, if it is still held.
    pub fn get(&mut self, token: Token) -> Option<Arc<Snapshot>> {
        let state = self.held.get(&token).map(|(_, s)| Arc::clone(s))?;
        self.touch(token);
        Some(state)
    }

    /// The state that one of those held was tried from; none: the model at rest.
    pub(super) fn parent(&self, token: Token) -> Option<Token> {
        self.held.get(&token).and_then(|(parent, _)| *parent)
    }

    /// Stores the outcome of a request under the request's token.
    pub fn insert(&mut self, request: &Trial<'_>, snapshot: Snapshot) -> Token {
        let token = name(request);
        self.put(token, request.parent, snapshot);
        token
    }

    /// Stores a state under a token that it had before.
    pub(super) fn put(&mut self, token: Token, parent: Option<Token>, snapshot: Snapshot) {
        self.forget(token);
        self.bytes += size(&snapshot);
        self.held.insert(token, (parent, Arc::new(snapshot)));
        self.touch(token);
        while self.used.len() > MAX_STATES || (self.used.len() > KEPT && self.bytes > MAX_BYTES) {
            if let Some(old) = self.used.pop_front() {
                self.forget(old);
            }
        }
    }

    /// States held.
    pub(super) fn len(&self) -> usize {
        self.used.len()
    }

    /// Tokens, parents and states, the least recently used first.
    pub(super) fn in_order(&self) -> impl Iterator<Item = (Token, Option<Token>, &Snapshot)> {
        self.used.iter().filter_map(|token| self.held.get(token).map(|(parent, state)| (*token, *parent, &**state)))
    }

    /// Some of them alone, as they were.
    ///
    /// # Errors
    /// The first token that is not held.
    pub(super) fn only(&self, tokens: &[Token]) -> Result<Self, Token> {
        let mut alone = Self::default();
        for &token in tokens {
            let (parent, state) = self.held.get(&token).ok_or(token)?;
            alone.put(token, *parent, Snapshot::clone(state));
        }
        Ok(alone)
    }

    fn forget(&mut self, token: Token) {
        if let Some((_, state)) = self.held.remove(&token) {
            self.bytes -= size(&state);
        }
    }

    /// Frees the other trials of the accepted state's parent, and all but the last used states.
    pub fn accept(&mut self, token: Token) {
        let Some(&(parent, _)) = self.held.get(&token) else { return };
        let rivals: Vec<Token> = (self.used.iter().copied())
            .filter(|t| *t != token && self.held.get(t).is_some_and(|(p, _)| *p == parent && parent.is_some()))
            .collect();
        for rival in rivals {
            self.forget(rival);
        }
        self.used.retain(|t| self.held.contains_key(t));
        self.touch(token);
        while self.used.len() > KEPT {
            if let Some(old) = self.used.pop_front() {
                self.forget(old);
            }
        }
    }

    /// Bytes that the states take, about.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    fn touch(&mut self, token: Token) {
        // recent tokens stand at the back, so the search is short
        if let Some(at) = self.used.iter().rposition(|t| *t == token) {
            self.used.remove(at);
        }
        self.used.push_back(token);
    }
}

fn size(s: &Snapshot) -> usize {
    (s.q.len() + s.v.len()) * size_of::<Pose>()
        + s.carried.iter().map(|m| m.q.len() + m.v.len()).sum::<usize>() * size_of::<Pose>()
        + s.macro_step.as_ref().map_or(0, |position| position.bytes())
        + s.offset.as_ref().map_or(0, |offset| offset.bytes())
        + size_of_val(&s.origin[..])
        + (s.rise.len() + s.sources.len() + s.anchors.len() + s.shown.doubles()) * 8
        + size_of::<Snapshot>()
}

/// The token of a request: FNV-1a over all that its answer depends on, folded to 53 bits and never 0.
fn name(request: &Trial<'_>) -> Token {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |word: u64| {
        for byte in word.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    eat(request.parent.map_or(0, |t| t.0));
    eat(match request.mode {
        Mode::Static => 1,
        Mode::Transient => request.dt.to_bits(),
    });
    for v in request.voltages {
        eat(v.to_bits());
    }
    let folded = (hash >> 53) ^ (hash & ((1 << 53) - 1));
    Token(folded.max(1))
}
