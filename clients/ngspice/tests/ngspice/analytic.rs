//! The plug-in in ngspice, with a device whose answers are known in closed form: the same plate is written once in
//! Rust behind the plug-in (`examples/analytic.rs`) and once with ngspice's own B-sources.

use crate::support::{analytic_deck, analytic_plugin, complex, complex_deviation, deviation, real, run, skipped};
use bimorph::cosim::{CosimError, CosimOptions};

fn options(deck: &str) -> CosimOptions {
    CosimOptions { deck: analytic_deck(deck), plugin: Some(analytic_plugin()), ..CosimOptions::default() }
}

/// The plate's displacement (um) at 5 V across the comb and `v` across the gap, from the balance of forces
/// k·x = ½v²εA/(g − x)² + ½·25 V²·10⁻⁸ F/m by fixed-point iteration.
fn balance(v: f64) -> f64 {
    let mut x = 0.125f64;
    for _ in 0..400 {
        x = 0.5 * v * v * 8.854e-20 / (2e-6 - 1e-6 * x).powi(2) * 1e6 + 0.125;
    }
    x
}

/// Operating point and sweep are the balance of forces; small signal and transient agree with B-sources to 1e-6, and
/// to 2e-5 of range in currents, where the two differ by their integration formulas at a step of 20 ns.
#[test]
fn every_analysis_agrees_with_b_sources() {
    if skipped() {
        return;
    }
    let (ours, theirs) = (run(options("plate.cir")).unwrap(), run(options("plate_b_sources.cir")).unwrap());
    assert!((real(ours.plot("Operating"), "v(x)")[0] / balance(2.0) - 1.0).abs() < 1e-9);
    let sweep = ours.plot("DC");
    for (v, x) in real(sweep, "v(v-sweep)").iter().zip(real(sweep, "v(x)")) {
        assert!((x / balance(*v) - 1.0).abs() < 1e-9, "{v} V: {x} against {}", balance(*v));
    }
    let (a, b) = (ours.plot("AC"), theirs.plot("AC"));
    for column in ["v(x)", "i(vd)", "i(vs)"] {
        let off = complex_deviation(complex(a, column), complex(b, column));
        assert!(off < 1e-6, "ac {column}: {off:e}");
    }
    let (a, b) = (ours.plot("Transient"), theirs.plot("Transient"));
    for (column, bound) in [("v(x)", 2e-6), ("i(vs)", 2e-5), ("v(s)", 2e-5)] {
        let wave = |p| (real(p, "time"), real(p, column));
        let off = deviation(wave(a), wave(b), 1e-6, 150e-6);
        assert!(off < bound, "tran {column}: {off:e}");
    }
}

/// A device that bears steps of at most 50 ns gets them: no accepted step is longer, and the motion is that of the
/// device without the bound. Tolerance: the trapezoidal error of the free run at its own step control.
#[test]
fn a_bound_on_the_step_is_kept() {
    if skipped() {
        return;
    }
    let bounded = run(options("short.cir")).unwrap();
    let plot = bounded.plot("Transient");
    let t = real(plot, "time");
    let longest = t.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
    assert!(longest <= 50e-9 * (1.0 + 1e-9), "{longest:e}");
    let fine = run(options("plate.cir")).unwrap();
    let fine = fine.plot("Transient");
    let off = deviation((t, real(plot, "v(x)")), (real(fine, "time"), real(fine, "v(x)")), 1e-6, 30e-6);
    assert!(off < 1e-4, "{off:e}");
}

fn stopped(deck: &str) -> (String, String) {
    match run(options(deck)) {
        Err(CosimError::Stopped { reason, output }) => (reason, output),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("{deck} ran to its end"),
    }
}

/// A device without an answer ends the analysis: one message that names the instance, and no raw file.
#[test]
fn a_failure_ends_the_analysis_with_one_message() {
    if skipped() {
        return;
    }
    let (reason, output) = stopped("fails.cir");
    assert_eq!(reason, "instance a1: the plate broke off");
    let lines: Vec<_> = output.lines().filter(|l| l.contains("broke off")).collect();
    assert_eq!(lines, ["Instance: a1   Message: Error: bimorph: the plate broke off"]);
    assert!(output.contains("simulation(s) aborted"), "{output}");
}

/// The same inside .control, where ngspice itself ends with status 0.
#[test]
fn a_failure_inside_control_is_a_failure() {
    if skipped() {
        return;
    }
    assert_eq!(stopped("fails_in_control.cir").0, "instance a1: the plate broke off");
}

/// A bug in the device reaches ngspice as an error and nothing else.
#[test]
fn a_panic_becomes_an_error() {
    if skipped() {
        return;
    }
    let (reason, output) = stopped("panics.cir");
    assert!(reason.starts_with("instance a1: internal error: a bug at ") && reason.contains("analytic.rs"), "{reason}");
    assert!(!output.contains("panicked"), "{output}");
}

/// Instances of one model are separate devices; monitors may be left out.
#[test]
fn instances_are_separate() {
    if skipped() {
        return;
    }
    let run = run(options("two.cir")).unwrap();
    let plot = run.plot("Operating");
    for (node, v) in [("v(x)", 2.0), ("v(x2)", 1.0)] {
        let got = real(plot, node)[0];
        assert!((got / balance(v) - 1.0).abs() < 1e-9, "{node}: {got} against {}", balance(v));
    }
}

/// Analyses that leave a stale kind to code models get operating points, and end.
#[test]
fn noise_after_a_transient_runs() {
    if skipped() {
        return;
    }
    let options = CosimOptions { capture: true, ..options("stale.cir") };
    let report = bimorph::cosim::run(&options, &|| true).unwrap();
    assert!(report.output.contains("length(frequency) = 6"), "{}", report.output);
}

/// A bound from the devices of one circuit does not affect another circuit of the same ngspice. After a part that bears
/// 50 ns steps, a part that bears any takes as many points as before it.
#[test]
fn circuits_do_not_share_bounds() {
    if skipped() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, file) in [("free.cir", "plate"), ("short.cir", "plate.short")] {
        let text = std::fs::read_to_string(analytic_deck("short.cir")).unwrap();
        std::fs::write(folder.path().join(name), text.replace("plate.short", file)).unwrap();
    }
    std::fs::copy(analytic_deck("drive.inc"), folder.path().join("drive.inc")).unwrap();
    let at = folder.path().display();
    let control = format!(
        "* three circuits\n.control\nsource {at}/free.cir\nrun\nprint length(time)\nsource {at}/short.cir\nrun\nprint \
         length(time)\nsource {at}/free.cir\nrun\nprint length(time)\nquit\n.endc\n.end\n"
    );
    let deck = folder.path().join("all.cir");
    std::fs::write(&deck, control).unwrap();
    let report = bimorph::cosim::run(&CosimOptions { deck, capture: true, ..options("plate.cir") }, &|| true).unwrap();
    let lengths: Vec<_> = report.output.lines().filter(|l| l.starts_with("length(time)")).collect();
    assert_eq!(lengths.len(), 3, "{}", report.output);
    assert_ne!(lengths[0], lengths[1]);
    assert_eq!(lengths[0], lengths[2]);
}

/// Loading the plug-in twice, in an initialisation file and once more in the deck, does no harm.
#[test]
fn loading_twice_does_no_harm() {
    if skipped() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(analytic_deck("drive.inc"), folder.path().join("drive.inc")).unwrap();
    let deck = folder.path().join("deck.cir");
    let text = std::fs::read_to_string(analytic_deck("two.cir")).unwrap();
    let again = format!(".control\npre_codemodel {}\n.endc\n.end", analytic_plugin().display());
    std::fs::write(&deck, text.replace(".end", &again)).unwrap();
    let run = run(CosimOptions { deck, ..options("two.cir") }).unwrap();
    assert!((real(run.plot("Operating"), "v(x)")[0] / balance(2.0) - 1.0).abs() < 1e-9);
}
