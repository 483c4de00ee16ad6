//! Currents of charges as results: their error, and the part that the trapezoidal rule leaves in them.

use crate::support::{all_decks, deviation, real, versions};
use bimorph::cosim::{self, CosimOptions};
use bimorph::results::table::Table;
use std::path::Path;

/// The bank, heated by 2.2 V from 20 µs on and sensed at 40 V by an amplifier that holds its comb, with these options of model and deck, up to `stop`: its
/// transient, and the warnings.
fn bank(ngspice: &Path, model: &str, options: &str, stop: &str) -> (Table, String) {
    let folder = all_decks();
    let (deck, raw) = (folder.path().join("sensed.cir"), folder.path().join("sensed.raw"));
    let text = format!(
        "* sensed\n.model bank bimorph(file=\"bank.net\" ports=[\"heat\" \"sense\"] monitors=[\"yoke.y:1e6\"] {model})\n\
         A1 %gd [heat 0 comb 0] %v [y] bank\nVheat heat 0 PULSE(0 2.2 20u 1u 1u 300u 600u)\nVbias bias 0 40\nEamp out 0 bias in 1e5\n\
         Rf out in 100meg\nCf out in 10f\nVsense in comb 0\n.options abstol=1e-15 reltol=1e-5 {options}\n.tran 1u {stop} 0 0.2u\n.end\n"
    );
    std::fs::write(&deck, text).unwrap();
    let options = CosimOptions {
        deck,
        raw: Some(raw.clone()),
        ngspice: Some(ngspice.to_owned()),
        capture: true,
        ..CosimOptions::default()
    };
    let report = cosim::run(&options, &|| true).unwrap();
    let plots = bimorph::results::raw::read(&std::fs::read(raw).unwrap()).unwrap();
    (plots.into_iter().next().unwrap(), report.warnings().collect::<Vec<_>>().join("\n"))
}

/// Largest difference of the sense current from another run's, of its range.
fn apart(one: &Table, other: &Table, from: f64, to: f64) -> f64 {
    let current = |plot| real(plot, "i(vsense)");
    deviation((real(one, "time"), current(one)), (real(other, "time"), current(other)), from, to)
}

/// At tight tolerances the trapezoidal rule adds up the errors of the charges with alternating signs, to a tenth of the current's range here. W047 says within a
/// factor of three how much that is: the difference from Gear's method, which keeps none. Under that, and with `xmu=0.4`, nothing is reported beyond 1 %.
#[test]
fn alternation_is_reported_as_large_as_it_is() {
    let figure = |line: &str| line.split_once("from point to point by ")?.1.split_once(' ')?.0.parse::<f64>().ok();
    let largest = |warnings: &str| warnings.lines().filter_map(figure).fold(0.0, f64::max);
    for (version, ngspice) in versions() {
        let [trapezoidal, gear, damped] =
            ["", "method=gear", "xmu=0.4"].map(|options| bank(&ngspice, "tol=1e-5", options, "100u"));
        let off = apart(&trapezoidal.0, &gear.0, 25e-6, 100e-6);
        let reported = largest(&trapezoidal.1);
        println!("ngspice {version}: reported {reported:.1e}, off by {off:.1e}");
        assert!((off / 3.0..off * 3.0).contains(&reported), "ngspice {version}: {reported:e} of {off:e}");
        assert!(largest(&gear.1) == 0.0 && largest(&damped.1) < 1e-2, "ngspice {version}: {}{}", gear.1, damped.1);
        let left = apart(&damped.0, &gear.0, 25e-6, 100e-6);
        assert!(left < 0.3 * off, "ngspice {version}: {left:e} of {off:e}");
    }
}

/// The sense current of the bank on the mesh for a tolerance of 1e-3 rings at 810 kHz, too, a mode whose frequency that mesh has 0.35 % too low. W040 says within
/// a factor of three by how much that brings the current off: the difference from a run at 1e-5 with 16 segments, by Gear's method.
#[test]
fn what_higher_modes_bring_is_reported() {
    let Some((version, ngspice)) = versions().into_iter().next() else { return };
    let (coarse, warnings) = bank(&ngspice, "tol=1e-3", "", "220u");
    let (fine, _) = bank(&ngspice, "tol=1e-5 segments=16", "method=gear", "220u");
    let off = apart(&coarse, &fine, 25e-6, 220e-6);
    let figure = |line: &str| line.split_once("its estimated error is ")?.1.split_once(' ')?.0.parse::<f64>().ok();
    let reported = warnings.lines().filter(|line| line.contains("W040")).filter_map(figure).fold(0.0, f64::max);
    println!("ngspice {version}: reported {reported:.1e}, off by {off:.1e}");
    assert!((off / 3.0..off * 3.0).contains(&reported), "{reported:e} of {off:e}: {warnings}");
}
