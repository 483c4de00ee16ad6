//! The table of a sweep, on its way to a file or to standard output.

use super::failure::Failure;
use super::output::{check_folder, print};
use bimorph::jobs::sweep::SweepTable;
use bimorph::results::atomic;
use std::path::{Path, PathBuf};

/// Refuses a file that a table cannot be written to, before anything is computed for it.
pub(super) fn check(out: Option<&PathBuf>) -> Result<(), Failure> {
    let Some(out) = out else { return Ok(()) };
    if out.extension().is_none_or(|e| !e.eq_ignore_ascii_case("csv")) {
        return Err(Failure::bad("--out", "a .csv file", format!("\"{}\"", out.display())));
    }
    check_folder(out)
}

/// Whether a table is a result: at least one point must have one. One of a shard is: its reasons are rows of the whole.
pub(super) fn is_result(table: &SweepTable, part: Option<&str>) -> bool {
    part.is_some() || table.rows.is_empty() || table.failed() < table.rows.len()
}

/// Writes the table, where it is one; whether it is.
pub(super) fn deliver(out: Option<&Path>, table: &SweepTable, part: Option<&str>) -> Result<bool, Failure> {
    if !is_result(table, part) {
        return Ok(false);
    }
    let text = part.map_or_else(|| table.to_csv(), |part| table.to_csv_of_part(part));
    match out {
        Some(path) => atomic::write(path, |out| out.write_all(text.as_bytes()))
            .map_err(|source| Failure::Write { path: path.to_owned(), source })?,
        None => print(&text)?,
    }
    Ok(true)
}

/// An error if no point has a result.
pub(super) fn nothing(table: &SweepTable) -> Result<(), Failure> {
    match table.rows.iter().find_map(|row| row.values.as_ref().err()) {
        Some(first) if table.failed() == table.rows.len() => Err(Failure::AllPoints(first.trim_end().to_owned())),
        _ => Ok(()),
    }
}

/// How many rows a table has, and of what part, and how many of them without a result.
pub(super) fn summary(table: &SweepTable, part: &str) -> String {
    let text = format!("{} points{part}", table.rows.len());
    match table.failed() {
        0 => text,
        failed => text + &format!(", {failed} without a result: see the column \"error\""),
    }
}
