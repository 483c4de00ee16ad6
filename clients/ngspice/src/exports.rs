//! The symbols by which ngspice loads a `.cm` file, in the order in which it calls them.

use crate::callbacks;
use crate::host::CORE;
use crate::table::{DEVICE, DeviceFunctions, LAYOUT};
use std::ffi::{c_int, c_void};
use std::io::Write;
use std::panic::catch_unwind;

static DEVICE_COUNT: c_int = 1;
static TYPE_COUNT: c_int = 0;

/// A null-ended list of one device.
struct List([*mut c_void; 2]);
// SAFETY: constants; the addresses in it are those of statics.
unsafe impl Sync for List {}
// SAFETY: as above.
unsafe impl Send for List {}

/// The functions that the host calls.
fn device_functions() -> DeviceFunctions {
    DeviceFunctions {
        model_param: callbacks::model_param as *const c_void,
        load: callbacks::load as *const c_void,
        setup: callbacks::setup as *const c_void,
        unsetup: callbacks::unsetup as *const c_void,
        pole_zero_setup: callbacks::pole_zero_setup as *const c_void,
        trunc: callbacks::trunc as *const c_void,
        small_signal_load: callbacks::small_signal_load as *const c_void,
        accept: callbacks::accept as *const c_void,
        model_delete: callbacks::model_delete as *const c_void,
        delete: callbacks::delete as *const c_void,
        ask: callbacks::ask as *const c_void,
        model_ask: callbacks::model_ask as *const c_void,
        convergence_test: callbacks::convergence_test as *const c_void,
        distortion: callbacks::distortion as *const c_void,
        noise: callbacks::noise as *const c_void,
        bind: callbacks::bind as *const c_void,
        bind_complex: callbacks::bind_complex as *const c_void,
        bind_real: callbacks::bind_real as *const c_void,
    }
}

/// Number of devices.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn CMdevNum() -> *const c_int {
    let _ = catch_unwind(|| {
        crate::panics::keep_quiet();
        // SAFETY: the host calls this while it loads the plug-in.
        unsafe { DEVICE.declare(callbacks::evaluate) }
    });
    &raw const DEVICE_COUNT
}

/// The devices.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn CMdevs() -> *const c_void {
    static DEVICES: std::sync::OnceLock<List> = std::sync::OnceLock::new();
    DEVICES.get_or_init(|| List([DEVICE.address(), std::ptr::null_mut()])).0.as_ptr().cast()
}

/// Number of node types of its own: none.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn CMudnNum() -> *const c_int {
    &raw const TYPE_COUNT
}

/// Node types of its own: an empty list.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn CMudns() -> *const c_void {
    static TYPES: List = List([std::ptr::null_mut(); 2]);
    TYPES.0.as_ptr().cast()
}

/// Where the host shall write its function table. By now it has registered the device, so its layout shows.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn CMgetCoreItfPtr() -> *mut c_void {
    let _ = catch_unwind(|| {
        if LAYOUT.get().is_some() {
            return; // Loaded once more, under the same or another path: the table is complete.
        }
        let version = std::env::var("BIMORPH_NGSPICE").ok().and_then(|v| v.split('.').next()?.parse().ok());
        // SAFETY: the host calls this while it loads the plug-in, after it registered the device.
        match unsafe { DEVICE.complete(version, &device_functions()) } {
            Ok(layout) => {
                crate::trace::line(format_args!("layout {layout:?}"));
                let _ = LAYOUT.set(layout);
            }
            Err(error) => {
                // SAFETY: as above.
                unsafe { DEVICE.withdraw() };
                let _ = writeln!(std::io::stderr(), "bimorph: {error}; the model \"bimorph\" is not available");
            }
        }
    });
    CORE.place().cast()
}
