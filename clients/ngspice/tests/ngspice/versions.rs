//! The decks of the project, of its samples and of docs/reference/ngspice.md on every ngspice at hand, compared with each other; and
//! with KLU in place of Sparse where an ngspice has both.

use crate::support::{Run, all_decks, complex_deviation, deviation, real, run, run_text, versions};
use bimorph::cosim::CosimOptions;
use bimorph::results::table::{ColumnSamples, Table};
use std::path::{Path, PathBuf};

/// Columns of a transient that are compared, with the share of their range by which versions may differ: motion and
/// temperature 1e-4, motional currents and what an amplifier makes of them 2e-3.
const WAVES: [(&str, f64); 6] =
    [("v(x)", 1e-4), ("v(x2)", 1e-4), ("v(y)", 1e-4), ("v(t)", 1e-4), ("i(vs)", 2e-3), ("v(out)", 2e-3)];

/// Decks that run here: every `.cir` with a part in it but those that want a server, and every whole deck of the
/// documentation.
fn decks(folder: &Path) -> Vec<PathBuf> {
    let docs =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/ngspice.md")).unwrap();
    let blocks = |kind: &str| -> Vec<String> {
        let fence = format!("```{kind}\n");
        docs.split(fence.as_str()).skip(1).filter_map(|rest| rest.split("```").next()).map(str::to_owned).collect()
    };
    let written = blocks("deck");
    assert!(written.len() >= 5, "docs/reference/ngspice.md has {} decks", written.len());
    for (n, text) in written.iter().enumerate() {
        assert!(text.contains("bimorph(") && text.trim_end().ends_with(".end"), "{text}");
        std::fs::write(folder.join(format!("docs_{n}.cir")), text).unwrap();
    }
    for text in blocks("netlist") {
        let name = text.trim_start_matches("% ").split([':', '\n']).next().expect("a name").to_owned();
        assert!(!folder.join(&name).exists() && name.ends_with(".net"), "{name}");
        std::fs::write(folder.join(name), text).unwrap();
    }
    let mut found: Vec<PathBuf> = (std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()))
        .filter(|p| p.extension().is_some_and(|e| e == "cir") && !p.ends_with("comb_remote.cir"))
        .filter(|p| std::fs::read_to_string(p).unwrap().contains("bimorph("))
        .collect();
    found.sort();
    found
}

fn on(deck: &Path, ngspice: &Path) -> Result<Run, String> {
    let options = CosimOptions { deck: deck.to_owned(), ngspice: Some(ngspice.to_owned()), ..CosimOptions::default() };
    run(options).map_err(|e| e.to_string())
}

/// Largest difference of two runs of one deck, in units of what is allowed, and where.
fn difference(a: &Run, b: &Run) -> (f64, String) {
    let mut worst = (0.0, String::new());
    let mut take = |off: f64, what: String| {
        if off.is_nan() || off > worst.0 {
            worst = (off, what);
        }
    };
    for (p, q) in a.plots.iter().zip(&b.plots) {
        if p.plot_name.starts_with("Transient") {
            let end = real(p, "time").last().copied().unwrap_or(0.0);
            for (column, allowed) in WAVES.iter().filter(|(c, _)| p.column(c).is_some()) {
                let wave = |t: &'static str, p: &Table| (real(p, t).to_vec(), real(p, column).to_vec());
                let (x, y) = (wave("time", p), wave("time", q));
                let off = deviation((&x.0, &x.1), (&y.0, &y.1), 0.0, end) / allowed;
                take(off, format!("{column} in time"));
            }
            continue;
        }
        // ngspice leaves the imaginary parts of its frequencies as they were in memory.
        for column in p.columns().iter().filter(|c| c.name != "frequency") {
            let Some(other) = q.column(&column.name) else { continue };
            let off = match (&column.samples, &other.samples) {
                (ColumnSamples::Complex(x), ColumnSamples::Complex(y)) => {
                    let still = |z: &[[f64; 2]]| z.iter().all(|z| *z == [0.0; 2]);
                    if still(x) && still(y) { 0.0 } else { complex_deviation(x, y) }
                }
                (ColumnSamples::Real(x), ColumnSamples::Real(y)) => {
                    let size = y.iter().fold(0.0f64, |m, y| m.max(y.abs()));
                    let off = x.iter().zip(y).fold(0.0f64, |m, (x, y)| m.max((x - y).abs()));
                    if size > 0.0 { off / size } else { off }
                }
                _ => f64::NAN,
            };
            take(off / 1e-4, format!("{} in {}", column.name, p.plot_name));
        }
    }
    worst
}

/// Decks of few points, or of a switch that opens within a step: ngspice's own integration differs between versions by more than what
/// is compared here. They run here; tests of their own measure them on every version (`steps`, `charge`).
const OF_THEIR_OWN: [&str; 3] = ["charge_ring.cir", "ring_oscillator.cir", "comb_oscillator.cir"];

/// Every deck runs on every version, and the waveforms agree with those of the first.
#[test]
fn every_deck_on_every_version() {
    let folder = all_decks();
    let versions = versions();
    let mut table = String::from("deck");
    versions.iter().for_each(|(v, _)| table += &format!(" | {v}"));
    let mut wrong = Vec::new();
    for deck in decks(folder.path()) {
        let name = deck.file_name().unwrap().to_string_lossy().into_owned();
        table += &format!("\n{name}");
        let mut first: Option<Run> = None;
        for (version, ngspice) in &versions {
            match (on(&deck, ngspice), &first) {
                (Err(e), _) => {
                    table += " | fails";
                    wrong.push(format!("{name} on {version}: {e}"));
                }
                (Ok(_), _) if OF_THEIR_OWN.contains(&name.as_str()) => table += " | runs",
                (Ok(run), None) => {
                    table += " | runs";
                    first = Some(run);
                }
                (Ok(run), Some(reference)) => {
                    let (off, what) = difference(reference, &run);
                    table += &format!(" | {off:.3} of what is allowed, {what}");
                    if off.is_nan() || off > 1.0 {
                        wrong.push(format!("{name} on {version}: {what} differs by {off} of what is allowed"));
                    }
                }
            }
        }
    }
    println!("{table}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Ten plates behind resistors, each with a monitor.
fn ten_plates() -> String {
    let plates: String = (1..=10).map(|n| format!("R{n} in d{n} {n}k\nA{n} %gd [d{n} 0] %v [x{n}] plate\n")).collect();
    format!(
        "* ten\nVin in 0 dc 2 ac 1 PULSE(2 4 1u 1u 1u 20u 40u)\n{plates}\
         .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n\
         .op\n.ac dec 5 1k 100k\n.tran 0.1u 60u 0 0.1u\n.end\n"
    )
}

/// Points whose step is no shorter than a nanosecond. At the steps of rounding around a corner a capacitance of 20 fF at
/// 10 V has a current of 2e-13/h, whose last digit is what is left of a source's 4e-11 A.
fn resolved(plot: &Table, samples: &[f64]) -> Vec<f64> {
    let time = plot.column("time").filter(|_| plot.plot_name.starts_with("Transient")).map(|t| t.samples.magnitudes());
    let long = |i: usize| i == 0 || time.as_ref().is_none_or(|t| t[i] - t[i - 1] >= 1e-9);
    samples.iter().enumerate().filter(|(i, _)| long(*i)).map(|(_, x)| *x).collect()
}

/// KLU and Sparse solve the same equations: every sample of every column agrees within 1e-9 of its largest in any analysis,
/// with a monitor, without one, and with ten parts in one matrix.
#[test]
fn klu_agrees_with_sparse() {
    let folder = all_decks();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let silent: String = (ten_plates().lines())
        .map(|line| match line.split_once(" %v ") {
            Some((head, _)) => format!("{head} null plate\n"),
            None => format!("{}\n", line.replace(" monitors=[\"m.x:1e6\"]", "")),
        })
        .collect();
    for (version, ngspice) in versions().into_iter().filter(|(v, _)| *v >= 42) {
        for (name, text) in [
            ("comb", read("comb.cir")),
            ("ten plates", ten_plates()),
            ("ten plates, no monitors", silent.clone()),
            ("thermal port", read("thermal_port.cir")),
            ("port dampers", read("port_dampers.cir")),
        ] {
            let sparse = run_text(&text, &ngspice).unwrap();
            let with = text.replacen('\n', "\n.options klu\n", 1);
            let klu = run_text(&with, &ngspice).unwrap_or_else(|e| panic!("{name} on {version} with KLU: {e}"));
            assert_eq!(sparse.plots.len(), klu.plots.len());
            let mut worst = (0.0f64, String::new());
            for (p, q) in sparse.plots.iter().zip(&klu.plots) {
                // by place: the branches of a part with several share a name
                for (column, other) in p.columns().iter().zip(q.columns()).filter(|(c, _)| c.name != "frequency") {
                    let x = resolved(p, &column.samples.magnitudes());
                    let y = resolved(q, &other.samples.magnitudes());
                    assert_eq!(column.name, other.name);
                    assert_eq!(x.len(), y.len(), "{name} on {version}: {} of {}", column.name, p.plot_name);
                    // At an operating point no current flows: the solution there is rounding.
                    let everywhere = sparse.plots.iter().filter_map(|plot| plot.column(&column.name));
                    let size =
                        everywhere.flat_map(|c| c.samples.magnitudes()).fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
                    let off = x.iter().zip(&y).fold(0.0f64, |m, (x, y)| m.max((x - y).abs())) / size;
                    if off.is_nan() || off > worst.0 {
                        worst = (off, format!("{} of {}", column.name, p.plot_name));
                    }
                }
            }
            println!("ngspice {version}, {name}: KLU differs from Sparse by {:e} ({})", worst.0, worst.1);
            assert!(worst.0 < 1e-9, "{name} on {version}: {worst:?}");
        }
    }
}

/// Where a plate 1 N/m stiff and 1e-8 m² large stands at 2 V [um], by fixed-point iteration of k·x = ½εAV²/(g − x)².
fn stands_at(gap: f64) -> f64 {
    (0..200).fold(0.0, |x, _| 0.5 * 8.854e-12 * 1e-8 * 4.0 / (gap - x).powi(2)) * 1e6
}

/// Netlist parameters follow the deck's: from `.param`, as the only entry of `set` and as one of two; and geometry comes
/// with the instance, through a subcircuit.
#[test]
fn settings_follow_the_deck() {
    for (version, ngspice) in versions() {
        let text = "* settings\n.param gdeck=3u\nVd a 0 2\n\
            .model one bimorph(file=\"damped_plate.net\" monitors=[\"m.x:1e6\"] set=[\"g\" {gdeck}])\n\
            A1 %gd [a 0] %v [x1] one\n\
            .model two bimorph(file=\"damped_plate.net\" monitors=[\"m.x:1e6\"] set=[\"g\" {gdeck/2} \"spare:1\"])\n\
            A2 %gd [a 0] %v [x2] two\n\
            .subckt cell a x g=2u\nA1 %gd [a 0] %v [x] inner\n\
            .model inner bimorph(file=\"damped_plate.net\" monitors=[\"m.x:1e6\"] set=[\"g\" {g}])\n.ends\n\
            X1 a x3 cell g=2.5u\nX2 a x4 cell\n.op\n.end\n";
        let run = run_text(text, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Operating");
        for (column, gap) in [("v(x1)", 3e-6), ("v(x2)", 1.5e-6), ("v(x3)", 2.5e-6), ("v(x4)", 2e-6)] {
            let (got, want) = (real(plot, column)[0], stands_at(gap));
            assert!((got / want - 1.0).abs() < 1e-6, "ngspice {version}: {column} is {got}, expected {want}");
        }
    }
}
