//! Requests of the page.

use bimorph_base::Setting;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A request: the state of the bench, and the analysis of it.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Question {
    /// Channel: a newer request of the same channel stops the older one.
    #[serde(default)]
    pub(crate) channel: String,
    /// State of the bench.
    #[serde(default)]
    pub(crate) state: BenchState,
    /// The analysis.
    pub(crate) ask: Ask,
}

/// Parameters, port voltages and text on the bench.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub(crate) struct BenchState {
    /// Values of netlist parameters (SI) or texts.
    #[serde(default)]
    pub(crate) set: BTreeMap<String, SetValue>,
    /// Port voltages (V).
    #[serde(default)]
    pub(crate) ports: BTreeMap<String, f64>,
    /// Edited text of the netlist; none: the file.
    #[serde(default)]
    pub(crate) text: Option<String>,
}

/// Value of a parameter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(crate) enum SetValue {
    /// A number (SI).
    Number(f64),
    /// A text.
    Text(String),
}

impl BenchState {
    /// Settings of the parameters.
    pub(crate) fn settings(&self) -> Vec<(String, Setting)> {
        let value = |value: &SetValue| match value {
            SetValue::Number(x) => Setting::Number(*x),
            SetValue::Text(text) => Setting::Text(text.clone()),
        };
        self.set.iter().map(|(name, given)| (name.clone(), value(given))).collect()
    }

    /// Port voltages by name (V).
    pub(crate) fn voltages(&self) -> Vec<(String, f64)> {
        self.ports.iter().map(|(name, volts)| (name.clone(), *volts)).collect()
    }
}

/// An analysis.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum Ask {
    /// Names, values, units and ranges of parameters and ports, files and decks.
    Describe {},
    /// Polygons of the layout.
    Layout {},
    /// Static equilibrium.
    Static {},
    /// Natural frequencies and shapes.
    Modes {
        /// How many.
        count: usize,
        /// Whether shapes are wanted.
        shapes: bool,
    },
    /// Pull-in and release.
    Pullin {
        /// Port; none: the first.
        port: Option<String>,
        /// Largest voltage (V).
        max: f64,
    },
    /// Path of equilibria.
    Path(PathQuestion),
    /// Motion in time.
    Transient(MotionQuestion),
    /// Frequency response.
    Response(ResponseQuestion),
    /// Run of ngspice on a deck.
    Circuit {
        /// Name of the deck, as described.
        deck: String,
    },
    /// Samples of parameters.
    Yield(YieldQuestion),
    /// Writes the edited text to the file.
    Save {
        /// Writes also where the file has changed since it was read.
        force: bool,
    },
    /// The self-contained page.
    Export {
        /// The analyses that it contains, each by its name on the page.
        asks: BTreeMap<String, Ask>,
        /// State of the controls, which the page interprets.
        view: serde_json::Value,
    },
}

/// Request for a path.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PathQuestion {
    /// Port, numeric parameter, or `loads`.
    pub(crate) along: String,
    /// First value.
    pub(crate) from: f64,
    /// Last value.
    pub(crate) to: f64,
    /// Signals; empty: x and y of the node that moves most.
    #[serde(default)]
    pub(crate) signals: Vec<String>,
    /// Most points.
    #[serde(default = "path_points")]
    pub(crate) points: usize,
}

/// Points of a path on the page: more take seconds.
pub(crate) const PATH_POINTS: usize = 400;

fn path_points() -> usize {
    PATH_POINTS
}

/// Request for a motion in time.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MotionQuestion {
    /// End time (s).
    pub(crate) stop: f64,
    /// Output times.
    pub(crate) points: usize,
    /// Signals; empty: x and y of the node that moves most.
    #[serde(default)]
    pub(crate) signals: Vec<String>,
    /// Corners of the waveform of each port: time (s) and volts. A port without one keeps its voltage.
    #[serde(default)]
    pub(crate) waves: BTreeMap<String, Vec<[f64; 2]>>,
}

/// Request for a frequency response.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ResponseQuestion {
    /// Input.
    pub(crate) drive: String,
    /// Signals; empty: that of the driven place.
    #[serde(default)]
    pub(crate) signals: Vec<String>,
    /// Lowest frequency (Hz).
    pub(crate) from: f64,
    /// Highest frequency (Hz).
    pub(crate) to: f64,
    /// Frequencies of the even grid.
    pub(crate) points: usize,
}

/// Request for samples.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct YieldQuestion {
    /// Parameters with their distributions, as `bimorph sweep --vary` writes them.
    pub(crate) vary: Vec<String>,
    /// Number of samples.
    pub(crate) samples: usize,
    /// The same seed draws the same samples.
    pub(crate) seed: u64,
    /// `static`, `modes` or `pullin`.
    pub(crate) analysis: String,
    /// Result: a signal of `static`; ignored otherwise.
    #[serde(default)]
    pub(crate) signal: String,
    /// Limits, as `bimorph sweep --limits` writes them.
    #[serde(default)]
    pub(crate) limits: Vec<String>,
}
