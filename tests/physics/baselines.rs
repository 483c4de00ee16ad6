//! The baselines: other solvers of the same equations, and the linear frame that stands for SUGAR.

use crate::{balance, close, linear, model, node};
use bimorph::analysis::frame::{frame, frame_modes, frame_statics, frame_transient, frame_with};
use bimorph::analysis::modes::modes;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::discretize::frame::{ElementCount, FrameGaps, FrameOptions};
use bimorph::netlist::{Setting, read_bundle};
use bimorph::solve::baseline::SolverKind;
use std::path::Path;

fn bank(band: Option<f64>) -> CompiledModel {
    let bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).unwrap();
    compile(&bundle, &CompileOptions { band, junctions: Junctions::Centreline, ..CompileOptions::default() }).unwrap()
}

/// On the heated bank every solver makes the same steps as the recursion, and the same motion to 1e-9 of its amplitude: the
/// matrices are definite, where elimination without pivoting is as good as with.
#[test]
fn every_solver_gives_the_same_motion() {
    let compiled = bank(Some(4e5));
    let run = |solver: SolverKind| {
        let options = TransientOptions {
            stop: 5e-5,
            signals: vec!["yoke.y".into(), "yoke.x".into()],
            points: 201,
            voltages: vec![("heat".into(), 2.0)],
            solver,
            ..TransientOptions::default()
        };
        transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap()
    };
    let recursion = run(SolverKind::Recursion);
    for kind in SolverKind::ALL {
        let other = run(kind);
        assert_eq!(other.counters, recursion.counters, "{}", kind.name());
        assert_eq!(other.signals.len(), 2);
        for (a, b) in other.signals.iter().zip(&recursion.signals) {
            let amplitude = b.2.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let apart = a.2.iter().zip(&b.2).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(apart <= 1e-9 * amplitude, "{} {}: {apart:e} of {amplitude:e}", kind.name(), a.0);
        }
    }
}

/// A bank of three bimorphs, as an independent program has it: 169 GPa, 2330 kg/m3, Poisson's ratio 0.22.
fn fine_bank() -> CompiledModel {
    let bimorph = |k: usize| {
        format!(
            "anchor p2 [c{k}] [l=10u w=10u oz=pi]\nanchor p2 [h{k}] [l=10u w=10u oz=pi]\n\
             beam2d p2 [c{k} f{k}] [l=30u w=2.6u]\nbeam2d p2 [f{k} t{k}] [l=175u w=16u]\n\
             beam2d p2 [h{k} u{k}] [l=205u w=2u]\nbeam2d p2 [t{k} u{k}] [l=12u w=3u oz=pi/2]\n\
             beam2d p2 [t{k} y{k}] [l=32u w=2.1u]\n"
        )
    };
    let material = "process p2 = [Poisson=0.22 Youngsmodulus=169e9 density=2330 viscosity=0 fluid=2u h=2u]\n";
    let yoke = "beam2d p2 [y1 y2] [l=40u w=24u oz=pi/2]\nbeam2d p2 [y2 y3] [l=40u w=24u oz=pi/2]\n\
                beam2d p2 [y3 e] [l=120u w=24u oz=pi/2]\n";
    let text = format!("{material}{}{}{}{yoke}", bimorph(1), bimorph(2), bimorph(3));
    model(&text, &CompileOptions::default())
}

fn fine_modes(elements: usize, shear: bool) -> Vec<f64> {
    let compiled = fine_bank();
    let options =
        FrameOptions { elements: ElementCount::Each(elements), shear, undamped: false, gaps: FrameGaps::LeftOut };
    let frame = frame_with(&compiled, &options).unwrap();
    frame_modes(&compiled, &frame, 10, &[]).unwrap().0.frequencies_hz
}

/// One element for each beam: the ten frequencies of an independent frame program, to 1e-8. The hot arms' own modes, 2 to 4
/// at 403 to 413 kHz, are missing: an element between two fixed ends has no mode.
#[test]
fn a_coarse_frame_is_that_of_another_program() {
    let want = [
        84473.67749583659,
        611603.1369469498,
        612010.8870832918,
        768656.9368237362,
        1310312.3753743747,
        1410577.8652086838,
        1410989.1066712013,
        1436561.555218326,
        2254014.787442343,
        2275633.3905416466,
    ];
    let got = fine_modes(1, false);
    assert!(got.len() >= want.len());
    for (got, want) in got.iter().zip(want) {
        close(*got, want, 1e-8);
    }
}

/// 24 elements for each beam: those of the same program at 24, to 1e-7; and with shear and rotary inertia those of another
/// program's 32 Timoshenko elements, to 1e-4.
#[test]
fn a_fine_frame_is_converged() {
    let slender = [
        84390.00981976,
        403591.76715755,
        403774.40252694,
        412624.52111284,
        626507.6323009,
        626892.64536316,
        769852.84189264,
        1125226.32791322,
        1125690.84087676,
        1125964.69458733,
    ];
    let thick = [
        83419.88, 403092.14, 403251.00, 412112.83, 622322.39, 622701.24, 764294.07, 1122720.42, 1123152.68, 1123529.77,
    ];
    let (found, sheared) = (fine_modes(24, false), fine_modes(16, true));
    for k in 0..10 {
        close(found[k], slender[k], 1e-3);
        close(sheared[k], thick[k], 1e-4);
    }
}

/// The frame's statics are those of SUGAR and of the product's own linear model: tang resonator's shape of load, heat, and a
/// rigid link. Here the heated bank without its comb, to 1e-8.
#[test]
fn frame_statics_agree_with_the_linear_model() {
    let text = "
        param F=3u
        anchor p1 [a] [l=10u w=10u oz=pi]
        anchor p1 [g] [l=10u w=10u oz=pi]
        beam2de p1 [a t] [l=206u w=2u T=500]
        beam2d p1 [t c] [l=23u w=13u oz=-pi/2]
        beam2d p1 [c f] [l=112u w=8u oz=pi]
        beam2d p1 [f g] [l=94u w=1.9u oz=pi]
        link2d * [c o] [l=24u]
        beam2d p1 [o e] [l=30u w=2u oz=pi/6]
        f2d * [e] [F=F oz=1 M=1e-11]";
    let compiled = model(text, &linear());
    let own = balance(&compiled, &[]);
    let framed = frame_statics(&compiled, &frame(&compiled).unwrap(), &[]).unwrap().0;
    for name in ["t", "c", "f", "o", "e"] {
        let (a, b) = (node(&framed, name), node(&own, name));
        close(a.x, b.x, 1e-8);
        close(a.y, b.y, 1e-8);
        close(a.rz, b.rz, 1e-8);
    }
}

/// A finely divided frame and the product's own linear model ring alike: the bank's modes up to 1.1 MHz to 0.1 %.
#[test]
fn frame_modes_agree_with_the_segments() {
    let compiled = bank(Some(1.3e6));
    let own = modes(&compiled, 10, &[]).unwrap().frequencies_hz;
    let frame = frame(&compiled).unwrap();
    let framed = frame_modes(&compiled, &frame, 10, &[]).unwrap().0.frequencies_hz;
    assert_eq!((framed.len(), own.len()), (10, 10));
    for (a, b) in framed.iter().zip(&own) {
        close(*a, *b, 2e-3);
    }
}

/// A released cantilever, both models far finer than the motion needs: the frame oscillates as the product's own linear
/// model does, to 2e-3 of the amplitude over five periods (1e-3 is the tolerance of each).
#[test]
fn frame_motion_agrees_with_the_linear_model() {
    let text = "param F=1u\nanchor p1 [a] [l=10u w=10u]\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=F oz=pi/2]";
    let with = |force: f64| {
        let set = vec![("F".to_owned(), Setting::Number(force))];
        model(text, &CompileOptions { set, band: Some(3e7), undamped: true, ..linear() })
    };
    let (held, free) = (with(1e-6), with(0.0));
    let options = TransientOptions {
        stop: 2e-5,
        signals: vec!["b.y".into()],
        points: 401,
        release: Some(&held),
        ..TransientOptions::default()
    };
    let own = transient(&free, &options, &mut |_, _| {}, &mut |_| true).unwrap();
    let framed = frame_transient(&free, &frame(&free).unwrap(), &options, &mut |_| true).unwrap();
    let (a, b) = (&framed.signals[0].2, &own.signals[0].2);
    let amplitude = b[0].abs();
    close(a[0], b[0], 1e-6);
    assert_eq!((a.len(), b.len()), (401, 401));
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < 2e-3 * amplitude, "{a:e} {b:e}");
    }
}

/// Printed results of frame statics are within the printed tolerance. A part on a slender beam, some 1e-11 as stiff as
/// its support, is where a beam of twenty times the thickness has it within 1e-3. At 1e-6, where rounding hides the
/// beam, it is rejected.
#[test]
fn what_rounding_hides_is_refused() {
    let at = |thread: &str, tol: f64| {
        let text = format!(
            "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=100u w=20u]\n\
             beam2d p [b c] [l=200u w={thread} h={thread}]\nbeam2d p [c d] [l=50u w=20u]\nbeam2d p [d e] [l=50u w=20u oz=pi/2]\n\
             f2d * [b] [F=1u oz=pi/2]"
        );
        let compiled = model(&text, &CompileOptions { tol, ..CompileOptions::default() });
        let found = frame_statics(&compiled, &frame(&compiled).unwrap(), &[]).map(|(result, _)| node(&result, "e").y);
        found.map_err(|error| error.to_string())
    };
    let thick = at("2u", 1e-6).unwrap();
    close(at("100n", 1e-3).unwrap(), thick, 1e-3);
    assert!(at("25n", 1e-6).unwrap_err().contains("rounding hides"));
}
