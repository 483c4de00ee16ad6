//! `bimorph pullin`: where the gap closes, and where it opens again.

use super::failure::Failure;
use super::model::{Context, ModelArgs, warn_of, warn_of_mesh};
use super::output::OutputArgs;
use super::{progress, report, value};
use bimorph::analysis::mesh::pull_in_fitted;
use bimorph::analysis::pull_in::PullInResult;
use bimorph::options::OptionValue;
use bimorph::options::analysis::PULL_IN_MAX;
use bimorph::results::plot::axis::quantity;
use bimorph::results::table::Table;
use clap::Args;
use serde::Serialize;

/// Pull-in and release voltage of a gap.
///
/// The equilibrium is followed up to where it loses its stability and a gap closes, and down again to where the last closed
/// gap opens. Where the closed part snaps further below --max, the way down begins beyond that. JSON: "pull_in_v" [V]; "release_v" [V], null
/// when it stays closed at 0 V; "snaps_v": voltages of further snaps; "release_before_snaps_v": release without those; "held": false when
/// no contact holds it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph pullin examples/switch/switch.net --max 50\n  \
    bimorph pullin examples/switch/switch.net --source drive --set touch=0.15u --json")]
pub(crate) struct PullInCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Port or voltage source to raise [default: the first port, else the first source]
    #[arg(long, value_name = "NAME")]
    source: Option<String>,

    /// Highest voltage tried [V]
    #[arg(long, default_value_t = PULL_IN_MAX.number(), value_name = "VOLTS", value_parser = value::number, allow_negative_numbers = true)]
    max: f64,

    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct PullInDocument<'a> {
    #[serde(flatten)]
    result: &'a PullInResult,
    max_v: f64,
    #[serde(flatten)]
    context: Context<'a>,
}

impl PullInCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        if self.output.format().is_some_and(|f| !f.is_table()) {
            let hint = "write .csv or .raw";
            return Err(Failure::NoSuchOutput { what: "pullin", kind: "picture", hint });
        }
        PULL_IN_MAX.check(&OptionValue::Number(self.max))?;
        let compiled = self.model.compile()?;
        let busy = progress::spinner("pull-in");
        let drawn = compiled;
        let result = pull_in_fitted(&drawn, self.source.as_deref(), self.max);
        busy.finish_and_clear();
        let (compiled, result) = result?;
        warn_of_mesh(&drawn, &compiled);
        warn_of(&result.warnings);
        let none = if result.held { "none: it stays closed" } else { "none: nothing holds the part beyond pull-in" };
        let release = result.release_v.map_or(none.to_owned(), |v| quantity(v, "V"));
        let text = format!(
            "port     {}\npull-in  {}\nrelease  {release}\n\n{}",
            result.port,
            quantity(result.pull_in_v, "V"),
            report::options(&compiled)
        );
        let document = PullInDocument {
            result: &result,
            max_v: self.max,
            context: self.model.context(&compiled).with(&result.warnings),
        };
        let table = || {
            let mut table = Table::new(self.model.title(), "Pull-in");
            table.push_real("pull_in", "V", vec![result.pull_in_v])?;
            // without a release it says whether something holds the part
            table.push_real("release", "V", vec![result.release_v.unwrap_or(f64::NAN)])?;
            table.push_real("held", "", vec![f64::from(u8::from(result.held))])?;
            Ok(table)
        };
        let picture = || Err(Failure::NoSuchOutput { what: "pullin", kind: "picture", hint: "write .csv or .raw" });
        self.output.finish(table, picture, &document, &text)
    }
}
