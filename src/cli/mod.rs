//! The command line: one file for each subcommand, and what they share.
//!
//! Every subcommand is an [`clap::Args`] struct with a `run` method. It reads, computes, writes its `--out` file, and
//! only then prints to standard output, so that a failure leaves standard output empty and no file behind.

#[macro_use]
mod stderr;

mod ac;
mod ac_report;
mod chart;
mod check;
mod convert;
mod convert_picture;
mod cosim;
mod cosim_check;
mod cosim_netlist;
mod credentials;
mod doctor;
mod draw_motion;
mod export;
mod failure;
mod interrupt;
mod jobs;
mod layout;
mod merge;
mod merge_error;
mod model;
mod modes;
mod options;
mod output;
mod path;
mod plot;
mod progress;
mod pull_in;
mod random_parameters;
mod remote;
mod report;
mod serve;
mod solver;
mod statics;
mod sweep;
mod sweep_files;
mod sweep_output;
mod tran;
mod tran_report;
mod value;
mod view;
mod waveform;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Behavioural device models of electro-mechanical microsystems.
///
/// Input: a SUGAR netlist. Output: motion, modes, pull-in voltages and waveforms. Numbers take netlist suffixes (1.5u,
/// 30n, 2M; m is milli, M is mega) and are SI: metres, seconds, volts, newtons, hertz.
#[derive(Debug, Parser)]
#[command(name = "bimorph", version, max_term_width = 100)]
#[command(after_help = "Exit status: 0 done, 1 error (one message on standard error), 2 wrong usage, 130 interrupted.")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Check(check::CheckCommand),
    Convert(convert::ConvertCommand),
    Layout(layout::LayoutCommand),
    Static(statics::StaticCommand),
    Path(path::PathCommand),
    Modes(modes::ModesCommand),
    Ac(ac::AcCommand),
    Pullin(pull_in::PullInCommand),
    Tran(tran::TransientCommand),
    Export(export::ExportCommand),
    Cosim(cosim::CosimCommand),
    Serve(serve::ServeCommand),
    Sweep(sweep::SweepCommand),
    Jobs(jobs::JobsCommand),
    Merge(merge::MergeCommand),
    Chart(chart::ChartCommand),
    Plot(plot::PlotCommand),
    View(view::ViewCommand),
    Doctor(doctor::DoctorCommand),
}

/// Runs the command that the process was started with.
pub(crate) fn main() -> ExitCode {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !bimorph::layout::extract::medial::may_panic() {
            usual(info);
        }
    }));
    let cli = Cli::parse();
    let done = match &cli.command {
        Command::Check(command) => command.run(),
        Command::Convert(command) => command.run(),
        Command::Layout(command) => command.run(),
        Command::Static(command) => command.run(),
        Command::Path(command) => command.run(),
        Command::Modes(command) => command.run(),
        Command::Ac(command) => command.run(),
        Command::Pullin(command) => command.run(),
        Command::Tran(command) => command.run(),
        Command::Export(command) => command.run(),
        Command::Cosim(command) => command.run(),
        Command::Serve(command) => command.run(),
        Command::Sweep(command) => command.run(),
        Command::Jobs(command) => command.run(),
        Command::Merge(command) => command.run(),
        Command::Chart(command) => command.run(),
        Command::Plot(command) => command.run(),
        Command::View(command) => command.run(),
        Command::Doctor(command) => command.run(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.show();
            ExitCode::from(failure.exit_status())
        }
    }
}
