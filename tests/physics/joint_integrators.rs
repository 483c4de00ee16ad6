//! Implicit methods in joint coordinates: orders, work, stiffness, contact, and that they find the motion that the explicit
//! one and the other formulation find.

use crate::{ARM, model};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::formulation::{Formulation, coordinate_scales, linkage};
use bimorph::analysis::integrator::{IntegrationRun, Integrator};
use bimorph::analysis::joint_transient::{JointReport, joint_transient};
use bimorph::analysis::transient::{TransientOptions, TransientResult, Until, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::domains::Ramp;
use bimorph::equations::constrained::Constrained;
use bimorph::equations::loads::JointLoads;
use bimorph::netlist::Setting;
use bimorph::solve::adaptive::Control;
use bimorph::solve::method::Motion;

/// Two of [`ARM`] on a yoke, pulled by F at its end.
const BANK: &str = "
    param F=0
    arm p1 [y1] []
    arm p1 [y2] []
    beam2d p1 [y1 y2] [l=49.5u w=11u oz=pi/2]
    f2d * [y1] [F=F oz=pi/2]";

const ALL: [Integrator; 5] = [
    Integrator::TrBdf2,
    Integrator::Sdirk4,
    Integrator::Midpoint,
    Integrator::Newmark,
    Integrator::GeneralizedAlpha { rho: 0.8 },
];

fn undamped(text: &str, force: f64, rotary_inertia: bool) -> CompiledModel {
    let set = vec![("F".to_owned(), Setting::Number(force))];
    model(&format!("{ARM}{text}"), &CompileOptions { set, undamped: true, rotary_inertia, ..CompileOptions::default() })
}

fn asked(stop: f64, signal: &str, method: Integrator, tol: f64) -> TransientOptions<'static> {
    TransientOptions { stop, signals: vec![signal.into()], points: 51, tol, method, ..TransientOptions::default() }
}

fn joints(
    compiled: &CompiledModel,
    kind: Formulation,
    options: &TransientOptions<'_>,
) -> (TransientResult, JointReport) {
    joint_transient(compiled, kind, options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
}

/// Largest difference of the first signals over the largest value.
fn apart(a: &TransientResult, b: &TransientResult) -> f64 {
    let (a, b) = (&a.signals[0].2, &b.signals[0].2);
    let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

/// The bank in joint coordinates after `stop` in equal steps of `h`, from rates that its loops allow: coordinates.
fn struck(compiled: &CompiledModel, method: Integrator, stop: f64, h: f64) -> (Vec<f64>, u64) {
    let system = &compiled.parts.system;
    let linkage = linkage(Formulation::Rcr, system).unwrap();
    let n = linkage.coordinates;
    let ramp = Ramp::new(&system.electrics, &[], &[], &[], stop);
    let scale = coordinate_scales(&linkage, system.length_scale);
    let mut equations = Constrained::new(&linkage, JointLoads::new(system, &linkage, &ramp), &scale, stop);
    let mut now = Motion::zeros(n);
    now.v.iter_mut().zip(&scale).for_each(|(v, s)| *v = 2e6 * s);
    equations.project(0.0, &mut now);
    let corners = Vec::new();
    let run =
        IntegrationRun { motion: &mut now, h, control: Control::Fixed(h), observe: &mut |_, _, _, _| true, corners };
    let (end, work) = method.rule().unwrap().advance(&mut equations, run);
    end.unwrap();
    (now.q, work.iterations)
}

/// Halving equal steps divides the error by 2² for the methods of order two and by 2⁴ for SDIRK4, on a bank of two that
/// was struck, loops closed on the way; every method comes to the same motion.
#[test]
fn orders() {
    let compiled = undamped(BANK, 0.0, false);
    let stop = 4e-7;
    let (exact, _) = struck(&compiled, Integrator::Sdirk4, stop, stop / 640.0);
    for rule in ALL {
        let (order, counts) = if rule == Integrator::Sdirk4 { (4.0, [40.0, 80.0]) } else { (2.0, [160.0, 320.0]) };
        let errors = counts.map(|count| {
            let (q, _) = struck(&compiled, rule, stop, stop / count);
            q.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        });
        let slope = (errors[0] / errors[1]).log2();
        println!("{rule:?}: {slope:.2} of {errors:?}");
        assert!((slope - order).abs() < 0.35, "{rule:?}: {slope} of {errors:?}");
    }
}

/// The rotary bank released from 20 µN: every implicit method finds the motion of explicit steps, and the work of each
/// is pinned. SDIRK4 at the same tolerance comes closest.
#[test]
fn one_motion() {
    let (held, free) = (undamped(BANK, 2e-5, false), undamped(BANK, 0.0, false));
    let options = |method, tol| TransientOptions { release: Some(&held), ..asked(1e-5, "y1.y", method, tol) };
    let (exact, explicit) = joints(&free, Formulation::Rcr, &options(Integrator::Rk45, 1e-5));
    let mut pinned = Vec::new();
    for method in ALL {
        let (found, report) = joints(&free, Formulation::Rcr, &options(method, 1e-3));
        let off = apart(&exact, &found);
        println!("{}: {off:.2e} {:?} of {}", method.name(), found.counters, explicit.accelerations);
        assert!(off < 2e-3, "{}: {off:e}", method.name());
        assert!(report.largest_gap_m < 1e-15, "{:e}", report.largest_gap_m);
        pinned.push((found.counters.steps, found.counters.rejected, found.counters.iterations));
    }
    assert_eq!(pinned, [(1304, 52, 5422), (1156, 3, 11583), (1452, 24, 8856), (1451, 19, 8821), (1454, 40, 8965)]);
}

/// With every direction elastic, axial motions are a thousand times faster than what the yoke does. Implicit steps
/// exceed them. Equal ones of 50 ns, twenty times the explicit limit, give the yoke's motion within 2e-3 at a seventh
/// of the evaluations or less, by either order. Explicit and implicit under error control, and the bodies' own
/// coordinates, agree within 5e-4.
#[test]
fn stiff_directions_cost_no_steps() {
    let compiled = undamped(BANK, 2e-5, true);
    let of = |method| joints(&compiled, Formulation::RcrElastic, &asked(1e-5, "y1.y", method, 1e-3)).0;
    let (explicit, implicit) = (of(Integrator::Rk45), of(Integrator::TrBdf2));
    let bodies = transient(&compiled, &asked(1e-5, "y1.y", Integrator::Rodas4, 1e-3), &mut |_, _| {}, &mut |_| true);
    let (off, other) = (apart(&explicit, &implicit), apart(&bodies.unwrap(), &implicit));
    println!("{off:e} {other:e} {:?} {:?}", explicit.counters, implicit.counters);
    assert!(off < 5e-4 && other < 5e-4, "{off:e} {other:e}");
    for method in [Integrator::TrBdf2, Integrator::Sdirk4] {
        let options = TransientOptions { step: Some(5e-8), ..asked(1e-5, "y1.y", method, 1e-3) };
        let (long, _) = joints(&compiled, Formulation::RcrElastic, &options);
        let off = apart(&explicit, &long);
        println!("{}: {off:e} {:?}", method.name(), long.counters);
        assert!(off < 2e-3, "{}: {off:e}", method.name());
        assert!(long.counters.iterations * 7 < explicit.counters.forces, "{:?}", long.counters);
    }
}

/// A plate on a spring (k = 1 N/m, m = 1e-10 kg, A = 1e-8 m², g = 2 µm) over 8 V, above its pull-in. Stages in joint
/// coordinates include the softening of the gap and the stiff contact. The plate passes 1 µm and comes into contact,
/// 0.1 µm before the gap is closed, within 1e-4 of the times in the bodies' own coordinates.
#[test]
fn pull_in_and_contact() {
    let text = "
        anchor * [f] [l=1u w=1u h=1u]
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        damper2d * [f m] [bx=2e-6]
        anchor * [e] [l=1u w=1u h=1u]
        plategap2d * [m e] [A=1e-8 gap=2u]
        eground * [e] []
        drive port * [m e] []";
    let compiled = model(text, &CompileOptions::default());
    let options = |method| TransientOptions {
        voltages: vec![("drive".into(), 8.0)],
        events: vec![("m.x".into(), 1e-6)],
        until: Some(Until::Contact),
        ..asked(1.5e-4, "m.x", method, 1e-4)
    };
    let bodies = transient(&compiled, &options(Integrator::Rodas4), &mut |_, _| {}, &mut |_| true).unwrap();
    println!("rodas4 on bodies: {:?}", bodies.counters);
    for method in ALL {
        let (found, _) = joints(&compiled, Formulation::RcrElastic, &options(method));
        println!("{}: {:?}", method.name(), found.counters);
        assert!(found.events.len() >= 2 && bodies.events.len() >= 2 && found.events[1].contact);
        for (a, b) in found.events.iter().zip(&bodies.events).take(2) {
            assert_eq!((a.contact, a.direction), (b.contact, b.direction));
            assert!((a.t / b.t - 1.0).abs() < 1e-4, "{}: {:e} {:e}", method.name(), a.t, b.t);
        }
    }
}

/// A bimorph whose hot arm is heated, with joint lengths prescribed by the heat (time constant 2 µs). Every implicit
/// method closes the loop at the lengths of the end of its step, and gives the motion of explicit steps within five
/// times the tolerance. (Stages do not see the lengths change; without counting how far they move the end of a step,
/// one step went through all of it.)
#[test]
fn heated_lengths() {
    let text = "
        anchor p1 [a] [l=10u w=10u oz=pi]
        hot beam2det p1 [a t] [l=206u w=2u tau=2u]
        bar beam2det p1 [t c] [l=23u w=13u oz=-pi/2 tau=2u]
        cold beam2det p1 [c g] [l=206u w=8u oz=pi tau=2u]
        anchor p1 [g] [l=10u w=10u oz=pi]
        eground * [g] []
        heat port * [a] []";
    let compiled = model(text, &CompileOptions::default());
    let options =
        |method, tol| TransientOptions { voltages: vec![("heat".into(), 3.0)], ..asked(6e-6, "t.y", method, tol) };
    let (exact, _) = joints(&compiled, Formulation::Rcr, &options(Integrator::Rk45, 1e-4));
    for method in ALL {
        let (found, report) = joints(&compiled, Formulation::Rcr, &options(method, 1e-3));
        let off = apart(&exact, &found);
        println!("{}: {off:.2e} {:e} {:?}", method.name(), report.largest_gap_m, found.counters);
        assert!(off < 5e-3, "{}: {off:e}", method.name());
        assert!(report.largest_gap_m < 1e-15, "{:e}", report.largest_gap_m);
    }
}

/// Methods that joint coordinates do not have are refused with those that they have.
#[test]
fn refusals_name_the_way_out() {
    let compiled = undamped(BANK, 2e-5, false);
    for method in [Integrator::Radau5, Integrator::AverageField] {
        let options = asked(1e-6, "y1.y", method, 1e-3);
        match joint_transient(&compiled, Formulation::Rcr, &options, &mut |_, _| {}, &mut |_| true) {
            Err(AnalysisError::BadRequest { detail, .. }) => {
                assert!(detail.contains("tr-bdf2") && detail.contains("compliant"), "{detail}");
            }
            other => panic!("{other:?}"),
        }
    }
}
