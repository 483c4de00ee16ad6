//! Devices: trials, small signals, and states as bytes.

use crate::fault::{CallCode, CallFault, call, keep, terminated, value};
use crate::memory::{array, fill, output, place, reference, release, text, texts};
use crate::model::ModelHandle;
use bimorph::device::local::LocalDevice;
use bimorph::device::{Description, Device, Mode, OpenRequest, SmallSignal, Status, Token, Trial, TrialReply};
use std::ffi::{CString, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

/// A device that one thread uses at a time.
pub struct DeviceHandle(Mutex<OpenedDevice>);

/// A device with the texts and buffers of its answers.
struct OpenedDevice {
    device: LocalDevice,
    units: DeviceUnits,
    reply: TrialReply,
    small: SmallSignal,
    spectra: Vec<[f64; 2]>,
    warnings: CString,
}

/// Units of ports and signals.
#[derive(Default)]
struct DeviceUnits {
    given: Vec<CString>,
    answered: Vec<CString>,
    signals: Vec<CString>,
}

impl DeviceUnits {
    fn of(description: &Description) -> Self {
        let ports = &description.ports;
        Self {
            given: ports.iter().map(|port| terminated(port.kind.given().1)).collect(),
            answered: ports.iter().map(|port| terminated(port.kind.answered().1)).collect(),
            signals: description.signals.iter().map(|signal| terminated(&signal.unit)).collect(),
        }
    }
}

impl DeviceHandle {
    /// The device, unless another thread uses it.
    fn lock(&self) -> Result<MutexGuard<'_, OpenedDevice>, CallFault> {
        match self.0.try_lock() {
            Ok(opened) => Ok(opened),
            // its storage was made anew after a fault
            Err(TryLockError::Poisoned(opened)) => Ok(opened.into_inner()),
            Err(TryLockError::WouldBlock) => {
                Err(CallFault::new(CallCode::Busy, "another thread uses the device: open one for each thread"))
            }
        }
    }

    /// Runs a call on the device. After a fault inside its storage is made anew, and its states stay.
    fn run<T>(&self, job: impl FnOnce(&mut OpenedDevice) -> Result<T, CallFault>) -> Result<T, CallFault> {
        let mut opened = self.lock()?;
        match catch_unwind(AssertUnwindSafe(|| job(&mut opened))) {
            Ok(done) => done,
            Err(fault) => {
                opened.device.recover();
                resume_unwind(fault)
            }
        }
    }
}

/// A request as C has it.
#[derive(Debug)]
#[repr(C)]
pub struct TrialArguments {
    size: usize,
    mode: i32,
    reserved: i32,
    parent: u64,
    t: f64,
    dt: f64,
    given: *const f64,
}

/// A reply as C has it.
#[derive(Debug)]
#[repr(C)]
pub struct TrialResults {
    size: usize,
    status: i32,
    jumped: i32,
    state: u64,
    dt_next: f64,
    answered: *mut f64,
    charges: *mut f64,
    answered_given: *mut f64,
    charges_given: *mut f64,
    signals: *mut f64,
    signals_given: *mut f64,
}

const SOLVED: i32 = 0;
const SHORTER_STEP: i32 = 1;
const NO_ANSWER: i32 = 2;

/// The state at rest has the number 0.
fn token(state: u64) -> Option<Token> {
    (state != 0).then_some(Token(state))
}

/// A state that is not that at rest.
fn tried(state: u64) -> Result<Token, CallFault> {
    token(state)
        .ok_or_else(|| CallFault::new(CallCode::UnknownState, "state: 0 is the model at rest; make a trial first"))
}

/// Opens a device.
///
/// # Safety
/// As the header says: pointers are null or valid for the stated lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_open(
    model: *const ModelHandle,
    ports: *const *const c_char,
    port_count: usize,
    signals: *const *const c_char,
    signal_count: usize,
    device: *mut *mut DeviceHandle,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (model, device) = unsafe { (reference(model, "model")?, place(device, "device")?) };
        // SAFETY: by the contract of this function.
        let (ports, signals) =
            unsafe { (texts(ports, port_count, "ports")?, texts(signals, signal_count, "signals")?) };
        let mut local = LocalDevice::new(Arc::clone(model.in_circuit()));
        let description = local.open(&OpenRequest { ports, signals, noise: None })?;
        let opened = OpenedDevice {
            device: local,
            units: DeviceUnits::of(&description),
            reply: TrialReply::default(),
            small: SmallSignal::default(),
            spectra: Vec::new(),
            warnings: CString::default(),
        };
        let made = Box::into_raw(Box::new(DeviceHandle(Mutex::new(opened))));
        // SAFETY: the place is not null, and by the contract of this function valid.
        unsafe { device.write(made) };
        Ok(())
    })
}

/// Number of ports.
///
/// # Safety
/// `device` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_port_count(device: *const DeviceHandle) -> usize {
    // SAFETY: by the contract of this function.
    value(0, || Ok(unsafe { reference(device, "device") }?.lock()?.units.given.len()))
}

/// Number of signals.
///
/// # Safety
/// `device` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_signal_count(device: *const DeviceHandle) -> usize {
    // SAFETY: by the contract of this function.
    value(0, || Ok(unsafe { reference(device, "device") }?.lock()?.units.signals.len()))
}

/// A unit of a list of a device.
///
/// # Safety
/// `device` is null or a valid handle.
unsafe fn unit(device: *const DeviceHandle, index: usize, list: fn(&DeviceUnits) -> &[CString]) -> *const c_char {
    value(std::ptr::null(), || {
        // SAFETY: by the contract of this function.
        let opened = unsafe { reference(device, "device") }?.lock()?;
        Ok(list(&opened.units).get(index).map_or(std::ptr::null(), |unit| unit.as_ptr()))
    })
}

/// Unit of the input of a port.
///
/// # Safety
/// `device` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_given_unit(device: *const DeviceHandle, port: usize) -> *const c_char {
    // SAFETY: by the contract of this function.
    unsafe { unit(device, port, |units| &units.given) }
}

/// Unit of the output of a port.
///
/// # Safety
/// `device` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_answered_unit(device: *const DeviceHandle, port: usize) -> *const c_char {
    // SAFETY: by the contract of this function.
    unsafe { unit(device, port, |units| &units.answered) }
}

/// Unit of a signal.
///
/// # Safety
/// `device` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_signal_unit(device: *const DeviceHandle, signal: usize) -> *const c_char {
    // SAFETY: by the contract of this function.
    unsafe { unit(device, signal, |units| &units.signals) }
}

/// Evaluates a trial.
///
/// # Safety
/// As the header says: structures have their size, and arrays the lengths of the device.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_trial(
    device: *mut DeviceHandle,
    trial: *const TrialArguments,
    reply: *mut TrialResults,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (device, asked) = unsafe { (reference(device, "device")?, reference(trial, "trial")?) };
        // SAFETY: by the contract of this function.
        let reply = unsafe { output(reply, "reply") }?;
        let sizes =
            [(asked.size, size_of::<TrialArguments>(), "trial"), (reply.size, size_of::<TrialResults>(), "reply")];
        for (size, least, name) in sizes {
            if size < least {
                let message = format!("{name}: expected a size of at least {least} bytes, got {size}: set `size`");
                return Err(CallFault::argument(message));
            }
        }
        let mode = match asked.mode {
            0 => Mode::Static,
            1 => Mode::Transient,
            other => {
                let message = format!("mode: expected BIMORPH_STATIC or BIMORPH_TRANSIENT, got {other}");
                return Err(CallFault::argument(message));
            }
        };
        device.run(|opened| {
            let ports = opened.units.given.len();
            // SAFETY: by the contract of this function.
            let voltages = unsafe { array(asked.given, ports, "given") }?;
            let request = Trial { mode, parent: token(asked.parent), t: asked.t, dt: asked.dt, voltages };
            opened.device.trial(&request, &mut opened.reply)?;
            let found = &opened.reply;
            reply.jumped = i32::from(found.jumped);
            (reply.state, reply.dt_next) = (found.token.map_or(0, |token| token.0), found.dt_next);
            reply.status = match &found.status {
                Status::Ok => SOLVED,
                Status::NeedDt(bound) => {
                    (reply.state, reply.dt_next) = (0, *bound);
                    SHORTER_STEP
                }
                Status::Fail(reason) => {
                    (reply.state, reply.dt_next) = (0, 0.0);
                    keep(reason);
                    NO_ANSWER
                }
            };
            if reply.status != SOLVED {
                return Ok(());
            }
            // SAFETY: by the contract of this function every array is null or has its length.
            unsafe {
                fill(reply.answered, &found.currents);
                fill(reply.charges, &found.charges);
                fill(reply.answered_given, &found.di_dv);
                fill(reply.charges_given, &found.dq_dv);
                fill(reply.signals, &found.outputs);
                fill(reply.signals_given, &found.doutputs_dv);
            }
            Ok(())
        })
    })
}

/// Accepts a state.
///
/// # Safety
/// `device` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_accept(device: *mut DeviceHandle, state: u64) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let device = unsafe { reference(device, "device") }?;
        let state = tried(state)?;
        device.run(|opened| {
            opened.device.accept(state);
            Ok(())
        })
    })
}

/// Warnings of a state.
///
/// # Safety
/// `device` is null or a valid handle, `warnings` null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_warnings(
    device: *mut DeviceHandle,
    state: u64,
    warnings: *mut *const c_char,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (device, warnings) = unsafe { (reference(device, "device")?, place(warnings, "warnings")?) };
        let state = tried(state)?;
        device.run(|opened| {
            let found = opened.device.warns(state);
            let lines = found.iter().map(|one| match one.help.as_str() {
                "" => one.message.clone(),
                help => format!("{}; {help}", one.message),
            });
            opened.warnings = terminated(&lines.collect::<Vec<_>>().join("\n"));
            // SAFETY: the place is not null, and by the contract of this function valid.
            unsafe { warnings.write(opened.warnings.as_ptr()) };
            Ok(())
        })
    })
}

/// Small-signal answer.
///
/// # Safety
/// As the header says: pointers are null or valid for the lengths of the device.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_linearize(
    device: *mut DeviceHandle,
    state: u64,
    omega: f64,
    admittance: *mut f64,
    signals: *mut f64,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let device = unsafe { reference(device, "device") }?;
        let state = tried(state)?;
        device.run(|opened| {
            opened.device.linearize(state, omega, &mut opened.small)?;
            // SAFETY: by the contract of this function both arrays are null or have their length.
            unsafe {
                fill(admittance, opened.small.admittance.as_flattened());
                fill(signals, opened.small.outputs.as_flattened());
            }
            Ok(())
        })
    })
}

/// Spectral densities.
///
/// # Safety
/// As the header says: pointers are null or valid for the lengths of the device.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_noise(
    device: *mut DeviceHandle,
    state: u64,
    omega: f64,
    spectra: *mut f64,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (device, spectra) = unsafe { (reference(device, "device")?, place(spectra, "spectra")?) };
        let state = tried(state)?;
        device.run(|opened| {
            opened.device.noise(state, omega, &mut opened.spectra)?;
            // SAFETY: by the contract of this function the array has its length.
            unsafe { fill(spectra, opened.spectra.as_flattened()) };
            Ok(())
        })
    })
}

/// Value of a quantity.
///
/// # Safety
/// As the header says: pointers are null or valid, and texts end with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_read(
    device: *mut DeviceHandle,
    state: u64,
    name: *const c_char,
    number: *mut f64,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (device, name, number) =
            unsafe { (reference(device, "device")?, text(name, "name")?, place(number, "value")?) };
        let state = tried(state)?;
        device.run(|opened| {
            let found = opened.device.read_quantity(state, name)?;
            // SAFETY: the place is not null, and by the contract of this function valid.
            unsafe { number.write(found) };
            Ok(())
        })
    })
}

/// States as bytes.
///
/// # Safety
/// As the header says: pointers are null or valid for the stated lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_save(
    device: *const DeviceHandle,
    states: *const u64,
    count: usize,
    bytes: *mut *mut u8,
    length: *mut usize,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (device, states) = unsafe { (reference(device, "device")?, array(states, count, "states")?) };
        let (bytes, length) = (place(bytes, "bytes")?, place(length, "length")?);
        let tokens = states.iter().map(|state| tried(*state)).collect::<Result<Vec<_>, _>>()?;
        device.run(|opened| {
            let only = (!tokens.is_empty()).then_some(tokens.as_slice());
            let saved = opened.device.save(only)?.into_boxed_slice();
            let (size, made) = (saved.len(), Box::into_raw(saved));
            // SAFETY: the places are not null, and by the contract of this function valid.
            unsafe {
                length.write(size);
                bytes.write(made.cast());
            }
            Ok(())
        })
    })
}

/// States from bytes.
///
/// # Safety
/// As the header says: pointers are null or valid for the stated lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_load(device: *mut DeviceHandle, bytes: *const u8, length: usize) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (device, bytes) = unsafe { (reference(device, "device")?, array(bytes, length, "bytes")?) };
        device.run(|opened| {
            let description = opened.device.load(bytes)?;
            opened.units = DeviceUnits::of(&description);
            Ok(())
        })
    })
}

/// Releases the bytes of a snapshot.
///
/// # Safety
/// Both are those of one `bimorph_device_save`, and are not used again; or `bytes` is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_bytes_free(bytes: *mut u8, length: usize) {
    if !bytes.is_null() {
        // SAFETY: by the contract of this function they are the parts of a boxed slice.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(bytes, length)) });
    }
}

/// Releases a device.
///
/// # Safety
/// `device` is null or a handle that is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_device_free(device: *mut DeviceHandle) {
    value((), || {
        // SAFETY: by the contract of this function.
        unsafe { release(device) };
        Ok(())
    });
}

#[cfg(test)]
mod tests {
    //! A fault inside a call is a code, and the device continues.
    use super::*;
    use bimorph::compile::{CompileOptions, compile};
    use bimorph::netlist::Bundle;

    /// A panic inside a call becomes BIMORPH_INTERNAL with its text, prints nothing, and the device has the same bits after it.
    #[test]
    fn a_panic_is_a_code() {
        let netlist = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] [l=1u w=1u]\n\
                    beam2d p [a b] [l=100u w=2u]\nf2d * [b] [F=1u oz=pi/2]\n";
        let compiled = compile(&Bundle::from_text("c.net", netlist), &CompileOptions::default()).expect("a model");
        let mut local = LocalDevice::new(Arc::new(compiled));
        let asked = OpenRequest { ports: vec!["b.y".into()], signals: vec!["b.y".into()], noise: None };
        let description = local.open(&asked).expect("open");
        let handle = DeviceHandle(Mutex::new(OpenedDevice {
            device: local,
            units: DeviceUnits::of(&description),
            reply: TrialReply::default(),
            small: SmallSignal::default(),
            spectra: Vec::new(),
            warnings: CString::default(),
        }));
        let request = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[1e-6] };
        let answer = |handle: &DeviceHandle| {
            let tried = handle.run(|opened| {
                opened.device.trial(&request, &mut opened.reply)?;
                Ok(opened.reply.clone())
            });
            tried.map_err(|fault| format!("{fault:?}")).expect("an answer")
        };
        let before = answer(&handle);
        let code = call(|| handle.run(|_| -> Result<(), CallFault> { panic!("on purpose") }));
        assert_eq!(code, CallCode::Internal as c_int);
        // SAFETY: the message of this thread is valid until the next failed call.
        let message = unsafe { text(crate::fault::bimorph_error(), "message") }.map(str::to_owned).ok();
        assert!(message.as_deref().is_some_and(|m| m.contains("on purpose")), "{message:?}");
        assert_eq!(answer(&handle), before);
    }
}
