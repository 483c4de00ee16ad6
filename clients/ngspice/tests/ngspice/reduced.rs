//! Reduced models in decks, against the full model.

use crate::support::{all_decks, deviation, real, versions};
use bimorph::cosim::{self, CosimOptions};
use std::time::Instant;

/// The bank of three, heated for 300 µs and sensed by an amplifier at 20 V (as examples/bank/bank.cir), with the reduced and the full model on one mesh. The yoke and the
/// voltage of the amplifier are the same within the tolerance of 1e-2 of their ranges, and no point warns of the reduced model (W053). The time of
/// both goes to the output: that of the process with the mesh and the training in it.
#[test]
fn the_bank_is_that_of_the_full_model() {
    for (version, ngspice) in versions() {
        let run = |formulation: &str| {
            let folder = all_decks();
            let (deck, raw) = (folder.path().join("reduced.cir"), folder.path().join("reduced.raw"));
            let text = format!(
                "* bank\n.model bank bimorph(file=\"bank.net\" tol=1e-2 segments=2 ports=[\"heat\" \"sense\"] monitors=[\"yoke.y:1e6\"] \
                 formulation=\"{formulation}\" ranges=\"heat:0:2.2|sense:0:20\")\nA1 %gd [heat 0 comb 0] %v [y] bank\n\
                 Vheat heat 0 PULSE(0 2.2 20u 1u 1u 300u 600u)\nVbias bias 0 20\nEamp out 0 bias in 1e5\nRf out in 100meg\nCf out in 10f\n\
                 Vsense in comb 0\n.options abstol=1e-15 reltol=1e-5\n.tran 1u 600u 0 0.2u\n.end\n"
            );
            std::fs::write(&deck, text).unwrap();
            let options = CosimOptions {
                deck,
                raw: Some(raw.clone()),
                ngspice: Some(ngspice.clone()),
                capture: true,
                ..CosimOptions::default()
            };
            let begun = Instant::now();
            let report = cosim::run(&options, &|| true).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
            let time = begun.elapsed().as_secs_f64();
            assert!(!report.output.contains("W053"), "ngspice {version}, {formulation}: {}", report.output);
            (bimorph::results::raw::read(&std::fs::read(raw).unwrap()).unwrap(), time)
        };
        let ((reduced, fast), (full, slow)) = (run("reduced"), run("compliant"));
        let of = |plots: &[_], name| (real(&plots[0], "time").to_vec(), real(&plots[0], name).to_vec());
        for name in ["v(y)", "v(out)"] {
            let (a, b) = (of(&reduced, name), of(&full, name));
            let error = deviation((&a.0, &a.1), (&b.0, &b.1), 0.0, 600e-6);
            println!(
                "ngspice {version}, {name}: {} points, off by {error:.1e}; {fast:.3} s, full model {slow:.3} s",
                a.0.len()
            );
            assert!(error < 1e-2, "ngspice {version}, {name}: {error:e}");
        }
    }
}
