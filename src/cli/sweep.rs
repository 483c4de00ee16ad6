//! `bimorph sweep`: many variants.

use super::failure::Failure;
use super::model::ModelArgs;
use super::output::print;
use super::random_parameters::SamplingArgs;
use super::remote::{RemoteSweepArgs, failure, follow};
use super::{interrupt, progress, sweep_files, sweep_output, value};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::journal::{self, Journal, JournalRow};
use bimorph::jobs::sweep::shard::SweepPart;
use bimorph::jobs::sweep::statistics::{SweepStatistics, YieldLimit};
use bimorph::jobs::sweep::{
    self, Shard, SweepAnalysis, SweepError, SweepParameter, SweepProgress, SweepSpec, SweepTable,
};
use bimorph::netlist::Bundle;
use bimorph::options::OptionValue;
use bimorph::options::analysis::{MODES_COUNT, PULL_IN_MAX, TRAN_STOP};
use clap::{Args, ValueEnum};
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::sync::OnceLock;

/// Run one analysis over a grid of parameter values, or over samples of parameters that vary, on all cores, here or on a server.
///
/// The table is CSV with one row for each point, in grid order whatever the number of cores; a point without a result
/// has its reason in the column "error". The shards of a sweep put together (`bimorph merge`) are the whole sweep; each of their rows says
/// in a last column "part" of which sweep it is.
///
/// With --out FILE.csv every finished point is stored in FILE.csv.journal until the table is written. After Ctrl-C, a
/// kill or a full disk the same command with --resume continues, and the table has the bytes of one uninterrupted run.
///
/// With --to the sweep is a job of a server. It continues after Ctrl-C, and when the connection is lost: `bimorph jobs`
/// lists it, attaches to it, and cancels it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph sweep examples/bank/bank.net --param wh=1.8u:2.2u:21 --port heat=2.2 --signals yoke.y --out w.csv\n  \
    bimorph sweep examples/bank/bank.net --param wh=1.8u:2.2u:21 --param comb=0,1 --analysis modes --count 3\n  \
    bimorph sweep examples/switch/switch.net --param touch=0.08u:0.12u:9 --analysis pullin --shard 0/4 --out part0.csv\n  \
    bimorph sweep examples/bank/bank.net --param wh=1.8u:2.2u:16 --analysis tran --stop 100u --port heat=2.2 --signals yoke.y\n  \
    bimorph sweep examples/bank/bank.net --vary wh=normal:2u:0.05u --samples 1000 --seed 7 --analysis modes --out mc.csv\n  \
    bimorph sweep examples/bank/bank.net --vary wh=normal:2u:0.05u --samples 1000 --seed 7 --port heat=2.2 --signals yoke.y \
      --limits 'yoke.y<-0.94u' --out mc.parquet --out mc.png\n  \
    bimorph sweep examples/bank/bank.net --param wh=1.8u:2.2u:5 --param heat.v=0:3:31 --signals yoke.y --out hv.csv\n  \
    printf 'wh\\n1.9u\\n2.1u\\n' > corners.csv\n  \
    bimorph sweep examples/bank/bank.net --points corners.csv --port heat=2.2 --signals yoke.y --out c.csv\n  \
    bimorph sweep examples/bank/bank.net --param option.tol=1e-2,1e-3,1e-4 --analysis modes\n  \
    bimorph sweep examples/bank/bank.net --param wh=1.8u:2.2u:201 --port heat=2.2 --signals yoke.y --out w.csv --resume")]
pub(crate) struct SweepCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// An axis of the grid, LOW:HIGH:COUNT or a list A,B,C: a netlist parameter, the voltage of a port (PORT.v), the motion of a driven anchor
    /// (NODE.ux, .uy, .urz), or an option of the model (option.tol). Repeatable; the last varies fastest
    #[arg(long = "param", value_name = "NAME=LOW:HIGH:COUNT", required_unless_present_any = ["vary", "points"])]
    parameters: Vec<String>,

    /// A list of points: a .csv file with names as of --param in its first row, and a row for each point. With --param and --vary: their
    /// grid and their samples at each of these points
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,

    #[command(flatten)]
    chance: SamplingArgs,

    /// Analysis at each point
    #[arg(long, value_enum, default_value_t = SweepAnalysisChoice::Static)]
    analysis: SweepAnalysisChoice,

    /// Modes: how many [default: 6]
    #[arg(long, short = 'n')]
    count: Option<usize>,

    /// Static: columns wanted, NODE.x, NODE.y, NODE.rz, PORT.i, PORT.q, BEAM.T, BEAM.stress, or sums such as a.x-0.5*b.x [default: every node]; tran: signals at the end
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Tran: end time [s]; the motion starts from rest
    #[arg(long, value_name = "SECONDS", value_parser = value::number, required_if_eq("analysis", "tran"))]
    stop: Option<f64>,

    /// Static, modes, tran: hold a port at a voltage [V]. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    /// Pull-in: port or voltage source to raise [default: the first]
    #[arg(long, value_name = "NAME")]
    source: Option<String>,

    /// Pull-in: highest voltage tried [V] [default: 200]
    #[arg(long, value_name = "VOLTS", value_parser = value::number, allow_negative_numbers = true)]
    max: Option<f64>,

    /// Run part I of N (I from 0) of the grid
    #[arg(long, value_name = "I/N", default_value = "0/1")]
    shard: String,

    /// Worker threads [default: one for each core]
    #[arg(long)]
    threads: Option<usize>,

    #[command(flatten)]
    remote: RemoteSweepArgs,

    /// Write the table to a .csv or .parquet file, or a picture of every result to an .svg, .png or .html file: histograms of samples, else
    /// curves over the last parameter. Repeatable [default: the table to standard output]
    #[arg(long, value_name = "FILE")]
    out: Vec<PathBuf>,

    /// Print statistics of every result, and the fraction of points that keep to this limit: NAME>NUMBER, with <, <=, > or >=. A point without
    /// a result is beyond it. Repeatable: the yield is of all of them
    #[arg(long, value_name = "LIMIT")]
    limits: Vec<YieldLimit>,

    /// Continue with the points in FILE.csv.journal, if there are any
    #[arg(long, requires = "out", conflicts_with = "to")]
    resume: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SweepAnalysisChoice {
    Static,
    Modes,
    Pullin,
    Tran,
}

impl SweepCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        sweep_files::check(&self.out)?;
        let spec = self.spec()?;
        sweep_files::check_limits(&spec, &self.limits)?;
        let (bundle, options) = (self.model.bundle()?, self.model.options()?);
        warn_of_netlist(&spec, &bundle, &options);
        if let Some(uri) = &self.remote.to {
            return self.there(uri, &spec, &bundle, &options);
        }
        let bar = progress::bar("sweep");
        let table = self.here(&spec, &bundle, &options, &bar);
        bar.finish_and_clear();
        let (table, journal) = table?;
        let part = (spec.shard.count > 1).then(|| SweepPart::of(&spec, &bundle, &options)).transpose()?;
        let written = self.deliver(&table, &spec, part.map(|part| part.to_string()).as_deref())?;
        // points that are in no table stay where they are
        if let Some(journal) = journal.filter(|_| written) {
            journal.finish()?;
        }
        sweep_output::nothing(&table)
    }

    /// The sweep on a server, as a job that survives this process.
    fn there(&self, uri: &str, spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) -> Result<(), Failure> {
        let (mut client, name) = self.remote.submit(uri, spec, bundle, options)?;
        if self.remote.detach {
            return print(&format!("{name}\n"));
        }
        let bar = progress::bar("sweep");
        let followed = follow(&mut client, uri, &name, &bar);
        bar.finish_and_clear();
        let (table, job) = followed?;
        if let Some(failure) = failure(uri, &job) {
            stderr_line!(
                "the rows that it has stay on the server: `bimorph jobs delete {name} --to {uri}` forgets them"
            );
            return Err(failure);
        }
        // the version in it is that of the server
        let part = Some(job.part.as_str()).filter(|part| !part.is_empty());
        let written = self.deliver(&table, spec, part).map(drop);
        // a table that could not be written is still there
        if let Err(error @ (Failure::Write { .. } | Failure::Stdout(_))) = written {
            stderr_line!("its rows are on the server: `bimorph jobs attach {name} --to {uri}` has them");
            return Err(error);
        }
        self.remote.forget(&mut client, &name);
        written?;
        sweep_output::nothing(&table)
    }

    /// Writes the table and says what it has; whether there was anything to write.
    fn deliver(&self, table: &SweepTable, spec: &SweepSpec, part: Option<&str>) -> Result<bool, Failure> {
        let Shard { index, count } = spec.shard;
        let shown = (spec.samples.is_some(), self.limits.as_slice());
        let written = sweep_files::deliver(&self.out, &self.model.title(), table, part, shown)?;
        let shard = part.map(|_| format!(" (shard {index}/{count})")).unwrap_or_default();
        stderr_line!("{}", sweep_output::summary(table, &shard));
        // where no point has a result there is no column to compare
        if !self.limits.is_empty() && table.failed() < table.rows.len() {
            stderr_line!("{}", sweep_files::report(&SweepStatistics::of(table, &self.limits)?, spec.samples.is_some()));
        }
        Ok(written)
    }

    /// The sweep in this process, each point kept in a journal where there will be a file.
    fn here(
        &self,
        spec: &SweepSpec,
        bundle: &Bundle,
        options: &CompileOptions,
        bar: &indicatif::ProgressBar,
    ) -> Result<(SweepTable, Option<Journal>), Failure> {
        sweep::check_names(spec, bundle, options)?;
        let Some(path) = self.journal() else {
            return Ok((sweep::run(spec, bundle, options, &|p| report(bar, p))?, None));
        };
        let (journal, known) = Journal::open(&path, &journal::name(spec, bundle, options), self.resume)?;
        if journal.damaged() > 0 {
            let (lines, path) = (journal.damaged(), path.display());
            bar.suspend(|| stderr_line!("{path}: {lines} of its lines are damaged: their points are computed again"));
        }
        if !known.is_empty() {
            bar.suspend(|| stderr_line!("{} points are there from before", known.len()));
        }
        let refused = OnceLock::new();
        let keep = |kept: &JournalRow| journal.keep(kept).map_err(|error| refused.set(error)).is_ok();
        let table = sweep::run_on(spec, bundle, options, known, Some(&keep), &|p| report(bar, p));
        if let Some(error) = refused.into_inner() {
            return Err(error.into());
        }
        match table {
            Err(SweepError::Cancelled { done, points }) => {
                bar.suspend(|| {
                    stderr_line!("{done} of {points} points are in {}: continue with --resume", path.display())
                });
                Err(Failure::Interrupted)
            }
            table => Ok((table?, Some(journal))),
        }
    }

    /// FILE.csv.journal beside FILE.csv; none for pictures alone, and for a pipe or a device, which keeps nothing.
    fn journal(&self) -> Option<PathBuf> {
        let out = sweep_files::table_file(&self.out).filter(|out| !out.exists() || out.is_file())?;
        let mut name = out.file_name()?.to_owned();
        name.push(".journal");
        Some(out.with_file_name(name))
    }

    fn spec(&self) -> Result<SweepSpec, Failure> {
        let axes = self.parameters.iter().map(|text| text.parse()).collect::<Result<Vec<SweepParameter>, _>>()?;
        let parameters = [self.listed()?, axes].concat();
        self.check_use()?;
        let count = self.count.unwrap_or(MODES_COUNT.count());
        let max = self.max.unwrap_or(PULL_IN_MAX.number());
        MODES_COUNT.check(&OptionValue::Count(count))?;
        PULL_IN_MAX.check(&OptionValue::Number(max))?;
        let analysis = match self.analysis {
            SweepAnalysisChoice::Static => {
                SweepAnalysis::Static { outputs: value::names(&self.signals), voltages: self.ports.clone() }
            }
            SweepAnalysisChoice::Modes => SweepAnalysis::Modes { count, voltages: self.ports.clone() },
            SweepAnalysisChoice::Pullin => SweepAnalysis::PullIn { port: self.source.clone(), max },
            SweepAnalysisChoice::Tran => {
                let stop = self.stop.unwrap_or_default();
                TRAN_STOP.check(&OptionValue::Number(stop))?;
                let outputs = value::names(&self.signals);
                if outputs.is_empty() {
                    return Err(Failure::bad("--signals", "at least one signal, such as yoke.y", "none".to_owned()));
                }
                SweepAnalysis::Transient { stop, outputs, voltages: self.ports.clone() }
            }
        };
        let (samples, shard) = (self.chance.samples()?, self.shard.parse::<Shard>()?);
        let spec = SweepSpec { parameters, samples, analysis, shard, threads: self.threads };
        spec.point_numbers()?;
        Ok(spec)
    }

    /// The points of --points.
    fn listed(&self) -> Result<Vec<SweepParameter>, Failure> {
        let Some(path) = &self.points else { return Ok(Vec::new()) };
        let text = std::fs::read_to_string(path).map_err(|source| Failure::Read { path: path.clone(), source })?;
        Ok(sweep::points(&path.display().to_string(), &text)?)
    }

    /// Refuses what the analysis would ignore.
    fn check_use(&self) -> Result<(), Failure> {
        use SweepAnalysisChoice::{Modes, Pullin, Static, Tran};
        let given: [(&str, bool, &[SweepAnalysisChoice]); 6] = [
            ("--count", self.count.is_some(), &[Modes]),
            ("--signals", !self.signals.is_empty(), &[Static, Tran]),
            ("--stop", self.stop.is_some(), &[Tran]),
            ("--port", !self.ports.is_empty(), &[Static, Modes, Tran]),
            ("--source", self.source.is_some(), &[Pullin]),
            ("--max", self.max.is_some(), &[Pullin]),
        ];
        let name = |analysis: &SweepAnalysisChoice| {
            analysis.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
        };
        if let Some((option, _, of)) = given.iter().find(|(_, given, of)| *given && !of.contains(&self.analysis)) {
            let expected = of.iter().map(name).collect::<Vec<_>>().join(" or ");
            return Err(Failure::bad(
                option,
                format!("--analysis {expected} beside it").as_str(),
                name(&self.analysis),
            ));
        }
        if self.threads.is_some() && self.remote.to.is_some() {
            return Err(Failure::bad(
                "--threads",
                "a sweep in this process",
                "--to, where the server decides".to_owned(),
            ));
        }
        Ok(())
    }
}

/// Shows what the netlist is warned of at the first point; the points themselves are checked one by one.
fn warn_of_netlist(spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) {
    if let Ok(drawn) = sweep::first_drawn(spec, bundle, options)
        && !drawn.warnings.items.is_empty()
    {
        stderr_text!("{}", drawn.warnings.render(io::stderr().is_terminal()));
    }
}

fn report(bar: &indicatif::ProgressBar, progress: SweepProgress) -> bool {
    bar.set_length(progress.points);
    bar.set_position(progress.done);
    !interrupt::asked()
}
