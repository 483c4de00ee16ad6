//! ngspice's memory, read and written: inputs and outputs at each call.

use crate::abi::{self, Complex, ConnectionData, InstanceHead, ModelHead, Tail, analysis, port, port_data};
use crate::circuit::HostCircuit;
use crate::evaluation::EvaluationRequest;
use crate::layout::HostLayout;
use std::ffi::{CStr, c_char, c_int, c_void};

/// Ports that are driven.
pub(crate) const PORTS: usize = 0;
/// Monitors.
pub(crate) const MONITORS: usize = 1;

/// Doubles of an instance within every state vector of the circuit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reserved {
    /// Place of the first.
    pub(crate) first: usize,
    /// How many.
    pub(crate) doubles: usize,
}

/// A host's string as text.
///
/// # Safety
/// `at` is null or points to a string that ends in a zero byte.
pub(crate) unsafe fn text(at: *const c_char) -> Option<String> {
    // SAFETY: by contract.
    (!at.is_null()).then(|| unsafe { CStr::from_ptr(at) }.to_string_lossy().into_owned())
}

/// The instances of a list of models, in the host's order.
///
/// # Safety
/// `model` heads the host's list of models, which stays unchanged for the lifetime of the iterator.
pub(crate) unsafe fn instances<'a>(model: *mut ModelHead) -> impl Iterator<Item = (&'a ModelHead, &'a InstanceHead)> {
    // SAFETY: by contract; the list ends in null.
    let models = std::iter::successors(unsafe { model.as_ref() }, |m| unsafe { m.next.as_ref() });
    models.flat_map(|m| {
        // SAFETY: as above.
        let first = unsafe { m.instances.as_ref() };
        // SAFETY: as above.
        let next = |i: &&'a InstanceHead| unsafe { i.next.as_ref() };
        std::iter::successors(first, next).map(move |i| (m, i))
    })
}

/// Ports of a connection; 0 where it is `null`.
///
/// # Safety
/// `conn` points to an instance's connections, at least `which + 1` of them.
pub(crate) unsafe fn size(conn: *mut *mut ConnectionData, which: usize) -> usize {
    // SAFETY: by contract.
    let connection = unsafe { &**conn.add(which) };
    if connection.is_null == 0 { connection.size.max(0) as usize } else { 0 }
}

/// Whether each driven port is a branch: its current is given, and it answers with the voltage across it.
///
/// # Safety
/// As for [`size`].
pub(crate) unsafe fn branches(conn: *mut *mut ConnectionData) -> Vec<bool> {
    // SAFETY: by contract; a port begins with its kind.
    unsafe { (0..size(conn, PORTS)).map(|n| is_branch(*(**conn.add(PORTS)).port.add(n))).collect() }
}

/// # Safety
/// `port` is a port of the host's.
unsafe fn is_branch(port: *const u8) -> bool {
    // SAFETY: by contract.
    let kind = unsafe { *port.add(port_data::KIND).cast::<c_int>() };
    kind == port::RESISTANCE || kind == port::DIFF_RESISTANCE
}

/// Whether ports keep their partials where ngspice 39 does. To be asked after the host's own setup.
///
/// # Safety
/// As for [`size`]; the host has allocated the ports' outputs.
pub(crate) unsafe fn partial_at_80(conn: *mut *mut ConnectionData) -> bool {
    // SAFETY: the electrical ports exist (the connection may not be null); that word is a pointer or null.
    unsafe { !(*(*(**conn).port).add(port_data::PARTIAL_39).cast::<*mut c_void>()).is_null() }
}

/// The two places in the circuit's solution between which each port, then each monitor adds what it answers: a current flows
/// into the part, out of the circuit; a voltage stands in a branch.
///
/// # Safety
/// As for [`partial_at_80`], in the host's layout.
pub(crate) unsafe fn terminals(conn: *mut *mut ConnectionData, layout: &HostLayout) -> Vec<[i32; 2]> {
    // SAFETY: by contract; a port's matrix data hold its nodes and its branch.
    unsafe {
        let matrix = layout.port_matrix(partial_at_80(conn));
        let mut terminals = Vec::new();
        for which in [PORTS, MONITORS] {
            for n in 0..size(conn, which) {
                let port = *(**conn.add(which)).port.add(n);
                let number = |at: usize| *port.add(matrix + at).cast::<i32>();
                let branch = which == MONITORS || is_branch(port);
                terminals.push(match branch {
                    true => [number(port_data::BRANCH), 0],
                    false => [number(port_data::NODES[1]), number(port_data::NODES[0])],
                });
            }
        }
        terminals
    }
}

/// The function by which the host loads the device. The host also passes the kind of the analysis to a code model. It
/// may be that of the previous one, since `.noise`, `.pz`, `.tf` and `.sens` do not set it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// Currents at these voltages.
    Large,
    /// Admittances at a frequency.
    Small,
}

/// One call of the model by the host.
pub(crate) struct ModelCall<'a> {
    arguments: &'a abi::CircuitArguments,
    tail: &'a Tail,
    circuit: HostCircuit,
    wanted: Wanted,
    partial: usize,
    matrix: usize,
}

impl ModelCall<'_> {
    /// Sees a call's data.
    ///
    /// # Safety
    /// `data` is what the host passed to the model in this call, `layout` is the host's, and `circuit` the one it loads.
    pub(crate) unsafe fn new(data: *mut c_void, layout: &HostLayout, circuit: HostCircuit, wanted: Wanted) -> Self {
        // SAFETY: by contract.
        unsafe {
            let arguments = &*data.cast::<abi::CircuitArguments>();
            let tail = &*data.cast::<u8>().add(layout.call_tail()).cast::<Tail>();
            let as_39 = partial_at_80(tail.conn);
            let partial = port_data::PARTIAL_39 + if as_39 { 0 } else { 8 };
            Self { arguments, tail, circuit, wanted, partial, matrix: layout.port_matrix(as_39) }
        }
    }

    /// Key of the instance: its connections stay at one address for its lifetime.
    pub(crate) fn key(&self) -> usize {
        self.tail.conn as usize
    }

    /// A sweep, whose points follow each other's branch; an operating point starts from rest.
    pub(crate) fn sweep(&self) -> bool {
        self.circuit.sweep()
    }

    /// Address of the job that is being run.
    pub(crate) fn job(&self) -> usize {
        self.circuit.job()
    }

    /// The memory of an instance for a point, where the host has allocated it: 0 for the present point, 1 for the last accepted one.
    pub(crate) fn memory(&self, point: usize, memory: Reserved) -> Option<*mut f64> {
        let vector = self.circuit.states(point);
        // SAFETY: the host allocates every state that was added to its count at setup.
        (!vector.is_null()).then(|| unsafe { vector.add(memory.first) })
    }

    /// The request, or the reason why it is unknown. The circuit's step and the difference of the two times are the
    /// same up to the rounding of the times.
    pub(crate) fn question(&self) -> Result<EvaluationRequest, &'static str> {
        let (c, delta) = (self.arguments, self.circuit.delta());
        if self.wanted == Wanted::Small {
            let arguments = (c.anal_type == analysis::AC).then_some(c.frequency);
            return match arguments.or_else(|| self.circuit.omega()) {
                Some(omega) => Ok(EvaluationRequest::SmallSignal { omega }),
                None => Err("this ngspice does not give code models the frequency in this analysis; use .ac"),
            };
        }
        if c.anal_type != analysis::TRAN || !self.circuit.transient() {
            return Ok(EvaluationRequest::Static);
        }
        let dt = c.t[0] - c.t[1];
        Ok(match dt > 0.0 {
            true => {
                let same = (dt - delta).abs() <= 4.0 * f64::EPSILON * c.t[0];
                EvaluationRequest::Transient { t: c.time, dt: if same { delta } else { dt }, rule: self.circuit.rule() }
            }
            false => EvaluationRequest::Static,
        })
    }

    /// Currents are wanted, but the host loads as for a small signal: without inputs, and without right-hand sides.
    fn large_as_small(&self) -> bool {
        self.wanted == Wanted::Large && self.arguments.anal_type == analysis::AC
    }

    /// Admittances are wanted, but the host loads as for currents: without imaginary parts.
    fn small_as_large(&self) -> bool {
        self.wanted == Wanted::Small && self.arguments.anal_type != analysis::AC
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

    /// Positive and negative node of a port.
    pub(crate) fn nodes(&self, which: usize, n: usize) -> [i32; 2] {
        // SAFETY: a port's matrix data begin with its two nodes, set by the host.
        port_data::NODES.map(|at| unsafe { *self.port(which, n).add(self.matrix + at).cast::<i32>() })
    }

    /// Whether a port answers with the voltage across it: a monitor, or one whose current is given.
    fn is_branch(&self, which: usize, n: usize) -> bool {
        // SAFETY: a port of this instance.
        which == MONITORS || unsafe { is_branch(self.port(which, n)) }
    }

    /// The two places in the solution whose difference is given to a port: its nodes, or the branch and ground.
    pub(crate) fn given(&self, n: usize) -> [i32; 2] {
        if self.is_branch(PORTS, n) {
            // SAFETY: matrix data of a port, set by the host.
            [unsafe { *self.port(PORTS, n).add(self.matrix + port_data::INPUT_BRANCH).cast::<i32>() }, 0]
        } else {
            self.nodes(PORTS, n)
        }
    }

    fn input(&self, n: usize) -> *mut f64 {
        // SAFETY: an analogue port's input is a double.
        unsafe { self.port(PORTS, n).add(port_data::INPUT).cast() }
    }

    /// Port voltages, or currents where these are given. The host's values are wrong where it takes the load for a
    /// small signal, and it does not know the initial values of a transient (`uic`). The values read instead are also
    /// written back to it, now and for the first step.
    pub(crate) fn voltages(&self, into: &mut Vec<f64>) {
        into.clear();
        let given = self.wanted == Wanted::Large && self.circuit.given();
        for n in 0..self.size(PORTS) {
            // SAFETY: the circuit's nodes; the place of the input lasts as long as this call. The host keeps the input of
            // the point before in the state vector, at an index that follows the gains.
            unsafe {
                if self.large_as_small() || given {
                    let first = self.circuit.first() && !given;
                    *self.input(n) = if first { 0.0 } else { self.circuit.loaded_at(self.given(n)) };
                    let kept = *self.port(PORTS, n).add(self.partial + 16).cast::<i32>();
                    *self.circuit.states(0).add(kept as usize) = *self.input(n);
                }
                into.push(*self.input(n));
            }
        }
    }

    /// Sets a port's output and its partials over the driven ports.
    pub(crate) fn set(&self, which: usize, n: usize, output: f64, partials: &[f64]) {
        if self.large_as_small() {
            self.set_gains(which, n, partials.iter().map(|gain| [*gain, 0.0]));
            // SAFETY: inputs are doubles.
            let linear: f64 = partials.iter().enumerate().map(|(m, gain)| unsafe { gain * *self.input(m) }).sum();
            let [positive, negative] = self.nodes(which, n);
            // SAFETY: equations of the circuit, which is being loaded.
            unsafe {
                if !self.is_branch(which, n) {
                    self.circuit.add(positive, linear - output);
                    self.circuit.add(negative, output - linear);
                } else {
                    let branch = *self.port(which, n).add(self.matrix + port_data::BRANCH).cast::<i32>();
                    self.circuit.add(branch, output - linear);
                }
            }
            return;
        }
        let port = self.port(which, n);
        // SAFETY: the host allocated an output and one partial per driven port for every output port.
        unsafe {
            *port.add(port_data::OUTPUT).cast::<f64>() = output;
            let row = **port.add(self.partial).cast::<*const *mut f64>();
            std::slice::from_raw_parts_mut(row, self.size(PORTS)).copy_from_slice(partials);
        }
    }

    /// Sets a port's small-signal gains over the driven ports.
    pub(crate) fn set_gains(&self, which: usize, n: usize, gains: impl Iterator<Item = [f64; 2]>) {
        let port = self.port(which, n);
        if self.small_as_large() {
            // The host adds partials alone, and to the right-hand side what they make of the inputs: nothing.
            for (m, [re, im]) in gains.enumerate() {
                // SAFETY: as for `set`; this is a host of generation `Since39`, the only one whose frequency is known.
                unsafe {
                    *self.input(m) = 0.0;
                    *(**port.add(self.partial).cast::<*const *mut f64>()).add(m) = re;
                    self.add_imaginary((which, n), m, im);
                }
            }
            return;
        }
        // SAFETY: as for the partials; the gains' pointer follows that of the partials.
        let row = unsafe {
            let row = **port.add(self.partial + 8).cast::<*const *mut Complex>();
            std::slice::from_raw_parts_mut(row, self.size(PORTS))
        };
        for (gain, [re, im]) in row.iter_mut().zip(gains) {
            *gain = Complex { re, im };
        }
    }

    /// Adds the imaginary part of a port's gain to the matrix.
    ///
    /// # Safety
    /// The host is ngspice 39 to 41 and is loading the complex matrix.
    unsafe fn add_imaginary(&self, (which, n): (usize, usize), input: usize, im: f64) {
        /// Words of a port's element pointers, one set for each input.
        const SET: usize = 4;
        // In the order of the host: voltages give currents, currents give currents; voltages give voltages, currents do.
        let signs: &[f64] = match (self.is_branch(which, n), self.is_branch(PORTS, input)) {
            (false, false) => &[1.0, -1.0, -1.0, 1.0],
            (false, true) => &[1.0, -1.0],
            (true, false) => &[-1.0, 1.0],
            (true, true) => &[-1.0],
        };
        // SAFETY: the host made these elements when it set the instance up; each is a pair of doubles.
        unsafe {
            let inputs = *self.port(which, n).add(self.matrix + port_data::INPUTS_39).cast::<*const *const *mut f64>();
            let elements = (*inputs.add(PORTS)).add(SET * input);
            for (k, sign) in signs.iter().enumerate() {
                *(*elements.add(k)).add(1) += sign * im;
            }
        }
    }
}
