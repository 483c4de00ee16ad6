//! The computed model is the drawn one: positions of lumped springs, directions of bowed beams, owners of heat, and
//! independence of the order of lines and of other parts.

use super::{balance, close, linear, node};
use bimorph::analysis::frame::{frame, frame_statics};
use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::netlist::Bundle;

const P1: &str = "process p1 = [Youngsmodulus=165e9 density=2300 h=2u]\n";

fn drawn(text: &str, options: &CompileOptions) -> CompiledModel {
    compile(&Bundle::from_text("drawn.net", &format!("{P1}{text}")), options).unwrap_or_else(|e| panic!("{e}"))
}

fn first_mode(text: &str) -> f64 {
    modes(&drawn(text, &linear()), 1, &[]).unwrap().frequencies_hz[0]
}

/// A spring of length l acts half way between its ends as drawn, whatever holds its far end: an anchor, a hinge with a slider, or a
/// stout beam on an anchor. By hand: a cantilever with the tip compliances u = l³/3EI, s = l²/2EI, r = l/EI whose tip carries the
/// spring k at the distance d = 25 µm: with the force Q there, u_tip = u·F − (u + d·s)·Q and Q = k·(u_tip + d·θ_tip).
#[test]
fn springs_sit_half_way() {
    let deflection = |far: &str| {
        let text = format!(
            "anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u]\nspring2d * [b c] [ky=100 l=50u]\n{far}\nf2d * [b] [F=1u oz=pi/2]"
        );
        node(&static_equilibrium(&super::model(&format!("{P1}{text}"), &linear()), &[]).unwrap(), "b").y
    };
    let (l, ei, d, k) = (100e-6_f64, 165e9 * 16e-24 / 12.0, 25e-6, 100.0);
    let (u, s, r) = (l.powi(3) / (3.0 * ei), l * l / (2.0 * ei), l / ei);
    let q = k * (u + d * s) * 1e-6 / (1.0 + k * (u + 2.0 * d * s + d * d * r));
    let want = u * 1e-6 - (u + d * s) * q;
    close(deflection("anchor * [c] []"), want, 1e-6);
    close(deflection("hinge * [c] []\nslider * [c] []"), want, 1e-6);
    close(deflection("beam2d p1 [c d] [l=1u w=50u]\nanchor p1 [d] []"), want, 1e-4);
}

/// `curvature` is positive towards local y, in a mirrored part too: both halves bow to the same side, by κl²/2 at their tips. Where
/// local y is normal to the drawing plane it is left out, with a warning.
#[test]
fn mirrored_beams_bow_as_their_mirror() {
    let text = "subnet half [root tip] [] [ beam2d parent [root tip] [l=100u w=2u curvature=100] ]
        anchor p1 [root] []\nhalf p1 [root right] [oz=0]\nhalf p1 [root left] [oy=pi]";
    let result = static_equilibrium(&drawn(text, &linear()), &[]).unwrap();
    close(node(&result, "right").y, 0.5e-6, 5e-3);
    close(node(&result, "left").y, node(&result, "right").y, 1e-9);
    let flat = drawn("anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u ox=pi/2 h=4u curvature=100]", &linear());
    assert_eq!(node(&static_equilibrium(&flat, &[]).unwrap(), "b").y, 0.0);
    assert!(flat.warnings.items.iter().any(|d| d.code == "W020" && d.message.contains("curvature")));
}

/// The linear frame expands the beam that is hot, also when two beams have one name: with 50 times the resistance in the second
/// half the middle is pushed back towards the first.
#[test]
fn heat_goes_to_its_beam_whatever_its_name() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.7e-6 thermcond=34 ambienttemperature=300]
        anchor p [a] []\n{1} beam2det p [a c] [l=200u w=2u R=2k]\n{2} beam2det p [c b] [l=200u w=2u R=100k]\nanchor p [b] []
        eground * [b] []\nheat port * [a b] []";
    let middle = |first: &str, second: &str| {
        let text = text.replace("{1}", first).replace("{2}", second);
        let compiled = drawn(&text, &linear());
        let volts = [("heat".to_owned(), 5.0)];
        node(&frame_statics(&compiled, &frame(&compiled).unwrap(), &volts).unwrap().0, "c").x
    };
    let want = middle("hot", "cold");
    assert!(want < -1e-9, "{want:e}");
    assert_eq!(middle("arm", "arm"), want);
}

/// A junction of two materials, or of two thicknesses, has the same mass in whatever order its beams are written.
#[test]
fn junctions_know_no_order() {
    for second in [
        "process p2 = [Youngsmodulus=78e9 density=19300 h=2u]",
        "process p2 = [Youngsmodulus=165e9 density=2300 h=20u]",
    ] {
        let stem = "beam2d p2 [c top] [l=30u w=10u oz=pi/2]\n";
        let bar = "beam2d p1 [r1 c] [l=50u w=10u]\nbeam2d p1 [c r2] [l=50u w=10u]\n";
        let head = format!("{second}\nanchor p1 [r1] []\nanchor p1 [r2] []\n");
        close(first_mode(&format!("{head}{stem}{bar}")), first_mode(&format!("{head}{bar}{stem}")), 1e-9);
    }
}

/// A hinge holds its node to 1e-6 of the forces on it, beside beams and springs of any stiffness. 1000 N/m on a lever
/// of 25 µm and 1 µg at 50 µm, f = √(k·s²/(m·q² + J))/(2π), with and without a beam elsewhere that is softer than the
/// spring; and on any mesh.
#[test]
fn hinges_hold_whatever_else_is_drawn() {
    let lever = "hinge * [p] []\nlink2d * [p s] [l=25u]\nlink2d * [s q] [l=25u]\nmass2d * [q] [m=1e-9 J=1e-22]
        spring2d * [s g] [ky=1000]\nanchor * [g] []\n";
    let inertia: f64 = 1e-9 * 50e-6 * 50e-6 + 1e-22;
    let want = (1000.0 * 25e-6 * 25e-6 / inertia).sqrt() / (2.0 * std::f64::consts::PI);
    close(first_mode(lever), want, 1e-6);
    let soft = "process soft = [Youngsmodulus=3e6 density=1e-3 h=1u]\nbeam2d soft [g b] [l=10u w=0.5u]";
    close(first_mode(&format!("{lever}{soft}")), want, 1e-6);
    let strut = "anchor p1 [a] []\nhinge * [b] []\nbeam2d p1 [a m] [l=50u w=4u]\nbeam2d p1 [m b] [l=50u w=4u]\nf2d * [m] [F=1m]";
    let middle = |segments: usize| {
        let options = CompileOptions { segments: Some(segments), ..linear() };
        node(&balance(&drawn(strut, &options), &[]), "m").x
    };
    close(middle(64), middle(2), 1e-8);
}
