//! Parts that touch: pull-in, what holds them, release, and the hysteresis between.

use crate::{balance, close, model, node};
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::domains::contact::{DEEPEST, TOUCH};
use bimorph::solve::time::event::Direction;

pub(crate) const EPS: f64 = 8.854e-12;
/// Least distance that the law of contact allows between parts drawn more than 0.2 µm apart (m).
pub(crate) const LEAST: f64 = TOUCH * (1.0 - 0.5 * DEEPEST);

/// A plate of area A on a spring k in front of an electrode at a distance g.
fn plate(k: f64, area: f64, gap: f64, impact: &str) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx={k:e}]
        anchor * [e] []
        plategap2d * [m e] [A={area:e} gap={gap:e} {impact}]
        eground * [e] []
        drive port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

/// A plate of 1e-8 m² on 1 N/m, 2 µm in front of an electrode, with what stops it.
fn stopped_plate(stop: &str) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] []
        plategap2d * [m e] [A=1e-8 gap=2u]
        eground * [e] []
        drive port * [m e] []
        {stop}"
    );
    model(&text, &CompileOptions::default())
}

/// √(8kg³/27εA) (Nathanson et al., 1967).
fn nathanson(k: f64, area: f64, gap: f64) -> f64 {
    (8.0 * k * gap.powi(3) / (27.0 * EPS * area)).sqrt()
}

/// Numbers between two bounds, evenly in their logarithm, the same in every run (Knuth's 64-bit congruence).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let share = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        low * (high / low).powf(share)
    }
}

/// A thousand plates of any stiffness, area and gap at up to 50 times their pull-in voltage rest within the range of the law of
/// contact: between ¾ of the touching distance and itself. (By the earlier law, which had no area, large plates went micrometres
/// through each other.)
#[test]
fn a_thousand_plates_rest_on_contact() {
    let mut random = Numbers(7);
    let mut deepest = f64::INFINITY;
    for _ in 0..1000 {
        let (k, area) = (random.between(1e-2, 1e2), random.between(1e-10, 1e-6));
        let gap = random.between(0.5e-6, 5e-6);
        let volts = nathanson(k, area, gap) * random.between(1.02, 50.0);
        let pressure = 0.5 * EPS * volts * volts / (TOUCH * TOUCH);
        if pressure > 2e10 {
            continue; // silicon bears about 10 GPa
        }
        let result = balance(&plate(k, area, gap, ""), &[("drive", volts)]);
        let left = gap - node(&result, "m").x;
        assert!(
            result.pulled_in && (LEAST..=TOUCH).contains(&left),
            "k {k:e} A {area:e} g {gap:e} V {volts}: {left:e}"
        );
        deepest = deepest.min(left);
    }
    assert!(deepest < 0.98 * TOUCH, "the voltages never pressed: {deepest:e}");
}

/// A contact beyond the range of the law is rejected with the name of the gap: a plate of 1 µm² pushed by 0.1 N, 100
/// GPa.
#[test]
fn beyond_the_law_there_is_no_number() {
    let text = "
        param F=0
        anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        f2d * [m] [F=F]
        anchor * [e] []
        narrow plategap2d * [m e] [A=1e-12 gap=2u]
        eground * [e] []
        drive port * [m e] []";
    let at = |force: &str| {
        let compiled = model(&text.replace("F=F", &format!("F={force}")), &CompileOptions::default());
        bimorph::analysis::statics::static_equilibrium(&compiled, &[])
    };
    let left = 2e-6 - node(&at("10m").unwrap(), "m").x;
    assert!((LEAST..TOUCH).contains(&left), "{left:e}");
    let error = at("100m").unwrap_err().to_string();
    assert!(error.contains("\"narrow\"") && error.contains("law of contact"), "{error}");
}

/// One gap of random size, in one of four layouts: a lumped plate, a cantilever that is the electrode, a wide electrode on a thin
/// cantilever (SUGAR's demo beamgap2e), a clamped-clamped beam over four pieces of an electrode.
pub(crate) fn random_part(case: usize, random: &mut Numbers) -> CompiledModel {
    let gap = random.between(1e-6, 4e-6);
    if case.is_multiple_of(4) {
        return plate(random.between(0.1, 10.0), random.between(1e-9, 1e-7), gap, "");
    }
    let (l, w) = (random.between(60e-6, 200e-6), random.between(1e-6, 3e-6));
    let field = format!("gap={gap:e}] \n R * [a b] [R=1]\n R * [c d] [R=1]\n anchor p1 [c] []\n anchor p1 [d] []\n");
    let text = match case % 4 {
        1 => format!(
            "anchor p1 [a] []\nbeam2d p1 [a b] [l={l:e} w={w:e}]\ngap2dforce p1 [a b c d] [l={l:e} w1={w:e} w2=5u {field}"
        ),
        2 => format!(
            "anchor p1 [s] []\nbeam2d p1 [s a] [l={l:e} w={w:e}]\nbeam2d p1 [a b] [l=100u w=10u]\n\
             gap2dforce p1 [a b c d] [l=100u w1=10u w2=5u {field}"
        ),
        _ => format!(
            "dl = {l:e}\nanchor p1 [e(0)] []\nanchor p1 [f(0)] []\nfor i=1:4 [\n beam2d p1 [e(i-1) e(i)] [l=dl w=1u]\n\
             gap2dforce p1 [e(i-1) e(i) f(i-1) f(i)] [l=dl w1=1u w2=5u gap={gap:e}]\n\
             R * [e(i-1) e(i)] [R=1]\n R * [f(i-1) f(i)] [R=1]\n anchor p1 [f(i)] []\n]\nanchor p1 [e(4)] []\n"
        ),
    };
    let [moving, fixed] = if case % 4 == 3 { ["e(0)", "f(0)"] } else { ["a", "c"] };
    let text = format!("{text}eground * [{moving}] []\ndrive port * [{fixed} {moving}] []\n");
    model(&text, &CompileOptions::default())
}

/// Two hundred random parts pull in and open at the same voltages for any largest voltage, from just above pull-in to
/// 1000 V, and open below pull-in.
#[test]
fn pull_in_does_not_depend_on_the_largest_voltage() {
    let mut random = Numbers(11);
    for case in 0..200 {
        let compiled = random_part(case, &mut random);
        let first = pull_in(&compiled, None, 1000.0).unwrap_or_else(|e| panic!("{case}: {e}"));
        let release = first.release_v.unwrap_or(0.0);
        assert!(first.held && release < first.pull_in_v, "{case}: {first:?}");
        let share = random.between(0.01, 0.9);
        let between = first.pull_in_v.powf(1.0 - share) * 1000f64.powf(share);
        for max in [1.0001 * first.pull_in_v, 2.0 * first.pull_in_v, between] {
            let found = pull_in(&compiled, None, max).unwrap_or_else(|e| panic!("{case}, --max {max}: {e}"));
            close(found.pull_in_v, first.pull_in_v, 1e-9);
            assert!(
                (found.release_v.unwrap_or(0.0) - release).abs() <= 1e-9 * release,
                "{case}, --max {max}: {found:?}"
            );
        }
        // a little beyond, the static equilibrium is the closed one
        for beyond in [1.0001, 1.003, 1.1] {
            let result = balance(&compiled, &[("drive", beyond * first.pull_in_v)]);
            assert!(result.pulled_in, "{case}: {beyond}");
        }
        assert!(!balance(&compiled, &[("drive", 0.999 * first.pull_in_v)]).jumped, "{case}");
    }
}

/// Plates pull in at Nathanson's voltage, and open where kx = εAV²/2(g − x)² at the touching distance.
#[test]
fn plates_pull_in_and_open() {
    let mut random = Numbers(5);
    for _ in 0..100 {
        let (k, area, gap) = (random.between(0.1, 10.0), random.between(1e-9, 1e-7), random.between(0.5e-6, 4e-6));
        let found = pull_in(&plate(k, area, gap, ""), None, 1000.0).unwrap();
        close(found.pull_in_v, nathanson(k, area, gap), 1e-6);
        let release = (2.0 * k * (gap - TOUCH) * TOUCH * TOUCH / (EPS * area)).sqrt();
        close(found.release_v.unwrap(), release, 5e-3);
    }
}

/// A plate with a stop at 1 µm, half of its gap, pulls in at Nathanson's voltage for each --max, and opens where V² =
/// 2kx(g − x)²/εA at x = 1 µm: 4.7527 V.
#[test]
fn plate_with_a_stop() {
    let compiled = stopped_plate("anchor * [s] []\nplategap2d * [m s] [A=1e-8 gap=1.1u]\nR * [m s] [R=1]");
    for max in [12.0, 21.0, 24.0, 25.0, 42.0, 48.0, 50.0, 100.0, 200.0] {
        let found = pull_in(&compiled, None, max).unwrap_or_else(|e| panic!("--max {max}: {e}"));
        close(found.pull_in_v, nathanson(1.0, 1e-8, 2e-6), 1e-6);
        close(found.release_v.unwrap(), (2e-18 / (EPS * 1e-8)).sqrt(), 1e-3);
    }
}

/// A hundred bounces of an undamped plate at 8 V (dynamic pull-in is 4.75 V), default tolerance. In flight, ½mv² + ½kx²
/// − ½CV² stays within 1e-3 of the energy released by a fall. The plate does not rebound beyond its start by more than
/// the corresponding height; at 1e-2 within ten times that.
#[test]
fn a_hundred_bounces_gain_no_energy() {
    let (mass, k, area, gap, volts) = (1e-10, 1.0, 1e-8, 2e-6, 8.0);
    let compiled = plate(k, area, gap, "restitution=1");
    let energy = |x: f64, v: f64| 0.5 * (mass * v * v + k * x * x - EPS * area * volts * volts / (gap - x));
    let released = energy(0.0, 0.0) - energy(gap - TOUCH, 0.0);
    for (tol, share) in [(1e-3, 1e-3), (1e-2, 1e-2)] {
        let options = TransientOptions {
            stop: 4.2e-3,
            points: 40_001,
            tol,
            signals: vec!["m.x".into(), "m.vx".into()],
            voltages: vec![("drive".into(), volts)],
            ..TransientOptions::default()
        };
        let result = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap();
        let bounces = result.events.iter().filter(|e| e.contact && e.direction == Direction::Down).count();
        assert!((95..=110).contains(&bounces), "{bounces}");
        let flight = result.signals[0].2.iter().zip(&result.signals[1].2).filter(|(x, _)| gap - **x > 1.05 * TOUCH);
        for (x, v) in flight {
            let gained = (energy(*x, *v) - energy(0.0, 0.0)) / released;
            assert!(gained.abs() < share, "tol {tol:e}: {gained:e} at {x:e}");
        }
        let back = result.signals[0].2.iter().fold(0.0, |a: f64, x| a.min(*x));
        assert!(energy(back, 0.0) - energy(0.0, 0.0) < share * released, "{back:e}");
    }
}

/// A mass on a spring between stops at +1 and −2 µm under ±10 µN at k = 1 N/m. Rigid stops hold it within 5 nm, where
/// the law has p·A = F − kx. A stop of 50 N/m is displaced by (F − kx)/50, plus 1 nm of contact. Within the stops there
/// is no force.
#[test]
fn stops_hold() {
    let at = |force: f64, stop: &str| {
        let text = format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-10]
            guide2d * [m] []
            spring2d * [f m] [kx=1]
            s stop2d * [m] [gap=1u back=2u {stop}]
            f2d * [m] [F={force:e}]"
        );
        node(&balance(&model(&text, &CompileOptions::default()), &[]), "m").x
    };
    close(at(0.9e-6, ""), 0.9e-6, 1e-9);
    for (force, way) in [(10e-6, 1e-6), (-10e-6, 2e-6)] {
        let x = at(force, "").abs();
        let share = 2.0 * (x - way) / TOUCH;
        assert!((0.0..5e-9).contains(&(x - way)), "{x:e}");
        close(1e-10 * 2e11 * share.powi(3), 10e-6 - x, 1e-6);
        let pressed = at(force, "k=50").abs() - way;
        close(50.0 * pressed * pressed / (pressed + 1e-9), 10e-6 - way - pressed, 1e-6);
    }
}

/// A plate with a rigid stop after 1 µm, half of its gap, pulls in and opens as with a stop drawn as a gap: 5.1741 and
/// 4.7527 V.
#[test]
fn a_stop_ends_pull_in() {
    let found = pull_in(&stopped_plate("s stop2d * [m] [gap=1u]"), None, 200.0).unwrap();
    close(found.pull_in_v, nathanson(1.0, 1e-8, 2e-6), 1e-6);
    close(found.release_v.unwrap(), (2e-18 / (EPS * 1e-8)).sqrt(), 1e-3);
}

/// A load that opens a gap is there before the attraction that it holds off: k = 1 N/m, g = 2 µm, 4 µN away from the electrode. Up to pull-in at
/// 26.89 V the plate stays where the cubic (u + F/k)(g + u)² = −ε₀AV²/2k has its stable root: −3.391 µm at 20 V.
#[test]
fn a_load_that_opens_a_gap_comes_first() {
    let text = format!("{}\nf2d * [m] [F=-4u]", crate::gaps::PLATE);
    let compiled = model(&text, &CompileOptions::default());
    for volts in [20.0, 26.0] {
        let port = [("drive".to_owned(), volts)];
        let found = static_equilibrium(&compiled, &port).unwrap();
        assert!(!found.pulled_in && !found.jumped, "{volts}");
        let u = node(&found, "m").x;
        let attraction = 0.5 * EPS * 1e-8 * volts * volts / (2e-6 - u).powi(2);
        assert!((u + 4e-6 - attraction).abs() < 1e-5 * 4e-6, "{volts}: {u:e} {attraction:e}");
    }
}
