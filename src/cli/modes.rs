//! `bimorph modes`: how it rings.

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs, warn_of, warn_of_mesh};
use super::output::OutputArgs;
use super::solver::ModelChoice;
use super::{progress, report, statics, value};
use bimorph::analysis::BeamMotions;
use bimorph::analysis::frame::{frame, frame_modes};
use bimorph::analysis::mesh::modes_fitted;
use bimorph::analysis::mode_quality::{ModeLoss, mode_losses};
use bimorph::analysis::modes::ModesResult;
use bimorph::analysis::statics::NodeMotion;
use bimorph::compile::CompiledModel;
use bimorph::options::OptionValue;
use bimorph::options::analysis::MODES_COUNT;
use bimorph::results::format::ResultFormat;
use bimorph::results::plot::animation::{self, AnimationFrame, Play};
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::mechanism::{self, DisplacementScale, MechanismFigure};
use bimorph::results::plot::svg::Picture;
use bimorph::results::table::Table;
use clap::Args;
use serde::Serialize;

/// Shapes drawn in one picture.
const MAX_SHAPES: usize = 12;

/// Natural frequencies and mode shapes about the operating point, without damping.
///
/// JSON: "frequencies_hz". "signals": by name "re" and "im", null where an undamped resonance has no bound. "units" and
/// "at_rest": by name. "poles" and, by name, "zeros": "re", "im" [rad/s], "frequency_hz", "quality" (null: undamped),
/// "width_hz". "points_added": points about resonances and zeros. "modes" and "modal_error": with --by-modes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph modes examples/bank/bank.net --count 10 --band 1.3M\n  \
    bimorph modes examples/bank/bank.net --port sense=40 --json      # about the equilibrium at 40 V\n  \
    bimorph modes examples/bank/bank.net --count 4 --out shapes.png")]
pub(crate) struct ModesCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// How many modes, from the lowest
    #[arg(long, short = 'n', default_value_t = MODES_COUNT.count())]
    count: usize,

    /// Hold a port at a voltage [V], or a driven anchor at NODE.ux, .uy [m] or .urz [rad]; others are at 0. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    /// Quality factors, with the parts of drag, gas in gaps, heat flow across bent beams, resistances and anchors
    #[arg(long)]
    quality: bool,

    /// Solver: the product's own model, or the baseline to compare with [default: recursion; frame with --as-sugar]
    #[arg(long, value_enum, help_heading = "Research and comparison", hide_short_help = true)]
    solver: Option<ModelChoice>,

    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct ModesDocument<'a> {
    frequencies_hz: &'a [f64],
    shapes: Vec<JsonMap<'a, NodeMotion>>,
    residuals: &'a [f64],
    estimated_errors: &'a [Option<f64>],
    unknowns: usize,
    /// With --quality: 1/Q of each mode by cause.
    #[serde(skip_serializing_if = "Option::is_none")]
    losses: Option<&'a [ModeLoss]>,
    /// Largest displacement of a node at the equilibrium that the modes are about [m].
    deflection_m: f64,
    solver: ModelChoice,
    port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl ModesCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        MODES_COUNT.check(&OptionValue::Count(self.count))?;
        // SUGAR's modes are those of one cubic element for each beam
        let usual = if self.model.options()?.as_sugar { ModelChoice::Frame } else { ModelChoice::Recursion };
        let solver = self.solver.unwrap_or(usual);
        let drawn = match solver {
            ModelChoice::Recursion => self.model.compile()?,
            ModelChoice::Frame => self.model.compile_frame()?,
        };
        let busy = progress::spinner("modes");
        let result = match solver {
            ModelChoice::Recursion => modes_fitted(&drawn, self.count, &self.ports),
            ModelChoice::Frame => frame(&drawn)
                .and_then(|frame| frame_modes(&drawn, &frame, self.count, &self.ports))
                .map(|(result, curves)| (drawn.clone(), result, curves)),
        };
        busy.finish_and_clear();
        let (compiled, result, curves) = result?;
        warn_of_mesh(&drawn, &compiled);
        warn_of(&result.warnings);
        let losses = match (self.quality, solver) {
            (false, _) => None,
            (true, ModelChoice::Recursion) => Some(mode_losses(&compiled, self.count, &self.ports)?),
            (true, ModelChoice::Frame) => {
                warn_of(&["--quality needs the product's own model: leave out --solver and --as-sugar".to_owned()]);
                None
            }
        };
        let document = ModesDocument {
            losses: losses.as_deref(),
            frequencies_hz: &result.frequencies_hz,
            shapes: result.shapes.iter().map(|shape| JsonMap(shape)).collect(),
            residuals: &result.residuals,
            estimated_errors: &result.errors,
            unknowns: result.unknowns,
            deflection_m: result.deflection_m,
            solver,
            port_voltages_v: JsonMap(&self.ports),
            context: self.model.context(&compiled).with(&result.warnings),
        };
        let title = self.model.title();
        let rows: Vec<Vec<String>> = result
            .frequencies_hz
            .iter()
            .zip(&result.residuals)
            .enumerate()
            .map(|(i, (f, r))| {
                let error = result.errors[i].map_or("–".into(), |e| format!("{e:.1e}"));
                vec![(i + 1).to_string(), quantity(*f, "Hz"), error, format!("{r:.1e}")]
            })
            .collect();
        let text = report::columns(&["mode", "frequency", "error", "residual"], &rows)
            + "\n"
            + &losses.as_deref().map_or(String::new(), qualities)
            + &about(result.deflection_m)
            + &report::footing(&compiled, result.unknowns);
        if self.output.format() == Some(ResultFormat::Html) {
            return self.output.finish_page(|| page(&compiled, &title, &result, &curves), &document, &text);
        }
        self.output.finish(
            || table(&title, &result),
            || Ok(picture(&compiled, &title, &result, &curves)),
            &document,
            &text,
        )
    }
}

/// Q of each mode with the percentages of its causes in 1/Q.
fn qualities(losses: &[ModeLoss]) -> String {
    let row = |(k, loss): (usize, &ModeLoss)| {
        let quality = loss.quality();
        let shown = if quality.is_finite() { format!("{quality:.4}") } else { "undamped".into() };
        let part = |part: f64| if part > 0.0 { format!("{:.1} %", 100.0 * part * quality) } else { "–".into() };
        let parts = [loss.drag, loss.gas, loss.thermoelastic, loss.electrical, loss.anchors];
        [(k + 1).to_string(), shown].into_iter().chain(parts.map(part)).collect()
    };
    let rows: Vec<Vec<String>> = losses.iter().enumerate().map(row).collect();
    report::columns(&["mode", "Q", "drag", "gas in gaps", "thermoelastic", "electrical", "anchors"], &rows) + "\n"
}

/// Reference state of the modes, where it is not the drawing.
fn about(deflection: f64) -> String {
    if deflection > 0.0 {
        format!("about the equilibrium, {} away from the drawing\n", quantity(deflection, "m"))
    } else {
        String::new()
    }
}

fn table(title: &str, result: &ModesResult) -> Result<Table, Failure> {
    let mut table = Table::new(title, "Modes");
    table.push_real("mode", "", (1..=result.frequencies_hz.len()).map(|k| k as f64).collect())?;
    table.push_real("frequency", "Hz", result.frequencies_hz.clone())?;
    let errors = result.errors.iter().map(|error| error.unwrap_or(f64::NAN)).collect();
    table.push_real("error", "", errors)?;
    table.push_real("residual", "", result.residuals.clone())?;
    Ok(table)
}

/// Title of a mode.
fn name(index: usize, frequency: f64) -> String {
    format!("{}: {}", index + 1, quantity(frequency, "Hz"))
}

fn picture(compiled: &CompiledModel, title: &str, result: &ModesResult, curves: &[BeamMotions]) -> Picture {
    let names: Vec<String> = result.frequencies_hz.iter().enumerate().map(|(i, f)| name(i, *f)).collect();
    let motions: Vec<_> = result.shapes.iter().map(|shape| statics::motion(compiled, shape)).collect();
    let curves: Vec<_> = curves.iter().map(statics::beams).collect();
    let drawings: Vec<MechanismFigure<'_>> = (names.iter().zip(&motions).zip(&curves).take(MAX_SHAPES))
        .map(|((title, motion), curves)| MechanismFigure {
            structure: &compiled.structure,
            title,
            motion,
            curves,
            temperatures: &[],
            scale: DisplacementScale::Shape,
        })
        .collect();
    mechanism::grid(title, &drawings)
}

/// The modes swinging. Their displacements stand for no length: the largest of each becomes a micrometre.
fn page(compiled: &CompiledModel, title: &str, result: &ModesResult, curves: &[BeamMotions]) -> String {
    let frames = result.shapes.iter().zip(&result.frequencies_hz).zip(curves).enumerate();
    let frames: Vec<AnimationFrame> = frames
        .map(|(k, ((shape, frequency), curves))| {
            let (mut nodes, mut curves) = (statics::motion(compiled, shape), statics::beams(curves));
            let all = || nodes.iter().chain(curves.iter().flatten());
            let largest = all().map(|[x, y, _]| x.hypot(*y)).fold(f64::MIN_POSITIVE, f64::max);
            nodes.iter_mut().chain(curves.iter_mut().flatten()).for_each(|m| *m = m.map(|x| 1e-6 * x / largest));
            AnimationFrame { label: name(k, *frequency), nodes, curves }
        })
        .collect();
    animation::page(&compiled.structure, title, Play::Modes, &frames)
}
