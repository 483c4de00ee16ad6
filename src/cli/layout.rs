//! `bimorph layout`: a netlist as masks.

use super::failure::Failure;
use super::model::ModelArgs;
use super::output;
use bimorph::layout::LayoutFormat;
use bimorph::layout::convert::DEFAULT_PROCESS;
use bimorph::layout::mask::mask;
use bimorph::layout::process::Process;
use bimorph::results::atomic;
use clap::Args;
use std::fmt::Write;
use std::path::PathBuf;

/// Draw a netlist as a layout: GDSII or CIF.
///
/// Beams, plates, anchors, combs and facing beams become polygons on the masks of --process (polymumps unless given):
/// the layer as thick as they are. Names of nodes are labels at the nodes. Labels on the layer 255/0 (BIMORPH in CIF)
/// hold data that outlines cannot express, so that `bimorph convert` gives the same mechanism back. docs/reference/layouts.md
/// describes them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph layout examples/bank/bank.net --out bank.gds\n  \
    bimorph layout examples/bank/bank.net --set wh=2.2u --out bank.cif --process polymumps")]
pub(crate) struct LayoutCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// File to write; its extension says the format: .gds or .cif
    #[arg(long, short = 'o', value_name = "FILE")]
    out: PathBuf,

    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

impl LayoutCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let name = self.out.display().to_string();
        let Some(format) = LayoutFormat::of(&name) else {
            return Err(Failure::bad("--out", "a file that ends in .gds or .cif", format!("\"{name}\"")));
        };
        output::check_folder(&self.out)?;
        let process = match self.model.asked().process()? {
            Some(process) => process,
            None => Process::builtin(DEFAULT_PROCESS).map_err(bimorph::input::FrontError::from)?,
        };
        let drawn = self.model.draw()?;
        let mask = mask(&drawn.structure, &process, format, &name)?;
        let failed = |source| Failure::Write { path: self.out.clone(), source };
        atomic::write(&self.out, |out| out.write_all(&mask.bytes)).map_err(failed)?;
        if self.json {
            let document = serde_json::json!({
                "file": self.model.title(),
                "out": name,
                "process": process.name,
                "polygons": mask.polygons,
                "labels": mask.labels,
                "unit_m": mask.unit_m,
                "notes": mask.notes,
            });
            return output::print(&format!("{document}\n"));
        }
        let mut text = format!(
            "{name}: {} polygons and {} labels on the masks of {}, unit {:e} m\n",
            mask.polygons, mask.labels, process.name, mask.unit_m
        );
        for note in &mask.notes {
            let _ = writeln!(text, "  {note}");
        }
        output::print(&text)
    }
}
