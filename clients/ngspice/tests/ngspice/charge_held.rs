//! Parts that a charge alone holds: a plate beyond a third of its gap, charged by a current.

use crate::support::{all_decks, real, value, versions};
use bimorph::cosim::{self, CosimOptions};

/// A plate of k = 1 N/m, m = 1e-10 kg, b = 1e-5 N·s/m (half of critical), A = 1e-8 m², g = 2 µm takes 0.565 pC from a current source, in steps that may be as long
/// as 60 µs. It stands at q²/(2εAk) = 1.8027 µm, 0.9 of its gap, at q·(g − x)/εA = 1.2587 V. At that voltage its motion would grow e-fold in 2.7 µs: steps
/// that are longer bring it to 1.84 µm, and its voltage 20 % off. Charged slowly and fast; said once (W048). A voltage that closes the plate passes the same places
/// and says nothing.
#[test]
fn a_charged_plate_stands_beyond_a_third_of_its_gap() {
    let (e, q) = (8.854_187_8e-12 * 1e-8, 0.565e-12);
    let x = q * q / (2.0 * e);
    let volts = q * (2e-6 - x) / e;
    for (version, ngspice) in versions() {
        for (current, held) in
            [("PULSE(0 0.565n 1u 1n 1n 999.999u 1)", 1), ("PULSE(0 5.65n 1u 1n 1n 99.999u 1)", 1), ("", 0)]
        {
            let source = match held {
                1 => format!("I1 0 a {current}\nRl a 0 1e15"),
                _ => "V1 a 0 PWL(0 0 1m 8)".to_owned(),
            };
            let folder = all_decks();
            let (deck, raw) = (folder.path().join("held.cir"), folder.path().join("held.raw"));
            let text = format!(
                "* held\n{source}\nA1 %gd [a 0] %v [x] plate\n\
                 .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n.tran 60u 3m\n.end\n"
            );
            std::fs::write(&deck, text).unwrap();
            let options = CosimOptions {
                deck,
                raw: Some(raw.clone()),
                ngspice: Some(ngspice.clone()),
                capture: true,
                ..CosimOptions::default()
            };
            let report = cosim::run(&options, &|| true).unwrap_or_else(|e| panic!("ngspice {version}, {current}: {e}"));
            assert_eq!(report.output.matches("warning[W048]").count(), held, "ngspice {version}: {}", report.output);
            if held == 0 {
                continue;
            }
            let plots = bimorph::results::raw::read(&std::fs::read(raw).unwrap()).unwrap();
            let t = real(&plots[0], "time");
            let at = |name: &str| value(t, real(&plots[0], name), 2.9e-3);
            let (place, voltage) = (at("v(x)") * 1e-6 / x - 1.0, at("v(a)") / volts - 1.0);
            println!(
                "ngspice {version}, {current}: {} points, off by {place:.1e}, its voltage by {voltage:.1e}",
                t.len()
            );
            assert!(place.abs() < 1e-4 && voltage.abs() < 1e-3, "ngspice {version}: {place:e}, {voltage:e}");
        }
    }
}
