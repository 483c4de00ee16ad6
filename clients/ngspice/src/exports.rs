//! The symbols by which ngspice loads a `.cm` file, in the order in which it calls them.

use crate::host::CORE;
use crate::table::{DEVICE, LAYOUT};
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

/// Number of devices.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn CMdevNum() -> *const c_int {
    let _ = catch_unwind(|| {
        crate::panics::keep_quiet();
        // SAFETY: the host calls this while it loads the plug-in.
        unsafe { DEVICE.declare() }
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
        match unsafe { DEVICE.complete(version) } {
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
