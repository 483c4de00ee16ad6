//! The functions ngspice calls: setup, load, accept, truncation, and the model itself.
//!
//! Each passes the call on to the host's own code model support and adds what Bimorph needs around it. None lets a
//! panic out. Instances are found by the address of their connections, which stays the same as long as they live.

use crate::abi::{self, Model, code};
use crate::call::{self, Call, MONITORS, PORTS};
use crate::history::{self, History};
use crate::instance::{Instance, Outcome, Question};
use crate::model_card::ModelCard;
use crate::table::LAYOUT;
use crate::{host, opener, panics, trace};
use std::ffi::{c_int, c_void};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Where a circuit keeps its present step [byte].
const CIRCUIT_DELTA: usize = 88;

/// An instance with what its calls reuse.
struct Entry {
    key: usize,
    epoch: u64,
    instance: Instance,
    voltages: Vec<f64>,
    previous: History,
}

struct Registry {
    entries: Vec<Entry>,
    epochs: u64,
    /// The step the circuit takes in this load [s].
    delta: f64,
    /// Whether every instance has answered in this load.
    good: bool,
    /// Set when the analysis must end: no device is asked any more.
    stopped: bool,
    /// Name of the instance being asked.
    asked: String,
}

static REGISTRY: Mutex<Registry> = Mutex::new(Registry {
    entries: Vec::new(),
    epochs: 0,
    delta: 0.0,
    good: true,
    stopped: false,
    asked: String::new(),
});

fn registry() -> MutexGuard<'static, Registry> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a callback; a panic in it becomes an error code.
fn guarded(body: impl FnOnce() -> c_int) -> c_int {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or(code::PANIC)
}

/// Leaves the reason of a stop where `BIMORPH_FAILURE` says, for whoever started ngspice.
fn record_failure(text: &str) {
    if let Some(path) = std::env::var_os("BIMORPH_FAILURE") {
        let _ = std::fs::write(path, text);
    }
}

/// Stores a model parameter.
pub(crate) unsafe extern "C" fn model_param(index: c_int, value: *mut c_void, model: *mut Model) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::model_param(index, value, model) })
}

/// Frees a model.
pub(crate) unsafe extern "C" fn model_delete(model: *mut Model) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::model_delete(model) })
}

/// Reads an instance parameter.
pub(crate) unsafe extern "C" fn ask(
    circuit: *mut c_void,
    instance: *mut abi::Instance,
    index: c_int,
    value: *mut c_void,
    select: *mut c_void,
) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::ask(circuit, instance, index, value, select) })
}

/// Reads a model parameter.
pub(crate) unsafe extern "C" fn model_ask(
    circuit: *mut c_void,
    model: *mut Model,
    index: c_int,
    value: *mut c_void,
) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::model_ask(circuit, model, index, value) })
}

/// Tests convergence.
pub(crate) unsafe extern "C" fn convergence_test(model: *mut Model, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::convergence_test(model, circuit) })
}

/// Opens every instance, after the host's own setup. An error ends the run before it starts.
pub(crate) unsafe extern "C" fn setup(
    matrix: *mut c_void,
    model: *mut Model,
    circuit: *mut c_void,
    states: *mut c_int,
) -> c_int {
    guarded(|| {
        // SAFETY: passed on.
        let result = unsafe { host::setup(matrix, model, circuit, states) };
        if result != code::OK {
            return result;
        }
        // SAFETY: the host's lists of models and instances, set up above.
        match unsafe { open_all(model) } {
            Ok(()) => code::OK,
            Err(text) => {
                let _ = writeln!(std::io::stderr(), "Error: bimorph: {text}");
                record_failure(&text);
                trace::line(format_args!("refused: {text}"));
                code::PARMVAL
            }
        }
    })
}

/// Opens each instance of each model.
///
/// # Safety
/// `model` heads the host's list of models; each is set up.
unsafe fn open_all(mut model: *mut Model) -> Result<(), String> {
    let remote = std::env::var("BIMORPH_REMOTE").ok();
    // SAFETY: the lists end in null; names are strings of the host.
    unsafe {
        while let Some(this) = model.as_ref() {
            let mut instance = this.instances;
            while let Some(at) = instance.as_ref() {
                let name = call::text(at.name).unwrap_or_default();
                let card = ModelCard::new(&call::card(this.param, this.num_param), remote.clone());
                let (ports, monitors) = (call::size(at.conn, PORTS), call::size(at.conn, MONITORS));
                let directory = deck_directory(at.conn);
                let opened = card.map_err(|e| e.to_string()).and_then(|mut card| {
                    card.check_counts(ports, monitors).map_err(|e| e.to_string())?;
                    open(&name, &mut card, ports, directory.as_deref())
                });
                let model_name = call::text(this.name).unwrap_or_default();
                let opened = opened.map_err(|e| format!("instance {name} (model {model_name}): {e}"))?;
                register(at.conn as usize, opened);
                instance = at.next;
            }
            model = this.next;
        }
    }
    Ok(())
}

fn open(name: &str, card: &mut ModelCard, ports: usize, directory: Option<&Path>) -> Result<Instance, String> {
    let device = opener::open(card, directory).map_err(|e| e.to_string())?;
    trace::line(format_args!("{name}: {card:?}, deck in {directory:?}"));
    Instance::open(name, device, &card.ports, ports, &card.monitors).map_err(|e| format!("\"{}\": {e}", card.file))
}

/// The deck's directory: from whoever started ngspice, or from the host.
///
/// # Safety
/// `conn` points to the connections of an instance that the host has set up.
unsafe fn deck_directory(conn: *mut *mut abi::Connection) -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("BIMORPH_DECK_DIR") {
        return Some(path.into());
    }
    // SAFETY: by contract; the slot is that of this host.
    unsafe { LAYOUT.get()?.deck_path_slot(call::partial_at_80(conn)).and_then(|slot| host::deck_directory(slot)) }
}

fn register(key: usize, instance: Instance) {
    let registry = &mut *registry();
    registry.epochs += 1;
    registry.stopped = false;
    trace::line(format_args!("open {} epoch {} {:?}", instance.name(), registry.epochs, instance.description()));
    let entry = Entry { key, epoch: registry.epochs, instance, voltages: Vec::new(), previous: History::default() };
    match registry.entries.iter_mut().find(|e| e.key == key) {
        Some(old) => *old = entry,
        None => registry.entries.push(entry),
    }
}

/// Closes the instances of these models: states and connections to servers end with the analysis.
pub(crate) unsafe extern "C" fn unsetup(model: *mut Model, circuit: *mut c_void) -> c_int {
    guarded(|| {
        let mut next = model;
        // SAFETY: the host's lists, as in `open_all`.
        unsafe {
            while let Some(this) = next.as_ref() {
                let mut instance = this.instances;
                while let Some(at) = instance.as_ref() {
                    close(at.conn as usize);
                    instance = at.next;
                }
                next = this.next;
            }
            host::unsetup(model, circuit)
        }
    })
}

/// Frees an instance.
pub(crate) unsafe extern "C" fn delete(instance: *mut abi::Instance) -> c_int {
    guarded(|| {
        // SAFETY: the host passes a live instance.
        unsafe {
            close((*instance).conn as usize);
            host::delete(instance)
        }
    })
}

fn close(key: usize) {
    registry().entries.retain(|e| e.key != key);
}

/// Loads the matrix: the host calls [`evaluate`] for each instance.
///
/// Where one has no answer this ends Newton's iteration, and ngspice tries a shorter step or another way to the
/// operating point. Once an instance has stopped the analysis, none of these succeeds and ngspice gives up. (The code
/// that ends a transient at once would make ngspice report success.)
pub(crate) unsafe extern "C" fn load(model: *mut Model, circuit: *mut c_void) -> c_int {
    guarded(|| {
        {
            let mut registry = registry();
            registry.good = true;
            // SAFETY: the step stands at this place of the circuit from 39 to 47.
            registry.delta = unsafe { *circuit.cast::<u8>().add(CIRCUIT_DELTA).cast::<f64>() };
        }
        // SAFETY: passed on; the registry is not locked while the host calls back.
        let result = unsafe { host::load(model, circuit) };
        if registry().good { result } else { code::ITERLIM }
    })
}

/// Bounds the next step by what the devices can bear. An answer that was given stands, so no step is rejected here:
/// a device that needs a shorter step says so in its answer.
pub(crate) unsafe extern "C" fn trunc(model: *mut Model, circuit: *mut c_void, step: *mut f64) -> c_int {
    /// ngspice rejects a step when the next one would be less than this share of it, with a little to spare.
    const KEEPS: f64 = 0.91;
    guarded(|| {
        // SAFETY: passed on.
        let result = unsafe { host::trunc(model, circuit, step) };
        for entry in &registry().entries {
            let bound = entry.instance.step_bound().max(KEEPS * entry.instance.answer().step);
            // SAFETY: the host passes a place for the bound.
            unsafe { *step = (*step).min(bound) };
        }
        result
    })
}

/// A point was accepted.
pub(crate) unsafe extern "C" fn accept(_circuit: *mut c_void, _model: *mut Model) -> c_int {
    guarded(|| {
        for entry in &mut registry().entries {
            entry.instance.accept();
        }
        code::OK
    })
}

/// The model: one call for one instance.
pub(crate) unsafe extern "C" fn evaluate(data: *mut c_void) {
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let layout = LAYOUT.get()?;
        // SAFETY: the host passes the data of this call, in its layout.
        let call = unsafe { Call::new(data, layout) };
        let mut registry = registry();
        if registry.stopped {
            registry.good = false;
            return None;
        }
        registry.asked.clear();
        Some(respond(&call, &mut registry))
    }));
    let outcome = match outcome {
        Ok(None) | Ok(Some(Outcome::Solved)) => return,
        Ok(Some(outcome)) => outcome,
        Err(_) => Outcome::Stop(format!("internal error: {}; please report it", panics::last())),
    };
    let mut registry = registry();
    registry.good = false;
    if let Outcome::Stop(text) = outcome {
        registry.stopped = true;
        let reason = format!("instance {}: {text}", registry.asked);
        drop(registry);
        record_failure(&reason);
        trace::line(format_args!("stop: {reason}"));
        // SAFETY: this is within a load.
        unsafe { host::message(&format!("Error: bimorph: {text}")) };
    }
}

/// Answers a call.
fn respond(call: &Call<'_>, registry: &mut Registry) -> Outcome {
    let delta = registry.delta;
    let Some(entry) = registry.entries.iter_mut().find(|e| e.key == call.key()) else {
        return Outcome::Stop("an instance was not set up".into());
    };
    registry.asked.push_str(entry.instance.name());
    let question = call.question(delta);
    let ports = call.size(PORTS);
    let doubles = history::len(ports);
    if call.init() {
        // SAFETY: this is the instance's first call in a load.
        unsafe { host::reserve(doubles) };
    }
    let from = c_int::from(!matches!(question, Question::SmallSignal { .. }));
    // SAFETY: this is within a load; the memory has the size that was reserved.
    let recalled = unsafe { host::memory(from).as_ref().map(|m| std::slice::from_raw_parts(m, doubles)) };
    let Some(recalled) = recalled else {
        return Outcome::Stop("ngspice gave no state memory".into());
    };
    history::read(recalled, entry.epoch, &mut entry.previous);
    call.voltages(&mut entry.voltages);
    let outcome = entry.instance.ask(question, &entry.voltages, &entry.previous);
    if outcome == Outcome::Solved {
        match question {
            Question::SmallSignal { .. } => write_gains(call, &entry.instance),
            _ => write_answer(call, entry, doubles),
        }
    }
    if trace::on() {
        trace_call(entry, question, &outcome);
    }
    outcome
}

fn write_answer(call: &Call<'_>, entry: &Entry, doubles: usize) {
    let (answer, ports) = (entry.instance.answer(), call.size(PORTS));
    for n in 0..ports {
        call.set(PORTS, n, answer.currents[n], &answer.conductances[n * ports..(n + 1) * ports]);
    }
    for n in 0..call.size(MONITORS) {
        call.set(MONITORS, n, answer.monitors[n], &answer.monitor_gains[n * ports..(n + 1) * ports]);
    }
    // SAFETY: this is within a load; this point's memory has the size that was reserved, and no other view of it.
    let memory = unsafe { host::memory(0).as_mut().map(|m| std::slice::from_raw_parts_mut(m, doubles)) };
    if let (Some(memory), Some(token)) = (memory, answer.token) {
        history::write(memory, entry.epoch, token, answer.step, &answer.charges, &entry.previous.charges);
    }
}

fn write_gains(call: &Call<'_>, instance: &Instance) {
    let (small, ports) = (instance.small_signal(), call.size(PORTS));
    for n in 0..ports {
        call.set_gains(PORTS, n, small.admittance[n * ports..(n + 1) * ports].iter().copied());
    }
    for (n, monitor) in instance.monitors().iter().enumerate() {
        let row = &small.outputs[n * ports..(n + 1) * ports];
        call.set_gains(MONITORS, n, row.iter().map(|[re, im]| [monitor.scale * re, monitor.scale * im]));
    }
}

fn trace_call(entry: &Entry, question: Question, outcome: &Outcome) {
    let (name, answer) = (entry.instance.name(), entry.instance.answer());
    trace::line(format_args!(
        "{name} {question:?} parent {:?} v {:?} -> {outcome:?} token {:?} i {:?} q {:?} monitors {:?}",
        entry.previous.token, entry.voltages, answer.token, answer.currents, answer.charges, answer.monitors
    ));
}
