//! Reader of ngspice's circuit (`CKTcircuit`): the step, the analysis, the two solutions of Newton's iteration.
//!
//! Code models receive the kind of the analysis that set it last, and `.noise`, `.pz`, `.tf` and `.sens` do not set it.
//! The circuit's own mode is right at every call.

use crate::companion::DifferentiationRule;
use crate::layout::{Generation, HostLayout};
use std::ffi::c_void;

/// Offset of the state vectors, eight pointers (byte).
const STATES: usize = 16;
/// Offset of the present step (byte).
const DELTA: usize = 88;
/// Offset of the order of integration, and after the largest order that of its method, three integers of four bytes (byte).
const ORDER: usize = 232;
/// Offset of the share of the last current in the trapezoidal rule (byte).
const XMU: usize = 248;
/// Number of Gear's method.
const GEAR: i32 = 2;
/// Offset of the right-hand side; after a solve, of the solution (byte).
const SOLUTION: usize = 280;
/// Offset of the solution before it, at which the devices were loaded (byte).
const LOADED_AT: usize = 288;

/// Offset of the imaginary part of a small-signal solution (byte).
const IMAGINARY: usize = 304;

/// Offset of the angular frequency up to ngspice 41 (byte).
const OMEGA_39: usize = 568;

/// Offsets of the job that is being run: where the mode stands at [`MODE_UNTIL_45`], and elsewhere (byte).
const JOB: [usize; 2] = [664, 704];
/// Offset of the mode up to ngspice 45 (byte).
const MODE_UNTIL_45: usize = 392;

/// Bits of the mode.
mod bit {
    pub(super) const TRANSIENT: u64 = 0x1;
    pub(super) const SMALL: u64 = 0x2;
    pub(super) const NOISE: u64 = 0x8;
    pub(super) const SWEEP: u64 = 0x40;
    /// Every kind of analysis.
    pub(super) const KINDS: u64 = 0x73;
    pub(super) const FIRST: u64 = 0x200;
    pub(super) const TRANSIENT_POINT: u64 = 0x20;
    pub(super) const GIVEN: u64 = 0x10000;
    /// Stages of initialisation.
    pub(super) const STAGES: u64 = 0x3f00;
    /// All there are; from ngspice 39 on with those of S-parameters.
    pub(super) const ALL: u64 = 0x1ff7b;
}

/// A circuit during one of the host's calls.
#[derive(Clone, Copy)]
pub(crate) struct HostCircuit {
    /// Address.
    base: usize,
    layout: HostLayout,
}

impl HostCircuit {
    /// The circuit at `at`.
    ///
    /// # Safety
    /// The host passed it in the call that lasts as long as this value is used, and its layout is `layout`.
    pub(crate) unsafe fn new(at: *mut c_void, layout: &HostLayout) -> Self {
        Self { base: at as usize, layout: *layout }
    }

    /// The value at an offset.
    fn read<T: Copy>(self, offset: usize) -> T {
        // SAFETY: by the contract of `new` the circuit is there; it is larger than every offset used here from 39 to 47.
        unsafe { ((self.base + offset) as *const T).read() }
    }

    /// The present step (s).
    pub(crate) fn delta(self) -> f64 {
        self.read(DELTA)
    }

    /// How ngspice integrates over the present step.
    pub(crate) fn rule(self) -> DifferentiationRule {
        let [order, _, method] = self.read::<[i32; 3]>(ORDER);
        match (order, method) {
            (1, _) => DifferentiationRule::First,
            (_, GEAR) => DifferentiationRule::Gear,
            _ => DifferentiationRule::Trapezoidal(self.read(XMU)),
        }
    }

    /// The mode word. ngspice 45 and 46 cannot be distinguished, and 46 has it one word further on: there the word with
    /// a valid mode counts.
    fn mode_offset(self) -> usize {
        let valid = |word: u64| {
            word & !bit::ALL == 0 && (word & bit::KINDS).is_power_of_two() && (word & bit::STAGES).is_power_of_two()
        };
        let offsets = self.layout.mode_offsets();
        if valid(self.read(offsets[0])) { offsets[0] } else { offsets[1] }
    }

    fn mode(self) -> u64 {
        self.read(self.mode_offset())
    }

    /// Address of the job that is being run: it names one analysis line of the deck as long as that runs.
    pub(crate) fn job(self) -> usize {
        self.read(JOB[usize::from(self.mode_offset() != MODE_UNTIL_45)])
    }

    /// Time passes in this step.
    pub(crate) fn transient(self) -> bool {
        self.mode() & bit::TRANSIENT != 0
    }

    /// A sweep, whose points follow each other's branch.
    pub(crate) fn sweep(self) -> bool {
        self.mode() & bit::KINDS == bit::SWEEP
    }

    /// The first load of an operating point, made at 0 V.
    pub(crate) fn first(self) -> bool {
        self.mode() & bit::FIRST != 0
    }

    /// The start of a transient from given voltages (`uic`), which is loaded once and not solved.
    pub(crate) fn given(self) -> bool {
        self.mode() & (bit::GIVEN | bit::TRANSIENT_POINT) == bit::GIVEN | bit::TRANSIENT_POINT
    }

    /// Noise is being analysed, in the adjoint of the circuit.
    pub(crate) fn noise(self) -> bool {
        let noise = |word: u64| word & !bit::ALL == 0 && word & bit::KINDS == bit::SMALL && word & bit::NOISE != 0;
        self.layout.mode_offsets().into_iter().any(|offset| noise(self.read(offset)))
    }

    /// Angular frequency of a small-signal solution (rad/s), where it is known how this host keeps it.
    pub(crate) fn omega(self) -> Option<f64> {
        (self.layout.generation == Generation::Since39).then(|| self.read(OMEGA_39))
    }

    /// The state vector of a point: 0 for the present one, 1 for the last accepted one. Null before the host has allocated them.
    pub(crate) fn states(self, point: usize) -> *mut f64 {
        self.read(STATES + point * size_of::<usize>())
    }

    /// Voltage between two nodes in the newest solution (V). During a load that vector is the right-hand side.
    ///
    /// # Safety
    /// The nodes are the circuit's.
    pub(crate) unsafe fn solved(self, [positive, negative]: [i32; 2]) -> f64 {
        // SAFETY: by contract; a node's number is its place in the vector.
        unsafe { difference(self.read(SOLUTION), positive, negative) }
    }

    /// Voltage between two nodes in the solution at which devices are loaded (V).
    ///
    /// # Safety
    /// The nodes are the circuit's.
    pub(crate) unsafe fn loaded_at(self, [positive, negative]: [i32; 2]) -> f64 {
        // SAFETY: as above.
        unsafe { difference(self.read(LOADED_AT), positive, negative) }
    }

    /// Difference of the complex solution between two places, while the circuit's adjoint is solved: the effect on the
    /// output of a current into the first and out of the second.
    ///
    /// # Safety
    /// The places are the circuit's.
    pub(crate) unsafe fn adjoint(self, [positive, negative]: [i32; 2]) -> [f64; 2] {
        // SAFETY: by contract.
        [SOLUTION, IMAGINARY].map(|part| unsafe { difference(self.read(part), positive, negative) })
    }

    /// Adds to the right-hand side of an equation.
    ///
    /// # Safety
    /// This is within a load, and the equation is the circuit's.
    pub(crate) unsafe fn add(self, equation: i32, value: f64) {
        // SAFETY: by contract.
        unsafe { *self.read::<*mut f64>(SOLUTION).add(equation as usize) += value }
    }
}

/// # Safety
/// `vector` has the elements.
unsafe fn difference(vector: *const f64, positive: i32, negative: i32) -> f64 {
    // SAFETY: by contract.
    unsafe { *vector.add(positive as usize) - *vector.add(negative as usize) }
}
