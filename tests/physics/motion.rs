//! Motion in time.

use crate::{close, model};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, Compiled};

fn run(compiled: &Compiled, options: &TransientOptions<'_>) -> (Vec<f64>, Vec<f64>, u64) {
    let result = transient(compiled, options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    (result.t, result.signals[0].2.clone(), result.counters.factorizations)
}

fn options<'a>(stop: f64, release: Option<&'a Compiled>) -> TransientOptions<'a> {
    TransientOptions { stop, signals: vec!["m.x".into()], points: 201, release, ..TransientOptions::default() }
}

const OSCILLATOR: &str = "
    param F=0
    anchor * [f] [l=1u w=1u h=1u]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    spring2d * [f m] [kx=1]
    damper2d * [f m] [bx=1e-6]
    f2d * [m] [F=F]";

/// A damped oscillator released from 1 µm follows e^{−δt}(cos ωt + δ/ω·sin ωt) within 1e-4 of its start over ten periods,
/// and a tenth of the tolerance costs less than 2.5 times the factorizations (fourth order).
#[test]
fn released_oscillator() {
    let start = model(&OSCILLATOR.replace("F=0", "F=1u"), &CompileOptions::default());
    let compiled = model(OSCILLATOR, &CompileOptions::default());
    let (decay, omega) = (5e3, (1e10f64 - 25e6).sqrt());
    let exact = |t: f64| 1e-6 * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin());
    let mut work = Vec::new();
    for tol in [1e-3, 1e-4] {
        let (t, x, factorizations) = run(&compiled, &TransientOptions { tol, ..options(6.3e-4, Some(&start)) });
        let worst = t.iter().zip(&x).map(|(t, x)| (x - exact(*t)).abs()).fold(0.0, f64::max);
        assert!(worst < 0.1 * tol * 1e-6, "{tol}: {worst:e}");
        work.push(factorizations);
    }
    assert!(work[1] < 5 * work[0] / 2, "{work:?}");
}

/// The last sample stands at the end time, samples are equally spaced, and the stream sees each of them once.
#[test]
fn samples_are_where_they_were_asked_for() {
    let start = model(&OSCILLATOR.replace("F=0", "F=1u"), &CompileOptions::default());
    let compiled = model(OSCILLATOR, &CompileOptions::default());
    let mut streamed = Vec::new();
    let mut last = 0.0;
    let asked = options(1e-4, Some(&start));
    let result = transient(&compiled, &asked, &mut |t, row| streamed.push((t, row[0])), &mut |share| {
        assert!(share >= last && share <= 1.0);
        last = share;
        true
    })
    .unwrap();
    assert_eq!(result.t.len(), 201);
    assert_eq!(*result.t.last().unwrap(), 1e-4);
    close(result.t[100], 0.5e-4, 1e-12);
    let kept: Vec<_> = result.t.iter().copied().zip(result.signals[0].2.iter().copied()).collect();
    assert_eq!(streamed, kept);
    assert_eq!(last, 1.0);
}

/// Two runs give the same bits, and stopping from outside is reported as such.
#[test]
fn runs_repeat_and_can_be_stopped() {
    let start = model(&OSCILLATOR.replace("F=0", "F=1u"), &CompileOptions::default());
    let compiled = model(OSCILLATOR, &CompileOptions::default());
    assert_eq!(run(&compiled, &options(1e-4, Some(&start))), run(&compiled, &options(1e-4, Some(&start))));
    let stopped = transient(&compiled, &options(1e-4, Some(&start)), &mut |_, _| {}, &mut |_| false);
    assert_eq!(stopped, Err(AnalysisError::Cancelled));
}

/// Undamped dynamic pull-in of the lumped plate lies between 0.999 and 1.001 of √(27/32) of the static one, 4.7527 V: a step
/// just below swings back, a step just above closes the gap. (The plate bounces at once, 0.1 µm from the electrode: samples of 75 ns
/// catch it within 50 nm of that.)
#[test]
fn dynamic_pull_in() {
    let compiled = model(crate::gaps::PLATE, &CompileOptions::default());
    let reach = |volts: f64| {
        let asked = TransientOptions { voltages: vec![("drive".into(), volts)], points: 4001, ..options(3e-4, None) };
        run(&compiled, &asked).1.into_iter().fold(0.0, f64::max)
    };
    let below = reach(4.7527 * 0.999);
    assert!(below < 1.05e-6, "{below:e}");
    let above = reach(4.7527 * 1.001);
    assert!(above > 1.85e-6, "{above:e}");
}
