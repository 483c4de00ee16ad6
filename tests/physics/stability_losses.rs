//! Equilibria far beyond the first loss of stability: which state a slowly growing load reaches, what is reported of the way, and what a slender
//! beam beside a column does not hide.

use super::{balance, close, model, node};
use bimorph::analysis::mesh::{pull_in_fitted, static_fitted};
use bimorph::analysis::statics::StaticResult;
use bimorph::compile::CompileOptions;
use bimorph::solve::equilibrium::LossKind;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Bending stiffness EI of a section `w` wide, 2 µm thick, E = 165 GPa (N·m²).
fn rigidity(w: f64) -> f64 {
    165e9 * 2e-6 * w.powi(3) / 12.0
}

fn segments(n: usize) -> CompileOptions {
    CompileOptions { segments: Some(n), ..CompileOptions::default() }
}

/// The elastica far beyond Euler's load, which is 0.53, 0.24 and 0.11 of these loads. The compared values are the end
/// angle, the load over Euler's load, and the distances of the tip from the clamp along and across the column over its
/// length. They are from S. P. Timoshenko, J. M. Gere, "Theory of Elastic Stability" (1961), table 2-3. The load acts
/// along the column's axis, so that the loss is a bifurcation at Euler's load π²EI/4L². The column goes to the left of
/// its drawn direction.
#[test]
fn a_column_far_beyond_eulers_load_is_the_elastica() {
    let (length, width) = (200e-6, 1e-6);
    let euler = PI.powi(2) * rigidity(width) / (4.0 * length * length);
    for (times, along, across) in [(1.884, 0.123, 0.803), (4.029, -0.340, 0.625), (9.116, -0.577, 0.421)] {
        let text = format!(
            "anchor p1 [a] []\ncolumn beam2d p1 [a b] [l=200u w=1u oz=pi/2]\nf2d * [b] [F={:e} oz=-pi/2]",
            times * euler
        );
        let result = balance(&model(&text, &segments(24)), &[]);
        let tip = node(&result, "b");
        assert!((1.0 + tip.y / length - along).abs() < 4e-3, "{times}: {}", 1.0 + tip.y / length);
        assert!((-tip.x / length - across).abs() < 4e-3, "{times}: {}", tip.x / length);
        let [passed] = result.passed.as_slice() else { panic!("{:?}", result.passed) };
        assert!(
            result.jumped && passed.kind == LossKind::Bifurcation && passed.direction == "column to the left",
            "{passed:?}"
        );
        // 24 segments bear 1e-3 more than the column; the column is shortened by 1e-4 before it buckles
        close(passed.share, 1.0 / times, 3e-3);
    }
}

/// A frame closed by a slender beam, held by two anchors.
fn overloaded(load: f64) -> String {
    format!(
        "anchor p1 [a] []\nb0 beam2d p1 [a b] [l=120u w=2u oz=0.1]\nb1 beam2d p1 [b c] [l=110u w=1.2u oz=1.7]\n\
         b2 beam2d p1 [b d] [l=100u w=0.6u oz=0.2]\nb3 beam2d p1 [d e] [l=90u w=2.5u oz=1.4]\nb4 beam2d p1 [c d] [w=0.7u]\n\
         anchor p1 [e] []\nf2d * [c] [F={load:e} oz=-2.2]\nf2d * [b] [F={:e} oz=-2.9]",
        0.3 * load,
    )
}

/// Loads of [`overloaded`], some up to 300 times what its slender members bear (N).
const LOADS: [f64; 3] = [2e-5, 2e-4, 1e-3];

/// Loads far beyond what slender members bear have an equilibrium, on finer segments where those of the first mesh are turned too far from their chords, and
/// the losses on the way are reported in order.
#[test]
fn frames_rest_far_beyond_their_first_loss() {
    for load in LOADS {
        let found = static_fitted(&model(&overloaded(load), &CompileOptions::default()), &[]);
        let (_, result, _) = found.unwrap_or_else(|error| panic!("{load:e}: {error}"));
        let shares: Vec<f64> = result.passed.iter().map(|passed| passed.share).collect();
        assert!(shares.is_sorted() && shares.iter().all(|s| (0.0..1.0).contains(s)), "{shares:?}");
        assert_eq!(result.jumped, !shares.is_empty());
    }
}

/// Two beams from two anchors to a corner, pushed across.
fn corner(angle: f64, load: f64) -> String {
    format!(
        "anchor p1 [a] []\nb0 beam2d p1 [a b] [l=120u w=2u oz={:?}]\nb1 beam2d p1 [b c] [l=90u w=1.4u oz={:?}]\nanchor p1 [c] []\n\
         f2d * [b] [F={load:e} oz={:?}]",
        0.35 + angle,
        angle - 0.25,
        angle - 1.4,
    )
}

/// A part snaps through at the same load, whatever larger load it is loaded to, and as a limit point: within 1e-6 of it, to which losses are located.
#[test]
fn a_limit_point_does_not_depend_on_the_load_beyond() {
    let critical = |load: f64| {
        let result = balance(&model(&corner(0.0, load), &segments(8)), &[]);
        let [passed] = result.passed.as_slice() else { panic!("{:?}", result.passed) };
        assert!(passed.kind == LossKind::LimitPoint && !passed.direction.is_empty(), "{passed:?}");
        load * passed.share
    };
    let reference = critical(2e-4);
    for load in [4e-4, 1.5e-3, 6e-3] {
        close(critical(load), reference, 1e-6);
    }
}

/// Motions of all nodes in the frame of the drawing, turned back.
fn turned_back(result: &StaticResult, angle: f64) -> Vec<[f64; 3]> {
    let (sin, cos) = angle.sin_cos();
    result.nodes.iter().map(|(_, m)| [cos * m.x + sin * m.y, cos * m.y - sin * m.x, m.rz]).collect()
}

/// No state depends on the direction of the drawing, at 24 angles: a beam between anchors that heat buckles, a portal whose two columns sway (both
/// bifurcations), and a frame beyond limit points. Differences are those of rounding, 1e-8 of the largest motion.
#[test]
fn states_do_not_depend_on_the_direction_of_the_drawing() {
    let heated = |angle: f64| {
        format!(
            "process warm : p1 = [thermalexpansion=1e-6 ambienttemperature=0]\nanchor p1 [a] []\n\
             l beam2d warm [a m] [l=100u w=2u T=1000 oz={angle:?}]\nr beam2d warm [m b] [l=100u w=2u T=1000 oz={angle:?}]\nanchor p1 [b] []"
        )
    };
    let portal = |angle: f64| {
        let up = angle + FRAC_PI_2;
        format!(
            "anchor p1 [a] []\nl beam2d p1 [a c] [l=100u w=1u oz={up:?}]\nt beam2d p1 [c d] [l=100u w=2u oz={angle:?}]\n\
             r beam2d p1 [d b] [l=100u w=1u oz={:?}]\nanchor p1 [b] []\nf2d * [c] [F=27u oz={:?}]\nf2d * [d] [F=27u oz={:?}]",
            angle - FRAC_PI_2,
            angle - FRAC_PI_2,
            angle - FRAC_PI_2,
        )
    };
    let frame = |angle: f64| corner(angle, 1.5e-3);
    let cases: [(&str, &dyn Fn(f64) -> String); 3] = [("heated", &heated), ("portal", &portal), ("frame", &frame)];
    for (name, text) in cases {
        let at = |angle: f64| {
            let result = balance(&model(&text(angle), &segments(4)), &[]);
            (turned_back(&result, angle), result.passed)
        };
        let (reference, passed) = at(0.0);
        assert!(!passed.is_empty(), "{name}");
        let largest = reference.iter().map(|m| m[0].hypot(m[1])).fold(0.0, f64::max);
        for k in 1..24 {
            let (found, its) = at(TAU * f64::from(k) / 24.0);
            let apart = found.iter().zip(&reference).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
            assert!(apart < 1e-8 * largest, "{name} at {} °: {:e} of {largest:e}", 15 * k, apart);
            let directions = |list: &[bimorph::solve::equilibrium::StabilityLoss]| -> Vec<String> {
                list.iter().map(|passed| passed.direction.clone()).collect()
            };
            assert_eq!(directions(&its), directions(&passed), "{name} at {} °", 15 * k);
        }
    }
}

/// W046 names pull-in where voltages soften a part and buckling where a thrust does. Voltages 1e-5 below pull-in of plates on a spring and on a cantilever; a
/// column 0.4 % below Euler's load.
#[test]
fn warnings_name_pull_in_and_buckling() {
    let warned = |text: &str, options: &CompileOptions, voltages: &[(String, f64)]| {
        let (fitted, ..) = static_fitted(&model(text, options), voltages).unwrap();
        let near = fitted.warnings.items.into_iter().find(|warning| warning.code == "W046");
        near.map(|warning| warning.message).unwrap_or_default()
    };
    let spring = "anchor * [f] []\nspring2d * [f a] [kx=1]\nmass2d * [a] [m=1e-10]\nguide2d * [a] []\n\
        plategap2d * [a b] [A=1e-8 gap=4u]\nanchor * [b] []\neground * [b] []\ndrive port * [a b] []";
    let plates = "anchor p1 [f] []\narm beam2d p1 [f a] [l=100u w=2u]\n\
        plategap2d p1 [a b] [A=1e-8 gap=2u oz=pi/2]\nanchor p1 [b] []\neground * [b] []\ndrive port * [a b] []";
    for (text, softest) in [(spring, ""), (plates, "; softest motion: beam arm")] {
        let found = pull_in_fitted(&model(text, &segments(8)), None, 100.0).unwrap().1;
        let below = [("drive".to_owned(), found.pull_in_v * (1.0 - 1e-5))];
        let message = warned(text, &segments(8), &below);
        assert_eq!(message, format!("the voltages are within 1 % of pull-in{softest}"));
        assert_eq!(warned(text, &segments(8), &[("drive".to_owned(), found.pull_in_v * 0.95)]), "");
    }
    let euler = 4.0 * PI.powi(2) * rigidity(2.2e-6) / (120e-6 * 120e-6);
    let column = format!(
        "anchor p1 [a] []\ncolumn beam2d p1 [a tip] [l=120u w=2.2u oz=pi/2]\nguide2d * [tip] [oz=pi/2]\nf2d * [tip] [F={:e} oz=-pi/2]",
        0.996 * euler
    );
    assert_eq!(
        warned(&column, &CompileOptions::default(), &[]),
        "the load is within 1 % of buckling; softest motion: beam column"
    );
}

/// A column with a guided end 0.4 % above Euler's load 4π²EI/L² has buckled, and a slender beam attached at its foot or
/// at its head does not hide that; 5 % below, it stands straight in both cases. A column that buckles at most 1 % above
/// the load says so.
#[test]
fn a_slender_beam_hides_no_buckling() {
    let (length, width) = (120e-6, 2.2e-6);
    let euler = 4.0 * PI.powi(2) * rigidity(width) / (length * length);
    let column = |times: f64, beside: &str| {
        let text = format!(
            "anchor p1 [a] []\ncolumn beam2d p1 [a tip] [l=120u w=2.2u oz=pi/2]\nguide2d * [tip] [oz=pi/2]\nf2d * [tip] [F={:e} oz=-pi/2]\n{beside}",
            times * euler
        );
        let (fitted, result, _) = static_fitted(&model(&text, &CompileOptions::default()), &[]).unwrap();
        let near = fitted.warnings.items.iter().any(|warning| warning.code == "W046");
        (result.jumped, near, node(&result, "tip").y)
    };
    for beside in ["", "beam2d p1 [a end] [l=400u w=0.5u oz=0]", "beam2d p1 [tip end] [l=300u w=0.4u oz=0.3]"] {
        let (jumped, _, above) = column(1.004, beside);
        assert!(jumped, "{beside}: straight at 1.004 of Euler's load");
        let (jumped, near, below) = column(0.95, beside);
        assert!(!jumped && !near, "{beside}: {jumped} {near}");
        // the head comes down further when the column bends
        assert!(above < 1.01 * below, "{beside}: {above:e} {below:e}");
        let (jumped, near, _) = column(0.996, beside);
        assert!(!jumped && near, "{beside}: {jumped} {near}");
    }
}
