//! The few XSPICE structures a code model exchanges with ngspice, written down from their measured layout.
//!
//! A `.cm` file carries no version, and what differs between hosts is not in these types but in where they stand: see
//! [`crate::layout`]. Everything here is the same from ngspice 39 to 47 unless its name says otherwise.

use std::ffi::{c_char, c_int, c_void};

/// Analysis kinds, as in `circuit.anal_type`.
pub(crate) mod analysis {
    use std::ffi::c_int;
    /// Small-signal.
    pub(crate) const AC: c_int = 1;
    /// Transient.
    pub(crate) const TRAN: c_int = 2;
}

/// Port kinds.
pub(crate) mod port {
    use std::ffi::c_int;
    /// Voltage of a node.
    pub(crate) const VOLTAGE: c_int = 0;
    /// Voltage between two nodes.
    pub(crate) const DIFF_VOLTAGE: c_int = 1;
    /// Current that depends on the voltage of the same node.
    pub(crate) const CONDUCTANCE: c_int = 5;
    /// Current between two nodes that depends on the voltage between them.
    pub(crate) const DIFF_CONDUCTANCE: c_int = 6;
    /// Voltage of a node that depends on the current into it.
    pub(crate) const RESISTANCE: c_int = 7;
    /// Voltage between two nodes that depends on the current into the first.
    pub(crate) const DIFF_RESISTANCE: c_int = 8;
    /// Direction: output.
    pub(crate) const OUT: c_int = 1;
    /// Direction: input and output.
    pub(crate) const INOUT: c_int = 2;
}

/// Parameter kinds: the enumeration of code models, then the flags of SPICE parameters.
pub(crate) mod kind {
    use std::ffi::c_int;
    /// Boolean.
    pub(crate) const BOOLEAN: c_int = 0;
    /// Real.
    pub(crate) const REAL: c_int = 2;
    /// String.
    pub(crate) const STRING: c_int = 4;
    /// SPICE: boolean.
    pub(crate) const IF_FLAG: c_int = 0x1;
    /// SPICE: real.
    pub(crate) const IF_REAL: c_int = 0x4;
    /// SPICE: string.
    pub(crate) const IF_STRING: c_int = 0x20;
    /// SPICE: an array of what the lower bits say.
    pub(crate) const IF_VECTOR: c_int = 0x8000;
    /// SPICE: may be read, and `.sens` leaves it alone.
    pub(crate) const IF_ASK: c_int = 0x0020_1000;
    /// SPICE: `show` omits it unless everything is requested.
    pub(crate) const IF_UNINTERESTING: c_int = 0x0200_0000;
    /// SPICE: may be read and set, and `.sens` leaves it alone.
    pub(crate) const IF_ASK_SET: c_int = 0x0020_3000;
}

/// Error codes of ngspice that the plug-in answers with.
pub(crate) mod code {
    use std::ffi::c_int;
    /// All is well.
    pub(crate) const OK: c_int = 0;
    /// Ends an analysis where no better code exists.
    pub(crate) const PANIC: c_int = 1;
    /// Of a test of convergence: another iteration.
    pub(crate) const UNSETTLED: c_int = 1;
    /// There is no such parameter.
    pub(crate) const BADPARM: c_int = 7;
    /// A parameter value cannot be used.
    pub(crate) const PARMVAL: c_int = 11;
    /// Newton's iteration limit: the step or the operating point is tried again by other means.
    pub(crate) const ITERLIM: c_int = 103;
}

/// Slots of the host's function table. These have the same place from ngspice 39 to 47.
pub(crate) mod slot {
    pub(crate) const SETUP: usize = 3;
    pub(crate) const UNSETUP: usize = 4;
    pub(crate) const LOAD: usize = 5;
    pub(crate) const MODEL_PARAM: usize = 6;
    pub(crate) const MODEL_ASK: usize = 8;
    pub(crate) const TRUNC: usize = 9;
    pub(crate) const DELETE: usize = 11;
    pub(crate) const MODEL_DELETE: usize = 12;
    pub(crate) const ANALOG_INTEGRATE: usize = 25;
    pub(crate) const MESSAGE_SEND: usize = 35;
}

/// A complex number.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Complex {
    pub(crate) re: f64,
    pub(crate) im: f64,
}

/// A parameter or port value.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) union ParameterValue {
    pub(crate) flag: c_int,
    pub(crate) real: f64,
    pub(crate) complex: Complex,
    pub(crate) string: *const c_char,
}

/// Circuit data of a call. From 47 on two more doubles follow.
#[repr(C)]
pub(crate) struct CircuitArguments {
    pub(crate) init: c_int,
    pub(crate) anal_type: c_int,
    pub(crate) anal_init: c_int,
    pub(crate) call_type: c_int,
    pub(crate) time: f64,
    pub(crate) frequency: f64,
    pub(crate) temperature: f64,
    pub(crate) t: [f64; 8],
}

/// Data after [`CircuitArguments`] in a call.
#[repr(C)]
pub(crate) struct Tail {
    pub(crate) num_conn: c_int,
    pub(crate) conn: *mut *mut ConnectionData,
    pub(crate) num_param: c_int,
    pub(crate) param: *mut *mut Parameter,
}

/// A connection of an instance.
#[repr(C)]
pub(crate) struct ConnectionData {
    pub(crate) name: *const c_char,
    pub(crate) description: *const c_char,
    pub(crate) is_null: c_int,
    pub(crate) is_input: c_int,
    pub(crate) is_output: c_int,
    pub(crate) size: c_int,
    /// Port data; its layout differs between 39 and 40.
    pub(crate) port: *mut *mut u8,
}

/// Value of a model parameter.
#[repr(C)]
pub(crate) struct Parameter {
    pub(crate) is_null: c_int,
    pub(crate) size: c_int,
    pub(crate) element: *mut ParameterValue,
    pub(crate) element_type: c_int,
}

/// Offsets inside a port's data.
pub(crate) mod port_data {
    /// Kind of the port, of those in [`super::port`].
    pub(crate) const KIND: usize = 0;
    /// Input value.
    pub(crate) const INPUT: usize = 48;
    /// Output value.
    pub(crate) const OUTPUT: usize = 64;
    /// Node and branch numbers within a port's matrix data: positive, negative, branch.
    pub(crate) const NODES: [usize; 2] = [0, 4];
    pub(crate) const BRANCH: usize = 8;
    /// The branch whose current is the input.
    pub(crate) const INPUT_BRANCH: usize = 12;
    /// Element pointers over the inputs within a port's matrix data, up to ngspice 41.
    pub(crate) const INPUTS_39: usize = 80;
    /// Partials in ngspice 39; null in later hosts, where they follow at + 8.
    pub(crate) const PARTIAL_39: usize = 80;
}

/// Head of a model (`GENmodel`, then what code models add).
#[repr(C)]
pub(crate) struct ModelHead {
    pub(crate) kind: c_int,
    pub(crate) next: *mut ModelHead,
    pub(crate) instances: *mut InstanceHead,
    pub(crate) name: *const c_char,
    pub(crate) defaults: *mut c_void,
    pub(crate) num_param: c_int,
    pub(crate) param: *mut *mut Parameter,
}

/// Head of an instance (`GENinstance`, then what code models add).
#[repr(C)]
pub(crate) struct InstanceHead {
    pub(crate) model: *mut ModelHead,
    pub(crate) next: *mut InstanceHead,
    pub(crate) name: *const c_char,
    pub(crate) state: c_int,
    /// `GENinstance` ends here, padded to a whole word.
    pub(crate) padding: c_int,
    pub(crate) num_conn: c_int,
    pub(crate) conn: *mut *mut ConnectionData,
}

/// Declares a connection.
#[repr(C)]
pub(crate) struct ConnectionInfo {
    pub(crate) name: *const c_char,
    pub(crate) description: *const c_char,
    pub(crate) direction: c_int,
    pub(crate) default_type: c_int,
    pub(crate) default_name: *const c_char,
    pub(crate) allowed_count: c_int,
    pub(crate) allowed: *const c_int,
    pub(crate) allowed_names: *const *const c_char,
    pub(crate) is_array: c_int,
    pub(crate) has_lower: c_int,
    pub(crate) lower: c_int,
    pub(crate) has_upper: c_int,
    pub(crate) upper: c_int,
    pub(crate) null_allowed: c_int,
}

/// Declares a SPICE parameter (`IFparm`).
#[repr(C)]
pub(crate) struct SpiceParameter {
    pub(crate) keyword: *const c_char,
    pub(crate) id: c_int,
    pub(crate) data_type: c_int,
    pub(crate) description: *const c_char,
}

/// A default or a bound up to ngspice 42.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Bound42 {
    pub(crate) flag: c_int,
    pub(crate) integer: c_int,
    pub(crate) real: f64,
    pub(crate) complex: Complex,
    pub(crate) string: *const c_char,
}

/// Declares a code model parameter up to ngspice 42.
#[repr(C)]
pub(crate) struct ParameterInfo42 {
    pub(crate) name: *const c_char,
    pub(crate) description: *const c_char,
    pub(crate) kind: c_int,
    pub(crate) has_default: c_int,
    pub(crate) default: Bound42,
    pub(crate) has_lower: c_int,
    pub(crate) lower: Bound42,
    pub(crate) has_upper: c_int,
    pub(crate) upper: Bound42,
    pub(crate) rest: ParameterInfoTail,
}

/// Declares a code model parameter from ngspice 43 on: defaults stand elsewhere.
#[repr(C)]
pub(crate) struct ParameterInfo43 {
    pub(crate) name: *const c_char,
    pub(crate) description: *const c_char,
    pub(crate) kind: c_int,
    pub(crate) default_count: c_int,
    pub(crate) defaults: *const ParameterValue,
    pub(crate) has_lower: c_int,
    pub(crate) lower: ParameterValue,
    pub(crate) has_upper: c_int,
    pub(crate) upper: ParameterValue,
    pub(crate) rest: ParameterInfoTail,
}

/// End of both forms of a parameter declaration.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct ParameterInfoTail {
    pub(crate) is_array: c_int,
    pub(crate) has_conn_ref: c_int,
    pub(crate) conn_ref: c_int,
    pub(crate) has_lower: c_int,
    pub(crate) lower: c_int,
    pub(crate) has_upper: c_int,
    pub(crate) upper: c_int,
    pub(crate) null_allowed: c_int,
}

const _: () = {
    assert!(size_of::<ParameterValue>() == 16);
    assert!(size_of::<CircuitArguments>() == 104);
    assert!(size_of::<ConnectionInfo>() == 80);
    assert!(size_of::<ParameterInfo42>() == 192);
    assert!(size_of::<ParameterInfo43>() == 112);
    assert!(std::mem::offset_of!(Tail, conn) == 8 && std::mem::offset_of!(Tail, param) == 24);
    assert!(std::mem::offset_of!(InstanceHead, conn) == 40);
    assert!(std::mem::offset_of!(ModelHead, param) == 48);
};
