//! Heated beams with a resistance that depends on temperature and with loss of heat through gas, from the netlist to what circuits see.
//!
//! The bar of 200 × 2 × 2 µm between ends at ambient has a closed form: rise = (cos(λ(x − L/2))/cos(λL/2) − 1)/ξ, λ² = J²·ρ₀·ξ/k. Its
//! numbers, and those with gas, are from an independent computation.

use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, SmallSignal, Status, Trial, TrialReply};
use bimorph::netlist::{Bundle, read_bundle};
use std::path::Path;
use std::sync::Arc;

fn bar(layer: &str, more: &str) -> Arc<CompiledModel> {
    let text = format!(
        "process si = [ Youngsmodulus=160e9 density=2330 h=2u resistivity=2e-5 thermcond=32 thermalexpansion=2.7e-6 {layer} ]
anchor si [cold] []
arm beam2det si [cold far] [l=200u w=2u]
anchor si [far] []
eground * [cold] []
{more}"
    );
    Arc::new(
        compile(&Bundle::from_text("bar.net", &text), &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")),
    )
}

/// Mean and highest temperature of each beam of the example (K), and its current (A).
const WANTED: [(&str, f64, f64); 4] =
    [("hot", 432.003, 474.598), ("bar", 341.736, 344.515), ("cold", 321.639, 338.960), ("flex", 324.326, 334.524)];
const CURRENT: f64 = 1.3092012e-03;

const PORT: &str = "feed port * [far cold] []";
const AIR: &str = "TCR=1.25e-3 gasconductivity=0.026 fluid=2u shapefactor=4";

/// Mean rise, highest rise and current at 1 V, at 2 V and at the voltage of 1 mA, alone and in air, to 1e-4 of the closed forms. Without a TCR
/// the bar at 2 V is V²/(12·ρ·k) = 520.833 K warm, 1.5 times that in its middle. A conductivity that falls with temperature has the highest rise
/// of Kirchhoff's transformation.
#[test]
fn steady_temperatures() {
    let any = f64::NAN;
    for (layer, volts, wanted) in [
        ("TCR=1.25e-3", 1.0, [116.570329, 175.961065, 0.872819002e-3]),
        ("TCR=1.25e-3", 1.20238213, [161.905701, 244.886773, 1e-3]),
        ("TCR=1.25e-3", 2.0, [377.23, any, any]),
        (AIR, 1.04098483, [32.787863, 44.723975, 1e-3]),
        ("TCK=2e-3", 1.0, [any, 238.952098, 1e-3]),
        ("", 2.0, [520.833333, 781.25, 2e-3]),
    ] {
        let found = static_equilibrium(&bar(layer, PORT), &[("feed".into(), volts)]).unwrap_or_else(|e| panic!("{e}"));
        let found = [found.temperatures_k[0].1, found.peak_temperatures_k[0].1, found.currents_a[0].1];
        for (found, wanted) in found.into_iter().zip(wanted).filter(|(_, wanted)| !wanted.is_nan()) {
            assert!((found / wanted - 1.0).abs() < 1e-4, "{layer}, {volts} V: {found} {wanted}");
        }
    }
}

/// The example of a hot-arm actuator in air at 4 V has the temperatures and the current of a finite-volume model with cells of 0.25 µm
/// (independent computation), to 5e-4 of the rise. The tip bends towards the cold arm.
#[test]
fn a_hot_arm_in_air() {
    let path = format!("{}/examples/hot_arm/hot_arm.net", env!("CARGO_MANIFEST_DIR"));
    let compiled = compile(&read_bundle(Path::new(&path), &[]).unwrap(), &CompileOptions::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let found = static_equilibrium(&compiled, &[("heat".into(), 4.0)]).unwrap_or_else(|e| panic!("{e}"));
    for (name, mean, peak) in WANTED {
        let of = |list: &[(String, f64)]| list.iter().find(|(beam, _)| beam == name).unwrap().1;
        let (rise, highest) = (of(&found.temperatures_k) - 293.0, of(&found.peak_temperatures_k) - 293.0);
        assert!((rise / (mean - 293.0) - 1.0).abs() < 5e-4, "{name}: {rise}");
        // the hottest point of other beams is an end, where cells have no node
        assert!(name != "hot" || (highest / (peak - 293.0) - 1.0).abs() < 2e-4, "{name}: {highest}");
    }
    assert!((found.currents_a[0].1 / CURRENT - 1.0).abs() < 1e-4, "{}", found.currents_a[0].1);
    let tip = found.nodes.iter().find(|(name, _)| name == "c").unwrap().1;
    assert!(tip.y < -0.1e-6, "{}", tip.y);
}

/// A run from cold ends at the steady rise and current, to 1e-4.
#[test]
fn a_run_ends_at_the_steady_state() {
    let compiled = bar(&format!("{AIR} specificheat=700"), PORT);
    let voltages = vec![("feed".to_owned(), 1.5)];
    let steady = static_equilibrium(&compiled, &voltages).unwrap();
    let options = TransientOptions {
        stop: 1e-3,
        signals: vec!["arm.T".into(), "feed.i".into()],
        points: 101,
        voltages,
        ..TransientOptions::default()
    };
    let run = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    let [temperature, current] = [0, 1].map(|k| &run.signals[k].2);
    assert_eq!(temperature[0], 0.0);
    assert!(temperature.windows(2).all(|w| w[1] >= w[0] * (1.0 - 1e-6)));
    assert!((temperature[100] / steady.temperatures_k[0].1 - 1.0).abs() < 1e-4, "{}", temperature[100]);
    // cold at first: V/R₀
    assert!((current[0] / 1.5e-3 - 1.0).abs() < 1e-9, "{}", current[0]);
    assert!((current[100] / steady.currents_a[0].1 - 1.0).abs() < 1e-4, "{}", current[100]);
}

/// Partials of the current and of the temperature with the voltage agree with differences to 1e-6 in a static trial and in a short step. In a
/// long one, whose sub-steps follow the voltage, they do to 1e-5, the tolerance of those. The admittance at a low frequency is the static partial.
#[test]
fn partials_of_a_circuit() {
    for (layer, more) in [
        ("TCR=1.25e-3 specificheat=700".to_owned(), PORT),
        (format!("{AIR} specificheat=700"), PORT),
        (format!("{AIR} specificheat=700"), "R * [far out] [R=500]\nfeed port * [out cold] []"),
        ("TCR=1.25e-3".to_owned(), PORT),
    ] {
        let compiled = bar(&layer, more);
        let mut device = LocalDevice::new(Arc::clone(&compiled));
        device.open(&OpenRequest { ports: Vec::new(), signals: vec!["arm.T".into()], noise: None }).unwrap();
        let mut ask = |mode, parent, dt, volts: f64| {
            let mut reply = TrialReply::default();
            device.trial(&Trial { mode, parent, t: dt, dt, voltages: &[volts] }, &mut reply).unwrap();
            assert_eq!(reply.status, Status::Ok);
            reply
        };
        let rest = ask(Mode::Static, None, 0.0, 1.0);
        for (mode, dt, within) in
            [(Mode::Static, 0.0, 1e-6), (Mode::Transient, 1e-7, 1e-6), (Mode::Transient, 5e-5, 1e-5)]
        {
            let at = ask(mode, rest.token, dt, 1.2);
            let (up, down) = (ask(mode, rest.token, dt, 1.2 + 1e-3), ask(mode, rest.token, dt, 1.2 - 1e-3));
            let current = (up.currents[0] - down.currents[0]) / 2e-3;
            assert!((at.di_dv[0] / current - 1.0).abs() < within, "{layer} {dt}: {} {current}", at.di_dv[0]);
            let rise = (up.outputs[0] - down.outputs[0]) / 2e-3;
            assert!((at.doutputs_dv[0] / rise - 1.0).abs() < within, "{layer} {dt}: {} {rise}", at.doutputs_dv[0]);
            assert_eq!(ask(mode, rest.token, dt, 1.2), at);
        }
        let at = ask(Mode::Static, None, 0.0, 1.2);
        let mut response = SmallSignal::default();
        device.linearize(at.token.unwrap(), 1e-2, &mut response).unwrap();
        let [re, im] = response.admittance[0];
        assert!((re / at.di_dv[0] - 1.0).abs() < 1e-6 && im.abs() < 1e-3 * re, "{layer}: {re} {im}");
    }
}

/// A negative TCR that takes the resistance away is one error with the beam and the fraction of 2 V that is
/// 2·√(ρ·k/|TCR|) = 1.13137 V, to 1e-3.
#[test]
fn runaway_is_one_error() {
    let compiled = bar("TCR=-2e-3", PORT);
    let error = static_equilibrium(&compiled, &[("feed".into(), 2.0)]).unwrap_err().to_string();
    assert!(error.contains("thermal runaway of `arm`") && error.contains("above 0.566"), "{error}");
    assert!(static_equilibrium(&compiled, &[("feed".into(), 1.13)]).is_ok());
}

/// A gap between two heated beams in series, whose voltage depends on their temperatures, is refused with its name.
#[test]
fn gaps_on_hot_dividers_are_refused() {
    let text = "process si = [ Youngsmodulus=160e9 density=2330 h=2u resistivity=2e-5 thermcond=32 thermalexpansion=2.7e-6 TCR=1e-3 ]
anchor si [a] []
left beam2det si [a c] [l=100u w=2u]
right beam2det si [c b] [l=100u w=2u]
anchor si [b] []
plate plategap2d si [c e] [A=1e-9 gap=2u oz=-pi/2]
anchor si [e] []
eground * [a] []
eground * [e] []
feed port * [b a] []";
    let error = compile(&Bundle::from_text("divider.net", text), &CompileOptions::default()).unwrap_err().to_string();
    assert!(error.contains("plate") && error.contains("TCR"), "{error}");
}

/// Radiation needs an absolute ambient temperature and an emissivity from 0 to 1: one error with the line. A beam in vacuum that radiates is colder than one that does not, and a heat capacity that grows
/// with temperature delays the rise without a change of its end.
#[test]
fn radiation_and_heat_capacity() {
    let refused = |layer: &str, wanted: &str| {
        let text = format!(
            "process si = [ Youngsmodulus=160e9 density=2330 h=2u resistivity=2e-5 thermcond=32 thermalexpansion=2.7e-6 {layer} ]
            anchor si [a] []
            beam2det si [a b] [l=200u w=2u]
            anchor si [b] []
            eground * [a] []"
        );
        let error = compile(&Bundle::from_text("bar.net", &text), &CompileOptions::default()).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    };
    refused("emissivity=0.5", "`ambienttemperature`");
    refused("emissivity=1.5 ambienttemperature=300", "emissivity");
    let steady = |layer: &str| {
        static_equilibrium(&bar(layer, PORT), &[("feed".into(), 2.0)]).unwrap_or_else(|e| panic!("{e}")).temperatures_k
            [0]
        .1
    };
    let [dark, bright] =
        ["", "emissivity=0.9"].map(|more| steady(&format!("TCR=1e-9 ambienttemperature=300 specificheat=700 {more}")));
    // linear in small losses: the mean of 4·σ·ε·2(w + h)·l·T³ over the parabola, against the conduction
    assert!(bright < dark * (1.0 - 1e-3) && bright > dark * (1.0 - 2e-2), "{bright} {dark}");
    let half = |layer: &str| {
        let options = TransientOptions {
            stop: 4e-3,
            signals: vec!["arm.T".into()],
            points: 401,
            voltages: vec![("feed".into(), 2.0)],
            ..TransientOptions::default()
        };
        let run =
            transient(&bar(layer, PORT), &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
        let t = &run.signals[0].2;
        (t[10], t[400])
    };
    let (early, end) = half("TCC=1e-9 specificheat=700");
    let (late, same) = half("TCC=1e-3 specificheat=700");
    assert!(late < 0.95 * early && (same / end - 1.0).abs() < 1e-3, "{early} {late} {end} {same}");
}

/// A bar in air between anchors at 320 K over a substrate at 350 K, with an ambient of 300 K, has a mean rise of 50 − 30·tanh(μ/2)/(μ/2) K without voltage, to 1e-4. Here μ² = G/K with
/// G = 20.8 µW/K and K = 0.64 µW/K (a fin, by hand). A run without voltage stays there.
#[test]
fn three_temperatures() {
    let layer = "gasconductivity=0.026 fluid=2u shapefactor=4 ambienttemperature=300 substratetemperature=350 anchortemperature=320 specificheat=700";
    let half = 0.5 * (20.8f64 / 0.64).sqrt();
    let wanted = 300.0 + 50.0 - 30.0 * half.tanh() / half;
    let compiled = bar(layer, PORT);
    let found = static_equilibrium(&compiled, &[]).unwrap_or_else(|e| panic!("{e}")).temperatures_k[0].1;
    assert!(((found - 300.0) / (wanted - 300.0) - 1.0).abs() < 1e-4, "{found} {wanted}");
    let options =
        TransientOptions { stop: 1e-4, signals: vec!["arm.T".into()], points: 11, ..TransientOptions::default() };
    let run = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert!(run.signals[0].2.iter().all(|t| (t / found - 1.0).abs() < 1e-9), "{:?}", run.signals[0].2);
}

/// Silicon's thermal expansion (1/K) (Okada and Tokumaru, J. Appl. Phys. 56, 1984), in a table each 50 K from 250 to 1300 K.
fn silicon() -> String {
    let expansion = |t: f64| 1e-6 * (3.725 * (1.0 - (-5.88e-3 * (t - 124.0)).exp()) + 5.548e-4 * t);
    let points = (0..=21).map(|k| 250.0 + 50.0 * f64::from(k)).map(|t| format!("{t}, {:e}", expansion(t)));
    format!("table({})", points.collect::<Vec<_>>().join(", "))
}

/// A bar without the constants of [`bar`], which a layer gives.
fn curved(layer: &str) -> Result<Arc<CompiledModel>, String> {
    let text = format!(
        "process si = [ Youngsmodulus=160e9 density=2330 h=2u
{layer} ]
anchor si [cold] []
arm beam2det si [cold far] [l=200u w=2u]
anchor si [far] []
eground * [cold] []
{PORT}"
    );
    compile(&Bundle::from_text("bar.net", &text), &CompileOptions::default()).map(Arc::new).map_err(|e| e.to_string())
}

const PLAIN: &str = "resistivity=2e-5 thermcond=32 thermalexpansion=2.7e-6";

/// A polynomial has the temperatures and the current of the TCR that it is to 1e-12, a table of k₀/(1 + β·T) each 20 K the highest rise of
/// Kirchhoff's transformation (238.952 K) to 1e-4.
#[test]
fn curves_stand_for_coefficients() {
    let steady = |model: &CompiledModel| {
        let found = static_equilibrium(model, &[("feed".into(), 1.0)]).unwrap_or_else(|e| panic!("{e}"));
        [found.temperatures_k[0].1, found.peak_temperatures_k[0].1, found.currents_a[0].1]
    };
    let linear = steady(&bar("TCR=1.25e-3 TCC=1e-3 specificheat=700", PORT));
    let curve =
        "resistivity=polynomial(2e-5, 2.5e-8) thermcond=32 thermalexpansion=2.7e-6 specificheat=polynomial(700, 0.7)";
    for (found, wanted) in steady(&curved(curve).unwrap()).into_iter().zip(linear) {
        assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
    }
    let points = (0..=20).map(|k| 20.0 * f64::from(k)).map(|t| format!("{t}, {:e}", 32.0 / (1.0 + 2e-3 * t)));
    let table =
        format!("resistivity=2e-5 thermcond=table({}) thermalexpansion=2.7e-6", points.collect::<Vec<_>>().join(", "));
    let found = steady(&curved(&table).unwrap());
    assert!((found[1] / 238.952098 - 1.0).abs() < 1e-4 && (found[2] / 1e-3 - 1.0).abs() < 1e-9, "{found:?}");
}

/// Expansion that depends on temperature acts by its mean along the beam. A bar between anchors at 0.5 V, with the rise 4·T·s·(1 − s) and T = 48.828125 K, is
/// pressed by E·(a·2T/3 + b/2·8T²/15), to 1e-9 of the ratio to one with the expansion a alone. A run ends there, within its tolerance.
#[test]
fn expansion_with_temperature() {
    let layer =
        |expansion: &str| format!("resistivity=2e-5 thermcond=32 specificheat=700 thermalexpansion={expansion}");
    let stress = |expansion: &str| {
        let mut device = LocalDevice::new(curved(&layer(expansion)).unwrap());
        device.open(&OpenRequest { ports: Vec::new(), signals: vec!["arm.stress".into()], noise: None }).unwrap();
        let mut reply = TrialReply::default();
        let trial = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[0.5] };
        device.trial(&trial, &mut reply).unwrap();
        reply.outputs[0]
    };
    let top = 48.828125f64;
    let (constant, grown) = (2.7e-6 * 2.0 * top / 3.0, 2e-8 * 8.0 * top * top / 15.0);
    let [alone, both] = [stress("2.7e-6"), stress("polynomial(2.7e-6, 4e-8)")];
    assert!((both / alone * constant / (constant + grown) - 1.0).abs() < 1e-9, "{alone} {both}");
    // the roots at the anchors are 2.5e-4 stiffer than a beam that begins in a point
    assert!((alone / (160e9 * constant) - 1.0).abs() < 5e-4, "{alone}");
    let options = TransientOptions {
        stop: 2e-3,
        signals: vec!["arm.stress".into()],
        points: 11,
        voltages: vec![("feed".to_owned(), 0.5)],
        ..TransientOptions::default()
    };
    let model = curved(&layer("polynomial(2.7e-6, 4e-8)")).unwrap();
    let run = transient(&model, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert!((run.signals[0].2[10] / both - 1.0).abs() < 1e-3, "{} {both}", run.signals[0].2[10]);
}

/// The electrothermal actuator of N. D. Mankame and G. K. Ananthasuresh (J. Micromech. Microeng. 11 (2001) 452, ANSYS VM223) at 15 V: the tip moves by 27 µm, of which a model
/// of beams has 24 to 27. Properties are those of VM223, its mean expansions from 300 K turned into those at each temperature. Films of gas are taken at the mean of
/// the temperatures of each beam and the air, and its radiation acts to ambient.
#[test]
fn an_actuator_in_films_of_gas() {
    let text = "process silicon = [ Youngsmodulus=169e9 Poisson=0.3 density=2330 h=20u resistivity=4.2e-4 ambienttemperature=300 emissivity=0.7
  thermalexpansion=table(300, 2.568e-6, 400, 3.725e-6, 500, 4.213e-6, 600, 4.421e-6, 700, 4.523e-6, 800, 4.594e-6, 900, 4.662e-6, 1000, 4.741e-6)
  thermcond=table(300, 146.4, 400, 98.3, 500, 73.2, 600, 57.5, 700, 49.2, 800, 41.8, 900, 37.6, 1000, 34.5) ]
anchor silicon [a] []
anchor silicon [b] []
hot  beam2det silicon [a c] [l=2185u w=40u gasconductivity=0.0529 fluid=40u shapefactor=1]
link beam2det silicon [d c] [l=222.5u w=90u oz=pi/2 gasconductivity=0.0527 fluid=90u shapefactor=1]
cold beam2det silicon [e d] [l=1855u w=255u gasconductivity=0.0554 fluid=255u shapefactor=1]
root beam2det silicon [f e] [l=107.5u w=90u oz=-pi/2 gasconductivity=0.05 fluid=90u shapefactor=1]
flex beam2det silicon [b f] [l=330u w=40u gasconductivity=0.0420 fluid=40u shapefactor=1]
tip link2d * [d t] [l=135.2u oz=-1.2315]
eground * [b] []
drive port * [a b] []
";
    let compiled = compile(&Bundle::from_text("actuator.net", text), &CompileOptions::default()).unwrap();
    let found = static_equilibrium(&compiled, &[("drive".into(), 15.0)]).unwrap_or_else(|e| panic!("{e}"));
    let tip = found.nodes.iter().find(|(name, _)| name == "t").unwrap().1;
    let moved = 1e6 * tip.x.hypot(tip.y);
    assert!((moved / 27.0 - 1.0).abs() < 0.2, "{moved} µm");
}

/// Partials of the current, of the mean temperature and of the stress with the voltage agree with differences where every property has a table, in static
/// trials and short steps to 1e-6, in long ones to 1e-5. The response at a low frequency is the static partial to 1e-6.
#[test]
fn partials_of_curves() {
    let layer = "resistivity=table(0, 2e-5, 100, 2.2e-5, 250, 2.7e-5, 600, 4e-5, 1000, 6e-5)
        thermcond=table(0, 32, 150, 27, 400, 20, 1000, 14) specificheat=table(0, 700, 200, 800, 500, 870, 1000, 900)
        thermalexpansion=table(0, 2.6e-7, 100, 3.1e-7, 300, 3.6e-7, 1000, 4.1e-7)";
    let mut device = LocalDevice::new(curved(layer).unwrap());
    let signals = vec!["arm.T".into(), "arm.stress".into()];
    device.open(&OpenRequest { ports: Vec::new(), signals, noise: None }).unwrap();
    let mut ask = |mode, parent, dt, volts: f64| {
        let mut reply = TrialReply::default();
        device.trial(&Trial { mode, parent, t: dt, dt, voltages: &[volts] }, &mut reply).unwrap();
        assert_eq!(reply.status, Status::Ok);
        reply
    };
    let rest = ask(Mode::Static, None, 0.0, 1.0);
    for (mode, dt, within) in [(Mode::Static, 0.0, 1e-6), (Mode::Transient, 1e-7, 1e-6), (Mode::Transient, 5e-5, 1e-5)]
    {
        let at = ask(mode, rest.token, dt, 1.2);
        let (up, down) = (ask(mode, rest.token, dt, 1.2 + 1e-3), ask(mode, rest.token, dt, 1.2 - 1e-3));
        let current = (up.currents[0] - down.currents[0]) / 2e-3;
        assert!((at.di_dv[0] / current - 1.0).abs() < within, "{dt}: {} {current}", at.di_dv[0]);
        for k in 0..2 {
            let change = (up.outputs[k] - down.outputs[k]) / 2e-3;
            assert!((at.doutputs_dv[k] / change - 1.0).abs() < within, "{dt} {k}: {} {change}", at.doutputs_dv[k]);
        }
    }
    let at = ask(Mode::Static, None, 0.0, 1.2);
    let mut response = SmallSignal::default();
    device.linearize(at.token.unwrap(), 1e-2, &mut response).unwrap();
    let [re, im] = response.admittance[0];
    assert!((re / at.di_dv[0] - 1.0).abs() < 1e-6 && im.abs() < 1e-3 * re, "{re} {im}");
    for k in 0..2 {
        let [re, im] = response.outputs[k];
        assert!((re / at.doutputs_dv[k] - 1.0).abs() < 1e-6 && im.abs() < 1e-3 * re.abs(), "{k}: {re} {im}");
    }
}

/// A free silicon beam of 200 µm at 1000 K is longer than at 300 K by the integral of Okada's and Tokumaru's expansion (2.6385e-3 of it, by hand), to 1e-4.
#[test]
fn silicon_expands() {
    let part = |t: f64| 1e-6 * (3.725 * (t + (-5.88e-3 * (t - 124.0)).exp() / 5.88e-3) + 2.774e-4 * t * t);
    let strain = part(1000.0) - part(300.0);
    assert!((strain / 2.6385e-3 - 1.0).abs() < 1e-4, "{strain}");
    let text = format!(
        "process si = [ Youngsmodulus=160e9 density=2330 h=2u ambienttemperature=300 thermalexpansion={} ]
anchor si [a] []
beam2d si [a b] [l=200u w=2u T=1000]",
        silicon()
    );
    let model = compile(&Bundle::from_text("silicon.net", &text), &CompileOptions::default()).unwrap();
    let tip = static_equilibrium(&model, &[]).unwrap().nodes.iter().find(|(name, _)| name == "b").unwrap().1;
    assert!((tip.x / (200e-6 * strain) - 1.0).abs() < 1e-4, "{} {}", tip.x, 200e-6 * strain);
}

/// Tables that do not increase, are negative or do not cover the ambient temperature, a given temperature or a temperature that current leads to are one error
/// each, with the property and its layer, or the beam.
#[test]
fn tables_are_checked() {
    let refused = |layer: &str, wanted: &[&str]| {
        let error = curved(layer).unwrap_err();
        assert!(wanted.iter().all(|part| error.contains(part)) && error.matches("error[").count() < 2, "{error}");
    };
    let with =
        |thermcond: &str, more: &str| format!("resistivity=2e-5 thermcond={thermcond} thermalexpansion=2.7e-6 {more}");
    refused(&with("table(0, 32, 0, 30)", ""), &["bar.net:2", "must increase"]);
    refused(&with("table(0, 32, 100, -1)", ""), &["bar.net:4", "`thermcond`", "layer `si`", "positive", "100 K"]);
    refused(&with("table(200, 32, 400, 30)", ""), &["bar.net:4", "layer `si`", "200 to 400 K", "ambient temperature"]);
    refused(&with("polynomial(-1, 2)", ""), &["bar.net:4", "`thermcond`", "positive"]);
    refused(&with("table(0, 32, 400, 30)", "TCK=1e-3"), &["`TCK`"]);
    refused(&format!("{PLAIN} specificheat=700 emissivity=table(0, 1, 1, 1)"), &["`emissivity`", "curve"]);
    let model = curved(&with("table(0, 32, 100, 30, 150, 29)", "specificheat=700")).unwrap();
    let voltages = vec![("feed".to_owned(), 2.0)];
    let error = static_equilibrium(&model, &voltages).unwrap_err().to_string();
    assert!(error.contains("`thermcond` goes from 0 to 150 K, which `arm` leaves"), "{error}");
    let mut device = LocalDevice::new(model);
    device.open(&OpenRequest { ports: Vec::new(), signals: Vec::new(), noise: None }).unwrap();
    let mut reply = TrialReply::default();
    let trial = Trial { mode: Mode::Transient, parent: None, t: 1e-3, dt: 1e-3, voltages: &[2.0] };
    device.trial(&trial, &mut reply).unwrap();
    let Status::Fail(error) = &reply.status else { panic!("{:?}", reply.status) };
    assert!(error.contains("`thermcond` goes from 0 to 150 K, and `arm` reaches"), "{error}");
}
