//! Integrators: orders, energy, stability, work, and that they all find the same motion.

use crate::{ARM, model};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::domains::{Ramp, System};
use bimorph::netlist::Setting;
use bimorph::solve::SolveError;
use bimorph::solve::adaptive::Control;
use bimorph::solve::baseline::Solver;
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::event::Direction;
use bimorph::solve::linear::Recursion;
use bimorph::solve::method::{Motion, SolverCounters};
use bimorph::solve::path::SourcePath;

/// A plate on a spring and a damper that a ramp of 2 V to 4 V pulls at (k = 1 N/m, m = 1e-10 kg, A = 1e-8 m², g = 2 µm).
const PLATE: &str = "
    anchor * [f] [l=1u w=1u h=1u]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    spring2d * [f m] [kx=1]
    damper2d * [f m] [bx=2e-6]
    anchor * [e] [l=1u w=1u h=1u]
    plategap2d * [m e] [A=1e-8 gap=2u]
    eground * [e] []
    drive port * [m e] []";

/// Three of [`ARM`] on one yoke, pulled by a force F along y at its end.
const BANK: &str = "
    param F=0
    arm p1 [y1] []
    arm p1 [y2] []
    arm p1 [y3] []
    beam2d p1 [y1 y2] [l=49.5u w=11u oz=pi/2]
    beam2d p1 [y2 y3] [l=49.5u w=11u oz=pi/2]
    f2d * [y1] [F=F oz=pi/2]";

const ALL: [Integrator; 10] = [
    Integrator::Rodas4,
    Integrator::AverageField,
    Integrator::Midpoint,
    Integrator::TrBdf2,
    Integrator::GeneralizedAlpha { rho: 0.8 },
    Integrator::GeneralizedAlpha { rho: 1.0 },
    Integrator::Newmark,
    Integrator::Radau5,
    Integrator::Rk45,
    Integrator::Sdirk4,
];

fn run(
    system: &System,
    volts: (&[f64], &[f64]),
    motion: &mut Motion,
    (method, stop, control): (Integrator, f64, Control),
) -> (Result<(), SolveError>, SolverCounters) {
    let rise = vec![0.0; system.electrics.heating.states()];
    let ramp = Ramp::new(&system.electrics, volts.0, volts.1, &rise, stop);
    let solver = Solver::Recursion(Recursion);
    let (end, work) = method.advance(system, solver, &ramp, motion, 1e-9, control, &mut |_, _, _, _| true);
    (end.map(|_| ()), work)
}

/// The bank free to move, and its static displacement under 25 µN.
fn released_bank() -> (CompiledModel, Motion) {
    let at = |force: f64| {
        let set = vec![("F".to_owned(), Setting::Number(force))];
        model(&format!("{ARM}{BANK}"), &CompileOptions { set, undamped: true, ..CompileOptions::default() })
    };
    let (held, free) = (at(25e-6), at(0.0));
    let system = &held.parts.system;
    let mut start = Motion::zeros(system.bodies());
    let path = SourcePath::new(&system.electrics, &[], &[], [0.0, 1.0]);
    Equilibrium::new(system, EquilibriumOptions::default()).follow(system, &path, &mut start.q).unwrap();
    (free, start)
}

fn energy(system: &System, motion: &Motion) -> f64 {
    system.energy(&motion.q, &motion.v, &system.electrics.drive())
}

/// Energy gained, relative to the strain energy released, after `stop` in equal steps.
fn drift(
    bank: &(CompiledModel, Motion),
    method: Integrator,
    step: f64,
    stop: f64,
) -> Result<(f64, SolverCounters), SolveError> {
    let (system, mut motion) = (&bank.0.parts.system, bank.1.clone());
    let before = energy(system, &motion);
    let (end, work) = run(system, (&[], &[]), &mut motion, (method, stop, Control::Fixed(step)));
    end.map(|()| (energy(system, &motion) / before - 1.0, work))
}

/// Halving the step divides the error by 2^p on a driven, damped, nonlinear oscillator, with p = 2, 4 or 5 as published for
/// each method; the reference is Radau5 in 6400 steps.
#[test]
fn orders() {
    let compiled = model(PLATE, &CompileOptions::default());
    let system = &compiled.parts.system;
    let end = |method, steps: u32| {
        let mut motion = Motion::zeros(1);
        let stop = 4e-5;
        run(system, (&[2.0], &[4.0]), &mut motion, (method, stop, Control::Fixed(stop / f64::from(steps)))).0.unwrap();
        motion.q[0].x
    };
    let exact = end(Integrator::Radau5, 6400);
    for method in ALL {
        let (order, counts) = match method {
            Integrator::Rodas4 | Integrator::Sdirk4 => (4.0, [50, 100, 200]),
            Integrator::Radau5 => (5.0, [20, 40, 80]),
            Integrator::Rk45 => (5.0, [50, 100, 200]),
            _ => (2.0, [100, 200, 400]),
        };
        let errors = counts.map(|n| (end(method, n) - exact).abs());
        for pair in errors.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            println!("{method:?}: slope {slope:.2} of {errors:?}");
            assert!((slope - order).abs() < 0.3, "{method:?}: {slope} of {errors:?}");
        }
    }
}

/// Undamped motion of the bank over 1 ms in steps of 0.5 µs: the average vector field keeps the energy to 1e-8; beside it
/// the drift of the others, which the theory quotes. Twice the same run gives the same bits.
#[test]
fn energy_over_a_millisecond() {
    let bank = released_bank();
    let of = |method| drift(&bank, method, 0.5e-6, 1e-3).unwrap();
    let (kept, work) = of(Integrator::AverageField);
    println!("avf {kept:.2e} {work:?}");
    assert!(kept.abs() <= 1e-8, "{kept:e}");
    assert_eq!(work.steps, 2000);
    assert_eq!(of(Integrator::AverageField), (kept, work));
}

/// The bank with rotary inertia in every body, as an explicit method needs it.
fn with_rotary_inertia(system: &System) -> System {
    let mut system = system.clone();
    for body in &mut system.model.bodies {
        if body.inertia == 0.0 {
            // r² = w²/12 of a beam 2 µm wide
            body.inertia = body.mass * 4e-12 / 12.0;
        }
    }
    system
}

/// All methods find the same motion of the bank at 5 µs, each within what its tolerance of 1e-6 a step allows; and the work
/// each takes is pinned.
#[test]
fn one_motion() {
    let (compiled, start) = released_bank();
    let system = &with_rotary_inertia(&compiled.parts.system);
    let end = |method, tol| {
        let mut motion = start.clone();
        let (end, work) = run(system, (&[], &[]), &mut motion, (method, 5e-6, Control::Tolerance(tol)));
        end.unwrap();
        (motion, work)
    };
    let size = |m: &Motion| m.q.iter().map(|q| q.xy().norm_squared()).sum::<f64>().sqrt();
    let (exact, _) = end(Integrator::Radau5, 1e-9);
    let mut pinned = Vec::new();
    for method in ALL {
        let (mut found, work) = end(method, 1e-6);
        for (a, b) in found.q.iter_mut().zip(&exact.q) {
            *a -= b;
        }
        let error = size(&found) / size(&start);
        println!("{method:?}: {error:.2e} {work:?}");
        assert!(error < 2e-4, "{method:?}: {error:e}");
        pinned.push((work.steps, work.rejected, work.factorizations, work.solves, work.forces, work.iterations));
    }
    #[rustfmt::skip]
    let known = [
        (850, 9, 859, 5154, 5154, 0),
        (1345, 1, 8076, 8076, 16152, 8076),
        (1345, 1, 8076, 8076, 8076, 8076),
        (711, 23, 2936, 3670, 3670, 2936),
        (1274, 5, 7678, 7678, 7678, 7678),
        (1345, 1, 8080, 8080, 8080, 8080),
        (1345, 1, 8080, 8080, 8080, 8080),
        (772, 67, 1678, 4195, 5873, 1678),
        (8109, 54, 0, 0, 48979, 0),
        (1137, 0, 11370, 12507, 11370, 11370),
    ];
    assert_eq!(pinned, known);
}

/// Steps of 2 µs are too long for methods without damping. On the undamped bank Newmark's rule and generalized-α with ρ
/// = 1, which are one method, gain more than a hundredth of the energy, and the midpoint rule more than a tenth. Then
/// no step can be taken any more, all within a millisecond. The error names time, step and body. (Generalized-α with ρ
/// = 1 gained 79 % when it held the mean of the forces at both ends to zero where there is no inertia, and Newmark's
/// rule when it began with M⁻¹ of the forces: noise that nothing damps.) Generalized-α with ρ = 0.8 completes at 1 µs,
/// and loses energy.
#[test]
fn long_steps() {
    let bank = released_bank();
    let undamped =
        [(Integrator::Newmark, 0.01), (Integrator::GeneralizedAlpha { rho: 1.0 }, 0.01), (Integrator::Midpoint, 0.1)];
    for (method, least) in undamped {
        match drift(&bank, method, 2e-6, 1e-3) {
            Err(SolveError::StepFailed { t, dt, body, .. }) => {
                assert!(t > 0.0 && t < 1e-3 && (dt / 2e-6 - 1.0).abs() < 1e-6);
                assert!(bank.0.parts.system.model.bodies.iter().any(|b| b.name.to_string() == body));
                let gained = drift(&bank, method, 2e-6, t).unwrap().0;
                println!("{method:?}: {gained:.2} gained until {t:e} s, where \"{body}\" stops it");
                assert!(gained > least, "{method:?}: {gained}");
            }
            other => panic!("{method:?}: {other:?}"),
        }
    }
    let damped = drift(&bank, Integrator::GeneralizedAlpha { rho: 0.8 }, 1e-6, 1e-3).unwrap().0;
    assert!((-0.5..0.0).contains(&damped), "{damped}");
}

/// An explicit method refuses bodies without rotary inertia, and says which, in which direction, and what to do.
#[test]
fn explicit_needs_inertia() {
    let (compiled, start) = released_bank();
    let control = Control::Tolerance(1e-6);
    let system = &compiled.parts.system;
    let error = run(system, (&[], &[]), &mut start.clone(), (Integrator::Rk45, 1e-6, control)).0.unwrap_err();
    assert!(matches!(error, SolveError::Massless { direction: "about z", .. }), "{error}");
    assert!(error.to_string().contains("rotary_inertia"), "{error}");
}

/// A plate on a spring (ω = 1e5 rad/s), released, passes its middle at (k + ½)π/ω, down and up in turn, within 1e-7 of
/// a period. Over 8 V, above its pull-in, it comes into contact, 0.1 µm before the gap is closed, after it has passed 1
/// µm.
#[test]
fn events() {
    let text = "param F=0\nanchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []
        spring2d * [f m] [kx=1]\nf2d * [m] [F=F]";
    let (held, free) =
        (model(&text.replace("F=0", "F=1u"), &CompileOptions::default()), model(text, &CompileOptions::default()));
    let asked = TransientOptions {
        stop: 2e-4,
        tol: 1e-6,
        release: Some(&held),
        events: vec![("m.x".into(), 0.0)],
        ..TransientOptions::default()
    };
    let found = transient(&free, &asked, &mut |_, _| {}, &mut |_| true).unwrap().events;
    assert_eq!(found.len(), 6);
    for (k, event) in found.iter().enumerate() {
        let exact = (k as f64 + 0.5) * std::f64::consts::PI / 1e5;
        assert!((event.t - exact).abs() < 1e-7 * 6.3e-5, "{}: {:e}", event.t, event.t - exact);
        assert_eq!(event.direction, if k % 2 == 0 { Direction::Down } else { Direction::Up });
    }

    let compiled = model(PLATE, &CompileOptions::default());
    let asked = TransientOptions {
        stop: 3e-4,
        voltages: vec![("drive".into(), 8.0)],
        events: vec![("m.x".into(), 1e-6)],
        ..TransientOptions::default()
    };
    let found = transient(&compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap().events;
    let reported: Vec<_> = found.iter().map(|e| (e.contact, e.direction, e.level)).take(2).collect();
    assert_eq!(reported, [(false, Direction::Up, 1e-6), (true, Direction::Down, 1e-7)], "{found:?}");
    assert!(found[0].t < found[1].t && found[1].signal.ends_with(".gap"));
}

/// The residual is the gradient of the potential, with voltage, contact and load: central differences of 1e-12 m and rad.
#[test]
fn potential_and_residual() {
    let compiled = model(&format!("{PLATE}\nf2d * [m] [F=3u]"), &CompileOptions::default());
    let system = &compiled.parts.system;
    let mut drive = system.electrics.drive();
    drive.volts.fill(3.0);
    for x in [0.4e-6, 1.93e-6] {
        let at = |x: f64| [nalgebra::Vector3::new(x, 0.0, 0.0)];
        let slope = (system.potential(&at(x + 1e-12), &drive) - system.potential(&at(x - 1e-12), &drive)) / 2e-12;
        let mut r = at(0.0);
        system.residual(&at(x), &drive, &mut r);
        assert!((slope / r[0].x - 1.0).abs() < 1e-5, "{x}: {slope:e} {:e}", r[0].x);
    }
}

/// The table of the theory: energy drift, work and error of every method on the bank.
#[test]
#[ignore = "prints the table of docs/project/benchmarks.md"]
fn table() {
    let bank = released_bank();
    println!("{} unknowns", bank.0.parts.system.model.unknowns());
    for step in [1e-6, 0.5e-6, 0.25e-6, 0.1e-6] {
        for method in ALL {
            if method == Integrator::Rk45 {
                continue;
            }
            match drift(&bank, method, step, 1e-3) {
                Ok((gain, w)) => println!(
                    "{step:.2e} {method:?}: {gain:.2e}; {} factorizations {} solves {} forces",
                    w.factorizations, w.solves, w.forces
                ),
                Err(error) => println!("{step:.2e} {method:?}: {error}"),
            }
        }
    }
}

/// A cantilever released at its tip stays within its initial deflection by every method, at the times between steps as
/// well. Generalized-α began with M⁻¹ of the forces, which threw the light body at the tip 250 times as far; in equal
/// steps it failed.
#[test]
fn a_released_part_is_not_thrown() {
    let text = "param F=1u\nanchor p1 [r] []\nb beam2d p1 [r t] [l=100u w=2u]\nf2d * [t] [F=F oz=pi/2]\n";
    let options = |force: f64| CompileOptions {
        segments: Some(4),
        set: vec![("F".to_owned(), Setting::Number(force))],
        ..CompileOptions::default()
    };
    let (start, moving) = (model(text, &options(1e-6)), model(text, &options(0.0)));
    let run = |method: Integrator, step: Option<f64>| {
        let options = TransientOptions {
            stop: 5e-6,
            signals: vec!["t.y".into()],
            points: 401,
            release: Some(&start),
            method,
            step,
            ..TransientOptions::default()
        };
        transient(&moving, &options, &mut |_, _| {}, &mut |_| true).unwrap().signals.remove(0).2
    };
    let reference = run(Integrator::Rodas4, None);
    let most = reference[0].abs();
    for rho in [0.0, 0.8, 1.0] {
        for step in [None, Some(1e-9), Some(1e-8)] {
            let found = run(Integrator::GeneralizedAlpha { rho }, step);
            let off = found.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / most;
            println!("{rho} {step:?}: {off:.1e}");
            assert!(off <= 2e-2, "{rho} {step:?}: {off:e}");
        }
    }
}
