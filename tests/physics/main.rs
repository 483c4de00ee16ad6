//! Results of the models, against closed forms and published or independently computed numbers.

mod anchors;
mod backbending;
mod baselines;
mod beams;
mod closed_branches;
mod combs;
mod contact;
mod contact_signals;
mod contact_speed;
mod contact_steps;
mod dashpot;
mod domain_derivatives;
mod drawing_semantics;
mod driven_anchors;
mod duffing;
mod eigenvalues;
mod electrothermal;
mod examples;
mod excited_modes;
mod expressions;
mod floating;
mod formulations;
mod free_coordinates;
mod fringe;
mod gaps;
mod gaps_along_beams;
mod impacts;
mod integrators;
mod joint_integrators;
mod junctions;
mod large_motion;
mod mechanisms;
mod mesh;
mod mode_errors;
mod mode_quality;
mod motion;
mod moving_anchors;
mod near_limit_points;
mod orientation;
mod paths;
mod port_currents;
mod responses;
mod rodas4;
mod run_errors;
mod schemes;
mod sharp_bends;
mod shock;
mod small_parts;
mod solvers;
mod sprung_loops;
mod sprung_loops_motion;
mod squeeze_film;
mod stability_losses;
mod stress;
mod surfaces;
mod vm236;
mod warnings;

use bimorph::analysis::statics::{NodeMotion, StaticResult, static_equilibrium};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::Bundle;

/// Structural polysilicon with the constants of SUGAR's MUMPs process file, 2 µm thick.
pub(crate) const POLY: &str = "
process p1 = [ Poisson=0.3 Youngsmodulus=165e9 density=2300 viscosity=1.78e-5 fluid=2e-6 permittivity=8.854e-12
  sheetresistance=20 stress=0 straingradient=0 thermalexpansion=2.33e-6 ambienttemperature=293 thermcond=41 h=2u ]
";

/// A thermal bimorph with a hot arm 206 µm long and 2 µm wide, from two anchors to [o].
pub(crate) const ARM: &str = "
    subnet arm [o] [] [
      anchor parent [a] [l=10u w=10u oz=pi]
      anchor parent [g] [l=10u w=10u oz=pi]
      beam2d parent [a t] [l=206u w=2u]
      beam2d parent [t c] [l=23u w=13u oz=-pi/2]
      beam2d parent [c f] [l=112u w=8u oz=pi]
      beam2d parent [f g] [l=94u w=1.9u oz=pi]
      beam2d parent [c o] [l=24u w=3u]
    ]
";

/// Compiles [`POLY`] followed by `text`, with beams that meet in points, as closed forms and SUGAR assume.
pub(crate) fn model(text: &str, options: &CompileOptions) -> CompiledModel {
    let bundle = Bundle::from_text("model.net", &format!("{POLY}{text}"));
    compile(&bundle, &CompileOptions { junctions: Junctions::Centreline, ..options.clone() })
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Small displacements, as SUGAR.
pub(crate) fn linear() -> CompileOptions {
    CompileOptions { linear: true, ..CompileOptions::default() }
}

/// Static equilibrium with voltages on ports.
pub(crate) fn balance(compiled: &CompiledModel, volts: &[(&str, f64)]) -> StaticResult {
    let volts: Vec<(String, f64)> = volts.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
    static_equilibrium(compiled, &volts).unwrap_or_else(|e| panic!("{e}"))
}

/// The motion of one node.
pub(crate) fn node(result: &StaticResult, name: &str) -> NodeMotion {
    result.nodes.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no node {name}")).1
}

/// Asserts `got` within `relative` of `want`.
pub(crate) fn close(got: f64, want: f64, relative: f64) {
    assert!((got / want - 1.0).abs() <= relative, "got {got:e}, want {want:e} within {relative:e}");
}
