//! `bimorph modes`: how it rings.

use super::failure::Failure;
use super::model::{Context, ModelArgs, Named};
use super::output::OutputArgs;
use super::{progress, report, statics, value};
use bimorph::analysis::modes::{ModesResult, modes};
use bimorph::analysis::statics::NodeMotion;
use bimorph::compile::Compiled;
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::mechanism::{self, Drawing, Scale};
use bimorph::results::plot::{stack, svg::Picture};
use bimorph::results::table::Table;
use clap::Args;
use serde::Serialize;

/// Shapes drawn in one picture.
const MOST_SHAPES: usize = 6;

/// Natural frequencies and mode shapes about the operating point, without damping.
///
/// JSON: "frequencies_hz" ascending [Hz]; "shapes": for each mode the displacement of every node, the largest
/// translation being 1; "residuals": |Kx - λMx| / |Kx|.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  bimorph modes bank.net --count 10 --band 1.3M\n  \
                        bimorph modes bank.net --port sense=40 --json      about the equilibrium at 40 V\n  \
                        bimorph modes bank.net --count 4 --out shapes.png")]
pub(crate) struct Modes {
    #[command(flatten)]
    model: ModelArgs,

    /// How many modes, from the lowest
    #[arg(long, short = 'n', default_value_t = 6)]
    count: usize,

    /// Hold a port at a voltage [V]; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct Document<'a> {
    frequencies_hz: &'a [f64],
    shapes: Vec<Named<'a, NodeMotion>>,
    residuals: &'a [f64],
    unknowns: usize,
    port_voltages_v: Named<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl Modes {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        if self.count == 0 {
            return Err(Failure::bad("--count", "at least one mode", "0"));
        }
        let compiled = self.model.compile()?;
        let busy = progress::spinner("modes");
        let result = modes(&compiled, self.count, &self.ports);
        busy.finish_and_clear();
        let result = result?;
        let document = Document {
            frequencies_hz: &result.frequencies_hz,
            shapes: result.shapes.iter().map(|shape| Named(shape)).collect(),
            residuals: &result.residuals,
            unknowns: result.unknowns,
            port_voltages_v: Named(&self.ports),
            context: self.model.context(&compiled),
        };
        let title = self.model.title();
        let rows: Vec<Vec<String>> = result
            .frequencies_hz
            .iter()
            .zip(&result.residuals)
            .enumerate()
            .map(|(i, (f, r))| vec![(i + 1).to_string(), quantity(*f, "Hz"), format!("{r:.1e}")])
            .collect();
        let text = report::columns(&["mode", "frequency", "residual"], &rows)
            + "\n"
            + &report::footing(&compiled, result.unknowns);
        self.output.finish(|| table(&title, &result), || Ok(picture(&compiled, &title, &result)), &document, &text)
    }
}

fn table(title: &str, result: &ModesResult) -> Result<Table, Failure> {
    let mut table = Table::new(title, "Modes");
    table.push_real("mode", "", (1..=result.frequencies_hz.len()).map(|k| k as f64).collect())?;
    table.push_real("frequency", "Hz", result.frequencies_hz.clone())?;
    table.push_real("residual", "", result.residuals.clone())?;
    Ok(table)
}

fn picture(compiled: &Compiled, title: &str, result: &ModesResult) -> Picture {
    let shapes = result.shapes.iter().zip(&result.frequencies_hz).enumerate().take(MOST_SHAPES);
    let drawings: Vec<Picture> = shapes
        .map(|(i, (shape, frequency))| {
            mechanism::draw(&Drawing {
                structure: &compiled.structure,
                title: &format!("{title}: mode {}, {}", i + 1, quantity(*frequency, "Hz")),
                motion: &statics::motion(compiled, shape),
                temperatures: &[],
                scale: Scale::Shape,
            })
        })
        .collect();
    stack(&drawings)
}
