//! A run repeated with half the steps, a tenth of the tolerances and twice the segments, and the resulting error
//! estimate.

use super::compare::{self, PlotComparison, PrintedNumber};
use super::error::{CosimError, io};
use super::refined_deck::{TIGHTER, finer, keeping_plots, measuring};
use super::run::{CosimOptions, CosimReport, run_whatever};
use super::scratch::scratch_folder;
use bimorph_results::raw;
use bimorph_results::table::Table;
use std::path::Path;

/// How far a run and its finer repetition lie apart.
#[derive(Debug, Clone, PartialEq)]
pub struct CosimCheck {
    /// The run as the deck has it.
    pub report: CosimReport,
    /// Every plot.
    pub plots: Vec<PlotComparison>,
    /// Every number that was printed by name.
    pub printed: Vec<PrintedNumber>,
    /// Parts that could not be refined or compared, one sentence each.
    pub notes: Vec<String>,
}

/// Runs a deck with half the longest step of every transient, a tenth of `reltol` and a tenth of each model's `tol`, then as it is, and
/// compares. Files that the deck writes itself are those of the second run. Output is captured.
///
/// # Errors
/// [`CosimError`]: of either run.
pub fn check(options: &CosimOptions, keep_going: &dyn Fn() -> bool) -> Result<CosimCheck, CosimError> {
    let deck = &options.deck;
    let bytes = std::fs::read(deck).map_err(|source| CosimError::Deck { path: deck.clone(), source })?;
    let text = options.text.clone().unwrap_or_else(|| String::from_utf8_lossy(&bytes).into_owned());
    let scratch = scratch_folder()?;
    let changed = finer(&text, deck.parent().unwrap_or(Path::new(".")));
    let mut notes = changed.notes;
    let one = |text: &str, name: &str, share: f64| {
        let kept = scratch.path().join(format!("{name}-kept.raw"));
        let raw = scratch.path().join(format!("{name}.raw"));
        let measuring = if options.raw.is_none() { measuring(text, &kept) } else { None };
        let own = measuring.is_none().then(|| raw.clone());
        let run_options = options.for_comparison(measuring.unwrap_or_else(|| keeping_plots(text, &kept)), own, share);
        let report = run_whatever(&run_options, keep_going)?;
        let mut plots = read(&kept)?;
        plots.extend(read(&raw)?);
        plots.retain(|plot| plot.plot_name != "constants");
        Ok((report, plots, raw))
    };
    let (fine, fine_plots, _) = one(&changed.text, "finer", 1.0 / TIGHTER)?;
    let (mut report, plots, raw) = one(&text, "as-it-is", 1.0)?;
    report.raw = None;
    if let Some(out) = &options.raw {
        if !raw.is_file() {
            return Err(CosimError::NoRaw { deck: deck.clone() });
        }
        let bytes = std::fs::read(&raw).map_err(io(|| format!("cannot read {}", raw.display())))?;
        bimorph_results::atomic::write(out, |file| file.write_all(&bytes))
            .map_err(io(|| format!("cannot write {}", out.display())))?;
        report.raw = Some(out.clone());
    }
    let (plots, more) = compare::plots(&plots, &fine_plots);
    notes.extend(more);
    Ok(CosimCheck { plots, printed: compare::printed(&report.output, &fine.output), notes, report })
}

/// Plots of a raw file; empty if the file does not exist.
fn read(path: &Path) -> Result<Vec<Table>, CosimError> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let bytes = std::fs::read(path).map_err(io(|| format!("cannot read {}", path.display())))?;
    raw::read(&bytes).map_err(|source| CosimError::Raw { path: path.to_owned(), source })
}
