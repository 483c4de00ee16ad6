//! The mesh of a run follows what its modes and signals show, and no further: contracts of `analysis::mesh` for transients.

use bimorph::analysis::chart::error::relative_error;
use bimorph::analysis::mesh::fitted_in_time;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::netlist::{Bundle, Setting, read_bundle};
use std::path::Path;

/// Two short beams between anchors and a load where they meet, which moves them along as well: waves of some gigahertz.
const BRIDGE: &str = "process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a] []
beam2d p [a b] [l=30u w=1.5u oz=deg(45)]
beam2d p [b z] [l=50u w=2u oz=deg(30)]
anchor p [z] []
f2d * [b] [F=1u oz=deg(45)]
";

/// Beams with a plate, bent far by a load that is released.
const BRANCHES: &str = "param F=0
process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a] []
beam2d p [a b] [l=100u w=2u oz=deg(90)]
beam2d p [b c] [l=60u w=4u oz=deg(45)]
beam2d p [c d] [l=100u w=2u oz=deg(45)]
beam2d p [a e] [l=100u w=8u oz=deg(20)]
mass2d * [c] [m=1e-12 J=1e-20]
f2d * [c] [F=F oz=deg(45)]
";

/// A run of `bundle`, released from the load `F` if there is one; with the model that it ran on.
fn run(
    bundle: &Bundle,
    force: Option<f64>,
    stop: f64,
    signals: &[&str],
    options: &CompileOptions,
) -> (TransientResult, CompiledModel) {
    let model = compile(bundle, options).unwrap();
    let loaded = force.map(|force| {
        let set = vec![("F".to_owned(), Setting::Number(force))];
        compile(bundle, &CompileOptions { set, ..options.clone() }).unwrap()
    });
    let asked = TransientOptions {
        stop,
        signals: signals.iter().map(|s| (*s).to_owned()).collect(),
        tol: options.tol,
        release: loaded.as_ref(),
        ..TransientOptions::default()
    };
    let (model, start) = fitted_in_time(&model, &asked).unwrap();
    let asked = TransientOptions { release: start.as_ref(), ..asked };
    (transient(&model, &asked, &mut |_, _| {}, &mut |_| true).unwrap(), model)
}

fn warned(model: &CompiledModel) -> bool {
    model.warnings.items.iter().any(|d| d.code == "W040")
}

/// Motion outside the modes is compared where its bound would exceed the tolerance. The undamped quarter stage released
/// from 20 µN, of which 1.3e-3 is in no mode, holds 1e-3 and 1e-4. Its estimate is within a factor of fifteen of its error
/// (before: 1.3e-3 at both). The reference has 24 segments a beam.
#[test]
fn what_no_mode_holds_is_compared() {
    let bundle = read_bundle(Path::new("examples/quarter_stage/quarter_stage.net"), &[]).unwrap();
    let options = CompileOptions { undamped: true, ..CompileOptions::default() };
    let release = |options: &CompileOptions| run(&bundle, Some(20e-6), 20e-6, &["c.x", "c.y"], options);
    let (reference, _) = release(&CompileOptions { tol: 2e-5, segments: Some(24), ..options.clone() });
    for tol in [1e-3, 1e-4] {
        let (found, model) = release(&CompileOptions { tol, ..options.clone() });
        let (error, reported) = (relative_error(&reference, &found), found.estimated_error.unwrap());
        println!("{tol:e}: {error:.1e}, told {reported:.1e}, {} unknowns", found.unknowns);
        assert!(
            error <= tol && reported <= 1.2 * tol && warned(&model) == (reported > 1.05 * tol),
            "{tol:e}: {error:e} {reported:e}"
        );
        assert!(reported <= 15.0 * error, "{tol:e}: {error:e} {reported:e}");
    }
}

/// No useless mesh is searched: the bridge's waves at 1e-2 are beyond every mesh, which is reported, and its mesh stays
/// below 1000 unknowns (before: 12,180, and 41 s for 50 µs).
#[test]
fn no_mesh_is_sought_that_cannot_help() {
    let bundle = Bundle::from_text("bridge.net", BRIDGE);
    let options = CompileOptions { tol: 1e-2, ..CompileOptions::default() };
    let (found, model) = run(&bundle, None, 5e-6, &["b.x", "b.rz"], &options);
    println!("told {:.1e}, {} unknowns", found.estimated_error.unwrap(), found.unknowns);
    let long = TransientOptions {
        stop: 50e-6,
        signals: vec!["b.x".into(), "b.rz".into()],
        tol: 1e-2,
        ..TransientOptions::default()
    };
    let (of_long, _) = fitted_in_time(&compile(&bundle, &options).unwrap(), &long).unwrap();
    assert!(warned(&of_long) && of_long.unknowns() < 1000, "{}", of_long.unknowns());
    assert!(model.unknowns() < 1000, "{}", model.unknowns());
}

/// The scale of a rate is its own amplitude: velocities of a released plate hold 1e-2 on fewer than 300 unknowns with
/// an estimate within it (before: 7968, estimate 0.85).
#[test]
fn rates_have_their_own_swing() {
    let bundle = Bundle::from_text("branches.net", BRANCHES);
    let release = |options: &CompileOptions| run(&bundle, Some(10e-6), 20e-6, &["c.vx", "c.vy"], options);
    let (reference, _) = release(&CompileOptions { tol: 1e-5, segments: Some(40), ..CompileOptions::default() });
    let (found, model) = release(&CompileOptions { tol: 1e-2, ..CompileOptions::default() });
    let (error, reported) = (relative_error(&reference, &found), found.estimated_error.unwrap());
    println!("{error:.1e}, estimated {reported:.1e}, {} unknowns, segments {:?}", found.unknowns, model.order.segments);
    assert!(error <= 1e-2 && reported <= 1e-2 && found.unknowns < 300, "{error:e} {reported:e} {}", found.unknowns);
}
