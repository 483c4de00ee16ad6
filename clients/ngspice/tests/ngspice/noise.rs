//! Noise on every ngspice: of the part itself, against closed forms and against resistors that do the same.

use crate::support::{real, run_text, versions};
use bimorph::multibody::agitation::BOLTZMANN;

const PLATE: &str = "* noise of a damped mass
Vt t 0 1.2 AC 1
Vb b 0 0
A1 %gd [t 0 b 0] %v [x] mass
.model mass bimorph(file=\"proof_mass.net\" ports=[\"top\" \"bottom\"] monitors=[\"m.x:1e6\"])
.noise v(x) Vt dec 400 1 1meg
.end
";

/// Between plates at held voltages the displacement has 4·k_B·T·c·|χ|², χ with the spring that the plate at 1.2 V
/// softens: 1e-3 requested. Over all frequencies that is k_B·T/k (equipartition).
#[test]
fn a_damped_mass() {
    let (m, c, k, area, gap, volts): (f64, f64, f64, f64, f64, f64) = (1e-9, 2e-6, 1.0, 1e-7, 2e-6, 1.2);
    // equilibrium k·x = εAV²/2(g − x)², by Newton's iteration on the lower branch
    let (mut x, half) = (0.0, 0.5 * 8.854e-12 * area * volts * volts);
    for _ in 0..50 {
        x -= (k * x - half / (gap - x).powi(2)) / (k - 2.0 * half / (gap - x).powi(3));
    }
    let soft = k - 2.0 * half / (gap - x).powi(3);
    for (version, ngspice) in versions() {
        let run = run_text(PLATE, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Noise Spectral");
        let (f, density) = (real(plot, "frequency"), real(plot, "onoise_spectrum"));
        let mut worst = 0.0f64;
        for (f, density) in f.iter().zip(density) {
            let omega = 2.0 * std::f64::consts::PI * f;
            let chi = 1.0 / (soft - m * omega * omega).hypot(omega * c);
            let want = 1e6 * chi * (4.0 * BOLTZMANN * 300.15 * c).sqrt();
            worst = worst.max((density / want - 1.0).abs());
        }
        let total = real(run.plot("Integrated Noise"), "v(onoise_total)")[0];
        let want = 1e6 * (BOLTZMANN * 300.15 / soft).sqrt();
        println!("ngspice {version}: density within {worst:e}, in all {total:e} for {want:e} um");
        assert!(worst < 1e-6, "ngspice {version}: {worst:e}");
        assert!((total / want - 1.0).abs() < 1e-3, "ngspice {version}: {total:e} {want:e}");
    }
}

/// Noise of a deck at its output, and over all frequencies.
fn noise(text: &str, ngspice: &std::path::Path) -> (Vec<f64>, f64) {
    let run = run_text(text, ngspice).unwrap_or_else(|e| panic!("{}: {e}", ngspice.display()));
    let density = real(run.plot("Noise Spectral"), "onoise_spectrum").to_vec();
    (density, real(run.plot("Integrated Noise"), "v(onoise_total)")[0])
}

/// The damper in the netlist makes the noise that ngspice's own resistor makes in its place, on a velocity port: 1/c ohms. Both
/// plates' currents swing together with the mass, and the amplifier reads their difference: without their correlation, 15 %
/// and more would be missing or too much.
#[test]
fn a_damper_is_a_resistor() {
    let inside = std::fs::read_to_string(crate::support::deck("noise.cir")).unwrap();
    let outside = inside
        .replace("A1 %gd [t 0 b 0]", "Rd  v  0 500k\nA1 [%gd t 0 b 0 %hd v 0]")
        .replace("ports=[\"top\" \"bottom\"]", "ports=[\"top\" \"bottom\" \"m.vx\"] set=[\"b\" 0]");
    for (version, ngspice) in versions() {
        let ((own, own_total), (resistor, total)) = (noise(&inside, &ngspice), noise(&outside, &ngspice));
        let worst = own.iter().zip(&resistor).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        println!("ngspice {version}: within {worst:e}; in all {own_total:e} V for {total:e} V");
        assert!(worst < 1e-9 && (own_total / total - 1.0).abs() < 1e-3, "ngspice {version}: {worst:e}");
        let silent = noise(&inside.replace("Eo  out 0 t b 10", "Eo  out 0 t 0 10"), &ngspice).0;
        let together = own.iter().zip(&silent).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(together > 0.15, "{together}");
    }
}

/// In time the mass has k⟨x²⟩ = k_B·T within three standard deviations of the mean of γT = 2000 correlation times, σ = √(2/γT) =
/// 3.2 %. Two parts of one model are independent: their correlation is within three of its own, √(1/γT) = 2.2 %. The same seed
/// gives the same bits, another seed another motion.
#[test]
fn a_mass_is_shaken() {
    let deck = std::fs::read_to_string(crate::support::deck("brownian.cir")).unwrap();
    let long = deck.replace(".tran 5u 2m 0 0.5u", ".tran 5u 0.2");
    let motion = |text: &str, ngspice: &std::path::Path| {
        let run = run_text(text, ngspice).unwrap_or_else(|e| panic!("{}: {e}", ngspice.display()));
        let plot = run.plot("Transient");
        ["v(x1)", "v(x2)"].map(|name| real(plot, name).to_vec())
    };
    for (version, ngspice) in versions() {
        let [a, b] = motion(&long, &ngspice);
        // the first tenth warms up
        let from = a.len() / 10;
        let mean = |x: &[f64], y: &[f64]| {
            x[from..].iter().zip(&y[from..]).map(|(x, y)| x * y).sum::<f64>() / (x.len() - from) as f64
        };
        // in pm², with 1 N/m
        let energy = BOLTZMANN * 300.15 * 1e24;
        let shares = [mean(&a, &a) / energy, mean(&b, &b) / energy];
        let together = mean(&a, &b) / energy;
        println!(
            "ngspice {version}: k<x2>/kT = {:.3} and {:.3}, correlation {together:.3}, {} points",
            shares[0],
            shares[1],
            a.len()
        );
        assert!(shares.iter().all(|share| (share - 1.0).abs() < 3.0 * 0.034), "{shares:?}");
        assert!(together.abs() < 3.0 * 0.024, "{together}");
        let same = motion(&deck, &ngspice);
        assert_eq!(motion(&deck, &ngspice), same);
        assert_ne!(motion(&deck.replace("seed=3", "seed=4"), &ngspice), same);
    }
}
