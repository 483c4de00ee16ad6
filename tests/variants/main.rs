//! Sweeps of variants: shared data (a mesh, the parsed netlist, the steps of a run) change no guarantee about any one
//! of them.

mod batch_transients;
mod batched;
mod point_lists;
mod ports;
mod reduced;

use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, compile};
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepSpec, SweepTable};
use bimorph::netlist::{Bundle, Setting};

/// A beam between anchors under a force at its middle, beside a cantilever: the first stiffens as it bends.
const BEAMS: &str = "param F=100u, w=2u, l=100u
process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a] []
left beam2d p [a m] [l=l w=w]
right beam2d p [m b] [l=l w=w]
anchor p [b] []
arm beam2d p [m t] [l=60u w=1.5u oz=deg(90)]
f2d * [m] [F=F oz=deg(90)]
f2d * [t] [F=F/20 oz=0]
";

fn swept(text: &str, axes: &[&str], analysis: SweepAnalysis, options: &CompileOptions, shard: Shard) -> SweepTable {
    let parameters = axes.iter().map(|axis| axis.parse().expect("an axis")).collect();
    let spec = SweepSpec { parameters, samples: None, analysis, shard, threads: Some(2) };
    sweep::run(&spec, &Bundle::from_text("beams.net", text), options, &|_| true).expect("a table")
}

fn statics() -> SweepAnalysis {
    SweepAnalysis::Static { outputs: vec!["m.y".into(), "t.x".into(), "t.y".into()], voltages: Vec::new() }
}

/// Every row of a sweep is within the tolerance of the beams; W040 says where its estimate is beyond the tolerance, and with
/// segments that are given too coarse it is. The reference is extrapolated from
/// 64 and 128 segments a beam.
#[test]
fn rows_are_within_the_tolerance_of_a_finer_mesh() {
    let axes = ["F=20u:400u:4", "w=1.6u:2.4u:3"];
    for tol in [1e-2, 1e-3, 1e-4] {
        let options = CompileOptions { tol, ..CompileOptions::default() };
        let table = swept(BEAMS, &axes, statics(), &options, Shard::default());
        let with = |n: usize| CompileOptions { segments: Some(n), ..options.clone() };
        let (fine, finer) = (64, 128);
        let fine = swept(BEAMS, &axes, statics(), &with(fine), Shard::default());
        let finer = swept(BEAMS, &axes, statics(), &with(finer), Shard::default());
        for ((row, reference), finest) in table.rows.iter().zip(&fine.rows).zip(&finer.rows) {
            let numbers = |row: &sweep::SweepRow| -> Vec<f64> {
                row.values.as_ref().expect("a result").iter().map(|x| x.expect("a number")).collect()
            };
            let finest = numbers(finest);
            // an error is relative to the displacement of its node
            let scales = [finest[0].abs(), finest[1].hypot(finest[2]), finest[1].hypot(finest[2])];
            for (k, (x, r)) in numbers(row).iter().zip(numbers(reference)).enumerate() {
                let (last, scale) = (finest[k], scales[k]);
                // Richardson: the remainder falls with the second order
                let f = last + (last - r) / 3.0;
                assert!((f - last).abs() < 0.5 * tol * scale, "the reference is not converged: {r} {last}");
                assert!((x - f).abs() <= tol * scale, "{tol}: {x} {f} {:?}", row.parameters);
            }
            let reported = row.estimated_error.expect("an estimate");
            assert_eq!(row.warning.is_empty(), reported <= 1.05 * tol, "{reported} {}", row.warning);
        }
    }
    let coarse = CompileOptions { tol: 1e-4, segments: Some(2), ..CompileOptions::default() };
    let table = swept(BEAMS, &axes, statics(), &coarse, Shard::default());
    let beyond = table.rows.iter().filter(|row| row.estimated_error > Some(1e-4));
    assert!(
        beyond.clone().count() > 6 && beyond.clone().all(|row| row.warning.starts_with("W040")),
        "{}",
        table.to_csv()
    );
}

/// The mesh of a point does not depend on the other points of its shard. Shards put together are the whole table, also
/// where a part of the grid needs a finer mesh (forces up to F·l²/EI = 40) or has other beams.
#[test]
fn shards_are_the_whole() {
    let text = format!("param more=0\n{BEAMS}if more\n[ tail beam2d p [t e] [l=20u w=1.5u oz=0] ]\n");
    let axes = ["F=1u,5u,2000u", "more=0,1", "w=2u,2.2u"];
    let options = CompileOptions::default();
    let whole = swept(&text, &axes, statics(), &options, Shard::default());
    assert_eq!(whole.failed(), 0, "{}", whole.to_csv());
    let mut rows: Vec<_> =
        (0..5).flat_map(|index| swept(&text, &axes, statics(), &options, Shard { index, count: 5 }).rows).collect();
    rows.sort_by_key(|row| row.point);
    assert_eq!(rows, whole.rows);
}

/// Modes of variants that share a mesh: within the tolerance of 64 segments a beam, with their estimates.
#[test]
fn frequencies_hold_their_tolerance() {
    let text = BEAMS.replace("F=100u", "F=0");
    let axes = ["l=80u:120u:3", "w=1.6u:2.4u:3"];
    let modes = SweepAnalysis::Modes { count: 4, voltages: Vec::new() };
    let options = CompileOptions::default();
    let table = swept(&text, &axes, modes.clone(), &options, Shard::default());
    let fine = CompileOptions { segments: Some(64), ..options.clone() };
    let fine = swept(&text, &axes, modes, &fine, Shard::default());
    for (row, reference) in table.rows.iter().zip(&fine.rows) {
        let (found, expected) = (row.values.as_ref().expect("modes"), reference.values.as_ref().expect("modes"));
        for (f, r) in found.iter().zip(expected) {
            let (f, r) = (f.expect("a frequency"), r.expect("a frequency"));
            assert!((f / r - 1.0).abs() <= options.tol, "{f} {r} {:?}", row.parameters);
        }
        assert!(row.estimated_error.is_some_and(|reported| reported <= options.tol), "{row:?}");
    }
}

/// A netlist that was read once draws each set of parameters as one that is read anew, warnings and errors included.
#[test]
fn reading_once_is_reading_anew() {
    let source = bimorph::netlist::NetlistSource::new(&Bundle::from_text("beams.net", BEAMS));
    for (name, value) in [("w", 1e-6), ("w", 3e-6), ("w", -1e-6), ("nosuch", 1.0), ("l", 5e-5)] {
        let set = vec![(name.to_owned(), Setting::Number(value))];
        let options = CompileOptions { set, ..CompileOptions::default() };
        let anew = compile(&Bundle::from_text("beams.net", BEAMS), &options);
        let once = bimorph::compile::draw(&source, &options).and_then(bimorph::compile::ParsedStructure::compile);
        assert_eq!(format!("{once:?}"), format!("{anew:?}"));
    }
}

/// A sweep of transients gives the numbers of each run alone, to the bit, on any number of threads and in shards. Its tolerance is the requested
/// one or that divided by a power of ten, as the error of the steps needs. A point that cannot be drawn has its reason, and points of another
/// topology have lanes of their own.
#[test]
fn sweeps_of_transients_are_runs_alone() {
    let text = format!("param more=0\n{BEAMS}if more\n[ tail beam2d p [t e] [l=20u w=1.5u oz=0] ]\n");
    let transients =
        SweepAnalysis::Transient { stop: 5e-6, outputs: vec!["m.y".into(), "t.vx".into()], voltages: Vec::new() };
    let axes = ["more=0,1", "w=1.6u:2.4u:5", "F=1u,50u,200u"];
    let options = CompileOptions { segments: Some(3), ..CompileOptions::default() };
    let whole = swept(&text, &axes, transients.clone(), &options, Shard::default());
    assert_eq!((whole.rows.len(), whole.failed()), (30, 0), "{}", whole.to_csv());
    assert_eq!(whole.units, ["m", "m/s"]);
    let spec = SweepSpec {
        samples: None,
        parameters: axes.iter().map(|axis| axis.parse().expect("an axis")).collect(),
        analysis: transients.clone(),
        shard: Shard::default(),
        threads: None,
    };
    let alone = |row: &sweep::SweepRow, tol: f64| {
        let set = spec.settings(row.point);
        let compiled = compile(&Bundle::from_text("beams.net", &text), &CompileOptions { set, ..options.clone() });
        let run = TransientOptions {
            stop: 5e-6,
            signals: vec!["m.y".into(), "t.vx".into()],
            points: 2,
            tol,
            ..TransientOptions::default()
        };
        let alone = transient(&compiled.expect("a variant"), &run, &mut |_, _| (), &mut |_| true).expect("a run");
        alone.signals.iter().map(|s| s.2.last().copied()).collect::<Vec<_>>()
    };
    let sharper: Vec<f64> = std::iter::successors(Some(options.tol), |tol| Some(tol / 10.0)).take(8).collect();
    for row in whole.rows.iter().step_by(7) {
        let same = |tol: &f64| row.values.as_ref() == Ok(&alone(row, *tol));
        assert!(sharper.iter().any(same), "{:?}", row.parameters);
        assert!(row.estimated_error.is_some());
    }
    let mut rows: Vec<_> = (0..3)
        .flat_map(|index| swept(&text, &axes, transients.clone(), &options, Shard { index, count: 3 }).rows)
        .collect();
    rows.sort_by_key(|row| row.point);
    assert_eq!(rows, whole.rows);
    // an invalid width: its own error, and no other's
    let broken = swept(&text, &["w=-1u,2u", "F=1u,2u"], transients, &options, Shard::default());
    assert_eq!(broken.failed(), 2, "{}", broken.to_csv());
}

/// Omissions of a linear model are reported for each row, as `static` and `pullin` report them: on the shared mesh, on
/// one of the row's own, and on given segments. A cantilever pressed with up to half of Euler's load; one pulled in one
/// piece.
#[test]
fn rows_report_what_the_commands_report() {
    let pressed = "param F=1u\nprocess p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\n\
                   beam2d p [a b] [l=200u w=2u]\nf2d * [b] [F=F oz=pi]\nf2d * [b] [F=1n oz=pi/2]\n";
    let outputs = vec!["b.y".to_owned()];
    let statics = SweepAnalysis::Static { outputs, voltages: Vec::new() };
    for segments in [None, Some(3)] {
        let options = CompileOptions { linear: true, segments, ..CompileOptions::default() };
        let table = swept(pressed, &["F=0:6.7u:3"], statics.clone(), &options, Shard::default());
        let reported: Vec<bool> = table.rows.iter().map(|row| row.warning.contains("W041: the linear model")).collect();
        assert_eq!(reported, [false, true, true], "{:?}", table.rows);
    }
    // beyond Euler's load modes grow; a part that is pulled in, and one that stays closed
    let buckled = SweepAnalysis::Modes { count: 1, voltages: Vec::new() };
    let linear = CompileOptions { linear: true, ..CompileOptions::default() };
    let table = swept(pressed, &["F=1u,40u"], buckled, &linear, Shard::default());
    let reported: Vec<bool> =
        table.rows.iter().map(|row| row.warning.contains("the equilibrium is unstable")).collect();
    assert_eq!(reported, [false, true], "{:?}", table.rows);
    let plate = "param V=1\nanchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1]\n\
                 anchor * [e] [l=1u w=1u h=1u]\ngap plategap2d * [m e] [A=1e-8 gap=2u]\neground * [e] []\nVsrc * [m e] [V=V]\n";
    let outputs = vec!["m.x".to_owned()];
    let still = SweepAnalysis::Static { outputs, voltages: Vec::new() };
    let table = swept(plate, &["V=1,9"], still, &CompileOptions::default(), Shard::default());
    let reported: Vec<bool> = table.rows.iter().map(|row| row.warning.contains("pulled in on the way")).collect();
    assert_eq!(reported, [false, true], "{:?}", table.rows);
}

/// Rows of transients report the step error in the middle of the grid, where it is beyond the tolerance. This applies
/// to a part released far that exchanges energy between its modes for milliseconds, and not to one that has only begun
/// to move.
#[test]
fn rows_report_how_far_their_steps_are_off() {
    let text = BEAMS;
    let outputs = vec!["t.y".to_owned()];
    let options = CompileOptions { segments: Some(3), undamped: true, tol: 1e-2, ..CompileOptions::default() };
    let run = |stop: f64| {
        let transients = SweepAnalysis::Transient { stop, outputs: outputs.clone(), voltages: Vec::new() };
        swept(text, &["F=50u,100u,200u"], transients, &options, Shard::default())
    };
    let reported = |table: &SweepTable| -> Vec<bool> {
        table.rows.iter().map(|row| row.warning.contains("the estimated error of the steps in time is")).collect()
    };
    let long = run(2e-3);
    assert_eq!(reported(&long), [true; 3], "{:?}", long.rows);
    assert!(long.rows[0].warning.contains("in the middle of the grid"));
    let short = run(2e-6);
    assert_eq!(reported(&short), [false; 3], "{:?}", short.rows);
}
