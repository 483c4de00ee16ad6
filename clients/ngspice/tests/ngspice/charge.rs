//! Charge that a circuit delivers stays on a port, whatever ngspice's tolerance and steps.

use crate::support::{real, run_text, versions};

/// A current of 0.5646 nA for 1 ms onto a plate that nothing else holds. The gap's charge is a monitor [fC].
fn deck(step: &str, reltol: f64) -> String {
    format!(
        "* charge onto a plate\nIq 0 a PULSE(0 0.5646n 10u 1u 1u 999u 10m)\nA1 %gd [a 0] %v [q x] plate\n\
         .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"gap.q:1e15\" \"m.x:1e6\"])\n\
         .options reltol={reltol}\n.tran {step} 1.2m 0 {step} uic\n.end\n"
    )
}

/// 564.6 fC delivered are held within 1e-4, at ngspice's own tolerance and at tighter ones, for steps from 0.1 to 5 µs; the
/// plate is then at Q²/(2εAk) = 1.8002 µm, far beyond the third of its gap at which a voltage would have pulled it in.
#[test]
fn charge_held_is_charge_delivered() {
    for (version, ngspice) in versions() {
        for (step, reltol) in [("0.1u", 1e-3), ("1u", 1e-3), ("5u", 1e-3), ("1u", 1e-4), ("1u", 1e-5)] {
            let run = run_text(&deck(step, reltol), &ngspice).unwrap();
            let plot = run.plot("Transient");
            let held = *real(plot, "v(q)").last().unwrap();
            let x = *real(plot, "v(x)").last().unwrap();
            println!("ngspice {version}, steps {step}, reltol {reltol:e}: {held:.4} fC of 564.6, x {x:.5} um");
            assert!((held / 564.6 - 1.0).abs() < 1e-4, "ngspice {version}, {step}, {reltol:e}: {held} fC");
            let want = 1e6 * 564.6e-15f64.powi(2) / (2.0 * 8.854e-12 * 1e-8);
            assert!((x / want - 1.0).abs() < 5e-4, "ngspice {version}, {step}: {x} um, expected {want}");
        }
    }
}

/// A voltage that `.ic` gives with `uic` stands on the port from the first point on, and the plate begins in equilibrium
/// there: 4 V behind 1 PΩ stay 4 V, and k·x = ½εAV²/(g − x)² holds to ngspice's tolerance.
#[test]
fn initial_voltages_are_on_the_port() {
    for (version, ngspice) in versions() {
        let text = "* uic\nR1 a 0 1e15\n.ic v(a)=4\nA1 %gd [a 0] %v [x] plate\n\
                    .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n\
                    .tran 0.1u 100u uic\n.end\n";
        let run = run_text(text, &ngspice).unwrap();
        let plot = run.plot("Transient");
        let (v, x) = (real(plot, "v(a)"), real(plot, "v(x)"));
        let low = v[1..].iter().copied().fold(f64::INFINITY, f64::min);
        assert!(low > 3.99 && v[v.len() - 1] < 4.001, "ngspice {version}: from {:?} down to {low} V", &v[..2]);
        let want = (0..200).fold(0.0, |x, _| 0.5 * 8.854e-20 * 16.0 / (2e-6f64 - x).powi(2)) * 1e6;
        let off = x[1..].iter().map(|x| (x / want - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 1e-3, "ngspice {version}: up to {off} from {want} um");
    }
}
