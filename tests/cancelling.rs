//! Every computation stops soon after its cancellation: every kind of analysis on a large model, cancelled in the
//! middle.

use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::analysis::{modes, pull_in, statics};
use bimorph::budget::{Allowance, Budget, Stopped, within};
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::netlist::Bundle;
use std::fmt::Write as _;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// A chain of 40 beams in so many segments, between two anchors, with a gap at its middle.
fn chain(segments: usize) -> (Bundle, CompileOptions) {
    let mut text = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [n0] [l=1u w=1u]\n".to_owned();
    for k in 0..40 {
        let _ = writeln!(text, "beam2d p [n{k} n{}] [l=100u w=2u oz={}]", k + 1, f64::from(k % 2) * 0.3);
    }
    text += "anchor p [n40] [l=1u w=1u]\nanchor p [e] [l=1u w=1u]\nplategap2d * [n20 e] [A=1e-8 gap=2u]\n";
    text += "eground * [e] []\ndrive port * [n20 e] []\n";
    (
        Bundle::from_text("chain.net", &text),
        CompileOptions { segments: Some(segments / 40), ..CompileOptions::default() },
    )
}

/// Time for which `job` runs after it was cancelled at `at`; `None` when it ended before.
fn after_cancelling(at: Duration, job: impl FnOnce() + Send) -> Option<Duration> {
    let budget = Budget::new(Allowance::default());
    let (ended, end) = channel();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let outcome = within(&budget, job);
            ended.send((outcome, Instant::now())).expect("heard");
        });
        std::thread::sleep(at);
        let cancelled = Instant::now();
        budget.cancel();
        let (outcome, at) = end.recv().expect("it ends");
        (outcome == Err(Stopped::Cancelled)).then(|| at.saturating_duration_since(cancelled))
    })
}

/// Cancels a computation at five moments; the median of its further run time.
fn median(name: &str, mut job: impl FnMut() + Send) -> Duration {
    let moments = [20, 60, 120, 250, 500].map(Duration::from_millis);
    let mut after: Vec<Duration> = moments.iter().filter_map(|at| after_cancelling(*at, &mut job)).collect();
    after.sort();
    println!("{name}: {after:.1?} after it was cancelled");
    after.get(after.len() / 2).copied().unwrap_or_default()
}

/// Statics, modes, pull-in, transients and compilations of 30 000 unknowns run for some milliseconds longer, on a
/// machine without load. The asserted limit is twenty times the aim of 50 ms, which an unstoppable computation exceeds
/// by far.
#[test]
fn computations_stop_soon() {
    let (bundle, options) = chain(10_000);
    let compiled: CompiledModel = compile(&bundle, &options).expect("compiles");
    let volts = vec![("drive".to_owned(), 1.0)];
    let longest = Duration::from_secs(1);
    let soon = |name: &str, job: &mut (dyn FnMut() + Send)| {
        let after = median(name, job);
        assert!(after < longest, "{name}: {after:?}");
    };
    soon("modes", &mut || drop(modes::modes(&compiled, 100, &volts)));
    soon("pull-in", &mut || drop(pull_in::pull_in(&compiled, None, 100.0)));
    soon("statics", &mut || (0..1000).for_each(|_| drop(statics::static_equilibrium(&compiled, &volts))));
    for name in Integrator::NAMES {
        let method = Integrator::named(name).expect("a name");
        let options = TransientOptions { stop: 1.0, method, keep: false, ..TransientOptions::default() };
        soon(name, &mut || drop(transient(&compiled, &options, &mut |_, _| (), &mut |_| true)));
    }
    let (fine, options) = chain(200_000);
    soon("compiling", &mut || (0..10).for_each(|_| drop(compile(&fine, &options))));
    let band = CompileOptions { segments: None, band: Some(1e7), ..options };
    soon("a band", &mut || (0..10).for_each(|_| drop(compile(&bundle, &band))));
    let mut long = "anchor * [a] [l=1u w=1u]\n".to_owned();
    (0..200_000).for_each(|k| {
        let _ = writeln!(long, "mass2d * [m{k}] [m=1e-10]\nspring2d * [a m{k}] [kx=1]");
    });
    let long = Bundle::from_text("long.net", &long);
    soon("a long netlist", &mut || drop(compile(&long, &CompileOptions::default())));
}
