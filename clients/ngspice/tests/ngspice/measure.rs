//! `.measure`, `.four` and loops in `.control`, by the decks that docs/reference/ngspice.md names, against closed forms.

use crate::support::{deck, versions};
use bimorph::cosim::check::check;
use bimorph::cosim::{self, CosimOptions};
use std::f64::consts::PI;
use std::path::Path;

/// The damped plate of small voltages: ω₀ (rad/s), and damping ratio (k = 1 N/m, m = 1e-10 kg, b = 1e-5 N·s/m).
const PLATE: (f64, f64) = (1e5, 0.5);

fn options(name: &str, ngspice: &Path) -> CosimOptions {
    CosimOptions { deck: deck(name), ngspice: Some(ngspice.to_owned()), capture: true, ..CosimOptions::default() }
}

fn said(name: &str, ngspice: &Path) -> String {
    cosim::run(&options(name, ngspice), &|| true).unwrap_or_else(|e| panic!("{name}: {e}")).output
}

/// Every number printed as `NAME = VALUE`.
fn numbers(output: &str, name: &str) -> Vec<f64> {
    let of =
        |line: &str| line.trim().strip_prefix(name)?.trim().strip_prefix('=')?.split_whitespace().next()?.parse().ok();
    output.lines().filter_map(of).collect()
}

/// A small step overshoots by e^(−πζ/√(1−ζ²)), and its peak comes π/(ω₀√(1−ζ²)) after the step; the measured pull is
/// k·x where the plate has settled. `--check` compares what was measured.
#[test]
fn a_step_is_measured() {
    let (omega, zeta) = PLATE;
    let damped = f64::sqrt(1.0 - zeta * zeta);
    for (version, ngspice) in versions() {
        let output = said("plate_measure.cir", &ngspice);
        let of = |name: &str| *numbers(&output, name).first().unwrap_or_else(|| panic!("no {name} in\n{output}"));
        // the field softens the spring by εAV²/(kg³) = 1.3e-4, and steps are 0.1 µs
        let over = (-PI * zeta / damped).exp();
        assert!((of("over") / over - 1.0).abs() < 1e-3, "ngspice {version}: {} of {over}", of("over"));
        let peak: f64 = output
            .lines()
            .find_map(|l| l.trim().strip_prefix("peak")?.split_once("at=")?.1.trim().parse().ok())
            .unwrap();
        let want = 1e-6 + PI / (omega * damped);
        assert!((peak - want).abs() < 0.15e-6, "ngspice {version}: peak at {peak} s, expected {want}");
        // nanometres on 1 N/m are nanonewtons; the pull is largest where the plate is nearest
        assert!((of("pull") / (of("settled") * 1e-9) - 1.0).abs() < 1e-3, "ngspice {version}: {}", of("pull"));
        let checked = check(&options("plate_measure.cir", &ngspice), &|| true).unwrap_or_else(|e| panic!("{e}"));
        let reported =
            checked.printed.iter().find(|p| p.name == "over").unwrap_or_else(|| panic!("{:?}", checked.printed));
        assert!(reported.values[0] == of("over") && reported.difference < 1e-3, "ngspice {version}: {reported:?}");
        assert!(checked.plots.iter().any(|p| p.name.starts_with("Transient")), "ngspice {version}");
    }
}

/// A plate follows the square of its voltage: with V = V₀ + a·sin ωt the second harmonic is a/4V₀ of the first, times what the plate
/// makes of 2ω over ω: |H(ω)| = 1/√((1 − r²)² + (2ζr)²), r = ω/ω₀.
#[test]
fn a_squared_voltage_has_a_second_harmonic() {
    let (omega, zeta) = PLATE;
    let response = |frequency: f64| {
        let r = 2.0 * PI * frequency / omega;
        1.0 / ((1.0 - r * r).powi(2) + (2.0 * zeta * r).powi(2)).sqrt()
    };
    let want = 0.04 / (4.0 * 0.1) * response(2e3) / response(1e3);
    for (version, ngspice) in versions() {
        let output = said("plate_fourier.cir", &ngspice);
        let row = output
            .lines()
            .find(|l| l.split_whitespace().take(2).eq(["2", "2000"]))
            .unwrap_or_else(|| panic!("{output}"));
        let got: f64 = row.split_whitespace().nth(4).unwrap().parse().unwrap();
        assert!((got / want - 1.0).abs() < 1e-3, "ngspice {version}: {got}, expected {want}");
    }
}

/// A loop sets a netlist's parameter, and one a resistor: displacements are those of k·x = ½εAV²/(g − x)², voltages those of the
/// divider.
#[test]
fn a_loop_sets_parameters() {
    for (version, ngspice) in versions() {
        let output = said("plate_loop.cir", &ngspice);
        let (x, v) = (numbers(&output, "v(x)"), numbers(&output, "v(a)"));
        assert_eq!((x.len(), v.len()), (3, 2), "ngspice {version}: {output}");
        let volts = |r1: f64| 2.0 * 1e9 / (1e9 + r1);
        for (x, gap) in x.iter().zip([2e-6, 2.5e-6, 3e-6]) {
            let force = |x: f64| 0.5 * 8.854e-12 * 1e-8 * volts(1e6).powi(2) / (gap - x).powi(2);
            let want = (0..200).fold(0.0, |x, _| force(x)) * 1e6;
            assert!((x / want - 1.0).abs() < 1e-5, "ngspice {version}: {x}, expected {want}");
        }
        for (v, r1) in v.iter().zip([1e6, 1e9]) {
            assert!((v / volts(r1) - 1.0).abs() < 1e-5, "ngspice {version}: {v}");
        }
    }
}
