//! Options that choose the model: the netlist, its parameters, and how fine the model is.

use super::failure::Failure;
use super::options::Chosen;
use super::{interrupt, progress, value};
use bimorph::analysis::readout::ReadoutError;
use bimorph::analysis::readout::ports::check_ranges;
use bimorph::compile::{Anchors, CompileOptions, CompiledModel, Junctions, ParsedStructure, compile, draw};
use bimorph::input::{self, InputBundle, LayoutChoice};
use bimorph::layout::LayoutFormat;
use bimorph::layout::drawing::FlatLayout;
use bimorph::netlist::{Bundle, Diagnostic, DroppedInclude, Setting};
use bimorph::options::{MODEL, OptionValue};
use clap::Args;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Options of every command that reads a netlist.
#[derive(Debug, Args)]
pub(crate) struct ModelArgs {
    /// SUGAR netlist, layout (.cif or .gds) or JSON document of a structure
    file: PathBuf,

    /// Set a netlist parameter: a number with suffix (2.1u) or text. Repeatable
    #[arg(long = "set", short = 's', value_name = "NAME=VALUE", value_parser = value::setting, help_heading = "Model")]
    set: Vec<(String, Setting)>,

    /// Folder to search for files that the netlist uses. Repeatable
    #[arg(long, value_name = "DIR", help_heading = "Model")]
    include: Vec<PathBuf>,

    #[command(flatten)]
    layout: LayoutArgs,

    #[command(flatten)]
    chosen: Chosen,
}

/// How a layout is to be read.
#[derive(Debug, Args)]
pub(crate) struct LayoutArgs {
    /// Layouts only: definition of the layers; a built-in process (polymumps, soi) or a process file (.toml,
    /// docs/reference/layouts.md)
    #[arg(long, value_name = "NAME|FILE", help_heading = "Model")]
    process: Option<String>,

    /// Layouts only: the cell to read, where several are called by no other
    #[arg(long, value_name = "NAME", help_heading = "Model")]
    cell: Option<String>,
}

impl LayoutArgs {
    pub(crate) fn asked(&self) -> LayoutChoice {
        LayoutChoice { process: self.process.clone(), cell: self.cell.clone() }
    }
}

/// Reads and converts a file with a bar; gives the drawing too.
pub(crate) fn front_telling(path: &Path, asked: &LayoutChoice) -> Result<(FlatLayout, InputBundle), Failure> {
    interrupt::listen();
    let bar = progress::bar("reading");
    let read = input::drawing_and_source(path, asked, &mut progress::watch(&bar, ""));
    bar.finish_and_clear();
    Ok(read?)
}

impl ModelArgs {
    /// The netlist with everything it uses; a layout is converted, and what its report has to say goes to standard error.
    pub(crate) fn bundle(&self) -> Result<Bundle, Failure> {
        self.bundle_asked(&self.asked())
    }

    fn bundle_asked(&self, asked: &LayoutChoice) -> Result<Bundle, Failure> {
        interrupt::listen();
        let warn = &mut |dropped: DroppedInclude| stderr_line!("warning: {dropped}");
        let bar = progress::bar("reading");
        let read = input::read(&self.file, &self.include, asked, warn, &mut progress::watch(&bar, ""));
        bar.finish_and_clear();
        let source = read?;
        if let Some(converted) = &source.converted {
            let report = &converted.report;
            for note in &report.notes {
                stderr_line!("warning: {note}");
            }
            if report.areas.unrecognised_m2 > 0.0 {
                let [part, all] =
                    [report.areas.unrecognised_m2, report.areas.drawn_m2].map(|a| (a * 1e14).round() / 1e2);
                stderr_line!("warning: {part} of {all} µm² were not understood: `bimorph convert` lists them");
            }
        }
        Ok(source.bundle)
    }

    /// The file as named on the command line.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// How a layout is to be read.
    pub(crate) fn asked(&self) -> LayoutChoice {
        self.layout.asked()
    }

    /// The structure, with warnings on standard error. A process is then that of what is to be drawn, for netlists too.
    pub(crate) fn draw(&self) -> Result<ParsedStructure, Failure> {
        let asked = if LayoutFormat::of(&self.file.display().to_string()).is_some() {
            self.asked()
        } else {
            LayoutChoice::default()
        };
        let drawn = draw(&bimorph::netlist::NetlistSource::new(&self.bundle_asked(&asked)?), &self.options()?)?;
        if !drawn.warnings.items.is_empty() {
            stderr_text!("{}", drawn.warnings.render(io::stderr().is_terminal()));
        }
        Ok(drawn)
    }

    /// The options of the compilation, checked. Ranges of ports are refused: an analysis is trained for what acts in it.
    pub(crate) fn options(&self) -> Result<CompileOptions, Failure> {
        let options = self.options_with_ranges()?;
        match &options.ranges {
            Some(ranges) => Err(Failure::bad(
                "--ranges",
                "none in this command, which has no motion and which no circuit drives (they are for tran, decks, cosim, view, sessions of the service, \
                 Python and C; sweep has those of its points, export has --range)",
                format!("\"{}\"", ranges.text()),
            )),
            None => Ok(options),
        }
    }

    /// The options of the compilation of a model that a circuit drives or that is trained for a motion, checked.
    pub(crate) fn options_with_ranges(&self) -> Result<CompileOptions, Failure> {
        Ok(self.chosen.options()?.with_settings(&self.set))
    }

    /// Compiles the netlist and shows its warnings on standard error.
    pub(crate) fn compile(&self) -> Result<CompiledModel, Failure> {
        self.compiled(&self.options()?)
    }

    /// The same for circuits and motions: ranges are those of ports.
    pub(crate) fn compile_with_ranges(&self) -> Result<CompiledModel, Failure> {
        let compiled = self.compiled(&self.options_with_ranges()?)?;
        match check_ranges(&compiled, &[]) {
            Err(ReadoutError::BadRange { expected, got }) => Err(Failure::bad("--ranges", expected, got)),
            _ => Ok(compiled),
        }
    }

    /// Whether an option of the model was given by its name, not left out.
    pub(crate) fn gives(&self, option: &str) -> bool {
        self.chosen.given(option)
    }

    /// The same for a frame of cubic beams, whose centrelines meet in points.
    pub(crate) fn compile_frame(&self) -> Result<CompiledModel, Failure> {
        let options = self.options()?;
        if self.chosen.given("junctions") && options.junctions != Junctions::Centreline {
            let got = format!("\"{}\" with --solver frame, which has no other", options.junctions.name());
            return Err(Failure::bad("--junctions", "centreline", got));
        }
        if options.anchors == Anchors::Elastic {
            return Err(Failure::bad(
                "--anchors",
                "rigid",
                "\"elastic\" with --solver frame, whose anchors are rigid".to_owned(),
            ));
        }
        let mut compiled = compile(&self.bundle()?, &options.with_centrelines())?.for_given_steps();
        // that of the recursion's mesh is no frame's
        compiled.order.estimated_error = None;
        compiled.warnings.items.push(baseline());
        warn(&compiled);
        Ok(compiled)
    }

    fn compiled(&self, options: &CompileOptions) -> Result<CompiledModel, Failure> {
        let compiled = compile(&self.bundle()?, options)?;
        warn(&compiled);
        Ok(compiled)
    }

    /// Input of the model, for JSON.
    pub(crate) fn context<'a>(&'a self, compiled: &'a CompiledModel) -> Context<'a> {
        self.context_of(compiled, compiled)
    }

    /// The same of a run in which `compiled` moves and `drawn` is what the netlist says.
    pub(crate) fn context_of<'a>(&'a self, drawn: &'a CompiledModel, compiled: &'a CompiledModel) -> Context<'a> {
        let mut reported: Vec<&Diagnostic> = compiled.warnings.items.iter().collect();
        reported.extend(drawn.warnings.items.iter().filter(|d| !compiled.warnings.items.contains(d)));
        Context {
            file: self.file.display().to_string(),
            parameters: OrderedMap(&drawn.parameters),
            options: Keys(&drawn.options),
            estimated_error: compiled.order.estimated_error,
            warnings: reported.into_iter().map(|d| d.message.as_str()).collect(),
        }
    }

    /// The netlist's file name, for titles.
    pub(crate) fn title(&self) -> String {
        self.file.file_name().map_or_else(|| self.file.display().to_string(), |n| n.to_string_lossy().into_owned())
    }
}

/// Warning on every result of the linear frame.
fn baseline() -> Diagnostic {
    let message =
        "the linear frame is a baseline: small displacements, no stops, and no estimate of the error of its elements";
    let help = "--segments N or --band HZ for more elements; --solver recursion has an estimate";
    Diagnostic::warning("W043", message.into(), help)
}

/// Shows what the mesh has added to the warnings of a model on standard error.
pub(crate) fn warn_of_mesh(before: &CompiledModel, fitted: &CompiledModel) {
    let mut added = fitted.warnings.clone();
    added.items.drain(..before.warnings.items.len().min(added.items.len()));
    if !added.items.is_empty() {
        stderr_text!("{}", added.render(io::stderr().is_terminal()));
    }
}

/// Shows the warnings of a netlist on standard error.
pub(crate) fn warn(compiled: &CompiledModel) {
    if !compiled.warnings.items.is_empty() {
        stderr_text!("{}", compiled.warnings.render(io::stderr().is_terminal()));
    }
}

/// The part of every JSON document that says what the model was.
#[derive(Debug, Serialize)]
pub(crate) struct Context<'a> {
    /// Netlist as named on the command line.
    file: String,
    /// Netlist parameters with the values they took, SI.
    parameters: OrderedMap<'a, Setting>,
    /// Every option, under its name on the wire.
    #[serde(flatten)]
    options: Keys<'a>,
    /// Largest estimated relative error of the requested results from the mesh; null without an estimate.
    estimated_error: Option<f64>,
    /// Warnings of the netlist.
    warnings: Vec<&'a str>,
}

impl<'a> Context<'a> {
    /// With what an analysis warns of.
    pub(crate) fn with(mut self, warnings: &'a [String]) -> Self {
        self.warnings.extend(warnings.iter().map(String::as_str));
        self
    }
}

/// Shows what an analysis warns of on standard error.
pub(crate) fn warn_of(warnings: &[String]) {
    for warning in warnings {
        stderr_line!("warning: {warning}");
    }
}

/// The options of a model as keys of a document, without the number of segments, which `check` lists by beam.
#[derive(Debug)]
struct Keys<'a>(&'a CompileOptions);

impl Serialize for Keys<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for option in MODEL.iter().filter(|option| option.about.name != "segments") {
            let key = option.about.wire;
            match self.0.value(option) {
                OptionValue::Unset => map.serialize_entry(key, &())?,
                OptionValue::Flag(flag) => map.serialize_entry(key, &flag)?,
                OptionValue::Count(count) => map.serialize_entry(key, &count)?,
                OptionValue::Number(x) => map.serialize_entry(key, &x)?,
                OptionValue::Name(name) => map.serialize_entry(key, &name)?,
            }
        }
        map.end()
    }
}

/// Named values as a JSON object in their own order.
#[derive(Debug)]
pub(crate) struct OrderedMap<'a, T>(pub(crate) &'a [(String, T)]);

impl Serialize for OrderedMap<'_, Setting> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in self.0 {
            match value {
                Setting::Number(x) => map.serialize_entry(name, x)?,
                Setting::Text(text) => map.serialize_entry(name, text)?,
            }
        }
        map.end()
    }
}

/// The same for values that JSON knows.
#[derive(Debug)]
pub(crate) struct JsonMap<'a, T>(pub(crate) &'a [(String, T)]);

impl<T> JsonMap<'_, T> {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<T: Serialize> Serialize for JsonMap<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}
