//! Options of single analyses: the same defaults and ranges on the command line, on the wire and in Python.

use super::table::{OptionDescription, OptionValue, Range};

/// Most output times of a run: each holds every signal as a double.
const MAX_POINTS: usize = 10_000_000;

/// `tran`: output times.
pub static TRAN_POINTS: OptionDescription = OptionDescription {
    name: "points",
    wire: "points",
    unit: "",
    range: Range::Count(2, MAX_POINTS),
    default: OptionValue::Count(1001),
    unset: "",
    help: "Number of equally spaced output times, both ends included",
};

/// `tran`: the end.
pub static TRAN_STOP: OptionDescription = OptionDescription {
    name: "stop",
    wire: "stop_s",
    unit: "s",
    range: Range::Above(0.0, 1e9),
    default: OptionValue::Unset,
    unset: "must be given",
    help: "End time",
};

/// `tran`: equal steps.
pub static TRAN_STEP: OptionDescription = OptionDescription {
    name: "step",
    wire: "step_s",
    unit: "s",
    range: Range::Above(0.0, 1e9),
    default: OptionValue::Unset,
    unset: "steps follow tol",
    help: "Equal steps of this length",
};

/// `tran`: how generalized-alpha damps.
pub static TRAN_RHO: OptionDescription = OptionDescription {
    name: "rho",
    wire: "rho",
    unit: "1",
    range: Range::Within(0.0, 1.0),
    default: OptionValue::Number(0.8),
    unset: "",
    help: "Of generalized-alpha: factor by which an infinitely fast motion shrinks in a step, 0 to 1",
};

/// Most frequencies of a response.
pub const MAX_FREQUENCIES: usize = 1_000_000;

/// `ac`: the lowest frequency.
pub static AC_FROM: OptionDescription = OptionDescription {
    name: "from",
    wire: "from_hz",
    unit: "Hz",
    range: Range::Above(0.0, 1e12),
    default: OptionValue::Unset,
    unset: "must be given",
    help: "Lowest frequency",
};

/// `ac`: the highest frequency.
pub static AC_TO: OptionDescription = OptionDescription {
    name: "to",
    wire: "to_hz",
    unit: "Hz",
    range: Range::Above(0.0, 1e12),
    default: OptionValue::Unset,
    unset: "must be given",
    help: "Highest frequency",
};

/// `ac`: frequencies.
pub static AC_POINTS: OptionDescription = OptionDescription {
    name: "points",
    wire: "points",
    unit: "",
    range: Range::Count(2, MAX_FREQUENCIES),
    default: OptionValue::Count(201),
    unset: "",
    help: "Frequencies of the even grid, both ends included; more are added about resonances and zeros",
};

/// `ac`: modes of a sum over modes.
pub static AC_MODES: OptionDescription = OptionDescription {
    name: "modes",
    wire: "modes",
    unit: "",
    range: Range::Count(1, 1000),
    default: OptionValue::Unset,
    unset: "those to twice the highest frequency",
    help: "Of a sum over modes: how many, from the lowest",
};

/// `modes`: how many.
pub static MODES_COUNT: OptionDescription = OptionDescription {
    name: "count",
    wire: "count",
    unit: "",
    range: Range::Count(1, 100_000),
    default: OptionValue::Count(6),
    unset: "",
    help: "How many modes, from the lowest",
};

/// `pullin`: how far.
pub static PULL_IN_MAX: OptionDescription = OptionDescription {
    name: "max",
    wire: "max_v",
    unit: "V",
    range: Range::Above(0.0, 1e9),
    default: OptionValue::Number(200.0),
    unset: "",
    help: "Highest voltage tried",
};

/// `path`: points.
pub static PATH_POINTS: OptionDescription = OptionDescription {
    name: "points",
    wire: "points",
    unit: "",
    range: Range::Count(2, 1_000_000),
    default: OptionValue::Count(bimorph_solve::continuation::DEFAULT_POINTS),
    unset: "",
    help: "Most points",
};

/// `chart`: output times.
pub static CHART_POINTS: OptionDescription = OptionDescription {
    name: "points",
    wire: "points",
    unit: "",
    range: Range::Count(2, 1_000_000),
    default: OptionValue::Count(401),
    unset: "",
    help: "Output times at which errors are taken",
};

/// The commands and their options, as documented.
pub static ANALYSES: [(&str, &OptionDescription); 12] = [
    ("tran", &TRAN_STOP),
    ("tran", &TRAN_POINTS),
    ("tran", &TRAN_STEP),
    ("tran", &TRAN_RHO),
    ("ac", &AC_FROM),
    ("ac", &AC_TO),
    ("ac", &AC_POINTS),
    ("ac", &AC_MODES),
    ("modes", &MODES_COUNT),
    ("pullin", &PULL_IN_MAX),
    ("path", &PATH_POINTS),
    ("chart", &CHART_POINTS),
];

impl OptionDescription {
    /// The default of an option that counts; 0 for others.
    pub fn count(&self) -> usize {
        if let OptionValue::Count(count) = self.default { count } else { 0 }
    }

    /// The default of an option that is a number; 0 for others.
    pub fn number(&self) -> f64 {
        if let OptionValue::Number(x) = self.default { x } else { 0.0 }
    }
}
