//! Compiled models.

use crate::fault::{CallFault, call, terminated, value};
use crate::memory::{array, place, reference, release, text};
use crate::options::OptionsHandle;
use bimorph::analysis::mesh;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::device::Device;
use bimorph::device::local::LocalDevice;
use bimorph::input::{self, LayoutChoice};
use bimorph::netlist::Bundle;
use std::ffi::{CString, c_char, c_int};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// A model as drawn, and on the mesh for circuits once a device needs it.
#[derive(Debug)]
pub struct ModelHandle {
    pub(crate) drawn: CompiledModel,
    in_circuit: OnceLock<Arc<CompiledModel>>,
    warnings: CString,
    pub(crate) ports: Vec<String>,
    port_names: Vec<CString>,
    signal_names: OnceLock<Vec<CString>>,
}

impl ModelHandle {
    fn new(bundle: &Bundle, options: &CompileOptions) -> Result<Self, CallFault> {
        let drawn = compile(bundle, options)?;
        let electrics = &drawn.parts.system.electrics;
        let ports = electrics.names[..electrics.ports].to_vec();
        let port_names = ports.iter().map(|name| terminated(name)).collect();
        let warnings = terminated(drawn.warnings.render(false).trim_end());
        let (in_circuit, signal_names) = (OnceLock::new(), OnceLock::new());
        Ok(Self { drawn, in_circuit, warnings, ports, port_names, signal_names })
    }

    /// The model on the mesh for circuits.
    pub(crate) fn in_circuit(&self) -> &Arc<CompiledModel> {
        self.in_circuit.get_or_init(|| Arc::new(mesh::in_circuit(&self.drawn)))
    }

    fn signal_names(&self) -> &[CString] {
        self.signal_names.get_or_init(|| {
            let device = LocalDevice::new(Arc::new(self.drawn.clone()));
            device.names().iter().map(|name| terminated(name)).collect()
        })
    }

    /// Voltages by port name; null stands for 0 V at each.
    ///
    /// # Safety
    /// `volts` is null, or points to one number for each port.
    pub(crate) unsafe fn voltages(&self, volts: *const f64) -> Result<Vec<(String, f64)>, CallFault> {
        if volts.is_null() {
            return Ok(Vec::new());
        }
        // SAFETY: by the contract of this function.
        let volts = unsafe { array(volts, self.ports.len(), "volts") }?;
        if let Some(wrong) = volts.iter().find(|v| !v.is_finite()) {
            return Err(CallFault::argument(format!("volts: expected finite numbers, got {wrong}")));
        }
        Ok(self.ports.iter().cloned().zip(volts.iter().copied()).collect())
    }
}

/// The options of a call.
///
/// # Safety
/// `options` is null or a valid handle.
unsafe fn chosen(options: *const OptionsHandle) -> CompileOptions {
    // SAFETY: by the contract of this function.
    unsafe { options.as_ref() }.map_or_else(CompileOptions::default, |handle| handle.options.clone())
}

/// Compiles a file.
///
/// # Safety
/// As the header says: pointers are null or valid, and texts end with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_open(
    path: *const c_char,
    options: *const OptionsHandle,
    model: *mut *mut ModelHandle,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (path, options, model) = unsafe { (text(path, "path")?, chosen(options), place(model, "model")?) };
        let source = input::read(Path::new(path), &[], &LayoutChoice::default(), &mut |_| (), &mut |_| true)?;
        let made = Box::into_raw(Box::new(ModelHandle::new(&source.bundle, &options)?));
        // SAFETY: the place is not null, and by the contract of this function valid.
        unsafe { model.write(made) };
        Ok(())
    })
}

/// Compiles a text.
///
/// # Safety
/// As the header says: pointers are null or valid, `text` for `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_compile(
    name: *const c_char,
    netlist: *const c_char,
    length: usize,
    options: *const OptionsHandle,
    model: *mut *mut ModelHandle,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (name, options, model) = unsafe { (text(name, "name")?, chosen(options), place(model, "model")?) };
        // SAFETY: by the contract of this function.
        let bytes: &[u8] = unsafe { array(netlist.cast(), length, "text") }?;
        let text = String::from_utf8_lossy(bytes);
        let made = Box::into_raw(Box::new(ModelHandle::new(&Bundle::from_text(name, &text), &options)?));
        // SAFETY: the place is not null, and by the contract of this function valid.
        unsafe { model.write(made) };
        Ok(())
    })
}

/// Warnings about the text.
///
/// # Safety
/// `model` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_warnings(model: *const ModelHandle) -> *const c_char {
    // SAFETY: by the contract of this function.
    value(c"".as_ptr(), || Ok(unsafe { reference(model, "model") }?.warnings.as_ptr()))
}

/// Number of electrical ports.
///
/// # Safety
/// `model` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_port_count(model: *const ModelHandle) -> usize {
    // SAFETY: by the contract of this function.
    value(0, || Ok(unsafe { reference(model, "model") }?.port_names.len()))
}

/// Name of a port.
///
/// # Safety
/// `model` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_port_name(model: *const ModelHandle, index: usize) -> *const c_char {
    value(std::ptr::null(), || {
        // SAFETY: by the contract of this function.
        let names = &unsafe { reference(model, "model") }?.port_names;
        Ok(names.get(index).map_or(std::ptr::null(), |name| name.as_ptr()))
    })
}

/// Number of signals.
///
/// # Safety
/// `model` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_signal_count(model: *const ModelHandle) -> usize {
    // SAFETY: by the contract of this function.
    value(0, || Ok(unsafe { reference(model, "model") }?.signal_names().len()))
}

/// Name of a signal.
///
/// # Safety
/// `model` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_signal_name(model: *const ModelHandle, index: usize) -> *const c_char {
    value(std::ptr::null(), || {
        // SAFETY: by the contract of this function.
        let names = unsafe { reference(model, "model") }?.signal_names();
        Ok(names.get(index).map_or(std::ptr::null(), |name| name.as_ptr()))
    })
}

/// Mechanical unknowns.
///
/// # Safety
/// `model` is null or a valid handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_unknowns(model: *const ModelHandle) -> usize {
    // SAFETY: by the contract of this function.
    value(0, || Ok(unsafe { reference(model, "model") }?.drawn.unknowns()))
}

/// Releases a model.
///
/// # Safety
/// `model` is null or a handle that is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_model_free(model: *mut ModelHandle) {
    value((), || {
        // SAFETY: by the contract of this function.
        unsafe { release(model) };
        Ok(())
    });
}
