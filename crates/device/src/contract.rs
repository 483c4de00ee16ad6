//! The contract of a device: requests, replies, and errors.

use bimorph_analysis::readout::{PortKind, ReadoutError};
use bimorph_base::Diagnostic;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Names an immutable state of a device: a content hash, below 2⁵³ so that it survives in a double. 0 is never used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Token(pub u64);

/// Kind of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Static equilibrium at these voltages, from the parent's branch (or from rest without a parent).
    Static,
    /// From the parent's state at `t − dt` to `t`, the voltages going linearly from the parent's to these.
    Transient,
}

/// One evaluation request of the circuit.
#[derive(Debug, Clone, Copy)]
pub struct Trial<'a> {
    /// Static or transient.
    pub mode: Mode,
    /// State to start from; none: the model at rest as drawn.
    pub parent: Option<Token>,
    /// Time at the end of the step (s). Only for messages: a trial depends on `dt`, not on `t`.
    pub t: f64,
    /// Length of the step (s); positive in [`Mode::Transient`], ignored otherwise.
    pub dt: f64,
    /// Input of the ports at `t` [V, N, W, …: [`PortKind::given`]], in the order of [`Description::ports`].
    pub voltages: &'a [f64],
}

/// Whether a trial's answer may be used.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub enum Status {
    /// The reply holds.
    #[default]
    Ok,
    /// The step was too long for the device's tolerance: ask again with at most this dt (s).
    NeedDt(f64),
    /// No answer exists; the text says why. Nothing else in the reply may be used.
    Fail(String),
}

/// The answer to a [`Trial`]. Reuse one: its vectors are refilled in place. p ports, s outputs; matrices row-major.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrialReply {
    /// The new state; none unless `status` is [`Status::Ok`].
    pub token: Option<Token>,
    /// Whether the rest may be used.
    pub status: Status,
    /// Conduction current into each port (A), or what it answers in its place [m, K, …: [`PortKind::answered`]] (p).
    pub currents: Vec<f64>,
    /// Charge on each port (C); 0 for one that is not electrical (p).
    pub charges: Vec<f64>,
    /// ∂current/∂voltage (S) (p×p); for ports that are not electrical ∂answered/∂given, with the mechanical response over
    /// this dt.
    pub di_dv: Vec<f64>,
    /// ∂charge/∂voltage (F) (p×p), with the mechanical response over this dt; within a macro step ([`crate::macro_step`]) without it.
    pub dq_dv: Vec<f64>,
    /// Value of each opened signal in its own unit (s).
    pub outputs: Vec<f64>,
    /// ∂output/∂voltage (s×p).
    pub doutputs_dv: Vec<f64>,
    /// Longest next step the device's tolerance is likely to bear (s); infinite when it does not care.
    pub dt_next: f64,
    /// A static trial passed a fold: the part pulled in (or opened) on the way to these voltages.
    pub jumped: bool,
}

/// Small-signal answer about a state: y(ω), and outputs per volt. Matrices row-major, [re, im].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SmallSignal {
    /// Port admittances (S) (p×p), row: current, column: voltage; for ports that are not electrical answered over given.
    pub admittance: Vec<[f64; 2]>,
    /// Signals per volt (s×p).
    pub outputs: Vec<[f64; 2]>,
}

/// A port as the circuit sees it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PortInfo {
    /// Name from the netlist, or of the quantity.
    pub name: String,
    /// Its input and output.
    pub kind: PortKind,
}

/// A quantity that can be read from a state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SignalInfo {
    /// Name: `NODE.x`, `NODE.y`, `NODE.rz`, `NODE.vx`, `NODE.vy`, `NODE.vrz`, `BEAM.T`, `GAP.q`, `GAP.gap`,
    /// `GAP.C`, `GAP.F`, …
    pub name: String,
    /// Unit: "m", "rad", "m/s", "rad/s", "K", "C", "F", "N".
    pub unit: String,
}

/// Description of an opened device.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Description {
    /// Ports, in the order of every voltage and current vector.
    pub ports: Vec<PortInfo>,
    /// Opened signals, in the order of every output vector.
    pub signals: Vec<SignalInfo>,
    /// Mechanical unknowns of the model.
    pub unknowns: usize,
}

/// Request to open a device: ports in their order, and signals.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OpenRequest {
    /// Port names in the caller's order, see [`ports`](bimorph_analysis::readout::ports); empty: all electrical ones, in netlist order. A port left out is held
    /// at 0 V, or free.
    pub ports: Vec<String>,
    /// Signal names, see [`SignalInfo::name`].
    pub signals: Vec<String>,
    /// Thermal agitation in transient trials; none: without.
    pub noise: Option<Agitation>,
}

/// Errors of a request. A trial that finds no answer is not an error but [`Status::Fail`].
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DeviceError {
    /// No port of that name.
    #[error(
        "no port named \"{name}\"; the netlist has {available:?}, and there are NODE.x|y|rz, NODE.vx|vy|vrz, BEAM.T, \
         frame.ax|ay|wz"
    )]
    UnknownPort {
        /// The requested name.
        name: String,
        /// The names there are.
        available: Vec<String>,
    },
    /// No signal of that name.
    #[error("no signal named \"{name}\"; {hint}")]
    UnknownSignal {
        /// The requested name.
        name: String,
        /// Suggested names.
        hint: String,
    },
    /// A token that names no state held here.
    #[error("token {0:?} names no state of this session")]
    UnknownToken(Token),
    /// A vector of the wrong length, or a value that is not finite.
    #[error("{what}: expected {expected}, got {got}")]
    BadRequest {
        /// Which field.
        what: &'static str,
        /// The expected value.
        expected: String,
        /// The given value.
        got: String,
    },
    /// The device was used before [`Device::open`].
    #[error("the device is not open")]
    NotOpen,
    /// The server that holds the model cannot be reached, or answered with an error.
    #[error("server {address}: {reason}")]
    Remote {
        /// Address as given.
        address: String,
        /// The reason.
        reason: String,
    },
}

impl From<ReadoutError> for DeviceError {
    fn from(error: ReadoutError) -> Self {
        match error {
            ReadoutError::UnknownSignal { ref name, .. } | ReadoutError::BadExpression { text: ref name, .. } => {
                Self::UnknownSignal { name: name.clone(), hint: error.to_string() }
            }
            ReadoutError::UnknownPort { name, available } => Self::UnknownPort { name, available },
            ReadoutError::BadPort { expected, got } => Self::BadRequest { what: "ports", expected, got },
            ReadoutError::BadRange { expected, got } => Self::BadRequest { what: "ranges", expected, got },
        }
    }
}

/// The electrical contract. See the module for its rules.
pub trait Device: Send {
    /// Starts an epoch: chooses ports and signals and drops every state. Returns what was opened.
    ///
    /// # Errors
    /// [`DeviceError::UnknownPort`], [`DeviceError::UnknownSignal`], [`DeviceError::Remote`].
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError>;

    /// Evaluates one trial; see [`Trial`] and [`TrialReply`].
    ///
    /// # Errors
    /// [`DeviceError::UnknownToken`] when the parent is not held, [`DeviceError::BadRequest`], [`DeviceError::Remote`].
    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError>;

    /// Says that the circuit accepted this state. Advisory: only frees memory, never changes an answer.
    fn accept(&mut self, token: Token);

    /// Warnings of an accepted state, each kind once in an epoch. Advisory: never changes an answer. Empty where a
    /// device does not know.
    fn warns(&mut self, token: Token) -> Vec<Diagnostic> {
        let _ = token;
        Vec::new()
    }

    /// Small-signal answer at angular frequency `omega` (rad/s) about the state `token`.
    ///
    /// # Errors
    /// [`DeviceError::UnknownToken`], [`DeviceError::Remote`].
    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError>;

    /// Names that [`Device::read_quantity`] knows: those of [`WHOLE`](crate::quantities::WHOLE) and every signal. Empty where a device cannot
    /// be inspected.
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Value of a signal in a state, whether it was opened or not, or of the state as a whole ([`WHOLE`](crate::quantities::WHOLE)), in its own unit.
    ///
    /// # Errors
    /// [`DeviceError::UnknownToken`], [`DeviceError::UnknownSignal`].
    fn read_quantity(&mut self, token: Token, name: &str) -> Result<f64, DeviceError> {
        let _ = token;
        let hint = "this device shows what was opened alone".to_owned();
        Err(DeviceError::UnknownSignal { name: name.to_owned(), hint })
    }

    /// One-sided spectral densities of what ports and signals answer at angular frequency `omega` (rad/s) about the state
    /// `token`, and their cross-spectra: ports, then signals; row-major, complex, [answered²/Hz]. Each is that with nothing
    /// else changed: the current of a port whose voltage is held. Empty where a device makes no noise.
    ///
    /// # Errors
    /// Those of [`Device::linearize`].
    fn noise(&mut self, token: Token, omega: f64, reply: &mut Vec<[f64; 2]>) -> Result<(), DeviceError> {
        let _ = (token, omega);
        reply.clear();
        Ok(())
    }

    /// Makes the device usable after a call that was stopped in the middle ([`bimorph_base::budget`]): its storage is made
    /// anew, its states stay as they are. A device that holds no half computed storage does nothing.
    fn recover(&mut self) {}

    /// The open ports and signals and their states, as bytes from which a device of the same model continues bit by
    /// bit. `only`: those states alone.
    ///
    /// # Errors
    /// [`DeviceError::NotOpen`], [`DeviceError::UnknownToken`], [`DeviceError::BadRequest`] where a device cannot do it.
    fn save(&self, only: Option<&[Token]>) -> Result<Vec<u8>, DeviceError> {
        let _ = only;
        Err(refused("a device that can be saved", "another kind"))
    }

    /// The state that a state was tried from; none: the model at rest, or a state that is not held.
    fn parent(&self, token: Token) -> Option<Token> {
        let _ = token;
        None
    }

    /// Starts an epoch with the states of [`Device::save`] in place of none. Returns what was opened.
    ///
    /// # Errors
    /// [`DeviceError::BadRequest`] for bytes that are not those of a device of this model.
    fn load(&mut self, saved: &[u8]) -> Result<Description, DeviceError> {
        let _ = saved;
        Err(refused("a device that can be restored", "another kind"))
    }
}

/// The agitation of an opened device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Agitation {
    /// Names the random numbers.
    pub seed: u64,
    /// Band of the force (Hz), above 0, at most 1e12; none: twenty times the lowest natural frequency, about the drawing.
    pub band: Option<f64>,
}

/// Error of an invalid snapshot.
pub(super) fn refused(expected: &str, got: &str) -> DeviceError {
    DeviceError::BadRequest { what: "snapshot", expected: expected.into(), got: got.into() }
}
