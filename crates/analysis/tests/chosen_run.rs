//! Runs in the formulation that `auto` takes give way to those in the other one.

use bimorph_analysis::AnalysisError;
use bimorph_analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph_analysis::step_error::with_step_error;
use bimorph_analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph_base::{Bundle, Setting};
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation, draw};
use bimorph_netlist::NetlistSource;

/// Two plates of about 120 times the mass of their flexures.
const CHAIN: &str = "
process p1 = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p1 [q(0)] []
for i=1:2 [
  beam2d p1 [q(i-1) r(i)] [l=10u w=1u]
  link2d * [r(i) c(i)] [l=20u]
  plate2d p1 [c(i)] [l=40u w=30u]
  link2d * [c(i) q(i)] [l=20u]
]
f2d * [c(2)] [F=0.1u oz=pi/2]
";

/// A plate on two beams, one of them of two pieces, under a force that folds segments: with two segments a beam no step of the bodies passes
/// 5e-8 s.
const FRAME: &str = "
process p1 = [Youngsmodulus=165e9 density=2300 h=5u]
anchor p1 [a] []
beam2d p1 [a b] [l=80u w=0.45u]
beam2d p1 [a c] [l=80u w=1.5u oz=1]
beam2d p1 [c b] [l=76.7u w=1.5u oz=-1.0708]
plate2d p1 [b] [l=18u w=18u]
f2d * [b] [F=140u oz=2.7]
";

/// An arm of two beams with a plate, which a force turns by a radian.
const ARM: &str = "
process p1 = [Youngsmodulus=165e9 density=2300 h=3.1u]
param F=0.74u
anchor p1 [a] []
beam2d p1 [a c] [l=57u w=0.55u oz=1.49]
beam2d p1 [c b] [l=78u w=1.8u oz=2.144]
plate2d p1 [b] [l=14u w=14u]
f2d * [b] [F=F oz=4.07]
";

type Samples = Vec<(f64, Vec<f64>)>;
type Interference<'a> = &'a dyn Fn(&mut dyn FnMut(f64) -> bool) -> Result<(), AnalysisError>;

fn drawn(formulation: Formulation) -> CompiledModel {
    let options = CompileOptions { formulation, undamped: true, ..CompileOptions::default() };
    let bundle = Bundle::from_text("chain.net", CHAIN);
    draw(&NetlistSource::new(&bundle), &options).and_then(|drawn| drawn.compile()).unwrap_or_else(|e| panic!("{e}"))
}

fn asked(points: usize) -> TransientOptions<'static> {
    TransientOptions { stop: 2e-5, signals: vec!["c(2).y".into()], points, ..TransientOptions::default() }
}

/// The run of `auto` or of bodies, its samples, and how many runs there were; `interfere` acts on a tentative one after it has been made.
fn run(
    formulation: Formulation,
    points: usize,
    interfere: Interference<'_>,
) -> (Result<TransientResult, AnalysisError>, Samples, usize) {
    let (mut samples, mut runs) = (Samples::new(), 0);
    let options = asked(points);
    let mut attempt = |run: FittedRun, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
        runs += 1;
        let mut go = |options: &TransientOptions<'_>,
                      sample: &mut dyn FnMut(f64, &[f64]),
                      watch: &mut dyn FnMut(f64) -> bool| {
            transient(&run.moving, options, sample, watch).map(|r| (r, ()))
        };
        let done = with_step_error(&options, &run.moving, &mut go, sample, watch)?;
        if run.is_tentative {
            interfere(watch)?;
        }
        Ok(done)
    };
    let keep = &mut |t: f64, values: &[f64]| samples.push((t, values.to_vec()));
    let done = run_as_chosen(&drawn(formulation), &options, &mut attempt, keep, &mut |_| true);
    (done.map(|(result, ())| result), samples, runs)
}

/// The run of the frame, its samples, and the formulations of all runs; `interfere` acts on one in joint coordinates after it has been made.
fn run_frame(
    formulation: Formulation,
    interfere: Interference<'_>,
) -> (Result<TransientResult, AnalysisError>, Samples, Vec<Formulation>) {
    let model = CompileOptions { formulation, segments: Some(2), ..CompileOptions::default() };
    run_at_one_percent(FRAME, &model, 4e-7, interfere)
}

/// The same of a netlist with a node b, undamped, at a tolerance of 1e-2.
fn run_at_one_percent(
    netlist: &str,
    model: &CompileOptions,
    stop: f64,
    interfere: Interference<'_>,
) -> (Result<TransientResult, AnalysisError>, Samples, Vec<Formulation>) {
    let (mut samples, mut runs) = (Samples::new(), Vec::new());
    let model = CompileOptions { undamped: true, tol: 1e-2, ..model.clone() };
    let bundle = Bundle::from_text("frame.net", netlist);
    let drawn = draw(&NetlistSource::new(&bundle), &model).and_then(|drawn| drawn.compile());
    let drawn = drawn.unwrap_or_else(|e| panic!("{e}"));
    let signals = vec!["b.x".into(), "b.y".into()];
    let options = TransientOptions { stop, signals, points: 101, tol: 1e-2, ..TransientOptions::default() };
    let mut attempt = |run: FittedRun, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
        runs.push(run.moving.options.formulation);
        let mut go = |options: &TransientOptions<'_>,
                      sample: &mut dyn FnMut(f64, &[f64]),
                      watch: &mut dyn FnMut(f64) -> bool| {
            transient(&run.moving, options, sample, watch).map(|r| (r, ()))
        };
        let done = with_step_error(&options, &run.moving, &mut go, sample, watch)?;
        interfere(watch)?;
        Ok(done)
    };
    let keep = &mut |t: f64, values: &[f64]| samples.push((t, values.to_vec()));
    let done = run_as_chosen(&drawn, &options, &mut attempt, keep, &mut |_| true);
    (done.map(|(result, ())| result), samples, runs)
}

fn failure() -> AnalysisError {
    AnalysisError::StepFailed { t: 1e-5, dt: 1e-22, detail: "a fault".into() }
}

/// Where a run in joint coordinates fails or its steps collapse, result and samples are those of the bodies to the last bit, each sample comes once, and
/// the result has the reason. One that succeeds is the only one.
#[test]
fn failed_runs_in_joints_give_way_to_bodies() {
    let (bodies, samples, runs) = run(Formulation::Compliant, 101, &|_| Ok(()));
    let bodies = bodies.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((bodies.formulation_taken.as_deref(), samples.len(), runs), (None, 101, 1));

    let (chosen, others, runs) = run(Formulation::Auto, 101, &|_| Ok(()));
    let taken = chosen.unwrap_or_else(|e| panic!("{e}")).formulation_taken.unwrap_or_default();
    assert!(taken.starts_with("rcr: rigid parts of"), "{taken}");
    assert_eq!((others.len(), runs), (101, 1));
    assert_ne!(others, samples);

    let collapse = |watch: &mut dyn FnMut(f64) -> bool| {
        assert!((0..1000).any(|k| !watch(1e-8 * f64::from(k))), "the run is given up");
        Err(AnalysisError::Cancelled)
    };
    let stalled = "(its steps fell below 5e-8 of the run)";
    let failed = "(transient stopped at t = 1e-5 s (dt = 1e-22 s): a fault)";
    let cases: [(Interference<'_>, &str); 2] = [(&collapse, stalled), (&|_| Err(failure()), failed)];
    for (interfere, why) in cases {
        let (found, others, runs) = run(Formulation::Auto, 101, interfere);
        let mut found = found.unwrap_or_else(|e| panic!("{e}"));
        let taken = found.formulation_taken.take().unwrap_or_default();
        let told =
            format!("compliant: a run in joint coordinates was given up {why}, which were taken as rigid parts of");
        assert!(taken.starts_with(&told), "{taken}");
        assert_eq!((found, others, runs), (bodies.clone(), samples.clone(), 2));
    }
}

/// A caller that cancels a run in joint coordinates gets no other one.
#[test]
fn cancelled_runs_do_not_give_way() {
    let (found, samples, runs) = run(Formulation::Auto, 101, &|_| Err(AnalysisError::Cancelled));
    assert_eq!((found, samples.len(), runs), (Err(AnalysisError::Cancelled), 0, 1));
}

/// Runs with more samples than are kept (2²⁰) are those of the bodies at once.
#[test]
fn runs_with_many_samples_are_those_of_bodies() {
    let (found, samples, runs) = run(Formulation::Auto, (1 << 20) + 1, &|_| Ok(()));
    let taken = found.unwrap_or_else(|e| panic!("{e}")).formulation_taken.unwrap_or_default();
    assert!(
        taken.starts_with("compliant: a run in joint coordinates was given up (more samples than are kept"),
        "{taken}"
    );
    assert_eq!((samples.len(), runs), ((1 << 20) + 1, 1));
}

/// Where a step of the bodies fails, result and samples are those of joint coordinates to the last bit, each sample comes once, and the result has the
/// reason. Where these fail, too, the error is that of the bodies, and where the caller cancels them they are cancelled.
#[test]
fn failed_steps_of_bodies_give_way_to_joints() {
    let (joints, samples, runs) = run_frame(Formulation::Rcr, &|_| Ok(()));
    let joints = joints.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((samples.len(), runs), (101, vec![Formulation::Rcr]));
    let (refused, none, _) = run_frame(Formulation::Compliant, &|_| Ok(()));
    let refused = refused.map(|_| ()).expect_err("segments fold");
    assert!(matches!(&refused, AnalysisError::StepFailed { t, .. } if *t < 5e-8), "{refused}");
    assert!(none.is_empty());

    let both = vec![Formulation::Auto, Formulation::Rcr];
    let (found, others, runs) = run_frame(Formulation::Auto, &|_| Ok(()));
    let mut found = found.unwrap_or_else(|e| panic!("{e}"));
    let taken = found.formulation_taken.take().unwrap_or_default();
    assert_eq!(taken, format!("rcr: a run of the bodies was given up ({refused})"));
    assert_eq!((found, others, &runs), (joints, samples, &both));

    for (interfere, told) in [(failure(), refused), (AnalysisError::Cancelled, AnalysisError::Cancelled)] {
        let (found, others, runs) = run_frame(Formulation::Auto, &|_| Err(interfere.clone()));
        assert_eq!((found, others.len(), &runs), (Err(told), 0, &both));
    }
}

/// Where coarse runs predict more work of the steps over bodies than in joint coordinates, `auto` makes one run, in joint coordinates. It has the bits of
/// `rcr`, and less than a third of the steps of the bodies. Under a small force the run is that of the bodies.
#[test]
fn costly_steps_of_bodies_give_way_to_joints() {
    let run = |formulation, force: f64| {
        let set = vec![("F".to_owned(), Setting::Number(force))];
        let model = CompileOptions { formulation, set, ..CompileOptions::default() };
        let (found, samples, runs) = run_at_one_percent(ARM, &model, 2.4e-4, &|_| Ok(()));
        (found.unwrap_or_else(|e| panic!("{e}")), samples, runs)
    };
    for (force, other, taken) in [
        (7.4e-7, Formulation::Rcr, "rcr: coarse runs predict less work of the steps"),
        (1e-8, Formulation::Compliant, "compliant: joints are elastic in every direction"),
    ] {
        let (mut chosen, samples, runs) = run(Formulation::Auto, force);
        let why = chosen.formulation_taken.take().unwrap_or_default();
        assert!(why.starts_with(taken) && runs.len() == 1, "{why}, {runs:?}");
        let (same, others, _) = run(other, force);
        assert_eq!((&chosen, samples), (&same, others));
        let (bodies, ..) = run(Formulation::Compliant, force);
        let fewer = 3 * chosen.counters.steps < bodies.counters.steps;
        assert_eq!(fewer, other == Formulation::Rcr, "{} of {} steps", chosen.counters.steps, bodies.counters.steps);
    }
}
