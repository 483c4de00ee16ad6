//! The functions ngspice calls: setup, load, accept, truncation, and the model itself.
//!
//! Each passes the call on to the host's own code model support and adds what Bimorph needs around it. None lets a
//! panic out.

use crate::abi::{self, Model, circuit as at, code};
use crate::call::{self, Call};
use crate::instance::Outcome;
use crate::opening::open_all;
use crate::registry::{close, registry};
use crate::respond::respond;
use crate::table::LAYOUT;
use crate::{host, panics, trace};
use std::ffi::{c_int, c_void};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

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

/// Tests convergence. Derivatives are exact here, so the host's own test of voltages and currents is enough; its test of
/// integrals would cost one more iteration at every point.
pub(crate) unsafe extern "C" fn convergence_test(_model: *mut Model, _circuit: *mut c_void) -> c_int {
    code::OK
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

/// Closes the instances of these models: states and connections to servers end with the analysis.
pub(crate) unsafe extern "C" fn unsetup(model: *mut Model, circuit: *mut c_void) -> c_int {
    guarded(|| {
        // SAFETY: the host's lists; then passed on.
        unsafe {
            call::instances(model).for_each(|(_, instance)| close(instance.conn as usize));
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
            // SAFETY: a circuit is larger than this from 39 to 47, and the step stands at the same place in all.
            unsafe {
                let circuit = circuit.cast::<u8>();
                registry.delta = *circuit.add(at::DELTA).cast::<f64>();
                registry.sweep = at::MODES.iter().any(|&mode| at::is_sweep(*circuit.add(mode).cast::<u64>()));
            }
        }
        // SAFETY: passed on; the registry is not locked while the host calls back.
        let result = unsafe { host::load(model, circuit) };
        if registry().good { result } else { code::ITERLIM }
    })
}

/// Bounds the next step by the truncation error of the charges, as the host does for capacitors, and by what the devices
/// can bear. An answer that was given stands, so a device rejects no step here: one that
/// needs a shorter step says so in its answer.
pub(crate) unsafe extern "C" fn trunc(model: *mut Model, circuit: *mut c_void, step: *mut f64) -> c_int {
    /// ngspice rejects a step when the next one would be less than this share of it, with a little to spare.
    const KEEPS: f64 = 0.91;
    guarded(|| {
        // SAFETY: passed on.
        let result = unsafe { host::trunc(model, circuit, step) };
        let mut registry = registry();
        // SAFETY: the host's lists.
        for (_, instance) in unsafe { call::instances(model) } {
            let Some(entry) = registry.find(instance.conn as usize) else { continue };
            let bound = entry.instance.step_bound().max(KEEPS * entry.instance.answer().step);
            // SAFETY: the host passes a place for the bound.
            unsafe { *step = (*step).min(bound) };
        }
        result
    })
}

/// A point was accepted.
pub(crate) unsafe extern "C" fn accept(_circuit: *mut c_void, model: *mut Model) -> c_int {
    guarded(|| {
        let mut registry = registry();
        // SAFETY: the host's lists.
        for (_, instance) in unsafe { call::instances(model) } {
            if let Some(entry) = registry.find(instance.conn as usize) {
                entry.instance.accept();
            }
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
        registry.asked = call.key();
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
        let asked = registry.asked;
        let name = registry.find(asked).map_or("?", |entry| entry.instance.name());
        let reason = format!("instance {name}: {text}");
        drop(registry);
        record_failure(&reason);
        trace::line(format_args!("stop: {reason}"));
        // SAFETY: this is within a load.
        unsafe { host::message(&format!("Error: bimorph: {text}")) };
    }
}
