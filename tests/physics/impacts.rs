//! Impacts in time: contact losses, methods that gain energy, discrete gradients, ends of runs, and validity after
//! contact.

use crate::contact::{Numbers, random_part};
use crate::model;
use bimorph::analysis::AnalysisError;
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::mesh::fitted_in_time;
use bimorph::analysis::modes::modes;
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, TransientResult, Until, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation};
use bimorph::netlist::Setting;
use bimorph::solve::time::event::Direction;

/// A mass of 1e-10 kg that 1 µN throws at a stop 10 µm away: it arrives with √(2·F·w/m) = 0.44721 m/s.
fn thrown(stop: &str, options: &CompileOptions) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1e-6]
        f2d * [m] [F=1u]
        stop2d * [m] [gap=10u {stop}]"
    );
    model(&text, options)
}

fn run(compiled: &CompiledModel, options: &TransientOptions<'_>) -> Result<TransientResult, AnalysisError> {
    transient(compiled, options, &mut |_, _| {}, &mut |_| true)
}

/// How far the mass comes back from the stop, of the way that it fell.
fn rebound(compiled: &CompiledModel, method: Integrator, step: Option<f64>) -> f64 {
    let options = TransientOptions {
        stop: 100e-6,
        points: 20_001,
        tol: if method == Integrator::TrBdf2 { 1e-4 } else { 1e-3 },
        signals: vec!["m.x".into()],
        method,
        step,
        ..TransientOptions::default()
    };
    let result = run(compiled, &options).unwrap_or_else(|e| panic!("{method:?}: {e}"));
    let touched = result.events.iter().find(|e| e.contact && e.direction == Direction::Down).unwrap().t;
    let (t, x) = (&result.t, &result.signals[0].2);
    // up to the second contact
    let again =
        result.events.iter().filter(|e| e.contact && e.direction == Direction::Down).nth(1).map_or(1.0, |e| e.t);
    let after = t.iter().zip(x).filter(|(t, _)| **t > touched && **t < again).map(|(_, x)| *x);
    1.0 - after.fold(1e-5, f64::min) / 1e-5
}

/// A mass that arrives at the reference speed comes back with the restitution e, so e² of the way: rigid and elastic stops, e = 0.5 (the
/// default), 0.8 and 1, every method of the bodies' and of joint coordinates. The throwing force changes the impulse by 0.2 %: 1 %, and 3 % by a method of order 2 at a tenth
/// of the tolerance.
#[test]
fn rebounds_have_the_restitution() {
    let speed = 0.447_21;
    let methods = [Integrator::Rodas4, Integrator::Radau5, Integrator::Sdirk4, Integrator::TrBdf2];
    for (stop, e) in [
        (format!("speed={speed}"), 0.5),
        (format!("restitution=0.8 speed={speed}"), 0.8),
        (format!("restitution=0.5 speed={speed} k=1e5"), 0.5),
        ("restitution=1".to_owned(), 1.0),
    ] {
        let compiled = thrown(&stop, &CompileOptions::default());
        for method in methods {
            let came = rebound(&compiled, method, None);
            let most = if method == Integrator::TrBdf2 { 0.03 } else { 0.01 };
            assert!((came / (e * e) - 1.0).abs() < most, "{stop} {method:?}: {came}");
        }
    }
    let joints = CompileOptions { formulation: Formulation::RcrElastic, ..CompileOptions::default() };
    let compiled = thrown(&format!("speed={speed}"), &joints);
    let came = rebound(&compiled, Integrator::Rodas4, None);
    assert!((came / 0.25 - 1.0).abs() < 0.01, "joint coordinates: {came}");
}

/// Parts come to rest on a rigid stop in joint coordinates as in those of the bodies. A mass on a spring has a first step into the stop that overflows, and the tip
/// of a beam one that throws it back. Contact begins at the same time within 5e-3; the schemes on two segments differ by 3e-3. Over the second half of the run the mass lies within 5 % of the stop and
/// the tip bounces within 30 %; neither goes further than 1 % into it.
#[test]
fn joint_coordinates_come_to_rest_on_stops() {
    let mass = "anchor * [f] []
        spring2d * [f a] [kx=1 l=8u]
        mass2d * [a] [m=1e-10]
        guide2d * [a] []
        f2d * [a] [F=10u]
        stop2d * [a] [gap=3u back=2u]";
    let beam = "process p = [ Youngsmodulus=160e9 density=2330 h=10u ]
        anchor p [f] []
        beam2d p [f a] [l=200u w=2u]
        f2d * [a] [F=2u oz=pi/2]
        stop2d * [a] [gap=1u oz=pi/2]";
    for (text, signal, gap, stop, near) in [(mass, "a.x", 3e-6, 40e-6, 0.05), (beam, "a.y", 1e-6, 60e-6, 0.3)] {
        for tol in [1e-2, 1e-3] {
            let touched = [Formulation::Compliant, Formulation::RcrElastic, Formulation::Rcr].map(|formulation| {
                let given = CompileOptions { tol, formulation, segments: Some(2), ..CompileOptions::default() };
                let options = TransientOptions {
                    stop,
                    points: 401,
                    tol,
                    signals: vec![signal.into()],
                    ..TransientOptions::default()
                };
                let (moving, _) = fitted_in_time(&model(text, &given), &options).unwrap();
                let result = run(&moving, &options).unwrap_or_else(|e| panic!("{signal} {formulation:?} {tol}: {e}"));
                let places = &result.signals[0].2[200..];
                let mean = places.iter().sum::<f64>() / places.len() as f64;
                let most = places.iter().copied().fold(0.0, f64::max);
                assert!(
                    (mean / gap - 1.0).abs() < near && most < 1.01 * gap,
                    "{signal} {formulation:?} {tol}: {mean} {most}"
                );
                result.events.iter().find(|e| e.contact && e.direction == Direction::Down).unwrap().t
            });
            assert!(touched.iter().all(|t| (t / touched[0] - 1.0).abs() < 5e-3), "{signal} {tol}: {touched:?}");
        }
    }
}

/// A tip that is close to its stop touches before the first output time of its run. Its mesh is that of the motion up to there: the first contact comes within the
/// tolerance of that in a run on 192 segments at a tenth of the tolerance, and the mesh has an estimate that holds. On one segment a beam, a tenth of the mass is at the tip, and
/// it touches ten times too soon.
#[test]
fn an_early_contact_finds_its_mesh() {
    let text = "process p = [ Youngsmodulus=165e9 density=2300 h=2u ]
        anchor p [f] []
        beam2d p [f a] [l=120u w=2u]
        beam2d p [a b] [l=75u w=2u]
        beam2d p [b c] [l=125u w=2u]
        f2d * [c] [F=4u oz=pi/2]
        stop2d * [c] [gap=0.07u k=1e5 restitution=0.3 oz=pi/2]";
    let first_contact = |tol: f64, segments: Option<usize>| {
        let given = CompileOptions { tol, segments, rotary_inertia: true, ..CompileOptions::default() };
        let stop = if segments.is_some() { 0.2e-6 } else { 10e-6 };
        let signals = vec!["c.y".into()];
        let options = TransientOptions { stop, points: 101, tol, signals, ..TransientOptions::default() };
        let (moving, _) = fitted_in_time(&model(text, &given), &options).unwrap();
        let end = TransientOptions { until: Some(Until::Contact), ..options };
        let contact = run(&moving, &end).unwrap().stopped_at.unwrap();
        (contact, moving.order.estimated_error)
    };
    let (exact, _) = first_contact(1e-4, Some(64));
    for tol in [1e-2, 1e-3] {
        let (contact, error) = first_contact(tol, None);
        assert!(contact < 10e-6 / 100.0, "{contact}");
        assert!((contact / exact - 1.0).abs() < tol, "{tol}: {contact} {exact}");
        assert!(error.is_some_and(|error| 0.0 < error && error <= tol), "{tol}: {error:?}");
    }
}

/// A plate on k = 1 N/m, m = 1e-10 kg, in front of an electrode 2 µm away that it pulls in on.
fn plate(impact: &str) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] []
        plategap2d * [m e] [A=1e-8 gap=2u {impact}]
        eground * [e] []
        drive port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

fn closing(method: Integrator, step: Option<f64>) -> TransientOptions<'static> {
    TransientOptions {
        stop: 100e-6,
        points: 2001,
        signals: vec!["m.x".into(), "m.vx".into()],
        voltages: vec![("drive".into(), 8.0)],
        method,
        step,
        ..TransientOptions::default()
    }
}

/// Methods that gain energy in contact end with an error at the contact that names one that does not; at ρ = 0 generalized-α stays; before a
/// contact nothing is refused.
#[test]
fn methods_that_gain_energy_are_refused() {
    let compiled = plate("");
    for method in [Integrator::Midpoint, Integrator::Newmark, Integrator::GeneralizedAlpha { rho: 0.8 }] {
        let error = run(&compiled, &closing(method, Some(20e-9))).unwrap_err().to_string();
        assert!(error.contains("gains energy") && error.contains("rodas4") && error.contains(method.name()), "{error}");
        let early = TransientOptions { stop: 1e-6, ..closing(method, Some(20e-9)) };
        assert!(run(&compiled, &early).is_ok());
    }
    let result = run(&compiled, &closing(Integrator::GeneralizedAlpha { rho: 0.0 }, Some(20e-9)));
    assert!(result.is_ok(), "{result:?}");
}

/// The discrete gradient gains no energy in contact, in steps of 5 to 80 ns across impacts of some 30 ns, elastic and
/// with loss. Kinetic energy and k·x²/2 − εAV²/(2(g − x)) stay below that at the start, within 1e-9 of the depth of the
/// fall.
#[test]
fn discrete_gradients_gain_no_energy() {
    let (mass, k, area, gap, volts) = (1e-10, 1.0, 1e-8, 2e-6, 8.0);
    let eps = crate::contact::EPS;
    let energy = |x: f64, v: f64| 0.5 * (mass * v * v + k * x * x - eps * area * volts * volts / (gap - x));
    let depth = energy(0.0, 0.0) - energy(gap - 1e-7, 0.0);
    for impact in ["restitution=1", ""] {
        let compiled = plate(impact);
        for step in [5e-9, 20e-9, 80e-9] {
            let options = TransientOptions { stop: 400e-6, ..closing(Integrator::AverageField, Some(step)) };
            let result = run(&compiled, &options).unwrap_or_else(|e| panic!("{impact} {step:e}: {e}"));
            let contacts = result.events.iter().filter(|e| e.contact).count();
            assert!(contacts > 4, "{impact} {step:e}: {contacts}");
            let back = result.signals[0].2.iter().fold(0.0, |a: f64, x| a.min(*x));
            assert!(energy(back, 0.0) - energy(0.0, 0.0) < 1e-9 * depth, "{impact} {step:e}: {back:e}");
        }
    }
}

/// With the default loss the plate is at rest on its electrode after 400 µs, in a few thousand steps, and no step fails.
#[test]
fn a_plate_comes_to_rest() {
    let compiled = plate("");
    let result = run(&compiled, &TransientOptions { stop: 400e-6, ..closing(Integrator::Rodas4, None) }).unwrap();
    assert!(result.counters.steps < 4000, "{:?}", result.counters);
    let last = result.signals[1].2.iter().rev().take(100).fold(0.0, |a: f64, v| a.max(v.abs()));
    assert!(last < 1e-3, "{last:e}");
}

/// A run ends at its event: first contact, first release, or a level during the motion, at the time of the whole run.
/// An event that it does not reach is reported.
#[test]
fn runs_end_at_their_events() {
    let compiled = plate("");
    let whole = run(&compiled, &closing(Integrator::Rodas4, None)).unwrap();
    let event = |direction| whole.events.iter().find(|e| e.contact && e.direction == direction).unwrap().t;
    for (until, t) in [(Until::Contact, event(Direction::Down)), (Until::Release, event(Direction::Up))] {
        let ended =
            run(&compiled, &TransientOptions { until: Some(until), ..closing(Integrator::Rodas4, None) }).unwrap();
        assert_eq!(ended.stopped_at, Some(t));
        assert!(ended.t.last().is_some_and(|last| *last <= t && t - last < 1e-7));
        assert!(ended.warnings.is_empty() && ended.events.last().is_some_and(|e| e.t == t));
    }
    let level = Until::Level("m.x".into(), 1e-6);
    let ended = run(&compiled, &TransientOptions { until: Some(level), ..closing(Integrator::Rodas4, None) }).unwrap();
    let at = ended.stopped_at.unwrap();
    let crossed = whole.t.windows(2).zip(whole.signals[0].2.windows(2)).find(|(_, x)| x[0] < 1e-6 && x[1] >= 1e-6);
    assert!(crossed.is_some_and(|(t, _)| t[0] <= at && at <= t[1]), "{at:e}");
    let never = TransientOptions { stop: 1e-6, until: Some(Until::Contact), ..closing(Integrator::Rodas4, None) };
    let ended = run(&compiled, &never).unwrap();
    assert!(ended.stopped_at.is_none() && ended.warnings[0].contains("contact"), "{:?}", ended.warnings);
}

/// With the default loss the tolerance holds to the end; bounces that lose nothing are reported as unreliable from a time after the first
/// contact, with means: of 100 elastic bounces no two runs have the same.
#[test]
fn claims_after_contact() {
    let reported = |impact: &str, stop: f64| {
        let compiled = plate(impact);
        let options = TransientOptions { stop, ..closing(Integrator::Rodas4, None) };
        let mut go =
            |o: &TransientOptions<'_>, s: &mut dyn FnMut(f64, &[f64]), w: bimorph::analysis::ProgressCallback<'_>| {
                transient(&compiled, o, s, w).map(|r| (r, ()))
            };
        with_step_error(&options, &compiled, &mut go, &mut |_, _| (), &mut |_| true).unwrap().0
    };
    let held = reported("", 200e-6);
    assert!(held.reliable_until.is_none() && held.after_contact.is_empty(), "{:?}", held.warnings);
    let lost = reported("restitution=1", 4e-3);
    let contact = lost.events.iter().find(|e| e.contact).unwrap().t;
    let until = lost.reliable_until.expect("elastic bounces do not hold");
    assert!(until >= contact && until < 4e-3, "{until:e}");
    assert_eq!(lost.after_contact.len(), 2);
    let x = &lost.after_contact[0];
    assert!(x.low < x.mean && x.mean < x.high && x.mean_error > 0.0 && x.mean_error < x.rms, "{x:?}");
    assert_eq!(lost.warnings.iter().filter(|w| w.starts_with("W049")).count(), 1, "{:?}", lost.warnings);
}

/// A cantilever that is released and strikes a stop is within its tolerance of a far finer run, or states until when it is: the mesh follows from the motion
/// before the contact. At 1e-2 it was off by 3e-2 and stated 1.2e-3.
#[test]
fn a_mesh_that_does_not_resolve_an_impact_is_stated() {
    let text = "process p1 = [Youngsmodulus=165e9 density=2300 h=2e-6]
        param F=0
        anchor p1 [a] []
        beam2d p1 [a b] [l=200u w=2u]
        stop2d * [b] [gap=2u oz=-pi/2 k=100 restitution=1]
        f2d * [b] [F=F oz=pi/2]";
    let run = |tol: f64| {
        let compiled = |force: f64| {
            let set = [("F".to_owned(), Setting::Number(force))].into();
            model(text, &CompileOptions { set, tol, ..CompileOptions::default() })
        };
        let (moving, bent) = (compiled(0.0), compiled(0.5e-6));
        let options = TransientOptions {
            stop: 10e-6,
            points: 101,
            signals: vec!["b.y".into()],
            tol,
            release: Some(&bent),
            ..TransientOptions::default()
        };
        let (moving, start) = fitted_in_time(&moving, &options).unwrap();
        let options = options.with_release(start.as_ref());
        let mut go =
            |o: &TransientOptions<'_>, s: &mut dyn FnMut(f64, &[f64]), w: bimorph::analysis::ProgressCallback<'_>| {
                transient(&moving, o, s, w).map(|r| (r, ()))
            };
        with_step_error(&options, &moving, &mut go, &mut |_, _| (), &mut |_| true).unwrap().0
    };
    let exact = run(1e-5);
    let y = |result: &TransientResult| result.signals[0].2.clone();
    let range = y(&exact).iter().fold([f64::INFINITY, -f64::INFINITY], |[low, high], y| [low.min(*y), high.max(*y)]);
    let mut stated = 0;
    for tol in [1e-2, 1e-3, 1e-4] {
        let found = run(tol);
        let squares: f64 = y(&found).iter().zip(y(&exact)).map(|(a, b)| (a - b) * (a - b)).sum();
        let error = (squares / 101.0).sqrt() / (0.5 * (range[1] - range[0]));
        assert!(error <= tol || found.reliable_until.is_some(), "{tol:e}: {error:e}");
        stated += u32::from(found.reliable_until.is_some_and(|t| t >= 4.5e-6));
        assert!(found.reliable_until.is_none() || error > 0.1 * tol, "{tol:e}: {error:e}");
    }
    assert!(stated > 0);
}

/// Errors of the closing times of random parts at 1.05 to 1.6 times their pull-in voltage, at the default tolerance, ascending; the
/// references are runs at 1e-7.
fn closing_errors(count: usize) -> Vec<f64> {
    let mut random = Numbers(5);
    let mut errors: Vec<f64> = (0..count)
        .map(|case| {
            let compiled = random_part(case, &mut random);
            let volts = random.between(1.05, 1.6) * pull_in(&compiled, None, 1000.0).unwrap().pull_in_v;
            let period = 1.0 / modes(&compiled, 1, &[]).unwrap().frequencies_hz[0];
            let options = |tol: f64| TransientOptions {
                stop: 200.0 * period,
                points: 1001,
                signals: vec![["m.x", "b.y", "b.y", "e(2).y"][case % 4].into()],
                tol,
                voltages: vec![("drive".into(), volts)],
                until: Some(Until::Contact),
                ..TransientOptions::default()
            };
            let (moving, _) = fitted_in_time(&compiled, &options(1e-3)).unwrap_or_else(|e| panic!("{case}: {e}"));
            let closed = |tol: f64| {
                let result = run(&moving, &options(tol)).unwrap_or_else(|e| panic!("{case}: {e}"));
                result.stopped_at.unwrap_or_else(|| panic!("{case} does not close"))
            };
            (closed(1e-3) / closed(1e-7) - 1.0).abs()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Closing times at the default tolerance are within 1e-3 of those at 1e-7, in the median of random parts, and within 3e-3 in all.
#[test]
fn closing_times() {
    let errors = closing_errors(12);
    assert!(errors[6] < 1e-3 && errors[11] < 3e-3, "{errors:?}");
}

/// The same of a hundred: `cargo test --release --test physics hundred_closings -- --ignored --nocapture`.
#[test]
#[ignore = "a table"]
fn hundred_closings() {
    let errors = closing_errors(100);
    println!("median {:.1e}, 90th {:.1e}, worst {:.1e}", errors[50], errors[90], errors[99]);
    assert!(errors[50] < 1e-3 && errors[99] < 3e-3, "{errors:?}");
}

/// A cantilever of one segment a beam, whose sections are drawn without inertia, meets a stop under voltage: it closes and stays closed, and no step
/// shrinks. Where sections follow the force at once, steps fell to 1e-21 s.
#[test]
fn a_tip_without_inertia_meets_a_stop() {
    let text = "
        process m = [Youngsmodulus=78e9 density=19300 h=30u Poisson=0.3]
        anchor m [r] []
        beam2d m [r e(0)] [l=60u w=2u]
        for i=1:5 [
          beam2d m [e(i-1) e(i)] [l=20u w=2u]
          gap2dforce m [e(i-1) e(i) s(i-1) s(i)] [l=20u w=2u gap=2u touch=0.1u permittivity=8.854e-12]
          wire * [e(i-1) e(i)] []
          wire * [s(i-1) s(i)] []
          anchor m [s(i-1)] []
        ]
        anchor m [s(5)] []
        beam2d m [e(5) tip] [l=40u w=2u]
        stop2d * [tip] [gap=1.6u oz=-pi/2 A=1e-11]
        eground * [e(0)] []
        gate port * [s(0)] []";
    let compiled = model(text, &CompileOptions { segments: Some(1), ..CompileOptions::default() });
    let options = TransientOptions {
        stop: 40e-6,
        points: 401,
        signals: vec!["tip.y".into()],
        voltages: vec![("gate".into(), 30.0)],
        ..TransientOptions::default()
    };
    let (moving, _) = fitted_in_time(&compiled, &options).unwrap();
    let result = run(&moving, &options).unwrap_or_else(|e| panic!("{e}"));
    // it rattles on the stop at 1.6 µm, which has no tolerance pointwise
    let late = &result.signals[0].2[200..];
    assert!(late.iter().all(|y| (-1.63e-6..-1.4e-6).contains(y)), "{late:?}");
    assert!(
        result.signals[0].2.iter().all(|y| *y < 0.05e-6) && result.counters.steps < 20_000,
        "{:?}",
        result.counters
    );
}

/// A point without mass on a spring of 50 N/m meets a stop ahead of a mass of 1e-10 kg that 3 µN push. By every method
/// permitted in contact the mass finally rests at (F + k_t·w)/(k + k_t), with w = 2 µm the travel of the point, within
/// 1e-3.
#[test]
fn a_point_without_mass_meets_a_stop() {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        damper2d * [f m] [bx=2e-5]
        spring2d * [m t] [kx=50]
        guide2d * [t] []
        f2d * [m] [F=3u]
        stop2d * [t] [gap=2u]";
    let compiled = model(text, &CompileOptions::default());
    for method in [Integrator::Rodas4, Integrator::Radau5, Integrator::TrBdf2, Integrator::Sdirk4] {
        let options = TransientOptions {
            stop: 100e-6,
            points: 101,
            signals: vec!["m.x".into()],
            method,
            ..TransientOptions::default()
        };
        let (moving, _) = fitted_in_time(&compiled, &options).unwrap();
        let result = run(&moving, &options).unwrap_or_else(|e| panic!("{method:?}: {e}"));
        let last = result.signals[0].2.last().unwrap();
        let rest = (3e-6 + 50.0 * 2e-6) / 51.0;
        assert!((last / rest - 1.0).abs() < 1e-3 && result.counters.steps < 5000, "{method:?}: {last:e} for {rest:e}");
    }
}

/// A guided plate that closes at any angle closes when it does along x, and rests as far from its drawn place. Beside a contact, the pivot of what a guide
/// at an angle holds was rounding: steps fell to 1e-21 s.
#[test]
fn a_plate_closes_at_any_angle() {
    let closed = |angle: f64| {
        let text = format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-10 J=1e-20 b=2e-6]
            guide2d * [m] [oz={angle}]
            spring2d * [f m] [kx=1 oz={angle}]
            anchor * [e] []
            plategap2d * [m e] [A=1e-8 gap=2u oz={angle}]
            eground * [e] []
            drive port * [m e] []"
        );
        let options = TransientOptions {
            stop: 60e-6,
            points: 601,
            signals: vec!["m.x".into(), "m.y".into()],
            voltages: vec![("drive".into(), 16.0)],
            ..TransientOptions::default()
        };
        let compiled = model(&text, &CompileOptions::default());
        let result = run(&compiled, &options).unwrap_or_else(|e| panic!("{angle}: {e}"));
        let last = |k: usize| *result.signals[k].2.last().unwrap();
        (result.events[0].t, last(0).hypot(last(1)))
    };
    let (t, x) = closed(0.0);
    for k in 1..24 {
        let angle = std::f64::consts::TAU * f64::from(k) / 24.0 + 0.01;
        let (found, way) = closed(angle);
        assert!(
            (found / t - 1.0).abs() < 1e-4 && (way / x - 1.0).abs() < 1e-4,
            "{angle}: {found:e} {way:e} for {t:e} {x:e}"
        );
    }
}

/// Equal steps that are too long for an impact give energy by any method but avf: the run ends with an error that names
/// what helps. A mass released 2 µm from rest came back 3 µm high, at a restitution of 0.5.
#[test]
fn energy_from_long_steps_is_refused() {
    let text = |load: &str| {
        format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-10 J=1e-20]
            guide2d * [m] []
            spring2d * [f m] [kx=1]
            stop2d * [m] [gap=1u speed=0.1732]
            f2d * [m] [F={load}]"
        )
    };
    let [drawn, loaded] = ["0", "-2u"].map(|load| model(&text(load), &CompileOptions::default()));
    let options = |method, step| TransientOptions {
        stop: 100e-6,
        signals: vec!["m.x".into()],
        release: Some(&loaded),
        method,
        step: Some(step),
        ..TransientOptions::default()
    };
    let error = run(&drawn, &options(Integrator::Sdirk4, 70e-9)).unwrap_err().to_string();
    assert!(error.contains("at an impact") && error.contains("--method avf"), "{error}");
    for (method, step) in [(Integrator::AverageField, 50e-9), (Integrator::Sdirk4, 1e-9)] {
        let result = run(&drawn, &options(method, step)).unwrap_or_else(|e| panic!("{method:?}: {e}"));
        let highest = result.signals[0].2.iter().fold(0.0, |a: f64, x| a.min(*x));
        assert!((-2.001e-6..-1.999e-6).contains(&highest), "{method:?}: {highest:e}");
    }
}

/// A step whose stages touch and whose ends do not: a plate that pulls in was thrown 400 µm away from a gap of 2 µm. The energy that it was given
/// ends the run.
#[test]
fn energy_from_contact_within_a_step_is_refused() {
    let text = "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] []
        gap plategap2d * [m e] [A=1e-8 gap=2u touch=0.2u restitution=1 speed=0.1]
        eground * [e] []
        drive port * [m e] []";
    let compiled = model(text, &CompileOptions::default());
    let mut ended = 0;
    for step in [0.2e-6, 0.3e-6, 0.5e-6, 1e-6] {
        let options = TransientOptions {
            stop: 200e-6,
            signals: vec!["m.x".into()],
            voltages: vec![("drive".into(), 7.0)],
            method: Integrator::Sdirk4,
            step: Some(step),
            ..TransientOptions::default()
        };
        match run(&compiled, &options) {
            Err(error) => ended += usize::from(error.to_string().contains("take a shorter --step")),
            Ok(result) => {
                let farthest = result.signals[0].2.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                assert!(farthest < 2.1e-6, "{step:e}: {farthest:e}");
            }
        }
    }
    assert!(ended > 0, "no step gave energy: the test shows nothing");
}
