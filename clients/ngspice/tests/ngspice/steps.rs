//! How long the circuit's steps are: as long as what ports and monitors show allows, not as short as what moves unseen.

use crate::support::{real, run_text, versions};

/// A bank of bimorphs heated by 0 to 2.2 V pulses at 20 kHz, and where its yoke is.
fn pulses(options: &str) -> String {
    format!(
        "* PWM\nVheat heat 0 PULSE(0 2.2 0 100n 100n 25u 50u)\nA1 %gd [heat 0] %v [y] bank\n\
         .model bank bimorph(file=\"bank.net\" ports=[\"heat\"] monitors=[\"yoke.y:1e6\"] {options})\n.end\n"
    )
}

/// Mean of a waveform over time.
fn mean(t: &[f64], y: &[f64]) -> f64 {
    let area: f64 = (1..t.len()).map(|i| 0.5 * (y[i] + y[i - 1]) * (t[i] - t[i - 1])).sum();
    area / (t[t.len() - 1] - t[0])
}

/// A heater driven by pulses at 20 kHz takes at most 8,000 points for 1 ms at default tolerances, and the mean deflection
/// is within 1e-4 of that of a run with 50 ns steps at a tolerance ten times smaller.
#[test]
fn pulse_width_modulation_takes_few_points() {
    for (version, ngspice) in versions().into_iter().take(1) {
        let run = |options: &str, tran: &str| {
            let text = pulses(options).replace(".end\n", &format!("{tran}\n.end\n"));
            let run = run_text(&text, &ngspice).unwrap();
            let plot = run.plot("Transient");
            let (t, y) = (real(plot, "time"), real(plot, "v(y)"));
            (t.len(), mean(t, y))
        };
        let (points, free) = run("", ".tran 1u 1m");
        let (_, fine) = run("tol=1e-4", ".tran 50n 1m 0 50n");
        println!("ngspice {version}: {points} points, mean {free} um against {fine} um");
        assert!(points <= 8000, "{points} points");
        assert!((free / fine - 1.0).abs() < 1e-4, "mean {free} um against {fine} um");
    }
}
