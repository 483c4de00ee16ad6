//! `bimorph convert`: a layout to a netlist, and any model to a JSON document.

use super::failure::Failure;
use super::model::{LayoutArgs, front_telling};
use super::{interrupt, output, value};
use bimorph::compile::CompileError;
use bimorph::input::{self, InputBundle};
use bimorph::layout::report::{ConversionReport, region};
use bimorph::netlist::{self, Bundle, DroppedInclude, Setting};
use bimorph::results::atomic;
use bimorph::results::format::ResultFormat;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Make a netlist of a layout, or a JSON document of any model.
///
/// With --out FILE.json any netlist, layout or document becomes a document: the structure with all its numbers in SI, for
/// other programs (docs/reference/document.md). Every command reads such a document in place of a netlist, and gets the same bits.
///
/// A drawing that `bimorph layout` made is read by its labels, checked against its polygons; any other by its geometry:
/// limbs become beams, wide parts bodies, what the process says holds them anchors. Unrecognised areas are listed with
/// size and position, and drawn red in the picture. Every other command takes layouts too, with the same --process and
/// --cell.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph layout examples/bank/bank.net --out bank.gds\n  \
    bimorph convert bank.gds --out again.net --picture again.png\n  \
    bimorph convert bank.gds --cell bank --process polymumps --out again.net\n  \
    bimorph modes bank.gds --count 3                                   # every analysis takes a layout\n  \
    bimorph convert examples/bank/bank.net --out model.json         # for other programs")]
pub(crate) struct ConvertCommand {
    /// Layout: .cif or .gds. With --out FILE.json also a netlist or a document
    file: PathBuf,

    /// Set a netlist parameter: a number with suffix (2.1u) or text. Repeatable
    #[arg(long = "set", short = 's', value_name = "NAME=VALUE", value_parser = value::setting, help_heading = "Model")]
    set: Vec<(String, Setting)>,

    /// Folder to search for files that the netlist uses. Repeatable
    #[arg(long, value_name = "DIR", help_heading = "Model")]
    include: Vec<PathBuf>,

    #[command(flatten)]
    layout: LayoutArgs,

    /// Netlist or document (.json) to write; without it the netlist goes to standard output and the report to standard error
    #[arg(long, short = 'o', value_name = "FILE")]
    out: Option<PathBuf>,

    /// Picture to write, the mechanism over the polygons: .svg, .png or .html
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,

    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct ConversionDocument<'a> {
    file: String,
    cell: &'a str,
    process: &'a str,
    #[serde(flatten)]
    report: &'a ConversionReport,
    netlist: &'a str,
}

fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    let failed = |source| Failure::Write { path: path.to_owned(), source };
    atomic::write(path, |out| out.write_all(text.as_bytes())).map_err(failed)
}

impl ConvertCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        if let Some(path) = &self.picture {
            if !matches!(ResultFormat::from_path(path)?, ResultFormat::Svg | ResultFormat::Png | ResultFormat::Html) {
                let got = format!("\"{}\"", path.display());
                return Err(Failure::bad("--picture", "a file that ends in .svg, .png or .html", got));
            }
            output::check_folder(path)?;
        }
        if let Some(path) = &self.out {
            output::check_folder(path)?;
        }
        let name = self.file.display().to_string();
        if bimorph::layout::LayoutFormat::of(&name).is_none() {
            return self.netlist_to_document();
        }
        let (drawing, source) = front_telling(&self.file, &self.layout.asked())?;
        let Some(converted) = &source.converted else { return Ok(()) };
        // The resulting netlist must load. Anything else is a fault of the conversion, reported before it is written.
        let loaded = netlist::load(&source.bundle, &self.set).map_err(CompileError::Netlist)?;
        let report = self.report(&drawing.top, &converted.process, &converted.report);
        if let Some(path) = &self.picture {
            let picture = super::convert_picture::draw(&self.file, &drawing, &loaded.structure, converted);
            output::write_picture(path, ResultFormat::from_path(path)?, &picture)?;
        }
        match &self.out {
            Some(path) if is_json(path) => self.write_document(&source.bundle, path)?,
            Some(path) => write_text(path, &converted.netlist)?,
            None => {}
        }
        if self.json {
            let document = ConversionDocument {
                file: name,
                cell: &drawing.top,
                process: &converted.process,
                report: &converted.report,
                netlist: &converted.netlist,
            };
            let text = serde_json::to_string(&document).map_err(|e| Failure::Stdout(e.into()))?;
            return output::print(&(text + "\n"));
        }
        if self.out.is_some() {
            return output::print(&report);
        }
        stderr_text!("{report}");
        output::print(&converted.netlist)
    }

    /// A netlist or a document to a document.
    fn netlist_to_document(&self) -> Result<(), Failure> {
        let Some(path) = self.out.as_deref().filter(|path| is_json(path)) else {
            let got = self.out.as_ref().map_or("none".to_owned(), |path| format!("\"{}\"", path.display()));
            let expected = format!("a file that ends in .json: {} is no layout by its name", self.file.display());
            return Err(Failure::bad("--out", expected, got));
        };
        for (option, given) in [("--picture", self.picture.is_some()), ("--json", self.json)] {
            if given {
                return Err(Failure::bad(option, "a layout (.cif, .gds)", format!("\"{}\"", self.file.display())));
            }
        }
        interrupt::listen();
        let warn = &mut |dropped: DroppedInclude| stderr_line!("warning: {dropped}");
        let InputBundle { bundle, .. } =
            input::read(&self.file, &self.include, &self.layout.asked(), warn, &mut |_| true)?;
        self.write_document(&bundle, path)
    }

    /// Writes the structure of a bundle as a document.
    fn write_document(&self, bundle: &Bundle, path: &Path) -> Result<(), Failure> {
        let (document, warnings) = netlist::document(bundle, &self.set).map_err(CompileError::Netlist)?;
        if !warnings.items.is_empty() {
            stderr_text!("{}", warnings.render(io::stderr().is_terminal()));
        }
        write_text(path, &document.write()?)
    }

    fn report(&self, cell: &str, process: &str, report: &ConversionReport) -> String {
        const MOST: usize = 20;
        let um2 = |m2: f64| (m2 * 1e14).round() / 1e2;
        let mut text = format!("{}: cell {cell}, process {process}, by {}\n", self.file.display(), report.by);
        let counts: Vec<String> = report.counts.iter().map(|(what, n)| format!("{n} {what}")).collect();
        let _ = writeln!(text, "  {}", counts.join(", "));
        let a = &report.areas;
        let _ = writeln!(
            text,
            "  drawn {} µm², in the mechanism {}, anchored {}, not understood {}",
            um2(a.drawn_m2),
            um2(a.extracted_m2),
            um2(a.anchored_m2),
            um2(a.unrecognised_m2)
        );
        for piece in report.unrecognised.iter().take(MOST) {
            let _ = writeln!(text, "  {} µm² on {} at {}: {}", piece.area_um2(), piece.layer, region(piece), piece.why);
        }
        if report.unrecognised.len() > MOST {
            let _ = writeln!(text, "  … and {} more pieces (--json has all)", report.unrecognised.len() - MOST);
        }
        for note in &report.notes {
            let _ = writeln!(text, "  {note}");
        }
        text
    }
}
