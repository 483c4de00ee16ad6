//! Friction of parts at rest: static trials hold its history, against closed forms.

use crate::{ask, compiled, opened};
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::Formulation;
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, Token};
use bimorph::netlist::{Bundle, load};

/// A block on a spring of 1 N/m along a floor, on which 1 µN presses it: friction of at most 0.9 µN, and 9 N/m while it sticks.
const BLOCK: &str = "
anchor * [f] []
spring2d * [f m] [kx=1 ky=1e-6 krz=1e-3]
mass2d * [m] [m=1e-10 J=1e-22]
f2d * [m] [F=1u oz=-pi/2]
floor stop2d * [m] [gap=1n oz=-pi/2 k=1e4 friction=0.9 stickstiffness=9]
";

/// Displacements (m) of the block under these forces in turn (N), from a state or as drawn, and the last state.
fn moved(device: &mut LocalDevice, mut from: Option<Token>, forces: &[f64]) -> (Vec<f64>, Option<Token>) {
    let mut at = Vec::new();
    for force in forces {
        let reply = ask(device, Mode::Static, from, 0.0, &[*force]);
        at.push(reply.currents[0]);
        from = reply.token;
    }
    (at, from)
}

/// The loop of a block with friction, loaded to ±3 µN in steps of 0.25 µN. It sticks with k + k_t = 10 N/m up to ±μN = ±0.9 µN of friction. Then it follows the spring
/// alone: x = (F − μN)/k up, x = (F + μN)/k down, with 2·μN/k_t = 0.2 µm of way to turn. The work of the force over the loop is μN times the slip of 2·(2·2.1 − 0.2) µm.
/// A saved session continues with the same bits. Statics balance a contact to 1e-6 of its force, which is 1e-12 m here.
#[test]
fn a_block_with_friction_has_a_loop() {
    let (k, kt, limit, most) = (1.0, 9.0, 0.9e-6, 3e-6);
    let close = 1e-6 * 1e-6 / k;
    let steps = |from: f64, to: f64| -> Vec<f64> {
        let n = ((to - from) / 0.25e-6).abs().round() as usize;
        (1..=n).map(|i| from + (to - from) * i as f64 / n as f64).collect()
    };
    let up = steps(0.0, most);
    let around: Vec<f64> = steps(most, -most).into_iter().chain(steps(-most, most)).collect();
    let mut device = opened(&compiled(BLOCK, Formulation::Compliant), &["m.x"], &[]);
    let (first, corner) = moved(&mut device, None, &up);
    for (force, x) in up.iter().zip(&first) {
        let exact = (force / (k + kt)).max((force - limit) / k);
        assert!((x - exact).abs() < close, "{force:e}: {x:e} {exact:e}");
    }
    let saved = device.save(None).unwrap_or_else(|e| panic!("{e}"));
    let (found, _) = moved(&mut device, corner, &around);
    let top = (most - limit) / k;
    let mut work = 0.0;
    let (mut before, mut last) = (top, most);
    for (n, (force, x)) in around.iter().zip(&found).enumerate() {
        let exact = match n < around.len() / 2 {
            true => (top - (most - force) / (k + kt)).min((force + limit) / k),
            false => (-top + (force + most) / (k + kt)).max((force - limit) / k),
        };
        assert!((x - exact).abs() < close, "{force:e}: {x:e} {exact:e}");
        work += 0.5 * (force + last) * (x - before);
        (before, last) = (*x, *force);
    }
    let slip = 2.0 * (2.0 * top - 2.0 * limit / kt);
    assert!((before - top).abs() < close && (work / (limit * slip) - 1.0).abs() < 1e-6, "{work:e}");
    let mut restored = LocalDevice::new(compiled(BLOCK, Formulation::Compliant));
    restored.load(&saved).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(moved(&mut restored, corner, &around).0, found);
}

/// The derivative of a static trial is that of the equilibria to which it moves, by differences to 1e-6, where the block sticks and where it slips. The second floor is inclined
/// by 30°, so that the force itself changes the contact force.
#[test]
fn trials_have_the_derivative_of_their_state() {
    for (slope, forces) in [("-pi/2", [0.4e-6, 2e-6]), ("-pi/3", [0.2e-6, 2.5e-6])] {
        let text = BLOCK.replace("gap=1n oz=-pi/2", &format!("gap=1n oz={slope}"));
        let mut device = opened(&compiled(&text, Formulation::Compliant), &["m.x"], &[]);
        for force in forces {
            let start = ask(&mut device, Mode::Static, None, 0.0, &[0.99 * force]).token;
            let mut at = |force: f64| ask(&mut device, Mode::Static, start, 0.0, &[force]);
            let (lower, here, upper) = (at(force * (1.0 - 1e-4)), at(force), at(force * (1.0 + 1e-4)));
            let slope = (upper.currents[0] - lower.currents[0]) / (2e-4 * force);
            assert!((here.di_dv[0] / slope - 1.0).abs() < 1e-6, "{force:e}: {:e} {slope:e}", here.di_dv[0]);
        }
    }
}

/// A force drives a block into an inclined floor, on springs of 1 N/m in both directions. Statics give s = (F·t − μN)/k along the floor, with N = F·n − k·u of the ways
/// s and u along and towards it, to 1e-6 of the way. Without `stickstiffness` there is no friction at rest.
#[test]
fn a_wedge_slips_under_its_own_contact_force() {
    let part = |stick: &str| {
        format!(
            "anchor * [f] []
            spring2d * [f m] [kx=1 ky=1 krz=1e-9]
            mass2d * [m] [m=1e-10 J=1e-22]
            f2d * [m] [F=3u]
            floor stop2d * [m] [gap=0.1u oz=pi/3 k=1e3 friction=0.3 {stick}]"
        )
    };
    let (n, t) = ([0.5, 0.75f64.sqrt()], [-(0.75f64.sqrt()), 0.5]);
    for (stick, coefficient) in [("stickstiffness=1k", 0.3), ("", 0.0)] {
        let found = static_equilibrium(&compiled(&part(stick), Formulation::Compliant), &Vec::new()).unwrap();
        let m = found.nodes.iter().find(|(name, _)| name == "m").unwrap().1;
        let way = |axis: [f64; 2]| m.x * axis[0] + m.y * axis[1];
        let normal = 3e-6 * n[0] - way(n);
        let exact = 3e-6 * t[0] + coefficient * normal;
        assert!(normal > 1e-6 && (way(t) - exact).abs() < 1e-6 * exact.abs(), "{stick}: {:e} {exact:e}", way(t));
    }
}

/// A block that meets its stop under a load beside it sticks to where it touched: at x₀ = F·gap/N while the spring alone holds it, and x = (F + k_t·x₀)/(k + k_t) then. That
/// holds to 2e-5 in every direction of the drawing, since the contact closes in a millionth of the load.
#[test]
fn a_block_sticks_where_it_touches() {
    let (k, kt, force, normal, gap) = (1.0, 9.0, 0.95e-6, 1e-6, 1e-9);
    let exact = (force + kt * force * gap / normal) / (k + kt);
    for angle in [0.0, 0.3, std::f64::consts::FRAC_PI_2, 2.0, 4.5f64] {
        let text = format!(
            "anchor * [f] []
            spring2d * [f m] [kx={k} ky={k} krz=1e-6 oz={angle}]
            mass2d * [m] [m=1e-9 J=1e-18]
            f2d * [m] [F={normal} oz={angle}-pi/2]
            f2d * [m] [F={force} oz={angle}]
            floor stop2d * [m] [gap={gap} oz={angle}-pi/2 k=1e4 friction=0.9 stickstiffness={kt}]"
        );
        let found = static_equilibrium(&compiled(&text, Formulation::Compliant), &Vec::new()).unwrap();
        let m = found.nodes.iter().find(|(name, _)| name == "m").unwrap().1;
        let along = m.x * angle.cos() + m.y * angle.sin();
        assert!((along - exact).abs() < 2e-5 * exact, "{angle}: {along:e} {exact:e}");
    }
}

/// A stiffness along a stop beyond 1e9 N/m, where rounding of displacements would decide on the force, is refused by name.
#[test]
fn stiffness_beyond_that_of_contacts_is_refused() {
    let text = BLOCK.replace("stickstiffness=9", "stickstiffness=1e300");
    let refused = load(&Bundle::from_text("block.net", &text), &[]).unwrap_err().to_string();
    assert!(refused.contains("`stickstiffness` (stiffness [N/m]) must be at most 1e9, this is 1e300"), "{refused}");
}
