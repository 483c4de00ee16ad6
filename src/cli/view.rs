//! `bimorph view`: the live bench.

use super::convert_picture::{MAX_POLYGONS, shift};
use super::failure::Failure;
use super::model::{ModelArgs, front_telling};
use super::output::{check_folder, print, write_page};
use super::value;
use bimorph::layout::LayoutFormat;
use bimorph::layout::convert::Converted;
use bimorph::layout::drawing::FlatLayout;
use bimorph::netlist::NetlistSource;
use bimorph::view::{Bench, BenchOptions, LayoutGround, ViewServer};
use clap::Args;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// A page on which the device moves while its parameters are turned.
///
/// The page has a slider for each parameter of the netlist and each port, and tabs for statics, modes, paths, transients, responses, circuits and yield.
/// It is served on this machine alone, at an address with a secret token, which is printed and opened in the browser. Ctrl-C ends it. The netlist file is
/// written only where the page is asked to save it.
///
/// A comment behind a `param` may give its unit and range: `param w = 2u % width of the beams [m] [1.5u:3u]`. Other ranges are ± 50 %.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph view examples/comb_resonator/comb_resonator.net\n  \
    bimorph view examples/switch/switch.net --port drive=12 --no-browser\n  \
    bimorph view examples/bank/bank.net --port heat=2.2 --export bank.html     # one file with its animations, for others")]
pub(crate) struct ViewCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Begin with a port at a voltage [V]; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    /// Print the address only; do not open the browser
    #[arg(long)]
    no_browser: bool,

    /// Port of the address on this machine [default: any that is free]
    #[arg(long, value_name = "NUMBER", default_value_t = 0, hide_default_value = true)]
    listen: u16,

    /// End when standard input ends, as with the process that started this one
    #[arg(long, conflicts_with = "export")]
    while_stdin: bool,

    /// Write a self-contained page with the results of this state and their animations, and end
    #[arg(long, value_name = "FILE")]
    export: Option<PathBuf>,
}

impl ViewCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        if let Some(path) = &self.export {
            check_folder(path)?;
        }
        if let Some(path) = &self.export {
            let compiled = self.model.compile_with_ranges()?;
            return write_page(path, &Bench::new(self.bench()?).export(&compiled));
        }
        let bench = Bench::new(self.bench()?);
        let server = ViewServer::bind(bench, self.listen)?;
        let url = server.url();
        print(&format!("{url}\n"))?;
        stderr_line!("the bench is at this address, on this machine alone; Ctrl-C ends it");
        if !self.no_browser {
            open(&url);
        }
        if self.while_stdin {
            std::thread::spawn(end_with_stdin);
        }
        server.run();
        Ok(())
    }

    fn bench(&self) -> Result<BenchOptions, Failure> {
        let file = self.model.file().to_owned();
        let options = self.model.options_with_ranges()?;
        let voltages = self.ports.clone();
        if LayoutFormat::of(&file.display().to_string()).is_none() {
            let bundle = self.model.bundle()?;
            return Ok(BenchOptions { file, bundle, options, voltages, layout: None });
        }
        let (drawing, source) = front_telling(&file, &self.model.asked())?;
        let layout = match &source.converted {
            Some(converted) => {
                let drawn = bimorph::compile::draw(&NetlistSource::new(&source.bundle), &options)?;
                ground(&drawing, converted, shift(converted, &drawn.structure))
            }
            None => LayoutGround::default(),
        };
        Ok(BenchOptions { file, bundle: source.bundle, options, voltages, layout: Some(layout) })
    }
}

/// The polygons of a layout in the coordinates of its netlist (m).
fn ground(drawing: &FlatLayout, converted: &Converted, shift: [f64; 2]) -> LayoutGround {
    for note in &converted.report.notes {
        stderr_line!("warning: {note}");
    }
    let place = |p: &[i32; 2]| [0, 1].map(|i| f64::from(p[i]) * drawing.unit_m - shift[i]);
    let mut left = MAX_POLYGONS;
    let layer = |(name, polygons): (&String, &Vec<bimorph::layout::drawing::Polygon>)| {
        let taken = polygons.len().min(left);
        left -= taken;
        let contours = polygons[..taken].iter().flat_map(|p| &p.contours);
        (name.clone(), contours.map(|contour| contour.iter().map(place).collect()).collect())
    };
    LayoutGround { layers: drawing.layers.iter().map(layer).collect() }
}

/// Ends the process when standard input ends.
fn end_with_stdin() {
    let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
    std::process::exit(0);
}

/// Opens the address in the browser of the desktop, where there is one.
fn open(url: &str) {
    let named = std::env::var_os("BROWSER").filter(|name| !name.is_empty());
    let desktop = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    if named.is_none() && !desktop {
        return;
    }
    let program = named.unwrap_or_else(|| "xdg-open".into());
    let quiet = || Stdio::null();
    let opened = Command::new(program).arg(url).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn();
    if opened.is_err() {
        stderr_line!("no browser could be opened; open the address yourself");
    }
}
