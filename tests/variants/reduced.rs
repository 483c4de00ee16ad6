//! Sweeps of motions in a reduced model over the voltages of ports.

use bimorph::analysis::reduced::batch::{SharedRun, transients};
use bimorph::analysis::reduced::train_motion;
use bimorph::analysis::step_error::step_error;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, Formulation, compile};
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepParameter, SweepSpec};
use bimorph::netlist::{Bundle, Setting, read_bundle};
use bimorph::options::PortRanges;
use std::path::Path;
use std::sync::Arc;

/// A row: its value, and its warnings.
type Row = (u64, String);

/// The rows of a sweep of transients over these axes.
fn swept(
    bundle: &Bundle,
    options: &CompileOptions,
    run: &TransientOptions<'_>,
    axes: &[&str],
    threads: usize,
) -> Vec<Row> {
    let (stop, outputs, voltages) = (run.stop, run.signals.clone(), run.voltages.clone());
    let spec = SweepSpec {
        parameters: axes.iter().map(|text| text.parse::<SweepParameter>().expect("an axis")).collect(),
        samples: None,
        analysis: SweepAnalysis::Transient { stop, outputs, voltages },
        shard: Shard::default(),
        threads: Some(threads),
    };
    let table = sweep::run(&spec, bundle, options, &|_| true).expect("a table");
    let row = |row: &sweep::SweepRow| {
        let values = row.values.as_ref().expect("a run");
        (values[0].expect("a number").to_bits(), row.warning.clone())
    };
    table.rows.iter().map(row).collect()
}

/// Rows of a sweep over a voltage, at two widths of the arms, have the bits of runs alone with the ranges of the sweep, on one thread and on two.
/// A run with ranges has other bits than one that is trained for its own voltage. At 40 V on the comb its fingers leave the middle of their gaps.
#[test]
fn rows_over_voltages_are_runs_alone_with_their_ranges() {
    [5.0, 40.0].into_iter().for_each(rows_are_runs_alone);
}

/// The same at a voltage of the comb.
fn rows_are_runs_alone(sense: f64) {
    let bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).expect("the bank");
    let tol = 1e-2;
    let options =
        CompileOptions { tol, formulation: Formulation::Reduced, segments: Some(2), ..CompileOptions::default() };
    let volts = |k: usize| 0.6 + 0.4 * k as f64;
    let run = |heat: f64| TransientOptions {
        stop: 4e-6,
        signals: vec!["yoke.y".into()],
        points: 2,
        tol,
        voltages: vec![("sense".to_owned(), sense), ("heat".to_owned(), heat)],
        ..TransientOptions::default()
    };
    let held = TransientOptions { voltages: vec![("sense".to_owned(), sense)], ..run(0.0) };
    let list = (0..5).map(|k| volts(k).to_string()).collect::<Vec<_>>().join(",");
    let axes = ["wh=1.9u:2.1u:2", &format!("heat.v={list}")];
    let rows = swept(&bundle, &options, &held, &axes, 1);
    assert_eq!(rows, swept(&bundle, &options, &held, &axes, 2));
    let ranges = PortRanges::parse(&format!("heat:{:e}:{:e}", volts(0), volts(4))).expect("ranges");
    let at = |wh: f64, ranges: Option<&PortRanges>| {
        let mut options = CompileOptions { set: vec![("wh".into(), Setting::Number(wh))], ..options.clone() };
        options.ranges = ranges.cloned();
        compile(&bundle, &options).expect("the bank")
    };
    // the steps are judged in the middle of the grid
    let (_, steps) = step_error(&run(volts(2)).with_points(201), &at(2.1e-6, Some(&ranges)), &mut |_| true);
    let mut own = 0;
    for (place, wh) in [1.9e-6, 2.1e-6].into_iter().enumerate() {
        let (shared, alone) = (at(wh, Some(&ranges)), at(wh, None));
        for k in 0..5 {
            let run = run(volts(k)).with_tolerance(steps);
            let end = |compiled| {
                let result = transient(compiled, &run, &mut |_, _| (), &mut |_| true).expect("a run");
                assert!(result.unknowns < 10, "not a reduced model");
                result
            };
            let (found, row) = (end(&shared), &rows[5 * place + k]);
            assert_eq!(found.signals[0].2[1].to_bits(), row.0, "{wh} {}", volts(k));
            assert!(found.warnings.iter().all(|warning| row.1.contains(warning)), "{:?} {}", found.warnings, row.1);
            own += u32::from(end(&alone).signals[0].2[1].to_bits() == row.0);
        }
    }
    assert!(own < 10, "ranges change nothing");
}

/// Seven plates on flexures in a tree, of which an electrode pulls the last.
const PLATES: &str = "process p1 = [Youngsmodulus=165e9 density=2300 h=5.49e-6]
anchor p1 [q(0)] []
beam2d p1 [q(0) r(1)] [l=1.59e-6 w=8.07e-7 oz=-0.892]
link2d * [r(1) c(1)] [l=1.48e-5 oz=-0.892]
plate2d p1 [c(1)] [l=2.97e-5 w=1.06e-5 oz=-0.892]
link2d * [c(1) q(1)] [l=1.48e-5 oz=-0.892]
beam2d p1 [q(1) r(2)] [l=3.82e-6 w=4.37e-7 oz=1.16]
link2d * [r(2) c(2)] [l=1.12e-5 oz=1.16]
plate2d p1 [c(2)] [l=2.24e-5 w=1.07e-5 oz=1.16]
link2d * [c(2) q(2)] [l=1.12e-5 oz=1.16]
beam2d p1 [q(1) r(3)] [l=2.21e-5 w=7.04e-7 oz=-0.812]
link2d * [r(3) c(3)] [l=1.13e-5 oz=-0.812]
plate2d p1 [c(3)] [l=2.27e-5 w=2.49e-5 oz=-0.812]
link2d * [c(3) q(3)] [l=1.13e-5 oz=-0.812]
beam2d p1 [q(1) r(4)] [l=6.93e-6 w=7.25e-7 oz=-0.237]
link2d * [r(4) c(4)] [l=5.73e-6 oz=-0.237]
plate2d p1 [c(4)] [l=1.15e-5 w=1.31e-5 oz=-0.237]
link2d * [c(4) q(4)] [l=5.73e-6 oz=-0.237]
beam2d p1 [q(4) r(5)] [l=1.93e-5 w=8.32e-7 oz=0.768]
link2d * [r(5) c(5)] [l=5.69e-6 oz=0.768]
plate2d p1 [c(5)] [l=1.14e-5 w=1.78e-5 oz=0.768]
link2d * [c(5) q(5)] [l=5.69e-6 oz=0.768]
beam2d p1 [q(1) r(6)] [l=1.82e-5 w=6.36e-7 oz=0.433]
link2d * [r(6) c(6)] [l=6.99e-6 oz=0.433]
plate2d p1 [c(6)] [l=1.4e-5 w=7.85e-6 oz=0.433]
link2d * [c(6) q(6)] [l=6.99e-6 oz=0.433]
beam2d p1 [q(5) r(7)] [l=1.88e-6 w=7.65e-7 oz=0.914]
link2d * [r(7) c(7)] [l=8.13e-6 oz=0.914]
plate2d p1 [c(7)] [l=1.63e-5 w=2.16e-5 oz=0.914]
link2d * [c(7) q(7)] [l=8.13e-6 oz=0.914]
anchor * [e] [l=1u w=1u h=1u]
gap plategap2d * [c(7) e] [A=4e-10 gap=10u oz=deg(-4)]
eground * [c(7)] []
drive port * [e] []
";

/// Rows whose directions lack what moves get these from their own runs, and are those of the full model within the tolerance: the plates swing in modes that the voltage
/// excites by way of others alone. Four directions of the training are off by a tenth of the amplitude. Where the motion takes too many directions, rows have the bits of
/// the full model, and a warning: at 600 V the plate strikes its electrode.
#[test]
fn rows_of_a_training_that_lacks_modes_are_those_of_the_full_model() {
    let bundle = Bundle::from_text("plates.net", PLATES);
    let options = |formulation| CompileOptions { tol: 1e-2, formulation, undamped: true, ..CompileOptions::default() };
    let rows = |stop, axis| {
        let run = TransientOptions {
            stop,
            signals: vec!["c(7).x".into()],
            points: 2,
            tol: 1e-2,
            ..TransientOptions::default()
        };
        let rows = |formulation| swept(&bundle, &options(formulation), &run, &[axis], 1);
        let (full, reduced) = (rows(Formulation::Compliant), rows(Formulation::Reduced));
        full.into_iter().zip(reduced).collect::<Vec<_>>()
    };
    for (full, reduced) in rows(38e-6, "drive.v=20:100:5") {
        let [known, found] = [full.0, reduced.0].map(f64::from_bits);
        assert!((found / known - 1.0).abs() <= 1e-2 && known != found, "{known:e} {found:e}");
        assert!(!reduced.1.contains("W053") && !full.1.contains("W053"), "{} {}", full.1, reduced.1);
    }
    for (full, reduced) in rows(8e-6, "drive.v=580:600:2") {
        assert_eq!(full.0, reduced.0);
        assert!(reduced.1.starts_with("W053") && !full.1.contains("W053"), "{} {}", full.1, reduced.1);
    }
}

/// A mass between stops at the end of an arm, which a plate pulls.
const STOPPED: &str = "process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a] []
arm beam2d p [a m] [l=100u w=2u]
mass2d * [m] [m=1e-12]
stop2d * [m] [gap=180n back=180n A=1e-12 restitution=1 oz=deg(90)]
anchor * [e] [l=1u w=1u h=1u]
gap plategap2d * [m e] [A=1e-9 gap=2u oz=deg(90)]
eground * [m] []
drive port * [e] []
";

/// Runs in lanes have the samples, warnings and counters of runs alone, to the bit, with any neighbours: a bank with a comb, a beam over an electrode
/// with contact, and a mass between stops. Eleven and more voltages in eight lanes. Runs that leave the polynomials, by pull-in or at the stops, have no
/// lane.
#[test]
fn lanes_are_runs_alone() {
    let volts = |low: f64, high: f64| (0..11).map(|k| low + (high - low) * f64::from(k) / 10.0).collect::<Vec<_>>();
    for (file, port, signal, volts, stop, most, leave) in [
        ("bank/bank.net", "heat", "yoke.y", volts(0.0, 2.2), 8e-6, 2.2, vec![]),
        ("switch/switch.net", "drive", "a(8).y", [volts(4.0, 14.0), vec![30.0]].concat(), 2e-6, 14.0, vec![30.0]),
        ("stopped.net", "drive", "m.y", volts(4.0, 8.0), 1e-5, 8.0, vec![7.2, 7.6, 8.0]),
    ] {
        let bundle = match file {
            "stopped.net" => Bundle::from_text(file, STOPPED),
            _ => read_bundle(&Path::new("examples").join(file), &[]).expect("a netlist"),
        };
        let tol = 1e-2;
        let ranges = PortRanges::parse(&format!("{port}:0:{most}")).expect("ranges");
        let formulation = Formulation::Reduced;
        let options = CompileOptions { tol, formulation, segments: Some(2), ..CompileOptions::default() };
        let compiled = compile(&bundle, &options.with_ranges(ranges)).expect("a model");
        let run = |volts: f64| TransientOptions {
            stop,
            signals: vec![signal.into()],
            points: 21,
            tol,
            voltages: vec![(port.to_owned(), volts)],
            ..TransientOptions::default()
        };
        let trained = Arc::new(train_motion(&compiled, &run(0.0)).expect("ports"));
        let runs: Vec<SharedRun<'_>> =
            volts.iter().map(|volts| (&compiled, run(*volts).with_reduction(Arc::clone(&trained)))).collect();
        let (results, work) = transients(&runs, &mut || true);
        assert!(work.together < work.accepted + work.rejected, "{file}: nothing was side by side: {work:?}");
        let mut without = Vec::new();
        for ((compiled, options), (result, volts)) in runs.iter().zip(results.iter().zip(&volts)) {
            let alone = transient(compiled, options, &mut |_, _| (), &mut |_| true);
            match result {
                Some(result) => {
                    assert_eq!(format!("{result:?}"), format!("{:?}", alone.expect("a run")), "{file} {volts}")
                }
                None => without.push(*volts),
            }
        }
        assert_eq!(without, leave, "{file}");
        // no run begins after the caller has stopped
        let (mut left, mut counted) = (3, 0);
        let (some, _) = transients(&runs, &mut || {
            left -= 1;
            left > 0
        });
        some.iter().for_each(|result| counted += u32::from(result.is_some()));
        assert!((3..=10).contains(&counted), "{file}: {counted}");
    }
}
