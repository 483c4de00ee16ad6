//! The device table and the declarations of ports and parameters that the host reads.
//!
//! The host reads the first part (name, ports, parameters) at any time, and fills in two sizes while it registers the
//! device. Only then the layout is known and the second part, the functions, can be written.

use crate::abi::{
    Bound42, Complex, ConnectionInfo, ParameterInfo42, ParameterInfo43, ParameterInfoTail, ParameterValue,
    SpiceParameter, kind, port,
};
use crate::deck_options::{DeckValue, Declared, declared};
use crate::layout::{HostLayout, HostLayoutError, TABLE_WORDS};
use crate::model_card::DEADLINE;
use crate::query_table::ParameterTable;
use std::cell::UnsafeCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::sync::OnceLock;

/// A parameter of a `.model` line.
pub(crate) struct Declaration {
    name: CString,
    /// How code models call its kind.
    kind: c_int,
    /// How SPICE does.
    data_type: c_int,
    /// Value in ngspice's listings where the line omits the parameter; `None`: no text, an empty list. From 43 on
    /// ngspice rejects a line that omits a number or a boolean without a default. The plug-in can still detect the
    /// omission, so that it never reads these.
    default: Option<ParameterValue>,
    text: CString,
}

const STRINGS: c_int = kind::IF_STRING | kind::IF_VECTOR;
const NOTHING: ParameterValue = ParameterValue { complex: Complex { re: 0.0, im: 0.0 } };

/// The parameters that are the plug-in's own; the options of a model follow them.
const OWN: [(&str, c_int, c_int, Option<f64>, &str); OWN_COUNT] = [
    ("file", kind::STRING, kind::IF_STRING, None, "netlist of the mechanical part"),
    (
        "ports",
        kind::STRING,
        STRINGS,
        None,
        "names of the ports, in the order of the node pairs; NAME:SCALE where they are not electrical",
    ),
    ("monitors", kind::STRING, STRINGS, None, "signals shown as voltages, NAME or NAME:SCALE"),
    ("set", kind::STRING, STRINGS, None, "netlist parameters, NAME=VALUE"),
    ("remote", kind::STRING, kind::IF_STRING, None, "address of a server that steps the model"),
    ("deadline", kind::REAL, kind::IF_REAL, Some(DEADLINE), "longest wait for the server [s]"),
    ("noise", kind::BOOLEAN, kind::IF_FLAG, Some(0.0), "thermal agitation in .tran"),
    ("seed", kind::REAL, kind::IF_REAL, Some(1.0), "names the random numbers of the agitation"),
    ("noise_band", kind::REAL, kind::IF_REAL, Some(0.0), "band of the agitation [Hz]; 0: by the model"),
];
/// How many they are.
pub(crate) const OWN_COUNT: usize = 9;

/// Parameters of a `.model` line, in the order of [`crate::parameters::card`].
fn parameters() -> Vec<Declaration> {
    let real = |x| ParameterValue { complex: Complex { re: x, im: 0.0 } };
    let text = |text: &str| CString::new(text).unwrap_or_default();
    let own = OWN.iter().map(|(name, kind, data_type, default, about)| Declaration {
        name: text(name),
        kind: *kind,
        data_type: *data_type,
        default: default.map(real),
        text: text(about),
    });
    let option = |declared: Declared| {
        let (kind, data_type, default) = match declared.default {
            DeckValue::Flag(flag) => {
                let mut value = NOTHING;
                value.flag = flag.into();
                (kind::BOOLEAN, kind::IF_FLAG, Some(value))
            }
            DeckValue::Number(x) => (kind::REAL, kind::IF_REAL, Some(real(x))),
            DeckValue::Text(_) => (kind::STRING, kind::IF_STRING, None),
        };
        Declaration { name: text(declared.name), kind, data_type, default, text: text(&declared.text) }
    };
    own.chain(declared().into_iter().map(option)).collect()
}

static ZERO: c_int = 0;

/// Declarations whose addresses the host keeps.
struct Declarations {
    spice: Vec<SpiceParameter>,
    connections: Vec<ConnectionInfo>,
    parameters42: Vec<ParameterInfo42>,
    parameters43: Vec<ParameterInfo43>,
    count: c_int,
    /// Storage that the others point to.
    _parameters: Vec<Declaration>,
}

// SAFETY: written once behind a `OnceLock`, then only read; the pointers in it point to constants.
unsafe impl Send for Declarations {}
// SAFETY: as above.
unsafe impl Sync for Declarations {}

/// Port kinds and their names, as pairs of arrays.
struct Kinds<const N: usize>([c_int; N], [*const c_char; N]);
// SAFETY: constants.
unsafe impl<const N: usize> Sync for Kinds<N> {}

static PORT_KINDS: Kinds<4> = Kinds(
    [port::DIFF_CONDUCTANCE, port::CONDUCTANCE, port::DIFF_RESISTANCE, port::RESISTANCE],
    [c"gd".as_ptr(), c"g".as_ptr(), c"hd".as_ptr(), c"h".as_ptr()],
);
static MONITOR_KINDS: Kinds<2> = Kinds([port::VOLTAGE, port::DIFF_VOLTAGE], [c"v".as_ptr(), c"vd".as_ptr()]);

fn declarations() -> &'static Declarations {
    static DECLARATIONS: OnceLock<Declarations> = OnceLock::new();
    DECLARATIONS.get_or_init(|| {
        let zero =
            Bound42 { flag: 0, integer: 0, real: 0.0, complex: Complex { re: 0.0, im: 0.0 }, string: std::ptr::null() };
        let none = NOTHING;
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
        // Pointers into it stay valid when the vector itself is moved.
        let parameters = parameters();
        Declarations {
            spice: parameters
                .iter()
                .enumerate()
                .map(|(id, declared)| SpiceParameter {
                    keyword: declared.name.as_ptr(),
                    id: id as c_int,
                    data_type: declared.data_type | kind::IF_ASK_SET,
                    description: declared.text.as_ptr(),
                })
                .collect(),
            connections: vec![
                connection(c"ports", port::INOUT, &PORT_KINDS, false),
                connection(c"monitors", port::OUT, &MONITOR_KINDS, true),
            ],
            parameters42: parameters
                .iter()
                .map(|declared| ParameterInfo42 {
                    name: declared.name.as_ptr(),
                    description: declared.text.as_ptr(),
                    kind: declared.kind,
                    has_default: 1,
                    default: declared.default.map_or(zero, |value| {
                        // SAFETY: every bit of a value of either kind is set.
                        let (flag, real) = unsafe { (value.flag, value.real) };
                        Bound42 { flag, real, ..zero }
                    }),
                    has_lower: 0,
                    lower: zero,
                    has_upper: 0,
                    upper: zero,
                    rest,
                })
                .collect(),
            parameters43: parameters
                .iter()
                .map(|declared| ParameterInfo43 {
                    name: declared.name.as_ptr(),
                    description: declared.text.as_ptr(),
                    kind: declared.kind,
                    default_count: declared.default.is_some().into(),
                    defaults: declared.default.as_ref().map_or(std::ptr::null(), |value| &raw const *value),
                    has_lower: 0,
                    lower: none,
                    has_upper: 0,
                    upper: none,
                    rest,
                })
                .collect(),
            count: parameters.len() as c_int,
            _parameters: parameters,
        }
    })
}

fn connection<const N: usize>(
    name: &'static CStr,
    direction: c_int,
    kinds: &'static Kinds<N>,
    optional: bool,
) -> ConnectionInfo {
    ConnectionInfo {
        name: name.as_ptr(),
        description: name.as_ptr(),
        direction,
        default_type: kinds.0[0],
        default_name: kinds.1[0],
        allowed_count: N as c_int,
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

/// The functions of the device, by the names that they have in the host's table.
pub(crate) struct DeviceFunctions {
    pub(crate) model_param: *const c_void,
    pub(crate) load: *const c_void,
    pub(crate) setup: *const c_void,
    pub(crate) unsetup: *const c_void,
    pub(crate) pole_zero_setup: *const c_void,
    pub(crate) trunc: *const c_void,
    pub(crate) small_signal_load: *const c_void,
    pub(crate) accept: *const c_void,
    pub(crate) model_delete: *const c_void,
    pub(crate) delete: *const c_void,
    pub(crate) ask: *const c_void,
    pub(crate) model_ask: *const c_void,
    pub(crate) convergence_test: *const c_void,
    pub(crate) distortion: *const c_void,
    pub(crate) noise: *const c_void,
    pub(crate) bind: *const c_void,
    pub(crate) bind_complex: *const c_void,
    pub(crate) bind_real: *const c_void,
}

/// The device table, with room for any host's.
pub(crate) struct DeviceTable(UnsafeCell<[usize; TABLE_WORDS]>);

// SAFETY: the plug-in writes it only while the host loads it or sets circuits up, from the host's thread; the host reads it afterwards.
unsafe impl Sync for DeviceTable {}

/// The one device of this plug-in.
pub(crate) static DEVICE: DeviceTable = DeviceTable(UnsafeCell::new([0; TABLE_WORDS]));

/// The host's layout, once known.
pub(crate) static LAYOUT: OnceLock<HostLayout> = OnceLock::new();

impl DeviceTable {
    /// Address handed to the host.
    pub(crate) fn address(&self) -> *mut c_void {
        self.0.get().cast()
    }

    /// Writes one word of the table.
    ///
    /// # Safety
    /// The host is loading the plug-in, or waits in a call for it.
    unsafe fn put<T>(&self, byte: usize, value: T) {
        debug_assert!(byte + size_of::<T>() <= TABLE_WORDS * 8);
        // SAFETY: in bounds and aligned; by contract no other code uses the table now.
        unsafe { self.0.get().cast::<u8>().add(byte).cast::<T>().write(value) }
    }

    /// Writes what every host reads at the same place.
    ///
    /// # Safety
    /// The host is loading the plug-in.
    pub(crate) unsafe fn declare(&self, evaluate: unsafe extern "C" fn(*mut c_void)) {
        let declarations = declarations();
        // SAFETY: the public part of the table has this layout from 39 to 47.
        unsafe {
            self.put(0, c"bimorph".as_ptr());
            self.put(8, c"electro-mechanical model from a netlist".as_ptr());
            self.put(16, &raw const ZERO); // terminals
            self.put(24, &raw const ZERO); // named terminals
            self.put(40, &raw const ZERO); // instance parameters
            self.put(56, &raw const declarations.count);
            self.put(64, declarations.spice.as_ptr());
            self.put(72, evaluate);
            self.put(80, declarations.connections.len() as c_int);
            self.put(88, declarations.connections.as_ptr());
            self.put(96, declarations.count);
        }
    }

    /// Exchanges the instance parameters.
    ///
    /// # Safety
    /// The host has called the plug-in and waits for it; it reads these two words during a lookup.
    pub(crate) unsafe fn set_instance_parameters(&self, parameters: &ParameterTable) {
        // SAFETY: by contract; what they point to stays for good.
        unsafe {
            self.put(40, std::ptr::from_ref(parameters.count));
            self.put(48, parameters.first);
        }
    }

    /// Finds the host's layout from what it wrote, then fills in the functions.
    ///
    /// # Errors
    /// [`HostLayoutError`]: nothing was filled in.
    ///
    /// # Safety
    /// The host has registered this table and is still loading the plug-in.
    pub(crate) unsafe fn complete(
        &self,
        version: Option<u32>,
        functions: &DeviceFunctions,
    ) -> Result<HostLayout, HostLayoutError> {
        // SAFETY: by contract no other code uses the table now; the host wrote addresses of its own integers.
        let layout = unsafe { HostLayout::detect(&*self.0.get(), |at| *(at as *const c_int), version)? };
        let declarations = declarations();
        let at = layout.functions();
        // SAFETY: offsets of the host's own device functions; the types are theirs.
        unsafe {
            if layout.new_parameters() {
                self.put(104, declarations.parameters43.as_ptr());
            } else {
                self.put(104, declarations.parameters42.as_ptr());
            }
            self.put(at + 8, functions.model_param);
            self.put(at + 16, functions.load);
            self.put(at + 24, functions.setup);
            self.put(at + 32, functions.unsetup);
            self.put(at + 40, functions.pole_zero_setup);
            self.put(at + 56, functions.trunc);
            self.put(at + 72, functions.small_signal_load);
            self.put(at + 80, functions.accept);
            self.put(at + 96, functions.model_delete);
            self.put(at + 104, functions.delete);
            self.put(at + 120, functions.ask);
            self.put(at + 128, functions.model_ask);
            self.put(at + 144, functions.convergence_test);
            self.put(at + 200, functions.distortion);
            self.put(at + 208, functions.noise);
            // After the table of a host without KLU, which never reads there.
            let bind = layout.sizes() + 16;
            self.put(bind, functions.bind);
            self.put(bind + 8, functions.bind_complex);
            self.put(bind + 16, functions.bind_real);
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
