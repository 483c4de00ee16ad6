//! Where results go: `--out` files, JSON or a report on standard output.

use super::failure::Failure;
use super::interrupt;
use bimorph::results::format::ResultFormat;
use bimorph::results::plot::{Picture, render};
use bimorph::results::table::Table;
use bimorph::results::{atomic, csv, raw};
use clap::Args;
use serde::Serialize;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Options of every command that has a result.
#[derive(Debug, Args)]
pub(crate) struct OutputArgs {
    /// Print one JSON document: SI, full precision
    #[arg(long, help_heading = "Output")]
    json: bool,

    /// Write the result to a file; its extension says what: .raw (ngspice), .csv, .svg, .png, .html
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    out: Option<PathBuf>,
}

impl OutputArgs {
    /// Refuses a file that could not be written, before any work is done.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let Some(path) = &self.out else { return Ok(()) };
        ResultFormat::from_path(path)?;
        check_folder(path)
    }

    /// The format of `--out`.
    pub(crate) fn format(&self) -> Option<ResultFormat> {
        self.out.as_deref().and_then(|path| ResultFormat::from_path(path).ok())
    }

    /// Writes a finished page to `--out`, then prints.
    pub(crate) fn finish_page(
        &self,
        page: impl FnOnce() -> String,
        json: &impl Serialize,
        report: &str,
    ) -> Result<(), Failure> {
        if let Some(path) = &self.out {
            write_page(path, &page())?;
        }
        self.print(json, report)
    }

    /// Writes the `--out` file, then prints.
    pub(crate) fn finish(
        &self,
        table: impl FnOnce() -> Result<Table, Failure>,
        picture: impl FnOnce() -> Result<Picture, Failure>,
        json: &impl Serialize,
        report: &str,
    ) -> Result<(), Failure> {
        if let (Some(path), Some(format)) = (&self.out, self.format()) {
            write(path, format, table, picture)?;
        }
        self.print(json, report)
    }

    fn print(&self, json: &impl Serialize, report: &str) -> Result<(), Failure> {
        if self.json {
            let mut text = serde_json::to_string(json).map_err(|e| Failure::Stdout(e.into()))?;
            text.push('\n');
            print(&text)
        } else {
            print(report)
        }
    }
}

/// Refuses a file in a folder that does not exist.
pub(crate) fn check_folder(path: &Path) -> Result<(), Failure> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.is_dir() {
        return Ok(());
    }
    let source = io::Error::new(io::ErrorKind::NotFound, format!("there is no folder {}", folder.display()));
    Err(Failure::Write { path: path.to_owned(), source })
}

/// Writes one result file.
pub(crate) fn write(
    path: &Path,
    format: ResultFormat,
    table: impl FnOnce() -> Result<Table, Failure>,
    picture: impl FnOnce() -> Result<Picture, Failure>,
) -> Result<(), Failure> {
    interrupt::no_longer_polled();
    let failed = |source| Failure::Write { path: path.to_owned(), source };
    match format {
        ResultFormat::Raw => {
            let table = table()?;
            atomic::write(path, |out| raw::write(&table, raw::Encoding::Binary, out)).map_err(failed)
        }
        ResultFormat::Csv => {
            let table = table()?;
            atomic::write(path, |out| csv::write(&table, out)).map_err(failed)
        }
        ResultFormat::Svg | ResultFormat::Png | ResultFormat::Html => write_picture(path, format, &picture()?),
    }
}

/// Writes a picture as SVG, as a web page, or (any other format) as PNG.
pub(crate) fn write_picture(path: &Path, format: ResultFormat, picture: &Picture) -> Result<(), Failure> {
    let bytes = match format {
        ResultFormat::Svg => picture.to_svg().into_bytes(),
        ResultFormat::Html => {
            let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            render::html(&name, picture).into_bytes()
        }
        _ => render::png(picture)?,
    };
    let failed = |source| Failure::Write { path: path.to_owned(), source };
    atomic::write(path, |out| out.write_all(&bytes)).map_err(failed)
}

/// Writes a page as it is.
pub(crate) fn write_page(path: &Path, page: &str) -> Result<(), Failure> {
    write_bytes(path, page.as_bytes())
}

/// Writes a file as it is.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    interrupt::no_longer_polled();
    let failed = |source| Failure::Write { path: path.to_owned(), source };
    atomic::write(path, |out| out.write_all(bytes)).map_err(failed)
}

/// Prints to standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Failure::Stdout)
}
