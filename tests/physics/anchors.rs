//! Elastic anchors and silicon by direction: the compliance of a root and the modulus of a beam, in results.

use crate::{balance, close, linear, node};
use bimorph::analysis::modes::modes;
use bimorph::compile::{Anchors, CompileOptions, CompiledModel, Junctions, compile};
use bimorph::discretize::anchor_root;
use bimorph::netlist::{Bundle, Setting};

const CANTILEVER: &str = "
process p = [ Youngsmodulus=160e9 Poisson=0.25 density=2330 h=2u ]
param l=100u, w=2u, fx=0, fy=0, m=0
anchor p [a] []
beam2d p [a t] [l=l w=w]
f2d * [t] [F=fx]
f2d * [t] [F=fy oz=pi/2]
f2d * [t] [M=m]
";

fn compiled(text: &str, set: &[(&str, f64)], options: &CompileOptions) -> CompiledModel {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value))).collect();
    let options = CompileOptions { set, ..options.clone() };
    compile(&Bundle::from_text("model.net", text), &options).unwrap_or_else(|e| panic!("{e}"))
}

fn elastic(junctions: Junctions) -> CompileOptions {
    CompileOptions { anchors: Anchors::Elastic, junctions, segments: Some(4), ..linear() }
}

/// A cantilever with an elastic root of (δ_N, a_Q, a_c, a_M) moves at its tip by what beam theory with shear (κ = 5/6) and the root say, under
/// tension, tip force and tip moment, whatever the junctions.
#[test]
fn a_root_adds_its_compliance() {
    let (e, t, w, l, nu) = (160e9, 2e-6, 2e-6, 100e-6, 0.25);
    let [delta_n, delta_m] = anchor_root::lengths(w, t, nu, 0.0);
    let (a_n, a_m) = (delta_n / w, 12.0 * delta_m / w);
    let (a_q, a_c) = (1.4 * a_n, (0.874 - 1.197 * nu) * (delta_m / w) / 0.4162);
    let ei = e * t * w * w * w / 12.0;
    let shear = l / (5.0 / 6.0 * e / (2.0 * (1.0 + nu)) * w * t);
    let root = 1.0 / (e * t);
    for junctions in [Junctions::Centreline, Junctions::Offset, Junctions::Calibrated] {
        let tip = |name: &str, value: f64| {
            node(&balance(&compiled(CANTILEVER, &[(name, value)], &elastic(junctions)), &[]), "t")
        };
        close(tip("fx", 1e-6).x, 1e-6 * (l / (e * t * w) + root * a_n), 1e-9);
        let across = l * l * l / (3.0 * ei) + shear + root * (a_q + 2.0 * a_c * l / w + a_m * (l / w).powi(2));
        close(tip("fy", 1e-6).y, 1e-6 * across, 1e-9);
        let turned = l * l / (2.0 * ei) + root / w * (a_c + a_m * l / w);
        close(tip("fy", 1e-6).rz, 1e-6 * turned, 1e-9);
        close(tip("m", 1e-12).rz, 1e-12 * (l / ei + root * a_m / (w * w)), 1e-9);
    }
}

/// The first frequency of a cantilever with an elastic root is that of one longer by δ_M: Δf/f = −2·δ_M/l to first order, for beams of any
/// direction.
#[test]
fn a_root_lowers_the_frequency() {
    let frequency = |anchors: Anchors, turn: &str| {
        let text = CANTILEVER.replace("[l=l w=w]", &format!("[l=l w=w oz={turn}]"));
        let options = CompileOptions {
            anchors,
            band: Some(1e6),
            tol: 1e-5,
            junctions: Junctions::Centreline,
            shear: true,
            ..CompileOptions::default()
        };
        modes(&compiled(&text, &[("l", 400e-6)], &options), 1, &[]).unwrap().frequencies_hz[0]
    };
    let delta = anchor_root::lengths(2e-6, 2e-6, 0.25, 0.0)[1];
    let straight = frequency(Anchors::Elastic, "0") / frequency(Anchors::Rigid, "0") - 1.0;
    close(straight, -2.0 * delta / 400e-6, 0.02);
    let turned = frequency(Anchors::Elastic, "1.1") / frequency(Anchors::Rigid, "1.1") - 1.0;
    close(turned, straight, 1e-5);
}

/// By default an anchor is elastic where its layer has an `undercut`, and rigid where it has none; a larger undercut makes it softer.
#[test]
fn an_undercut_makes_anchors_elastic() {
    let tip = |entry: &str, anchors: Anchors| {
        let text = CANTILEVER.replace("h=2u ]", &format!("h=2u {entry} ]"));
        let options = CompileOptions { anchors, ..elastic(Junctions::Calibrated) };
        node(&balance(&compiled(&text, &[("fy", 1e-6)], &options), &[]), "t").y
    };
    assert_eq!(tip("", Anchors::Auto), tip("", Anchors::Rigid));
    assert_eq!(tip("undercut=0", Anchors::Auto), tip("", Anchors::Elastic));
    assert_eq!(tip("undercut=1u", Anchors::Rigid), tip("", Anchors::Rigid));
    let [bonded, etched] = [tip("undercut=0", Anchors::Auto), tip("undercut=1u", Anchors::Auto)];
    assert!(etched > bonded && bonded > tip("", Anchors::Rigid), "{etched:e} {bonded:e}");
}

/// The tip stiffness of a cantilever on a (100) wafer goes with E of its direction: 169.10 GPa along the flat and 130.13 GPa at 45° to it
/// (Hopcroft 2010).
#[test]
fn silicon_bends_by_its_direction() {
    let text = |turn: &str| {
        format!(
            "process p = [ crystal=100 density=2330 h=20u ]\nanchor p [a] []\nbeam2d p [a t] [l=1m w=5u oz={turn}]\nf2d * [t] [F=1n oz=pi/2+{turn}]"
        )
    };
    let moved = |turn: &str| {
        let options = CompileOptions { junctions: Junctions::Centreline, ..linear() };
        let tip = node(&balance(&compiled(&text(turn), &[], &options), &[]), "t");
        tip.x.hypot(tip.y)
    };
    let exact = |e: f64| 1e-9 * 1e-9 / (3.0 * e * 20e-6 * (5e-6f64).powi(3) / 12.0);
    close(moved("0"), exact(169.10e9), 1e-4);
    close(moved("pi/2"), exact(169.10e9), 1e-4);
    close(moved("pi/4"), exact(130.13e9), 1e-4);
    close(moved("-pi/12"), exact(157.32e9), 1e-4);
}
