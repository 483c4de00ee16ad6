//! The formulations against each other: joint coordinates and springs in all directions are the same mechanism.

use crate::model;
use bimorph::analysis::AnalysisError;
use bimorph::analysis::formulation::{Formulation, linkage};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::joint_transient::{JointReport, joint_transient};
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::domains::Ramp;
use bimorph::equations::loads::JointLoads;
use bimorph::multibody::joint_coordinates::constrained_loops::Reduction;
use bimorph::netlist::Setting;
use bimorph::solve::dormand_prince::{DormandPrince, Tolerances};
use bimorph::solve::joint_motion::JointMotion;

/// Bimorphs on a yoke, every beam in two: the long ones by slenderness, the short ones as drawn.
const ROW: &str = "
param F=0
subnet two [a b] [l=0 w=0] [
  beam2d parent [a m] [l=l/2 w=w]
  beam2d parent [m b] [l=l/2 w=w]
]
subnet arm [o] [s=1] [
  anchor parent [a] [l=10u w=10u oz=pi]
  anchor parent [g] [l=10u w=10u oz=pi]
  beam2d parent [a t] [l=206u w=2u]
  two parent [t c] [l=23u w=13u oz=-s*pi/2]
  beam2d parent [c f] [l=112u w=8u oz=pi]
  beam2d parent [f g] [l=94u w=1.9u oz=pi]
  two parent [c o] [l=24u w=3u]
]
subnet row [out] [s=1 n=5] [
  for k=1:n-1 [
    arm parent [y(k)] [s=s]
  ]
  arm parent [out] [s=s]
  for k=1:n-2 [
    two parent [y(k) y(k+1)] [l=49.5u w=11u oz=s*pi/2]
  ]
  two parent [y(n-1) out] [l=49.5u w=11u oz=s*pi/2]
]
";
const STAGE: &str = "
A row p1 [pa] []
B row p1 [pb] [s=-1 oz=-pi/2]
beam2d p1 [pa sa] [l=80u w=2u oz=pi/2]
beam2d p1 [pb sb] [l=80u w=2u oz=pi]
link2d * [sa c] [l=30u oz=pi/2]
link2d * [sb c] [l=30u oz=pi]
plate2d p1 [c] [l=60u w=60u]
f2d * [c] [F=F]
";
const BANK: &str = "
A row p1 [tip] [n=3]
f2d * [tip] [F=F oz=pi/2]
";

fn undamped(text: &str, force: f64) -> CompiledModel {
    let set = vec![("F".to_owned(), Setting::Number(force))];
    model(text, &CompileOptions { set, undamped: true, ..CompileOptions::default() })
}

fn asked(stop: f64, signal: &str, tol: f64) -> TransientOptions<'static> {
    TransientOptions { stop, signals: vec![signal.into()], points: 101, tol, ..TransientOptions::default() }
}

fn spring(compiled: &CompiledModel, options: &TransientOptions<'_>) -> TransientResult {
    transient(compiled, options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
}

fn joints(
    compiled: &CompiledModel,
    kind: Formulation,
    options: &TransientOptions<'_>,
) -> (TransientResult, JointReport) {
    let options = &TransientOptions { method: Integrator::Rk45, ..options.clone() };
    joint_transient(compiled, kind, options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
}

/// Largest difference of the first signals over the largest value.
fn apart(a: &TransientResult, b: &TransientResult) -> f64 {
    let (a, b) = (&a.signals[0].2, &b.signals[0].2);
    let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

/// The paper's quarter stage: with every beam in two, 12 joints a bimorph and a free plate, n = 123; its 20 loops of three
/// constraints each leave 63 freedoms. The tree that is reduced cuts loops at joints and leaves the same number.
#[test]
fn counts_of_the_paper() {
    let compiled = undamped(&format!("{ROW}{STAGE}"), 0.0);
    let rotary = compiled.parts.system.model.rotary();
    let counts = rotary.counts();
    assert_eq!(rotary.joints.len(), 12 * 10);
    assert_eq!((counts.coordinates, counts.loops, counts.constraints), (123, 20, 60));
    let linkage = linkage(Formulation::Rcr, &compiled.parts.system).unwrap();
    assert_eq!(linkage.coordinates - linkage.constraints, 123 - 60);
    assert_eq!((linkage.coordinates, linkage.constraints), (101, 38));
}

/// A bank of three under a suddenly applied 20 µN. As the axial and shear springs of the compliant model grow, its
/// motion approaches that of joints that only rotate, ten times closer for ten times the stiffness (between 6 and 16
/// times).
#[test]
fn stiff_springs_become_rotary_joints() {
    let compiled = undamped(&format!("{ROW}{BANK}"), 2e-5);
    let options = asked(1e-5, "tip.y", 1e-4);
    let (rotary, report) = joints(&compiled, Formulation::Rcr, &options);
    // the arms are drawn straight, so their loops are near a singular configuration all the time
    assert!(report.singular_evaluations > 0);
    assert!(report.largest_gap_m < 1e-15, "{:e}", report.largest_gap_m);
    let mut last = f64::INFINITY;
    for factor in [1e1, 1e2, 1e3, 1e4] {
        let mut stiff = compiled.clone();
        stiff.parts.system.model = stiff.parts.system.model.rotary().stiffened(factor);
        let now = apart(&rotary, &spring(&stiff, &options));
        println!("{factor:e} {now:e}");
        if last.is_finite() {
            assert!((6.0..16.0).contains(&(last / now)), "{factor:e}: {last:e} -> {now:e}");
        }
        last = now;
    }
    assert!(last < 1e-4, "{last:e}");
}

/// A portal frame of stout beams with all three directions elastic: joint coordinates with an elastic loop and the bodies'
/// own coordinates give the same motion within ten times the tolerance.
#[test]
fn elastic_joints_are_the_same_model() {
    let text = "
        param F=0
        anchor p1 [a] [l=10u w=10u oz=-pi/2]
        beam2d p1 [a b] [l=16u w=2u oz=pi/2]
        beam2d p1 [b c] [l=16u w=2u oz=pi/2]
        beam2d p1 [c d] [l=20u w=3u]
        beam2d p1 [d e] [l=16u w=2u oz=-pi/2]
        beam2d p1 [e f] [l=16u w=2u oz=-pi/2]
        anchor p1 [f] [l=10u w=10u oz=-pi/2]
        f2d * [c] [F=F]";
    let compiled = undamped(text, 5e-4);
    let options = asked(2e-6, "c.x", 1e-5);
    let (elastic, report) = joints(&compiled, Formulation::RcrElastic, &options);
    assert_eq!((report.coordinates, report.constraints), (12, 0));
    let off = apart(&spring(&compiled, &options), &elastic);
    assert!(off < 1e-4, "{off:e}");
}

/// Struck once, the bank of three keeps its energy to 1e-6 over 2 µs at a tolerance of 1e-8 a step.
#[test]
fn rotary_bank_keeps_its_energy() {
    let compiled = undamped(&format!("{ROW}{BANK}"), 0.0);
    let system = &compiled.parts.system;
    let linkage = linkage(Formulation::Rcr, system).unwrap();
    let n = linkage.coordinates;
    let ramp = Ramp::new(&system.electrics, &[], &[], &[], 2e-6);
    let drive = system.electrics.drive();
    let mut loads = JointLoads::new(system, &linkage, &ramp);
    let mut motion =
        JointMotion::new(&linkage, |t, q: &[f64], v: &[f64], r: &mut Reduction<f64>| loads.add(t, q, v, r));
    let (mut q, mut v, mut change) = (vec![0.0; n], vec![2e3; n], vec![0.0; n]);
    motion.reduction.project_rates(&q, &mut v, &mut change);
    let energy =
        |r: &Reduction<f64>, q: &[f64]| r.kinetic_energy(&linkage) + r.strain_energy(&linkage, q, &drive.rest());
    let before = energy(&motion.reduction, &q);
    let bounds = Tolerances { rtol: 1e-8, atol_q: vec![1e-13; n], atol_v: vec![1e-5; n] };
    let mut method = DormandPrince::new(n);
    let mut h = 0.0;
    method.integrate(&mut motion, (0.0, 2e-6), &mut q, &mut v, &mut h, &bounds, 1_000_000, &mut |_| true).unwrap();
    motion.reduction.place(&q, &v);
    let after = energy(&motion.reduction, &q);
    assert!(motion.reduction.strain_energy(&linkage, &q, &drive.rest()) > 1e-2 * before);
    assert!((after / before - 1.0).abs() < 1e-6, "{before:e} -> {after:e}");
}

/// Models beyond joint coordinates are rejected with a remedy: inner bodies of elastic beams rotate without inertia,
/// explicit steps to 10 s would be 1e8 and more, and small displacements are not supported.
#[test]
fn refusals_name_the_way_out() {
    let compiled = undamped(&format!("{ROW}{BANK}"), 2e-5);
    let linear = model(&format!("{ROW}{BANK}"), &CompileOptions { linear: true, ..CompileOptions::default() });
    for (compiled, kind, stop, word) in [
        (&compiled, Formulation::RcrElastic, 1e-6, "turns without inertia"),
        (&compiled, Formulation::Rcr, 10.0, "explicit steps"),
        (&linear, Formulation::Rcr, 1e-6, "--linear"),
    ] {
        let options = TransientOptions { method: Integrator::Rk45, ..asked(stop, "tip.y", 1e-3) };
        match joint_transient(compiled, kind, &options, &mut |_, _| {}, &mut |_| true) {
            Err(AnalysisError::BadRequest { detail, .. }) => {
                assert!(detail.contains(word) && detail.contains("compliant"), "{detail}");
            }
            other => panic!("{other:?}"),
        }
    }
}
