//! Steps, error and time of a step of motions of the example models in bodies, joints and reduced models, one line each, in one run:
//! `model,formulation,tol,unknowns,steps,rejected,µs a step,error,warnings`.
//!
//!     taskset -c 0 cargo run --release --no-default-features --example reduced_speed [MODEL [TOL [RUNS]]]
//!
//! Time is that from the first sample of a run to its end over all steps, rejected ones included: training and the mesh do not count, what a
//! run records does. It is the least of fifteen runs, all formulations in turn. `error` is the root mean square difference of a signal from the bodies'
//! at a hundredth of the tolerance, of its largest value. All have the mesh of two segments a beam.

use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::netlist::{Setting, read_bundle};
use std::path::Path;
use std::time::Instant;

/// A model: name, parameters, parameters of the start, port voltages, signal, duration (s).
type Example<'a> = (&'a str, &'a [(&'a str, f64)], &'a [(&'a str, f64)], &'a [(&'a str, f64)], &'a str, f64);

const FORMULATIONS: [(&str, Formulation); 3] =
    [("bodies", Formulation::Compliant), ("joints", Formulation::Rcr), ("reduced", Formulation::Reduced)];

fn main() {
    let examples: [Example<'_>; 7] = [
        ("bank", &[], &[], &[("heat", 1.5)], "yoke.y", 300e-6),
        ("comb_resonator", &[], &[], &[("drive", 20.0)], "shuttle.x", 300e-6),
        ("quarter_stage", &[], &[("F", 20e-6), ("angle", 0.9)], &[], "c.x", 30e-6),
        ("quarter_stage", &[], &[("F", 100e-6), ("angle", 0.9)], &[], "c.x", 30e-6),
        ("rotary_stage", &[], &[], &[("counter", 2.0)], "rotor.rz", 30e-6),
        ("switch", &[], &[], &[("drive", 12.0)], "a(8).y", 3e-6),
        ("chevron", &[], &[], &[("heat", 3.0)], "apex.y", 300e-6),
    ];
    println!("model,formulation,tol,unknowns,steps,rejected,us a step,error,warnings");
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let runs = wanted.get(2).map_or(15, |runs| runs.parse().unwrap());
    for example in examples.iter().filter(|(name, ..)| wanted.first().is_none_or(|of| of == name)) {
        for tol in [1e-2, 1e-3, 1e-4].into_iter().filter(|tol| wanted.get(1).is_none_or(|of| of.parse() == Ok(*tol))) {
            measure(example, tol, runs);
        }
    }
}

fn measure(&(name, set, start, volts, signal, stop): &Example<'_>, tol: f64, runs: usize) {
    let build = |extra: &[(&str, f64)], formulation| -> CompiledModel {
        let bundle = read_bundle(&Path::new("examples").join(name).join(format!("{name}.net")), &[]).unwrap();
        let named = |&(n, v): &(&str, f64)| (n.to_owned(), Setting::Number(v));
        let set = set.iter().chain(extra).map(named).collect();
        let options = CompileOptions {
            tol,
            set,
            formulation,
            segments: Some(2),
            junctions: Junctions::Centreline,
            ..CompileOptions::default()
        };
        compile(&bundle, &options).unwrap()
    };
    let released = (!start.is_empty()).then(|| build(start, Formulation::Compliant));
    let run = |compiled: &CompiledModel, tol: f64| {
        let options = TransientOptions {
            stop,
            signals: vec![signal.to_owned()],
            points: 301,
            tol,
            voltages: volts.iter().map(|(port, v)| ((*port).to_owned(), *v)).collect(),
            release: released.as_ref(),
            ..TransientOptions::default()
        };
        let mut begun = None;
        let mut sample = |_: f64, _: &[f64]| {
            begun.get_or_insert_with(Instant::now);
        };
        let result = transient(compiled, &options, &mut sample, &mut |_| true).unwrap();
        (result, begun.map_or(f64::NAN, |begun| 1e6 * begun.elapsed().as_secs_f64()))
    };
    let models = FORMULATIONS.map(|(_, formulation)| build(&[], formulation));
    let reference = run(&models[0], 1e-2 * tol).0;
    let mut best: [Option<(TransientResult, f64)>; 3] = [None, None, None];
    for _ in 0..runs {
        for (best, compiled) in best.iter_mut().zip(&models) {
            let now = run(compiled, tol);
            if best.as_ref().is_none_or(|(_, time)| now.1 < *time) {
                *best = Some(now);
            }
        }
    }
    for ((formulation, _), best) in FORMULATIONS.iter().zip(best) {
        let Some((result, time)) = best else { continue };
        let work = result.counters;
        let (steps, error) = (work.steps + work.rejected, difference(&result, &reference));
        let warnings = result.warnings.join("; ");
        println!(
            "{name},{formulation},{tol:e},{},{},{},{:.2},{error:.1e},{warnings}",
            result.unknowns,
            work.steps,
            work.rejected,
            time / steps as f64
        );
    }
}

/// Root mean square difference of the signals, over the largest value of the second.
fn difference(one: &TransientResult, other: &TransientResult) -> f64 {
    let (one, other) = (&one.signals[0].2, &other.signals[0].2);
    let squares: f64 = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / other.len() as f64).sqrt() / other.iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}
