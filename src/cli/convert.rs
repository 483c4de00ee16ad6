//! `bimorph convert`: a layout to a netlist.

use super::failure::Failure;
use super::model::{LayoutArgs, front_telling};
use super::output;
use bimorph::layout::report::{ConversionReport, region};
use bimorph::netlist;
use bimorph::results::atomic;
use bimorph::results::format::ResultFormat;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Make a netlist of a layout: CIF or GDSII.
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
    bimorph modes bank.gds --count 3                                   # every analysis takes a layout")]
pub(crate) struct ConvertCommand {
    /// Layout: .cif or .gds
    file: PathBuf,

    #[command(flatten)]
    layout: LayoutArgs,

    /// Netlist to write; without it the netlist goes to standard output and the report to standard error
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
            return Err(bimorph::layout::LayoutError::Format { file: name }.into());
        }
        let (drawing, source) = front_telling(&self.file, &self.layout.asked())?;
        let Some(converted) = &source.converted else { return Ok(()) };
        // The resulting netlist must load. Anything else is a fault of the conversion, reported before it is written.
        let loaded = netlist::load(&source.bundle, &[]).map_err(bimorph::compile::CompileError::Netlist)?;
        let report = self.report(&drawing.top, &converted.process, &converted.report);
        if let Some(path) = &self.picture {
            let picture = super::convert_picture::draw(&self.file, &drawing, &loaded.structure, converted);
            output::write_picture(path, ResultFormat::from_path(path)?, &picture)?;
        }
        if let Some(path) = &self.out {
            let failed = |source| Failure::Write { path: path.clone(), source };
            atomic::write(path, |out| out.write_all(converted.netlist.as_bytes())).map_err(failed)?;
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
