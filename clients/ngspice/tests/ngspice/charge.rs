//! Charge that a circuit delivers stays on a port, whatever ngspice's tolerance and steps.

use crate::support::{deck as deck_file, real, run_text, versions};
use std::path::Path;

/// A current of 0.5646 nA for 1 ms onto a plate that nothing else holds. The gap's charge is a monitor (fC).
fn deck(step: &str, reltol: f64) -> String {
    format!(
        "* charge onto a plate\nIq 0 a PULSE(0 0.5646n 10u 1u 1u 999u 10m)\nA1 %gd [a 0] %v [q x] plate\n\
         .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"gap.q:1e15\" \"m.x:1e6\"])\n\
         .options reltol={reltol}\n.tran {step} 1.2m 0 {step} uic\n.end\n"
    )
}

/// The delivered 564.6 fC are held within 1e-4, at ngspice's own tolerance and at tighter ones, for steps from 0.1 to 5
/// µs. The plate is then at Q²/(2εAk) = 1.8002 µm, far beyond the third of its gap at which a voltage would have pulled
/// it in.
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

/// Charge on an island of two plates with a switch between them, over `cycles` in each of which it goes from one plate to the
/// other: largest departure from what was there at the first points, over that.
fn island(ngspice: &Path, cycles: u32) -> (f64, f64) {
    let text = std::fs::read_to_string(deck_file("charge_ring.cir")).unwrap();
    assert!(text.contains(".tran 5u 10m uic"));
    let text = text.replace(".tran 5u 10m uic", &format!(".tran 5u {}u uic", 50 * cycles));
    let run = run_text(&text, ngspice).unwrap();
    let plot = run.plot("Transient");
    let (first, second) = (real(plot, "v(q1)"), real(plot, "v(q2)"));
    let start = first[10] + second[10];
    let off = first[10..].iter().zip(&second[10..]).map(|(a, b)| ((a + b) / start - 1.0).abs()).fold(0.0, f64::max);
    let swing = first[10..].iter().fold(f64::NEG_INFINITY, |m, q| m.max(*q))
        - first[10..].iter().fold(0.0f64, |m, q| m.min(*q));
    (off, swing / start)
}

/// Switches and plates keep an island's charge at ngspice's default tolerances: 1e-9 over 200 cycles in each of which more than
/// all of it moves.
#[test]
fn an_island_keeps_its_charge() {
    for (version, ngspice) in versions() {
        let (off, swing) = island(&ngspice, 200);
        println!("ngspice {version}: charge kept within {off:e}, of which {swing:.2} moves");
        assert!(off < 1e-9 && swing > 1.0, "ngspice {version}: {off:e} {swing}");
    }
}

/// The same over ten thousand cycles, 1e-8: takes minutes.
#[test]
#[ignore = "takes minutes"]
fn an_island_keeps_its_charge_for_long() {
    let (version, ngspice) = versions().swap_remove(0);
    let (off, _) = island(&ngspice, 10_000);
    println!("ngspice {version}: charge kept within {off:e} over 10,000 cycles");
    assert!(off < 1e-8, "{off:e}");
}

/// A ring oscillator without a clock, of two plates and the switches that they move. Returns its number of cycles in
/// `stop` seconds, and the largest relative departure of the plates' common charge from that at the first points.
fn ring(ngspice: &Path, stop: f64) -> (usize, f64) {
    let text = std::fs::read_to_string(deck_file("ring_oscillator.cir")).unwrap();
    assert!(text.contains(".tran 1u 1m uic"));
    let run = run_text(&text.replace(".tran 1u 1m uic", &format!(".tran 1u {stop:e} uic")), ngspice).unwrap();
    let plot = run.plot("Transient");
    let [first, second, behind] = ["v(q1)", "v(q2)", "v(n)"].map(|name| real(plot, name));
    let start = first[10] + second[10];
    let off = first[10..].iter().zip(&second[10..]).map(|(a, b)| ((a + b) / start - 1.0).abs()).fold(0.0, f64::max);
    (behind.windows(2).filter(|v| v[0] < 1.5 && v[1] >= 1.5).count(), off)
}

/// It oscillates by itself, and keeps its charge within 1e-9 at ngspice's default tolerances, over 100 cycles.
#[test]
fn a_ring_oscillator_keeps_its_charge() {
    for (version, ngspice) in versions() {
        let (cycles, off) = ring(&ngspice, 3.8e-3);
        println!("ngspice {version}: {cycles} cycles, charge kept within {off:e}");
        assert!((95..110).contains(&cycles) && off < 1e-9, "ngspice {version}: {cycles} {off:e}");
    }
}

/// The same over ten thousand cycles, 1e-8: takes minutes.
#[test]
#[ignore = "takes minutes"]
fn a_ring_oscillator_keeps_its_charge_for_long() {
    let (version, ngspice) = versions().swap_remove(0);
    let (cycles, off) = ring(&ngspice, 0.3772);
    println!("ngspice {version}: {cycles} cycles, charge kept within {off:e}");
    assert!(cycles > 10_000 && off < 1e-8, "{cycles} {off:e}");
}

/// Peak to peak of a voltage between two times.
fn swing(t: &[f64], v: &[f64], from: f64, to: f64) -> f64 {
    let within = t.iter().zip(v).filter(|(t, _)| (from..to).contains(*t)).map(|(_, v)| *v);
    let (low, high) = within.fold((0.0f64, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
    high - low
}

/// Remaining amplitude of an inductor and a plate after so many seconds at default options, with other parts in the
/// circuit, and the number of points.
fn tank(ngspice: &Path, beside: &str, stop: f64) -> (f64, usize) {
    let text = format!(
        "* a tank\nL1 a 0 10\n.ic v(a)=1\nA1 %gd [a 0] %v [x] plate\n\
         .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n{beside}\n\
         .tran 1u {stop:e} uic\n.end\n"
    );
    let run = run_text(&text, ngspice).unwrap();
    let plot = run.plot("Transient");
    let (t, v) = (real(plot, "time"), real(plot, "v(a)"));
    (swing(t, v, stop - 10e-6, stop) / swing(t, v, 0.0, 10e-6), t.len())
}

/// A plate and an inductor keep their swing over 76 cycles at default options, to 0.5 %, in at most 2,000 points. (BDF2 with steps
/// that follow the charge twice a cycle kept 5 %.) Gear's method takes what it takes of any tank, here more than a tenth.
#[test]
fn a_tank_keeps_its_swing() {
    for (version, ngspice) in versions() {
        let (kept, points) = tank(&ngspice, "", 320e-6);
        let (gear, _) = tank(&ngspice, ".options method=gear", 320e-6);
        println!("ngspice {version}: {kept:.4} of the swing is left, {points} points; {gear:.4} by Gear's method");
        assert!((0.995..1.005).contains(&kept), "ngspice {version}: {kept} of the swing");
        assert!(points <= 2000, "ngspice {version}: {points} points");
        assert!(gear < 0.9, "ngspice {version}: {gear} of the swing by Gear's method");
    }
}

/// A source that nothing connects to the tank makes the steps uneven by its corners; that feeds nothing and takes no more than backward Euler after each, as of any
/// tank: at least 95 % is left after 238 cycles. (A formula of charges alone, between BDF2 and BDF3, made 106 % of it.)
#[test]
fn corners_elsewhere_feed_no_tank() {
    for (version, ngspice) in versions() {
        let (kept, points) = tank(&ngspice, "Vx p 0 PULSE(0 1 0.3u 1n 1n 0.5u 1.3u)\nRx p 0 1k", 1e-3);
        println!("ngspice {version}: {kept:.4} of the swing is left, {points} points");
        assert!((0.95..1.005).contains(&kept), "ngspice {version}: {kept} of the swing");
    }
}

/// A plate of 44.2709 fF that nothing moves.
const HELD: &str = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1e7]\n\
    anchor * [e] [l=1u w=1u h=1u]\nplategap2d * [m e] [A=1e-8 gap=2u]\neground * [e] []\ndrive port * [m e] []\n";

/// Currents of a charge jump with the slope of a source, wherever its corners lie between the steps before: a plate that nothing moves takes the
/// current of ngspice's own capacitor, to 1e-4 of the largest at each point. (Restarts at what looked like a cut of the step left spikes of 67 %.)
#[test]
fn corners_of_sources_are_those_of_a_capacitor() {
    let folder = tempfile::tempdir().unwrap();
    let netlist = folder.path().join("held.net");
    std::fs::write(&netlist, HELD).unwrap();
    for (version, ngspice) in versions() {
        let mut worst = 0.0f64;
        for delay in [1.0, 1.0711, 1.1422, 1.31, 1.4977] {
            let source = format!("PULSE(0 4 {delay}u 2.1u 3.3u 1.7u 10u)");
            let text = format!(
                "* corners\nV1 a 0 {source}\nV2 b 0 {source}\nC1 b 0 44.2709f\nA1 %gd [a 0] null plate\n\
                 .model plate bimorph(file=\"{}\" ports=[\"drive\"])\n.tran 0.3u 40u\n.end\n",
                netlist.display()
            );
            let run = run_text(&text, &ngspice).unwrap();
            let plot = run.plot("Transient");
            let (plate, capacitor) = (real(plot, "i(v1)"), real(plot, "i(v2)"));
            let largest = capacitor.iter().fold(0.0f64, |most, i| most.max(i.abs()));
            worst = plate.iter().zip(capacitor).map(|(p, c)| (p - c).abs() / largest).fold(worst, f64::max);
        }
        println!("ngspice {version}: currents within {worst:.1e} of those of a capacitor");
        assert!(worst < 1e-4, "ngspice {version}: {worst:e}");
    }
}

/// An island of a plate and a capacitor of ngspice keeps its charge over 200 pulses, to 1e-4: both are integrated by one rule, at any tolerance, by both
/// methods and with `xmu`. (By nine parts of the trapezoidal rule and one of BDF2 nine tenths of it were gone.)
#[test]
fn an_island_with_a_capacitor_keeps_its_charge() {
    let folder = tempfile::tempdir().unwrap();
    let netlist = folder.path().join("held.net");
    std::fs::write(&netlist, HELD).unwrap();
    for (version, ngspice) in versions() {
        for options in ["", ".options reltol=1e-5", ".options method=gear", ".options xmu=0.4"] {
            let text = format!(
                "* island\n.ic v(a)=1 v(b)=1\nA1 %gd [a p] null plate\n.model plate bimorph(file=\"{}\" ports=[\"drive\"])\n\
                 C2 b n 44.2709f\nVp p 0 PULSE(0 3 0 1u 1u 49u 100u)\nVn n 0 PULSE(3 0 0 1u 1u 49u 100u)\n\
                 S1 a b k1 0 sw\n.model sw sw(vt=0.5 vh=0.1 ron=100k roff=1e15)\nV1 k1 0 PULSE(0 1 10u 1u 1u 30u 50u)\n\
                 {options}\n.tran 5u 10m uic\n.end\n",
                netlist.display()
            );
            let run = run_text(&text, &ngspice).unwrap();
            let plot = run.plot("Transient");
            let [a, p, b, n] = ["v(a)", "v(p)", "v(b)", "v(n)"].map(|name| real(plot, name));
            let held: Vec<f64> = (1..b.len()).map(|k| 44.2709e-15 * (a[k] - p[k] + b[k] - n[k])).collect();
            let off = held.iter().map(|q| (q / held[0] - 1.0).abs()).fold(0.0, f64::max);
            println!("ngspice {version} {options}: {:e} C kept within {off:.1e}, {} points", held[0], b.len());
            assert!(off < 1e-4, "ngspice {version} {options}: {off:e}");
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
