//! The functions ngspice calls: setup, load, accept, truncation, and the model itself.
//!
//! Each passes the call on to the host's own code model support and adds what Bimorph needs around it. None lets a
//! panic out.

use crate::abi::{self, ModelHead, code};
use crate::call::{self, ModelCall, Wanted};
use crate::circuit::HostCircuit;
use crate::evaluation::EvaluationOutcome;
use crate::instance_setup::open_all;
use crate::registry::{close, registry};
use crate::respond::{moves, respond, settle};
use crate::table::{DEVICE, LAYOUT};
use crate::{host, noise, panics, reported, trace};
use std::ffi::{c_int, c_void};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a callback; a panic in it becomes an error code.
fn guarded(body: impl FnOnce() -> c_int) -> c_int {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or(code::PANIC)
}

/// Writes the reason of a stop to the file that `BIMORPH_FAILURE` names, for the program that started ngspice.
fn record_failure(text: &str) {
    if let Some(path) = std::env::var_os("BIMORPH_FAILURE") {
        let _ = std::fs::write(path, text);
    }
}

/// Stores a model parameter.
pub(crate) unsafe extern "C" fn model_param(index: c_int, value: *mut c_void, model: *mut ModelHead) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::model_param(index, value, model) })
}

/// Frees a model.
pub(crate) unsafe extern "C" fn model_delete(model: *mut ModelHead) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::model_delete(model) })
}

/// Reads an instance parameter for `show` and `@a1[…]`.
pub(crate) unsafe extern "C" fn ask(
    _circuit: *mut c_void,
    instance: *mut abi::InstanceHead,
    index: c_int,
    value: *mut c_void,
    _select: *mut c_void,
) -> c_int {
    guarded(|| {
        // SAFETY: the host passes a live instance.
        let key = unsafe { (*instance).conn as usize };
        let found = usize::try_from(index).ok().and_then(|number| registry().query(key, number));
        let Some(x) = found else { return code::BADPARM };
        // SAFETY: the host passes a place for a value, which for a real parameter begins with a double.
        unsafe { value.cast::<f64>().write(x) };
        code::OK
    })
}

/// Reads a model parameter.
pub(crate) unsafe extern "C" fn model_ask(
    circuit: *mut c_void,
    model: *mut ModelHead,
    index: c_int,
    value: *mut c_void,
) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { host::model_ask(circuit, model, index, value) })
}

/// Tests convergence. Derivatives are exact here, so the host's own test of voltages and currents is enough; its test
/// of integrals would cost one more iteration at every point. It comes where those have converged: of an equilibrium
/// this is the last that is heard. ngspice then writes the solution before the last one, so that monitors of an
/// equilibrium would have an error of `reltol`. They are therefore iterated until they stop changing.
pub(crate) unsafe extern "C" fn convergence_test(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    guarded(|| {
        let Some(layout) = LAYOUT.get() else { return code::PANIC };
        // SAFETY: the host's circuit, for this call.
        let circuit = unsafe { HostCircuit::new(circuit, layout) };
        let mut registry = registry();
        // SAFETY: the host's lists.
        let mut entries = unsafe { call::instances(model) }.map(|(_, instance)| instance.conn as usize);
        if entries.any(|key| registry.find(key).is_some_and(|entry| moves(entry, circuit))) {
            return code::UNSETTLED;
        }
        // SAFETY: the host's lists.
        for (_, instance) in unsafe { call::instances(model) } {
            if let Some(entry) = registry.find(instance.conn as usize) {
                let warnings = entry.instance.settled(entry.sweeping);
                reported::of_instance(entry.instance.name(), &warnings);
            }
        }
        code::OK
    })
}

/// Opens every instance, after the host's own setup. An error ends the run before it starts.
pub(crate) unsafe extern "C" fn setup(
    matrix: *mut c_void,
    model: *mut ModelHead,
    circuit: *mut c_void,
    states: *mut c_int,
) -> c_int {
    guarded(|| {
        // SAFETY: passed on.
        let result = unsafe { host::setup(matrix, model, circuit, states) };
        if result != code::OK {
            return result;
        }
        // SAFETY: the host's lists of models and instances, set up above, and its count of states.
        match unsafe { open_all(model, circuit, &mut *states) } {
            Ok(()) => {
                offer_names();
                code::OK
            }
            Err(text) => {
                let _ = writeln!(std::io::stderr(), "Error: bimorph: {text}");
                record_failure(&text);
                trace::line(format_args!("refused: {text}"));
                code::PARMVAL
            }
        }
    })
}

/// Lets the host know what can be asked of the instances that are set up now.
fn offer_names() {
    let mut registry = registry();
    let mut names = registry.names.take().unwrap_or_default();
    if let Some(table) = names.renew(registry.instances()) {
        // SAFETY: the host is setting a circuit up and waits.
        unsafe { DEVICE.set_instance_parameters(&table) };
    }
    registry.names = Some(names);
}

/// Closes the instances of these models: states and connections to servers end with the analysis.
pub(crate) unsafe extern "C" fn unsetup(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    guarded(|| {
        // SAFETY: the host's lists; then passed on.
        unsafe {
            call::instances(model).for_each(|(_, instance)| close(instance.conn as usize));
            host::unsetup(model, circuit)
        }
    })
}

/// Frees an instance.
pub(crate) unsafe extern "C" fn delete(instance: *mut abi::InstanceHead) -> c_int {
    guarded(|| {
        // SAFETY: the host passes a live instance.
        unsafe {
            close((*instance).conn as usize);
            host::delete(instance)
        }
    })
}

/// Ends an analysis before it begins, with one message.
fn refuse(text: &str) -> c_int {
    let _ = writeln!(std::io::stderr(), "Error: bimorph: {text}");
    record_failure(text);
    trace::line(format_args!("refused: {text}"));
    code::PANIC
}

/// Loads the matrix for currents: the host calls [`evaluate`] for each instance.
pub(crate) unsafe extern "C" fn load(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { load_for(Wanted::Large, model, circuit) })
}

/// Loads the complex matrix of a small-signal analysis.
pub(crate) unsafe extern "C" fn small_signal_load(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { load_for(Wanted::Small, model, circuit) })
}

/// Loads the matrix.
///
/// Where an instance has no answer this ends Newton's iteration, and ngspice tries a shorter step or another way to the
/// operating point. Once an instance has stopped the analysis, none of these succeeds and ngspice gives up. (The code
/// that ends a transient at once would make ngspice report success.)
///
/// # Safety
/// The arguments are those with which the host called the plug-in.
unsafe fn load_for(wanted: Wanted, model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    let Some(layout) = LAYOUT.get() else { return code::PANIC };
    {
        let mut registry = registry();
        registry.good = true;
        // SAFETY: the host's circuit, for this load.
        registry.loading = Some((unsafe { HostCircuit::new(circuit, layout) }, wanted));
    }
    // SAFETY: passed on; the registry is not locked while the host calls back.
    let result = unsafe { host::load(model, circuit) };
    if registry().good { result } else { code::ITERLIM }
}

/// Pole-zero analysis solves at complex frequencies, where the part cannot be asked; ngspice would leave it out.
pub(crate) unsafe extern "C" fn pole_zero_setup(
    _matrix: *mut c_void,
    model: *mut ModelHead,
    _circuit: *mut c_void,
    _states: *mut c_int,
) -> c_int {
    guarded(|| {
        // SAFETY: the host's lists.
        let any = unsafe { call::instances(model).next() }.is_some();
        let text = ".pz knows no electro-mechanical parts; use .ac, or `bimorph modes` for natural frequencies";
        if any { refuse(text) } else { code::OK }
    })
}

/// Distortion analysis needs third derivatives; ngspice would take the part for linear.
pub(crate) unsafe extern "C" fn distortion(_mode: c_int, model: *mut ModelHead, _circuit: *mut c_void) -> c_int {
    guarded(|| {
        // SAFETY: the host's lists.
        let any = unsafe { call::instances(model).next() }.is_some();
        let text = ".disto knows no electro-mechanical parts; use .tran and fourier";
        if any { refuse(text) } else { code::OK }
    })
}

/// Adds the part's share to the noise at the output.
pub(crate) unsafe extern "C" fn noise(
    mode: c_int,
    operation: c_int,
    model: *mut ModelHead,
    circuit: *mut c_void,
    analysis: *mut noise::NoiseAnalysis,
    density: *mut f64,
) -> c_int {
    guarded(|| {
        let Some(layout) = LAYOUT.get() else { return code::PANIC };
        // SAFETY: passed on.
        match unsafe { noise::add((mode, operation), model, circuit, layout, (analysis, density)) } {
            Ok(()) => code::OK,
            Err(text) => refuse(&text),
        }
    })
}

/// Binds the matrix entries for KLU.
pub(crate) unsafe extern "C" fn bind(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { bind_by(0, model, circuit) })
}

/// Binds them to the complex matrix.
pub(crate) unsafe extern "C" fn bind_complex(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { bind_by(1, model, circuit) })
}

/// Binds them to the real matrix again.
pub(crate) unsafe extern "C" fn bind_real(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    guarded(|| unsafe { bind_by(2, model, circuit) })
}

/// # Safety
/// The arguments are those with which the host called the plug-in.
unsafe fn bind_by(which: usize, model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: passed on.
    let bound = LAYOUT.get().and_then(|layout| unsafe { host::bind(which, model, circuit, layout) });
    bound
        .unwrap_or_else(|| refuse("it is not known how this ngspice binds code models for KLU; leave out .options klu"))
}

/// Bounds the next step by the truncation error of the charges, as the host does for capacitors, and by what the devices
/// can bear. An answer that was given stands, so a device rejects no step here: one that
/// needs a shorter step says so in its answer.
pub(crate) unsafe extern "C" fn trunc(model: *mut ModelHead, circuit: *mut c_void, step: *mut f64) -> c_int {
    /// ngspice rejects a step when the next one would be less than this fraction of it, with a little to spare.
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
pub(crate) unsafe extern "C" fn accept(circuit: *mut c_void, model: *mut ModelHead) -> c_int {
    guarded(|| {
        let Some(layout) = LAYOUT.get() else { return code::PANIC };
        // SAFETY: the host's circuit, for this call.
        let circuit = unsafe { HostCircuit::new(circuit, layout) };
        let mut registry = registry();
        // SAFETY: the host's lists.
        for (_, instance) in unsafe { call::instances(model) } {
            if let Some(entry) = registry.find(instance.conn as usize) {
                settle(entry, circuit);
                let warnings = entry.instance.accept();
                reported::of_instance(entry.instance.name(), &warnings);
            }
        }
        code::OK
    })
}

/// The model: one call for one instance.
pub(crate) unsafe extern "C" fn evaluate(data: *mut c_void) {
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let layout = LAYOUT.get()?;
        let mut registry = registry();
        let (circuit, wanted) = registry.loading?;
        // SAFETY: the host passes the data of this call, in its layout, while it loads the circuit.
        let call = unsafe { ModelCall::new(data, layout, circuit, wanted) };
        if registry.stopped {
            registry.good = false;
            return None;
        }
        registry.asked = call.key();
        Some(respond(&call, &mut registry))
    }));
    let outcome = match outcome {
        Ok(None) | Ok(Some(EvaluationOutcome::Solved)) => return,
        Ok(Some(outcome)) => outcome,
        Err(_) => EvaluationOutcome::Stop(format!("internal error: {}; please report it", panics::last())),
    };
    let mut registry = registry();
    registry.good = false;
    if let EvaluationOutcome::Stop(text) = outcome {
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
