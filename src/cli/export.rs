//! `bimorph export`: the model as a file for other simulators.

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs, warn_of};
use super::output::{check_folder, print, write_page};
use super::{progress, report, value};
use bimorph::analysis::mesh::{beyond, in_circuit};
use bimorph::compile::CompiledModel;
use bimorph::export::compare::{ModelFit, fit};
use bimorph::export::names::{self, Pins};
use bimorph::export::{ExportError, ExportRequest, lumped, lumped_spice, lumped_verilog_a, spice, verilog_a};
use bimorph::results::plot::axis::quantity;
use clap::Args;
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

/// The model as a SPICE subcircuit or a Verilog-A module, for simulators without the plug-in.
///
/// The output is the linear model about the operating point: its modes, the static correction for all others, damping,
/// lags of heaters, and electrical, mechanical and thermal ports with the scales of the plug-in. It is compared with
/// the exact small-signal answer up to --to, and has as many modes as --within takes. The mesh is that of a deck with
/// the same options.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph export examples/bank/bank.net --spice --port heat=1 --port sense=10 --signals yoke.y:1M --out bank.lib\n  \
    bimorph export examples/bank/bank.net --verilog-a --name bank --out bank.va\n  \
    bimorph export examples/comb_resonator/comb_resonator.net --spice --ports drive,shuttle.x --to 200k")]
pub(crate) struct ExportCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Write a SPICE subcircuit of R, L, C and linear sources
    #[arg(long, required_unless_present = "verilog_a", conflicts_with = "verilog_a")]
    spice: bool,

    /// Write a Verilog-A module
    #[arg(long)]
    verilog_a: bool,

    /// Write the whole nonlinear model instead, without an operating point: of rigid parts that only slide on linear springs
    #[arg(long, conflicts_with_all = ["bias", "to", "count", "json"])]
    nonlinear: bool,

    /// Operating point: hold a port at a voltage [V]; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    bias: Vec<(String, f64)>,

    /// Ports of the file in its order: of the netlist, NODE.x|y|rz|vx|vy|vrz, BEAM.T, frame.ax|ay, each with :SCALE in volts
    /// per unit across; a,b or repeated [default: all of the netlist]
    #[arg(long, value_name = "NAMES")]
    ports: Vec<String>,

    /// Signals shown as voltages: NAME or NAME:SCALE in volts per unit; a,b or repeated
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Highest frequency that the file is for [Hz] [default: the second mode that ports and signals see]
    #[arg(long, value_name = "HZ", value_parser = value::number)]
    to: Option<f64>,

    /// Largest relative deviation from the exact small-signal answer up to --to
    #[arg(long, default_value_t = 1e-4, value_name = "NUMBER", value_parser = value::number)]
    within: f64,

    /// Keep exactly the N lowest modes [default: as many as --within takes]
    #[arg(long, short = 'n', value_name = "N")]
    count: Option<usize>,

    /// Name of the subcircuit or module [default: that of the netlist]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    /// File to write [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Print one JSON document about what was written; needs --out
    #[arg(long, requires = "out")]
    json: bool,
}

#[derive(Debug, Serialize)]
struct ExportDocument<'a> {
    name: &'a str,
    pins: Vec<&'a str>,
    frequencies_hz: Vec<f64>,
    quality: Vec<f64>,
    error: f64,
    band_hz: [f64; 2],
    unknowns: usize,
    port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl ExportCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        if let Some(path) = &self.out {
            check_folder(path)?;
        }
        let request = self.request()?;
        let stem = self.model.title();
        let name = match &self.name {
            Some(name) => names::checked(name)?.to_owned(),
            None => names::from_file(stem.rsplit_once('.').map_or(stem.as_str(), |(stem, _)| stem)),
        };
        let compiled = Arc::new(in_circuit(&self.model.compile()?));
        if self.nonlinear {
            return self.whole(&compiled, &request, &name);
        }
        let busy = progress::spinner("export");
        let fitted = fit(&compiled, &request);
        busy.finish_and_clear();
        let fitted = fitted?;
        let pins = Pins::of(&fitted.model.ports, &fitted.model.signals)?;
        let warnings = self.warnings(&compiled, &fitted);
        warn_of(&warnings);
        let about = self.about(&compiled, &fitted);
        let text = match self.spice {
            true => spice::write(&fitted, &pins, &name, &about),
            false => verilog_a::write(&fitted, &pins, &name, &about),
        };
        let Some(path) = &self.out else { return print(&text) };
        write_page(path, &text)?;
        if !self.json {
            return print(&(summary(&fitted, &pins, &name) + &mesh(&compiled) + "\n"));
        }
        let document = ExportDocument {
            name: &name,
            pins: pins.all().collect(),
            frequencies_hz: fitted.model.modes.iter().map(|m| m.omega / TAU).collect(),
            quality: (0..fitted.model.modes.len()).map(|j| quality(&fitted, j)).collect(),
            error: fitted.error,
            band_hz: fitted.band,
            unknowns: fitted.unknowns,
            port_voltages_v: JsonMap(&self.bias),
            context: self.model.context(&compiled).with(&warnings),
        };
        let json = serde_json::to_string(&document).map_err(|e| Failure::Stdout(e.into()))?;
        print(&(json + "\n"))
    }

    /// Limitations of the file that its numbers do not show.
    fn warnings(&self, compiled: &CompiledModel, fitted: &ModelFit) -> Vec<String> {
        let mut warnings: Vec<String> = beyond(compiled.options.errors(), mesh_error(compiled)).into_iter().collect();
        if fitted.error > self.within {
            let (modes, error, within) = (fitted.model.modes.len(), fitted.error, self.within);
            warnings.push(format!("{modes} modes deviate by {error:.1e}, more than --within {within:.1e}"));
        }
        if fitted.model.modes.is_empty() {
            warnings.push(
                "the file has no mode, and answers at once at every frequency: none that ports and signals see lies below --to; take a \
                 higher --to, or where they see no motion at this operating point, a --port voltage or NODE.x with --ports or --signals"
                    .to_owned(),
            );
        }
        if fitted.jumped {
            warnings.push(
                "the part pulled in, snapped or buckled on the way to this operating point: the file is about where it went, \
                 and knows no way back"
                    .to_owned(),
            );
        }
        warnings
    }

    /// Writes the nonlinear model.
    fn whole(&self, compiled: &CompiledModel, request: &ExportRequest, name: &str) -> Result<(), Failure> {
        let model = lumped::lump(compiled, request)?;
        let pins = Pins::of(&model.ports, &model.signals)?;
        let version = env!("CARGO_PKG_VERSION");
        let (parts, gaps) = (model.coordinates.len(), model.gaps.len());
        let mut about = vec![
            format!("{}, the whole nonlinear model, written by bimorph {version} export", self.model.title()),
            format!("{parts} direction(s) in which parts slide, {gaps} gap(s)"),
        ];
        about.extend(model.signals.iter().map(|s| format!("signal {}: 1 V is {:e} {}", s.name, 1.0 / s.scale, s.unit)));
        let text = match self.spice {
            true => lumped_spice::write(&model, &pins, name, &about),
            false => lumped_verilog_a::write(&model, &pins, name, &about),
        };
        let Some(path) = &self.out else { return print(&text) };
        write_page(path, &text)?;
        let all = pins.all().collect::<Vec<_>>().join(" ");
        print(&format!("{name} {all}\n{parts} direction(s) in which parts slide, {gaps} gap(s), nonlinear\n"))
    }

    /// The request, each option within its range.
    fn request(&self) -> Result<ExportRequest, Failure> {
        if let Some(to) = self.to.filter(|to| to.is_nan() || *to <= 0.0) {
            return Err(Failure::bad("--to", "a frequency above 0 Hz", to.to_string()));
        }
        if self.within.is_nan() || self.within < 1e-9 || self.within >= 1.0 {
            return Err(Failure::bad("--within", "a number of at least 1e-9, below 1", self.within.to_string()));
        }
        if let Some(count) = self.count.filter(|n| *n == 0 || *n > 1000) {
            return Err(Failure::bad("--count", "a number of modes, 1 to 1000", count.to_string()));
        }
        let scaled = |names: &[String]| value::names(names).iter().map(|name| value::scaled(name)).collect::<Vec<_>>();
        if let Some((name, _)) = scaled(&self.ports).iter().chain(&scaled(&self.signals)).find(|(_, s)| *s == Some(0.0))
        {
            return Err(Failure::bad("--ports, --signals", "a scale other than 0", format!("\"{name}:0\"")));
        }
        Ok(ExportRequest {
            ports: scaled(&self.ports),
            signals: scaled(&self.signals).into_iter().map(|(name, scale)| (name, scale.unwrap_or(1.0))).collect(),
            bias: self.bias.clone(),
            count: self.count,
            to: self.to,
            within: self.within,
        })
    }

    /// The lines at the head of the file.
    fn about(&self, compiled: &CompiledModel, fitted: &ModelFit) -> Vec<String> {
        let version = env!("CARGO_PKG_VERSION");
        let model = &fitted.model;
        let bias: Vec<String> = self.bias.iter().map(|(n, v)| format!("{n}={v:e} V")).collect();
        let at = if bias.is_empty() { "all ports at 0 V".into() } else { bias.join(", ") };
        let (row, port, hertz) = &fitted.worst;
        let mut about = vec![
            format!("{}, linear about the operating point, written by bimorph {version} export", self.model.title()),
            format!("operating point: {at}"),
            format!("full model: {} unknowns, {}", fitted.unknowns, report::options(compiled).trim_end()),
            mesh(compiled),
            format!(
                "kept: {} modes, {} lags of heat, static correction for the rest",
                model.modes.len(),
                model.lags.len()
            ),
            format!(
                "largest relative deviation from the full model, {:.3e} Hz to {:.3e} Hz at {} frequencies: {:.1e}",
                fitted.band[0], fitted.band[1], fitted.compared, fitted.error
            ),
        ];
        if fitted.error > 0.0 {
            about.push(format!("  found at {hertz:.4e} Hz from port {port} to {row}"));
        }
        about.extend(self.warnings(compiled, fitted).iter().map(|warning| format!("warning: {warning}")));
        about.extend(model.signals.iter().map(|s| format!("signal {}: 1 V is {:e} {}", s.name, 1.0 / s.scale, s.unit)));
        about
    }
}

fn quality(fitted: &ModelFit, mode: usize) -> f64 {
    fitted.model.modes[mode].omega / fitted.model.damping[(mode, mode)]
}

/// The estimate of the mesh, or of its lowest mode where that is all that is known; what has no beams has no mesh.
fn mesh_error(compiled: &CompiledModel) -> Option<f64> {
    let lowest = || compiled.lowest.map(|lowest| lowest.error.abs());
    if compiled.structure.beams.is_empty() { Some(0.0) } else { compiled.order.estimated_error.or_else(lowest) }
}

/// Estimated error of the full model from its mesh.
fn mesh(compiled: &CompiledModel) -> String {
    match mesh_error(compiled) {
        Some(error) if compiled.options.band.is_none() && compiled.options.segments.is_none() => format!(
            "the equilibrium and the lowest frequencies of the full model: estimated error {error:.1e} at most, from its mesh; --band HZ covers all below it"
        ),
        Some(error) => {
            format!("frequencies of the full model: estimated error {error:.1e} at most in the band, from its mesh")
        }
        None => "frequencies of the full model: the error of its mesh is unknown; --band HZ estimates it".to_owned(),
    }
}

/// Summary of the written file, for people.
fn summary(fitted: &ModelFit, pins: &Pins, name: &str) -> String {
    let model = &fitted.model;
    let row = |(j, mode): (usize, &bimorph::export::linear::ReducedMode)| {
        let number = mode.number.map_or_else(|| "static".into(), |n| n.to_string());
        vec![
            number,
            quantity(mode.omega / TAU, "Hz"),
            match quality(fitted, j) {
                q if q.is_finite() => format!("{q:.3e}"),
                _ => "undamped".into(),
            },
        ]
    };
    let rows: Vec<Vec<String>> = model.modes.iter().enumerate().map(row).collect();
    let mut text = report::columns(&["mode", "frequency", "Q"], &rows);
    let _ = write!(
        text,
        "\n{name} {}\n{} modes for {} unknowns, {} lags of heat\nwithin {:.1e} of the full model from {} to {}\n",
        pins.all().collect::<Vec<_>>().join(" "),
        model.modes.len(),
        fitted.unknowns,
        model.lags.len(),
        fitted.error,
        quantity(fitted.band[0], "Hz"),
        quantity(fitted.band[1], "Hz"),
    );
    text
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        match error {
            ExportError::Analysis(error) => error.into(),
            other => Self::Export(other),
        }
    }
}
