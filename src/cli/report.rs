//! Reports for people: aligned columns in engineering units.

use bimorph::compile::CompiledModel;
pub(crate) use bimorph::export::model_options::model_options as options;
use bimorph::export::model_options::model_options_of_run;
use std::fmt::Write;

/// Rows shown of a long list.
const MAX_ROWS: usize = 40;

/// Lines up cells in columns, the first to the left and the others to the right, two blanks apart.
pub(crate) fn columns(header: &[&str], rows: &[Vec<String>]) -> String {
    let mut widths: Vec<usize> = header.iter().map(|h| h.chars().count()).collect();
    for row in rows.iter().take(MAX_ROWS) {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let mut text = String::new();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut shown = String::new();
        for (i, (cell, width)) in cells.zip(&widths).enumerate() {
            let _ = if i == 0 { write!(shown, "{cell:<width$}") } else { write!(shown, "  {cell:>width$}") };
        }
        text.push_str(shown.trim_end());
        text.push('\n');
    };
    line(&mut header.iter().copied());
    for row in rows.iter().take(MAX_ROWS) {
        line(&mut row.iter().map(String::as_str));
    }
    if rows.len() > MAX_ROWS {
        let _ = writeln!(text, "… {} more; --json and --out have all", rows.len() - MAX_ROWS);
    }
    text
}

/// The last line of a report: mesh, unknowns and error estimate.
pub(crate) fn footing(compiled: &CompiledModel, unknowns: usize) -> String {
    format!("{unknowns} unknowns, {}", options(compiled))
}

/// The same of a run in time.
pub(crate) fn footing_of_run(compiled: &CompiledModel, unknowns: usize) -> String {
    format!("{unknowns} unknowns, {}", model_options_of_run(compiled))
}
