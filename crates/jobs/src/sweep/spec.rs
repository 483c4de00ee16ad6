//! Specification of a sweep: the points of a grid and their parameters.

use super::axis::{SweepParameter, VOLTS, Varied, varied};
use super::error::{SweepError, bad};
use super::samples::SampleGenerator;
use bimorph_analysis::mesh::MeshRequest;
use bimorph_base::Setting;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};

/// Points of a shard, at most: their numbers are laid out.
const MAX_POINTS: usize = 100_000_000;

/// Specification of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSpec {
    /// The full grid of these is run; the last one varies fastest. Empty: one point, as the netlist stands.
    pub parameters: Vec<SweepParameter>,
    /// Samples that are drawn at every point of the grid, and vary faster than it.
    pub samples: Option<SampleGenerator>,
    /// Analysis at each point.
    pub analysis: SweepAnalysis,
    /// Which part of the grid to run.
    pub shard: Shard,
    /// Worker threads; none: one per core. The table does not depend on it.
    pub threads: Option<usize>,
}

/// Analysis at each point.
#[derive(Debug, Clone, PartialEq)]
pub enum SweepAnalysis {
    /// Static equilibrium.
    Static {
        /// Columns wanted: `NODE.x` (m), `NODE.y` (m), `NODE.rz` (rad), `PORT.i` (A), `PORT.q` (C), `BEAM.T` (K);
        /// empty: x, y and rz of every node.
        outputs: Vec<String>,
        /// Port voltages by name (V).
        voltages: Vec<(String, f64)>,
    },
    /// Natural frequencies (Hz).
    Modes {
        /// How many, from the lowest.
        count: usize,
        /// Port voltages of the operating point by name (V).
        voltages: Vec<(String, f64)>,
    },
    /// Pull-in and release voltages (V).
    PullIn {
        /// Port or netlist source to raise; none: the first.
        port: Option<String>,
        /// Highest voltage tried (V).
        max: f64,
    },
    /// Motion from rest, by Rodas4: signals at its end.
    Transient {
        /// End time (s).
        stop: f64,
        /// Columns wanted, as signals of a transient: `NODE.x` (m), `NODE.vx` (m/s), `BEAM.T` (K), `GAP.gap` (m), `PORT.i` (A), ….
        outputs: Vec<String>,
        /// Port voltages held during the run, by name (V).
        voltages: Vec<(String, f64)>,
    },
}

impl SweepAnalysis {
    /// Voltages at which ports are held; `None` where the analysis holds none.
    fn voltages(&self) -> Option<&Vec<(String, f64)>> {
        match self {
            Self::Static { voltages, .. } | Self::Modes { voltages, .. } | Self::Transient { voltages, .. } => {
                Some(voltages)
            }
            Self::PullIn { .. } => None,
        }
    }

    fn voltages_mut(&mut self) -> Option<&mut Vec<(String, f64)>> {
        match self {
            Self::Static { voltages, .. } | Self::Modes { voltages, .. } | Self::Transient { voltages, .. } => {
                Some(voltages)
            }
            Self::PullIn { .. } => None,
        }
    }

    /// Its mesh request; `None` for a transient.
    pub(super) fn request(&self) -> Option<MeshRequest<'_>> {
        match self {
            Self::Static { voltages, .. } => Some(MeshRequest::Static { voltages }),
            Self::Modes { count, voltages } => Some(MeshRequest::Modes { count: *count, voltages }),
            Self::PullIn { port, max } => Some(MeshRequest::PullIn { port: port.as_deref(), max: *max }),
            Self::Transient { .. } => None,
        }
    }
}

/// One of `count` equal parts of a grid: the points whose number modulo `count` is `index`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: usize,
    /// At least 1.
    pub count: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

impl SweepSpec {
    /// Names of what varies, the slowest first.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let varying = self.samples.iter().flat_map(|samples| &samples.asked.vary);
        self.parameters.iter().map(|axis| axis.name.as_str()).chain(varying.map(|vary| vary.name.as_str()))
    }

    /// Samples at each point of the grid.
    fn sample_count(&self) -> usize {
        self.samples.as_ref().map_or(1, |samples| samples.asked.count)
    }

    /// Points of the whole grid with all samples, before sharding.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`] for an axis without values or a grid too large to number.
    pub fn grid_points(&self) -> Result<usize, SweepError> {
        self.groups().try_fold(self.sample_count(), |product, group| {
            let what = |axis: &SweepParameter| format!("parameter {}", axis.name);
            let [first, others @ ..] = group else { return Ok(product) };
            let count = first.values.len();
            if first.in_step {
                return Err(bad(what(first), "a parameter before it, to go along with", "none"));
            }
            if count == 0 {
                return Err(bad(what(first), "at least one value", "none"));
            }
            if let Some(other) = others.iter().find(|axis| axis.values.len() != count) {
                let expected = format!("{count} values, as {} has, with which it goes along", first.name);
                return Err(bad(what(other), &expected, &other.values.len().to_string()));
            }
            product
                .checked_mul(count)
                .ok_or_else(|| bad("parameters".into(), "a grid that can be numbered", "too many points"))
        })
    }

    /// The axes of the grid: one parameter, or several that go together.
    pub(super) fn groups(&self) -> impl Iterator<Item = &[SweepParameter]> {
        self.parameters.chunk_by(|_, next| next.in_step)
    }

    /// True where more than one point has the same options.
    pub(super) fn has_variants(&self) -> bool {
        let of_option = |group: &&[SweepParameter]| group.iter().any(|axis| axis.option().is_some());
        let sorts = self.groups().filter(of_option).map(|group| group[0].values.len());
        self.grid_points().is_ok_and(|points| points > sorts.fold(1, usize::saturating_mul))
    }

    /// Points of the grid, those together that have the same options.
    pub(super) fn by_options(&self, numbers: &[usize]) -> Vec<Vec<usize>> {
        if self.parameters.iter().all(|axis| axis.option().is_none()) {
            return vec![numbers.to_vec()];
        }
        let mut groups: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for &number in numbers {
            let places = self.places(number / self.sample_count());
            let of_options = self.parameters.iter().zip(places).filter(|(axis, _)| axis.option().is_some());
            groups.entry(of_options.map(|(_, place)| place).collect()).or_default().push(number);
        }
        groups.into_values().collect()
    }

    /// Numbers of the points this shard runs.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`].
    pub fn point_numbers(&self) -> Result<Vec<usize>, SweepError> {
        let Shard { index, count } = self.shard;
        if count == 0 || index >= count {
            return Err(bad("shard".into(), "i/N with 0 <= i < N", &format!("{index}/{count}")));
        }
        let mut seen = HashSet::with_capacity(self.parameters.len());
        for name in self.names() {
            if !seen.insert(name) {
                return Err(bad("parameters".into(), "each name once", &format!("\"{name}\" twice")));
            }
        }
        let points = self.grid_points()?;
        let own = points.saturating_sub(index).div_ceil(count);
        if own > MAX_POINTS {
            let text = format!("at most {MAX_POINTS} points at once; give each of several machines a --shard of them");
            return Err(bad("parameters".into(), &text, &format!("{own}")));
        }
        self.parameters.iter().try_for_each(SweepParameter::check)?;
        self.check_samples()?;
        self.check_ports()?;
        Ok((index..points).step_by(count).collect())
    }

    /// Ports whose voltages vary.
    pub(super) fn ports(&self) -> impl Iterator<Item = &str> {
        self.names().filter_map(|name| if let Varied::Voltage(port) = varied(name) { Some(port) } else { None })
    }

    /// Ports whose voltages vary, each with its least and largest value in the whole grid, samples included (V).
    pub(super) fn port_ranges(&self) -> Vec<(&str, [f64; 2])> {
        let mut ranges: Vec<(&str, [f64; 2])> =
            self.ports().map(|port| (port, [f64::INFINITY, -f64::INFINITY])).collect();
        let mut widen = |name: &str, value: Setting| {
            if let (Varied::Voltage(port), Setting::Number(volts)) = (varied(name), value)
                && let Some((_, range)) = ranges.iter_mut().find(|(known, _)| *known == port)
            {
                *range = [range[0].min(volts), range[1].max(volts)];
            }
        };
        for axis in &self.parameters {
            let ends = axis.values.ends().into_iter().flat_map(|(least, largest)| [least, largest]);
            ends.filter_map(|place| axis.values.get(place)).for_each(|value| widen(&axis.name, value));
        }
        let ports_vary = |samples: &&SampleGenerator| {
            samples.asked.vary.iter().any(|vary| matches!(varied(&vary.name), Varied::Voltage(_)))
        };
        for samples in self.samples.iter().filter(ports_vary) {
            (0..samples.asked.count).flat_map(|k| samples.values(k)).for_each(|(name, value)| widen(&name, value));
        }
        ranges
    }

    /// Rejects invalid or repeated voltages.
    fn check_ports(&self) -> Result<(), SweepError> {
        let held = self.analysis.voltages();
        let names: HashSet<&str> = held.into_iter().flatten().map(|(name, _)| name.as_str()).collect();
        for port in self.ports() {
            let what = || format!("parameter \"{port}{VOLTS}\"");
            if held.is_none() {
                return Err(bad(
                    what(),
                    "a netlist parameter: pull-in raises a port by itself",
                    "the voltage of a port",
                ));
            }
            if names.contains(port) {
                return Err(bad(what(), "a port that is not held at a voltage besides", &format!("\"{port}\" twice")));
            }
        }
        Ok(())
    }

    /// Refuses options that are to be drawn.
    fn check_samples(&self) -> Result<(), SweepError> {
        let vary = self.samples.iter().flat_map(|samples| &samples.asked.vary);
        match vary.map(|vary| &vary.name).find(|name| matches!(varied(name), Varied::Option(_))) {
            Some(name) => {
                Err(bad("samples".into(), "parameters of the netlist, or voltages PORT.v", &format!("\"{name}\"")))
            }
            None => Ok(()),
        }
    }

    /// The analysis at a point: with the voltages that vary, besides those that are held.
    pub(super) fn analysis_at(&self, settings: &[(String, Setting)]) -> Cow<'_, SweepAnalysis> {
        let mut analysis = Cow::Borrowed(&self.analysis);
        for (name, value) in settings {
            if let (Varied::Voltage(port), Setting::Number(volts)) = (varied(name), value)
                && let Some(held) = analysis.to_mut().voltages_mut()
            {
                held.push((port.to_owned(), *volts));
            }
        }
        analysis
    }

    /// Values of every parameter at one point of the grid.
    pub fn settings(&self, number: usize) -> Vec<(String, Setting)> {
        let count = self.sample_count();
        let mut settings = self.grid_settings(number / count);
        settings.extend(self.samples.iter().flat_map(|samples| samples.values(number % count)));
        settings
    }

    /// Values of the parameters of the grid at one of its points, samples aside.
    fn grid_settings(&self, number: usize) -> Vec<(String, Setting)> {
        let value = |(axis, place): (&SweepParameter, usize)| Some((axis.name.clone(), axis.values.get(place)?));
        self.parameters.iter().zip(self.places(number)).filter_map(value).collect()
    }

    /// Which value of each axis a point of the grid has, samples aside.
    fn places(&self, mut number: usize) -> Vec<usize> {
        let mut places = vec![0; self.parameters.len()];
        for (axis, place) in self.parameters.iter().zip(&mut places).rev() {
            let n = axis.values.len().max(1);
            *place = number % n;
            if !axis.in_step {
                number /= n;
            }
        }
        places
    }
}
