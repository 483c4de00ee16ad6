//! Functions shared by the tests that run ngspice: finding it, running a deck, reading its output.

use bimorph::cosim::{self, CosimError, CosimOptions};
use bimorph::results::table::{ColumnSamples, Table};
use std::path::{Path, PathBuf};

/// A deck's run: every plot of its raw file.
pub(crate) struct Run {
    pub(crate) plots: Vec<Table>,
}

/// True, and said aloud, where ngspice is missing.
pub(crate) fn skipped() -> bool {
    let missing = cosim::find_ngspice().is_none_or(|p| !p.is_file());
    if missing {
        eprintln!("SKIPPED: ngspice was not found, so no deck was run");
    }
    missing
}

/// Every ngspice at hand: those that `scripts/ngspice-versions` laid beside the machine's own, by major version, or else
/// the machine's own alone.
pub(crate) fn versions() -> Vec<(u32, PathBuf)> {
    let folder = std::env::var_os("BIMORPH_NGSPICE_VERSIONS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/ngspice"), PathBuf::from);
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut found: Vec<(u32, PathBuf)> = entries
        .filter_map(|e| Some((e.file_name().to_str()?.strip_prefix("ngspice")?.parse().ok()?, e.path())))
        .collect();
    found.sort();
    if found.len() < 2 {
        eprintln!("ONLY ONE: decks run on the machine's own ngspice alone; scripts/ngspice-versions fetches others");
    }
    if found.is_empty()
        && let Some(own) = cosim::find_ngspice().filter(|p| p.is_file())
    {
        found.push((0, own));
    }
    found
}

/// A folder with every deck and netlist of the project's tests and samples.
pub(crate) fn all_decks() -> tempfile::TempDir {
    let all = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for folder in ["tests/decks", "examples/bank", "examples"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap().map(Result::unwrap).filter(|e| e.path().is_file()) {
            let text = std::fs::read_to_string(entry.path()).unwrap_or_default();
            std::fs::write(all.path().join(entry.file_name()), text.replace("uses ../", "uses ")).unwrap();
        }
    }
    all
}

/// A deck of the given text, beside copies of every deck and netlist; the columns of its raw file.
pub(crate) fn run_text(text: &str, ngspice: &Path) -> Result<Run, CosimError> {
    let folder = all_decks();
    let deck = folder.path().join("deck.cir");
    std::fs::write(&deck, text).unwrap();
    run(CosimOptions { deck, ngspice: Some(ngspice.to_owned()), ..CosimOptions::default() })
}

/// Decks of the whole project.
pub(crate) fn deck(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/decks").join(name)
}

/// Decks for the analytic device.
pub(crate) fn analytic_deck(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ngspice/decks").join(name)
}

/// The plug-in of the analytic example.
pub(crate) fn analytic_plugin() -> PathBuf {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    let tests = std::env::current_exe().unwrap();
    let built = tests.parent().unwrap().join("../examples").join(format!("{DLL_PREFIX}analytic{DLL_SUFFIX}"));
    assert!(built.is_file(), "{} is missing; build it with `cargo build --example analytic`", built.display());
    built
}

/// Runs a deck with a raw file, in a folder of its own.
pub(crate) fn run(options: CosimOptions) -> Result<Run, CosimError> {
    let folder = tempfile::tempdir().unwrap();
    let raw = folder.path().join("out.raw");
    cosim::run(&CosimOptions { raw: Some(raw.clone()), capture: true, ..options }, &|| true)?;
    let plots = bimorph::results::raw::read(&std::fs::read(raw).unwrap()).unwrap();
    Ok(Run { plots })
}

impl Run {
    /// The plot whose name begins so ("Transient", "AC", "DC", "Operating").
    pub(crate) fn plot(&self, name: &str) -> &Table {
        self.plots.iter().find(|p| p.plot_name.starts_with(name)).unwrap_or_else(|| panic!("no plot {name}"))
    }
}

/// A column of real samples.
pub(crate) fn real<'a>(plot: &'a Table, name: &str) -> &'a [f64] {
    match &plot.column(name).unwrap_or_else(|| panic!("no column {name}")).samples {
        ColumnSamples::Real(samples) => samples,
        ColumnSamples::Complex(_) => panic!("{name} is complex"),
    }
}

/// A column of complex samples.
pub(crate) fn complex<'a>(plot: &'a Table, name: &str) -> &'a [[f64; 2]] {
    match &plot.column(name).unwrap_or_else(|| panic!("no column {name}")).samples {
        ColumnSamples::Complex(samples) => samples,
        ColumnSamples::Real(_) => panic!("{name} is real"),
    }
}

/// The value of a waveform at `at`, straight between its points.
pub(crate) fn value(t: &[f64], y: &[f64], at: f64) -> f64 {
    let i = t.partition_point(|&x| x < at).clamp(1, t.len() - 1);
    y[i - 1] + (y[i] - y[i - 1]) * (at - t[i - 1]) / (t[i] - t[i - 1])
}

/// Largest difference of two waveforms between `from` and `to`, at the points of the first, over the range of the
/// second.
pub(crate) fn deviation(a: (&[f64], &[f64]), b: (&[f64], &[f64]), from: f64, to: f64) -> f64 {
    let (mut worst, mut low, mut high) = (0.0f64, f64::INFINITY, f64::NEG_INFINITY);
    for (at, x) in a.0.iter().zip(a.1).filter(|(t, _)| (from..=to).contains(*t)) {
        let y = value(b.0, b.1, *at);
        worst = worst.max((x - y).abs());
        (low, high) = (low.min(y), high.max(y));
    }
    assert!(high > low, "no points between {from} and {to} s");
    worst / (high - low)
}

/// Largest difference of two complex columns over the largest magnitude of the second.
pub(crate) fn complex_deviation(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let worst = a.iter().zip(b).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
    worst / b.iter().map(|b| b[0].hypot(b[1])).fold(0.0, f64::max)
}
