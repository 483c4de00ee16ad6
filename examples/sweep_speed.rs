//! Points per second of processor time in sweeps of the bank, one line each, in one run on one thread:
//! `analysis,points,way,points_per_s,over_alone`.
//!
//!     taskset -c 0 cargo run --release --no-default-features --example sweep_speed [POINTS] [transient|reduced|static|modes|parts]
//!
//! *alone*: every point as a call of its own, read, searched a mesh for and analysed. *given mesh*: the same on the a
//! priori mesh, without any estimate. *sweep*: `jobs::sweep`, with the estimate of every point. Transients are on two
//! segments a beam in all ways; *lanes* is the integration alone, *sweep* has the reading and the estimate too. Their
//! ends are compared bit by bit. *reduced*: transients over the voltage of the heaters at a tolerance of 1e-2, of the full model (*bodies*) and in
//! a reduced model, whose *sweep* has one training for all. *parts*, on its own: the parts of a point's cost, `part,us`.

use bimorph::analysis::batch_transient;
use bimorph::analysis::mesh::{MeshRequest, fitted};
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::analysis::{modes::modes, statics::static_equilibrium};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, compile, draw};
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepParameter, SweepSpec};
use bimorph::netlist::{Bundle, NetlistSource, read_bundle};
use bimorph::refine::mesh_search::Mesh;
use std::hint::black_box;
use std::path::Path;

fn main() {
    let argument = |k: usize| std::env::args().nth(k);
    let points = argument(1).and_then(|n| n.parse().ok()).unwrap_or(2000);
    let only = argument(2).unwrap_or_default();
    let wanted = |name: &str| only.is_empty() || only == name;
    if only == "parts" {
        parts(points);
    }
    if wanted("transient") {
        transients(points / 8);
    }
    if wanted("reduced") {
        reduced(points / 8);
    }
    if wanted("static") {
        let voltages = vec![("heat".to_owned(), 2.2)];
        let outputs = vec!["yoke.y".into()];
        let analysis = SweepAnalysis::Static { outputs, voltages: voltages.clone() };
        measure("static", points, analysis, &|compiled, fit| {
            let request = MeshRequest::Static { voltages: &voltages };
            let mesh = fit.then(|| fitted(compiled, &request).expect("a mesh"));
            black_box(static_equilibrium(mesh.as_ref().unwrap_or(compiled), &voltages).expect("an equilibrium"));
        });
    }
    if wanted("modes") {
        let three = SweepAnalysis::Modes { count: 3, voltages: Vec::new() };
        measure("modes", points / 4, three, &|compiled, fit| {
            let request = MeshRequest::Modes { count: 3, voltages: &[] };
            let mesh = fit.then(|| fitted(compiled, &request).expect("a mesh"));
            black_box(modes(mesh.as_ref().unwrap_or(compiled), 3, &[]).expect("modes"));
        });
    }
}

/// Runs of the bank heated from rest, one by one and in sweeps: steps and time of each way.
fn transients(points: usize) {
    let (spec, bundle) = grid(
        points,
        SweepAnalysis::Transient {
            stop: 20e-6,
            outputs: vec!["yoke.y".into()],
            voltages: vec![("heat".to_owned(), 2.2)],
        },
    );
    let options = CompileOptions { segments: Some(2), ..CompileOptions::default() };
    let numbers = spec.point_numbers().expect("a grid");
    let variants: Vec<CompiledModel> = (numbers.iter())
        .map(|&n| compile(&bundle, &CompileOptions { set: spec.settings(n), ..options.clone() }).expect("the bank"))
        .collect();
    let run = TransientOptions {
        stop: 20e-6,
        signals: vec!["yoke.y".into()],
        points: 2,
        voltages: vec![("heat".to_owned(), 2.2)],
        ..TransientOptions::default()
    };
    let (mut steps, mut last) = (0, Vec::new());
    let alone = rate(variants.len(), || {
        for variant in &variants {
            let result = transient(variant, &run, &mut |_, _| (), &mut |_| true).expect("a run");
            steps += result.counters.steps;
            last.push(result.signals[0].2[1]);
        }
    });
    let all: Vec<&CompiledModel> = variants.iter().collect();
    println!("transient,{},alone,{alone:.0},1.00", variants.len());
    let each = |rate: f64| 1e6 * variants.len() as f64 / (rate * steps as f64);
    eprintln!("transient: {steps} steps; {:.2} µs a step alone", each(alone));
    let mut found = None;
    let lanes = rate(variants.len(), || found = batch_transient::ends(&all, &run, &mut || true).ok());
    let (ends, work) = found.expect("runs");
    for (end, last) in ends.iter().zip(&last) {
        assert_eq!(end.as_ref().map(|end| end.values[0].to_bits()), Some(last.to_bits()));
    }
    assert_eq!(work.accepted, steps);
    println!("transient,{},lanes,{lanes:.0},{:.2}", variants.len(), lanes / alone);
    let (at_once, rejected) = (work.together, work.rejected);
    eprintln!("transient: {at_once} of eight at once, {rejected} rejected; {:.2} µs a step in lanes", each(lanes));
    let whole = rate(variants.len(), || {
        let table = sweep::run(&spec, &bundle, &options, &|_| true).expect("a table");
        for (row, last) in table.rows.iter().zip(&last) {
            assert_eq!(row.values.as_ref().ok().and_then(|v| v[0]).map(f64::to_bits), Some(last.to_bits()));
        }
    });
    println!("transient,{},sweep,{whole:.0},{:.2}", variants.len(), whole / alone);
}

/// Runs of the bank over the voltage of its heaters: of the full model and of a reduced one, with a training each and in a sweep.
fn reduced(points: usize) {
    let analysis = SweepAnalysis::Transient { stop: 20e-6, outputs: vec!["yoke.y".into()], voltages: Vec::new() };
    let heat: SweepParameter = format!("heat.v=0.5:2.2:{points}").parse().expect("an axis");
    let spec = SweepSpec { parameters: vec![heat], samples: None, analysis, shard: Shard::default(), threads: Some(1) };
    let bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).expect("the bank");
    let options =
        |formulation| CompileOptions { tol: 1e-2, segments: Some(2), formulation, ..CompileOptions::default() };
    let swept = |formulation| {
        rate(points, || {
            let table = sweep::run(&spec, &bundle, &options(formulation), &|_| true).expect("a table");
            assert_eq!(table.failed(), 0);
        })
    };
    let bodies = swept(Formulation::Compliant);
    println!("reduced,{points},bodies,{bodies:.0},1.00");
    let compiled = compile(&bundle, &options(Formulation::Reduced)).expect("the bank");
    let alone = rate(points, || {
        for k in 0..points {
            let heat = 0.5 + 1.7 * k as f64 / (points - 1) as f64;
            let run = TransientOptions {
                stop: 20e-6,
                signals: vec!["yoke.y".into()],
                points: 2,
                tol: 1e-2,
                voltages: vec![("heat".to_owned(), heat)],
                ..TransientOptions::default()
            };
            black_box(transient(&compiled, &run, &mut |_, _| (), &mut |_| true).expect("a run"));
        }
    });
    println!("reduced,{points},alone,{alone:.0},{:.2}", alone / bodies);
    let sweep = swept(Formulation::Reduced);
    println!("reduced,{points},sweep,{sweep:.0},{:.2}", sweep / bodies);
}

/// The grid of two parameters with about `points` points, and the bank that has them.
fn grid(points: usize, analysis: SweepAnalysis) -> (SweepSpec, Bundle) {
    let side = (points as f64).sqrt().round() as usize;
    let axis = |text: String| text.parse::<SweepParameter>().expect("an axis");
    let parameters = vec![axis(format!("wh=1.8u:2.2u:{side}")), axis(format!("pitch=48u:51u:{side}"))];
    let spec = SweepSpec { parameters, samples: None, analysis, shard: Shard::default(), threads: Some(1) };
    let mut bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).expect("the bank");
    for text in bundle.files.values_mut() {
        *text = text.replace("pitch = 49.5u", "param pitch = 49.5u");
    }
    (spec, bundle)
}

/// Measures one analysis over `points` values of two parameters.
fn measure(name: &str, points: usize, analysis: SweepAnalysis, one: &dyn Fn(&CompiledModel, bool)) {
    let (spec, bundle) = grid(points, analysis);
    let points = spec.grid_points().expect("a grid");
    let some = spec.point_numbers().expect("a grid").into_iter().step_by(10);
    let compiled = |number: usize| {
        let options = CompileOptions { set: spec.settings(number), ..CompileOptions::default() };
        compile(&bundle, &options).expect("the bank")
    };
    let alone = rate(some.len(), || some.clone().for_each(|number| one(&compiled(number), true)));
    let given = rate(some.len(), || some.clone().for_each(|number| one(&compiled(number), false)));
    let options = CompileOptions::default();
    let mut worst: f64 = 0.0;
    let swept = rate(points, || {
        let table = sweep::run(&spec, &bundle, &options, &|_| true).expect("a table");
        worst = table.rows.iter().filter_map(|row| row.estimated_error).fold(0.0, f64::max);
        assert_eq!(table.failed(), 0);
    });
    for (way, rate) in [("alone", alone), ("given mesh", given), ("sweep", swept)] {
        println!("{name},{points},{way},{rate:.0},{:.2}", rate / alone);
    }
    eprintln!("{name}: largest estimate {worst:.1e}");
}

/// Calls per second of processor time of this process.
fn rate(count: usize, work: impl FnOnce()) -> f64 {
    let before = used();
    work();
    count as f64 / (used() - before)
}

/// Parts of the cost of one point, each repeated `points` times.
fn parts(points: usize) {
    let voltages = vec![("heat".to_owned(), 2.2)];
    let (spec, bundle) = grid(9, SweepAnalysis::Modes { count: 3, voltages: Vec::new() });
    let source = NetlistSource::new(&bundle);
    let options = CompileOptions { set: spec.settings(4), ..CompileOptions::default() };
    let drawn = draw(&source, &options).expect("the bank");
    let compiled = drawn.clone().compile().expect("the bank");
    let part =
        |name: &str, work: &dyn Fn()| println!("{name},{:.1}", 1e6 / rate(points, || (0..points).for_each(|_| work())));
    part("draw", &|| drop(black_box(draw(&source, &options))));
    for (name, request) in [
        ("static", MeshRequest::Static { voltages: &voltages }),
        ("modes", MeshRequest::Modes { count: 3, voltages: &[] }),
    ] {
        let order = fitted(&compiled, &request).expect("a mesh").order;
        let mesh = drawn.clone().on(order.clone()).expect("a mesh");
        let twice = Mesh { segments: order.segments.iter().map(|n| 2 * n).collect(), ..order.clone() };
        part(&format!("{name} mesh"), &|| drop(black_box(drawn.clone().on(order.clone()))));
        match request {
            MeshRequest::Static { voltages } => {
                part("second mesh", &|| drop(black_box(mesh.with_order(twice.clone()))));
                part("equilibrium", &|| drop(black_box(static_equilibrium(&mesh, voltages))));
            }
            _ => part("modes", &|| drop(black_box(modes(&mesh, 3, &[])))),
        }
    }
}

/// Processor time of all threads of this process (s), in ticks of a hundredth (Linux).
fn used() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |k: usize| fields[k].parse::<f64>().expect("a number");
    (ticks(11) + ticks(12)) / 100.0
}
