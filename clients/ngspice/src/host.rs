//! The host's functions, reached through the table it gives the plug-in.

use crate::abi::{InstanceHead, ModelHead, slot};
use crate::layout::{Generation, HostLayout};
use std::cell::UnsafeCell;
use std::ffi::{CString, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The host's table of function pointers; null until the host passes it.
#[repr(transparent)]
pub(crate) struct Core(UnsafeCell<*const *const c_void>);

// SAFETY: the host writes the pointer once, from the thread that loads the plug-in, before it makes any other call.
unsafe impl Sync for Core {}

/// The place the host writes its table into.
pub(crate) static CORE: Core = Core(UnsafeCell::new(std::ptr::null()));

impl Core {
    /// Where the host shall write.
    pub(crate) fn place(&self) -> *mut *const *const c_void {
        self.0.get()
    }

    /// The function in `slot`.
    ///
    /// # Safety
    /// The host has written its table, and `F` is the type of the function in that slot.
    unsafe fn function<F: Copy>(&self, slot: usize) -> F {
        const { assert!(size_of::<F>() == size_of::<*const c_void>()) };
        // SAFETY: by contract the table is there and has this slot; `F` is a function pointer of pointer size.
        unsafe { std::mem::transmute_copy(&*(*self.0.get()).add(slot)) }
    }
}

/// Model and circuit, as ngspice passes them to a device's functions.
type OverModel = unsafe extern "C" fn(*mut ModelHead, *mut c_void) -> c_int;

/// Declares a call that is passed on to the host as it is.
macro_rules! pass_on {
    ($(#[$doc:meta])* $name:ident, $slot:ident, ($($arg:ident: $ty:ty),*)) => {
        $(#[$doc])*
        ///
        /// # Safety
        /// The arguments are those with which the host called the plug-in.
        pub(crate) unsafe fn $name($($arg: $ty),*) -> c_int {
            // SAFETY: the slot holds the host's function of this very signature.
            unsafe {
                CORE.function::<unsafe extern "C" fn($($ty),*) -> c_int>(slot::$slot)($($arg),*)
            }
        }
    };
}

pass_on!(/// Allocates matrix entries and outputs.
    setup, SETUP, (matrix: *mut c_void, model: *mut ModelHead, circuit: *mut c_void, states: *mut c_int));
pass_on!(/// Stores a model parameter.
    model_param, MODEL_PARAM, (index: c_int, value: *mut c_void, model: *mut ModelHead));
pass_on!(/// Reads a model parameter.
    model_ask, MODEL_ASK, (circuit: *mut c_void, model: *mut ModelHead, index: c_int, value: *mut c_void));
pass_on!(/// Bounds the next step.
    trunc, TRUNC, (model: *mut ModelHead, circuit: *mut c_void, step: *mut f64));
pass_on!(/// Frees an instance.
    delete, DELETE, (instance: *mut InstanceHead));
pass_on!(/// Frees a model.
    model_delete, MODEL_DELETE, (model: *mut ModelHead));

/// Undoes [`setup`].
///
/// # Safety
/// The arguments are those with which the host called the plug-in.
pub(crate) unsafe fn unsetup(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: the slot holds the host's function of this signature.
    unsafe { CORE.function::<OverModel>(slot::UNSETUP)(model, circuit) }
}

/// Calls every instance of the plug-in and loads the matrix with its answers.
///
/// # Safety
/// The arguments are those with which the host called the plug-in.
pub(crate) unsafe fn load(model: *mut ModelHead, circuit: *mut c_void) -> c_int {
    // SAFETY: as above.
    unsafe { CORE.function::<OverModel>(slot::LOAD)(model, circuit) }
}

/// Declares a double of this point's memory as an integral to the host, so that its truncation error bounds the steps.
/// The double is overwritten. False where the host does not take it now.
///
/// # Safety
/// To be called from within a load of a transient; `at` lies in the memory of this point.
pub(crate) unsafe fn integral(at: *mut f64) -> bool {
    let mut partial = 0.0;
    // SAFETY: as above; the host registers the place, and writes to it and to `partial`.
    unsafe {
        CORE.function::<unsafe extern "C" fn(f64, *mut f64, *mut f64) -> c_int>(slot::ANALOG_INTEGRATE)(
            0.0,
            at,
            &mut partial,
        ) == 0
    }
}

/// Prints a message, with the name of the instance, where this host prints.
///
/// # Safety
/// To be called from within a load.
pub(crate) unsafe fn message(text: &str) {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    // SAFETY: the host only reads the text; the instance it names is set during a load.
    unsafe {
        CORE.function::<unsafe extern "C" fn(*mut c_char) -> c_int>(slot::MESSAGE_SEND)(text.as_ptr().cast_mut());
    }
}

/// Whether the host is ngspice 42 to 44. There the function in [`HostLayout::telling_slot`] returns a circuit, from 45
/// on the folder of the deck or null. Asked once, since a host does not change.
///
/// # Safety
/// To be called from within a call of the host, with its layout and the circuit it passed.
pub(crate) unsafe fn until_44(layout: &HostLayout, circuit: *mut c_void) -> bool {
    static ANSWER: OnceLock<bool> = OnceLock::new();
    let Some(slot) = layout.telling_slot() else { return layout.generation < Generation::Since43 };
    *ANSWER.get_or_init(|| {
        // SAFETY: in each of these hosts the function takes nothing and answers a pointer it owns, or null.
        let reported = unsafe { CORE.function::<unsafe extern "C" fn() -> *mut c_void>(slot)() };
        // Another circuit than this one is excluded by checking whether its bytes name a folder. SAFETY: a circuit,
        // whose first pointers hold zero bytes, or a text.
        reported == circuit
            || unsafe { crate::call::text(reported.cast()) }.is_some_and(|text| !Path::new(&text).is_dir())
    })
}

/// Binds the matrix entries of code models for KLU, by the host's own function `which`: 0 real, 1 from real to complex, 2
/// back.
///
/// # Safety
/// The arguments are those with which the host called the plug-in.
pub(crate) unsafe fn bind(
    which: usize,
    model: *mut ModelHead,
    circuit: *mut c_void,
    layout: &HostLayout,
) -> Option<c_int> {
    // SAFETY: by contract.
    let first = layout.bind_slot(unsafe { until_44(layout, circuit) })?;
    // SAFETY: hosts that bind have these three functions there, of this signature.
    Some(unsafe { CORE.function::<OverModel>(first + which)(model, circuit) })
}

/// The deck's directory from the host's function in `slot`.
///
/// # Safety
/// `slot` is where this host keeps that function.
pub(crate) unsafe fn deck_directory(slot: usize) -> Option<PathBuf> {
    // SAFETY: by contract; the host answers a string it owns, or null.
    unsafe {
        let path = CORE.function::<unsafe extern "C" fn() -> *const c_char>(slot)();
        crate::call::text(path).map(PathBuf::from)
    }
}
