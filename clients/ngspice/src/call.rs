//! ngspice's memory, read and written: parameters at setup, inputs and outputs at each call.

use crate::abi::{Circuit, Complex, Connection, Instance, Model, Parameter, Tail, Value, analysis, port_data};
use crate::deck_options::{Written, declared};
use crate::instance::Question;
use crate::layout::Layout;
use crate::model_card::RawCard;
use crate::table::OWN_COUNT;
use std::ffi::{CStr, c_char, c_int, c_void};

/// Electrical ports.
pub(crate) const PORTS: usize = 0;
/// Monitors.
pub(crate) const MONITORS: usize = 1;

/// A host's string as text.
///
/// # Safety
/// `at` is null or points to a string that ends in a zero byte.
pub(crate) unsafe fn text(at: *const c_char) -> Option<String> {
    // SAFETY: by contract.
    (!at.is_null()).then(|| unsafe { CStr::from_ptr(at) }.to_string_lossy().into_owned())
}

/// Reads a `.model` line's parameters, in the order in which [`crate::table`] declares them.
///
/// # Safety
/// `param` points to the model's `count` parameters, as set up by the host.
pub(crate) unsafe fn card(param: *mut *mut Parameter, count: c_int) -> RawCard {
    // SAFETY: by contract each slot below `count` points to a parameter.
    let slot = |n: usize| unsafe {
        (n < count as usize).then(|| &**param.add(n)).filter(|p| p.is_null == 0 && !p.element.is_null() && p.size > 0)
    };
    let value = |n: usize, i: usize| -> Option<&Value> {
        // SAFETY: a given parameter has `size` elements.
        slot(n).filter(|p| i < p.size as usize).map(|p| unsafe { &*p.element.add(i) })
    };
    // SAFETY: these parameters are strings, and the host keeps strings ended by a zero byte.
    let string = |n, i| value(n, i).and_then(|v| unsafe { text(v.string) });
    let strings = |n| (0..slot(n).map_or(0, |p| p.size as usize)).filter_map(|i| string(n, i)).collect();
    // SAFETY: these parameters are reals.
    let real = |n| value(n, 0).map(|v| unsafe { v.real });
    // SAFETY: these parameters are booleans.
    let flag = |n| value(n, 0).map(|v| unsafe { v.flag } != 0);
    RawCard {
        file: string(0, 0),
        ports: strings(1),
        monitors: strings(2),
        set: strings(3),
        remote: string(4, 0),
        deadline: real(5),
        options: (declared().iter().zip(OWN_COUNT..))
            .map(|(declared, n)| match declared.default {
                Written::Flag(_) => flag(n).map(Written::Flag),
                Written::Number(_) => real(n).map(Written::Number),
                Written::Text(_) => string(n, 0).map(Written::Text),
            })
            .collect(),
    }
}

/// The instances of a list of models, in the host's order.
///
/// # Safety
/// `model` heads the host's list of models, which stays as it is as long as the iterator lives.
pub(crate) unsafe fn instances<'a>(model: *mut Model) -> impl Iterator<Item = (&'a Model, &'a Instance)> {
    // SAFETY: by contract; the list ends in null.
    let models = std::iter::successors(unsafe { model.as_ref() }, |m| unsafe { m.next.as_ref() });
    models.flat_map(|m| {
        // SAFETY: as above.
        let first = unsafe { m.instances.as_ref() };
        // SAFETY: as above.
        let next = |i: &&'a Instance| unsafe { i.next.as_ref() };
        std::iter::successors(first, next).map(move |i| (m, i))
    })
}

/// Ports of a connection; 0 where it is `null`.
///
/// # Safety
/// `conn` points to an instance's connections, at least `which + 1` of them.
pub(crate) unsafe fn size(conn: *mut *mut Connection, which: usize) -> usize {
    // SAFETY: by contract.
    let connection = unsafe { &**conn.add(which) };
    if connection.is_null == 0 { connection.size.max(0) as usize } else { 0 }
}

/// Whether ports keep their partials where ngspice 39 does. To be asked after the host's own setup.
///
/// # Safety
/// As for [`size`]; the host has allocated the ports' outputs.
pub(crate) unsafe fn partial_at_80(conn: *mut *mut Connection) -> bool {
    // SAFETY: the electrical ports exist (the connection may not be null); that word is a pointer or null.
    unsafe { !(*(*(**conn).port).add(port_data::PARTIAL_39).cast::<*mut c_void>()).is_null() }
}

/// One call of the model by the host.
pub(crate) struct Call<'a> {
    circuit: &'a Circuit,
    tail: &'a Tail,
    partial: usize,
}

impl Call<'_> {
    /// Sees a call's data.
    ///
    /// # Safety
    /// `data` is what the host passed to the model in this call, and `layout` is the host's.
    pub(crate) unsafe fn new(data: *mut c_void, layout: &Layout) -> Self {
        // SAFETY: by contract.
        unsafe {
            let circuit = &*data.cast::<Circuit>();
            let tail = &*data.cast::<u8>().add(layout.call_tail()).cast::<Tail>();
            let partial = port_data::PARTIAL_39 + if partial_at_80(tail.conn) { 0 } else { 8 };
            Self { circuit, tail, partial }
        }
    }

    /// What names the instance: its connections stay at one address as long as it lives.
    pub(crate) fn key(&self) -> usize {
        self.tail.conn as usize
    }

    /// First call of the instance in an analysis.
    pub(crate) fn init(&self) -> bool {
        self.circuit.init != 0
    }

    /// What is asked. Analyses that leave the kind of the one before them show as transients in which no time
    /// passes; they want an operating point. `delta` is the circuit's step [s]: the difference of the two times is
    /// the same up to their rounding.
    pub(crate) fn question(&self, delta: f64) -> Question {
        let c = self.circuit;
        let dt = c.t[0] - c.t[1];
        match c.anal_type {
            analysis::AC => Question::SmallSignal { omega: c.frequency },
            analysis::TRAN if dt > 0.0 && (dt - delta).abs() <= 4.0 * f64::EPSILON * c.t[0] => {
                Question::Transient { t: c.time, dt: delta }
            }
            analysis::TRAN if dt > 0.0 => Question::Transient { t: c.time, dt },
            _ => Question::Static,
        }
    }

    /// Number of ports of a connection.
    pub(crate) fn size(&self, which: usize) -> usize {
        // SAFETY: the model has these two connections.
        unsafe { size(self.tail.conn, which) }
    }

    fn port(&self, which: usize, n: usize) -> *mut u8 {
        debug_assert!(n < self.size(which));
        // SAFETY: the connection has this many ports.
        unsafe { *(**self.tail.conn.add(which)).port.add(n) }
    }

    /// Port voltages.
    pub(crate) fn voltages(&self, into: &mut Vec<f64>) {
        into.clear();
        // SAFETY: an analogue port's input is a double.
        into.extend((0..self.size(PORTS)).map(|n| unsafe { *self.port(PORTS, n).add(port_data::INPUT).cast::<f64>() }));
    }

    /// Sets a port's output and its partials over the electrical ports.
    pub(crate) fn set(&self, which: usize, n: usize, output: f64, partials: &[f64]) {
        let port = self.port(which, n);
        // SAFETY: the host allocated an output and one partial per electrical port for every output port.
        unsafe {
            *port.add(port_data::OUTPUT).cast::<f64>() = output;
            let row = **port.add(self.partial).cast::<*const *mut f64>();
            std::slice::from_raw_parts_mut(row, self.size(PORTS)).copy_from_slice(partials);
        }
    }

    /// Sets a port's small-signal gains over the electrical ports.
    pub(crate) fn set_gains(&self, which: usize, n: usize, gains: impl Iterator<Item = [f64; 2]>) {
        let port = self.port(which, n);
        // SAFETY: as for the partials; the gains' pointer follows that of the partials.
        let row = unsafe {
            let row = **port.add(self.partial + 8).cast::<*const *mut Complex>();
            std::slice::from_raw_parts_mut(row, self.size(PORTS))
        };
        for (gain, [re, im]) in row.iter_mut().zip(gains) {
            *gain = Complex { re, im };
        }
    }
}
