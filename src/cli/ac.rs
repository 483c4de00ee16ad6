//! `bimorph ac`: the response to a small sinusoid at every frequency.

use super::ac_report::{picture, table, text};
use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs, warn_of, warn_of_mesh};
use super::output::OutputArgs;
use super::{progress, report, value};
use bimorph::analysis::harmonic::grid::Spacing;
use bimorph::analysis::harmonic::{HarmonicOptions, Root};
use bimorph::analysis::mesh::harmonic_fitted;
use bimorph::options::analysis::{AC_FROM, AC_MODES, AC_POINTS, AC_TO};
use bimorph::options::{OptionDescription, OptionValue};
use clap::Args;
use serde::Serialize;

/// Frequency response about the operating point: magnitude and phase of what a small sinusoid at one place does.
///
/// Drive: NODE.fx, NODE.fy [N], NODE.m [N·m], NODE.ux, .uy [m] or .urz [rad] of a driven anchor, a port of the netlist [V], BEAM.T (heat) [W], frame.ax, frame.ay [m/s²],
/// frame.wz [rad/s]. Signals: those of `tran` over the unit of the drive, and PORT.i [A], the current into a port.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph ac examples/bank/bank.net --drive yoke.fy --signals yoke.y --from 10k --to 1M --out bank.png\n  \
    # the current that 1 V of a sinusoid drives into the port at a bias of 10 V, and the motion\n  \
    bimorph ac examples/comb_resonator/comb_resonator.net --drive drive --signals drive.i,shuttle.x --port drive=10 --from 1k --to 100k\n  \
    bimorph ac examples/comb_resonator/comb_resonator.net --drive frame.ax --signals shuttle.x --from 1 --to 100k --points 20 --per-decade\n  \
    bimorph ac examples/bank/bank.net --drive yoke.fy --signals yoke.y --from 80k --to 90k --points 201 --linear-scale --even --json")]
pub(crate) struct AcCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Input: NODE.fx, NODE.fy, NODE.m, NODE.ux, .uy or .urz of a driven anchor, a port, BEAM.T, frame.ax, frame.ay or frame.wz
    #[arg(long, short = 'd', value_name = "NAME")]
    drive: String,

    /// Output signals, PORT.i among them, or sums such as top.C-0.5*bot.C: a,b or repeated [default: the output at the driven place itself]
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Lowest frequency [Hz], such as 1k
    #[arg(long, value_name = "HZ", value_parser = value::number, allow_negative_numbers = true)]
    from: f64,

    /// Highest frequency [Hz], such as 1M
    #[arg(long, value_name = "HZ", value_parser = value::number, allow_negative_numbers = true)]
    to: f64,

    /// Frequencies of the even grid, both ends included; more are added about resonances and zeros
    #[arg(long, short = 'n', default_value_t = AC_POINTS.count())]
    points: usize,

    /// --points is the number in a decade
    #[arg(long, conflicts_with = "linear_scale")]
    per_decade: bool,

    /// Equal differences of frequency instead of equal quotients (--linear is about the model: small displacements)
    #[arg(long)]
    linear_scale: bool,

    /// No points about resonances and zeros: exactly those of the even grid
    #[arg(long)]
    even: bool,

    /// As a sum over modes with static correction instead of exactly at each frequency, with its deviation from that
    #[arg(long)]
    by_modes: bool,

    /// Of a sum over modes: how many, from the lowest [default: those to twice the highest frequency]
    #[arg(long, value_name = "N", requires = "by_modes")]
    modes: Option<usize>,

    /// Operating point: hold a port at a voltage [V]; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    #[command(flatten)]
    output: OutputArgs,
}

/// Samples of one signal.
#[derive(Debug, Serialize)]
struct ComplexSamples {
    re: Vec<f64>,
    im: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct RootShown {
    re: f64,
    im: f64,
    frequency_hz: f64,
    quality: Option<f64>,
    width_hz: f64,
}

impl From<&Root> for RootShown {
    fn from(root: &Root) -> Self {
        Self {
            re: root.re,
            im: root.im,
            frequency_hz: root.frequency_hz(),
            quality: root.quality(),
            width_hz: root.width_hz(),
        }
    }
}

#[derive(Debug, Serialize)]
struct HarmonicDocument<'a> {
    drive: &'a str,
    drive_unit: &'a str,
    frequencies_hz: &'a [f64],
    signals: JsonMap<'a, ComplexSamples>,
    units: JsonMap<'a, String>,
    at_rest: JsonMap<'a, Option<f64>>,
    poles: Option<Vec<RootShown>>,
    zeros: JsonMap<'a, Option<Vec<RootShown>>>,
    points_added: usize,
    modes: Option<usize>,
    modal_error: Option<f64>,
    unknowns: usize,
    port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl AcCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        let options = self.request()?;
        let drawn = self.model.compile()?;
        let bar = progress::bar("ac");
        let advice = "fewer --points, a larger --tol, or --by-modes cost less";
        let result = harmonic_fitted(&drawn, &options, &mut progress::watch(&bar, advice));
        bar.finish_and_clear();
        let (compiled, result) = result?;
        warn_of_mesh(&drawn, &compiled);
        warn_of(&result.warnings);
        let of = |f: &dyn Fn(&[f64; 2]) -> f64, values: &[[f64; 2]]| values.iter().map(f).collect::<Vec<f64>>();
        let (mut signals, mut units, mut at_rest, mut zeros) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for signal in &result.signals {
            let name = signal.name.clone();
            signals.push((
                name.clone(),
                ComplexSamples { re: of(&|v| v[0], &signal.values), im: of(&|v| v[1], &signal.values) },
            ));
            units.push((name.clone(), signal.unit.clone()));
            at_rest.push((name.clone(), signal.at_rest));
            zeros
                .push((name, signal.zeros.as_ref().map(|zeros| zeros.iter().map(RootShown::from).collect::<Vec<_>>())));
        }
        let document = HarmonicDocument {
            drive: &result.drive,
            drive_unit: &result.drive_unit,
            frequencies_hz: &result.frequencies_hz,
            signals: JsonMap(&signals),
            units: JsonMap(&units),
            at_rest: JsonMap(&at_rest),
            poles: result.poles.as_ref().map(|poles| poles.iter().map(RootShown::from).collect()),
            zeros: JsonMap(&zeros),
            points_added: result.added,
            modes: result.modes,
            modal_error: result.modal_error,
            unknowns: result.unknowns,
            port_voltages_v: JsonMap(&self.ports),
            context: self.model.context(&compiled).with(&result.warnings),
        };
        let title = format!("{}: {} [{}]", self.model.title(), result.drive, result.drive_unit);
        let text = text(&result) + &report::footing(&compiled, result.unknowns);
        self.output.finish(
            || table(&title, &result),
            || Ok(picture(&title, &result, self.linear_scale)),
            &document,
            &text,
        )
    }

    /// The request, each option within its range.
    fn request(&self) -> Result<HarmonicOptions, Failure> {
        let given: [(&OptionDescription, OptionValue); 4] = [
            (&AC_FROM, OptionValue::Number(self.from)),
            (&AC_TO, OptionValue::Number(self.to)),
            (&AC_POINTS, OptionValue::Count(self.points)),
            (&AC_MODES, self.modes.map_or(OptionValue::Unset, OptionValue::Count)),
        ];
        for (option, value) in given {
            option.check(&value)?;
        }
        let spacing = match (self.per_decade, self.linear_scale) {
            (true, _) => Spacing::PerDecade,
            (_, true) => Spacing::Linear,
            _ => Spacing::Logarithmic,
        };
        let options = HarmonicOptions {
            drive: self.drive.clone(),
            signals: value::names(&self.signals),
            from: self.from,
            to: self.to,
            points: self.points,
            spacing,
            even: self.even,
            by_modes: self.by_modes,
            modes: self.modes,
            voltages: self.ports.clone(),
        };
        options.check()?;
        Ok(options)
    }
}
