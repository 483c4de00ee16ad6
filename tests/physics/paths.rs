//! Equilibrium paths by arc length: buckling, post-buckling, snap-through, pull-in and what lies behind it.

use crate::{close, model};
use bimorph::analysis::continuation::{ContinuationRequest, ContinuationResult, PathInput, trace};
use bimorph::analysis::mesh::path_fitted;
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::{Setting, read_bundle};
use bimorph::solve::continuation::Branch;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

const E: f64 = 165e9;
const L: f64 = 200e-6;
const W: f64 = 2e-6;
/// Bending stiffness of the column's section, 2 µm by 2 µm.
const EI: f64 = E * W * W * W * W / 12.0;
/// Euler's load of a clamped column.
const EULER: f64 = 4.0 * PI * PI * EI / (L * L);

fn scene(name: &str, set: &[(&str, f64)], options: &CompileOptions) -> CompiledModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
    let bundle = read_bundle(&path, &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
    let set = set.iter().map(|(n, v)| ((*n).to_owned(), Setting::Number(*v))).collect();
    compile(&bundle, &CompileOptions { set, junctions: Junctions::Centreline, ..options.clone() })
        .unwrap_or_else(|e| panic!("{e}"))
}

fn fine() -> CompileOptions {
    CompileOptions { band: Some(2e7), ..CompileOptions::default() }
}

fn follow(model: &CompiledModel, by: PathInput<'_>, to: f64, signals: &[&str], branch: Branch) -> ContinuationResult {
    let signals = signals.iter().map(|s| (*s).to_owned()).collect();
    let request = ContinuationRequest { input: by, from: 0.0, to, voltages: vec![], signals, branch, points: 3000 };
    trace(model, &request, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
}

/// Complete elliptic integral K(k) by the arithmetic-geometric mean.
fn complete(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    while (a - b) / a > 1e-15 {
        (a, b) = (f64::midpoint(a, b), (a * b).sqrt());
    }
    FRAC_PI_2 / a
}

/// k with K(k) = value.
fn modulus(value: f64) -> f64 {
    let (mut low, mut high) = (0.0, 0.999_999);
    for _ in 0..80 {
        let k = f64::midpoint(low, high);
        if complete(k) < value { low = k } else { high = k }
    }
    low
}

/// The straight column bifurcates at Euler's 4·π²·E·I/l² (which 1 − P/EA lowers by the strain, 3e-4) within 0.1 %, and
/// continues on the requested branch. It bends by l·k/K(k) with K(k) = (π/2)·√(P/P_E) (elastica of a quarter of it;
/// Timoshenko & Gere, "Theory of elastic stability", §2.7) within 0.2 % at 1.2 times the load. Straight on, it is
/// unstable.
#[test]
fn column() {
    let file = "column/column.net";
    let (first, last) = (scene(file, &[], &fine()), scene(file, &[("F", 1.2 * EULER)], &fine()));
    let to = |branch| follow(&first, PathInput::Parameter(&last), 1.2 * EULER, &["middle.y", "end.x"], branch);
    let bent = (modulus(FRAC_PI_2 * 1.2f64.sqrt()), FRAC_PI_2 * 1.2f64.sqrt());
    let want = L * bent.0 / bent.1;
    for (branch, sign) in [(Branch::Plus, 1.0), (Branch::Minus, -1.0)] {
        let path = to(branch);
        assert_eq!((path.end, path.folds.len(), path.bifurcations.len()), ("arrived", 0, 1));
        close(path.bifurcations[0].value, EULER, 1e-3);
        close(*path.signals[0].2.last().unwrap(), sign * want, 2e-3);
        assert_eq!(*path.negative.last().unwrap(), 0);
    }
    let straight = to(Branch::Stay);
    assert_eq!(straight.negative.last(), Some(&1));
    assert!(straight.signals[0].2.iter().all(|y| y.abs() < 1e-12));
    close(*straight.signals[1].2.last().unwrap(), -1.2 * EULER * L / (E * W * W), 1e-6);
}

/// A path to 0.99 or 0.9999 of the load at which it bifurcates ends there, straight. (It ended on the bent branch,
/// beyond the requested value.)
#[test]
fn ends_before_a_bifurcation() {
    let at = |force: f64| scene("column/column.net", &[("F", force)], &fine());
    let whole = follow(&at(0.0), PathInput::Parameter(&at(1.2 * EULER)), 1.2 * EULER, &[], Branch::Plus);
    for share in [0.99, 0.9999] {
        let to = share * whole.bifurcations[0].value;
        let path = follow(&at(0.0), PathInput::Parameter(&at(to)), to, &["middle.y"], Branch::Plus);
        assert_eq!((path.end, path.bifurcations.len(), path.negative.last()), ("arrived", 0, Some(&0)), "{share}");
        close(*path.values.last().unwrap(), to, 1e-12);
        assert!(path.signals[0].2.iter().all(|y| y.abs() < 1e-12));
    }
}

/// The mesh of a path holds the tolerance by default. Euler's load and the bend at 1.2 times that are compared with the
/// same on 128 segments; the estimate is within the tolerance and no smaller than a third of the error. `--linear`,
/// which cannot buckle, says so.
#[test]
fn the_mesh_of_a_path_holds_the_tolerance() {
    let to = 1.2 * EULER;
    let found = |options: &CompileOptions| {
        let at = |force: f64| scene("column/column.net", &[("F", force)], options);
        let (first, last) = (at(0.0), at(to));
        let request = ContinuationRequest {
            input: PathInput::Parameter(&last),
            from: 0.0,
            to,
            voltages: vec![],
            signals: vec!["middle.y".to_owned()],
            branch: Branch::Plus,
            points: 3000,
        };
        path_fitted(&first, &request, &mut |_| true).unwrap()
    };
    let both = |path: &ContinuationResult| [path.bifurcations[0].value, *path.signals[0].2.last().unwrap()];
    let exact = both(&found(&CompileOptions { segments: Some(128), ..CompileOptions::default() }).1);
    for tol in [1e-2, 1e-3, 1e-4] {
        let (fitted, path) = found(&CompileOptions { tol, ..CompileOptions::default() });
        let reported = fitted.order.estimated_error.unwrap();
        let error = both(&path).iter().zip(exact).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(error <= tol && reported <= tol && 3.0 * reported >= error, "{tol}: off by {error}, told {reported}");
    }
    // a path that ends by its limit of points has no particular end: there is no error estimate
    let last = scene("column/column.net", &[("F", to)], &CompileOptions::default());
    let request = ContinuationRequest {
        input: PathInput::Parameter(&last),
        from: 0.0,
        to,
        voltages: vec![],
        signals: vec![],
        branch: Branch::Plus,
        points: 5,
    };
    let first = scene("column/column.net", &[("F", 0.0)], &CompileOptions::default());
    let (short, _) = path_fitted(&first, &request, &mut |_| true).unwrap();
    assert_eq!(short.order.estimated_error, None);
    assert!(short.warnings.items.iter().any(|d| d.code == "W040"));
    let (linear, path) = found(&CompileOptions { linear: true, ..CompileOptions::default() });
    assert!(path.bifurcations.is_empty());
    assert!(linear.warnings.items.iter().any(|d| d.message.contains("would buckle")), "{:?}", linear.warnings);
}

/// Two segments find Euler's load of a column pinned at both ends, π²·E·I/l², within 1 % (its half is a cantilever of
/// one segment), and that of a cantilever within 0.1 %. Clamped at both ends they give 40·E·I/l², 1.3 % above it, as
/// two cubic elements do.
#[test]
fn columns_of_two_segments() {
    let cut = |segments: usize| CompileOptions { segments: Some(segments), ..CompileOptions::default() };
    let critical = |at: &dyn Fn(f64) -> CompiledModel, to: f64, signal: &str| {
        let path = follow(&at(0.0), PathInput::Parameter(&at(to)), to, &[signal], Branch::Stay);
        path.bifurcations[0].value
    };
    let cantilever = |segments: usize| {
        move |force: f64| {
            let set = vec![("F".to_owned(), Setting::Number(force))];
            let text = "param F=0\nanchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=F oz=pi]";
            model(text, &CompileOptions { set, ..cut(segments) })
        }
    };
    // a cantilever of half the length bears a quarter of what the clamped column does
    let euler = EULER / 4.0;
    close(critical(&cantilever(1), 1.3 * euler, "b.y"), euler, 1e-2);
    close(critical(&cantilever(2), 1.3 * euler, "b.y"), euler, 1e-3);
    let clamped = |force: f64| scene("column/column.net", &[("F", force)], &cut(1));
    close(critical(&clamped, 1.3 * EULER, "middle.y"), EULER * 10.0 / (PI * PI), 2e-3);
}

/// With a side load as imperfection there is no bifurcation: the column bends from the start and follows the elastica.
#[test]
fn column_with_imperfection() {
    let file = "column/column.net";
    let (first, last) =
        (scene(file, &[("side", 1e-8)], &fine()), scene(file, &[("side", 1e-8), ("F", 1.2 * EULER)], &fine()));
    let path = follow(&first, PathInput::Parameter(&last), 1.2 * EULER, &["middle.y"], Branch::Plus);
    assert!(path.bifurcations.is_empty() && path.folds.is_empty());
    let k = modulus(FRAC_PI_2 * 1.2f64.sqrt());
    close(*path.signals[0].2.last().unwrap(), L * k / (FRAC_PI_2 * 1.2f64.sqrt()), 5e-3);
}

/// A beam clamped at both ends buckles when its free strain comes to P_E/EA, and bends by (2·l/π)·√(strain − P_E/EA) in its
/// middle (cosine shape): within 0.5 %.
#[test]
fn clamped_beam_buckles_by_heat() {
    let text = |rise: f64| {
        let text = "param T=293
            anchor p1 [a] []
            beam2d p1 [a m] [l=100u w=2u T=T]
            beam2d p1 [m b] [l=100u w=2u T=T]
            anchor p1 [b] []";
        let set = vec![("T".to_owned(), Setting::Number(293.0 + rise))];
        model(text, &CompileOptions { set, ..fine() })
    };
    let critical = EULER / (E * W * W);
    let rise = 2.0 * critical / 2.33e-6;
    let path = follow(&text(0.0), PathInput::Parameter(&text(rise)), rise, &["m.y"], Branch::Plus);
    close(path.bifurcations[0].value, critical / 2.33e-6, 1e-3);
    close(*path.signals[0].2.last().unwrap(), 2.0 * L / PI * critical.sqrt(), 5e-3);
}

/// The clamped shallow arch snaps through at 5.4336 µN and 2.409 µm and back at 0.4080 µN and 6.575 µm. Loads are
/// within 1 % of the larger, and places within 1 % of the exact solution of the shallow-arch equation (closed form over
/// the axial force). Without a hold on its top it leaves the even path earlier, sways, and comes back to it on the
/// other side.
#[test]
fn arch_snaps_through() {
    let file = "arch/arch.net";
    let coarse = CompileOptions::default();
    let at = |force: f64, even: f64| scene(file, &[("F", force), ("even", even)], &coarse);
    let even = follow(&at(0.0, 1.0), PathInput::Parameter(&at(1e-5, 1.0)), 1e-5, &["p(20).y"], Branch::Plus);
    assert_eq!((even.end, even.folds.len(), even.bifurcations.len()), ("arrived", 2, 0));
    let y = |k: usize| even.signals[0].2[even.folds[k].point];
    close(even.folds[0].value, 5.4336e-6, 1e-2);
    close(y(0), -2.409e-6, 1e-2);
    assert!((even.folds[1].value - 0.4080e-6).abs() < 1e-2 * 5.4336e-6, "{}", even.folds[1].value);
    close(y(1), -6.575e-6, 1e-2);
    let sways =
        follow(&at(0.0, 0.0), PathInput::Parameter(&at(1e-5, 0.0)), 1e-5, &["p(20).y", "p(20).rz"], Branch::Plus);
    assert_eq!((sways.end, sways.bifurcations.len()), ("arrived", 2));
    assert!(sways.bifurcations[0].value < even.folds[0].value);
    assert_eq!(sways.negative.last(), Some(&0));
    assert!(sways.signals[1].2.iter().any(|rz| rz.abs() > 1e-2));
}

/// A chevron under a force at its apex leaves the even path and returns to it, at loads within 0.5 % on any mesh, and no warning says that a
/// bifurcation was not located (before: one on most meshes). The branch between is unstable at both.
#[test]
fn a_branch_that_returns_is_located_on_any_mesh() {
    let at = |force: f64, segments: usize| {
        let text = format!(
            "l = 150u/cos(0.06)\nanchor p1 [left] []\nbeam2d p1 [left apex] [l=l w=3u oz=0.06]\nbeam2d p1 [apex right] [l=l w=3u \
             oz=-0.06]\nanchor p1 [right] []\nf2d * [apex] [F={force:e} oz=-pi/2]"
        );
        model(&text, &CompileOptions { segments: Some(segments), ..CompileOptions::default() })
    };
    let found = |segments: usize| {
        let (first, last) = (at(0.0, segments), at(1e-4, segments));
        let path = follow(&first, PathInput::Parameter(&last), 1e-4, &["apex.y"], Branch::Plus);
        assert_eq!((path.end, path.bifurcations.len()), ("arrived", 2), "{segments} segments");
        assert!(path.warnings.iter().all(|w| !w.contains("not located")), "{segments} segments: {:?}", path.warnings);
        let negative = [0, 1].map(|k| path.negative[path.bifurcations[k].point]);
        assert_eq!(negative, [0, 1], "{segments} segments");
        [0, 1].map(|k| path.bifurcations[k].value)
    };
    let exact = found(32);
    for segments in [8, 9, 10, 11, 12, 16, 20] {
        found(segments).iter().zip(exact).for_each(|(value, exact)| assert!((value - exact).abs() < 5e-3 * 7e-5));
    }
}

/// The voltage of a lumped plate folds at √(8·k·g³/(27·ε·A)) = 5.1741 V and g/3 (Nathanson 1967), to 1e-4, and the path
/// continues behind pull-in along the unstable branch, where V² = 2·k·u·(g − u)²/(ε·A).
#[test]
fn behind_pull_in() {
    let text = "
    anchor * [f] []
    spring2d * [f m] [kx=1 l=5u]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    plategap2d * [m e] [A=1e-8 gap=2u]
    anchor * [e] []
    eground * [e] []
    drive port * [m] []";
    let plate = model(text, &CompileOptions::default());
    let path = follow(&plate, PathInput::Port("drive"), 6.0, &["m.x"], Branch::Plus);
    let g: f64 = 2e-6;
    let fold = &path.folds[0];
    close(fold.value, (8.0 * g.powi(3) / (27.0 * 8.854e-12 * 1e-8)).sqrt(), 1e-4);
    close(path.signals[0].2[fold.point], g / 3.0, 1e-4);
    let behind: Vec<(f64, f64)> =
        (fold.point + 1..path.values.len()).map(|k| (path.values[k], path.signals[0].2[k])).collect();
    let unstable: Vec<_> = behind.iter().filter(|(_, u)| *u < 1.8e-6).collect();
    assert!(unstable.len() > 5);
    for (v, u) in unstable {
        close(v * v, 2.0 * u * (g - u).powi(2) / (8.854e-12 * 1e-8), 1e-6);
    }
}

/// A moment of 2·π·E·I/l rolls a cantilever up to a full circle: its tip comes back to the root, within 0.3 % of its length.
/// A force of E·I/l² on the way bends it to the elastica (0.056433, 0.301721)·l, within 1e-4.
#[test]
fn roll_up_and_elastica() {
    let text = "param M=0 param F=0
    anchor p1 [root] []
    beam2d p1 [root tip] [l=200u w=2u]
    f3d * [tip] [M=M oy=-pi/2]
    f2d * [tip] [F=F oz=pi/2]";
    let at = |name: &str, value: f64| {
        let set = vec![(name.to_owned(), Setting::Number(value))];
        model(text, &CompileOptions { set, band: Some(1e7), ..CompileOptions::default() })
    };
    let moment = 2.0 * PI * EI / L;
    let circle = follow(
        &at("M", 0.0),
        PathInput::Parameter(&at("M", moment)),
        moment,
        &["tip.x", "tip.y", "tip.rz"],
        Branch::Plus,
    );
    assert_eq!((circle.folds.len(), circle.bifurcations.len()), (0, 0));
    let last = |k: usize| *circle.signals[k].2.last().unwrap();
    assert!((last(0) + L).hypot(last(1)) < 3e-3 * L, "{} {}", last(0), last(1));
    close(last(2), 2.0 * PI, 1e-6);
    let force = EI / (L * L);
    let bent = follow(&at("F", 0.0), PathInput::Parameter(&at("F", force)), force, &["tip.x", "tip.y"], Branch::Plus);
    close(*bent.signals[0].2.last().unwrap(), -0.056_433_236_283_376_88 * L, 1e-3);
    close(*bent.signals[1].2.last().unwrap(), 0.301_720_773_799_813_5 * L, 1e-4);
}

/// A parameter that changes the geometry is refused, not followed.
#[test]
fn geometry_is_no_load() {
    let text = "param w=2u
    anchor p1 [root] []
    beam2d p1 [root tip] [l=200u w=w]";
    let at = |w: f64| {
        model(text, &CompileOptions { set: vec![("w".into(), Setting::Number(w))], ..CompileOptions::default() })
    };
    let request = ContinuationRequest {
        input: PathInput::Parameter(&at(3e-6)),
        from: 2e-6,
        to: 3e-6,
        voltages: vec![],
        signals: vec![],
        branch: Branch::Plus,
        points: 10,
    };
    let refused = trace(&at(2e-6), &request, &mut |_| true).unwrap_err().to_string();
    assert!(refused.contains("changes the mechanism itself"), "{refused}");
}

/// Residual stress tunes a clamped beam: 435.319 kHz without, 596.393 kHz at +50 MPa and 371.932 kHz at −15 MPa (roots of the
/// frequency equation of a beam under axial force; Bokaian, J. Sound Vib. 115 (1987) 1), within 0.1 %.
#[test]
fn residual_stress_tunes_a_beam() {
    let text = "param stress=0
    anchor p1 [a] []
    beam2d p1 [a m] [l=100u w=2u stress=stress]
    beam2d p1 [m b] [l=100u w=2u stress=stress]
    anchor p1 [b] []";
    for (stress, want) in [(0.0, 435_318.707), (50e6, 596_392.540), (-15e6, 371_931.800)] {
        let set = vec![("stress".to_owned(), Setting::Number(stress))];
        let beam = model(text, &CompileOptions { set, ..fine() });
        close(bimorph::analysis::modes::modes(&beam, 1, &[]).unwrap().frequencies_hz[0], want, 1e-3);
    }
}

/// A clamped beam stretches as it bends: 100 µN in its middle move it by 4.4389 µm, not by the 18.94 µm of small
/// displacements, within 0.5 %. The reference is the exact solution of the beam under its own tension (closed form over
/// the tension).
#[test]
fn a_clamped_beam_stiffens() {
    let text = "
    anchor p1 [a] []
    beam2d p1 [a m] [l=100u w=2u]
    beam2d p1 [m b] [l=100u w=2u]
    anchor p1 [b] []
    f2d * [m] [F=100u oz=pi/2]";
    close(crate::node(&crate::balance(&model(text, &fine()), &[]), "m").y, 4.438_931e-6, 5e-3);
}

/// A rest curvature bends a free cantilever to the arc of that curvature: its tip to (sin(κl)/κ − l, (1 − cos(κl))/κ), to
/// 1e-3; between two pads it does nothing but press on them.
#[test]
fn rest_curvature_bends_to_an_arc() {
    let curvature: f64 = 2000.0;
    let text = "
    anchor p1 [a] []
    beam2d p1 [a tip] [l=200u w=2u curvature=2000]";
    let tip = crate::node(&crate::balance(&model(text, &fine()), &[]), "tip");
    close(tip.x, (curvature * L).sin() / curvature - L, 1e-3);
    close(tip.y, (1.0 - (curvature * L).cos()) / curvature, 1e-3);
    close(tip.rz, curvature * L, 1e-6);
    let held = "
    anchor p1 [a] []
    beam2d p1 [a m] [l=100u w=2u curvature=2000]
    beam2d p1 [m b] [l=100u w=2u curvature=2000]
    anchor p1 [b] []";
    let middle = crate::node(&crate::balance(&model(held, &fine()), &[]), "m");
    assert!(middle.y.abs() < 1e-15, "{middle:?}");
}
