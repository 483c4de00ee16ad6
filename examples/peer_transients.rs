//! The side of this program in `benches/peers/transients.py`: one released motion by formulation and tolerance, as a command makes it.
//!
//!     peer_transients NETLIST PARAMETER VALUE STOP POINTS NODE FORMULATION TOL …
//!
//! Prints a line of JSON for each tolerance: processor time of the thread with and without the mesh search (s, a mean), steps, unknowns, the
//! estimated error, and x and y of the node (m). A failure has a line with its reason. Beams meet in points, without damping.

use bimorph::analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::netlist::{Bundle, Setting, read_bundle};
use std::path::Path;

/// Runs are repeated up to this time (s): the scheduler's clock advances in milliseconds.
const BUDGET: f64 = 0.5;
/// Longest time of a run (s).
const PATIENCE: f64 = 60.0;

struct Request {
    bundle: Bundle,
    parameter: String,
    value: f64,
    stop: f64,
    points: usize,
    node: String,
    formulation: Formulation,
}

/// A run: its result, and times with and without the mesh search (s).
type Timed = (TransientResult, f64, f64);

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, parameter, value, stop, points, node, formulation, tols @ ..] = words.as_slice() else {
        panic!("NETLIST PARAMETER VALUE STOP POINTS NODE FORMULATION TOL …");
    };
    let number = |word: &String| -> f64 { word.parse().unwrap_or_else(|_| panic!("not a number: {word}")) };
    let request = Request {
        bundle: read_bundle(Path::new(file), &[]).unwrap_or_else(|e| panic!("{e}")),
        parameter: parameter.clone(),
        value: number(value),
        stop: number(stop),
        points: number(points) as usize,
        node: node.clone(),
        formulation: Formulation::ALL.into_iter().find(|f| f.name() == formulation).expect("a formulation"),
    };
    for tol in tols {
        match request.measure(number(tol)) {
            Ok((result, whole, run)) => {
                let took = result.formulation_taken.as_deref().unwrap_or(formulation);
                let reported = result.estimated_error.zip(result.step_error).map(|(mesh, steps)| mesh.max(steps));
                let reported = reported.map_or_else(|| "null".to_owned(), |e| format!("{e:e}"));
                let samples: Vec<String> = result.signals.iter().map(|s| format!("{:?}", s.2)).collect();
                println!(
                    "{{\"tol\":{tol},\"took\":\"{}\",\"whole\":{whole:e},\"run\":{run:e},\"steps\":{},\"unknowns\":{},\
                     \"reported\":{reported},\"signals\":[{}]}}",
                    took.split(':').next().unwrap_or_default(),
                    result.counters.steps,
                    result.unknowns,
                    samples.join(",")
                );
            }
            Err(reason) => println!("{{\"tol\":{tol},\"failed\":{reason:?}}}"),
        }
    }
}

impl Request {
    /// The run with mean times.
    fn measure(&self, tol: f64) -> Result<Timed, String> {
        let begun = on_cpu();
        let (result, mut whole, mut run) = self.once(tol)?;
        let mut count = 1.0;
        while on_cpu() - begun < BUDGET {
            let (_, again, alone) = self.once(tol)?;
            (whole, run, count) = (whole + again, run + alone, count + 1.0);
        }
        Ok((result, whole / count, run / count))
    }

    fn once(&self, tol: f64) -> Result<Timed, String> {
        let begun = on_cpu();
        let moving = self.compiled(0.0, tol)?;
        let held = self.compiled(self.value, tol)?;
        let options = TransientOptions {
            stop: self.stop,
            signals: vec![format!("{}.x", self.node), format!("{}.y", self.node)],
            points: self.points,
            tol,
            release: Some(&held),
            ..TransientOptions::default()
        };
        // the last run is that of the result
        let mut last = 0.0;
        let mut attempt =
            |fitted: FittedRun, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
                let options = options.with_release(fitted.start.as_ref());
                let mut go = |options: &TransientOptions<'_>,
                              sample: &mut dyn FnMut(f64, &[f64]),
                              watch: &mut dyn FnMut(f64) -> bool| {
                    let run = on_cpu();
                    let mut patient = |fraction: f64| watch(fraction) && on_cpu() - begun < PATIENCE;
                    let result = transient(&fitted.moving, options, sample, &mut patient)?;
                    last = on_cpu() - run;
                    Ok((result, ()))
                };
                with_step_error(&options, &fitted.moving, &mut go, sample, watch)
            };
        let found = run_as_chosen(&moving, &options, &mut attempt, &mut |_, _| (), &mut |_| true);
        let (result, ()) = found.map_err(|e| e.to_string())?;
        Ok((result, on_cpu() - begun, last))
    }

    fn compiled(&self, value: f64, tol: f64) -> Result<CompiledModel, String> {
        let options = CompileOptions {
            tol,
            formulation: self.formulation,
            undamped: true,
            junctions: Junctions::Centreline,
            set: vec![(self.parameter.clone(), Setting::Number(value))],
            ..CompileOptions::default()
        };
        compile(&self.bundle, &options).map_err(|e| e.to_string())
    }
}

/// Processor time of this thread (s), from the scheduler of Linux.
fn on_cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux with the times of its scheduler");
    let nanoseconds: f64 = text.split(' ').next().and_then(|word| word.parse().ok()).expect("a number");
    1e-9 * nanoseconds
}
