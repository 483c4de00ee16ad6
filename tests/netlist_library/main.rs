//! The planar models beside SUGAR's own: their effects, from closed forms and from the equations in docs/reference/elements.md,
//! and the warnings about members that leave the plane.

mod arcs;

use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::{NodeMotion, static_equilibrium};
use bimorph::compile::{CompileOptions, compile};
use bimorph::netlist::{Bundle, load};
use bimorph::structure::{CircuitKind, Structure};
use std::f64::consts::PI;

const P1: &str =
    "process p1 = [Youngsmodulus=160e9 Poisson=0.25 density=2000 h=2u viscosity=2e-5 fluid=1u]\nanchor p1 [a] []\n";
/// Bending stiffness of a beam 2 µm wide (N·m²).
const EI: f64 = 160e9 * 2e-6 * 8e-18 / 12.0;
/// Stiffness along it, times length (N).
const EA: f64 = 160e9 * 4e-12;

fn bundle(text: &str) -> Bundle {
    Bundle::from_text("t.net", &format!("{P1}{text}"))
}

fn drawn(text: &str) -> Structure {
    load(&bundle(text), &[]).unwrap_or_else(|d| panic!("{d}")).structure
}

fn warned(text: &str) -> Vec<(String, String)> {
    let loaded = load(&bundle(text), &[]).unwrap_or_else(|d| panic!("{d}"));
    loaded.warnings.items.into_iter().map(|d| (d.code, d.message)).collect()
}

fn refused(text: &str) -> Vec<(String, String, String)> {
    let found = load(&bundle(text), &[]).expect_err("an error").items;
    found.into_iter().filter(|d| d.code.starts_with('E')).map(|d| (d.code, d.message, d.help)).collect()
}

fn at(structure: &Structure, name: &str) -> [f64; 2] {
    structure.nodes[structure.node(name).expect(name).0].position
}

/// Where a node goes in the linear model of beams that meet in points.
fn moved(text: &str, node: &str) -> NodeMotion {
    let options = CompileOptions { as_sugar: true, ..CompileOptions::default() };
    let compiled = compile(&bundle(text), &options).unwrap_or_else(|e| panic!("{e}"));
    let result = static_equilibrium(&compiled, &[]).unwrap_or_else(|e| panic!("{e}"));
    result.nodes.iter().find(|(name, _)| name == node).expect(node).1
}

#[track_caller]
fn near(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance * want.abs().max(1e-15), "{got:e} is not {want:e}");
}

/// A predisplaced beam runs along its cubic: ends and slopes as given.
#[test]
fn predisplaced_beams_lie_as_drawn() {
    let s = drawn("x predisplacedbeam4 p1 [a b] [l=100u w=2u qx2=-10u qy2=20u qoz1=0.1 qoz2=-0.2]");
    let b = at(&s, "b");
    near(b[0], 90e-6, 1e-12);
    near(b[1], 20e-6, 1e-12);
    let slope = |k: usize| s.beams[k].angle.tan() * 0.9;
    assert!((slope(0) - 0.1).abs() < 0.03 && (slope(29) + 0.2).abs() < 0.03, "{} {}", slope(0), slope(29));
    let found = refused("predisplacedbeam4 p1 [a b] [l=100u w=2u qz2=1u]");
    assert_eq!(found[0].0, "E061", "{found:?}");
}

/// A trapezoid bends by F·l³/(3·E·I) with I of its section, and its mass is ρ·A·l; SUGAR's third is reported.
#[test]
fn trapezoidal_sections() {
    let text = "trapezoidalbeam p1 [a b] [l=100u wbottom=6u wtop=2u h=4u]\nf3d * [b] [F=1u oz=pi/2]";
    let second = 4e-6 / 48.0 * 8e-6 * 40e-12;
    near(moved(text, "b").y, 1e-6 * 1e-12 / (3.0 * 160e9 * second), 1e-9);
    let beam = &drawn(text).beams[0];
    near(beam.width * beam.thickness, 16e-12, 1e-12);
    assert!(warned(text).iter().any(|(code, message)| code == "W039" && message.contains("a third")));
}

/// A tapered cantilever bends by ∫(l − x)²/(E·I(x)) dx and turns by ∫(l − x)/(E·I(x)) dx, within 7e-4 however steep it is; thirty pieces of equal
/// length were up to 6 % off at a ratio of 16.
#[test]
fn tapered_beams() {
    for (w1, w2) in [(6.0, 2.0), (8.0, 0.5), (0.5, 8.0), (3.0, 3.0)] {
        let text = format!("taper2d p1 [a b] [l=100u w1={w1}u w2={w2}u]\nf2d * [b] [F=1n oz=pi/2]");
        let n = 200_000;
        let (mut bent, mut turned) = (0.0, 0.0);
        for k in 0..n {
            let x = 100e-6 * (f64::from(k) + 0.5) / f64::from(n);
            let width = 1e-6 * (w1 + (w2 - w1) * x / 100e-6);
            let piece = 1e-9 * (100e-6 - x) / (160e9 * 2e-6 * width.powi(3) / 12.0) * 100e-6 / f64::from(n);
            (bent, turned) = (bent + piece * (100e-6 - x), turned + piece);
        }
        near(moved(&text, "b").y, bent, 7e-4);
        near(moved(&text, "b").rz, turned, 7e-4);
    }
}

/// A soft joint stretches as its beam and bends a hundred times more.
#[test]
fn soft_joints() {
    for name in ["softjointlr", "hinge3"] {
        let text = format!("{name} p1 [a b] [l=100u w=2u]\nf2d * [b] [F=1n oz=pi/4]");
        let tip = moved(&text, "b");
        let f = 1e-9 * 0.5_f64.sqrt();
        near(tip.x, f * 100e-6 / EA, 1e-9);
        near(tip.y, 100.0 * f * 1e-12 / (3.0 * EI), 1e-9);
    }
}

/// A pinned bar carries E·A/l along itself and nothing across: of two cantilevers it joins end to end, only the first bends; its
/// weight is ρ·A·l.
#[test]
fn pinned_bars() {
    for name in ["freehinge", "hinge2"] {
        let text = |force: &str| {
            format!(
                "x {name} p1 [b c] [l=50u w=4u]\nbeam2d p1 [a b] [l=100u w=2u]\nbeam2d p1 [c d] [l=100u w=2u]\n\
                 anchor p1 [d] []\nf2d * [b] [F=1u {force}]"
            )
        };
        let across = text("oz=pi/2");
        near(moved(&across, "b").y, 1e-6 * 1e-12 / (3.0 * EI), 1e-9);
        near(moved(&across, "c").y, 0.0, 1e-6);
        // along: the first beam in parallel with bar and second beam in series
        let k = EA / 100e-6 + 1.0 / (50e-6 / (2.0 * EA) + 100e-6 / EA);
        near(moved(&text("oz=0"), "b").x, 1e-6 / k, 1e-9);
        let mass: f64 = drawn(&across).masses.iter().map(|m| m.mass).sum();
        near(mass, 2000.0 * 50e-6 * 4e-6 * 2e-6, 1e-12);
    }
}

/// A beam whose end slides along a slope of 30° under a force along it: it bends as its own stiffness projected on the
/// slope. A held direction of a part that may rotate is a spring with a displacement of some 1e-4 of that.
#[test]
fn sliding_ends() {
    let text = "slider2 p1 [a b] [l=100u w=2u slideroz=pi/6]\nf2d * [b] [F=1u oz=pi/6]";
    let tip = moved(text, "b");
    near(tip.y / tip.x, (PI / 6.0).tan(), 1e-4);
    let k = EA / 100e-6 * 0.75 + 3.0 * EI / 1e-12 * 0.25;
    near(tip.x.hypot(tip.y), 1e-6 / k, 1e-4);
}

/// The loads of a prestressed beam are K22·q: a cantilever beam beside it, loaded by −K22·q at its end, goes to −q.
#[test]
fn prestressed_loads() {
    let text =
        "beam2d p1 [a b] [l=100u w=2u oz=pi/3]\nprestressedbeam p1 [a b] [l=100u w=2u oz=pi/3 qx=1n qy=2n qoz=0.001]";
    let tip = moved(text, "b");
    let (s, c) = (PI / 3.0).sin_cos();
    near(tip.x * c + tip.y * s, -1e-9, 1e-9);
    near(tip.y * c - tip.x * s, -2e-9, 1e-9);
    near(tip.rz, -0.001_f64.to_radians(), 1e-9);
}

/// An arm of negative length is one that is turned round, in place and in stiffness.
#[test]
fn negative_arms() {
    let rest = "l=100u w=2u L2=20u oz2=pi/2] \nf2d * [b] [F=1n oz=1]";
    let one = format!("beam3dlink p1 [a b] [L1=-30u oz1=pi/2 {rest}");
    let other = format!("rigidlinkbeamcloaked p1 [a b] [L1=30u oz1=-pi/2 {rest}");
    let (s, t) = (drawn(&one), drawn(&other));
    let (x, y) = (at(&s, "b"), at(&t, "b"));
    near(x[0], 100e-6, 1e-12);
    near(x[1], -10e-6, 1e-12);
    near((x[0] - y[0]).hypot(x[1] - y[1]) + 1e-6, 1e-6, 1e-12);
    let (p, q) = (moved(&one, "b"), moved(&other, "b"));
    near(p.x, q.x, 1e-9);
    near(p.rz, q.rz, 1e-9);
}

/// Every name of the straight beam is the same beam.
#[test]
fn beams_of_many_names() {
    let want = moved("beam3d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=1n oz=1]", "b");
    for name in ["beam", "beam3d_2", "beam3d_perf", "beam3dnl", "beam3dnl6", "beam_R2", "prestressed"] {
        assert_eq!(moved(&format!("{name} p1 [a b] [l=100u w=2u]\nf2d * [b] [F=1n oz=1]"), "b"), want, "{name}");
    }
}

/// An anchor holds each of its nodes.
#[test]
fn anchors_hold_all_their_nodes() {
    let text = "pads anchor p1 [b c d] [l=1u w=1u]\nbeam2d p1 [a b] [l=10u w=1u]\nbeam2d p1 [b c] [l=10u w=1u]\nbeam2d p1 [c d] [l=10u w=1u]";
    let s = drawn(text);
    assert_eq!(s.supports.iter().filter(|x| x.name == "pads" && x.held == [true; 3]).count(), 3);
    assert!(warned(text).iter().any(|(code, message)| code == "W039" && message.contains("SUGAR holds the first")));
}

/// Drawn circuits are circuits: values, grounds, shorts; they place their nodes, between arms.
#[test]
fn drawn_circuits() {
    let text = "resistor * [a n] [len=30u R=55 oz=-pi/2 L2=10u oz2=pi/2]\nvoltage * [n g] [V=3 len=1u]\nshort * [a s] [len=2u]\n\
                ground * [g e] [len=1u]\ncapacitor * [s g] [C=1p]\neswitch * [s g] []\nbeam2d p1 [a z] [l=10u w=1u]";
    let s = drawn(text);
    let kinds: Vec<CircuitKind> = s.circuit.iter().map(|e| e.kind).collect();
    let volt = CircuitKind::VoltageSource;
    assert_eq!(kinds, [CircuitKind::Resistor, volt, volt, CircuitKind::Capacitor]);
    assert_eq!(s.circuit[2].value, Some(0.0));
    assert_eq!(s.electrical_grounds, [s.node("g").unwrap()]);
    let n = at(&s, "n");
    near(n[0], 10e-6, 1e-12);
    near(n[1], -30e-6, 1e-12);
    assert!(!s.nodes[s.node("n").unwrap().0].mechanical);
}

/// A source of small signals has its amplitude and phase, and no voltage at rest unless one is given.
#[test]
fn sources_of_small_signals() {
    let s = drawn(
        "Vsrc * [n g] [sv=2 sph=pi/2]\nVsrc * [m g] [V=5 sv=1]\nVsrc * [o g] [V=5]\neground * [g] []\nbeam2d p1 [a b] [l=1u w=1u]",
    );
    let small: Vec<_> = s.circuit.iter().map(|e| (e.value.unwrap(), e.small_signal)).collect();
    assert_eq!(small, [(0.0, Some([2.0, PI / 2.0])), (5.0, Some([1.0, 0.0])), (5.0, None)]);
}

/// Out of the plane: between anchors no member remains, a stout post is rigid and reported with its stiffness, and all
/// others are rejected.
#[test]
fn members_out_of_the_plane() {
    let beam = "beam2d p1 [a z] [l=10u w=1u]\n";
    let between = format!("{beam}anchor p1 [b] []\nbeam3d p1 [a b] [l=100u w=2u oy=1]");
    assert_eq!(drawn(&between).beams.len(), 1);
    assert!(warned(&between).iter().any(|(code, message)| code == "W038" && message.contains("between anchored")));
    let post =
        format!("{beam}beam3dlink p1 [z c] [l=2u w=10u h=10u oy=pi/2 L1=5u oy1=-pi/2]\nbeam2d p1 [c d] [l=20u w=2u]");
    let s = drawn(&post);
    assert_eq!((s.beams.len(), s.links.len()), (2, 1));
    near(at(&s, "c")[0], 15e-6, 1e-9);
    // E·w·h³/(4·l³) of the post as a cantilever
    assert!(
        warned(&post).iter().any(|(code, message)| code == "W038" && message.contains("5e7 N/m")),
        "{:?}",
        warned(&post)
    );
    for spatial in [
        "beam3d p1 [a b] [l=100u w=2u oy=1]",
        "beam3d p1 [a b] [l=100u w=2u oy=pi/2]",
        "beam3d p1 [a b] [l=9u w=2u ox=1]",
    ] {
        let found = refused(&format!("{beam}{spatial}"));
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].0, "E061");
    }
}

/// Sizes that are in range one by one and not in their products are refused, where they would become infinite.
#[test]
fn products_out_of_range() {
    for text in [
        "beam2d p1 [a b] [l=10u w=1u]\nprestressedbeam p1 [a b] [l=1e-200 w=2u qx=1n qoz=1]",
        "beam2d p1 [a b] [l=10u w=1e-150]",
        "freehinge p1 [a b] [l=1e-300 w=1e9]",
        "beam2d p1 [a b] [l=1e308 w=1u]\nbeam2d p1 [b c] [l=1e308 w=1u]",
    ] {
        assert_eq!(refused(text)[0].0, "E060", "{text}");
    }
}

/// A load per length is its nodal forces: p·l/2 and p·l²/12 of an even one, 3/20, 7/20 of p·l and p·l²/30, −p·l²/20 of one that grows.
#[test]
fn loads_per_length() {
    let of = |p: &str| {
        let s = drawn(&format!("beam2d p1 [a b] [l=100u w=2u oz=1]\np3d * [a b] [l=100u P={p}]"));
        [s.loads[0].force[1], s.loads[0].moment, s.loads[1].force[1], s.loads[1].moment]
    };
    let l: f64 = 100e-6;
    for (got, want) in of("2").into_iter().zip([l, l * l / 6.0, l, -l * l / 6.0]) {
        near(got, want, 1e-12);
    }
    assert_eq!(of("2"), of("\"2\""));
    let full = 2.0 * l;
    for (got, share) in of("'2.*x'").into_iter().zip([0.15 * l, l * l / 30.0, 0.35 * l, -l * l / 20.0]) {
        near(got, full * share, 1e-9);
    }
    assert_eq!(refused("beam2d p1 [a b] [l=1u w=1u]\np3d * [a b] [l=1u P='y+1']")[0].0, "E050");
}

/// Elements that only place nodes: a beam without section, a tracer.
#[test]
fn placing_beams() {
    let s = drawn(
        "beam2d p1 [a z] [l=1u w=1u]\nbeam2d p1 [a b] [l=10u w=0u h=0u oz=pi/2]\ntracer p1 [b c] [l=5u w=1u L1=2u]\nbeam2d p1 [c d] [l=1u w=1u]",
    );
    assert_eq!(s.beams.len(), 2);
    let c = at(&s, "c");
    near(c[0], 7e-6, 1e-12);
    near(c[1], 10e-6, 1e-12);
}

/// A parameter called like an angle is given with it, and turns the instance as well.
#[test]
fn angles_are_parameters_too() {
    let subnet =
        "subnet s [p q] [oz=* l=10u] [ assert_is_given = oz*2 beam2d parent [p q] [l=l*assert_is_given w=1u] ]\n";
    let s = drawn(&format!("{subnet}s p1 [a b] [oz=1.5]"));
    near(s.beams[0].length, 30e-6, 1e-12);
    near(s.beams[0].angle, 1.5, 1e-12);
}

/// Files that are no netlist are reported in words, and the help names no other kind.
#[test]
fn reported_in_words() {
    let reported =
        |name: &str, text: &str| load(&Bundle::from_text(name, text), &[]).expect_err("an error").items.remove(0);
    let script = reported("run.m", "% a sweep\nnet = cho_load('a.net');\n");
    assert_eq!((script.code.as_str(), script.line), ("E006", 2));
    assert_eq!(script.message, "`run.m` is a MATLAB file, not a netlist");
    let library = reported("cell.m", "% a cell\nsubnet cell [a b] [l=*] [ beam2d p7 [a b] [l=l w=width] ]\n");
    assert_eq!((library.code.as_str(), library.line), ("E007", 2));
    assert_eq!(library.message, "`cell.m` is a library: it has 1 subnet and draws nothing");
    let found = refused("slider1 p1 [a b] [l=1u]\n");
    assert_eq!((found[0].0.as_str(), found[0].2.contains("did you mean")), ("E055", false), "{found:?}");
    let found = refused("semicircularbaem p1 [a b] [l=1u]\n");
    assert_eq!(found[0].2, "did you mean `semicircularbeam`?");
}
