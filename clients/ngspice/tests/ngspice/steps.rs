//! How long the circuit's steps are: as long as what ports and monitors show allows, not as short as what moves unseen.

use crate::support::{deck, real, run, run_text, versions};
use bimorph::cosim::CosimOptions;

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

/// A heater driven by pulses at 20 kHz takes at most 8,000 points for 1 ms at default tolerances. The mean deflection
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

/// A comb resonator (k = 1 N/m, m = 1e-10 kg, Q = 50) that its own sense current keeps swinging: between the reversals of the
/// drive it swings freely about the drive's place, so that it oscillates at ω₀·√(1 − 1/4Q²). At default options and at most 36
/// points a cycle the frequency over 70 cycles is within 1e-4 of it.
#[test]
fn an_oscillator_keeps_its_frequency_at_few_points() {
    let (omega, quality): (f64, f64) = (1e5, 50.0);
    let exact = omega * (1.0 - 0.25 / (quality * quality)).sqrt() / std::f64::consts::TAU;
    for (version, ngspice) in versions() {
        let options =
            CosimOptions { deck: deck("comb_oscillator.cir"), ngspice: Some(ngspice), ..CosimOptions::default() };
        let run = run(options).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Transient");
        let (t, x) = (real(plot, "time"), real(plot, "v(x)"));
        // half of the sense comb's pull less the drive's
        let middle = 0.5 * 8.854e-10 * (25.0 - 100.0) * 1e6;
        let rises: Vec<(usize, f64)> = (1..t.len())
            .filter(|&i| x[i - 1] < middle && x[i] >= middle)
            .map(|i| (i, t[i - 1] + (t[i] - t[i - 1]) * (middle - x[i - 1]) / (x[i] - x[i - 1])))
            .collect();
        let (first, last) = (rises[100], rises[170]);
        let frequency = 70.0 / (last.1 - first.1);
        let points = (last.0 - first.0) as f64 / 70.0;
        println!("ngspice {version}: {points:.1} points a cycle, frequency off by {:e}", frequency / exact - 1.0);
        assert!(points <= 36.0, "ngspice {version}: {points} points a cycle");
        assert!((frequency / exact - 1.0).abs() < 1e-4, "ngspice {version}: {frequency} Hz, {exact} Hz");
    }
}

/// A resonator (k = 1 N/m, m = 1e-10 kg, Q = 5000) on a displacement port, with an equally stiff spring in the circuit,
/// is excited by a pulse. At default options its amplitude never grows. After 50 ms it is that of equal steps of 0.5
/// µs, 0.44 µm, within a quarter. Steps that follow its swing twice a cycle pumped it to 3.7 µm; one moved by 1 µm
/// through 1000 N/m went to 37 m.
#[test]
fn springs_of_the_circuit_pump_nothing() {
    const PART: &str = "anchor * [f] []\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1]\ndamper2d * [f m] [bx=2e-9]\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("part.net"), PART).unwrap();
    let model =
        "A1 %hd [v 0] %v [x] part\n.model part bimorph(file=\"part.net\" ports=[\"m.x\"] monitors=[\"m.x:1e6\"])\n";
    for (version, ngspice) in versions() {
        let peaks = |name: &str, body: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, format!("* {name}\n{body}{model}.end\n")).unwrap();
            let options = CosimOptions { deck: path, ngspice: Some(ngspice.clone()), ..CosimOptions::default() };
            let run = run(options).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
            let plot = run.plot("Transient");
            let (t, x) = (real(plot, "time"), real(plot, "v(x)"));
            let end = t[t.len() - 1];
            [0.0, 0.9].map(|from| {
                let within = |t: &f64| (from * end..=(from + 0.1) * end).contains(t);
                t.iter().zip(x).filter(|(t, _)| within(t)).map(|(_, x)| x.abs()).fold(0.0, f64::max)
            })
        };
        let [first, last] = peaks("kick.cir", "I1 0 v PULSE(0 1u 1u 1u 1u 10u 1)\nR1 v 0 1e6\n.tran 10u 50m\n");
        println!("ngspice {version}: kicked {first} um, then {last} um");
        assert!((0.68..0.72).contains(&first) && (0.33..0.46).contains(&last), "ngspice {version}: {first} {last}");
        let [_, last] = peaks("moved.cir", "V1 u 0 SIN(0 1 1k)\nR1 u v 1e3\n.tran 10u 10m\n");
        assert!((0.95..1.1).contains(&last), "ngspice {version}: moved by 1 um, {last} um");
    }
}
