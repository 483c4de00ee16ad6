//! The instances ngspice has set up, and what they share during a load.

use crate::call::{Reserved, Wanted};
use crate::circuit::HostCircuit;
use crate::history::History;
use crate::instance::Instance;
use crate::query_table::LookNames;
use crate::trace;
use bimorph::device::Token;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An instance with what its calls reuse.
pub(crate) struct RegisteredInstance {
    key: usize,
    /// Names the run its records belong to.
    pub(crate) epoch: u64,
    /// The device.
    pub(crate) instance: Instance,
    /// Its part of the host's state vectors.
    pub(crate) memory: Reserved,
    /// Port voltages of the call, or currents where these are given.
    pub(crate) voltages: Vec<f64>,
    /// The last accepted point.
    pub(crate) previous: History,
    /// Whether the host knows the charges as integrals.
    pub(crate) integrals: bool,
    /// The two places in the solution whose difference is given to each port.
    pub(crate) nodes: Vec<[i32; 2]>,
    /// The places of each monitor in the solution.
    pub(crate) shown: Vec<[i32; 2]>,
    /// Iterations in a row that the monitors of an equilibrium have taken beyond ngspice's own.
    pub(crate) further: u32,
    /// State of the last equilibrium: the operating point of a small signal.
    pub(crate) balanced: Option<Token>,
    /// Where the last answer's record stands: an address in the host's state memory, good until the point is accepted.
    pub(crate) record: usize,
    /// Whether the last evaluated equilibrium was a point of a sweep.
    pub(crate) sweeping: bool,
    /// The job of that sweep.
    pub(crate) job: usize,
    /// The record of an analysis before a sweep, while its first point finds that in the host's memory.
    pub(crate) stale: Option<Token>,
    /// Its share in the noise at the output at the last frequency.
    pub(crate) density: f64,
}

/// Every instance, and what concerns the load under way.
pub(crate) struct Registry {
    entries: Vec<RegisteredInstance>,
    epochs: u64,
    /// The circuit being loaded, and by which of the host's functions.
    pub(crate) loading: Option<(HostCircuit, Wanted)>,
    /// Whether every instance has answered in this load.
    pub(crate) good: bool,
    /// Set when the analysis must end: no device is asked any more.
    pub(crate) stopped: bool,
    /// Key of the instance being asked.
    pub(crate) asked: usize,
    /// Instance parameters by name; `None` before the first setup.
    pub(crate) names: Option<LookNames>,
}

static REGISTRY: Mutex<Registry> = Mutex::new(Registry {
    entries: Vec::new(),
    epochs: 0,
    loading: None,
    good: true,
    stopped: false,
    asked: 0,
    names: None,
});

/// The registry, for the lifetime of the guard: never while the host may call back.
pub(crate) fn registry() -> MutexGuard<'static, Registry> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Puts an opened instance in; it replaces the one before it.
pub(crate) fn register(key: usize, instance: Instance, memory: Reserved) {
    let registry = &mut *registry();
    registry.epochs += 1;
    registry.stopped = false;
    trace::line(format_args!("open {} epoch {} {:?}", instance.name(), registry.epochs, instance.description()));
    let entry = RegisteredInstance {
        key,
        epoch: registry.epochs,
        instance,
        memory,
        voltages: Vec::new(),
        previous: History::default(),
        integrals: false,
        nodes: Vec::new(),
        shown: Vec::new(),
        further: 0,
        balanced: None,
        record: 0,
        sweeping: false,
        job: 0,
        stale: None,
        density: 0.0,
    };
    match registry.find(key) {
        Some(old) => *old = entry,
        None => registry.entries.push(entry),
    }
}

/// Takes an instance out.
pub(crate) fn close(key: usize) {
    registry().entries.retain(|e| e.key != key);
}

impl Registry {
    /// Every instance that is set up, in the order of the circuit.
    pub(crate) fn instances(&self) -> impl Iterator<Item = &Instance> + Clone {
        self.entries.iter().map(|entry| &entry.instance)
    }

    /// Value of the quantity with this number in the last state of an instance; none where it has none.
    pub(crate) fn query(&mut self, key: usize, number: usize) -> Option<f64> {
        let name = self.names.as_ref()?.get(number)?.to_owned();
        self.find(key)?.instance.query(&name)
    }

    /// The instance whose connections are at `key`: that address stays the same for its lifetime.
    pub(crate) fn find(&mut self, key: usize) -> Option<&mut RegisteredInstance> {
        self.entries.iter_mut().find(|e| e.key == key)
    }
}
