//! `bimorph cosim`: a circuit with mechanisms in it.

use super::cosim_netlist::{NetlistArgs, is_netlist};
use super::credentials::AccessArgs;
use super::failure::Failure;
use super::output::{check_folder, write};
use super::plot::{chart_of, longest};
use super::{cosim_check, interrupt, progress};
use bimorph::cosim::check::check;
use bimorph::cosim::{CosimError, CosimOptions, run};
use bimorph::results::format::ResultFormat;
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Run ngspice on a deck with the plug-in loaded.
///
/// ngspice's own output is passed on. It runs in the working directory, as it always does; netlists named by a deck are
/// found beside it. Nothing is written under the name of --out unless the run is good.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph cosim examples/bank/bank.cir --out bank.raw\n  \
    bimorph cosim examples/bank/bank.cir --out bank.png              # every voltage and current of the analysis in the deck\n  \
    bimorph cosim examples/comb_resonator/comb_resonator.net --tran '0.1u 10u' --drive 'drive=PULSE(0 4 1u 1u)' --check     # error of steps and tolerances\n  \
    bimorph cosim examples/comb_resonator/comb_resonator.net --tran '0.1u 10u' --drive 'drive=PULSE(0 4 1u 1u)' --out comb.png\n  \
    bimorph cosim examples/comb_resonator/comb_resonator.net --port drive=10 --ac 'dec 20 1k 1meg' --emit comb.cir\n\n\
    A device in a deck:\n  \
    .model bank bimorph(file=\"bank.net\" ports=[\"heat\" \"sense\"] monitors=[\"yoke.y:1e6\"])\n  \
    A1 %gd [heat 0 sense 0] %v [y] bank")]
pub(crate) struct CosimCommand {
    /// ngspice deck; or a netlist (.net), which becomes a deck around its device with the circuit that it draws
    deck: PathBuf,

    /// Step every model of the deck on a server: unix:///path, host:port or https://host:port [default: as the deck says]
    #[arg(long, value_name = "URI")]
    remote: Option<String>,

    #[command(flatten)]
    access: AccessArgs,

    /// Write the waveforms: .raw, .csv, .svg, .png or .html
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Repeat the run with half the steps, a tenth of the tolerances (reltol, and tol of every model) and twice the
    /// segments, and print the difference
    #[arg(long)]
    check: bool,

    /// With --check: print one JSON document in place of ngspice's output and the table
    #[arg(long, requires = "check")]
    json: bool,

    /// Do not pass ngspice's output on
    #[arg(long, short)]
    quiet: bool,

    /// ngspice program [default: the first in PATH]
    #[arg(long, value_name = "PATH", env = "NGSPICE")]
    ngspice: Option<PathBuf>,

    /// The plug-in [default: beside this program]
    #[arg(long, value_name = "PATH", env = "BIMORPH_CM")]
    plugin: Option<PathBuf>,

    #[command(flatten)]
    netlist: NetlistArgs,
}

impl CosimCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let format = self.out.as_deref().map(ResultFormat::from_path).transpose()?;
        if let Some(out) = &self.out {
            check_folder(out)?;
        }
        interrupt::listen();
        let text = if is_netlist(&self.deck) {
            match self.netlist.deck(&self.deck)? {
                Some(text) => Some(text),
                None => return Ok(()),
            }
        } else if let Some(option) = self.netlist.given() {
            return Err(Failure::bad(option, "a netlist (.net), and no deck", self.deck.display().to_string()));
        } else {
            None
        };
        let raw = match (&self.out, format) {
            (Some(out), Some(ResultFormat::Raw)) => Some(out.clone()),
            (Some(out), Some(_)) => Some(out.with_extension(format!("{}.raw", std::process::id()))),
            _ => None,
        };
        let options = CosimOptions {
            deck: self.deck.clone(),
            remote: self.remote.clone(),
            environment: self.access.access().to_environment(),
            raw: raw.clone(),
            ngspice: self.ngspice.clone(),
            plugin: self.plugin.clone(),
            capture: self.quiet,
            text,
            ..CosimOptions::default()
        };
        let busy = (self.quiet || self.check).then(|| progress::spinner("ngspice"));
        let start = Instant::now();
        // Ctrl-C at a terminal reaches ngspice too; a signal to this process alone ends ngspice from here. Either way what
        // it leaves behind is cleared away before this process goes.
        let mut checked = None;
        let report = if self.check {
            check(&options, &|| !interrupt::asked()).map(|found| checked.insert(found).report.clone())
        } else {
            run(&options, &|| !interrupt::asked())
        };
        if let Some(busy) = busy {
            busy.finish_and_clear();
        }
        let report = match report {
            Err(CosimError::Cancelled) => return Err(Failure::Interrupted),
            Err(CosimError::Failed { .. }) if interrupt::asked_just_now() => return Err(Failure::Interrupted),
            other => other?,
        };
        stderr_line!("{}: done in {:.2} s", self.deck.display(), start.elapsed().as_secs_f64());
        if let Some(checked) = &checked {
            cosim_check::print_check(&self.deck, checked, self.json, self.quiet)?;
        }
        let (Some(out), Some(format), Some(raw)) = (&self.out, format, report.raw) else { return Ok(()) };
        if format == ResultFormat::Raw {
            return Ok(());
        }
        let drawn = longest(&raw, None).and_then(|(table, count)| {
            if count > 1 {
                let (file, plot) = (out.display(), &table.title);
                stderr_line!("note: {file} has the longest of {count} plots ({plot}); a .raw file has all, and `bimorph plot` draws any of them");
            }
            let picture = chart_of(&table, None, &[]);
            write(out, format, || Ok(table), || picture)
        });
        let _ = std::fs::remove_file(&raw);
        drawn
    }
}
