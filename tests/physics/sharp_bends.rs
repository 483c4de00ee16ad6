//! Loads that bend beams within a length far below theirs: the equilibrium is found on segments as short as that takes. Either branch of a bifurcation
//! can be chosen.

use super::{balance, close, model, node};
use bimorph::analysis::mesh::{modes_fitted, static_fitted};
use bimorph::compile::CompileOptions;
use bimorph::solve::equilibrium::LossKind;
use std::f64::consts::PI;

/// A cantilever 100 µm long that a force F pulls at 150° from its axis, √(EI/F) = 1 µm, 100th of its length: all of it but the clamp lies along the
/// force. The long elastica has (∂θ/∂s)² = 2·F·(1 − cos θ)/EI and therefore, with θ₀ the angle at the clamp and ℓ = √(EI/F), its tip at
/// L − 2ℓ·(1 − cos ½θ₀) along the force and 2ℓ·sin ½θ₀ across it (closed form). The force stretches it by 0.3 % and its own bend by as much.
#[test]
fn a_beam_bends_at_its_clamp_alone() {
    let (length, bend, angle) = (100e-6, 1e-6, 150f64.to_radians());
    let rigidity = 165e9 * 2e-6 * 0.2e-6f64.powi(3) / 12.0;
    let force = rigidity / (bend * bend);
    let text = format!("anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=0.2u]\nf2d * [b] [F={force:e} oz={angle}]");
    let compiled = model(&text, &CompileOptions::default());
    let (fitted, result, _) = static_fitted(&compiled, &[]).unwrap();
    let tip = node(&result, "b");
    let (x, y) = (length + tip.x, tip.y);
    let along = x * angle.cos() + y * angle.sin();
    let across = y * angle.cos() - x * angle.sin();
    close(along, (1.0 + force / (165e9 * 0.4e-12)) * length - 2.0 * bend * (1.0 - (0.5 * angle).cos()), 2e-4);
    close(across.abs(), 2.0 * bend * (0.5 * angle).sin(), 1e-2);
    assert!(fitted.order.segments[0] >= 64, "{:?}", fitted.order.segments);
    assert!(result.estimated_error.unwrap() <= 1e-3, "{:?}", result.estimated_error);
    // the modes are about that state, on a mesh that has it: those of a string of length L under the force F, n·√(F/m)/(2L) with one free end
    let (_, modes, _) = modes_fitted(&compiled, 1, &[]).unwrap();
    let string = (force / (2300.0 * 0.4e-12)).sqrt() / (4.0 * length);
    // the clamp shortens it by about ℓ, and its free end is stiff against shear by about as much
    assert!((modes.frequencies_hz[0] / string - 1.0).abs() < 0.05, "{} {string}", modes.frequencies_hz[0]);
}

/// A column under 1.9 of Euler's load leans to the left of its drawn direction, and with `other_branch` to the right: mirror images, 1e-9 apart.
#[test]
fn the_other_branch_is_the_mirror_image() {
    let euler = PI.powi(2) * (165e9 * 2e-6 * 1e-18 / 12.0) / (4.0 * 200e-6f64.powi(2));
    let text = format!(
        "anchor p1 [a] []\ncolumn beam2d p1 [a b] [l=200u w=1u oz=pi/2]\nf2d * [b] [F={:e} oz=-pi/2]",
        1.9 * euler
    );
    let on = |other_branch: bool| {
        balance(&model(&text, &CompileOptions { segments: Some(8), other_branch, ..CompileOptions::default() }), &[])
    };
    let (left, right) = (on(false), on(true));
    for (result, direction) in [(&left, "column to the left"), (&right, "column to the right")] {
        let [passed] = result.passed.as_slice() else { panic!("{:?}", result.passed) };
        assert!(passed.kind == LossKind::Bifurcation && passed.direction == direction, "{passed:?}");
    }
    let (left, right) = (node(&left, "b"), node(&right, "b"));
    assert!(left.x < -50e-6, "{left:?}");
    close(right.x, -left.x, 1e-9);
    close(right.y, left.y, 1e-9);
    close(right.rz, -left.rz, 1e-9);
}

/// Two clamped beams of 100 µm under a moment at their common end. Coarse meshes have an equilibrium at a third of the rotation, and their doubles have none;
/// the search continues to meshes that have the right one. Rotations of the extensible elastica x(L) = L, y(L) = 0, EI·θ'(L) = ½M (collocation by
/// scipy.integrate.solve_bvp, tolerance 1e-6).
#[test]
fn a_mesh_between_coarse_and_fine_has_no_equilibrium() {
    for (moment, rotation) in [(10e-9, 0.717018), (20e-9, 1.117575), (30e-9, 1.469926), (60e-9, 2.597643)] {
        let text = format!(
            "anchor p1 [r] []\nbeam2d p1 [r t] [l=100u w=1u]\nbeam2d p1 [t q] [l=100u w=1u]\nanchor p1 [q] []\nf2d * [t] [M={moment:e}]"
        );
        let (_, result, _) = static_fitted(&model(&text, &CompileOptions::default()), &[]).unwrap();
        close(node(&result, "t").rz, rotation, 1e-3);
        assert!(result.estimated_error.unwrap() <= 1e-3, "{moment:e}: {:?}", result.estimated_error);
    }
}

/// A moment that no beam at its node can bear: M/EI is a radius of 35 nm for the beam of 0.6 µm, and less for the other. Past the first loss of stability the
/// part winds itself up, and the refusal says so.
#[test]
fn a_moment_that_winds_beams_up_is_refused_by_what_it_does() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=0.5u]\nbeam2d p1 [b c] [l=80u w=0.6u oz=1.2]\nanchor p1 [c] []\n\
        f2d * [b] [F=3m M=2e-7 oz=3.5]";
    let error = static_fitted(&model(text, &CompileOptions::default()), &[]).unwrap_err().to_string();
    assert!(error.contains("is bent to a radius of") || error.contains("winds up, by"), "{error}");
}
