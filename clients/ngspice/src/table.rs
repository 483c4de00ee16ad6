//! The device table and the declarations of ports and parameters that the host reads.
//!
//! The host reads the first part (name, ports, parameters) at any time, and fills in two sizes while it registers the
//! device. Only then the layout is known and the second part, the functions, can be written.

use crate::abi::{
    Bound42, Complex, ConnectionInfo, ParameterInfo42, ParameterInfo43, ParameterInfoTail, SpiceParameter, Value, kind,
    port,
};
use crate::callbacks;
use crate::layout::{Layout, LayoutError, TABLE_WORDS};
use std::cell::UnsafeCell;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::OnceLock;

/// Name of a parameter, how code models and how SPICE call its kind, and what it is.
type Declaration = (&'static CStr, c_int, c_int, &'static CStr);

const STRINGS: c_int = kind::IF_STRING | kind::IF_VECTOR;

/// Parameters of a `.model` line, in the order of [`crate::call::card`].
pub(crate) const PARAMETERS: [Declaration; 11] = [
    (c"file", kind::STRING, kind::IF_STRING, c"netlist of the mechanical part"),
    (c"ports", kind::STRING, STRINGS, c"names of the electrical ports, in the order of the node pairs"),
    (c"monitors", kind::STRING, STRINGS, c"signals shown as voltages, NAME or NAME:SCALE"),
    (c"set", kind::STRING, STRINGS, c"netlist parameters, NAME=VALUE"),
    (c"remote", kind::STRING, kind::IF_STRING, c"address of a server that steps the model"),
    (c"tol", kind::REAL, kind::IF_REAL, c"relative error aimed at"),
    (c"band", kind::REAL, kind::IF_REAL, c"highest frequency to resolve [Hz]"),
    (c"linear", kind::BOOLEAN, kind::IF_FLAG, c"small displacements about the drawn geometry"),
    (c"undamped", kind::BOOLEAN, kind::IF_FLAG, c"leave out gas damping"),
    (c"deadline", kind::REAL, kind::IF_REAL, c"longest wait for the server [s]"),
    (c"junctions", kind::STRING, kind::IF_STRING, c"how beams meet: centreline, offset, calibrated"),
];

static ZERO: c_int = 0;
static PARAMETER_COUNT: c_int = PARAMETERS.len() as c_int;

/// Declarations whose addresses the host keeps.
struct Declarations {
    spice: Vec<SpiceParameter>,
    connections: Vec<ConnectionInfo>,
    parameters42: Vec<ParameterInfo42>,
    parameters43: Vec<ParameterInfo43>,
}

// SAFETY: written once behind a `OnceLock`, then only read; the pointers in it point to constants.
unsafe impl Send for Declarations {}
// SAFETY: as above.
unsafe impl Sync for Declarations {}

/// Port kinds and their names, as pairs of arrays.
struct Kinds([c_int; 2], [*const c_char; 2]);
// SAFETY: constants.
unsafe impl Sync for Kinds {}

static PORT_KINDS: Kinds = Kinds([port::DIFF_CONDUCTANCE, port::CONDUCTANCE], [c"gd".as_ptr(), c"g".as_ptr()]);
static MONITOR_KINDS: Kinds = Kinds([port::VOLTAGE, port::DIFF_VOLTAGE], [c"v".as_ptr(), c"vd".as_ptr()]);

fn declarations() -> &'static Declarations {
    static DECLARATIONS: OnceLock<Declarations> = OnceLock::new();
    DECLARATIONS.get_or_init(|| {
        let zero =
            Bound42 { flag: 0, integer: 0, real: 0.0, complex: Complex { re: 0.0, im: 0.0 }, string: std::ptr::null() };
        let none = Value { complex: Complex { re: 0.0, im: 0.0 } };
        // Lists are declared to code models as single values: only so may one be left out, and have any length. The
        // SPICE half of the declaration, by which the line is parsed, says that they are lists.
        let rest = ParameterInfoTail {
            is_array: 0,
            has_conn_ref: 0,
            conn_ref: 0,
            has_lower: 0,
            lower: 0,
            has_upper: 0,
            upper: 0,
            null_allowed: 1,
        };
        Declarations {
            spice: PARAMETERS
                .iter()
                .enumerate()
                .map(|(id, (name, _, data_type, text))| SpiceParameter {
                    keyword: name.as_ptr(),
                    id: id as c_int,
                    data_type: data_type | kind::IF_ASK_SET,
                    description: text.as_ptr(),
                })
                .collect(),
            connections: vec![
                connection(c"ports", port::INOUT, &PORT_KINDS, false),
                connection(c"monitors", port::OUT, &MONITOR_KINDS, true),
            ],
            parameters42: PARAMETERS
                .iter()
                .map(|(name, kind, _, text)| ParameterInfo42 {
                    name: name.as_ptr(),
                    description: text.as_ptr(),
                    kind: *kind,
                    has_default: 1,
                    default: zero,
                    has_lower: 0,
                    lower: zero,
                    has_upper: 0,
                    upper: zero,
                    rest,
                })
                .collect(),
            parameters43: PARAMETERS
                .iter()
                .map(|(name, kind, _, text)| ParameterInfo43 {
                    name: name.as_ptr(),
                    description: text.as_ptr(),
                    kind: *kind,
                    default_count: 0,
                    defaults: std::ptr::null(),
                    has_lower: 0,
                    lower: none,
                    has_upper: 0,
                    upper: none,
                    rest,
                })
                .collect(),
        }
    })
}

fn connection(name: &'static CStr, direction: c_int, kinds: &'static Kinds, optional: bool) -> ConnectionInfo {
    ConnectionInfo {
        name: name.as_ptr(),
        description: name.as_ptr(),
        direction,
        default_type: kinds.0[0],
        default_name: kinds.1[0],
        allowed_count: 2,
        allowed: kinds.0.as_ptr(),
        allowed_names: kinds.1.as_ptr(),
        is_array: 1,
        has_lower: 0,
        lower: 0,
        has_upper: 0,
        upper: 0,
        null_allowed: optional.into(),
    }
}

/// The device table, with room for any host's.
pub(crate) struct Table(UnsafeCell<[usize; TABLE_WORDS]>);

// SAFETY: the plug-in writes it only while the host loads it, from the loading thread; the host reads it afterwards.
unsafe impl Sync for Table {}

/// The one device of this plug-in.
pub(crate) static DEVICE: Table = Table(UnsafeCell::new([0; TABLE_WORDS]));

/// The host's layout, once known.
pub(crate) static LAYOUT: OnceLock<Layout> = OnceLock::new();

impl Table {
    /// Address handed to the host.
    pub(crate) fn address(&self) -> *mut c_void {
        self.0.get().cast()
    }

    /// Writes one word of the table.
    ///
    /// # Safety
    /// The host is loading the plug-in.
    unsafe fn put<T>(&self, byte: usize, value: T) {
        debug_assert!(byte + size_of::<T>() <= TABLE_WORDS * 8);
        // SAFETY: in bounds and aligned; by contract nobody else uses the table now.
        unsafe { self.0.get().cast::<u8>().add(byte).cast::<T>().write(value) }
    }

    /// Writes what every host reads at the same place.
    ///
    /// # Safety
    /// The host is loading the plug-in.
    pub(crate) unsafe fn declare(&self) {
        let declarations = declarations();
        // SAFETY: the public part of the table has this layout from 39 to 47.
        unsafe {
            self.put(0, c"bimorph".as_ptr());
            self.put(8, c"electro-mechanical model from a netlist".as_ptr());
            self.put(16, &raw const ZERO); // terminals
            self.put(24, &raw const ZERO); // named terminals
            self.put(40, &raw const ZERO); // instance parameters
            self.put(56, &raw const PARAMETER_COUNT);
            self.put(64, declarations.spice.as_ptr());
            self.put(72, callbacks::evaluate as unsafe extern "C" fn(*mut c_void));
            self.put(80, declarations.connections.len() as c_int);
            self.put(88, declarations.connections.as_ptr());
            self.put(96, PARAMETER_COUNT);
        }
    }

    /// Finds the host's layout from what it wrote, then fills in the functions.
    ///
    /// # Errors
    /// [`LayoutError`]: nothing was filled in.
    ///
    /// # Safety
    /// The host has registered this table and is still loading the plug-in.
    pub(crate) unsafe fn complete(&self, version: Option<u32>) -> Result<Layout, LayoutError> {
        // SAFETY: by contract nobody else uses the table now; what the host wrote are addresses of its own integers.
        let layout = unsafe { Layout::detect(&*self.0.get(), |at| *(at as *const c_int), version)? };
        let declarations = declarations();
        let at = layout.functions();
        // SAFETY: offsets of the host's own device functions; the types are theirs.
        unsafe {
            if layout.new_parameters() {
                self.put(104, declarations.parameters43.as_ptr());
            } else {
                self.put(104, declarations.parameters42.as_ptr());
            }
            self.put(at + 8, callbacks::model_param as *const c_void);
            self.put(at + 16, callbacks::load as *const c_void);
            self.put(at + 24, callbacks::setup as *const c_void);
            self.put(at + 32, callbacks::unsetup as *const c_void);
            self.put(at + 56, callbacks::trunc as *const c_void);
            self.put(at + 72, callbacks::load as *const c_void);
            self.put(at + 80, callbacks::accept as *const c_void);
            self.put(at + 96, callbacks::model_delete as *const c_void);
            self.put(at + 104, callbacks::delete as *const c_void);
            self.put(at + 120, callbacks::ask as *const c_void);
            self.put(at + 128, callbacks::model_ask as *const c_void);
            self.put(at + 144, callbacks::convergence_test as *const c_void);
        }
        Ok(layout)
    }

    /// Takes the model's name away, so that no deck finds it.
    ///
    /// # Safety
    /// The host is loading the plug-in.
    pub(crate) unsafe fn withdraw(&self) {
        // SAFETY: as for `declare`.
        unsafe { self.put(0, c"bimorph (unknown ngspice)".as_ptr()) }
    }
}
