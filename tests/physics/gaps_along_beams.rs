//! Gaps along beams: the field follows the shape of the segments, so that pieces drawn by hand do not matter and the error of the mesh
//! is that of the gap, too.

use crate::{close, model, node};
use bimorph::analysis::mesh::{pull_in_fitted, static_fitted};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::multibody::BodyMatrix;
use bimorph::multibody::planar::Pose;
use bimorph::netlist::Bundle;
use bimorph::refine::mesh_search::Mesh;
use nalgebra::Vector2;
use std::fmt::Write;
use std::sync::Arc;

/// A beam of 480 × 12 × 1.5 µm, E = 165 GPa, over a rigid electrode 2 µm away, without fringe field, drawn in `beams` pieces under
/// `gaps` gap elements; clamped at its far end, too, or free there.
fn over_electrode(beams: usize, gaps: usize, clamped: bool) -> String {
    let head = "process p = [ Youngsmodulus=165e9 density=2330 h=12u fringe=none ]
         anchor p [a(0)] []\nanchor p [c(0)] []\neground * [a(0)] []\ndrive port * [c(0) a(0)] []\n";
    let mut text = head.to_owned();
    for i in 1..=beams {
        writeln!(text, "beam2d p [a({}) a({i})] [l=480u/{beams} w=1.5u]\nR * [a(0) a({i})] [R=1]", i - 1).unwrap();
    }
    for k in 1..=gaps {
        let (from, to) = ((k - 1) * beams / gaps, k * beams / gaps);
        writeln!(text, "gap2dforce p [a({from}) a({to}) c({}) c({k})] [l=480u/{gaps} w1=1.5u w2=1.5u gap=2u]", k - 1)
            .unwrap();
        writeln!(text, "anchor p [c({k})] []\nR * [c(0) c({k})] [R=1]").unwrap();
    }
    if clamped {
        writeln!(text, "anchor p [a({beams})] []").unwrap();
    }
    text
}

fn compiled(text: &str, options: &CompileOptions) -> CompiledModel {
    let options = CompileOptions { junctions: Junctions::Centreline, ..options.clone() };
    compile(&Bundle::from_text("gap.net", text), &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Pull-in of one beam drawn in 1 to 16 pieces, and under one gap over four of them, agrees with a collocation solution
/// of the beam's own equation within the tolerance, and the estimate covers the error. The solution uses Chebyshev, 32
/// points; clamped with von Kármán's stretching 11.758272 V, free 1.629519 V. (That equation is for small slopes: of
/// the order (gap/length)², 1e-5.) Nothing is warned of.
#[test]
fn pieces_drawn_by_hand_do_not_matter() {
    for (clamped, wanted) in [(true, 11.758_272_2), (false, 1.629_518_5)] {
        for (beams, gaps) in [(1, 1), (2, 2), (4, 4), (8, 8), (16, 16), (4, 1), (4, 2)] {
            let drawn = compiled(&over_electrode(beams, gaps, clamped), &CompileOptions::default());
            let (fitted, found) =
                pull_in_fitted(&drawn, None, 1000.0).unwrap_or_else(|e| panic!("{beams} {gaps}: {e}"));
            let (error, estimate) = ((found.pull_in_v / wanted - 1.0).abs(), fitted.order.estimated_error.unwrap());
            println!("{clamped} {beams} {gaps}: {:?} {error:.1e} {estimate:.1e}", fitted.order.segments);
            assert!(error < 1e-3, "{beams} {gaps}: {error:e}");
            assert!(error < estimate + 2e-5, "{beams} {gaps}: {error:e} {estimate:e}");
            assert!(fitted.warnings.items.iter().all(|d| d.code != "W042"), "{:?}", fitted.warnings.items);
        }
    }
}

/// With given segments the estimate covers the error of the gap. One piece of 2, 4 and 8 segments is compared with
/// 11.758158 V, to which 32 and more converge; the error falls by a factor of 8 to 20 with each doubling (fourth order:
/// 16).
#[test]
fn the_estimate_has_the_error_of_the_gap() {
    let mut before = f64::INFINITY;
    for segments in [2, 4, 8] {
        let options = CompileOptions { segments: Some(segments), ..CompileOptions::default() };
        let (fitted, found) = pull_in_fitted(&compiled(&over_electrode(1, 1, true), &options), None, 1000.0).unwrap();
        let (error, estimate) = ((found.pull_in_v / 11.758_158_0 - 1.0).abs(), fitted.order.estimated_error.unwrap());
        println!("{segments}: {error:.2e}, estimate {estimate:.2e}");
        assert!(error < 1.1 * estimate, "{segments}: {error:e} {estimate:e}");
        assert!(segments == 2 || (8.0..20.0).contains(&(before / error)), "{segments}: {before:e} {error:e}");
        before = error;
    }
}

/// Two beams of different widths that face each other, of which one is drawn backwards.
const TWO: &str = "
    anchor p1 [a] []
    beam2d p1 [b a] [l=100u w=2u oz=pi]
    anchor p1 [c] []
    beam2d p1 [c d] [l=100u w=3u]
    g gap2dforce p1 [a b c d] [l=100u w1=2u w2=3u gap=2u]
    R * [a b] [R=1]
    R * [c d] [R=1]
    eground * [a] []
    drive port * [c a] []";

/// On segments that do not match, 3 against 4, forces are the derivatives of the potential, and the tangent that of the forces: central
/// differences about a bent state, open and in contact.
#[test]
fn one_potential_on_unequal_segments() {
    let drawn = model(TWO, &CompileOptions::default());
    let order = Mesh { segments: vec![3, 4], ..drawn.order.clone() };
    let compiled = drawn.with_order(order).unwrap();
    // the upper beam bends towards the lower one as x², to an end that is open or touches
    for (volts, end, touches) in [(20.0, -0.3e-6, false), (60.0, -1.91e-6, true)] {
        let system = &compiled.parts.system;
        let bent = |center: &Vector2<f64>| {
            let (x, slope) = (center.x / 100e-6, 2.0 * end * center.x / 100e-6 / 100e-6);
            if center.y > -1e-6 { Pose::new(0.0, end * x * x, slope) } else { Pose::zeros() }
        };
        let state: Vec<Pose> = system.model.bodies.iter().map(|body| bent(&body.center)).collect();
        assert_eq!(system.touches(0, &state), touches);
        let mut drive = system.electrics.drive();
        drive.volts.fill(volts);
        let n = system.bodies();
        let way: Vec<Pose> = (0..n)
            .map(|k| {
                let k = k as f64;
                Pose::new(1e-9 * (1.0 + k).sin(), 1e-9 * (2.0 + 3.0 * k).cos(), 1e-4 * (0.3 + k).sin())
            })
            .collect();
        let at = |s: f64| state.iter().zip(&way).map(|(q, d)| q + d * (0.5 + s)).collect::<Vec<Pose>>();
        let residual = |s: f64| {
            let mut r = vec![Pose::zeros(); n];
            system.residual(&at(s), &drive, &mut r);
            r
        };
        let step = 1e-3;
        let dot = |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let slope = (system.potential(&at(step), &drive) - system.potential(&at(-step), &drive)) / (2.0 * step);
        close(slope, dot(&residual(0.0), &way), 1e-5);
        let (there, here) = (residual(step), residual(-step));
        let mut change: Vec<Pose> = there.iter().zip(&here).map(|(a, b)| (a - b) / (2.0 * step)).collect();
        let mut tangent = BodyMatrix::new(&system.model.pattern);
        system.tangent(&at(0.0), &drive, &mut tangent, &mut vec![Pose::zeros(); n]);
        tangent.factor(&system.model.pattern).unwrap();
        tangent.solve(&system.model.pattern, &mut change);
        let off: f64 =
            change.iter().zip(&way).map(|(a, b)| (a - b).component_div(&Pose::new(1e-9, 1e-9, 1e-4)).norm()).sum();
        assert!(off < 1e-4 * n as f64, "{volts}: {off:e}");
        // charge: dC along the way
        let (more, less) = (system.capacitance(0, &at(step)), system.capacitance(0, &at(-step)));
        close((more - less) / (2.0 * step), system.capacitance_slope(0, &at(0.0), &way), 1e-5);
    }
}

/// The two beams bend as one does over its mirror plane: beams of equal widths under V against a beam over a rigid plane half as far away under V/2. Their fields are
/// the same, without fringe field and in the exact field of bars.
#[test]
fn facing_beams_bend_alike() {
    let two = TWO.replace("w=3u", "w=2u").replace("w2=3u", "w2=2u");
    let one = "
        anchor p1 [a] []
        beam2d p1 [a b] [l=100u w=2u]
        gap2dforce p1 [a b e f] [l=100u w1=2u w2=2u gap=1u touch=0.05u electrode=plane]
        R * [a b] [R=1]
        R * [e f] [R=1]
        anchor p1 [e] []
        anchor p1 [f] []
        eground * [a] []
        drive port * [e a] []";
    let tip = |text: &str, volts: f64| {
        let (_, result, _) =
            static_fitted(&model(text, &CompileOptions::default()), &[("drive".into(), volts)]).unwrap();
        node(&result, "b").y
    };
    close(tip(&two, 18.0), tip(one, 9.0), 1e-3);
    let plain = |text: &str| text.replace("touch=", "fringe=none touch=");
    let two = two.replace("gap=2u", "gap=2u fringe=none");
    close(tip(&two, 24.0), tip(&plain(one), 12.0), 1e-3);
}

/// In a circuit, whose mesh knows no voltage, W042 reports the error of the tip's deflection within a factor 3. The
/// free beam on 1, 2 and 4 segments at 0.9 V and 1.55 V (pull-in 1.63 V) is compared with 32, wherever that error is
/// beyond the tolerance of 1e-4.
#[test]
fn circuits_report_the_error_of_their_segments() {
    let at = |segments: usize, volts: f64| {
        let options = CompileOptions { segments: Some(segments), tol: 1e-4, ..CompileOptions::default() };
        let mut device = LocalDevice::new(Arc::new(compiled(&over_electrode(1, 1, false), &options)));
        let signals = vec!["a(1).y".to_owned()];
        device.open(&OpenRequest { ports: Vec::new(), signals, noise: None }).unwrap();
        let mut reply = TrialReply::default();
        let trial = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[volts] };
        device.trial(&trial, &mut reply).unwrap();
        let warnings = device.warns(reply.token.unwrap());
        let message = warnings.into_iter().find(|d| d.code == "W042").map(|d| d.message);
        let number = |text: String| text.split("deflection ").nth(1).unwrap().split(',').next().unwrap().parse::<f64>();
        (reply.outputs[0], message.map(|text| number(text).unwrap()))
    };
    for volts in [0.9, 1.55] {
        let exact = at(32, volts);
        assert_eq!(exact.1, None);
        for segments in [1, 2, 4] {
            let (tip, estimate) = at(segments, volts);
            let error = (tip / exact.0 - 1.0).abs();
            println!("{volts} V, {segments}: error {error:.2e}, estimate {estimate:?}");
            match estimate {
                Some(estimate) => {
                    assert!((1.0 / 3.0..3.0).contains(&(estimate / error)), "{volts} {segments}: {error:e}")
                }
                None => assert!(error < 1e-4, "{volts} {segments}: {error:e}"),
            }
        }
    }
}
