//! A bar of 200 × 2 × 2 µm between ends at ambient, against closed forms: rise = (cos(λ(x − L/2))/cos(λL/2) − 1)/ξ with λ² = J²·ρ₀·ξ/k,
//! and its counterpart with a loss through gas, computed independently.

use super::super::heat_curves::{HeatCurves, RelativeCurve};
use super::super::network::ElectricalNetwork;
use super::super::thermal::{HeatConductor, Heating};
use super::element::POINTS;
use bimorph_structure::PropertyCurve;
use nalgebra::Complex;
use std::sync::Arc;

/// ρ 2e-5 Ω·m, k 32 W/(m·K), ρ·c 2330·700 J/(m³·K), a TCR of 1.25e-3/K; `gas` of all of its length (W/K), in equal pieces, fed through a
/// resistor (Ω).
fn bar(pieces: usize, gas: f64, series: f64) -> Heating {
    let (length, area) = (200e-6 / pieces as f64, 4e-12);
    let heater = |i: usize| HeatConductor {
        a: i,
        b: i + 1,
        resistance: 2e-5 * length / area,
        conductance: 32.0 * area / length,
        expansion: 0.0,
        ambient: 0.0,
        time_constant: 0.0,
        delayed: true,
        capacity: 2330.0 * 700.0 * length * area,
        gas: gas / pieces as f64,
        coefficient: 1.25e-3,
        ..HeatConductor::default()
    };
    let heaters: Vec<HeatConductor> = (0..pieces).map(heater).collect();
    let feed = if series > 0.0 { vec![(pieces, pieces + 1, series)] } else { Vec::new() };
    let source = if series > 0.0 { pieces + 1 } else { pieces };
    let circuit = ElectricalNetwork {
        nodes: pieces + 2,
        resistors: feed.into_iter().chain(heaters.iter().map(|h| (h.a, h.b, h.resistance))).collect(),
        sources: vec![(source, None)],
        grounds: vec![0],
    };
    let mut sink = vec![false; pieces + 2];
    (sink[0], sink[pieces]) = (true, true);
    Heating::new(heaters, &circuit.solve().unwrap(), 1, &sink).unwrap().with_hot(&circuit, &[])
}

/// Mean rise, highest rise and current at these volts.
fn at(heating: &Heating, volts: f64) -> [f64; 3] {
    let mut rise = vec![0.0; heating.states()];
    heating.rises(&[volts], &mut rise);
    let mean = rise[..heating.heaters.len()].iter().sum::<f64>() / heating.heaters.len() as f64;
    let hot = heating.hot().unwrap();
    let current = hot.source_currents(&hot.flows(&rise, &[volts], |_| 0.0), &[volts])[0];
    [mean, heating.peaks(&[volts]).into_iter().fold(0.0, f64::max), current]
}

/// Mean and highest rise and current at 1 mA (by its 1.20238213 V) and at 1 V, and with gas at 1 mA (by its 1.04098483 V), to 1e-4; also
/// in pieces.
#[test]
fn like_the_closed_form() {
    for pieces in [1, 2, 5] {
        let gas = 4.0 * 0.026 * 200e-6;
        for (heating, volts, wanted) in [
            (bar(pieces, 0.0, 0.0), 1.20238213, [161.905701, 244.886773, 1e-3]),
            (bar(pieces, 0.0, 0.0), 1.0, [116.570329, 175.961065, 0.872819002e-3]),
            (bar(pieces, gas, 0.0), 1.04098483, [32.787863, 44.723975, 1e-3]),
        ] {
            let found = at(&heating, volts);
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found / wanted - 1.0).abs() < 1e-4, "{pieces}, {volts} V: {found} {wanted}");
            }
        }
    }
}

/// However high the voltage, the current stays below 2.2479407 mA, where λL = π, and tends to it; rises are positive there. That limit is
/// found to 2e-5, also through a resistor.
#[test]
fn the_current_tends_to_that_of_a_runaway() {
    let heating = bar(1, 0.0, 0.0);
    for series in [0.0, 100.0] {
        let limit = bar(1, 0.0, series).runaway_current(&[0.0], 0).unwrap();
        assert!((limit / 2.2479407e-3 - 1.0).abs() < 2e-5, "{limit}");
    }
    let [mean, _, current] = at(&heating, 1e4);
    assert!(
        mean > 1e4 && current < 2.2479407e-3 * (1.0 + 1e-4) && current > 2.2479407e-3 * (1.0 - 2e-3),
        "{mean} {current}"
    );
}

/// A conductivity that falls as 1/(1 + 2e-3·rise) at a constant resistivity: at 1 mA, here 1 V, the highest rise is 238.952098 K, to 1e-5, by
/// Kirchhoff's transformation. Slopes agree with differences to 1e-7.
#[test]
fn conductivity_falls_with_temperature() {
    let mut heaters = bar(1, 0.0, 0.0).heaters;
    (heaters[0].coefficient, heaters[0].thermal_coefficient) = (0.0, 2e-3);
    let circuit = ElectricalNetwork {
        nodes: 2,
        resistors: vec![(0, 1, heaters[0].resistance)],
        sources: vec![(1, None)],
        grounds: vec![0],
    };
    let heating = Heating::new(heaters, &circuit.solve().unwrap(), 1, &[true, true]).unwrap().with_hot(&circuit, &[]);
    let [_, peak, current] = at(&heating, 1.0);
    assert!((peak / 238.952098 - 1.0).abs() < 1e-5 && (current / 1e-3 - 1.0).abs() < 1e-12, "{peak} {current}");
    let mean = |volts: f64| at(&heating, volts)[0];
    let mut rise = vec![0.0; heating.states()];
    heating.rises(&[1.0], &mut rise);
    let mut slopes = vec![0.0; 1];
    heating.slopes(&[1.0], &rise, &[1.0], &mut slopes);
    let difference = (8.0 * (mean(1.001) - mean(0.999)) - (mean(1.002) - mean(0.998))) / 12e-3;
    assert!((slopes[0] / difference - 1.0).abs() < 1e-7, "{} {difference}", slopes[0]);
}

/// A bar and a gas whose conductivities follow one curve f over temperature, over a substrate at a rise of 30 K: Θ = ∫f is that of a fin with constant properties (Kirchhoff), for a
/// polynomial and a table. The highest Θ at 1 V and constant resistance is Θ_s + P/G·(…) of the closed form, to 1e-5, and slopes agree with differences to 1e-7.
#[test]
fn gas_follows_its_curve() {
    let curves = [
        PropertyCurve { polynomial: vec![0.01, 6e-5, 2e-8], ..PropertyCurve::default() },
        PropertyCurve { table: vec![[250.0, 0.02], [400.0, 0.034], [700.0, 0.05]], ..PropertyCurve::default() },
    ];
    for curve in curves {
        let (ambient, gas, substrate) = (300.0, 2.08e-5, 30.0);
        let mut heaters = bar(1, 0.0, 0.0).heaters;
        let law = || Some(RelativeCurve::new(&curve, ambient));
        let both = HeatCurves { conductance: law(), gas: law(), ..HeatCurves::default() };
        let h = &mut heaters[0];
        (h.coefficient, h.gas, h.substrate, h.ambient, h.curves) = (0.0, gas, substrate, ambient, Some(Arc::new(both)));
        let (k, watts) = (h.conductance, 1.0 / h.resistance);
        let circuit = ElectricalNetwork {
            nodes: 2,
            resistors: vec![(0, 1, h.resistance)],
            sources: vec![(1, None)],
            grounds: vec![0],
        };
        let heating =
            Heating::new(heaters, &circuit.solve().unwrap(), 1, &[true, true]).unwrap().with_hot(&circuit, &[]);
        let [_, peak, _] = at(&heating, 1.0);
        let theta = |rise: f64| law().unwrap().between(0.0, rise)[0];
        let half = 0.5 * f64::sqrt(gas / k);
        let wanted = (theta(substrate) + watts / gas) * (1.0 - half.cosh().recip());
        assert!((theta(peak) / wanted - 1.0).abs() < 1e-5, "{peak}: {} {wanted}", theta(peak));
        let mut rise = vec![0.0; heating.states()];
        heating.rises(&[1.0], &mut rise);
        let mut slopes = vec![0.0; 1];
        heating.slopes(&[1.0], &rise, &[1.0], &mut slopes);
        let mean = |volts: f64| at(&heating, volts)[0];
        let difference = (8.0 * (mean(1.001) - mean(0.999)) - (mean(1.002) - mean(0.998))) / 12e-3;
        assert!((slopes[0] / difference - 1.0).abs() < 1e-7, "{} {difference}", slopes[0]);
    }
}

/// A negative TCR of ξ = −2e-3/K at a held voltage has no temperature above 2·√(ρ₀·k/|ξ|) = 1.13137 V, where the rise of 500 K takes the
/// resistance away. Closed form: V = 2·√(ρ₀·k/|ξ|)·tanh(|λ|L/2). The error reports the voltage to 1e-3.
#[test]
fn a_negative_coefficient_runs_away() {
    let mut heating = bar(1, 0.0, 0.0);
    let mut heaters = heating.heaters.clone();
    heaters[0].coefficient = -2e-3;
    let circuit = ElectricalNetwork {
        nodes: 2,
        resistors: vec![(0, 1, heaters[0].resistance)],
        sources: vec![(1, None)],
        grounds: vec![0],
    };
    heating = Heating::new(heaters, &circuit.solve().unwrap(), 1, &[true, true]).unwrap().with_hot(&circuit, &[]);
    assert!(heating.check(&[0.5]).is_ok());
    let super::NoSteadyHeat { share, rise, .. } = heating.check(&[5.0]).unwrap_err();
    let limit = 5.0 * share.sqrt();
    assert!((limit / 1.131371 - 1.0).abs() < 1e-3 && rise < 500.0, "{limit} {rise}");
    assert!(heating.check(&[limit * 0.999]).is_ok() && heating.check(&[limit * 1.001]).is_err());
}

/// Slopes of the steady rises and currents with the voltage, also through a resistor, agree with differences to 1e-7.
#[test]
fn slopes_are_derivatives() {
    for heating in [bar(1, 0.0, 0.0), bar(3, 2.08e-5, 0.0), bar(3, 0.0, 700.0)] {
        let hot = heating.hot().unwrap();
        let values = |volts: f64| {
            let mut rise = vec![0.0; heating.states()];
            heating.rises(&[volts], &mut rise);
            let current = hot.source_currents(&hot.flows(&rise, &[volts], |_| 0.0), &[volts])[0];
            (rise, current)
        };
        let (rise, _) = values(1.3);
        let mut slopes = vec![0.0; heating.states()];
        heating.slopes(&[1.3], &rise, &[1.0], &mut slopes);
        let flows = hot.flows(&rise, &[1.3], |_| 0.0);
        let current = hot.source_currents(&hot.flow_change(&rise, &flows, &slopes, &[1.0]), &[1.0])[0];
        let ([a, b], [c, d]) = ([1.3 + 1e-3, 1.3 - 1e-3].map(values), [1.3 + 5e-4, 1.3 - 5e-4].map(values));
        let best = |wide: f64, narrow: f64| (4.0 * narrow / 1e-3 - wide / 2e-3) / 3.0;
        let highest = slopes.iter().fold(0.0f64, |most, s| most.max(s.abs()));
        for (k, slope) in slopes.iter().enumerate() {
            let difference = best(a.0[k] - b.0[k], c.0[k] - d.0[k]);
            assert!((slope - difference).abs() < 1e-7 * highest, "{k}: {slope} {difference}");
        }
        let difference = best(a.1 - b.1, c.1 - d.1);
        assert!((current / difference - 1.0).abs() < 1e-7, "{current} {difference}");
    }
}

/// A small step of the voltage decays with the slowest time constant ρ·c·L²/(π²·k) = 206.5686 µs, with gas 48.11822 µs, to 1e-3, and ends at
/// the steady rise. At low voltage the current does not couple.
#[test]
fn slowest_time_constants() {
    for (gas, tau) in [(0.0, 206.5686e-6), (4.0 * 0.026 * 200e-6, 48.11822e-6)] {
        let heating = bar(1, gas, 0.0);
        let hot = heating.hot().unwrap();
        let u = [1e-3];
        let mut steady = vec![0.0; hot.states()];
        hot.steady(&u, &mut steady).unwrap();
        let course = hot.course(super::SourceLine { from: &u, to: &u, dt: 6.0 * tau }, &vec![0.0; hot.states()]);
        assert_eq!(course.failed, None);
        let mut means = [0.0];
        hot.means(&steady, &mut means);
        let left = |t: f64| means[0] - course.mean(0, t)[0];
        let found = 2.0 * tau / (left(2.0 * tau) / left(4.0 * tau)).ln();
        assert!((found / tau - 1.0).abs() < 1e-3, "{found} {tau}");
        let slowest = hot.slowest(&u, &steady);
        assert!((slowest / tau - 1.0).abs() < 1e-4, "{slowest} {tau}");
        // by the rates between the ends of steps
        let rate = course.mean(0, 3.0 * tau)[1];
        let difference = (course.mean(0, 3.0 * tau + 1e-9)[0] - course.mean(0, 3.0 * tau - 1e-9)[0]) / 2e-9;
        assert!((rate / difference - 1.0).abs() < 1e-5, "{rate} {difference}");
    }
}

/// The change of a course with its final voltage agrees with differences to 1e-6, at its end and within it.
#[test]
fn changes_of_a_course_are_derivatives() {
    let heating = bar(2, 2.08e-5, 300.0);
    let hot = heating.hot().unwrap();
    let (from, dt) = ([0.4], 30e-6);
    let mut start = vec![0.0; hot.states()];
    hot.steady(&from, &mut start).unwrap();
    let line = |to: f64| (to, hot.course(super::SourceLine { from: &from, to: &[to], dt }, &start));
    let change = hot.course_change(super::SourceLine { from: &from, to: &[1.1], dt }, &start, 0);
    let (up, down) = (line(1.1 + 1e-4).1, line(1.1 - 1e-4).1);
    for t in [dt, 0.4 * dt] {
        for k in 0..2 {
            let difference = (up.mean(k, t)[0] - down.mean(k, t)[0]) / 2e-4;
            let found = change.mean(k, t)[0];
            assert!((found / difference - 1.0).abs() < 1e-6, "{t} {k}: {found} {difference}");
        }
    }
}

/// The response at a frequency tends to the steady slope at low ones, and at 1/τ has the admittance of the diffusion between cold ends:
/// mean rise ∝ (1 − tanh(z)/z)/z² with z = (L/2)·√(iωρc/k), relative to 1/3, to 1e-3. Closed form at small currents.
#[test]
fn response_in_frequency() {
    let heating = bar(1, 0.0, 0.0);
    let mut rise = vec![0.0; heating.states()];
    let u = [1e-3];
    heating.rises(&u, &mut rise);
    let at = |omega: f64| heating.response((&u, &rise), &[1.0], Complex::new(0.0, omega))[0];
    let mut slopes = vec![0.0; 1];
    heating.slopes(&u, &rise, &[1.0], &mut slopes);
    assert!((at(1e-3).re / slopes[0] - 1.0).abs() < 1e-9);
    for omega in [1e3, 5e3, 5e4] {
        let z = Complex::new(0.0, omega * 2330.0 * 700.0 / 32.0).sqrt() * 100e-6;
        let exact = (Complex::from(1.0) - z.tanh() / z) / (z * z) * 3.0;
        assert!((at(omega) / slopes[0] / exact - 1.0).norm() < 1e-3, "{omega}");
    }
}

/// A beam at the ends at ambient with the properties of `bar`, changed by `with`, fed by one source.
fn changed(with: impl FnOnce(&mut HeatConductor)) -> Heating {
    let mut heaters = bar(1, 0.0, 0.0).heaters;
    with(&mut heaters[0]);
    let circuit = ElectricalNetwork {
        nodes: 2,
        resistors: vec![(0, 1, heaters[0].resistance)],
        sources: vec![(1, None)],
        grounds: vec![0],
    };
    Heating::new(heaters, &circuit.solve().unwrap(), 1, &[true, true]).unwrap().with_hot(&circuit, &[])
}

/// Radiation of a beam that conducts hardly any heat: in its middle the power I²R/l of 1 W over its surface is σ·ε·(T⁴ − T₀⁴) (closed form), to 1e-9. With conduction the slopes with the voltage agree
/// with differences to 1e-7.
#[test]
fn beams_radiate() {
    // emissivity 0.7 of 200 µm × 8 µm
    let radiation = 5.670_374_419e-8 * 0.7 * 8e-6 * 200e-6;
    let dark = changed(|h| (h.coefficient, h.conductance, h.radiation, h.ambient) = (0.0, 1e-10, radiation, 300.0));
    let volts = (3e-4f64 * dark.heaters[0].resistance).sqrt();
    let [_, peak, _] = at(&dark, volts);
    let exact = (3e-4 / radiation + 300f64.powi(4)).powf(0.25) - 300.0;
    assert!((peak / exact - 1.0).abs() < 1e-9, "{peak} {exact}");
    let bright = changed(|h| (h.radiation, h.ambient) = (radiation, 300.0));
    let mut rise = vec![0.0; bright.states()];
    bright.rises(&[1.5], &mut rise);
    let mut slopes = vec![0.0; bright.states()];
    bright.slopes(&[1.5], &rise, &[1.0], &mut slopes);
    let mean = |volts: f64| at(&bright, volts)[0];
    let difference = (8.0 * (mean(1.501) - mean(1.499)) - (mean(1.502) - mean(1.498))) / 12e-3;
    assert!((slopes[0] / difference - 1.0).abs() < 1e-7, "{} {difference}", slopes[0]);
    assert!(mean(1.5) < at(&changed(|_| ()), 1.5)[0]);
}

/// Energy audit of heat: over a pulse of 1.2 V and the cooling after it the electrical work is the heat stored, ∫C·c(T)dT, and the heat lost to ends, gas and surroundings, within 1e-6 of
/// the work. All of TCR, TCK, TCC, gas and radiation act. Steps of the course are short here, so that Simpson's rule over them is exact enough.
#[test]
fn heat_is_stored_or_lost() {
    let heating = changed(|h| {
        (h.thermal_coefficient, h.capacity_coefficient, h.gas) = (8e-4, 5e-4, 2e-5);
        (h.radiation, h.ambient) = (6e-17, 300.0);
    });
    let hot = heating.hot().unwrap();
    let bar = &hot.bars[0];
    // work and losses of a state (W); heat that is stored, and the part of it at the ends (J)
    let powers = |state: &[f64], volts: f64| {
        let current = hot.conduct(state, &[volts]).current[0];
        let mut own = super::BeamResidual::default();
        bar.residual(([0.0; 2], state), None, current, &mut own);
        // what the ends receive but for what is stored at them
        let received = -own.heat[0] - own.heat[state.len() + 1];
        let node = |j: usize| if j == 0 || j > state.len() { 0.0 } else { state[j - 1] };
        let (mut aside, mut stored, mut at_ends) = (0.0, 0.0, 0.0);
        for e in 0..bar.elements {
            for (x, weight) in POINTS {
                let shape = [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
                let t: f64 = (0..3).map(|i| shape[i] * node(2 * e + i)).sum();
                let part = weight / bar.elements as f64;
                let heat = part * bar.capacity * (t + 0.5 * 5e-4 * t * t);
                aside += part * (2e-5 * t + 6e-17 * ((300.0 + t).powi(4) - 300f64.powi(4)));
                stored += heat;
                at_ends += if e == 0 { shape[0] * heat } else { 0.0 };
                at_ends += if e + 1 == bar.elements { shape[2] * heat } else { 0.0 };
            }
        }
        // the current flows from node 0, at ground, to node 1
        ([-current * volts, aside + received], stored, at_ends)
    };
    let mut state = vec![0.0; hot.states()];
    let (mut work, mut lost, mut worst) = (0.0, 0.0, 0.0f64);
    for volts in [1.2, 0.0] {
        let (given, mut dt) = ([volts], 1e-9);
        for _ in 0..500 {
            let line = |dt: f64| super::SourceLine { from: &given, to: &given, dt };
            let half = hot.course(line(0.5 * dt), &state).end;
            let end = hot.course(line(0.5 * dt), &half).end;
            let [(p0, _, ends0), (pm, ..), (p1, stored, ends1)] =
                [&state, &half, &end].map(|state| powers(state, volts));
            let mean = |i: usize| dt * (p0[i] + 4.0 * pm[i] + p1[i]) / 6.0;
            work += mean(0);
            lost += mean(1) - (ends1 - ends0);
            worst = worst.max((work - lost - stored).abs());
            state = end;
            dt = f64::min(1.05 * dt, 0.5e-6);
        }
    }
    println!("work {work:e} J, lost {lost:e} J, difference {:e}", worst / work);
    assert!(worst < 1e-6 * work, "{worst:e} of {work:e}");
}

/// The change of a course with its final voltage agrees with differences where the heat capacity depends on temperature and the beam radiates.
/// One step agrees to 1e-8. Several steps agree to 5e-6, since their lengths follow the voltage within their tolerance.
#[test]
fn changes_with_capacity_and_radiation_are_derivatives() {
    let heating = changed(|h| {
        (h.capacity_coefficient, h.radiation, h.ambient) = (1e-3, 6e-17, 300.0);
    });
    let hot = heating.hot().unwrap();
    let from = [0.4];
    let mut start = vec![0.0; hot.states()];
    hot.steady(&from, &mut start).unwrap();
    for (dt, bound) in [(1e-7, 1e-8), (5e-7, 5e-6), (2e-6, 5e-6)] {
        let mean = |to: f64| hot.course(super::SourceLine { from: &from, to: &[to], dt }, &start).mean(0, dt)[0];
        let found = hot.course_change(super::SourceLine { from: &from, to: &[1.1], dt }, &start, 0).mean(0, dt)[0];
        let one = |h: f64| (mean(1.1 + h) - mean(1.1 - h)) / (2.0 * h);
        let difference = (4.0 * one(1e-2) - one(2e-2)) / 3.0;
        assert!((found / difference - 1.0).abs() < bound, "{dt}: {found} {difference}");
    }
}

/// Anchors at a rise of 50 and −10 K without any heat: linear between them (closed form). A substrate at 30 K warms a bar between ends at ambient to a mean of
/// 30·(1 − tanh(μ/2)/(μ/2)), and its middle to 30·(1 − 1/cosh(μ/2)) (a fin between cold ends). A run begins and stays there, with slopes that agree with differences to 1e-7.
#[test]
fn anchors_and_substrate_have_temperatures() {
    let heaters = |gas: f64, substrate: f64| {
        let mut heaters = bar(1, 0.0, 0.0).heaters;
        (heaters[0].gas, heaters[0].substrate) = (gas, substrate);
        heaters
    };
    let with = |heaters: Vec<HeatConductor>, held: &[f64]| {
        let circuit = ElectricalNetwork {
            nodes: 2,
            resistors: vec![(0, 1, heaters[0].resistance)],
            sources: vec![(1, None)],
            grounds: vec![0],
        };
        Heating::new(heaters, &circuit.solve().unwrap(), 1, &[true, true]).unwrap().with_hot(&circuit, held)
    };
    let ends = with(heaters(0.0, 0.0), &[50.0, -10.0]);
    let rest = ends.rest();
    assert!((rest[0] - 20.0).abs() < 1e-9 && (ends.peaks(&[0.0])[0] - 50.0).abs() < 1e-9, "{rest:?}");
    let gas = 2.08e-5;
    let warm = with(heaters(gas, 30.0), &[0.0, 0.0]);
    let half = 0.5 * f64::sqrt(gas / (32.0 * 4e-12 / 200e-6));
    let rest = warm.rest();
    assert!((rest[0] / (30.0 * (1.0 - half.tanh() / half)) - 1.0).abs() < 1e-4, "{}", rest[0]);
    assert!((warm.peaks(&[0.0])[0] / (30.0 * (1.0 - half.cosh().recip())) - 1.0).abs() < 1e-4);
    let hot = warm.hot().unwrap();
    let still = hot.course(super::SourceLine { from: &[0.0], to: &[0.0], dt: 1e-4 }, &rest[1..]);
    assert!((still.mean(0, 1e-4)[0] / rest[0] - 1.0).abs() < 1e-9 && still.mean(0, 5e-5)[1].abs() < 1e-3 * rest[0]);
    let mut rise = vec![0.0; ends.states()];
    ends.rises(&[1.0], &mut rise);
    let mut slopes = vec![0.0; ends.states()];
    ends.slopes(&[1.0], &rise, &[1.0], &mut slopes);
    let mean = |volts: f64| at(&ends, volts)[0];
    let difference = (8.0 * (mean(1.001) - mean(0.999)) - (mean(1.002) - mean(0.998))) / 12e-3;
    assert!((slopes[0] / difference - 1.0).abs() < 1e-7, "{} {difference}", slopes[0]);
}
